"""Layouts of rooms: pieces placed one after the other, by rejection from their rules.

A candidate is refused with a reason; ``Conflict`` names the most frequent one of the rule that
could not be satisfied.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.families import declared
from gen_data.core.bounded_cache import ObjectCache
from gen_data.core.boxes import Rectangle, overlap_of
from gen_data.core.interfaces import AssetIndex
from gen_data.core.keypoint_names import BACKREST, INSIDE, SUPPORT
from gen_data.core.se3 import SE3, Array, Quaternion, Vec3
from gen_data.core.streams import Rng
from gen_data.rooms.floor_plan import Opening, Room, between, direction, draw_count
from gen_data.rooms.resting import UPRIGHT, turn_to_rest
from gen_data.rooms.rules import RoomType, Rule

Options = Mapping[str, Sequence[str]]
"""Ids of assets by family."""
WALL_GAP_M = 0.012
"""Gap behind pieces with their back to a wall: the thickness of a skirting board."""
DOOR_ZONE_M = 0.95
"""Depth of the floor before doors that stays free: the swing of a leaf."""
PERSON_M = 0.22
"""Half of the width that a person needs to pass; 0.45 m at the shoulders (DIN 33402-2)."""
CELL_M = 0.05
_TRIES = 36
_HEAD_M = 1.9
_CROWDED = 0.25
"""Distance within which a piece before a window hides it."""
_SILL_M = 0.026
"""Height of sills below the openings of windows."""
_OFF_SILLS_M = 0.005
"""Distance that things keep from sills."""
_HANGS_M = 0.3
"""What begins higher than this above the floor hangs on a wall."""
_BORDER_M = (0.05, 0.05)
"""Width of the border of surfaces that stays free, in depth and width."""
_SQUARE_SHARE = 0.4
"""Share of things on tables that lie square to them."""
_TRIES_ON = 6
_LONG_LIST = 6
"""Number of families from which on a rule means different things, not many of a kind."""
_FULL = 0.97
"""Largest share of a board that things cover."""
_TOP_M = 0.003
"""Depth of the rounded border of tops."""
_EDGE_OF_TOP_M = 0.008
_TOPS: ObjectCache[dict[str, Array]] = ObjectCache(2)
_SHAPES: ObjectCache[dict[str, _Shape]] = ObjectCache(2)


@dataclass(frozen=True, slots=True)
class Piece:
    """A placed piece.

    Attributes:
        role: Its name in the rules; ``thing`` for small things.
        position_m, yaw_rad: Pose of its frame, world, Z up.
        footprint: Rectangle that it covers, world.
        low_m, high_m: Heights between which it extends.
        on: Index of the piece that carries it; -1 = none.
        rest: Turn of its own frame, before ``yaw_rad``, with which it lies on a level surface.
    """

    role: str
    family: str
    asset: str
    position_m: Vec3
    yaw_rad: float
    footprint: Rectangle
    low_m: float
    high_m: float
    on: int = -1
    rest: Quaternion = UPRIGHT

    @property
    def pose(self) -> SE3:
        """``T_world_piece``."""
        return SE3.about_z(self.yaw_rad, self.position_m) @ SE3(quaternion_wxyz=self.rest)


class Conflict(Exception):
    """A layout that breaks a rule.

    Attributes:
        piece: Piece that has no place.
        reason: The most frequent reason.
    """

    def __init__(self, piece: str, reason: str) -> None:
        self.piece, self.reason = piece, reason
        super().__init__(f"{piece}: {reason}")


@dataclass(frozen=True, slots=True)
class _Shape:
    """Bounds of an asset at rest [m]: middle of its footprint, half extents, lowest and highest.

    Attributes:
        rest: Turn of its own frame with which it lies on a level surface; None if there is none.
    """

    x: float
    y: float
    half_x: float
    half_y: float
    low: float
    high: float
    rest: Quaternion | None


def _is_flat(family: str) -> bool:
    """Whether pieces of a family lie on the floor and others stand on them."""
    return bool(declared(family, "flat", False))


def _free_above_m(family: str) -> float:
    """Height above pieces of a family that others leave free."""
    return float(declared(family, "free_above_m", 0.0))


def _find_shape(assets: AssetIndex, asset: str) -> _Shape:
    low, high = assets.bounds_m(asset)
    rest: Quaternion | None = UPRIGHT
    if declared(asset, "loose", False):
        points_m = np.asarray(assets.vertices_m(asset), np.float64)
        rest = turn_to_rest(points_m)
        if rest is not None:
            turned_m = SE3(quaternion_wxyz=rest).apply(points_m)
            low, high = turned_m.min(axis=0).tolist(), turned_m.max(axis=0).tolist()
    (x0, y0, z0), (x1, y1, z1) = low, high
    middle, half = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), (0.5 * (x1 - x0), 0.5 * (y1 - y0))
    return _Shape(*middle, *half, z0, z1, rest)


def _find_top(assets: AssetIndex, asset: str) -> Array:
    """Sides of the convex outline of a piece's top, [n, 3]: ``a x + b y + c < 0`` inside [m]."""
    from scipy.spatial import ConvexHull

    points_m = assets.vertices_m(asset)
    top_m = points_m[points_m[:, 2] > points_m[:, 2].max() - _TOP_M, :2]
    return np.asarray(ConvexHull(top_m).equations, np.float64)


@dataclass
class Layout:
    """A room being furnished.

    Attributes:
        look: Decides on the look of matching pieces, in [0, 1).
        zones: Floor to keep free, with the index of the piece that needs it; -1 = a door.
    """

    room: Room
    assets: AssetIndex
    rng: Rng
    look: float = 0.0
    pieces: list[Piece] = field(default_factory=list)
    zones: list[tuple[Rectangle, int]] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)

    def shape(self, asset: str) -> _Shape:
        """Extents of an asset."""
        known = _SHAPES.get(self.assets, dict)
        if asset not in known:
            known[asset] = _find_shape(self.assets, asset)
        return known[asset]

    def is_on_top(self, footprint: Rectangle, carrier: Piece) -> bool:
        """Whether a footprint is on the top of a piece, which may be round."""
        known = _TOPS.get(self.assets, dict)
        if carrier.asset not in known:
            known[carrier.asset] = _find_top(self.assets, carrier.asset)
        x, y, c, s, a, b = footprint
        corners_m = np.array(
            [
                (x + u * a * c - v * b * s, y + u * a * s + v * b * c, 0.0)
                for u, v in ((-1, -1), (-1, 1), (1, -1), (1, 1))
            ]
        )
        inside_m = carrier.pose.inverse().apply(corners_m)[:, :2]
        sides = known[carrier.asset]
        return bool((inside_m @ sides[:, :2].T + sides[:, 2] < -_EDGE_OF_TOP_M).all())

    def pick(self, options: Sequence[str]) -> str:
        """Draw one of several."""
        return options[min(int(self.rng.random() * len(options)), len(options) - 1)]

    def signed(self, reach: float) -> float:
        """Draw uniformly from -reach to reach."""
        return (2.0 * float(self.rng.random()) - 1.0) * reach

    def put(
        self,
        rule: Rule,
        family: str,
        asset: str,
        at: tuple[float, float],
        yaw_rad: float,
        low_m: float,
        ignore: int = -2,
    ) -> bool:
        """Place the middle of an asset's footprint at a point, unless something is in the way."""
        s = self.shape(asset)
        if s.rest is None:
            self.refused["does not stand by itself"] += 1
            return False
        c, sn = _cos_sin(yaw_rad)
        footprint: Rectangle = (at[0], at[1], c, sn, s.half_x, s.half_y)
        high_m = low_m + s.high - s.low
        zone = _before(footprint, rule.clearance_m) if rule.clearance_m > 0.0 else None
        carrier = ignore if rule.place == "over" else -2
        # With what it will carry.
        top_m = high_m + _free_above_m(family)
        reason = self.refuse(footprint, low_m, high_m, zone, ignore, carrier, flat=_is_flat(family))
        if not reason and self.meets_sill(footprint, low_m, top_m):
            reason = "meets a sill"
        if reason:
            self.refused[reason] += 1
            return False
        x, y = at[0] - c * s.x + sn * s.y, at[1] - sn * s.x - c * s.y
        position = (round(x, 5), round(y, 5), round(low_m - s.low, 5))
        on = ignore if rule.place in ("on", "over") else -1
        self.pieces.append(
            Piece(
                rule.piece, family, asset, position, yaw_rad, footprint, low_m, high_m, on, s.rest
            )
        )
        if zone is not None:
            self.zones.append((zone, len(self.pieces) - 1))
        return True

    def refuse(
        self,
        footprint: Rectangle,
        low_m: float,
        high_m: float,
        zone: Rectangle | None,
        ignore: int,
        carrier: int,
        *,
        flat: bool,
    ) -> str:
        """Why something cannot be there; empty = it can.

        Args:
            footprint: Rectangle that it covers.
            low_m: Height of its lowest point.
            high_m: Height of its highest point.
            zone: Floor that it keeps free.
            ignore: Index of the piece whose floor it may take.
            carrier: Index of the piece that it hangs around.
            flat: Whether it lies under others.
        """
        if not self.holds(footprint):
            return "no room between the walls"
        if high_m > self.room.size_m[2] + 1e-6:
            return "higher than the room"
        for k, other in enumerate(self.pieces):
            if k == carrier or flat != (_is_flat(other.family)):
                continue
            if (
                low_m < other.high_m + _free_above_m(other.family) - 1e-6
                and other.low_m < high_m - 1e-6
                and overlap_of(footprint, other.footprint)
            ):
                return f"overlaps {other.role}"
        if not flat and low_m < _HEAD_M:
            for free, owner in self.zones:
                if owner != ignore and overlap_of(footprint, free):
                    return (
                        "blocks a door"
                        if owner < 0
                        else f"blocks the front of {self.pieces[owner].role}"
                    )
        if self.covers_window(footprint, low_m, high_m):
            return "covers a window"
        return "" if zone is None else self.refuse_zone(zone)

    def refuse_zone(self, zone: Rectangle) -> str:
        """Why floor cannot be kept free; empty = it can."""
        if not self.holds(zone):
            return "no free floor before it"
        for other in self.pieces:
            stands = other.low_m < _HEAD_M and not _is_flat(other.family)
            if stands and overlap_of(zone, other.footprint):
                return f"no free floor before it: {other.role}"
        return ""

    def holds(self, rectangle: Rectangle) -> bool:
        """Whether a rectangle is inside the walls."""
        x, y, c, s, a, b = rectangle
        reach_x, reach_y = abs(c) * a + abs(s) * b, abs(s) * a + abs(c) * b
        (mx, my), (sx, sy, _) = self.room.center_m, self.room.size_m
        return bool(
            abs(x - mx) + reach_x <= 0.5 * sx + 1e-6 and abs(y - my) + reach_y <= 0.5 * sy + 1e-6
        )

    def covers_window(self, footprint: Rectangle, low_m: float, high_m: float) -> bool:
        """Whether something stands before a window, or hangs before a door."""
        return any(
            low_m < opening.high_m
            and high_m > opening.low_m - _SILL_M
            and overlap_of(footprint, self.before_opening(opening))
            for opening in self.room.openings
        )

    def meets_sill(self, footprint: Rectangle, low_m: float, high_m: float) -> bool:
        """Whether something touches the sill of a window, which is wider than the opening."""
        reach_m = declared("window", "sill_reach_m") + _OFF_SILLS_M
        beside_m = declared("window", "sill_beside_m") + _OFF_SILLS_M
        return any(
            opening.kind == "window"
            and low_m < opening.low_m
            and high_m > opening.low_m - _SILL_M
            and overlap_of(footprint, self.before_opening(opening, reach_m, beside_m))
            for opening in self.room.openings
        )

    def before_opening(
        self, opening: Opening, reach_m: float = _CROWDED, beside_m: float = 0.0
    ) -> Rectangle:
        """The floor just before an opening, and beside that."""
        x, y = self.room.at_wall(opening.wall, opening.along_m, 0.5 * reach_m)
        c, s = direction(opening.wall)
        return (x, y, c, s, 0.5 * reach_m, 0.5 * opening.width_m + beside_m)


def _cos_sin(yaw_rad: float) -> tuple[float, float]:
    quarter = yaw_rad / (0.5 * math.pi)
    if abs(quarter - round(quarter)) < 1e-9:
        return direction(round(quarter))
    return math.cos(yaw_rad), math.sin(yaw_rad)


def _before(footprint: Rectangle, depth_m: float) -> Rectangle:
    """The rectangle before the front of a footprint."""
    x, y, c, s, a, b = footprint
    ahead = a + 0.5 * depth_m
    return (x + c * ahead, y + s * ahead, c, s, 0.5 * depth_m, b)


def furnish(
    room: Room, rules: RoomType, options: Options, assets: AssetIndex, rng: Rng, clutter: float
) -> list[Piece]:
    """Draw the pieces of a room.

    Args:
        room: The room with its openings.
        rules: Rules of its type.
        options: Ids of assets by family.
        assets: Their extents.
        rng: Random stream.
        clutter: Factor on the numbers of small things.

    Raises:
        Conflict: a required piece has no place, or something cannot be reached.
    """
    layout = Layout(room, assets, rng, look=float(rng.random()))
    for opening in room.openings:
        if opening.kind == "door":
            x, y = room.at_wall(opening.wall, opening.along_m, 0.5 * DOOR_ZONE_M)
            c, s = direction(opening.wall)
            layout.zones.append(((x, y, c, s, 0.5 * DOOR_ZONE_M, 0.5 * opening.width_m + 0.05), -1))
    larger = room.size_m[0] * room.size_m[1] / rules.usual_area_m2
    for rule in rules.pieces:
        layout.refused = Counter()
        low, high = rule.count
        wanted = draw_count(rng, (low, high))
        if rule.piece in ("floor_things", "beside_walls"):
            wanted = round(wanted * clutter)
        if rule.optional and rule.place in ("wall", "free", "corner", "hang"):
            wanted = round(wanted * larger)
        placed = _PLACES[rule.place](layout, rule, options, wanted)
        related = not rule.of or any(p.role in rule.of for p in layout.pieces)
        required = not rule.optional and rule.place not in ("on", "over", "around", "front")
        if placed < low and related and required:
            reason = layout.refused.most_common(1)
            raise Conflict(rule.piece, reason[0][0] if reason else "no place")
    unreachable = find_unreachable(layout)
    if unreachable:
        raise Conflict(unreachable, "cannot be reached from a door")
    for rule in rules.pieces:
        if rule.things or rule.inside:
            _put_things(layout, rule, options, clutter)
    return layout.pieces


def _draw_asset(layout: Layout, rule: Rule, options: Options) -> tuple[str, str]:
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


def _at_wall(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Back to a wall, in corners or anywhere along it; hanging ones at their height."""
    placed = 0
    for _ in range(wanted):
        for _ in range(_TRIES):
            family, asset = _draw_asset(layout, rule, options)
            s = layout.shape(asset)
            lengths = [layout.room.wall_length_m(k) for k in range(4)]
            wall = _weighted(lengths, float(layout.rng.random()))
            free = 0.5 * lengths[wall] - s.half_y - 0.015
            corner = free if layout.rng.random() < 0.5 else -free
            along = corner if rule.place == "corner" else layout.signed(max(free, 0.0))
            gap = 0.0005 if rule.place == "hang" else WALL_GAP_M
            at = layout.room.at_wall(wall, along, s.half_x + gap)
            # Basins on walls begin above the floor.
            low = _hanging_m(layout, rule, s) if rule.place == "hang" else max(s.low, 0.0)
            if layout.put(rule, family, asset, at, wall * 0.5 * math.pi, low):
                placed += 1
                break
    return placed


def _hanging_m(layout: Layout, rule: Rule, s: _Shape) -> float:
    """Height of the lowest point of what hangs on a wall."""
    if rule.middle_m[1]:
        return between(layout.rng, rule.middle_m) - 0.5 * (s.high - s.low)
    return between(layout.rng, rule.height_m)


def _weighted(weights: Sequence[float], draw: float) -> int:
    left = draw * sum(weights)
    for k, weight in enumerate(weights):
        left -= weight
        if left < 0.0:
            return k
    return len(weights) - 1


def _free(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Anywhere on the floor: furniture square to the walls, small things at any angle."""
    placed = 0
    (mx, my), (sx, sy, _) = layout.room.center_m, layout.room.size_m
    for _ in range(wanted):
        for _ in range(_TRIES):
            family, asset = _draw_asset(layout, rule, options)
            s = layout.shape(asset)
            small = max(s.half_x, s.half_y) < 0.65
            yaw = (
                layout.signed(math.pi) if small else draw_count(layout.rng, (0, 3)) * 0.5 * math.pi
            )
            at = (mx + layout.signed(0.5 * sx - 0.1), my + layout.signed(0.5 * sy - 0.1))
            if layout.put(rule, family, asset, at, yaw, 0.0):
                placed += 1
                break
    return placed


def _relatives(layout: Layout, rule: Rule) -> list[int]:
    return [k for k, p in enumerate(layout.pieces) if p.role in rule.of]


def _relative(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Before, beside, around, above or under another piece, or against the wall that it faces."""
    found = _relatives(layout, rule)
    placed = 0
    used: set[tuple[int, int]] = set()
    if not found:
        return 0
    for number in range(wanted):
        for attempt in range(_TRIES):
            k = (
                found[number % len(found)]
                if attempt < _TRIES // 2 and rule.place != "around"
                else found[min(int(layout.rng.random() * len(found)), len(found) - 1)]
            )
            family, asset = _draw_asset(layout, rule, options)
            if rule.place in ("front", "above", "under", "across") and (k, 0) in used:
                layout.refused["another one is there"] += 1
                continue
            if _put_relative(layout, rule, family, asset, k):
                used.add((k, 0))
                placed += 1
                break
    return placed


def _put_relative(layout: Layout, rule: Rule, family: str, asset: str, k: int) -> bool:
    ref = layout.pieces[k]
    x, y, c, sn, a, b = ref.footprint
    s = layout.shape(asset)
    gap = between(layout.rng, rule.gap_m)
    dx, dy, yaw, low = 0.0, 0.0, ref.yaw_rad, 0.0
    match rule.place:
        case "front":
            dx, dy = a + gap + s.half_x, layout.signed(0.25 * b)
            yaw += math.pi + (layout.signed(0.35) if gap != 0.0 and s.half_y < 0.4 else 0.0)
        case "beside":
            dx = s.half_x - a
            dy = (b + gap + s.half_y) * (1 if layout.rng.random() < 0.5 else -1)
            # Beside what hangs, at the same height.
            if ref.low_m > _HANGS_M:
                low = 0.5 * (ref.low_m + ref.high_m) - 0.5 * (s.high - s.low)
        case "around":
            side = draw_count(layout.rng, (0, 3))
            sc, ss = direction(side)
            reach, free = (a, b) if side % 2 == 0 else (b, a)
            away = reach + gap + s.half_x
            aside = layout.signed(max(free - s.half_y, 0.0))
            dx, dy = sc * away - ss * aside, ss * away + sc * aside
            yaw += side * 0.5 * math.pi + math.pi + layout.signed(0.15)
        case "above":
            dx, low = s.half_x - a - WALL_GAP_M + 0.0005, min(ref.high_m, 0.91) + gap
        case "under":
            dx = layout.signed(0.1) + (declared(ref.family, "under_share", 0.0) * a)
            yaw += 0.0
        case _:
            return _put_across(layout, rule, family, asset, k)
    at = (x + c * dx - sn * dy, y + sn * dx + c * dy)
    return layout.put(rule, family, asset, at, yaw, low, ignore=k)


def _put_across(layout: Layout, rule: Rule, family: str, asset: str, k: int) -> bool:
    ref, room = layout.pieces[k], layout.room
    wall = round(ref.yaw_rad / (0.5 * math.pi) + 2) % 4
    s = layout.shape(asset)
    c, sn = direction(wall)
    x, y = ref.footprint[0] - room.center_m[0], ref.footprint[1] - room.center_m[1]
    along = -x * sn + y * c + layout.signed(0.4)
    at = room.at_wall(wall, along, s.half_x + WALL_GAP_M)
    return layout.put(rule, family, asset, at, wall * 0.5 * math.pi, 0.0)


def _on(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """On the tops of other pieces; at most ``wanted`` on each."""
    placed = 0
    for k in _relatives(layout, rule) if wanted else []:
        ref = layout.pieces[k]
        x, y, c, sn, a, b = ref.footprint
        family, asset = _draw_asset(layout, rule, options)
        s = layout.shape(asset)
        dx = rule.at[0] * max(a - s.half_x, 0.0)
        dy = rule.at[1] * max(b - s.half_y, 0.0) * (1 if layout.rng.random() < 0.5 else -1)
        at = (x + c * dx - sn * dy, y + sn * dx + c * dy)
        if s.half_x <= a + 0.03 and s.half_y <= b + 0.03:
            placed += layout.put(rule, family, asset, at, ref.yaw_rad, ref.high_m, ignore=k)
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
        family, asset = _draw_asset(layout, rule, options)
        s = layout.shape(asset)
        x, y, z = ref.pose.apply(np.array([edges[0]]))[0].tolist()
        c, sn = _cos_sin(ref.yaw_rad)
        at = (x + c * s.x - sn * s.y, y + sn * s.x + c * s.y)
        placed += layout.put(rule, family, asset, at, ref.yaw_rad, z + s.low, ignore=k)
    return placed


def _windows(layout: Layout) -> list[Opening]:
    return [o for o in layout.room.openings if o.kind == "window"]


def _at_windows(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Curtains at both sides of windows, in pairs."""
    placed = 0
    for opening in _windows(layout)[: (wanted + 1) // 2]:
        family, asset = _draw_asset(layout, rule, options)
        s = layout.shape(asset)
        low = max(0.015, min(opening.high_m + 0.14, layout.room.size_m[2] - 0.04) - s.high)
        before = len(layout.pieces)
        for side in (-1, 1):
            along = opening.along_m + side * (0.5 * opening.width_m + s.half_y)
            at = layout.room.at_wall(opening.wall, along, s.half_x + 0.06)
            layout.put(rule, family, asset, at, opening.wall * 0.5 * math.pi, low)
        if len(layout.pieces) < before + 2:
            del layout.pieces[before:]
        placed += len(layout.pieces) - before
    return placed


def _below_windows(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Under the middle of windows."""
    placed = 0
    for opening in _windows(layout)[:wanted]:
        family, asset = _draw_asset(layout, rule, options)
        s = layout.shape(asset)
        low = between(layout.rng, rule.height_m)
        at = layout.room.at_wall(opening.wall, opening.along_m, s.half_x + 0.0005)
        placed += layout.put(rule, family, asset, at, opening.wall * 0.5 * math.pi, low)
    return placed


def _at_doors(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """On the wall at a side of doors."""
    placed = 0
    doors = [o for o in layout.room.openings if o.kind == "door"]
    for opening in doors[:wanted]:
        family, asset = _draw_asset(layout, rule, options)
        s = layout.shape(asset)
        low = between(layout.rng, rule.height_m)
        side = 1 if layout.rng.random() < 0.5 else -1
        for way in (side, -side):
            along = opening.along_m + way * (0.5 * opening.width_m + 0.12 + s.half_y)
            at = layout.room.at_wall(opening.wall, along, s.half_x + 0.0005)
            if layout.put(rule, family, asset, at, opening.wall * 0.5 * math.pi, low):
                placed += 1
                break
    return placed


def _at_ceiling(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """In a row, or in two rows from four on, under the ceiling; all of one kind."""
    (mx, my), (sx, sy, height) = layout.room.center_m, layout.room.size_m
    family, asset = _draw_asset(layout, rule, options)
    s = layout.shape(asset)
    rows = 2 if wanted >= 4 else 1
    columns = math.ceil(wanted / rows)
    placed = 0
    for k in range(wanted):
        u, v = (k % columns + 0.5) / columns - 0.5, (k // columns + 0.5) / rows - 0.5
        across = (u, v) if sx >= sy else (v, u)
        at = (mx + across[0] * sx, my + across[1] * sy)
        placed += layout.put(
            rule, family, asset, at, 0.5 * math.pi * (sx >= sy), height - (s.high - s.low)
        )
    return placed


_PLACES = {
    "wall": _at_wall,
    "corner": _at_wall,
    "hang": _at_wall,
    "free": _free,
    "front": _relative,
    "beside": _relative,
    "around": _relative,
    "above": _relative,
    "under": _relative,
    "across": _relative,
    "on": _on,
    "window": _at_windows,
    "below": _below_windows,
    "ceiling": _at_ceiling,
    "door": _at_doors,
    "over": _over,
}


@dataclass(frozen=True, slots=True)
class Support:
    """A level surface of a piece that carries things.

    Attributes:
        height_m: World height.
        clearance_m: Free height above.
        middle_m, half_m: Middle and half extents of the surface in the piece's footprint.
        is_top: Whether it is the piece's top, which may be round.
    """

    height_m: float
    clearance_m: float
    middle_m: tuple[float, float]
    half_m: tuple[float, float]
    is_top: bool = False


def supports(piece: Piece, assets: AssetIndex) -> list[Support]:
    """Surfaces of a piece that carry things."""
    height, half = piece.high_m - piece.low_m, piece.footprint[4:]
    corners = [k.position_m for k in assets.keypoints(piece.asset) if k.name == SUPPORT]
    if corners:
        (x0, y0, z), (x1, y1, _) = corners
        low, high = assets.bounds_m(piece.asset)
        middle = tuple(
            0.5 * (a + b) - 0.5 * (c + d)
            for a, b, c, d in zip((x0, y0), (x1, y1), low[:2], high[:2], strict=True)
        )
        free = (0.5 * (x1 - x0), 0.5 * (y1 - y0))
        return [Support(piece.position_m[2] + z, 0.35, (middle[0], middle[1]), free)]
    if declared(piece.family, "seat", False):
        # Seats of packs do not say where they are level.
        return []
    edge_x, edge_y = declared(piece.family, "border_m", _BORDER_M)
    inner = (half[0] - edge_x, half[1] - edge_y)
    levels_m = declared(piece.family, "levels_m", None)
    if levels_m is not None:
        levels = levels_m(round(height, 6))
        free_m = height / len(levels) - 0.05
        return [Support(piece.low_m + z, free_m, (0.0, 0.0), inner) for z in levels]
    pitch_m = declared(piece.family, "pallet_pitch_m", None)
    if pitch_m is not None:
        return [Support(k * pitch_m, pitch_m - 0.16, (0.0, 0.0), inner) for k in range(3)]
    return [Support(piece.high_m, 0.6, (0.0, 0.0), inner, is_top=True)]


def _insides(piece: Piece, assets: AssetIndex) -> list[Support]:
    """Boards of a piece behind its doors."""
    corners = [k.position_m for k in assets.keypoints(piece.asset) if k.name == INSIDE]
    low, high = assets.bounds_m(piece.asset)
    made = []
    for (x0, y0, z0), (x1, y1, z1) in zip(corners[::2], corners[1::2], strict=True):
        middle = (0.5 * (x0 + x1 - low[0] - high[0]), 0.5 * (y0 + y1 - low[1] - high[1]))
        half = (0.5 * (x1 - x0), 0.5 * (y1 - y0))
        made.append(Support(piece.position_m[2] + z0, z1 - z0, middle, half))
    return made


def _put_things(layout: Layout, rule: Rule, options: Options, clutter: float) -> None:
    """Small things on the surfaces of all pieces of a rule, apart from one another."""
    for k, piece in enumerate(list(layout.pieces)):
        if piece.role != rule.piece or piece.on >= 0 or piece.family not in rule.assets:
            continue
        near = [
            p
            for n, p in enumerate(layout.pieces)
            if n != k and overlap_of(p.footprint, piece.footprint)
        ]
        for board in _insides(piece, layout.assets) if rule.inside else ():
            stored = _put_thing(layout, rule.inside, options, k, board, near)
            if stored is not None:
                layout.pieces.append(stored)
        for support in supports(piece, layout.assets) if rule.things else ():
            if rule.filled[1]:
                _fill_board(layout, rule, options, k, support, near, clutter)
                continue
            for _ in range(round(draw_count(layout.rng, rule.how_many) * clutter)):
                placed = _put_thing(layout, rule.things, options, k, support, near)
                if placed is not None:
                    layout.pieces.append(placed)
                    near.append(placed)


def _put_thing(
    layout: Layout,
    things: Sequence[str],
    options: Options,
    k: int,
    support: Support,
    near: Sequence[Piece],
) -> Piece | None:
    """A thing on a surface of piece k; None if there is no place for it."""
    family = layout.pick(things)
    asset = layout.pick(options[family])
    s = layout.shape(asset)
    if not _fits(layout, s, support):
        return None
    for _ in range(_TRIES_ON):
        turn = layout.signed(math.pi if support.is_top else 0.25)
        if declared(family, "square", False) or (
            support.is_top and layout.rng.random() < _SQUARE_SHARE
        ):
            turn = 0.0
        reach = _reach(s, turn)
        free = support.half_m[0] - reach[0], support.half_m[1] - reach[1]
        if min(free) < 0.0:
            continue
        dx, dy = layout.signed(free[0]), layout.signed(free[1])
        placed = _thing_at(layout, family, asset, k, support, (dx, dy), turn)
        if not _is_taken(placed, near) and (
            not support.is_top or layout.is_on_top(placed.footprint, layout.pieces[k])
        ):
            return placed
    return None


def _fill_board(
    layout: Layout,
    rule: Rule,
    options: Options,
    k: int,
    support: Support,
    near: list[Piece],
    clutter: float,
) -> None:
    """Things side by side on a board, from one end on, near its front edge."""
    share = min(between(layout.rng, rule.filled) * clutter, _FULL)
    end = support.half_m[1] * (2.0 * share - 1.0)
    side = 1.0 if layout.rng.random() < 0.5 else -1.0
    at, failed = -support.half_m[1], 0
    while at < end and failed < _TRIES_ON:
        family = layout.pick(rule.things)
        asset = layout.pick(options[family])
        s = layout.shape(asset)
        turn = 0.0 if declared(family, "square", False) else layout.signed(0.12)
        reach = _reach(s, turn)
        free = support.half_m[0] - reach[0]
        if free < 0.0 or at + 2.0 * reach[1] > support.half_m[1] or not _fits(layout, s, support):
            failed += 1
            continue
        back = min(2.0 * free, 0.01 + 0.03 * float(layout.rng.random()))
        place = (free - back, side * (at + reach[1]))
        placed = _thing_at(layout, family, asset, k, support, place, turn)
        at += 2.0 * reach[1] + 0.003 + 0.05 * float(layout.rng.random()) ** 3
        if _is_taken(placed, near):
            failed += 1
            continue
        layout.pieces.append(placed)
        near.append(placed)


def _fits(layout: Layout, s: _Shape, support: Support) -> bool:
    """Whether a thing stands and is low enough for what is above a surface."""
    clearance_m = min(support.clearance_m, layout.room.size_m[2] - support.height_m)
    return s.rest is not None and s.high - s.low <= clearance_m


def _reach(s: _Shape, turn_rad: float) -> tuple[float, float]:
    """Half extents of a turned thing along depth and width of its surface [m]."""
    c, sn = abs(math.cos(turn_rad)), abs(math.sin(turn_rad))
    return s.half_x * c + s.half_y * sn, s.half_x * sn + s.half_y * c


def _thing_at(
    layout: Layout,
    family: str,
    asset: str,
    k: int,
    support: Support,
    at_m: tuple[float, float],
    turn_rad: float,
) -> Piece:
    """A thing on a surface of piece k, ``at_m`` from the surface's middle."""
    carrier, height = layout.pieces[k], support.height_m
    x, y, c, sn, _, _ = carrier.footprint
    s = layout.shape(asset)
    dx, dy = support.middle_m[0] + at_m[0], support.middle_m[1] + at_m[1]
    mx, my = x + c * dx - sn * dy, y + sn * dx + c * dy
    yaw = carrier.yaw_rad + turn_rad
    c2, s2 = _cos_sin(yaw)
    footprint: Rectangle = (mx, my, c2, s2, s.half_x, s.half_y)
    px, py = mx - c2 * s.x + s2 * s.y, my - s2 * s.x - c2 * s.y
    position = (round(px, 5), round(py, 5), round(height - s.low, 5))
    rest = UPRIGHT if s.rest is None else s.rest
    top = height + s.high - s.low
    return Piece("thing", family, asset, position, yaw, footprint, height, top, k, rest)


def _is_taken(thing: Piece, near: Sequence[Piece]) -> bool:
    """Whether something is where a thing would be."""
    return any(
        p.low_m < thing.high_m
        and thing.low_m < p.high_m - 1e-6
        and overlap_of(thing.footprint, p.footprint)
        for p in near
    )


def free_floor(
    room: Room, pieces: Sequence[Piece], margin_m: float
) -> tuple[NDArray[np.bool_], float, float]:
    """Cells of ``CELL_M`` on which a disc of radius ``margin_m`` can stand; [rows y, columns x].

    Also the world coordinates of the corner of the first cell.
    """
    (mx, my), (sx, sy, _) = room.center_m, room.size_m
    columns, rows = math.ceil(sx / CELL_M), math.ceil(sy / CELL_M)
    x0, y0 = mx - 0.5 * sx, my - 0.5 * sy
    x = x0 + (np.arange(columns) + 0.5) * CELL_M
    y = (y0 + (np.arange(rows) + 0.5) * CELL_M)[:, None]
    inside = (np.abs(x - mx) < 0.5 * sx - margin_m) & (np.abs(y - my) < 0.5 * sy - margin_m)
    free: NDArray[np.bool_] = np.broadcast_to(inside, (rows, columns)).copy()
    for piece in pieces:
        if piece.low_m >= _HEAD_M or _is_flat(piece.family):
            continue
        px, py, c, s, a, b = piece.footprint
        along, across = c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)
        free &= (np.abs(along) > a + margin_m) | (np.abs(across) > b + margin_m)
    return free, x0, y0


def find_unreachable(layout: Layout) -> str:
    """A door, or a piece with free floor before its front, that nobody can walk to; empty = none.

    Walking starts at the first door.
    """
    from scipy import ndimage

    fixed = [
        p for p in layout.pieces if p.role not in ("chair", "stool", "office_chair", "floor_things")
    ]
    free, x0, y0 = free_floor(layout.room, fixed, PERSON_M)
    regions, _ = ndimage.label(free)

    def region_at(zone: Rectangle) -> set[int]:
        x, y, c, s, a, b = zone
        found = set()
        for u in np.linspace(-0.9, 0.9, 9):
            for v in np.linspace(-0.9, 0.9, 9):
                px, py = x + c * u * a - s * v * b, y + s * u * a + c * v * b
                i, j = int((py - y0) / CELL_M), int((px - x0) / CELL_M)
                if 0 <= i < free.shape[0] and 0 <= j < free.shape[1]:
                    found.add(int(regions[i, j]))
        return found - {0}

    home: set[int] = set()
    for zone, owner in layout.zones:
        here = region_at(zone)
        if owner < 0 and not home:
            home = here
            if not home:
                return "door"
        elif not here & home:
            return "door" if owner < 0 else layout.pieces[owner].role
    return ""
