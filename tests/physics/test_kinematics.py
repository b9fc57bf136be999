"""Forward kinematics, and what is derived from it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from generator.core.kinematics import (
    all_positions,
    finger_links,
    link_bodies,
    link_poses,
    rigid_group,
    rounded_positions,
    within_limits,
)
from generator.core.scene import Articulation
from generator.core.se3 import SE3
from tests.physics.panda import HOME, URDF, panda


@pytest.fixture
def client() -> Iterator[int]:
    """A pybullet connection of its own."""
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def test_link_poses_are_those_of_an_independent_simulator(client: int) -> None:
    """Every link of the Panda, at random joints and a turned base, within a micrometre."""
    robot = panda()
    base = SE3.about_z(0.7, (0.3, -0.2, 0.75))
    w, x, y, z = base.quaternion_wxyz
    number = pybullet.loadURDF(
        str(URDF), base.translation_m, (x, y, z, w), useFixedBase=True, physicsClientId=client
    )
    rng = np.random.Generator(np.random.Philox(key=1))

    for _ in range(20):
        positions = [float(rng.uniform(j.lower, j.upper)) for j in robot.movable]
        poses = link_poses(robot, base, positions)
        values = dict(zip((j.name for j in robot.movable), positions, strict=True))
        joints = range(pybullet.getNumJoints(number, physicsClientId=client))
        names = {}
        for k in joints:
            info = pybullet.getJointInfo(number, k, physicsClientId=client)
            names[k] = info[12].decode()
            if info[1].decode() in values:
                value = values[info[1].decode()]
                pybullet.resetJointState(number, k, value, physicsClientId=client)
        for k in joints:
            state = pybullet.getLinkState(
                number, k, computeForwardKinematics=True, physicsClientId=client
            )
            matrix = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
            np.testing.assert_allclose(poses[names[k]].translation_m, state[4], atol=1e-6)
            np.testing.assert_allclose(poses[names[k]].rotation(), matrix, atol=1e-6)


def test_a_wrong_number_of_positions_is_refused() -> None:
    """Nine joints need nine numbers."""
    with pytest.raises(ValueError, match="9 joint positions needed, got 2"):
        link_poses(panda(), SE3(), (0.0, 0.0))


def test_link_bodies_carry_the_part_ids_of_the_instance() -> None:
    """Part id k is the k-th name of the instance's parts; unlisted links belong to the whole."""
    robot = panda()
    arm = Articulation("arm", "panda", 7, SE3(), HOME)

    bodies = link_bodies(arm, robot, ("panda_link0", "panda_hand"))

    assert [body.name for body in bodies] == [f"arm/{link}" for link in robot.visuals]
    part_ids = {body.name: body.part_id for body in bodies}
    assert part_ids["arm/panda_link0"] == 1
    assert part_ids["arm/panda_hand"] == 2
    assert part_ids["arm/panda_link3"] == 0
    assert all(body.instance_id == 7 and not body.collides for body in bodies)
    assert all(body.motion == "kinematic" for body in bodies)


def test_fingers_follow_the_opening_and_the_arm_its_own_positions() -> None:
    """Half open is half the range of each finger; the seven arm joints keep their order."""
    arm = (0.1, -0.2, 0.3, -1.4, 0.5, 1.6, 0.7)

    assert all_positions(panda(), arm, opening=0.5) == (*arm, 0.02, 0.02)


def test_limits_bound_every_joint() -> None:
    """The fourth joint of the Panda cannot bend backwards."""
    assert within_limits(panda(), HOME)
    assert not within_limits(panda(), (*HOME[:3], 0.1, *HOME[4:]))


def test_hand_flange_and_last_link_move_as_one_and_fingers_do_not() -> None:
    """Fixed joints glue links together, finger joints do not."""
    group = rigid_group(panda(), "panda_hand")

    assert group == {"panda_link7", "panda_link8", "panda_hand", "panda_grasptarget"}
    assert finger_links(panda()) == ("panda_leftfinger", "panda_rightfinger")


def test_positions_are_rounded_to_six_decimals_without_negative_zero() -> None:
    """What is written to files is what was simulated."""
    rounded = rounded_positions((math.pi, -1e-9))

    assert rounded == (3.141593, 0.0)
    assert math.copysign(1.0, rounded[1]) == 1.0
