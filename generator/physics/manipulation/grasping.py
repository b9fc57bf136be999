"""Grasps: the pose of an object between the fingers of a gripper, and their opening."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gen_data.core.asset_types import Gripper, RobotModel
from gen_data.core.kinematics import all_positions, finger_links, link_poses, rigid_group
from gen_data.core.se3 import IDENTITY, SE3, Array, Vec3
from gen_data.physics.manipulation.suction import is_sealed, needed_force_n, rim_depths_m
from gen_data.physics.world import World

_PALM_GAP_M = 0.002
_PAD_GAP_M = 0.002
"""The links on both sides must come this near to the object between them."""
_CUP_GAP_M = 0.0005
"""Between the rim of a cup and the object that it holds: they touch without overlapping."""
_PLAY_M = 0.0005
"""Between each finger and the body that it pulls or turns, to keep rigid fingers from jamming."""
_CLOSING_STEPS = 16
"""Steps of 5 mm, or less than a finger is thick: none passes through a wall between two."""
_BISECTIONS = 14
"""Halvings of the opening: a stroke of 8 cm is closed to within 5 micrometres."""

_UPRIGHT_AXES: tuple[Vec3, ...] = ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
"""Directions of the object's Z in the grasp frame: back into the hand, or to one of its sides."""


@dataclass(frozen=True, slots=True)
class Grasp:
    """A gripper opening in [0, 1] and the held object's pose in the grasp frame; None = empty."""

    opening: float
    T_grasp_held: SE3 | None = None


class Hand:
    """The gripper of a robot in a world.

    Args:
        robot: The robot's model.
        gripper: Its gripper.
        world: Has a body for every link.
        body: Name of a link's body.
    """

    def __init__(
        self, robot: RobotModel, gripper: Gripper, world: World, body: Callable[[str], str]
    ) -> None:
        self._robot = robot
        self._gripper = gripper
        self._world = world
        self._body = body
        solid = [link for link in robot.links if link in robot.collisions]
        fingers = finger_links(robot)
        palm = rigid_group(robot, gripper.link)
        self._fingers = [link for link in solid if link in fingers]
        self._palm = [link for link in solid if link in palm]
        self._arm_home = [0.0] * len(robot.movable)
        self._known: dict[tuple[str, Vec3], Grasp | None] = {}

    @property
    def stroke_m(self) -> float:
        """Distance between its fingers when they are open."""
        return self._gripper.stroke_m

    @property
    def sucks(self) -> bool:
        """Whether it holds by a suction cup instead of fingers."""
        return self._gripper.cup is not None

    def grasp(self, held: str, T_world_grasp: SE3) -> Grasp | None:
        """The grasp that holds a body as upright as the hand allows; None if it does not fit."""
        up = max(_UPRIGHT_AXES, key=lambda axis: float(T_world_grasp.rotate(np.array(axis))[2]))
        if (held, up) not in self._known:
            self._known[held, up] = self._close_fingers(held, up)
        return self._known[held, up]

    def grasp_in_place(self, held: str, T_grasp_held: SE3) -> Grasp | None:
        """The grasp of a body at a given pose in the grasp frame, centred along Y.

        None if the open fingers penetrate it, or the closed ones touch it on one side only.
        """
        self._pose_hand(1.0)
        self._world.place(held, T_grasp_held)
        pose = self._center_pose(held, T_grasp_held)
        if not self._clear(held, 1.0) or self._touches_palm(held):
            return None
        opening = self._narrowest(held)
        sides = self._sides
        self._pose_hand(opening)
        gaps_m = [self._side_gap_m(side, held, _PAD_GAP_M) for side in sides]
        if opening <= 0.0 or max(gaps_m) >= _PAD_GAP_M:
            return None
        return Grasp(opening, pose)

    def suck_in_place(self, held: str, T_world_held: SE3, T_world_above: SE3) -> Grasp | None:
        """The grasp of a resting body by a cup that comes straight down on it.

        None if the cup does not seal, or cannot bear the body's weight.

        Args:
            held: Name of the body.
            T_world_held: Its pose.
            T_world_above: Pose of the cup above it.
        """
        cup = self._gripper.cup
        if cup is None or self._world.mass_kg(held) <= 0.0:
            return None
        self._world.place(held, T_world_held)
        weight_n = needed_force_n(self._world.mass_kg(held), np.zeros(3))
        depth_m = float(rim_depths_m(self._world, held, T_world_above, cup).min())
        if weight_n > cup.force_n or not np.isfinite(depth_m):
            return None
        T_world_grasp = T_world_above @ SE3((0.0, 0.0, depth_m - _CUP_GAP_M))
        if not is_sealed(self._world, held, T_world_grasp, cup):
            return None
        return Grasp(0.0, T_world_grasp.inverse() @ T_world_held)

    def opening_around(self, body: str, T_world_grasp: SE3, play: bool = True) -> float:
        """Opening of fingers about a body where it is, with some play; 0 if they do not meet it."""
        met = self._narrowest(body, T_world_grasp)
        if not play:
            return met
        return min(1.0, met + 2.0 * _PLAY_M / self._gripper.stroke_m) if met > 0.0 else 0.0

    def palm_height_m(self) -> float:
        """Distance from the palm forward to the grasp frame's origin."""
        self._pose_hand(1.0)
        return -self._palm_z_m() - _PALM_GAP_M

    def tip_depth_m(self) -> float:
        """Distance from the grasp frame's origin forward to the finger tips."""
        self._pose_hand(1.0)
        return max(
            (float(self._world.bounds_m(self._body(f))[1][2]) for f in self._fingers), default=0.0
        )

    def _touches_palm(self, held: str) -> bool:
        return any(self._world.gap_m(self._body(link), held, 0.0) < 0.0 for link in self._palm)

    def _close_fingers(self, held: str, up: Vec3) -> Grasp | None:
        self._world.place(held, SE3())
        low, high = self._world.bounds_m(held)
        self._pose_hand(1.0)
        pose = _between_fingers(low, high, up, self._palm_z_m())
        self._world.place(held, pose)
        pose = self._center_pose(held, pose)
        if not self._clear(held, 1.0):
            return None
        opening = self._narrowest(held)
        return None if opening <= 0.0 else Grasp(opening, pose)

    def _narrowest(self, held: str, T_world_grasp: SE3 = IDENTITY) -> float:
        """The opening at which the closing fingers first meet the object; 0 if they never do.

        Closed fingers may be free of it again, in the hole of a ring.
        """
        steps = [k / _CLOSING_STEPS for k in range(_CLOSING_STEPS)]
        if not self._clear(held, 0.0, T_world_grasp):
            steps = [0.0]
        meets = (k for k in reversed(steps) if not self._clear(held, k, T_world_grasp))
        touching = next(meets, None)
        if touching is None:
            return 0.0
        free = min((k for k in steps if k > touching), default=1.0)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (touching + free)
            if self._clear(held, middle, T_world_grasp):
                free = middle
            else:
                touching = middle
        return free

    def _center_pose(self, held: str, pose: SE3) -> SE3:
        """The pose shifted along Y to the middle between the open fingers."""
        limit_m = self._gripper.stroke_m
        below_m, above_m = (self._side_gap_m(side, held, limit_m) for side in self._sides)
        shifted = SE3((0.0, 0.5 * (above_m - below_m), 0.0)) @ pose
        self._world.place(held, shifted)
        return shifted

    @cached_property
    def _sides(self) -> tuple[list[str], list[str]]:
        """Links of the fingers at negative and at positive Y; opens the hand to find them.

        A finger may have several links: its pad, and bars behind it.
        """
        self._pose_hand(1.0)
        low = [link for link in self._fingers if self._middle(link)[1] < 0.0]
        return low, [link for link in self._fingers if link not in low]

    def _side_gap_m(self, side: Sequence[str], held: str, limit_m: float) -> float:
        gaps_m = (self._world.gap_m(self._body(link), held, limit_m) for link in side)
        return min(gaps_m, default=limit_m)

    def _clear(self, held: str, opening: float, T_world_grasp: SE3 = IDENTITY) -> bool:
        self._pose_hand(opening, T_world_grasp)
        return all(
            self._world.gap_m(self._body(link), held, limit_m=0.0) >= 0.0 for link in self._fingers
        )

    def _pose_hand(self, opening: float, T_world_grasp: SE3 = IDENTITY) -> None:
        """Place hand and fingers, by default with the grasp frame in the world frame."""
        gripper = self._gripper
        positions = all_positions(self._robot, self._arm_home, opening)
        poses = link_poses(self._robot, SE3(), positions)
        T_grasp_base = (poses[gripper.link] @ gripper.T_link_grasp).inverse()
        for link in (*self._fingers, *self._palm):
            self._world.place(self._body(link), T_world_grasp @ T_grasp_base @ poses[link])

    def _palm_z_m(self) -> float:
        """Largest coordinate of the palm along the grasp frame's Z."""
        return max(
            (float(self._world.bounds_m(self._body(link))[1][2]) for link in self._palm),
            default=-np.inf,
        )

    def _middle(self, link: str) -> Array:
        low, high = self._world.bounds_m(self._body(link))
        middle: Array = 0.5 * (low + high)
        return middle


def _between_fingers(low_m: Array, high_m: Array, up: Vec3, palm_z_m: float) -> SE3:
    """``T_grasp_held``: narrow side along Y, centre at the origin or just clear of the palm.

    Args:
        low_m: Low corner of the object in its own frame, [3].
        high_m: High corner, [3].
        up: The object's Z in the grasp frame.
        palm_z_m: Front of the palm along the grasp frame's Z.
    """
    half, center = 0.5 * (high_m - low_m), 0.5 * (high_m + low_m)
    across = np.array([0.0, 1.0, 0.0])
    z_axis = np.array(up)
    if half[0] <= half[1]:
        columns = [across, np.cross(z_axis, across), z_axis]
    else:
        columns = [np.cross(across, z_axis), across, z_axis]
    rotation = np.stack(columns, axis=1)
    depth = float((np.abs(rotation[2]) * half).sum())
    ahead = (0.0, 0.0, max(0.0, depth + palm_z_m + _PALM_GAP_M))
    return SE3.from_rotation(rotation, ahead) @ SE3(tuple(-float(v) for v in center))  # type: ignore[arg-type]
