"""Ramps for wheelchairs before doors."""

from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.material_presets import painted_material
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import extrude
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.scenery.clutter_shapes import bar, rod
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.content.scenery.terraces import STONES
from gen_data.core.asset_types import Material

_CURB_M, _CURB_HIGH_M = 0.06, 0.1
"""Edges that wheels cannot cross: 10 cm high (DIN 18040-1:2010, 4.3.8.3); width assumed."""
_RAIL_M, _RAIL_RADIUS_M = 0.88, 0.02
"""Handrails: 85 to 90 cm high, 3 to 4.5 cm thick (DIN 18040-1:2010, 4.3.8.3)."""
_BEYOND_M = 0.3
"""Handrails go on level at both ends (2010 ADA Standards, 505.10.1: 305 mm)."""
_POST_M, _INSET_M = 1.5, 0.1
"""Distance between posts, and of the first one from an end."""
_WIDTH_M, _GRADE_MAX, _HEIGHT_M = (1.0, 3.0), 0.13, 3.0
_USUAL_M = (0.0, 0.41, 6.0, 0.05)
"""One run of the largest gradient and length (DIN 18040-1)."""
_METALS = (GALVANISED, painted_material("#3b3d3f", 0.45))

Point = tuple[float, float]


def door_ramp(seed: int, tops_m: tuple[float, ...], width_m: float) -> Solid:
    """A straight ramp along +X with curbs and handrails on both sides, solid down to the ground.

    The origin is on the ground below its upper end. Slots: stone, metal.

    Args:
        seed: Seed of stone and metal, which cycle through a few kinds each.
        tops_m: Distance from the upper end and height, in turn, at each change of gradient; of any
            number of runs and rests. Without numbers, one run of 6 m.
        width_m: With the curbs.

    Raises:
        ValueError: ``tops_m`` is not a way down of two or more places from 0 m, above the ground
            and at most 3 m high, with at most 13 %, or the width is not from 1 to 3 m.
    """
    tops_m = tops_m or _USUAL_M
    tops = list(zip(tops_m[::2], tops_m[1::2], strict=False))
    if len(tops_m) % 2 or not _leads_down(tops) or not _WIDTH_M[0] <= width_m <= _WIDTH_M[1]:
        raise ValueError(
            f"tops_m is {tops_m}, width_m {width_m:g}; expected distances from 0 and heights from "
            "3 m down to more than 0, in turn, with gradients of at most 0.13, and 1 to 3"
        )
    half = 0.5 * width_m
    patches = [_prism(a, b, (_CURB_M - half, half - _CURB_M)) for a, b in pairwise(tops)]
    raised = [(x, z + _CURB_HIGH_M) for x, z in tops]
    for edge in ((-half, _CURB_M - half), (half - _CURB_M, half)):
        patches += [_prism(a, b, edge) for a, b in pairwise(raised)]
        patches += _handrail(raised, 0.5 * (edge[0] + edge[1]))
    stone = Material(STONES[seed % len(STONES)], 0.9)
    parts = [_hull(a, b, half) for a, b in pairwise(tops)]
    return make_solid(patches, (stone, _METALS[seed % 2]), parts)


def _leads_down(tops: list[Point]) -> bool:
    steps = [(x1 - x0, z0 - z1) for (x0, z0), (x1, z1) in pairwise(tops)]
    return (
        bool(steps)
        and tops[0][0] == 0.0
        and tops[0][1] <= _HEIGHT_M
        and tops[-1][1] > 0.0
        and all(along > 0.0 and 0.0 <= fall <= _GRADE_MAX * along for along, fall in steps)
    )


def _prism(start: Point, end: Point, across_m: Point) -> Patch:
    """A block below a sloping top, down to the ground."""
    (x0, z0), (x1, z1), (right, left) = start, end, across_m
    outline = np.array([(x0, 0.0), (x1, 0.0), (x1, z1), (x0, z0)])
    return extrude(outline, left - right).rotated("x", 0.5 * np.pi).moved(y=left)


def _hull(start: Point, end: Point, half_m: float) -> Array:
    (x0, z0), (x1, z1) = start, end
    corners = [
        (x, y, z) for x, top in ((x0, z0), (x1, z1)) for y in (-half_m, half_m) for z in (0.0, top)
    ]
    return np.round(corners, 6)


def _handrail(curb: list[Point], y_m: float) -> list[Patch]:
    """A rail above a curb, and posts on it; slot 1."""
    over = _RAIL_M - _CURB_HIGH_M
    first, last = curb[0], curb[-1]
    line = [(first[0] - _BEYOND_M, first[1]), *curb, (last[0] + _BEYOND_M, last[1])]
    rail = rod([(x, y_m, z + over) for x, z in line], _RAIL_RADIUS_M, 8, 1)
    room = last[0] - 2.0 * _INSET_M
    stations = _INSET_M + np.linspace(0.0, room, 2 + int(room / _POST_M))
    feet = np.interp(stations, [x for x, _ in curb], [z for _, z in curb])
    return [rail] + [
        bar((x, y_m, z), (x, y_m, z + over), 0.018, 6, 1)
        for x, z in zip(stations.tolist(), feet.tolist(), strict=True)
    ]
