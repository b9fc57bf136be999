"""Bridges over a road: decks with railings, and the embankments at their ends.

Clearance 4.5 m and 0.2 m of reserve, parapets of 1.0 m: usual in Germany (assumed from RAL and
ZTV-ING); other sizes are assumed, 20 %.
"""

from collections.abc import Iterator

import numpy as np

from gen_data.assets.family import Facts, Solid, check_option
from gen_data.content.procedural import material_presets, patches
from gen_data.content.procedural.surface_shapes import block, cone, grid, sweep
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import variant_rng

KINDS = ("concrete", "steel")
DEPTHS_M = {"concrete": 1.1, "steel": 1.7}
SLOPE = 1.5
"""Run over rise of the sides of embankments (1:1.5, usual for fills)."""
_PARAPET_M, _POST_M = 1.0, 2.5
_CONCRETE, _STEEL, _ASPHALT, _GRASS = range(4)


def overpass(
    seed: int, span_m: float, width_m: float, clearance_m: float, pier: float, kind: str
) -> Solid:
    """A bridge along Y over a road along X, about the origin on that road.

    Slots: concrete, steel, asphalt.

    Args:
        seed: Seed of colours.
        span_m: Distance between its abutments.
        width_m: Width of the deck.
        clearance_m: Height of its underside.
        pier: Whether pillars stand below its middle.
        kind: A word of ``KINDS``.

    Raises:
        AssetError: the kind is unknown.
    """
    check_option("overpass", "kind", kind, KINDS)
    half, side, low = 0.5 * span_m + 0.6, 0.5 * width_m, clearance_m
    top = low + DEPTHS_M[kind]
    way_m = ((-side, -half, top - 0.02), (side, half, top + 0.02))
    parts = [_slab(half, side, low, top), block(*way_m, 0.0, _ASPHALT)]
    if kind == "steel":
        parts = [block((-side, -half, top - 0.35), (side, half, top), 0.0, _CONCRETE), parts[1]]
        for x in (-side + 0.2, side - 0.2):
            parts.append(block((x - 0.2, -half, low), (x + 0.2, half, top + 0.25), 0.0, _STEEL))
            parts += [
                block((x - 0.26, y - 0.02, low + 0.1), (x + 0.26, y + 0.02, top + 0.1), 0, _STEEL)
                for y in np.arange(-half + 1.0, half, 2.0).tolist()
            ]
    for way in (-1.0, 1.0):
        parts += _railing(way * (side - 0.15), half, top)
    if pier > 0.0:
        parts.append(block((-side + 0.6, -0.6, low - 0.6), (side - 0.6, 0.6, low), 0.0, _CONCRETE))
        for x in np.linspace(-side + 1.2, side - 1.2, 3).tolist():
            parts.append(cone((0.4, 0.0), (0.4, low - 0.5), 12, _CONCRETE).moved(x=x))
    hull = np.array([[x, y, z] for x in (-side, side) for y in (-half, half) for z in (low, top)])
    return make_solid(parts, _materials(seed), [hull])


def _slab(half_m: float, side_m: float, low_m: float, top_m: float) -> patches.Patch:
    """A slab with cantilevered edges, drawn along Y."""
    z, edge = top_m - low_m, 0.28
    section = np.array([(z, side_m), (z - edge, side_m), (z - edge - 0.12, 0.62 * side_m),
                        (0.0, 0.5 * side_m), (0.0, -0.5 * side_m),
                        (z - edge - 0.12, -0.62 * side_m), (z - edge, -side_m),
                        (z, -side_m)])  # fmt: skip
    path = np.array([(0.0, half_m, low_m), (0.0, -half_m, low_m)])
    return sweep(path, section, up=(0.0, 0.0, 1.0), capped=False, slot=_CONCRETE)


def _railing(x_m: float, half_m: float, top_m: float) -> Iterator[patches.Patch]:
    """A kerb with a railing of posts and three rails."""
    yield block(
        (x_m - 0.15, -half_m, top_m - 0.05), (x_m + 0.15, half_m, top_m + 0.2), 0, _CONCRETE
    )
    for z in (0.45, 0.72, 0.98):
        yield block((x_m - 0.03, -half_m, top_m + z), (x_m + 0.03, half_m, top_m + z + 0.05), 0,
                    _STEEL)  # fmt: skip
    for y in np.arange(-half_m + 0.5, half_m, _POST_M).tolist():
        post = ((x_m - 0.04, y - 0.04, top_m + 0.2), (x_m + 0.04, y + 0.04, top_m + _PARAPET_M))
        yield block(*post, 0.0, _STEEL)


def overpass_facts(seed: int, kind: str, **_: float) -> Facts:
    """Its kind."""
    del seed
    return Facts("overpass", {"kind": kind})


def embankment(seed: int, length_m: float, width_m: float, height_m: float) -> Solid:
    """The end of a bridge and the fill behind it, along +X from the abutment's face at x = 0.

    Slots: concrete, steel, asphalt, grass.

    Args:
        seed: Seed of colours.
        length_m: Length of the fill's top; beyond it the fill slopes down.
        width_m: Width of the road on it.
        height_m: Height of that road.
    """
    half, run = 0.5 * width_m, SLOPE * height_m
    # The face is vertical; wings close the fill on both sides.
    top = np.array([(0.0, -half), (0.0, half), (length_m, half), (length_m, -half)])
    foot = np.array([(0.0, -half - run), (0.0, half + run), (length_m + run, half + run),
                     (length_m + run, -half - run)])  # fmt: skip
    parts = [
        block((-0.6, -half, 0.0), (0.5, half, height_m - 0.9), 0.0, _CONCRETE),
        _plane(
            [(length_m, -half), (length_m, half), (0.0, -half), (0.0, half)], height_m, _ASPHALT
        ),
    ]
    for k in (1, 2, 3):
        a, b = k, (k + 1) % 4
        corners = [(*foot[a], 0.0), (*foot[b], 0.0), (*top[a], height_m), (*top[b], height_m)]
        parts.append(_facet(corners, _GRASS))
    wing = [(*foot[0], 0.0), (*foot[1], 0.0), (*top[0], height_m), (*top[1], height_m)]
    parts.append(_facet(wing, _CONCRETE).flipped())
    for way in (-1.0, 1.0):
        y = way * (half - 0.15)
        parts.append(block((0.0, y - 0.15, height_m - 0.05), (4.0, y + 0.15, height_m + 0.2), 0, 0))
        rail = (height_m + 0.44, height_m + 0.75)
        parts.append(block((0.0, y - 0.05, rail[0]), (length_m, y + 0.05, rail[1]), 0, _STEEL))
    x0, x1, y1 = -0.6, length_m + run, half + run
    hull = np.array([[x, y, z] for x in (x0, x1) for y in (-y1, y1) for z in (0.0, 0.1)])
    hull = np.concatenate([hull, np.column_stack([top, np.full(4, height_m)])])
    return make_solid(parts, _materials(seed), [hull])


def _plane(corners: list[tuple[float, float]], z_m: float, slot: int) -> patches.Patch:
    points = np.array([[(*corners[0], z_m), (*corners[1], z_m)],
                       [(*corners[2], z_m), (*corners[3], z_m)]])  # fmt: skip
    return _textured(points, slot)


def _facet(corners: list[tuple[float, ...]], slot: int) -> patches.Patch:
    """A quad of a lower and an upper edge, seen from outside."""
    a, b, c, d = corners
    return _textured(np.array([[b, a], [d, c]]), slot)


def _textured(points: patches.Array, slot: int) -> patches.Patch:
    """A quad whose texture repeats every few metres along its own edges."""
    wide = np.sqrt(((points[0, 1] - points[0, 0]) ** 2).sum())
    high = np.sqrt(((points[1, 0] - points[0, 0]) ** 2).sum())
    uv = np.array([[(0.0, 0.0), (wide, 0.0)], [(0.0, high), (wide, high)]]) / 5.0
    return grid(points, uv[0, :, 0], uv[:, 0, 1], slot)


def _materials(seed: int) -> tuple[Material, ...]:
    rng = variant_rng("overpass", seed)
    tone = rng.between(0.75, 1.0)
    concrete = Material(
        (tone, tone, 0.97 * tone), roughness=0.9, texture="texture/concrete?seed=2", role="facade"
    )
    colors = ("#4e6b5a", "#5d6a73", "#6d4b3c", "#3f5a73", "#8d9091")
    steel = Material(material_presets.draw_linear(colors, 0.05, rng), roughness=0.5)
    asphalt = Material(roughness=0.92, texture="texture/asphalt?seed=1", texture_scale_m=6.0)
    grass = Material(roughness=0.95, texture=f"texture/grass?seed={seed % 4}", role="grass")
    return (concrete, steel, asphalt, grass)
