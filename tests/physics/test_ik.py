"""Inverse kinematics."""

import math

import numpy as np
import pytest

from gen_data.core.asset_types import Gripper, Joint, RobotModel
from gen_data.core.kinematics import all_positions, is_arm_joint, is_within_limits, link_poses
from gen_data.core.se3 import SE3
from gen_data.physics.manipulation.inverse_kinematics import Chain, make_chain, solve_all
from tests.physics.panda import panda

ROBOT = panda()
assert ROBOT.gripper is not None
GRIPPER = ROBOT.gripper
CHAIN: Chain = make_chain(ROBOT, GRIPPER)


def grasp_pose(arm_positions: tuple[float, ...]) -> SE3:
    poses = link_poses(ROBOT, SE3(), all_positions(ROBOT, arm_positions, 1.0))
    return poses[GRIPPER.link] @ GRIPPER.T_link_grasp


def test_poses_made_by_forward_kinematics_are_reached() -> None:
    """At least 97 of 100 random poses, within 1 mm, half a degree and all limits."""
    rng = np.random.Generator(np.random.Philox(key=2))
    arm = [joint for joint in ROBOT.movable if is_arm_joint(joint, ROBOT)]
    reached = 0

    for _ in range(100):
        target = grasp_pose(tuple(float(rng.uniform(j.lower, j.upper)) for j in arm))
        found = next(solve_all(CHAIN, target), None)
        if found is None:
            continue
        reached += 1
        pose = grasp_pose(found)
        assert math.dist(pose.translation_m, target.translation_m) < 1e-3
        cosine = 0.5 * (np.trace(pose.rotation().T @ target.rotation()) - 1.0)
        assert math.acos(min(1.0, float(cosine))) < math.radians(0.5)
        assert is_within_limits(ROBOT, all_positions(ROBOT, found, 1.0))

    assert reached >= 97


def test_what_is_too_far_away_has_no_solution() -> None:
    """Two metres from the base, an arm of 0.86 m finds nothing."""
    assert list(solve_all(CHAIN, SE3((2.0, 0.0, 0.3)))) == []


def test_what_only_an_endless_wrist_could_reach_has_no_solution() -> None:
    """Just beyond the stretched arm every start is tried, and none pretends to arrive."""
    assert list(solve_all(CHAIN, SE3((0.0, 0.0, 1.40)))) == []


def test_the_solution_next_to_home_comes_first() -> None:
    """The home pose itself is solved by the home position."""
    home = ROBOT.home[:7]

    assert next(solve_all(CHAIN, grasp_pose(home))) == home


def levelled_arm() -> RobotModel:
    """Two arms of 0.5 m in a plane, and a hand that the linkage keeps level.

    As in a palletizer: ``q_hand = -q_shoulder - q_elbow`` is not one mimic, hence the elbow
    mimics the shoulder, ``-2 q + 0.2``, and the hand the elbow, ``0.5 q_elbow - 0.1``: the
    hand is at ``-q``.
    """

    def joint(number: int, x_m: float, mimic: str, multiplier: float, offset: float) -> Joint:
        return Joint(
            f"j{number}", "revolute", f"l{number}", f"l{number + 1}", SE3((x_m, 0.0, 0.0)),
            (0.0, 0.0, 1.0), -3.0, 3.0, mimic,
            mimic_multiplier=multiplier, mimic_offset=offset,
        )  # fmt: skip

    slide = Joint("slide", "prismatic", "l3", "l4", SE3((0.2, 0.0, 0.0)), (1.0, 0.0, 0.0), 0.0, 0.4)
    joints = (
        joint(0, 0.0, "", 1.0, 0.0), joint(1, 0.5, "j0", -2.0, 0.2), joint(2, 0.5, "j1", 0.5, -0.1),
        slide,
    )  # fmt: skip
    links = tuple(f"l{k}" for k in range(5))
    gripper = Gripper("l4", SE3(), (), 0.08)
    return RobotModel(links, joints, {}, {}, (0.0, 0.2, 0.0, 0.0), gripper, frozenset())


def test_joints_that_mimic_move_with_their_leaders() -> None:
    """By hand at shoulder 0.7, slide 0.3: angles 0.7, 0.7 - 1.2 = -0.5, then -0.5 - 0.7 = -1.2."""
    robot = levelled_arm()
    assert robot.gripper is not None
    x = 0.5 * math.cos(0.7) + 0.5 * math.cos(-0.5) + (0.2 + 0.3) * math.cos(-1.2)
    y = 0.5 * math.sin(0.7) + 0.5 * math.sin(-0.5) + (0.2 + 0.3) * math.sin(-1.2)

    found = next(solve_all(make_chain(robot, robot.gripper), SE3.about_z(-1.2, (x, y, 0.0))))

    assert found == pytest.approx((0.7, 0.3), abs=5e-3)
    assert all_positions(robot, found, 1.0)[1:3] == pytest.approx((-1.2, -0.7), abs=1e-2)
