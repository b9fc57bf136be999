"""The surface of a car park: asphalt, and the lines of its bays."""

from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.patches import Patch
from gen_data.content.roads import deck, markings, road_materials
from gen_data.core.se3 import Vec3
from gen_data.roads.parking_shape import EDGE_M, ParkingShape

_APRON_M, _APRON_Z_M = 4.0, -0.12


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
    patches = [_rectangle((-x, -y), (x, y), 0.0, "asphalt", slots["asphalt"])]
    patches.append(_skirt(x, y, slots["ground"]))
    for low, high in _lines(profile) if look.carriageway not in road_materials.UNPAVED else ():
        patches.append(_rectangle(low, high, deck.PAINT_LIFT_M, "marking", slots["marking"]))
    slab = hulls.box((-x, -y, -0.3), (x, y, 0.0))
    return road_materials.make_street_solid(patches, look, [slab])


def _round_counts(shape: dict[str, Any]) -> dict[str, int]:
    return {name: round(shape[name]) for name in ("bays", "aisles") if name in shape}


Point = tuple[float, float]


def _lines(shape: ParkingShape) -> list[tuple[Point, Point]]:
    """Rectangles of paint: one line between bays, one where two rows meet."""
    half, made = 0.5 * markings.NARROW_M, []
    for number in range(shape.aisles):
        y = shape.aisle_y_m(number)
        for side in (1.0, -1.0):
            near = y + side * 0.5 * shape.aisle_m
            low, high = sorted((near, near + side * shape.bay_m[1]))
            for bay in range(shape.bays + 1):
                x = bay * shape.bay_m[0] - 0.5 * shape.length_m
                made.append(((x - half, low), (x + half, high)))
        if number > 0:
            seam = y - 0.5 * shape.module_m
            reach = 0.5 * shape.length_m + half
            made.append(((-reach, seam - half), (reach, seam + half)))
    return made


def _rectangle(low: Point, high: Point, z_m: float, name: str, slot: int) -> Patch:
    x, y = np.meshgrid([low[0], high[0]], [low[1], high[1]], indexing="ij")
    plan = np.stack([x, y], axis=2)
    return deck.surface(np.stack([x, y, np.full_like(x, z_m)], axis=2), plan, name, slot)


def _skirt(x: float, y: float, slot: int) -> Patch:
    """Land that slopes away on all four sides."""
    ring: list[Vec3] = [(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0), (-x, -y, 0.0)]
    inner = np.array(ring)
    outer = inner + np.sign(inner) * np.array([_APRON_M, _APRON_M, 0.0])
    outer[:, 2] = _APRON_Z_M
    points = np.stack([outer, inner], axis=1)
    return deck.surface(points, points[..., :2], "ground", slot)
