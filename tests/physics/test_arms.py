"""Arms reach, hold and avoid."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.kinematics import link_poses
from gen_data.core.scene import ArmGoal, Articulation, Body, Instance, Scene
from gen_data.core.se3 import SE3, multiply_quaternions
from gen_data.physics.engine import Engine
from tests.physics.doubles import (
    TABLE_TOP_Z_M,
    accepted,
    refusal,
    table_scene,
    thing,
    world_vertices,
)
from tests.physics.panda import HOME, panda

DOWN = (0.0, 1.0, 0.0, 0.0)
ROBOT = panda()
INTO_TABLE = (0.0, 1.6, 0.0, -0.6, 0.0, 1.9, 0.0)


def armed(scene: Scene, goal: ArmGoal | None, positions: tuple[float, ...] = HOME) -> Scene:
    """The scene with a Panda on the table's left end."""
    base = SE3((-0.45, 0.0, TABLE_TOP_Z_M))
    arm = Articulation("arm", "panda", 9, base, positions, goal)
    instance = Instance(9, "arm", "robot", 1, "panda", parts=tuple(ROBOT.visuals))
    return replace(scene, articulations=(arm,), instances=(instance,))


def above_table(x: float, y: float, height_m: float, yaw_rad: float = 0.0) -> SE3:
    turn = multiply_quaternions(SE3.about_z(yaw_rad).quaternion_wxyz, DOWN)
    return SE3((x, y, TABLE_TOP_Z_M + height_m), turn)


def hand_pose(scene: Scene) -> SE3:
    arm = scene.articulations[0]
    assert ROBOT.gripper is not None
    poses = link_poses(ROBOT, arm.T_world_base, arm.joint_positions)
    return poses[ROBOT.gripper.link] @ ROBOT.gripper.T_link_grasp


def test_a_robot_without_a_goal_keeps_its_joints_and_gets_its_bodies(engine: Engine) -> None:
    """One body per visible link, at the pose of forward kinematics, part ids from the instance."""
    scene = accepted(engine, armed(table_scene(thing("cube", "box 0.05 0.05 0.05", x=0.2)), None))

    arm = scene.articulations[0]
    assert arm.joint_positions == HOME
    poses = link_poses(ROBOT, arm.T_world_base, HOME)
    for k, link in enumerate(ROBOT.visuals, 1):
        body = scene.body(f"arm/{link}")
        assert body.T_world_body == poses[link].rounded()
        assert (body.part_id, body.instance_id, body.collides) == (k, 9, False)


def test_link_bodies_of_the_template_are_moved_not_doubled(engine: Engine) -> None:
    """A finish that a randomizer gave to a link stays on it."""
    scene = armed(table_scene(), None)
    hand = Body("arm/panda_hand", "panda/panda_hand", instance_id=9, part_id=8, friction=0.123)

    settled = engine.settle(replace(scene, bodies=(*scene.bodies, hand))).scene

    names = [body.name for body in settled.bodies]
    assert len(names) == len(set(names))
    moved = settled.body("arm/panda_hand")
    assert moved.friction == 0.123
    assert moved.T_world_body != hand.T_world_body


def test_joints_goal_takes_the_first_candidate_that_works(engine: Engine) -> None:
    """Beyond a limit, then through the table, then good: the third is taken, rounded."""
    beyond = (0.0, -0.4, 0.0, 1.0, 0.0, 1.9, 0.0)
    good = (0.3, -0.4, 0.0, -2.2, 0.0, 1.9, 0.78539816339)
    goal = ArmGoal("joints", joint_candidates=(beyond, INTO_TABLE, good), gripper_opening=0.25)

    settled = accepted(engine, armed(table_scene(), goal))

    expected = (0.3, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785398, 0.01, 0.01)
    assert settled.articulations[0].joint_positions == expected


def test_an_arm_at_rest_in_the_table_is_refused(engine: Engine) -> None:
    found = refusal(engine, armed(table_scene(), None, (*INTO_TABLE, 0.0, 0.0)))

    assert found.reason == "arm 'arm' at rest collides with 'table'"
    assert "elements.arm.at_m" in found.remedy


def beside_another(scene: Scene, T_world_base: SE3) -> Scene:
    """A second arm like the first one, which has the same goal."""
    other = replace(scene.articulations[0], name="other", instance_id=8, T_world_base=T_world_base)
    return replace(scene, articulations=(*scene.articulations, other))


def test_two_arms_that_collide_at_rest_are_refused_by_name(engine: Engine) -> None:
    """At 5 cm from each other, with the element to move."""
    near = SE3((-0.45, 0.05, TABLE_TOP_Z_M))
    found = refusal(engine, beside_another(armed(table_scene(), None), near))

    assert found.reason.startswith("arm 'other' at rest collides with 'arm/panda_")
    assert "move robot 'other' (elements.other.at_m)" in found.remedy


def test_reach_puts_the_grasp_frame_where_it_was_asked(engine: Engine) -> None:
    """Within 1 mm and half a degree, fingers as far open as asked."""
    target = above_table(0.1, 0.15, 0.3, yaw_rad=0.4)
    goal = ArmGoal("reach", pose_candidates=(target,), gripper_opening=0.5)

    settled = accepted(engine, armed(table_scene(), goal))

    pose = hand_pose(settled)
    assert math.dist(pose.translation_m, target.translation_m) < 1e-3
    cosine = 0.5 * (np.trace(pose.rotation().T @ target.rotation()) - 1.0)
    assert math.acos(min(1.0, float(cosine))) < math.radians(0.5)
    arm = settled.articulations[0]
    assert arm.joint_positions[-2:] == (0.02, 0.02)
    assert arm.goal == goal, "the record of the request"


def test_reach_avoids_what_already_lies_there_and_ignores_what_has_yet_to_fall(
    engine: Engine,
) -> None:
    """The same box in the hand's way: scattered it forbids the pose, dropped it falls around."""
    box = thing("box", "box 0.2 0.2 0.3", x=0.1, above_m=0.151)
    goal = ArmGoal("reach", pose_candidates=(above_table(0.1, 0.0, 0.2),))

    scattered = refusal(engine, armed(table_scene(box, placement="scatter"), goal))
    dropped = engine.settle(armed(table_scene(box, placement="drop"), goal))

    assert scattered.reason == "arm collides"
    assert dropped.rejection is None or dropped.rejection.reason != "arm collides"


HELD = {
    "box 0.05 0.03 0.06": 0.03, "cylinder 0.025 0.08": 0.05, "box 0.02 0.06 0.02": 0.02,
}  # fmt: skip
"""Asset and the width at which the fingers must stop [m]."""


def holding(asset: str, *candidates: SE3) -> Scene:
    """A Panda that is to hold an object which lies on the table for now."""
    goal = ArmGoal("hold", pose_candidates=candidates, grasped_object="it")
    return armed(table_scene(thing("it", asset, x=0.3), placement="scatter"), goal)


FOLDED = (0.0, -1.7, 0.0, -3.05, 0.0, 0.3, 0.0)
"""The hand inside the shoulder: within all limits, and impossible."""


@pytest.mark.parametrize(("scene", "reason"), [
    (armed(table_scene(), ArmGoal("joints", joint_candidates=(INTO_TABLE,))), "arm collides"),
    (armed(table_scene(), ArmGoal("joints", joint_candidates=(FOLDED,))), "arm collides"),
    (armed(table_scene(), ArmGoal("reach", pose_candidates=(above_table(3.0, 0.0, 0.3),))),
     "arm cannot reach"),
    (holding("box 0.11 0.11 0.05", above_table(0.1, 0.0, 0.4)),
     "object does not fit the gripper"),
], ids=["through the table", "into itself", "too far", "wider than the stroke"])  # fmt: skip
def test_a_goal_that_no_candidate_reaches_is_refused(
    engine: Engine, scene: Scene, reason: str
) -> None:
    """The remedy names the arm."""
    found = refusal(engine, scene)

    assert found.reason == reason
    assert "'arm'" in found.remedy


@pytest.mark.parametrize("asset", HELD)
def test_a_held_object_sits_between_closed_fingers(engine: Engine, asset: str) -> None:
    """Centred at the grasp frame, fingers apart by its width, pads within 1 mm of it."""
    settled = accepted(engine, holding(asset, above_table(0.1, 0.0, 0.3, yaw_rad=0.2)))

    held = settled.body("it")
    assert held.motion == "kinematic"
    in_grasp = hand_pose(settled).inverse() @ held.T_world_body
    x, y, _ = in_grasp.translation_m
    assert abs(x) < 1e-5
    assert abs(y) < 1e-3
    fingers = settled.articulations[0].joint_positions[-2:]
    assert sum(fingers) == pytest.approx(HELD[asset], abs=0.002)
    for link in ("panda_leftfinger", "panda_rightfinger"):
        gap_m = distance_m(settled.body(f"arm/{link}"), held)
        assert -0.0005 < gap_m < 0.0015


def distance_m(one: Body, other: Body) -> float:
    """Distance of two convex bodies by a separate simulator, without the engine's shells."""
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    numbers = []
    for body in (one, other):
        points = world_vertices(body)
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, vertices=points.tolist(), physicsClientId=client
        )
        numbers.append(pybullet.createMultiBody(0, shape, physicsClientId=client))
    found = pybullet.getClosestPoints(*numbers, distance=1.0, physicsClientId=client)
    shell_m = 0.001  # pybullet keeps a shell of this thickness around each hull
    pybullet.disconnect(client)
    return float(min(point[8] for point in found)) + 2 * shell_m


def test_a_held_object_moves_with_the_grasp(engine: Engine) -> None:
    """Its pose in the grasp frame is the same wherever the hand is."""
    relative = []
    for target in (above_table(0.1, 0.0, 0.3), above_table(0.15, -0.2, 0.4, yaw_rad=1.0)):
        scene = accepted(engine, holding("box 0.05 0.03 0.06", target))
        relative.append(hand_pose(scene).inverse() @ scene.body("it").T_world_body)

    assert relative[0].translation_m == pytest.approx(relative[1].translation_m, abs=1e-5)
    np.testing.assert_allclose(relative[0].rotation(), relative[1].rotation(), atol=1e-5)


def test_a_tall_object_is_held_near_its_end_clear_of_the_palm(engine: Engine) -> None:
    """A bottle of 24 cm hangs upright below the hand; nothing but fingers is near it."""
    settled = accepted(engine, holding("cylinder 0.03 0.24", above_table(0.1, 0.0, 0.5)))

    held = settled.body("it")
    assert held.T_world_body.rotation()[2, 2] > math.cos(math.radians(0.6))
    for link in ("panda_hand", "panda_link7"):
        assert distance_m(settled.body(f"arm/{link}"), held) > 0.0


def test_fingers_close_on_what_is_between_them_not_on_the_whole_object(engine: Engine) -> None:
    """A mast on one side of a wider foot, held by the mast: both pads touch it."""
    settled = accepted(engine, holding("mast", above_table(0.1, 0.0, 0.5)))

    fingers = settled.articulations[0].joint_positions[-2:]
    assert sum(fingers) == pytest.approx(0.015, abs=0.002)


def test_an_object_in_a_level_hand_stays_upright(engine: Engine) -> None:
    """Fingers forward and side by side: the object's Z is up."""
    forward = np.eye(4)
    forward[:3, :3] = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    forward[:3, 3] = (0.15, 0.0, TABLE_TOP_Z_M + 0.4)

    settled = accepted(engine, holding("cylinder 0.025 0.12", SE3.from_matrix(forward)))

    assert settled.body("it").T_world_body.rotation()[2, 2] > math.cos(math.radians(0.6))


def test_a_held_object_may_not_be_in_the_table(engine: Engine) -> None:
    """The first candidate would push the bottle through the top; the second is taken."""
    low, high = above_table(0.1, 0.0, 0.12), above_table(0.1, 0.0, 0.5)

    settled = accepted(engine, holding("cylinder 0.03 0.24", low, high))

    assert hand_pose(settled).translation_m[2] == pytest.approx(TABLE_TOP_Z_M + 0.5, abs=0.001)


def test_things_fall_around_an_arm_and_come_to_rest(engine: Engine) -> None:
    """A box that is dropped onto the hand ends on the table or on the arm, not inside it."""
    goal = ArmGoal("reach", pose_candidates=(above_table(0.1, 0.0, 0.15),))
    box = thing("box", "box 0.06 0.06 0.06", x=0.12, above_m=0.2)

    settled = accepted(engine, armed(table_scene(box), goal))

    for link in ROBOT.visuals:
        assert distance_m(settled.body(f"arm/{link}"), settled.body("box")) > -0.002


def test_a_robot_without_a_gripper_follows_joint_candidates(engine: Engine) -> None:
    """Two hinges, two numbers; a post blocks the first candidate."""
    goal = ArmGoal("joints", joint_candidates=((0.0, 0.0), (1.5, 0.0)))
    arm = Articulation("arm", "gantry", 9, SE3((-0.4, -0.2, TABLE_TOP_Z_M)), (0.0, 0.5), goal)
    post = Body("post", "box 0.05 0.05 0.5", SE3((0.0, -0.2, TABLE_TOP_Z_M + 0.25)))
    scene = table_scene()

    settled = accepted(engine, replace(scene, bodies=(*scene.bodies, post), articulations=(arm,)))

    assert settled.articulations[0].joint_positions == (1.5, 0.0)


def test_a_candidate_of_the_wrong_length_is_a_mistake_not_a_rejection(engine: Engine) -> None:
    """Seven arm joints need seven numbers."""
    goal = ArmGoal("joints", joint_candidates=((0.0, 0.0),))

    with pytest.raises(ValueError, match="2 positions, the arm has 7 joints"):
        engine.settle(armed(table_scene(), goal))


def test_two_arms_avoid_each_other(engine: Engine) -> None:
    """The second arm may not take the place of the first."""
    goal = ArmGoal("reach", pose_candidates=(above_table(0.0, 0.0, 0.3),))
    opposite = SE3.about_z(math.pi, (0.45, 0.0, TABLE_TOP_Z_M))
    found = refusal(engine, beside_another(armed(table_scene(), goal), opposite))

    assert found.reason == "arm collides"
    assert "'other'" in found.remedy
