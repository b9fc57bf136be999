"""The surface of a car park: asphalt, and the lines of its bays."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.roads import deck, markings, road_materials
from gen_data.roads.parking_shape import EDGE_M, ParkingShape

_APRON_M, _APRON_Z_M = 4.0, -0.12
_STEP_M, _SLAB_STEPS = 1.0, 4
"""Length of the pieces of bent surfaces, and pieces per collision part."""


def parking_area(**parameters: Any) -> Solid:
    """A level car park around the origin; slots as in ``street_materials``.

    Args:
        parameters: Fields of ``StreetLook`` and of ``ParkingShape``. Sidewalks have no area here;
            their slots exist because all streets share one set.
    """
    look, shape = road_materials.split_look(parameters)
    profile = ParkingShape(**{**shape, **_round_counts(shape)})
    slots = road_materials.number_slots(look)
    x, y = 0.5 * profile.length_m + EDGE_M, 0.5 * profile.width_m + EDGE_M
    along = np.linspace(
        -x, x, 2 if profile.curvature_per_m == 0.0 else 1 + round(2.0 * x / _STEP_M)
    )
    across = np.array([-y, y])
    patches = [_area(profile, along, across, 0.0, "asphalt", slots["asphalt"])]
    patches.append(_skirt(profile, along, y, slots["ground"]))
    if look.carriageway not in road_materials.UNPAVED:
        patches += [
            _area(profile, *line, deck.PAINT_LIFT_M, "marking", slots["marking"])
            for line in _lines(profile, along)
        ]
    every = along if len(along) == 2 else [*along[:-1:_SLAB_STEPS].tolist(), x]
    slabs = [_slab(profile, span, across) for span in pairwise(every)]
    return road_materials.make_street_solid(patches, look, slabs)


def _round_counts(shape: dict[str, Any]) -> dict[str, int]:
    return {name: round(shape[name]) for name in ("bays", "aisles") if name in shape}


def _lines(shape: ParkingShape, along: Array) -> Iterator[tuple[Array, Array]]:
    """Places of paint along and across: one line between bays, one where two rows meet."""
    half = 0.5 * markings.NARROW_M
    for _, near, far in shape.rows():
        across = np.array(sorted((near, far)))
        # As wide at both ends, which bends stretch by different amounts.
        wide = half / np.array([shape.stretch(y) for y in across])
        for x in shape.row_x_m(near, far):
            yield np.stack([x - wide, x + wide]), across
    reach = 0.5 * shape.length_m + half
    for number in range(1, shape.aisles):
        seam = shape.aisle_y_m(number) - 0.5 * shape.module_m
        inner = along[(along > -reach) & (along < reach)]
        yield np.array([-reach, *inner, reach]), np.array([seam - half, seam + half])


def _area(
    shape: ParkingShape, along: Array, across: Array, z_m: float, name: str, slot: int
) -> Patch:
    """A part of the ground between places along [n] or [n, 2], and across [2]."""
    x, y = np.broadcast_arrays(along if along.ndim == 2 else along[:, None], across)
    points = np.concatenate([shape.plan(x, y), np.full((*x.shape, 1), z_m)], axis=2)
    return deck.surface(points, np.stack([x, y], axis=2), name, slot)


def _skirt(shape: ParkingShape, along: Array, y: float, slot: int) -> Patch:
    """Land that slopes away on all four sides."""
    back = along[::-1]
    x = np.concatenate([along, back, along[:1]])
    side = np.concatenate([np.full(len(along), -y), np.full(len(back), y), [-y]])
    # Corners lie farther out on both axes, other places on theirs.
    end = np.isin(x, (along[0], along[-1]))
    outer = shape.plan(
        x + np.where(end, np.sign(x) * _APRON_M, 0.0), side + np.sign(side) * _APRON_M
    )
    inner = shape.plan(x, side)
    points = np.stack(
        [np.insert(outer, 2, _APRON_Z_M, axis=1), np.insert(inner, 2, 0.0, axis=1)], 1
    )
    return deck.surface(points, points[..., :2], "ground", slot)


def _slab(shape: ParkingShape, span: tuple[float, float], across: Array) -> Array:
    """A convex part of the ground below the surface, between two places along."""
    corners = shape.plan(np.repeat(span, 2), np.tile(across, 2))
    return np.round([(x, y, z) for x, y in corners.tolist() for z in (-0.3, 0.0)], 6)
