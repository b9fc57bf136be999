"""Motion of pedestrians: along paths, around each other, and over crosswalks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array
from gen_data.traffic.pedestrian_paths import GRID_M, Path
from gen_data.traffic.signal_cycles import Approach
from gen_data.traffic.steering import normalize
from gen_data.traffic.vehicle_model import CrossingPedestrian

Indices = NDArray[np.int64]

AHEAD_M = 0.8
"""Lookahead along the path."""
SEEN_M, BESIDE_M = 3.5, 0.75
"""Distances ahead and to the side within which people make room for each other."""
SIDESTEP_M_S = 0.7
TIGHT_M, SLOW_M_S = 0.05, 0.4
"""Lateral error above which people slow down, and the speed to which they do."""
NEAR_M = 0.62
"""Smallest distance between the centres of two people."""
TOUCH_M = 0.31
"""Smallest distance between a person's centre and an obstacle."""
CHANGE_M_S2 = 2.0
"""Acceleration of pedestrians."""
TURN_PER_S = 4.0
"""Rate of turning to the walking direction: inverse of a time constant."""
AT_KERB_M = 2.0
"""Distance to a crosswalk at which people ask to cross."""
HURRY = 1.25
"""Factor on the walking speed to finish crossing before vehicles get green."""


@dataclass(frozen=True, slots=True)
class Pedestrian:
    """A person on foot.

    Attributes:
        xy_m: Start position.
        ahead: Start direction, unit.
        speed_m_s: Free walking speed; 0 = standing.
        path: Path to walk; None = standing.
        left_m: Preferred offset to the left of the path.
    """

    name: str
    xy_m: tuple[float, float]
    ahead: tuple[float, float]
    speed_m_s: float = 0.0
    path: Path | None = None
    left_m: float = 0.0


class Pedestrians:
    """State of n pedestrians; ``step`` changes it.

    They start at full walking speed, except people who stand.

    Attributes:
        obstacles: Boxes of obstacles [b, 6]: centre, half extents, cosine and sine of the yaw.
        xy_m, ahead: Positions and directions [n, 2].
        speed_m_s: Speeds [n].
        walked_m: Distances walked [n].
        at_m: Stations on the paths [n].
        off_m: Targeted offsets to the left of the paths [n].
    """

    def __init__(
        self, walkers: Sequence[Pedestrian], approaches: Mapping[str, Approach], obstacles: Array
    ) -> None:
        self.walkers = walkers
        self.approaches = approaches
        n = len(walkers)
        paths = [w.path for w in walkers]
        longest = max((len(p.points_m) for p in paths if p is not None), default=2)
        self._lines, self._sides = np.zeros((n, longest, 3)), np.zeros((n, longest, 2))
        for k, path in enumerate(paths):
            if path is not None:
                m = len(path.points_m)
                rows = np.minimum(np.arange(longest), m - 1)
                self._lines[k] = path.points_m[rows]
                self._sides[k] = np.stack([path.right_m[rows], path.left_m[rows]], axis=1)
        self.xy_m: Array = np.array([w.xy_m for w in walkers]).reshape(n, 2)
        self.ahead: Array = np.array([w.ahead for w in walkers]).reshape(n, 2)
        self._wanted = np.array([w.speed_m_s if w.path else 0.0 for w in walkers])
        self._end_m = np.array([w.path.end_m if w.path else 0.0 for w in walkers])
        self.speed_m_s: Array = self._wanted.copy()
        self.walked_m, self.at_m = np.zeros(n), np.zeros(n)
        self.off_m = np.array([w.left_m for w in walkers])
        self.height_m = self._lines[:, 0, 2].copy()
        self.obstacles = _select_near_boxes(obstacles, self._lines)
        self._asks = [False] * n
        self._let = [
            sum(p.from_m < 0.05 for p in path.passages) if path is not None else 0 for path in paths
        ]

    def crossers(self) -> list[CrossingPedestrian]:
        """Everybody on a crosswalk or at its kerb, except people who wait for their signal."""
        found = []
        for k, walker in enumerate(self.walkers):
            passages = walker.path.passages if walker.path is not None else ()
            if self._let[k] > 0 or self._asks[k]:
                passage = passages[self._let[k] - (0 if self._asks[k] else 1)]
                done = float(self.at_m[k]) - passage.from_m
                if done < passage.to_m - passage.from_m + 0.3:
                    covered = passage.length_m - (passage.to_m - passage.from_m)
                    at_m = covered + max(done, 0.0)
                    at_m = at_m if passage.forward else passage.length_m - at_m
                    found.append(
                        CrossingPedestrian(passage.crosswalk, at_m, passage.forward, self._asks[k])
                    )
        return found

    def step(self, time_s: float, step_s: float, lets_pass: Callable[[str], bool]) -> None:
        """Advance by one step.

        Args:
            time_s: Time at the start of the step.
            step_s: Duration of the step.
            lets_pass: Whether no vehicle is on a crosswalk or too fast to stop before it.
        """
        if not len(self.walkers):
            return
        room_m = self._room_m(time_s, lets_pass)
        rows = np.arange(len(self.walkers))
        k = np.minimum(((self.at_m + AHEAD_M) / GRID_M).astype(np.int64), self._lines.shape[1] - 3)
        along = normalize(self._lines[rows, k + 1, :2] - self._lines[rows, k, :2])
        target = self._lines[rows, k, :2] + self.off_m[:, None] * _left_normals(along)
        # Interpolate between grid points, for a smooth walk.
        target += (self.at_m + AHEAD_M - GRID_M * k)[:, None] * along
        to = target - self.xy_m
        away = np.sqrt(to[:, 0] * to[:, 0] + to[:, 1] * to[:, 1])
        way = normalize(to)
        push, limit = self._avoid_people(way)
        limit = np.minimum(limit, self._sidestep(push, rows, k, step_s))
        goal = np.minimum(np.minimum(self._wanted, limit), room_m / 0.5)
        change = np.clip(goal - self.speed_m_s, -3.0 * CHANGE_M_S2 * step_s, CHANGE_M_S2 * step_s)
        self.speed_m_s = np.where(goal < 0.02, 0.0, self.speed_m_s + change)
        self._advance(way, away, step_s)

    def _advance(self, way: Array, away: Array, step_s: float) -> None:
        """Move everybody whose way is free, and turn them to their walking direction."""
        moves = self._avoid_obstacles(way * (self.speed_m_s * step_s)[:, None])
        delta = self.xy_m[None] - self.xy_m[:, None]
        before = delta[..., 0] * delta[..., 0] + delta[..., 1] * delta[..., 1]
        after = delta - moves[:, None]
        squared = after[..., 0] * after[..., 0] + after[..., 1] * after[..., 1]
        hits: NDArray[np.bool_] = (squared < NEAR_M * NEAR_M) & (squared < before)
        np.fill_diagonal(hits, val=False)
        free: NDArray[np.bool_] = np.logical_not(hits.any(axis=1))
        self.speed_m_s = np.where(free, self.speed_m_s, 0.0)
        moves = np.where(free[:, None], moves, 0.0)
        gone = np.sqrt(moves[:, 0] * moves[:, 0] + moves[:, 1] * moves[:, 1])
        self.xy_m = self.xy_m + moves
        self.walked_m = self.walked_m + gone
        # The target point slows down for people behind it and speeds up for people close to it.
        self.at_m = self.at_m + gone * np.clip(1.5 - 0.5 * away / AHEAD_M, 0.0, 1.5)
        share = np.minimum(1.0, TURN_PER_S * step_s) * (gone > 0.0)
        cosine = self.ahead[:, 0] * way[:, 0] + self.ahead[:, 1] * way[:, 1]
        aim = np.where(cosine[:, None] < -0.9, _left_normals(self.ahead), way)
        self.ahead = normalize(self.ahead + share[:, None] * (aim - self.ahead))
        k = np.minimum((self.at_m / GRID_M).astype(np.int64), self._lines.shape[1] - 2)
        f = self.at_m / GRID_M - k
        rows = np.arange(len(k))
        a, b = self._lines[rows, k, 2], self._lines[rows, k + 1, 2]
        self.height_m = a + np.minimum(f, 1.0) * (b - a)

    def _avoid_obstacles(self, moves: Array) -> Array:
        """Remove the component of each move [n, 2] that leads into the nearest obstacle."""
        if not len(self.obstacles):
            return moves
        x, y, hx, hy, c, s = self.obstacles.T
        dx, dy = self.xy_m[:, :1] - x, self.xy_m[:, 1:] - y
        u, v = c * dx + s * dy, c * dy - s * dx
        # Vector from the nearest point of the box to the person, in the box's axes.
        u, v = u - np.clip(u, -hx, hx), v - np.clip(v, -hy, hy)
        away = np.sqrt(u * u + v * v)
        rows, k = np.arange(len(away)), np.argmin(away, axis=1)
        near, u, v = away[rows, k], u[rows, k], v[rows, k]
        scale = 1.0 / np.maximum(near, 1e-6)
        out = np.stack([c[k] * u - s[k] * v, s[k] * u + c[k] * v], axis=1) * scale[:, None]
        into = np.minimum(moves[:, 0] * out[:, 0] + moves[:, 1] * out[:, 1], 0.0)
        too_far = np.minimum(into + np.maximum(near - TOUCH_M, 0.0), 0.0)
        kept: Array = moves - too_far[:, None] * out
        return kept

    def _room_m(self, time_s: float, lets_pass: Callable[[str], bool]) -> Array:
        """Length of path that everybody may walk [n]: up to kerbs, and the end."""
        room = np.maximum(self._end_m - self.at_m, 0.0)
        for k, walker in enumerate(self.walkers):
            if walker.path is None or self._let[k] >= len(walker.path.passages):
                continue
            passage = walker.path.passages[self._let[k]]
            left = passage.from_m - 0.3 - float(self.at_m[k])
            if left > AT_KERB_M:
                continue
            self._asks[k] = self._may_cross(passage.crosswalk, passage.length_m, k, time_s)
            if self._asks[k] and lets_pass(passage.crosswalk):
                self._let[k] += 1
                self._asks[k] = False
            elif left < 1.0:
                room[k] = min(float(room[k]), max(left, 0.0))
        return room

    def _may_cross(self, crosswalk: str, length_m: float, k: int, time_s: float) -> bool:
        """Whether the signals leave enough time to cross."""
        approach = self.approaches.get(crosswalk)
        if approach is None:
            return True
        needed_s = (length_m + 1.5) / (HURRY * max(float(self._wanted[k]), 0.5))
        return approach.red_left_s(time_s) > needed_s

    def _avoid_people(self, way: Array) -> tuple[Array, Array]:
        """Avoidance of other people: side to step to [n], and largest speed [n]."""
        rel = self.xy_m[None] - self.xy_m[:, None]
        x = rel[..., 0] * way[:, :1] + rel[..., 1] * way[:, 1:]
        y = rel[..., 1] * way[:, :1] - rel[..., 0] * way[:, 1:]
        velocity = self.speed_m_s[:, None] * self.ahead
        theirs = velocity[None, :, 0] * way[:, :1] + velocity[None, :, 1] * way[:, 1:]
        closing = self.speed_m_s[:, None] - theirs
        met = (x > 0.05) & (x < SEEN_M) & (np.abs(y) < BESIDE_M) & (closing > 0.1)
        near = np.where(met, x, np.inf)
        who = np.argmin(near, axis=1)
        rows = np.arange(len(who))
        aside = np.where(y[rows, who] < -0.1, 1.0, -1.0)
        push = np.where(near[rows, who] < np.inf, aside, 0.0)
        before = np.where((x > 0.05) & (np.abs(y) < NEAR_M - 0.05), x, np.inf)
        pace = np.maximum(before - NEAR_M - 0.1, 0.0) / 0.6 + np.maximum(theirs, 0.0)
        return push, np.where(before < np.inf, pace, np.inf).min(axis=1)

    def _sidestep(self, push: Array, rows: Indices, k: Indices, step_s: float) -> Array:
        """Shift the offsets within their bounds; return speeds [n] that leave time for it."""
        low, high = self._sides[rows, k, 0], self._sides[rows, k, 1]
        home = np.array([w.left_m for w in self.walkers])
        back = np.clip(home - self.off_m, -0.2 * step_s, 0.2 * step_s)
        aim = self.off_m + np.where(push == 0.0, back, push * SIDESTEP_M_S * step_s)
        aim = np.clip(aim, low, high)
        most = SIDESTEP_M_S * step_s
        self.off_m = self.off_m + np.clip(aim - self.off_m, -most, most)
        return np.where(np.abs(self.off_m - aim) > TIGHT_M, SLOW_M_S, np.inf)


def _select_near_boxes(boxes: Array, lines: Array) -> Array:
    """Select the boxes near any path [n, m, 3]."""
    if not len(lines) or not len(boxes):
        return np.zeros((0, 6))
    low, high = lines[..., :2].min(axis=1) - SEEN_M, lines[..., :2].max(axis=1) + SEEN_M
    size = np.sqrt(boxes[:, 2] * boxes[:, 2] + boxes[:, 3] * boxes[:, 3])[:, None]
    near = (boxes[None, :, :2] + size > low[:, None]) & (boxes[None, :, :2] - size < high[:, None])
    kept: Array = boxes[near.all(axis=2).any(axis=0)]
    return kept


def _left_normals(vectors: Array) -> Array:
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)


def stride_m(height_m: float) -> float:
    """Length of a stride, two steps [m].

    Legs of 0.53 body heights cover it at the hip angles of level walking (Winter 2009). It agrees
    with Murray, Drought and Kory (1964): 0.9 body heights at a free speed of 1.5 m/s for adult men,
    less when slower.
    """
    return 0.8 * height_m
