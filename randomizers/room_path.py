"""Walks through rooms: paths over free floor, at the speed of a person or a robot."""

import heapq
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import boxes, errors, interfaces, motion, se3, streams
from gen_data.core.scene import Body, Scene
from gen_data.randomizers import base, free_space

TRIES = 12
CELL_M = 0.1
KNOT_S = 0.1
_GOALS = 40
_FLAT_M = 0.03
"""Higher objects are in the way."""
_HEAD_M = 2.0
_TURN_S = 0.8
"""Time over which the heading follows the path."""


class RoomPath(base.RandomizerBase):
    """Moves a carrier of sensors along a path over free floor, through doors, without collision.

    Paths are shortest ones between drawn places on a grid of 0.1 m (Dijkstra 1959), smoothed, and
    drawn again where the smoothed one comes too near to something. The carrier looks ahead.

    Attributes:
        room: Name of the template's ``room_layout`` element.
        carrier: Name of the template's ``carrier`` element.
        speed_m_s: Speed: people walk at 1.4 m/s outdoors, and at half of that at home.
        radius_m: Radius of the carrier, and of the person who holds it.
        duration_s: Duration of the motion.
        sway_m: Amplitude of the sideways motion of a hand; vertically it is half of it, twice a
            second.
    """

    type: Literal["room_path"] = "room_path"
    stage: Literal["scene", "view"] = "view"
    room: str = "room"
    carrier: str = "carrier"
    speed_m_s: Annotated[dist.Positive, dist.Bounds(0.05, 3.0)] = dist.Uniform(0.3, 0.9)
    radius_m: float = Field(0.22, ge=0.05, le=1.0)
    duration_s: float = Field(6.0, gt=0.2, le=120)
    sway_m: dist.NonNegative = dist.Constant(0.0)

    @property
    def motion_duration_s(self) -> float:
        """Duration of the motion."""
        return self.duration_s

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the carrier on its path.

        Raises:
            ConfigError: there is no such room or carrier.
            LayoutRejected: no path of that length is free.
        """
        body, floors = self._find(scene)
        obstacles = _obstacles(scene, assets, self.room)
        doors = [
            b
            for b in scene.bodies
            if b.asset.startswith("door_frame") and b.name.startswith(f"{self.room}/")
        ]
        grid = _Grid(floors, doors, obstacles, assets, self.radius_m)
        speed, sway_m = self.speed_m_s.draw(rng), self.sway_m.draw(rng)
        wanted_m = speed * self.duration_s
        for _ in range(TRIES):
            path = grid.draw_path(wanted_m, rng)
            if path is None:
                continue
            points = _walk(path, speed, self.duration_s)
            if grid.is_free(points):
                poses = _poses(points, body.T_world_body.translation_m[2], sway_m)
                track = motion.Trajectory(body.name, KNOT_S, poses)
                tracks = (*(t for t in scene.tracks if t.body != body.name), track)
                return replace(
                    scene.with_bodies(replace(body, T_world_body=poses[0])), tracks=tracks
                )
        raise self.reject(
            "no free path through the room", "a smaller radius_m, speed_m_s or duration_s"
        )

    def _find(self, scene: Scene) -> tuple[Body, list[Body]]:
        field = f"randomizers.{self.name}"
        floors = [
            b
            for b in scene.bodies
            if b.name.startswith(f"{self.room}/") and b.name.endswith("/floor")
        ]
        if not floors:
            raise errors.ConfigError(
                f"{field}.room: the template has no element '{self.room}' of type room_layout"
            )
        if self.carrier not in [rig.name for rig in scene.rigs if rig.body]:
            raise errors.ConfigError(
                f"{field}.carrier: the template has no element '{self.carrier}' of type carrier"
            )
        return scene.body(scene.rig(self.carrier).body), floors


def _obstacles(scene: Scene, assets: interfaces.AssetIndex, room: str) -> list[boxes.Rectangle]:
    """Footprints of a walker's obstacles: furniture and open doors."""
    found = []
    for body in scene.bodies:
        if not (body.group == room or body.name.endswith("/leaf")):
            continue
        bounds = assets.bounds_m(body.asset)
        z = body.T_world_body.translation_m[2]
        if z + bounds[0][2] < _HEAD_M and z + bounds[1][2] > _FLAT_M:
            found.append(free_space.Footprint.of(body.T_world_body, bounds, body.scale).rectangle)
    return found


class _Grid:
    """Places where a walker fits, as cells over all rooms; row = y, column = x."""

    def __init__(
        self,
        floors: Sequence[Body],
        doors: Sequence[Body],
        obstacles: Sequence[boxes.Rectangle],
        assets: interfaces.AssetIndex,
        radius_m: float,
    ) -> None:
        rooms = [_extent(b, assets) for b in floors]
        x0, y0 = min(r[0] for r in rooms), min(r[1] for r in rooms)
        columns = math.ceil((max(r[2] for r in rooms) - x0) / CELL_M)
        rows = math.ceil((max(r[3] for r in rooms) - y0) / CELL_M)
        self._corner = (x0, y0)
        x = x0 + (np.arange(columns) + 0.5) * CELL_M
        y = (y0 + (np.arange(rows) + 0.5) * CELL_M)[:, None]
        free: NDArray[np.bool_] = np.zeros((rows, columns), np.bool_)
        for a, b, c, d in rooms:
            inside_x = (x > a + radius_m) & (x < c - radius_m)
            free |= inside_x & (y > b + radius_m) & (y < d - radius_m)
        for door in doors:
            (lx, ly, _), (hx, hy, _) = assets.bounds_m(door.asset)
            half_across = 0.5 * (hy - ly) - 0.05 - 0.03 - radius_m
            place = free_space.Footprint.of(door.T_world_body, ((lx, ly, 0.0), (hx, hy, 0.0)))
            px, py, c, s, _, _ = place.rectangle
            along, across = c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)
            free |= (np.abs(along) < 0.5 * (hx - lx) + radius_m + CELL_M) & (
                np.abs(across) < max(half_across, 0.06)
            )
        for px, py, c, s, a, b in obstacles:
            along, across = np.abs(c * (x - px) + s * (y - py)), np.abs(c * (y - py) - s * (x - px))
            beyond = np.maximum(along - a, 0.0) ** 2 + np.maximum(across - b, 0.0) ** 2
            free &= beyond > radius_m * radius_m
        self._free = free

    def is_free(self, points_m: se3.Array) -> bool:
        """Whether all points [n, 2] are in free cells, or next to one."""
        i = np.floor((points_m[:, 1] - self._corner[1]) / CELL_M).astype(np.intp)
        j = np.floor((points_m[:, 0] - self._corner[0]) / CELL_M).astype(np.intp)
        return bool(self._free[i, j].all())

    def draw_path(self, wanted_m: float, rng: streams.Rng) -> se3.Array | None:
        """A path [n, 2] of at least that length over several goals; None if there is none."""
        cells = np.argwhere(self._free)
        if not len(cells):
            return None
        here = tuple(int(v) for v in cells[min(int(rng.random() * len(cells)), len(cells) - 1)])
        path = [here]
        for _ in range(_GOALS):
            goal = tuple(int(v) for v in cells[min(int(rng.random() * len(cells)), len(cells) - 1)])
            leg = self._shortest(path[-1], (goal[0], goal[1]))
            if leg is None or len(leg) < 8:
                continue
            path += leg[1:]
            smooth = self._smoothed(path)
            if _length_m(smooth) >= wanted_m + 0.2:
                return smooth
        return None

    def _shortest(
        self, start: tuple[int, ...], goal: tuple[int, ...]
    ) -> list[tuple[int, ...]] | None:
        rows, columns = self._free.shape
        best, came = {start: 0.0}, {start: start}
        queue = [(0.0, start)]
        while queue:
            cost, cell = heapq.heappop(queue)
            if cell == goal:
                path = [goal]
                while path[-1] != start:
                    path.append(came[path[-1]])
                return path[::-1]
            if cost > best[cell]:
                continue
            for di in (-1, 0, 1):
                for dj in (-1, 0, 1):
                    i, j = cell[0] + di, cell[1] + dj
                    if (
                        not (di or dj)
                        or not (0 <= i < rows and 0 <= j < columns)
                        or not self._free[i, j]
                    ):
                        continue
                    reached = cost + (1.4142 if di and dj else 1.0)
                    if reached < best.get((i, j), math.inf):
                        best[i, j], came[i, j] = reached, cell
                        heapq.heappush(queue, (reached, (i, j)))
        return None

    def _smoothed(self, path: Sequence[tuple[int, ...]]) -> se3.Array:
        x0, y0 = self._corner
        points = np.array([(x0 + (j + 0.5) * CELL_M, y0 + (i + 0.5) * CELL_M) for i, j in path])
        for _ in range(6):
            inner = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
            points = np.concatenate([points[:1], inner, points[-1:]])
        return points


def _extent(body: Body, assets: interfaces.AssetIndex) -> tuple[float, float, float, float]:
    (x0, y0, _), (x1, y1, _) = assets.bounds_m(body.asset)
    x, y, _ = body.T_world_body.translation_m
    return (x + x0, y + y0, x + x1, y + y1)


def _length_m(points: se3.Array) -> float:
    steps = np.diff(points, axis=0)
    return float(np.sqrt((steps**2).sum(axis=1)).sum())


def _walk(path: se3.Array, speed_m_s: float, duration_s: float) -> se3.Array:
    """Points [n, 2] along a path at even steps of time."""
    steps = np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = speed_m_s * KNOT_S * np.arange(math.ceil(duration_s / KNOT_S) + 1)
    return np.stack([np.interp(at, along, path[:, k]) for k in (0, 1)], axis=1)


def _poses(points: se3.Array, z_m: float, sway_m: float) -> tuple[se3.SE3, ...]:
    """Poses that look ahead; the heading follows the path smoothly."""
    ahead = round(_TURN_S / KNOT_S)
    later = np.concatenate([points[ahead:], np.repeat(points[-1:], ahead, axis=0)])
    way = later - points
    # At the end nothing lies ahead: the last heading stays.
    known = int((np.abs(way).sum(axis=1) > 1e-3).nonzero()[0][-1])
    way[known + 1 :] = way[known]
    poses = []
    for k, ((x, y), (dx, dy)) in enumerate(zip(points.tolist(), way.tolist(), strict=True)):
        yaw, phase = math.atan2(dy, dx), 2.0 * math.pi * k * KNOT_S
        side, up = sway_m * math.sin(phase), 0.5 * sway_m * math.sin(2.0 * phase)
        at = (x - side * math.sin(yaw), y + side * math.cos(yaw), z_m + up)
        poses.append(se3.SE3.about_z(yaw, at).rounded())
    return tuple(poses)
