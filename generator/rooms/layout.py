"""The state of a room being furnished: placed pieces, the floor that they need, and collisions.

A candidate is refused with a reason; ``Conflict`` names the most frequent one of the rule that
could not be satisfied.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from gen_data.assets.families import declared
from gen_data.core import bounded_cache, interfaces, streams
from gen_data.core.boxes import Rectangle, overlap_of
from gen_data.core.se3 import SE3, Array, Quaternion, Vec3
from gen_data.rooms import floor_plan, resting, rules

Options = Mapping[str, Sequence[str]]
"""Ids of assets by family."""
Drawn = tuple[str, str]
"""Family and id of a drawn asset."""
HEAD_M = 1.9
_CROWDED = 0.25
"""Distance within which a piece before a window hides it."""
_SILL_M = 0.026
"""Height of sills below the openings of windows."""
_OFF_SILLS_M = 0.005
"""Distance of objects from sills."""
_TOP_M = 0.003
"""Depth of the rounded border of tops."""
_EDGE_OF_TOP_M = 0.008
_TOPS: bounded_cache.ObjectCache[dict[str, Array]] = bounded_cache.ObjectCache(2)
_SHAPES: "bounded_cache.ObjectCache[dict[str, Shape]]" = bounded_cache.ObjectCache(2)


@dataclass(frozen=True, slots=True)
class Piece:
    """A placed piece.

    Attributes:
        role: Its name in the rules; ``thing`` for small objects.
        position_m, yaw_rad: Pose of its frame, world, Z up.
        footprint: Rectangle that it covers, world.
        low_m, high_m: Heights between which it extends.
        on: Index of the piece that carries it; -1 = none.
        rest: Turn of its frame, before ``yaw_rad``, with which it lies on a level surface.
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
    rest: Quaternion = resting.UPRIGHT

    @property
    def pose(self) -> SE3:
        """``T_world_piece``."""
        return SE3.about_z(self.yaw_rad, self.position_m) @ SE3(quaternion_wxyz=self.rest)


@dataclass(frozen=True, slots=True)
class Neighbor:
    """The piece that another one belongs to; the other may stand on the floor that it needs.

    Attributes:
        piece: Its index; -2 = none.
        carries: Whether the other one rests on it.
        is_enclosed: Whether the other one hangs around it.
    """

    piece: int = -2
    carries: bool = False
    is_enclosed: bool = False


ALONE = Neighbor()


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
class Shape:
    """Bounds of an asset at rest [m]: middle of its footprint, half extents, lowest and highest.

    Attributes:
        rest: Turn of its frame with which it lies on a level surface; None if there is none.
    """

    x: float
    y: float
    half_x: float
    half_y: float
    low: float
    high: float
    rest: Quaternion | None


# A room looks up the facts of a few dozen families a hundred thousand times.
@lru_cache(maxsize=1024)
def is_flat(family: str) -> bool:
    """Whether pieces of a family lie on the floor and others stand on them."""
    return bool(declared(family, "flat", False))


@lru_cache(maxsize=1024)
def _free_above_m(family: str) -> float:
    """Height above pieces of a family that others leave free."""
    return float(declared(family, "free_above_m", 0.0))


def _find_shape(assets: interfaces.AssetIndex, asset: str) -> Shape:
    low, high = assets.bounds_m(asset)
    rest: Quaternion | None = resting.UPRIGHT
    if declared(asset, "loose", False):
        points_m = np.asarray(assets.vertices_m(asset), np.float64)
        rest = resting.turn_to_rest(points_m)
        if rest is not None:
            turned_m = SE3(quaternion_wxyz=rest).apply(points_m)
            low, high = turned_m.min(axis=0).tolist(), turned_m.max(axis=0).tolist()
    (x0, y0, z0), (x1, y1, z1) = low, high
    middle, half = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), (0.5 * (x1 - x0), 0.5 * (y1 - y0))
    return Shape(*middle, *half, z0, z1, rest)


def _find_top(assets: interfaces.AssetIndex, asset: str) -> Array:
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

    room: floor_plan.Room
    assets: interfaces.AssetIndex
    rng: streams.Rng
    look: float = 0.0
    pieces: list[Piece] = field(default_factory=list)
    zones: list[tuple[Rectangle, int]] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)

    def shape(self, asset: str) -> Shape:
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
        rule: rules.Rule,
        drawn: Drawn,
        at: tuple[float, float],
        yaw_rad: float,
        low_m: float,
        near: Neighbor = ALONE,
    ) -> bool:
        """Place the middle of an asset's footprint at a point, unless something is in the way.

        Args:
            rule: Rule that the piece follows.
            drawn: Family and id of its asset.
            at: World coordinates of the middle of its footprint [m].
            yaw_rad: Turn about the vertical.
            low_m: Height of its lowest point.
            near: Piece that it belongs to.

        Returns:
            Whether it is placed; if not, ``refused`` counts the reason.
        """
        family, asset = drawn
        s = self.shape(asset)
        if s.rest is None:
            self.refused["does not stand by itself"] += 1
            return False
        c, sn = cos_sin(yaw_rad)
        footprint: Rectangle = (at[0], at[1], c, sn, s.half_x, s.half_y)
        high_m = low_m + s.high - s.low
        zone = _before(footprint, rule.clearance_m) if rule.clearance_m > 0.0 else None
        # Including its load.
        top_m = high_m + _free_above_m(family)
        reason = self.refuse(footprint, low_m, high_m, zone, near, flat=is_flat(family))
        if not reason and self.meets_sill(footprint, low_m, top_m):
            reason = "meets a sill"
        if reason:
            self.refused[reason] += 1
            return False
        x, y = at[0] - c * s.x + sn * s.y, at[1] - sn * s.x - c * s.y
        position = (round(x, 5), round(y, 5), round(low_m - s.low, 5))
        on = near.piece if near.carries else -1
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
        near: Neighbor,
        *,
        flat: bool,
    ) -> str:
        """Why something cannot be there; empty = it can.

        Args:
            footprint: Rectangle that it covers.
            low_m: Height of its lowest point.
            high_m: Height of its highest point.
            zone: Floor that it keeps free.
            near: Piece that it belongs to.
            flat: Whether it lies under others.
        """
        if not self.holds(footprint):
            return "no room between the walls"
        if high_m > self.room.size_m[2] + 1e-6:
            return "higher than the room"
        for k, other in enumerate(self.pieces):
            if (near.is_enclosed and k == near.piece) or flat != is_flat(other.family):
                continue
            if (
                low_m < other.high_m + _free_above_m(other.family) - 1e-6
                and other.low_m < high_m - 1e-6
                and overlap_of(footprint, other.footprint)
            ):
                return f"overlaps {other.role}"
        if not flat and low_m < HEAD_M:
            for free, owner in self.zones:
                if owner != near.piece and overlap_of(footprint, free):
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
            stands = other.low_m < HEAD_M and not is_flat(other.family)
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
        self, opening: floor_plan.Opening, reach_m: float = _CROWDED, beside_m: float = 0.0
    ) -> Rectangle:
        """The floor just before an opening, and next to that."""
        x, y = self.room.at_wall(opening.wall, opening.along_m, 0.5 * reach_m)
        c, s = floor_plan.direction(opening.wall)
        return (x, y, c, s, 0.5 * reach_m, 0.5 * opening.width_m + beside_m)


def cos_sin(yaw_rad: float) -> tuple[float, float]:
    """Cosine and sine, exact for multiples of a quarter turn."""
    quarter = yaw_rad / (0.5 * math.pi)
    if abs(quarter - round(quarter)) < 1e-9:
        return floor_plan.direction(round(quarter))
    return math.cos(yaw_rad), math.sin(yaw_rad)


def _before(footprint: Rectangle, depth_m: float) -> Rectangle:
    x, y, c, s, a, b = footprint
    ahead = a + 0.5 * depth_m
    return (x + c * ahead, y + s * ahead, c, s, 0.5 * depth_m, b)
