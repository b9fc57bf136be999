"""Places of pieces: at walls, near other pieces, on them, at windows and doors, below ceilings."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from gen_data.assets.families import declared
from gen_data.core.keypoint_names import BACKREST
from gen_data.core.streams import pick_by_weight
from gen_data.rooms.floor_plan import Opening, between, direction, draw_count
from gen_data.rooms.layout import Drawn, Layout, Neighbor, Options, Piece, Shape, cos_sin
from gen_data.rooms.rules import Rule

WALL_GAP_M = 0.012
"""Gap behind pieces with their back to a wall: the thickness of a skirting board."""
_TRIES = 36
_HANGS_M = 0.3
"""Pieces whose lowest point is above this height over the floor are wall-mounted."""
_LONG_LIST = 6
"""Number of families from which on a rule means different objects, not many of a kind."""

Placement = tuple[float, float, float, float]
"""Offset along depth and width of a piece [m], turn [rad], and height of the lowest point [m]."""
Offset = Callable[[Layout, Piece, Shape, float], Placement]
"""Draws the placement of a shape at a gap [m] from a piece."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where pieces go: one row of ``gen_data.rooms.TABLE``.

    Attributes:
        put: Places up to ``wanted`` pieces of a rule in a layout; returns their number.
        scales: Whether the number of optional pieces grows with the floor.
        is_extra: Whether a room may lack such pieces, whatever ``count`` states.
    """

    put: Callable[[Layout, Rule, Options, int], int]
    scales: bool = False
    is_extra: bool = False


def draw_asset(layout: Layout, rule: Rule, options: Options) -> Drawn:
    """Draw the family and the asset of a piece."""
    family = layout.pick(_unused(layout, rule))
    found = options[family]
    if rule.matching:
        alike = declared(family, "variants_per_look")
        look = int(layout.look * (len(found) // alike))
        seeds = range(alike * look, alike * (look + 1))
        found = [f"{family}?seed={seed}" for seed in seeds]
    return family, layout.pick(found)


def _unused(layout: Layout, rule: Rule) -> Sequence[str]:
    """Families to draw from: of long lists, none more often than it is listed."""
    if len(set(rule.assets)) < _LONG_LIST:
        return rule.assets
    used = Counter(p.family for p in layout.pieces if p.role == rule.piece)
    left = [f for f in rule.assets if used[f] < rule.assets.count(f)]
    return left or rule.assets


def _at_wall(
    layout: Layout,
    rule: Rule,
    options: Options,
    wanted: int,
    *,
    in_corners: bool = False,
    hangs: bool = False,
) -> int:
    """Back to a wall, in corners or anywhere along it; hanging ones at their height."""
    placed = 0
    for _ in range(wanted):
        for _ in range(_TRIES):
            drawn = draw_asset(layout, rule, options)
            s = layout.shape(drawn[1])
            lengths = [layout.room.wall_length_m(k) for k in range(4)]
            wall = pick_by_weight(lengths, float(layout.rng.random()))
            free = 0.5 * lengths[wall] - s.half_y - 0.015
            corner = free if layout.rng.random() < 0.5 else -free
            along = corner if in_corners else layout.signed(max(free, 0.0))
            gap = 0.0005 if hangs else WALL_GAP_M
            at = layout.room.at_wall(wall, along, s.half_x + gap)
            # Basins on walls begin above the floor.
            low = _hanging_m(layout, rule, s) if hangs else max(s.low, 0.0)
            if layout.put(rule, drawn, at, wall * 0.5 * math.pi, low):
                placed += 1
                break
    return placed


def _hanging_m(layout: Layout, rule: Rule, s: Shape) -> float:
    if rule.middle_m[1]:
        return between(layout.rng, rule.middle_m) - 0.5 * (s.high - s.low)
    return between(layout.rng, rule.height_m)


def _free(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Anywhere on the floor: furniture square to the walls, small objects at any angle."""
    placed = 0
    (mx, my), (sx, sy, _) = layout.room.center_m, layout.room.size_m
    for _ in range(wanted):
        for _ in range(_TRIES):
            drawn = draw_asset(layout, rule, options)
            s = layout.shape(drawn[1])
            small = max(s.half_x, s.half_y) < 0.65
            yaw = (
                layout.signed(math.pi) if small else draw_count(layout.rng, (0, 3)) * 0.5 * math.pi
            )
            at = (mx + layout.signed(0.5 * sx - 0.1), my + layout.signed(0.5 * sy - 0.1))
            if layout.put(rule, drawn, at, yaw, 0.0):
                placed += 1
                break
    return placed


def _relatives(layout: Layout, rule: Rule) -> list[int]:
    return [k for k, p in enumerate(layout.pieces) if p.role in rule.of]


def _near(
    put: Callable[[Layout, Rule, Drawn, int], bool],
    layout: Layout,
    rule: Rule,
    options: Options,
    wanted: int,
    *,
    once: bool = True,
    in_turn: bool = True,
) -> int:
    """Relative to other pieces; ``once`` to each, ``in_turn`` or to drawn ones."""
    found = _relatives(layout, rule)
    placed = 0
    used: set[int] = set()
    for number in range(wanted if found else 0):
        for attempt in range(_TRIES):
            k = (
                found[number % len(found)]
                if attempt < _TRIES // 2 and in_turn
                else found[min(int(layout.rng.random() * len(found)), len(found) - 1)]
            )
            drawn = draw_asset(layout, rule, options)
            if once and k in used:
                layout.refused["another one is there"] += 1
                continue
            if put(layout, rule, drawn, k):
                used.add(k)
                placed += 1
                break
    return placed


def _put_near(offset: Offset, layout: Layout, rule: Rule, drawn: Drawn, k: int) -> bool:
    ref = layout.pieces[k]
    x, y, c, sn, _, _ = ref.footprint
    gap_m = between(layout.rng, rule.gap_m)
    dx, dy, turn_rad, low_m = offset(layout, ref, layout.shape(drawn[1]), gap_m)
    at = (x + c * dx - sn * dy, y + sn * dx + c * dy)
    return layout.put(rule, drawn, at, ref.yaw_rad + turn_rad, low_m, Neighbor(k))


def _in_front(layout: Layout, ref: Piece, s: Shape, gap_m: float) -> Placement:
    dx, dy = ref.footprint[4] + gap_m + s.half_x, layout.signed(0.25 * ref.footprint[5])
    turn = layout.signed(0.35) if gap_m != 0.0 and s.half_y < 0.4 else 0.0
    return dx, dy, math.pi + turn, 0.0


def _at_side(layout: Layout, ref: Piece, s: Shape, gap_m: float) -> Placement:
    """Next to a piece, aligned with its back; next to a hanging piece at the same height."""
    a, b = ref.footprint[4:]
    side = 1 if layout.rng.random() < 0.5 else -1
    hangs = ref.low_m > _HANGS_M
    low = 0.5 * (ref.low_m + ref.high_m) - 0.5 * (s.high - s.low) if hangs else 0.0
    return s.half_x - a, (b + gap_m + s.half_y) * side, 0.0, low


def _at_any_side(layout: Layout, ref: Piece, s: Shape, gap_m: float) -> Placement:
    a, b = ref.footprint[4:]
    side = draw_count(layout.rng, (0, 3))
    c, sn = direction(side)
    reach, free = (a, b) if side % 2 == 0 else (b, a)
    away = reach + gap_m + s.half_x
    aside = layout.signed(max(free - s.half_y, 0.0))
    turn = side * 0.5 * math.pi + math.pi + layout.signed(0.15)
    return c * away - sn * aside, sn * away + c * aside, turn, 0.0


def _above(layout: Layout, ref: Piece, s: Shape, gap_m: float) -> Placement:
    del layout
    dx = s.half_x - ref.footprint[4] - WALL_GAP_M + 0.0005
    return dx, 0.0, 0.0, min(ref.high_m, 0.91) + gap_m


def _under(layout: Layout, ref: Piece, s: Shape, gap_m: float) -> Placement:
    del s, gap_m
    dx = layout.signed(0.1) + (declared(ref.family, "under_share", 0.0) * ref.footprint[4])
    return dx, 0.0, 0.0, 0.0


def _put_across(layout: Layout, rule: Rule, drawn: Drawn, k: int) -> bool:
    """Against the wall that a piece faces."""
    between(layout.rng, rule.gap_m)
    ref, room = layout.pieces[k], layout.room
    wall = round(ref.yaw_rad / (0.5 * math.pi) + 2) % 4
    s = layout.shape(drawn[1])
    c, sn = direction(wall)
    x, y = ref.footprint[0] - room.center_m[0], ref.footprint[1] - room.center_m[1]
    along = -x * sn + y * c + layout.signed(0.4)
    at = room.at_wall(wall, along, s.half_x + WALL_GAP_M)
    return layout.put(rule, drawn, at, wall * 0.5 * math.pi, 0.0)


def _on(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """On the tops of other pieces; at most ``wanted`` on each."""
    placed = 0
    for k in _relatives(layout, rule) if wanted else []:
        ref = layout.pieces[k]
        x, y, c, sn, a, b = ref.footprint
        drawn = draw_asset(layout, rule, options)
        s = layout.shape(drawn[1])
        dx = rule.at[0] * max(a - s.half_x, 0.0)
        dy = rule.at[1] * max(b - s.half_y, 0.0) * (1 if layout.rng.random() < 0.5 else -1)
        at = (x + c * dx - sn * dy, y + sn * dx + c * dy)
        if s.half_x <= a + 0.03 and s.half_y <= b + 0.03:
            placed += layout.put(
                rule, drawn, at, ref.yaw_rad, ref.high_m, Neighbor(k, carries=True)
            )
    return placed


def _over(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Over the backs of seats, which say where their upper edge is."""
    placed = 0
    found = [k for k in _relatives(layout, rule) if layout.pieces[k].on < 0]
    for _ in range(min(wanted, len(found))):
        k = found.pop(min(int(layout.rng.random() * len(found)), len(found) - 1))
        ref = layout.pieces[k]
        edges = [p.position_m for p in layout.assets.keypoints(ref.asset) if p.name == BACKREST]
        if not edges:
            continue
        drawn = draw_asset(layout, rule, options)
        s = layout.shape(drawn[1])
        x, y, z = ref.pose.apply(np.array([edges[0]]))[0].tolist()
        c, sn = cos_sin(ref.yaw_rad)
        at = (x + c * s.x - sn * s.y, y + sn * s.x + c * s.y)
        around = Neighbor(k, carries=True, is_enclosed=True)
        placed += layout.put(rule, drawn, at, ref.yaw_rad, z + s.low, around)
    return placed


def _windows(layout: Layout) -> list[Opening]:
    return [o for o in layout.room.openings if o.kind == "window"]


def _at_windows(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    placed = 0
    for opening in _windows(layout)[: (wanted + 1) // 2]:
        drawn = draw_asset(layout, rule, options)
        s = layout.shape(drawn[1])
        low = max(0.015, min(opening.high_m + 0.14, layout.room.size_m[2] - 0.04) - s.high)
        before = len(layout.pieces)
        for side in (-1, 1):
            along = opening.along_m + side * (0.5 * opening.width_m + s.half_y)
            at = layout.room.at_wall(opening.wall, along, s.half_x + 0.06)
            layout.put(rule, drawn, at, opening.wall * 0.5 * math.pi, low)
        if len(layout.pieces) < before + 2:
            del layout.pieces[before:]
        placed += len(layout.pieces) - before
    return placed


def _below_windows(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    placed = 0
    for opening in _windows(layout)[:wanted]:
        drawn = draw_asset(layout, rule, options)
        s = layout.shape(drawn[1])
        low = between(layout.rng, rule.height_m)
        at = layout.room.at_wall(opening.wall, opening.along_m, s.half_x + 0.0005)
        placed += layout.put(rule, drawn, at, opening.wall * 0.5 * math.pi, low)
    return placed


def _at_doors(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    placed = 0
    doors = [o for o in layout.room.openings if o.kind == "door"]
    for opening in doors[:wanted]:
        drawn = draw_asset(layout, rule, options)
        s = layout.shape(drawn[1])
        low = between(layout.rng, rule.height_m)
        side = 1 if layout.rng.random() < 0.5 else -1
        for way in (side, -side):
            along = opening.along_m + way * (0.5 * opening.width_m + 0.12 + s.half_y)
            at = layout.room.at_wall(opening.wall, along, s.half_x + 0.0005)
            if layout.put(rule, drawn, at, opening.wall * 0.5 * math.pi, low):
                placed += 1
                break
    return placed


def _at_ceiling(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """In a row, or in two rows from four on, under the ceiling; all of one kind."""
    (mx, my), (sx, sy, height) = layout.room.center_m, layout.room.size_m
    drawn = draw_asset(layout, rule, options)
    s = layout.shape(drawn[1])
    rows = 2 if wanted >= 4 else 1
    columns = math.ceil(wanted / rows)
    placed = 0
    for k in range(wanted):
        u, v = (k % columns + 0.5) / columns - 0.5, (k // columns + 0.5) / rows - 0.5
        across = (u, v) if sx >= sy else (v, u)
        at = (mx + across[0] * sx, my + across[1] * sy)
        placed += layout.put(rule, drawn, at, 0.5 * math.pi * (sx >= sy), height - (s.high - s.low))
    return placed


WALL = Place(_at_wall, scales=True)
CORNER = Place(partial(_at_wall, in_corners=True), scales=True)
HANG = Place(partial(_at_wall, hangs=True), scales=True)
FREE = Place(_free, scales=True)
FRONT = Place(partial(_near, partial(_put_near, _in_front)), is_extra=True)
BESIDE = Place(partial(_near, partial(_put_near, _at_side), once=False))
AROUND = Place(
    partial(_near, partial(_put_near, _at_any_side), once=False, in_turn=False), is_extra=True
)
ABOVE = Place(partial(_near, partial(_put_near, _above)))
UNDER = Place(partial(_near, partial(_put_near, _under)))
ACROSS = Place(partial(_near, _put_across))
ON = Place(_on, is_extra=True)
OVER = Place(_over, is_extra=True)
WINDOW = Place(_at_windows)
BELOW = Place(_below_windows)
DOOR = Place(_at_doors)
CEILING = Place(_at_ceiling)
