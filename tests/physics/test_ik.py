"""Inverse kinematics."""

from __future__ import annotations

import math

import numpy as np

from generator.core.kinematics import all_positions, is_arm_joint, link_poses, within_limits
from generator.core.se3 import SE3
from generator.physics.ik import Chain, chain_of, solutions
from tests.physics.panda import panda

ROBOT = panda()
assert ROBOT.gripper is not None
GRIPPER = ROBOT.gripper
CHAIN: Chain = chain_of(ROBOT, GRIPPER)


def grasp_pose(arm_positions: tuple[float, ...]) -> SE3:
    """``T_base_grasp`` by forward kinematics."""
    poses = link_poses(ROBOT, SE3(), all_positions(ROBOT, arm_positions, 1.0))
    return poses[GRIPPER.link] @ GRIPPER.T_link_grasp


def test_poses_made_by_forward_kinematics_are_reached() -> None:
    """At least 97 of 100 random poses, within 1 mm, half a degree and all limits."""
    rng = np.random.Generator(np.random.Philox(key=2))
    arm = [joint for joint in ROBOT.movable if is_arm_joint(joint, ROBOT)]
    reached = 0

    for _ in range(100):
        target = grasp_pose(tuple(float(rng.uniform(j.lower, j.upper)) for j in arm))
        found = next(solutions(CHAIN, target), None)
        if found is None:
            continue
        reached += 1
        pose = grasp_pose(found)
        assert math.dist(pose.translation_m, target.translation_m) < 1e-3
        cosine = 0.5 * (np.trace(pose.rotation().T @ target.rotation()) - 1.0)
        assert math.acos(min(1.0, float(cosine))) < math.radians(0.5)
        assert within_limits(ROBOT, all_positions(ROBOT, found, 1.0))

    assert reached >= 97


def test_what_is_too_far_away_has_no_solution() -> None:
    """Two metres from the base, an arm of 0.86 m finds nothing."""
    assert list(solutions(CHAIN, SE3((2.0, 0.0, 0.3)))) == []


def test_what_only_an_endless_wrist_could_reach_has_no_solution() -> None:
    """Just beyond the stretched arm every start is tried, and none pretends to arrive."""
    assert list(solutions(CHAIN, SE3((0.0, 0.0, 1.40)))) == []


def test_the_solution_next_to_home_comes_first() -> None:
    """The home pose itself is solved by the home position."""
    home = ROBOT.home[:7]

    assert next(solutions(CHAIN, grasp_pose(home))) == home
