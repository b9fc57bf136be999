"""Entrances of houses that stand above the ground before them: stairs, and ramps for wheelchairs.

Ramps follow DIN 18040-1:2010, 4.3.8: they fall by at most 6 %, along runs of at most 6 m between
rests of 1.5 m, are 1.2 m wide between their handrails, and have 1.5 m x 1.5 m to turn at both ends.
2010 ADA Standards 405 allow 1 : 12.
"""

import math
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.assets import asset_ids, families
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.relief import Relief
from gen_data.core.scene import Body, Lane
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.randomizers import free_space
from gen_data.roads.cross_section import APRON_FALL_M, APRON_M

STAIRS = "stairs_m"
"""Families of houses that may have stairs before their doors declare under this name how far those
reach at most."""
RAMPS = "ramp_share"
"""Those families declare under this name the share of houses with stairs, and with room for a ramp,
that have one."""
_STAIRS_M, _LANDING_M, _STEPS_FROM_M, _STEPS_UNIT_M = 1.4, 1.1, 0.05, 0.05
"""Width of stairs before doors, depth of their landing; height above the ground from which on there
are any; their heights are multiples of the last."""
_RAMP_M, _TURN_M, _RUN_M, _FALL = 1.4, 1.5, 6.0, 0.06
"""Width of a ramp with its curbs, length of rests and of places to turn, longest run, gradient."""
_STEP_M, _SHORTEST_M, _LONGEST_M = 0.05, 1.0, 13.5
"""Lengths of ramps are multiples of the first, from the second up to two runs and a rest."""
_STOREY_M, _STEPS_WIDE_M, _EVEN_M = 1.0, 1.0, 0.05
"""Height of points at the foot of walls; half the width of the zone of steps at a door;
difference up to which fronts are one."""
_SILL_M = 0.2
"""Highest steps of a house itself above the landing of a ramp."""
_GAP_M, _HEADROOM_M, _DEEPEST_M = 0.08, 2.2, 1.0
"""Distance of a ramp from the wall, height up to which bays and balconies are in its way, and by
how much they may reach out from the door."""
_PATH_M, _PATH_SUNK_M = 1.6, 0.045
"""Width of the strip for the path between a ramp and the one to the door; depth of its slabs."""
_AT_DOOR_M = 0.7
"""A path whose middle is at most this far from a door leads to it."""
_NEAR_M = 25.0
"""Bodies farther than this from a door are not in the way of its ramp."""
_ALLEY = frozenset({"garden", "frontage"})
"""Lanes on which stairs and ramps may stand."""
_PAVED = frozenset({"garden_path"})
"""Families on which ramps may stand."""


@dataclass(frozen=True, eq=False, slots=True)
class Ways:
    """The pieces of the middles of lanes in plan, and half their widths.

    Attributes:
        start_m, step_m: [n, 2].
        half_m: [n].
    """

    start_m: Array
    step_m: Array
    half_m: Array

    @classmethod
    def of(cls, lanes: Iterable[Lane]) -> "Ways":
        """The pieces of all lanes."""
        lines = [(np.asarray(lane.center_m)[:, :2], 0.5 * lane.width_m) for lane in lanes]
        none = np.zeros((0, 2))
        return cls(
            np.concatenate([none, *(line[:-1] for line, _ in lines)]),
            np.concatenate([none, *(np.diff(line, axis=0) for line, _ in lines)]),
            np.concatenate([none[:, 0], *(np.full(len(line) - 1, w) for line, w in lines)]),
        )

    def reach(self, place_m: Array) -> bool:
        """Whether a place [2] is on any of the lanes."""
        return bool(self.beyond_m(place_m[None])[0] == 0.0)

    def beyond_m(self, places_m: Array) -> Array:
        """Distances [n] of places [n, 2] from the nearest edge of the lanes; 0 on them."""
        nearest: Array = self._distances_m(places_m).min(axis=1, initial=np.inf)
        return np.maximum(nearest, 0.0)

    def near(self, place_m: Array, radius_m: float) -> "Ways":
        """The pieces that come nearer than a radius to a place [2]."""
        is_near = self._distances_m(place_m[None])[0] < radius_m
        return Ways(self.start_m[is_near], self.step_m[is_near], self.half_m[is_near])

    def _distances_m(self, places_m: Array) -> Array:
        """Distances of places [n, 2] from the edges of all pieces, below 0 on them."""
        away = self.start_m - places_m[:, None]
        share = -(away * self.step_m).sum(axis=2) / (self.step_m * self.step_m).sum(axis=1)
        off = away + np.clip(share, 0.0, 1.0)[..., None] * self.step_m
        distances: Array = np.hypot(off[..., 0], off[..., 1]) - self.half_m
        return distances


@dataclass(frozen=True, eq=False, slots=True)
class Land:
    """Ground before houses.

    Attributes:
        ways: Lanes on which nothing of a house may stand.
        gardens: Lanes between the street and the houses.
        relief: Relief of the ground.
    """

    ways: Ways
    gardens: Ways
    relief: Relief

    @classmethod
    def of(cls, lanes: Sequence[Lane], relief: Relief) -> "Land":
        """The ground along lanes of the level world."""
        ways = Ways.of(lane for lane in lanes if lane.kind not in _ALLEY)
        return cls(ways, Ways.of(lane for lane in lanes if lane.kind == "garden"), relief)


def doors(body: Body, assets: AssetLibrary) -> list[Vec3]:
    """Keypoints at the doors of a house, in its frame."""
    return [k.position_m for k in assets.keypoints(body.asset) if k.name == "door"]


def fronts_m(
    house: Body, y_m: tuple[float, float], assets: AssetLibrary
) -> list[tuple[tuple[float, float], float]]:
    """Parts of the front of a house in its frame, from right to left of its first door.

    Args:
        house: It has a door.
        y_m: From its right to its left end.
        assets: Library with the house.

    Returns:
        For each part its ends in y, and the largest x of the wall up to 1 m above the floor;
        steps at doors do not count. One part if both reach out by the same.
    """
    points = assets.vertices_m(house.asset)
    low = points[points[:, 2] < points[:, 2].min() + _STOREY_M]
    places = doors(house, assets)
    for _, y, _ in places:
        low = low[np.abs(low[:, 1] - y) > _STEPS_WIDE_M]
    middle = places[0][1]
    right, left = (
        house.scale * float(low[side, 0].max(initial=0.0))
        for side in (low[:, 1] < middle, low[:, 1] > middle)
    )
    if abs(right - left) < _EVEN_M:
        return [(y_m, max(right, left))]
    return [((y_m[0], house.scale * middle), right), ((house.scale * middle, y_m[1]), left)]


def entrances(
    house: Body, floor_m: float, level: Sequence[Body], land: Land, assets: AssetLibrary
) -> list[Body]:
    """Stairs and ramps from the doors of a house down to the ground before them.

    Args:
        house: In the level world.
        floor_m: Rise of the house above it.
        level: All bodies in the level world.
        land: The ground on which they stand.
        assets: Library with all bodies.
    """
    lifted = SE3((0.0, 0.0, floor_m)) @ house.T_world_body
    made: list[Body] = []
    for number, door in enumerate(doors(house, assets)):
        x, y = house.scale * door[0], house.scale * door[1]
        at = lifted @ SE3((x, y, 0.0))
        rise_m = at.translation_m[2] - float(land.relief.height(np.array([at.translation_m]))[0])
        if rise_m < _STEPS_FROM_M:
            continue
        slabs = _slabs(at, level, assets) if number == 0 and _has_ramp(house) else None
        site = _Site(house, np.array([x, y, 0.0]), at, slabs or 0, land, assets)
        ramp = None if slabs is None else _ramp(site, level)
        made.append(_stairs(site, rise_m, ramp, f"{house.name}/stairs{number}"))
        made += ramp.bodies(site, f"{house.name}/ramp{number}") if ramp else ()
    return made


@dataclass(frozen=True, eq=False, slots=True)
class _Site:
    """Ground and walls around a door.

    Attributes:
        house: In the level world.
        door_m: Place of the door in the frame of the house.
        T_world_door: The door at the height of the floor, X away from the house.
        slabs: Seed of the path to the door.
        land: The ground.
        assets: Library with all bodies.
    """

    house: Body
    door_m: Array
    T_world_door: SE3
    slabs: int
    land: Land
    assets: AssetLibrary

    def ground_m(self, places_m: Array) -> Array:
        """Height of the ground above the floor at places [..., 2] in the frame of the door.

        Gardens are as high as the house before it was lifted; behind them the apron of the road
        falls.
        """
        flat = places_m.reshape(-1, 2)
        world = self.T_world_door.apply(np.column_stack([flat, np.zeros(len(flat), np.float64)]))
        top_m = self.house.T_world_body.translation_m[2]
        middle = world[:, :2].mean(axis=0)
        reach_m = float(np.hypot(*(world[:, :2] - middle).T).max())
        gardens = self.land.gardens.near(middle, reach_m + APRON_M)
        behind = np.minimum(gardens.beyond_m(world[:, :2]) / APRON_M, 1.0)
        level_m = top_m - behind * (top_m + APRON_FALL_M)
        over = self.land.relief.height(world) + level_m - self.T_world_door.translation_m[2]
        heights: Array = over.reshape(places_m.shape[:-1])
        return heights

    def front_m(self, side: float, reach_m: float) -> float:
        """How far base, walls and bays on a side of the door reach out from it."""
        parts = fronts_m(self.house, (0.0, 0.0), self.assets)
        base_m = parts[-1 if side > 0.0 else 0][1] - float(self.door_m[0])
        x, y, z = (self.assets.vertices_m(self.house.asset) * self.house.scale - self.door_m).T
        aside = side * y
        near = (aside > 0.5 * _TURN_M) & (aside < 0.5 * _TURN_M + reach_m) & (z < _HEADROOM_M)
        return max(0.0, base_m, float(x[near].max(initial=0.0)))

    @property
    def sill_m(self) -> float:
        """Height of the steps that the house itself has before its door."""
        x, y, z = (self.assets.vertices_m(self.house.asset) * self.house.scale - self.door_m).T
        at_door = (np.abs(y) < 0.5 * _STAIRS_M) & (x > 0.1) & (x < _LANDING_M) & (z < _STOREY_M)
        return float(z[at_door].max(initial=0.0))

    @property
    def stone(self) -> int:
        """Seed of stairs and ramp."""
        return _seed(self.house.asset) % 4


def _seed(asset: str) -> int:
    seed = asset_ids.parse_asset_id(asset).parameters.get("seed")
    return seed if isinstance(seed, int) else 0


def _slabs(T_world_door: SE3, level: Sequence[Body], assets: AssetLibrary) -> int | None:
    """Seed of the paved path to a door; None if there is none."""
    for body in level:
        if body.asset.partition("?")[0] in _PAVED:
            x, y, _ = body.T_world_body.inverse().apply(np.array(T_world_door.translation_m))
            (x0, _, _), (x1, _, _) = assets.bounds_m(body.asset)
            if x0 - _LANDING_M < x < x1 + _LANDING_M and abs(y) < _AT_DOOR_M:
                return _seed(body.asset)
    return None


def _has_ramp(house: Body) -> bool:
    """Whether a house has a ramp, by a digest of its id and its place."""
    share = families.declared(house.asset, RAMPS, None) or 0.0
    x, y, _ = house.T_world_body.translation_m
    digest = zlib.crc32(f"{house.asset} {x:.3f} {y:.3f}".encode())
    return digest < share * 2.0**32


@dataclass(frozen=True, eq=False, slots=True)
class _Ramp:
    """A ramp along a front.

    Attributes:
        side: 1 = to the left of someone who leaves the house, -1 = to the right.
        inner_m: Distance of its near edge from the door.
        length_m: In plan.
        depth_m: Depth of the lowest ground below it, below the floor.
    """

    side: float
    inner_m: float
    length_m: float
    depth_m: float

    @property
    def landing_m(self) -> float:
        """Depth of the landing from which stairs and ramp lead down."""
        return self.inner_m + _TURN_M

    def footprint(self, site: _Site) -> free_space.Footprint:
        """Ground of the ramp, of the place to turn at its end, and of the path back."""
        low = self.side * 0.5 * _TURN_M
        high = low + self.side * (self.length_m + _TURN_M)
        bounds = ((self.inner_m, min(low, high), 0.0),
                  (self.inner_m + _RAMP_M + _PATH_M, max(low, high), 0.0))  # fmt: skip
        return free_space.Footprint.of(site.T_world_door, bounds)

    def bodies(self, site: _Site, name: str) -> Iterator[Body]:
        """The ramp, the place to turn at its end, and the path back to the one to the door."""
        high_m = (math.ceil(self.depth_m / _STEPS_UNIT_M) + 2) * _STEPS_UNIT_M
        rests = [way for way in (_RUN_M, _RUN_M + _TURN_M) if way < self.length_m]
        stations = np.array([0.0, *rests, self.length_m])
        tops = np.column_stack([stations, high_m - _fall_m(stations)]).round(4)
        values: dict[str, float | tuple[float, ...]] = {
            "tops_m": tuple(tops.ravel().tolist()), "width_m": _RAMP_M, "seed": site.stone,
        }  # fmt: skip
        start = (self.inner_m + 0.5 * _RAMP_M, self.side * 0.5 * _TURN_M, -high_m)
        pose = site.T_world_door @ SE3.about_z(self.side * 0.5 * math.pi, start)
        asset = str(asset_ids.AssetId("door_ramp", values))
        yield Body(name, asset, pose.rounded(), collides=False)
        far = self.side * (0.5 * _TURN_M + self.length_m + 0.5 * _TURN_M)
        outer = self.inner_m + _RAMP_M + 0.5 * _PATH_M
        yield _paved(site, f"{name}/turn", (self.inner_m + 0.5, far), (outer + 0.5 * _PATH_M, far))
        yield _paved(site, f"{name}/path", (outer, far), (outer, 0.0))


def _paved(site: _Site, name: str, start: tuple[float, float], end: tuple[float, float]) -> Body:
    """A path between two places in the frame of a door, as the ground leads."""
    (x0, y0), (x1, y1) = start, end
    z0, z1 = (float(site.ground_m(np.array(place))) for place in (start, end))
    long_m = math.hypot(x1 - x0, y1 - y0)
    half_rise = 0.5 * math.atan2(z1 - z0, long_m)
    tilt = SE3(quaternion_wxyz=(math.cos(half_rise), 0.0, -math.sin(half_rise), 0.0))
    middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1) - _PATH_SUNK_M)
    pose = site.T_world_door @ SE3.about_z(math.atan2(y1 - y0, x1 - x0), middle) @ tilt
    values: dict[str, float | int] = {"length_m": round(long_m, 2), "seed": site.slabs}
    return Body(name, str(asset_ids.AssetId("garden_path", values)), pose.rounded(), collides=False)


def _ramp(site: _Site, level: Sequence[Body]) -> _Ramp | None:
    """The shorter one of the ramps that fit on both sides of a door; None where none does."""
    if site.sill_m > _SILL_M:
        return None
    possible = [ramp for side in (1.0, -1.0) if (ramp := _along_front(site, side)) is not None]
    taken = free_space.Ground()
    x, y, _ = site.T_world_door.translation_m
    for body in level if possible else ():
        there = body.T_world_body.translation_m
        if (
            body.instance_id
            and body.name != site.house.name
            and (
                math.dist(there[:2], (x, y)) < _NEAR_M
                and body.asset.partition("?")[0] not in _PAVED
            )
        ):
            bounds = free_space.standing_bounds_m(site.assets, body.asset)
            taken.add(free_space.Footprint.of(body.T_world_body, bounds, body.scale))
    for ramp in sorted(possible, key=lambda ramp: ramp.length_m):
        ground = ramp.footprint(site)
        x, y, c, s, half_x, half_y = ground.rectangle
        corners = [(x + c * a * half_x - s * b * half_y, y + s * a * half_x + c * b * half_y)
                   for a in (-1.0, 1.0) for b in (-1.0, 0.0, 1.0)]  # fmt: skip
        if taken.is_free(ground) and not any(site.land.ways.reach(np.array(at)) for at in corners):
            return ramp
    return None


def _along_front(site: _Site, side: float) -> _Ramp | None:
    """The ramp along a side of a front that ends where it meets the ground."""
    length_m = _LONGEST_M
    for _ in range(2):
        # The walls that a shorter ramp passes may reach out less.
        inner_m = round(site.front_m(side, min(length_m, _RUN_M)) + _GAP_M, 2)
        if inner_m > _DEEPEST_M:
            return None
        ways_m: Array = _STEP_M * np.arange(1, round(_LONGEST_M / _STEP_M) + 1, dtype=np.float64)
        across = inner_m + _RAMP_M * np.array([0.0, 0.5, 1.0])
        places = np.stack(np.broadcast_arrays(
            across[:, None], side * (0.5 * _TURN_M + ways_m)
        ), axis=-1)  # fmt: skip
        ground = site.ground_m(places)
        over = -_fall_m(ways_m) - ground[1]
        meets = np.flatnonzero(over <= 0.01)
        if not len(meets) or ways_m[meets[0]] < _SHORTEST_M:
            return None
        length_m = round(float(ways_m[meets[0]]), 2)
    depth_m = -float(ground[:, : meets[0] + 1].min())
    return _Ramp(side, inner_m, length_m, max(depth_m, float(_fall_m(length_m))))


def _fall_m(ways_m: Array | float) -> Array:
    """Heights that a ramp has lost at distances from its upper end, in plan."""
    rest = np.clip(np.asarray(ways_m) - _RUN_M, 0.0, _TURN_M)
    fall: Array = _FALL * (np.asarray(ways_m) - rest)
    return fall


def _stairs(site: _Site, rise_m: float, ramp: _Ramp | None, name: str) -> Body:
    """Stairs from a door to the ground before it."""
    # The lowest step lies in the ground, which slopes along the stairs' width.
    high_m = (math.ceil(rise_m / _STEPS_UNIT_M) + 2) * _STEPS_UNIT_M
    values: dict[str, float] = {
        "rise_m": round(high_m, 2),
        "width_m": _STAIRS_M,
        "seed": site.stone,
    }
    if ramp is not None:
        values |= {"width_m": _TURN_M, "landing_m": round(ramp.landing_m, 2)}
    pose = (site.T_world_door @ SE3((0.0, 0.0, -high_m))).rounded()
    return Body(name, str(asset_ids.AssetId("door_stairs", values)), pose, collides=False)
