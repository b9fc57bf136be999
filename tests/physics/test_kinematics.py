"""Forward kinematics and its derived quantities."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from gen_data.core import kinematics
from gen_data.core.asset_types import Gripper, Joint, RobotModel
from gen_data.core.scene import Articulation
from gen_data.core.se3 import SE3
from tests.physics.panda import HOME, panda, urdf_path


@pytest.fixture
def client() -> Iterator[int]:
    pybullet = pytest.importorskip("pybullet")
    number: int = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def test_link_poses_are_those_of_an_independent_simulator(client: int) -> None:
    """Every link of the Panda, at random joints and a turned base, within a micrometre."""
    pybullet = pytest.importorskip("pybullet")
    robot = panda()
    base = SE3.about_z(0.7, (0.3, -0.2, 0.75))
    w, x, y, z = base.quaternion_wxyz
    number = pybullet.loadURDF(
        str(urdf_path()), base.translation_m, (x, y, z, w), useFixedBase=True,
        physicsClientId=client,
    )  # fmt: skip
    rng = np.random.Generator(np.random.Philox(key=1))

    for _ in range(20):
        positions = [float(rng.uniform(j.lower, j.upper)) for j in robot.movable]
        poses = kinematics.link_poses(robot, base, positions)
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
        kinematics.link_poses(panda(), SE3(), (0.0, 0.0))


def test_link_bodies_carry_the_part_ids_of_the_instance() -> None:
    """Part id k is the k-th name of the instance's parts; unlisted links belong to the whole."""
    robot = panda()
    arm = Articulation("arm", "panda", 7, SE3(), HOME)

    bodies = kinematics.make_link_bodies(arm, robot, ("panda_link0", "panda_hand"))

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

    assert kinematics.all_positions(panda(), arm, opening=0.5) == (*arm, 0.02, 0.02)


def test_limits_bound_every_joint() -> None:
    """The fourth joint of the Panda cannot bend backwards."""
    assert kinematics.is_within_limits(panda(), HOME)
    assert not kinematics.is_within_limits(panda(), (*HOME[:3], 0.1, *HOME[4:]))


def test_hand_flange_and_last_link_move_as_one_and_fingers_do_not() -> None:
    """Fixed joints glue links together, finger joints do not."""
    group = kinematics.rigid_group(panda(), "panda_hand")

    assert group == {"panda_link7", "panda_link8", "panda_hand", "panda_grasptarget"}
    assert kinematics.finger_links(panda()) == ("panda_leftfinger", "panda_rightfinger")


def test_positions_are_rounded_to_six_decimals_without_negative_zero() -> None:
    """Files contain the simulated positions."""
    rounded = kinematics.round_positions((math.pi, -1e-9))

    assert rounded == (3.141593, 0.0)
    assert math.copysign(1.0, rounded[1]) == 1.0


def linkage(*followers: Joint) -> RobotModel:
    """A hand whose joint ``finger`` [0, 0.8] turns about Z, and joints that follow it."""
    finger = turning("finger", "left", lower=0.0, upper=0.8)
    joints = (finger, *followers)
    links = ("base", *(joint.child for joint in joints))
    gripper = Gripper("base", SE3(), ("finger",), 0.085, open_at="lower")
    return RobotModel(links, joints, {}, {}, (0.0,) * len(joints), gripper, frozenset())


def turning(
    name: str, child: str, mimic: str = "", multiplier: float = 1.0, offset: float = 0.0,
    *, lower: float = -3.0, upper: float = 3.0,
) -> Joint:  # fmt: skip
    """A joint of the base that turns about Z."""
    return Joint(
        name, "revolute", "base", child, SE3(), (0.0, 0.0, 1.0), lower, upper, mimic,
        mimic_multiplier=multiplier, mimic_offset=offset,
    )  # fmt: skip


def test_a_joint_follows_with_its_multiplier_and_offset() -> None:
    """As a Robotiq hand: half closed, 0.4, the other side is at -1 * 0.4 + 0.1 = -0.3."""
    hand = linkage(turning("knuckle", "right", "finger", -1.0, 0.1))

    assert kinematics.all_positions(hand, (), opening=0.5) == (0.4, -0.3)


def test_a_joint_may_follow_one_that_follows() -> None:
    """2 * (-q + 0.1) - 0.05 = -2 q + 0.15: at 0.8, closed, -1.45; in any order."""
    knuckle = turning("knuckle", "right", "finger", -1.0, 0.1)
    tip = turning("tip", "tip", "knuckle", 2.0, -0.05)

    assert kinematics.all_positions(linkage(knuckle, tip), (), opening=0.0) == (0.8, -0.7, -1.45)
    assert kinematics.all_positions(linkage(tip, knuckle), (), opening=0.0) == (0.8, -1.45, -0.7)


def test_a_leader_stays_where_its_followers_are_within_their_limits() -> None:
    """-q + 0.1 within [-0.5, 0.05] leaves q within [0.05, 0.6]."""
    hand = linkage(turning("knuckle", "right", "finger", -1.0, 0.1, lower=-0.5, upper=0.05))

    assert kinematics.position_limits(hand.joints[0], hand) == pytest.approx((0.05, 0.6))


def test_links_that_follow_a_finger_are_fingers() -> None:
    """A joint that the gripper does not list moves with it all the same."""
    hand = linkage(turning("knuckle", "right", "finger", -1.0), turning("wrist", "palm"))

    assert kinematics.finger_links(hand) == ("left", "right")


@pytest.mark.parametrize("opening", [0.0, 0.25, 1.0])
def test_the_opening_is_read_back_from_positions(opening: float) -> None:
    """Whichever limit is the open one."""
    for robot, arm in ((panda(), HOME[:7]), (linkage(), ())):
        positions = kinematics.all_positions(robot, arm, opening)
        assert kinematics.gripper_opening(robot, positions) == pytest.approx(opening, abs=1e-5)


@pytest.mark.parametrize(("followers", "fault"), [
    ([turning("a", "x", "fingr")], r"'a' mimics 'fingr', which does not exist.*'finger'"),
    ([turning("a", "x", "a")], "'a' mimics itself through 'a'"),
    ([turning("a", "x", "b"), turning("b", "y", "a")], "'a' mimics itself through 'b'"),
])  # fmt: skip
def test_followers_without_a_leader_are_refused(followers: list[Joint], fault: str) -> None:
    """Unknown joints, and circles of any length."""
    with pytest.raises(ValueError, match=fault):
        kinematics.all_positions(linkage(*followers), (), opening=0.5)
