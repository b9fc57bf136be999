"""Measures of simulated bodies, which decide whether a task has succeeded."""

import math
from collections.abc import Mapping

import numpy as np

from gen_data.core.scene import HAND, BodyJoint, Condition
from gen_data.core.se3 import SE3, Array
from gen_data.physics.world import World, joint_position

GAP_MAX_M = 0.1
"""Gaps are measured up to this distance."""


class Measures:
    """Measurements of ``Condition``, in a world.

    Args:
        world: Has all bodies that conditions name.
        start: ``{name: T_world_body}`` of all bodies that can move, at time 0.
        joints: Joints of bodies, by body.
    """

    def __init__(
        self, world: World, start: Mapping[str, SE3], joints: Mapping[str, BodyJoint]
    ) -> None:
        self._world, self._start, self._joints = world, start, joints

    def value(self, condition: Condition, hand_m: Array) -> float:
        """Value of a condition's measure now, with the origin of the grasp frame at ``hand_m``."""
        world, body, other = self._world, condition.body, condition.other
        if condition.measure == "gap":
            return world.gap_m(body, other, GAP_MAX_M)
        if condition.measure == "tilt":
            up = np.array([0.0, 0.0, 1.0])
            cosine = float(world.pose(body).rotate(up) @ self._start[body].rotate(up))
            return math.acos(max(-1.0, min(1.0, cosine)))
        if condition.measure == "travel":
            return joint_position(self._joints[body], self._start[body], world.pose(body))
        low, high = self._bounds(body, hand_m)
        other_low, other_high = self._bounds(other, hand_m)
        if condition.measure == "height":
            return float(low[2] - other_high[2])
        size = 2 if condition.measure == "offset" else 3
        apart = 0.5 * (low + high - other_low - other_high)[:size]
        return math.sqrt(float(apart @ apart))

    def middle_m(self, name: str, hand_m: Array) -> Array:
        """Middle of a body's box along the axes of the world [m], shape [3]."""
        low, high = self._bounds(name, hand_m)
        middle: Array = 0.5 * (low + high)
        return middle

    def _bounds(self, name: str, hand_m: Array) -> tuple[Array, Array]:
        return (hand_m, hand_m) if name == HAND else self._world.bounds_m(name)
