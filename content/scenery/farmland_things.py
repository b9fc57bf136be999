"""Objects in fields: bales of straw and pylons of power lines.

Frame: metres, Z up, front +X, origin on the ground.
"""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import patches, surface_shapes
from gen_data.content.procedural.material_presets import painted_material, patterned_material
from gen_data.content.scenery import basic_shapes, clutter_shapes, street_furniture
from gen_data.core import errors, se3
from gen_data.core.variant_rng import VariantRng, variant_rng

BALES = ("round", "round", "wrapped", "square", "stack", "wrapped")
PYLONS = ("danube", "single", "barrel", "danube")
SPAN_MAX_M = 450.0
_ARMS: dict[str, tuple[tuple[float, float], ...]] = {
    "danube": ((0.72, 7.5), (0.88, 4.6)),
    "single": ((0.82, 8.5),),
    "barrel": ((0.66, 5.0), (0.78, 6.8), (0.9, 4.4)),
}
"""Cross-arms from below: height as a share of the pylon's, half length [m] (110 kV, assumed)."""
_SAG = 0.03
"""Sag of the conductors as a share of the span: 0.02 to 0.04 at high voltage (assumed)."""
_BUNDLE_M = 0.03
"""Radius that a conductor is drawn with: 0.011 m is the usual one (assumed); thin
ones would break up into dots far away."""


def straw_bale(rng: VariantRng) -> Solid:
    """A bale of straw or of silage in film; round ones are 1.2 to 1.5 m wide (assumed).

    Slots: straw or film, ends or cords.
    """
    kind = rng.turn(BALES, "kind")
    if kind in ("round", "wrapped"):
        radius, half = 0.5 * rng.between(1.2, 1.5), 0.5 * rng.between(1.15, 1.25, "width_m")
        edge = 0.12 if kind == "wrapped" else 0.04
        profile = [(0.0, -half), (radius - edge, -half), (radius, edge - half),
                   (radius, half - edge), (radius - edge, half), (0.0, half)]  # fmt: skip
        barrel = surface_shapes.lathe(profile, 20).rotated("x", 0.5 * math.pi).moved(z=radius)
        # It sinks in a little where it lies.
        corners = barrel.corners_m.copy()
        corners[..., 2] = np.maximum(corners[..., 2], 0.02)
        parts = [patches.Patch(corners, barrel.uvs, barrel.slots).moved(z=-0.02)]
        hull = [hulls.box((-radius, -half, 0.0), (radius, half, 2.0 * radius - 0.02))]
    else:
        rows = (3, 2) if kind == "stack" else (1,)
        parts, hull = [], []
        for level, count in enumerate(rows):
            for k in range(count):
                y, z = (k - 0.5 * (count - 1)) * 1.22 + rng.between(-0.04, 0.04), 0.9 * level
                body = surface_shapes.rounded_box((2.3, 1.18, 0.9), 0.05, 1).rotated(
                    "z", rng.between(-0.02, 0.02)
                )
                parts.append(body.moved(rng.between(-0.06, 0.06), y, z + 0.45))
                hull.append(hulls.box((-1.15, y - 0.59, z), (1.15, y + 0.59, z + 0.9)))
                parts += [
                    surface_shapes.block(
                        (x - 0.01, y - 0.595, z + 0.005), (x + 0.01, y + 0.595, z + 0.905), 0.0, 1
                    )
                    for x in np.linspace(-0.9, 0.9, 5).tolist()
                ]
    straw = patterned_material("texture/crop?kind=stubble&seed=1", 1.5, 0.95, (0.85, 0.8, 0.7))
    film = painted_material(rng.choose(("#dfe3df", "#aeb9a6", "#23262a", "#dfe3df")), 0.3)
    materials = (film if kind == "wrapped" else straw, painted_material("#8d7d52", 0.9))
    return basic_shapes.make_solid(parts, materials, hull)


def power_pylon(seed: int, span_m: float) -> Solid:
    """A lattice pylon of a 110 kV line, with the halves of the two spans that meet at it.

    Conductors run along X; pylons of one seed, ``span_m`` apart, join. The body without conductors
    has separate bounds. Slots: steel, concrete, insulators, conductors.

    Args:
        seed: Seed of the variant.
        span_m: Distance between pylons, 0 = without conductors.

    Raises:
        AssetError: if the span is not between 0 and 450 m.
    """
    if not 0.0 <= span_m <= SPAN_MAX_M:
        raise errors.AssetError(f"power_pylon: span_m={span_m} is not between 0 and {SPAN_MAX_M:g}")
    rng = variant_rng("power_pylon", seed)
    kind = rng.turn(PYLONS, "kind")
    high, foot = rng.between(26.0, 34.0, "height_m"), rng.between(2.2, 3.0, "foot_m")
    widths = _widths(high, foot)
    parts = list(_mast(widths))
    for x in (-foot, foot):
        for y in (-foot, foot):
            part = surface_shapes.block((x - 0.4, y - 0.4, 0.0), (x + 0.4, y + 0.4, 0.35), 0.0, 1)
            parts.append(part)
    grips: list[se3.Vec3] = []
    for share, reach in _ARMS[kind]:
        z, half = share * high, float(np.interp(share * high, widths[:, 0], widths[:, 1]))
        for side in (-1.0, 1.0):
            tip = (0.0, side * reach, z)
            for x in (-half, half):
                parts.append(clutter_shapes.wire((x, side * half, z), tip, 0.06))
                parts.append(clutter_shapes.wire((x, side * half, z + 1.6), tip, 0.06))
            places = (0.55, 1.0) if reach > 6.0 else (1.0,)
            for place in places:
                y = side * reach * place
                parts.append(clutter_shapes.wire((0.0, y, z), (0.0, y, z - 1.6), 0.08, 2))
                grips.append((0.0, y, z - 1.6))
    grips.append((0.0, 0.0, high))
    cables = list(_half_spans(grips, span_m)) if span_m else []
    materials = (
        street_furniture.GALVANISED,
        patterned_material("texture/concrete?seed=3", 2.0, 0.9),
        painted_material(rng.choose(("#5a3d30", "#7d8684")), 0.3),
        painted_material("#55585a", 0.5),
    )
    hull = hulls.frustum((foot, 0.0), (0.5, high), 4)
    return basic_shapes.make_solid([*parts, *cables], materials, [hull], body=parts)


def _widths(high_m: float, foot_m: float) -> patches.Array:
    """Heights and half widths of the panels, rows (z, half), from the ground to the peak."""
    waist = 0.6 * high_m
    lower = np.linspace(0.3, waist, 6)
    upper = np.linspace(waist, high_m - 1.5, 6)[1:]
    half = np.concatenate([np.interp(lower, [0.3, waist], [foot_m, 0.75]), np.full(5, 0.6)])
    return np.column_stack([np.concatenate([lower, upper]), half])


def _mast(widths: patches.Array) -> Iterator[patches.Patch]:
    """Four legs of angle steel with crossed bars on every side, and a peak."""
    for (z0, h0), (z1, h1) in pairwise(widths.tolist()):
        corners = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
        for k, (a, b) in enumerate(corners):
            c, d = corners[(k + 1) % 4]
            yield clutter_shapes.wire((a * h0, b * h0, z0), (a * h1, b * h1, z1), 0.09)
            yield clutter_shapes.wire((a * h0, b * h0, z0), (c * h1, d * h1, z1), 0.045)
            yield clutter_shapes.wire((c * h0, d * h0, z0), (a * h1, b * h1, z1), 0.045)
            yield clutter_shapes.wire((a * h1, b * h1, z1), (c * h1, d * h1, z1), 0.045)
    z, half = widths[-1].tolist()
    yield surface_shapes.cone((1.2 * half, z), (0.04, z + 1.5), 4)


def _half_spans(grips: list[se3.Vec3], span_m: float) -> Iterator[patches.Patch]:
    """Conductors along X from the pylon to the middle of the span on both sides, as parabolas."""
    t = np.linspace(0.0, 1.0, 7)
    for _, y, z in grips:
        for side in (-1.0, 1.0):
            fall = _SAG * span_m * (1.0 - (1.0 - t) ** 2)
            path = np.column_stack([side * 0.5 * span_m * t, np.full(7, y), z - fall])
            section = surface_shapes.circle(_BUNDLE_M, 3)
            yield surface_shapes.sweep(path, section, up=(0.0, 1.0, 0.0), capped=False, slot=3)
