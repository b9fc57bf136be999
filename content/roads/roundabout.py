"""The surface of a roundabout: ring, truck apron, planted island, splitter islands, sidewalks."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import triangulate
from gen_data.content.roads import road_materials
from gen_data.content.roads.deck import PAINT_LIFT_M, surface
from gen_data.content.roads.junction import arm_paint, corner_patches
from gen_data.roads import cross_section
from gen_data.roads.junction_shape import arm_points, corner
from gen_data.roads.roundabout_shape import RoundaboutShape

_RINGS = 8
_MOUND_M = 0.7
_YIELD_M, _YIELD_GAP_M = (0.5, 0.5), 0.25
"""Blocks of a give-way line: width and length, and the gaps between them (RMS-1: 0.50, 0.25 m)."""


def roundabout(*, crossings: str = "zebra", **others: Any) -> Solid:
    """A roundabout about the origin; slots as in ``street_materials``.

    Args:
        crossings: Style of the crosswalks: ``zebra``, ``ladder``, ``lines`` or ``none``.
        others: Fields of ``StreetLook`` and of ``RoundaboutShape``.
    """
    look, fields = road_materials.split_look(others)
    shape = RoundaboutShape(**fields)
    slots = road_materials.number_slots(look)
    paved = look.carriageway not in road_materials.UNPAVED
    patches = [*_ring(shape, slots), *_island(shape, slots)]
    for number in range(len(shape.arms_rad())):
        if shape.sidewalk_m > 0.0:
            patches += corner_patches(shape, number, slots)
        patches.append(_land(shape, number, slots["ground"]))
        if shape.splitter > 0.0:
            patches += _splitter(shape, number, slots)
        if paved:
            patches += arm_paint(shape, number, crossings, slots["marking"], stop_line=False)
            patches += _yield_line(shape, number, slots["marking"])
    return road_materials.make_street_solid(patches, look, _hulls(shape))


def _ring(shape: RoundaboutShape, slots: dict[str, int]) -> Iterator[Patch]:
    """Carriageway from the truck apron to the kerbs and mouths, and the apron itself."""
    line = shape.outline()
    line = np.concatenate([line, line[:1]])
    unit = line / np.sqrt((line * line).sum(axis=1, keepdims=True))
    inner = shape.island_m + shape.truck_apron_m
    rings = [
        unit * inner + share * (line - unit * inner) for share in np.linspace(0.0, 1.0, _RINGS + 1)
    ]
    # Rows from the outside in: with the centre on the left.
    yield _draped(shape, np.stack(rings[::-1], axis=1), "asphalt", slots["asphalt"])
    apron = np.stack([unit * inner, unit * shape.island_m], axis=1)
    yield _draped(shape, apron, "setts", slots["setts"])


def _draped(
    shape: RoundaboutShape, plan: Array, name: str, slot: int, lift_m: float = 0.0
) -> Patch:
    """A grid of points [rows, columns, 2] laid on the carriageway."""
    z = shape.height_m(plan.reshape(-1, 2)).reshape(plan.shape[:2]) + lift_m
    return surface(np.concatenate([plan, z[..., None]], axis=2), plan, name, slot)


def _island(shape: RoundaboutShape, slots: dict[str, int]) -> Iterator[Patch]:
    """A kerb, and a mound of grass."""
    turn = np.linspace(0.0, math.tau, 49)
    unit = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    base = float(shape.height_m(np.array([[shape.island_m, 0.0]]))[0])
    top, edge = base + shape.kerb_m + 0.02, shape.island_m - cross_section.KERB_WIDTH_M
    kerb = ((shape.island_m, base), (shape.island_m - 0.02, top), (edge, top))
    yield _revolved(unit, kerb, "kerb", slots["kerb"])
    radii = edge * np.linspace(1.0, 0.0, 6)
    mound = [(float(r), top + _MOUND_M * (1.0 - (r / edge) ** 2)) for r in radii]
    yield _revolved(unit, tuple(mound), "verge", slots["verge"])


def _revolved(unit: Array, profile: tuple[tuple[float, float], ...], name: str, slot: int) -> Patch:
    """A profile of (radius, height) from the outside in, turned about the centre."""
    points = np.stack(
        [np.column_stack([unit * r, np.full(len(unit), z)]) for r, z in profile], axis=1
    )
    plan = points[..., :2] + points[..., 2:] * np.array([1.0, 0.0])
    return surface(points, plan, name, slot)


def _splitter(shape: RoundaboutShape, number: int, slots: dict[str, int]) -> Iterator[Patch]:
    """A raised island that parts the lanes of an arm, narrow at its outer end."""
    near, far = shape.outer_m + 0.6, shape.curve_end_m() - 0.2
    r, half = np.array([near, 0.5 * (near + far), far]), np.array([1.1, 0.6, 0.15])
    loop_r = np.concatenate([r, r[::-1], r[:1]])
    loop_t = np.concatenate([-half, half[::-1], -half[:1]])
    rim = arm_points(shape, number, loop_r, loop_t)
    low = shape.height_m(rim)
    z = float(low.max()) + 0.1
    walls = np.stack(
        [np.column_stack([rim, low - 0.02]), np.column_stack([rim, np.full(len(rim), z)])], axis=1
    )
    yield surface(walls, walls[..., [0, 2]] + walls[..., [1, 1]], "kerb", slots["kerb"])
    flat = triangulate(rim[:-1])
    corners = np.concatenate([flat, np.full((*flat.shape[:2], 1), z)], axis=2)
    count = np.full(len(flat), slots["pavement"], dtype=np.int64)
    yield Patch(corners, flat / road_materials.SCALES_M["pavement"], count)


def _yield_line(shape: RoundaboutShape, number: int, slot: int) -> Iterator[Patch]:
    """Blocks along the ring's edge across the lane that leads into it."""
    way = 1.0 if shape.traffic == "right" else -1.0
    pitch = (_YIELD_M[1] + _YIELD_GAP_M) / shape.outer_m
    arm, end = shape.arms_rad()[number], shape.mouth_rad() - 0.04
    start = 1.3 / shape.outer_m if shape.splitter > 0.0 else 0.02
    for k in range(int((end - start) / pitch)):
        first = start + k * pitch
        turn = arm + way * np.linspace(first, first + _YIELD_M[1] / shape.outer_m, 2)
        turn = turn if way > 0.0 else turn[::-1]
        unit = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        plan = np.stack([unit * (shape.outer_m + _YIELD_M[0]), unit * shape.outer_m], axis=1)
        yield _draped(shape, plan, "marking", slot, PAINT_LIFT_M)


def _land(shape: RoundaboutShape, number: int, slot: int) -> Patch:
    """Land between two arms, from the sidewalk to the aprons of the roads that go on there."""
    walked = shape.sidewalk_m > 0.0
    offset, z = (shape.border_m, shape.edge_z_m) if walked else (0.0, 0.0)
    line = corner(shape, number, offset)
    away = shape.half_m + offset
    ends = []
    for arm, side in ((number, 1.0), ((number + 1) % len(shape.arms_rad()), -1.0)):
        out = side * (away + cross_section.APRON_M * np.array(cross_section.APRON_STEPS[1:]))
        flat = arm_points(shape, arm, np.full(len(out), shape.reach_m()), out)
        # Gardens before houses are level.
        drop_m = 0.0 if shape.setback_m > 0.0 else z + cross_section.APRON_FALL_M
        fall = np.array(cross_section.APRON_DROPS[1:]) * drop_m
        ends.append(np.column_stack([flat, z - fall]))
    a, b = ends[0][-1, :2], ends[1][-1, :2]
    start = math.atan2(a[1], a[0])
    gap = (math.atan2(b[1], b[0]) - start) % math.tau
    turn = start + np.linspace(0.0, gap, max(3, math.ceil(gap / 0.15)))[1:-1]
    far = math.hypot(*a) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    outer = np.column_stack([far, np.full(len(far), -cross_section.APRON_FALL_M)])
    edge = np.column_stack([line, np.full(len(line), z)])
    loop = np.concatenate([ends[0], outer, ends[1][::-1], edge[::-1]])
    heights = {(x, y): height for x, y, height in loop.tolist()}
    flat = triangulate(loop[:, :2])
    corners = np.array([[[x, y, heights[x, y]] for x, y in triangle] for triangle in flat.tolist()])
    count = np.full(len(flat), slot, dtype=np.int64)
    return Patch(corners, flat / road_materials.SCALES_M["ground"], count)


def _hulls(shape: RoundaboutShape) -> list[Array]:
    """Slices of the carriageway, the island, and the sidewalk in pieces."""
    line = shape.outline()
    line = np.concatenate([line, line[:1]])[::3]
    z = shape.height_m(line)
    top = float(shape.height_m(np.array([[shape.island_m, 0.0]]))[0])
    center = np.array([0.0, 0.0, top])
    rim = np.column_stack([line, z])
    tops = [np.stack([center, a, b]) for a, b in pairwise(rim)]
    for number in range(len(shape.arms_rad()) if shape.sidewalk_m > 0.0 else 0):
        near, far = corner(shape, number, 0.0), corner(shape, number, shape.border_m)
        for k in range(len(near) - 1):
            quad = np.stack([near[k], near[k + 1], far[k], far[k + 1]])
            tops.append(np.column_stack([quad, [shape.kerb_m] * 2 + [shape.edge_z_m] * 2]))
    turn = np.linspace(0.0, math.tau, 13)[:-1]
    disc = shape.island_m * np.stack([np.cos(turn), np.sin(turn), np.zeros(12)], axis=1)
    tops.append(disc + np.array([0.0, 0.0, top + shape.kerb_m]))
    return [np.concatenate([top_, top_ - np.array([0.0, 0.0, 0.3])]) for top_ in tops]
