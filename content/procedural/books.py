"""Books, lying flat with the front cover up; the spine is at -Y and the title reads from +X."""

from collections.abc import Mapping, Sequence

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets, wear
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.content.procedural.surface_shapes import Point2, UvRect, grid, rounded_box
from gen_data.core import asset_types, se3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

COVER_ATLAS: Mapping[str, UvRect] = {
    "back": (0.002, 0.002, 0.438, 0.998), "spine": (0.442, 0.002, 0.558, 0.998),
    "front": (0.562, 0.002, 0.998, 0.998),
}  # fmt: skip
_FORMATS = ((0.178, 0.11), (0.198, 0.129), (0.21, 0.148), (0.234, 0.156), (0.19, 0.19),
            (0.297, 0.21))  # fmt: skip


def book_size_m(seed: int) -> tuple[float, float, float]:
    """Length along the spine, width and thickness."""
    rng = variant_rng("book/size", seed)
    length, width = in_turn(_FORMATS, seed)
    scale = rng.between(0.97, 1.03, "scale")
    return (length * scale, width * scale, rng.between(0.012, 0.042))


def book(rng: VariantRng) -> Solid:
    """A paperback or hardcover. Slots: cover, pages."""
    length, width, thickness = book_size_m(rng.seed)
    hard = rng.chance(0.5, "hard")
    board = 0.0028 if hard else 0.0006
    margin = 0.003 if hard else 0.0
    bow = min(0.004, 0.3 * thickness) if hard else 0.0006
    cover = _cover((length, width, thickness), board, bow)
    inside = margin + board + bow
    block = rounded_box((length - 2 * margin, width - inside, thickness - 2 * board), 0.0003, 1)
    pages = block.painted(1).moved(y=0.5 * (board + bow - margin))
    color = material_presets.jitter_color(material_presets.hex_to_linear("#e9e2cf"), 0.05, rng)
    paper = asset_types.Material(color, 0.85)
    rough = wear.dulled(rng.between(0.25, 0.6), wear.draw_wear("book_cover", rng.seed))
    print_ = material_presets.printed_material(f"texture/book_cover?seed={rng.seed}", rough)
    half = (0.5 * length, 0.5 * width, 0.5 * thickness)
    low = (-half[0], -half[1], -half[2])
    return make_centred_solid([cover, pages], (print_, paper), [hulls.box(low, half)])


def _cover(size_m: se3.Vec3, board: float, bow: float) -> Patch:
    """A folded sheet: back, rounded spine, front, as one closed band around X."""
    length, width, thickness = size_m
    h = 0.5 * thickness
    y0, y1 = -0.5 * width, 0.5 * width
    spine = [(y0 + bow * t**2, -h * t) for t in (0.9, 0.5, 0.0, -0.5, -0.9)]
    outer = [(y1, -h), (y0 + bow, -h), *spine, (y0 + bow, h), (y1, h)]
    inner = [(y1, h - board), (y0 + bow + board, h - board),
             *((y + board, z * (1 - board / h)) for y, z in spine[::-1]),
             (y0 + bow + board, board - h), (y1, board - h)]  # fmt: skip
    back, side, front = (COVER_ATLAS[name] for name in ("back", "spine", "front"))
    arc = np.array(outer[1:8])
    steps = np.sqrt((np.diff(arc, axis=0) ** 2).sum(axis=1))
    turn = side[0] + (side[2] - side[0]) * np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    # Walking from the back's free edge around the spine to the front's: u runs the same way.
    us = (np.array([back[0], back[2]]), turn, np.array([front[0], front[2]]))
    spans = (outer[0:2], outer[1:8], outer[7:9])
    patches = [_band(span, length, u) for span, u in zip(spans, us, strict=True)]
    rest = [*inner, outer[0]]
    patches.append(_band([outer[-1], *rest], length, np.full(len(rest) + 1, side[0])))
    return join_patches([*patches, *_rims(outer, inner, length)])


def _band(points: Sequence[Point2], length: float, u: Array) -> Patch:
    """A polyline in the plane of Y and Z drawn out along X; images point up towards -X."""
    rows = [[(x, y, z) for y, z in points] for x in (0.5 * length, -0.5 * length)]
    return grid(np.array(rows), u, np.array([0.002, 0.998]))


def _rims(outer: Sequence[Point2], inner: Sequence[Point2], length: float) -> list[Patch]:
    """The cut edges at both ends of the sheet."""
    made = []
    for x in (-0.5 * length, 0.5 * length):
        rows = np.array([[(x, y, z) for y, z in line] for line in (outer, inner[::-1])])
        strip = grid(rows, np.full(len(outer), COVER_ATLAS["spine"][0]), np.array([0.01, 0.02]))
        made.append(strip.flipped() if x > 0 else strip)
    return made
