"""Hoardings, advertising columns, street names.

Everything faces +X. Sizes: assumed from makers' catalogues, 10 %, where no source is named.
"""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import printed_material
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, grid, lathe, rounded_box
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post
from gen_data.content.scenery.clutter_shapes import on_ground, worn_paint, worn_steel
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

BILLBOARDS = ("hoarding", "light_box", "a_board", "tall", "light_box", "hoarding", "a_board")
POSTERS, WIDE_POSTERS, STREET_NAMES = 12, 8, 12
"""Variants of the textures of posters.py that are used."""


def billboard(rng: VariantRng) -> Solid:
    """A hoarding of 3.56 x 2.52 m (18/1 sheets) on legs or a mast, a light box, an A-board.

    Slots: frame, print in front, print behind.
    """
    kind = rng.turn(BILLBOARDS, "kind")
    prints = _posters(rng.seed, "wide_poster" if kind in {"hoarding", "tall"} else "poster")
    if kind == "a_board":
        parts, hull = _a_board()
    elif kind == "light_box":
        parts, hull = _light_box(rng.between(0.0, 0.5, "foot_m"))
    else:
        parts, hull = _hoarding(
            3.2 if kind == "tall" else rng.between(0.6, 1.1, "foot_m"), kind == "tall"
        )
    frame = worn_paint(("#3b3d3f", "#8d9091", "#2f4236", "#55585a"), 0.5, rng)
    return make_solid(parts, (frame, *prints), [hull])


def _posters(seed: int, family: str) -> tuple[Material, Material]:
    count = POSTERS if family == "poster" else WIDE_POSTERS
    front, back = (
        printed_material(f"texture/{family}?seed={(seed + k) % count}", 0.35) for k in (0, 5)
    )
    return front, back


def _behind(face: Patch) -> Patch:
    """A face towards +X as one towards -X, its print upright."""
    return face.rotated("z", math.pi).painted(2)


def _hoarding(foot: float, mast: bool) -> tuple[list[Patch], np.ndarray]:
    half, high = 1.78, 2.52
    parts = [block((-0.1, -half - 0.08, foot), (0.1, half + 0.08, foot + high + 0.16), 0.01)]
    face = facing_rectangle(0.102, (-half, half), (foot + 0.08, foot + high + 0.08), 1)
    parts += [face, _behind(face)]
    if mast:
        parts += [post(0.16, (0.0, foot)), post(0.3, (0.0, 0.05))]
    else:
        legs = (-0.7 * half, 0.7 * half)
        parts += [block((-0.07, y - 0.06, 0.0), (0.05, y + 0.06, foot)) for y in legs]
    return parts, hulls.box((-0.1, -half, foot), (0.1, half, foot + high))


def _light_box(foot: float) -> tuple[list[Patch], np.ndarray]:
    half, high, low = 0.66, 1.9, 0.25 + foot
    parts = [
        rounded_box((0.16, 2 * half, high), 0.05, 1).moved(z=low + 0.5 * high),
        block((-0.06, -0.3, 0.0), (0.06, 0.3, low + 0.05)),
    ]
    face = facing_rectangle(0.082, (-half + 0.07, half - 0.07), (low + 0.07, low + high - 0.09), 1)
    parts += [face, _behind(face)]
    return parts, hulls.box((-0.08, -half, 0.0), (0.08, half, low + high))


def _a_board() -> tuple[list[Patch], np.ndarray]:
    half, high, lean = 0.32, 1.1, 0.2
    parts = []
    for k in range(2):
        board = block((-0.012, -half, 0.0), (0.012, half, high), 0.006)
        face = facing_rectangle(0.014, (-half + 0.04, half - 0.04), (0.12, high - 0.05), 1 + k)
        for part in (board, face):
            leaning = part.rotated("y", -lean).moved(high * math.sin(lean) + 0.02)
            parts.append(leaning.rotated("z", k * math.pi))
    return on_ground(parts), hulls.box((-0.24, -half, 0.0), (0.24, half, high))


def advertising_column(rng: VariantRng) -> Solid:
    """A column of 1.2 to 1.4 m for posters, with a foot and a cap. Slots: body, trim, 4 posters."""
    r, high = rng.between(0.58, 0.7, "radius_m"), rng.between(2.7, 3.3, "height_m")
    parts = [
        lathe([(0.0, 0.0), (r + 0.08, 0.0), (r + 0.08, 0.3), (r, 0.36), (r, high)], 28),
        lathe([(r, high), (r + 0.1, high + 0.05), (r + 0.1, high + 0.14), (0.4 * r, high + 0.34),
               (0.0, high + 0.4)], 28, 1),
    ]  # fmt: skip
    turn, slot = rng.between(0.0, 6.0), 0
    while turn < 12.0 - 0.2:
        wide = rng.between(0.5, 0.84) / r
        tall = wide * r * 1.41
        if turn + wide > 2.0 * math.pi + 5.6:
            break
        for low in (0.5, 0.5 + tall + 0.05):
            if low + tall < high - 0.05:
                parts.append(_pasted(r + 0.003, (turn, wide), (low, low + tall), 2 + slot % 4))
                slot += 1
        turn += wide + 0.03
    body = worn_paint(("#8d9091", "#d8d2c2", "#5f6d62", "#3f5a4a"), 0.7, rng)
    trim = worn_paint(("#2f4236", "#3b3d3f", "#2f3f5a", "#5f6d62"), 0.5, rng)
    prints = [
        printed_material(f"texture/poster?seed={(rng.seed * 5 + k) % POSTERS}", 0.6)
        for k in range(4)
    ]
    return make_solid(parts, (body, trim, *prints), [hulls.frustum((r, 0.0), (r, high), 16)])


def _pasted(radius: float, turn: tuple[float, float], z_m: tuple[float, float], slot: int) -> Patch:
    """A poster around a column, from an angle over a width [rad]."""
    at = np.linspace(turn[0], turn[0] + turn[1], 6)
    ring = np.stack([radius * np.cos(at), radius * np.sin(at)], axis=1)
    return grid(np.stack([np.insert(ring, 2, z, axis=1) for z in z_m]), slot=slot)


def street_name_plate(rng: VariantRng) -> Solid:
    """One or two name plates of a crossing on a post, 0.8-0.95 x 0.2 m. Slots: post, plates."""
    high, half = rng.between(2.5, 2.9, "height_m"), 0.5 * rng.between(0.76, 0.94, "width_m")
    profile = [(0.034, high), (0.03, high + 0.03), (0.0, high + 0.04)]
    parts = [post(0.03, (0.0, high)), lathe(profile, 8)]
    for k in range(rng.choose((1, 2, 2))):
        z = high - 0.24 * (k + 1)
        board = block((-0.006, -half, z), (0.006, half, z + 0.2), 0.004)
        face = facing_rectangle(
            0.0075, (-half + 0.005, half - 0.005), (z + 0.003, z + 0.197), 1 + k
        )
        back = face.rotated("z", math.pi)
        for part in (board, face, back):
            # Crosswise.
            parts.append(part.rotated("z", 0.5 * math.pi * k))
    names = [
        printed_material(f"texture/street_name?seed={(rng.seed + k) % STREET_NAMES}", 0.35)
        for k in (0, 5)
    ]
    materials = (worn_steel(rng), *names)
    return make_solid(parts, materials, [hulls.frustum((0.03, 0.0), (0.03, high), 8)])
