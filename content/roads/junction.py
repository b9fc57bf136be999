"""The surface of a junction: carriageway, kerbs, sidewalks, stop lines and crosswalks."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.roads import road_materials
from gen_data.content.roads.deck import PAINT_LIFT_M, surface
from gen_data.content.roads.junction_wear import worn_surface
from gen_data.content.roads.markings import NARROW_M, ZEBRA_BAR_M
from gen_data.roads.cross_section import (
    APRON_DROPS,
    APRON_FALL_M,
    APRON_M,
    APRON_STEPS,
    KERB_WIDTH_M,
)
from gen_data.roads.junction_shape import (
    CROSSWALK_M,
    STOP_LINE_M,
    ArmsShape,
    Fan,
    JunctionShape,
    arm_points,
    corner,
    make_fan,
)

_CELL_M = 0.6
"""Largest size of pieces of markings, which must follow the surface [m]."""
_TIP_RAD = math.radians(60.0)


def junction(*, crossings: str = "zebra", **others: Any) -> Solid:
    """A junction about the origin; slots as in ``street_materials``.

    Args:
        crossings: Style of the crosswalks: ``zebra``, ``ladder``, ``lines`` or ``none``.
        others: Fields of ``StreetLook`` and of ``JunctionShape``.
    """
    look, shape = road_materials.split_look(others)
    profile = JunctionShape(**shape)
    slots = road_materials.number_slots(look)
    fan = make_fan(profile)
    paved = look.carriageway not in road_materials.UNPAVED
    patches = [_carriageway(fan, slots["asphalt"]), *worn_surface(profile, fan, look, slots)]
    for number in range(len(profile.arms_rad())):
        if profile.sidewalk_m > 0.0:
            patches += corner_patches(profile, number, slots)
        patches.append(_land(profile, number, slots["ground"]))
        if paved:
            patches += arm_paint(profile, number, crossings, slots["marking"])
    return road_materials.make_street_solid(patches, look, _hulls(profile, fan))


def _carriageway(fan: Fan, slot: int) -> Patch:
    return _fan_patch(np.array([0.0, 0.0, fan.center_z_m]), fan.outline_m, "asphalt", slot)


def _fan_patch(center: Array, line: Array, name: str, slot: int) -> Patch:
    after = np.roll(line, -1, axis=0)
    corners = np.stack([np.broadcast_to(center, line.shape), line, after], axis=1)
    return Patch(
        corners,
        corners[..., :2] / road_materials.SCALES_M[name],
        np.full(len(corners), slot, dtype=np.int64),
    )


def corner_patches(shape: ArmsShape, number: int, slots: dict[str, int]) -> Iterator[Patch]:
    """Kerb and sidewalk from one arm's end to the next one's, closed at both ends."""
    top, b = shape.kerb_m, 0.02
    yield _band(
        shape, number, ((0.0, 0.0), (b, top - 0.015), (b + 0.015, top), (KERB_WIDTH_M, top)),
        "kerb", slots["kerb"],
    )  # fmt: skip
    yield _band(
        shape, number, ((KERB_WIDTH_M, top), (shape.border_m, shape.edge_z_m)),
        "pavement", slots["pavement"],
    )  # fmt: skip
    for end in (0, -1):
        inner, outer = corner(shape, number, 0.02)[end], corner(shape, number, shape.border_m)[end]
        corners = [[[*inner, -0.2], [*outer, -0.2]], [[*inner, top], [*outer, shape.edge_z_m]]]
        points = np.array(corners)
        plan = points[..., [0, 2]] + points[..., [1, 1]] * np.array([1.0, 0.0])
        yield surface(points, plan, "kerb", slots["kerb"])


def _band(
    shape: ArmsShape, number: int, profile: Sequence[tuple[float, float]], name: str, slot: int
) -> Patch:
    """A profile of (distance behind the kerb's face, height) drawn around a corner."""
    lines = [
        np.column_stack([line, np.full(len(line), z)])
        for line, z in ((corner(shape, number, offset), z) for offset, z in profile)
    ]
    # From the outside in: with the street on the left, that is from right to left.
    points = np.stack(lines[::-1], axis=1)
    middle = points[:, len(profile) // 2, :2]
    steps = np.sqrt((np.diff(middle, axis=0) ** 2).sum(axis=1))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    flat = np.array(profile[::-1])
    across = np.concatenate([[0.0], np.cumsum(np.sqrt((np.diff(flat, axis=0) ** 2).sum(axis=1)))])
    plan = np.stack(np.meshgrid(along, across, indexing="ij"), axis=2)
    return surface(points, plan, name, slot)


def _land(shape: JunctionShape, number: int, slot: int) -> Patch:
    """Land between two arms, from the sidewalk to the land along the arms.

    With front gardens, it is level, as they are.
    """
    offset = shape.border_m if shape.sidewalk_m > 0.0 else 0.0
    z = shape.edge_z_m if shape.sidewalk_m > 0.0 else 0.0
    line = corner(shape, number, offset)
    edge = np.column_stack([line, np.full(len(line), z)])
    gap = shape.gaps_rad()[number]
    # The outer edges of arms in line are parallel: they do not meet in a tip.
    if abs(gap - math.pi) <= 1e-3:
        far = corner(shape, number, offset + shape.setback_m + APRON_M)
        rows, plan = [np.column_stack([far, np.full(len(far), -APRON_FALL_M)])], [far]
        if shape.setback_m > 0.0:
            front = corner(shape, number, offset + shape.setback_m)
            rows.append(np.column_stack([front, np.full(len(front), z)]))
            plan.append(front)
        return surface(
            np.stack([*rows, edge], axis=1), np.stack([*plan, line], axis=1), "ground", slot
        )
    away = shape.half_m + offset
    meeting = away / math.tan(0.5 * gap)
    cross = arm_points(shape, number, np.array(meeting), np.array(away))
    tip = np.array([*(line[0] + line[-1] - cross), z if shape.setback_m > 0.0 else -APRON_FALL_M])
    if shape.setback_m > 0.0:
        loop = np.concatenate([edge, tip[None]])
        center = np.array([*loop[:, :2].mean(axis=0), z])
        return _fan_patch(center, loop, "ground", slot).flipped()
    ends = []
    for end, arm, side in ((0, number, 1.0), (-1, (number + 1) % len(shape.arms_rad()), -1.0)):
        # The same profile as along the road that continues here.
        out = side * (away + APRON_M * np.array(APRON_STEPS[1:]))
        flat = arm_points(shape, arm, np.full(len(out), shape.reach_m()), out)
        fall = np.array(APRON_DROPS[1:]) * (z + APRON_FALL_M)
        ends.append(np.column_stack([flat, z - fall])[:: -1 if end == 0 else 1])
    # The tip between arms close to each other lies far out, beyond the land of their roads.
    loop = np.concatenate([ends[0], edge, ends[1], *([tip[None]] if gap > _TIP_RAD else [])])
    (ax, ay, _), (bx, by, _) = ends[0][0], ends[1][-1]
    if ax * by - ay * bx <= 0.0:
        # Aprons that overlap cover the land between the arms.
        loop = edge
    # The land is convex. It runs clockwise: with the street on its left.
    center = np.array([*loop[:, :2].mean(axis=0), 0.0])
    return _fan_patch(center, loop, "ground", slot).flipped()


def arm_paint(
    shape: ArmsShape, arm: int, crossings: str, slot: int, *, stop_line: bool = True
) -> Iterator[Patch]:
    """Lines of an arm: stop line, lines between its lanes, crosswalk."""
    start, half = shape.curve_end_m(), shape.half_m
    side = 1.0 if shape.traffic == "right" else -1.0
    stop = (start + STOP_LINE_M[0], start + STOP_LINE_M[1])

    def painted(r: tuple[float, float], t: tuple[float, float]) -> Patch:
        return _drape(shape, arm, r, t, slot)

    middle, turning = 0.5 * shape.median_m, shape.has_turn_lane(arm)
    if stop_line:
        first = (-middle if turning else middle) + 0.06
        yield painted(stop, _ordered(side * first, side * (half - 0.15)))
    offsets = [middle + k * shape.lane_width_m for k in range(shape.lanes)]
    for t in sorted({way * offset for offset in offsets for way in (1.0, -1.0)}):
        yield painted((stop[0], shape.reach_m()), (t - 0.5 * NARROW_M, t + 0.5 * NARROW_M))
    if middle > 0.0 and not turning:
        for low in np.arange(stop[0] + 0.3, shape.reach_m() - 0.6, 1.4).tolist():
            yield painted((low, low + 0.5), (0.2 - middle, middle - 0.2))
    walk = (start + CROSSWALK_M[0], start + CROSSWALK_M[1])
    if crossings in ("zebra", "ladder"):
        count = int((2.0 * half - ZEBRA_BAR_M) // (2.0 * ZEBRA_BAR_M)) + 1
        first = -(count - 0.5) * ZEBRA_BAR_M
        for k in range(count):
            t = first + 2.0 * k * ZEBRA_BAR_M
            yield painted(walk, (t, t + ZEBRA_BAR_M))
        for edge in walk if crossings == "ladder" else ():
            yield painted((edge - 0.12, edge + 0.12), (0.2 - half, half - 0.2))
    elif crossings == "lines":
        # A signalled crossing: broken lines, dashes of 0.5 m and gaps of 0.2 m (RMS-1).
        for edge in walk:
            for t in np.arange(-half + 0.2, half - 0.5, 0.7):
                yield painted((edge, edge + NARROW_M), (float(t), float(t) + 0.5))


def _ordered(a: float, b: float) -> tuple[float, float]:
    """Both numbers, the smaller one first."""
    return (min(a, b), max(a, b))


def _drape(
    shape: ArmsShape, arm: int, r_m: tuple[float, float], t_m: tuple[float, float], slot: int
) -> Patch:
    """A rectangle of an arm's frame laid on the carriageway."""
    r, t = (
        np.linspace(low, high, max(2, math.ceil((high - low) / _CELL_M) + 1))
        for low, high in (r_m, t_m)
    )
    if t[0] < 0.0 < t[-1]:
        # The carriageway has its ridge in the middle of an arm.
        t = np.unique(np.append(t, 0.0))
    grid = np.stack(np.meshgrid(r, t, indexing="ij"), axis=2)
    xy = arm_points(shape, arm, grid[..., 0], grid[..., 1])
    z = shape.height_m(xy.reshape(-1, 2)).reshape(xy.shape[:2]) + PAINT_LIFT_M
    return surface(np.concatenate([xy, z[..., None]], axis=2), grid, "marking", slot)


def _hulls(shape: JunctionShape, fan: Fan) -> list[Array]:
    """The carriageway's slices, and the sidewalk in pieces."""
    center = np.array([0.0, 0.0, fan.center_z_m])
    line = np.concatenate([fan.outline_m, fan.outline_m[:1]])
    tops = [np.stack([center, a, b]) for a, b in pairwise(line[::4])]
    for number in range(len(shape.arms_rad()) if shape.sidewalk_m > 0.0 else 0):
        near, far = corner(shape, number, 0.0), corner(shape, number, shape.border_m)
        for k in range(len(near) - 1):
            quad = np.stack([near[k], near[k + 1], far[k], far[k + 1]])
            tops.append(np.column_stack([quad, [shape.kerb_m] * 2 + [shape.edge_z_m] * 2]))
    return [np.concatenate([top, top - np.array([0.0, 0.0, 0.3])]) for top in tops]
