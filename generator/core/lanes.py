"""Places along lanes."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from generator.core.scene import Lane
from generator.core.se3 import SE3, Vec3


@dataclass(frozen=True)
class LaneLine:
    """A lane's centre line by arc length.

    Attributes:
        at_m: Arc length of each point, from 0.
    """

    lane: Lane
    at_m: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Measure the line."""
        points = np.asarray(self.lane.center_m, dtype=np.float64)
        steps = np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1))
        object.__setattr__(self, "at_m", tuple(np.concatenate([[0.0], np.cumsum(steps)]).tolist()))

    @property
    def length_m(self) -> float:
        """Of the whole lane."""
        return self.at_m[-1]

    def pose(self, at_m: float, left_m: float = 0.0) -> SE3:
        """``T_world_place``: on the ground, X in the direction of travel, Z up.

        Args:
            at_m: Arc length, clamped to the lane.
            left_m: How far to the left of the centre line.
        """
        points = self.lane.center_m
        k = min(max(bisect_right(self.at_m, at_m) - 1, 0), len(points) - 2)
        a, b = points[k], points[k + 1]
        span_m = self.at_m[k + 1] - self.at_m[k]
        t = min(max((at_m - self.at_m[k]) / span_m, 0.0), 1.0)
        yaw = math.atan2(b[1] - a[1], b[0] - a[0])
        x, y, z = (p + t * (q - p) for p, q in zip(a, b, strict=True))
        return SE3.about_z(yaw, (x - left_m * math.sin(yaw), y + left_m * math.cos(yaw), z))


def standing_on_lane(
    T_world_place: SE3,
    lane: Lane,
    bounds_m: tuple[Vec3, Vec3],
    facing: Literal["along", "left"],
    turn_rad: float = 0.0,
) -> SE3:
    """``T_world_body`` of something whose lowest point stands on a place of a lane.

    Its middle is at the place; on a ``frontage``, its front is.

    Args:
        T_world_place: As ``LaneLine.pose`` gives it.
        lane: Where the place is.
        facing: Where fronts point there.
        bounds_m: Its smallest and largest coordinates, scale included.
        turn_rad: How far it is turned from where it should face.
    """
    (x0, y0, z0), (x1, y1, _) = bounds_m
    if facing == "left":
        turn_rad += 0.5 * math.pi
    anchor = x1 if lane.kind == "frontage" else 0.5 * (x0 + x1)
    return T_world_place @ SE3.about_z(turn_rad) @ SE3((-anchor, -0.5 * (y0 + y1), -z0))
