"""Arms pass goals in turn, within limits, through free space, and put objects down."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from gen_data.core.kinematics import link_poses
from gen_data.core.scene import ArmGoal, Body, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.physics import PhysicsConfig
from gen_data.physics.engine import Engine
from gen_data.physics.manipulation.joint_trajectories import smooth_step, speed_max
from gen_data.physics.physics_config import EngineName
from tests.physics.doubles import (
    TABLE_TOP_Z_M,
    Solids,
    accepted,
    refusal,
    table_scene,
    thing,
    world_vertices,
)
from tests.physics.panda import panda
from tests.physics.test_arms import INTO_TABLE, above_table, armed
from tests.tiers import sampled

ROBOT = panda()
SPEED = 0.5
START = ArmGoal("reach", pose_candidates=(above_table(0.05, 0.0, 0.4),))
TARGET = (0.15, -0.2)


def going(scene: Scene, *way: ArmGoal, start: ArmGoal | None = START) -> Scene:
    """The scene with a Panda that stands over the table and then passes a way."""
    scene = armed(scene, start)
    arm = replace(scene.articulations[0], task=way)
    return replace(scene, articulations=(arm,))


def spot(x: float, y: float, yaw_rad: float = 0.0) -> SE3:
    return SE3.about_z(yaw_rad, (x, y, TABLE_TOP_Z_M))


def pick_and_place(asset: str = "box 0.05 0.03 0.06") -> Scene:
    """An object at (0.1, 0.1) is carried past a can to TARGET, a quarter turn on."""
    scene = table_scene(
        thing("it", asset, x=0.1, y=0.1, above_m=0.05),
        thing("can", "cylinder 0.03 0.12", x=0.12, y=-0.05, above_m=0.07),
        placement="scatter",
    )
    grasp = ArmGoal("grasp", objects=("it",), speed=SPEED)
    place = ArmGoal("place", pose_candidates=(spot(*TARGET, 0.5 * math.pi),), speed=SPEED)
    return going(scene, grasp, place)


@cache
def moved(engine_name: EngineName, asset: str = "box 0.05 0.03 0.06") -> Scene:
    with Engine(Solids(), PhysicsConfig(engine=engine_name)) as engine:
        return accepted(engine, pick_and_place(asset))


def instants(scene: Scene) -> list[float]:
    """Times of all knots, and half way between them."""
    track = scene.articulations[0].joint_track
    assert track is not None
    return [0.5 * k * track.step_s for k in range(2 * len(track.knots) - 1)]


def overlaps_m(scene: Scene, pairs: list[tuple[str, str]]) -> list[float]:
    """Deepest overlap of pairs of convex bodies at each instant of the arm's motion.

    By a simulator without the engine's shells.
    """
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    numbers: dict[str, int] = {}
    for body in scene.bodies:
        points = world_vertices(replace(body, T_world_body=SE3()))
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, vertices=points.tolist(), physicsClientId=client
        )
        numbers[body.name] = pybullet.createMultiBody(0, shape, physicsClientId=client)
    shell_m = 0.001  # pybullet adds a shell of this thickness to each hull
    found = []
    for time_s in instants(scene):
        for body in scene_at(scene, time_s).bodies:
            w, i, j, k = body.T_world_body.quaternion_wxyz
            pybullet.resetBasePositionAndOrientation(
                numbers[body.name], body.T_world_body.translation_m, (i, j, k, w),
                physicsClientId=client,
            )  # fmt: skip
        deepest = 0.0
        for one, other in pairs:
            points = pybullet.getClosestPoints(
                numbers[one], numbers[other], distance=0.0, physicsClientId=client
            )
            deepest = max([deepest, *(-float(p[8]) - 2 * shell_m for p in points)])
        found.append(deepest)
    pybullet.disconnect(client)
    return found


@pytest.mark.slow
def test_joints_keep_to_their_limits_and_to_the_share_of_their_speed(
    engine_name: EngineName,
) -> None:
    """Differences of knots over the step: never above the share of the URDF's velocity limit."""
    track = moved(engine_name).articulations[0].joint_track
    assert track is not None
    knots = np.array(track.knots)
    speeds = np.abs(np.diff(knots, axis=0)) / track.step_s

    for k, joint in enumerate(ROBOT.movable):
        assert joint.speed_max > 0.0
        assert joint.lower - 1e-6 <= knots[:, k].min()
        assert knots[:, k].max() <= joint.upper + 1e-6
        assert speeds[:, k].max() <= SPEED * joint.speed_max + 1e-4
    assert speeds.max() > 0.5 * SPEED * 2.175  # it does not creep either


def test_joints_keep_to_the_share_of_their_acceleration(engine_name: EngineName) -> None:
    """Full speed within a quarter of a second is the limit: second differences of the knots."""
    track = moved(engine_name).articulations[0].joint_track
    assert track is not None
    accelerations = np.abs(np.diff(track.knots, n=2, axis=0)) / track.step_s**2

    for k, joint in enumerate(ROBOT.movable):
        assert accelerations[:, k].max() <= SPEED * joint.speed_max / 0.25 + 1e-2


def test_legs_start_and_end_at_rest() -> None:
    """The quintic has no speed at its ends and 15/8 of the mean speed half way."""
    h = 1e-4
    assert (smooth_step(0.0), smooth_step(0.5), smooth_step(1.0)) == (0.0, 0.5, 1.0)
    assert smooth_step(h) / h < 1e-6
    assert (smooth_step(0.5 + h) - smooth_step(0.5 - h)) / (2 * h) == pytest.approx(15 / 8)


def test_links_are_where_the_joints_put_them_at_every_knot(engine_name: EngineName) -> None:
    """Tracks of bodies and the joint track tell the same story."""
    scene = moved(engine_name)
    arm = scene.articulations[0]
    assert arm.joint_track is not None
    for k, positions in enumerate(arm.joint_track.knots):
        poses = link_poses(ROBOT, arm.T_world_base, positions)
        shown = scene_at(scene, k * arm.joint_track.step_s)
        assert shown.articulations[0].joint_positions == positions
        for link in ROBOT.visuals:
            pose = shown.body(f"arm/{link}").T_world_body
            assert pose.translation_m == pytest.approx(poses[link].translation_m, abs=1e-6)
            assert pose.quaternion_wxyz == pytest.approx(poses[link].quaternion_wxyz, abs=1e-7)


@pytest.mark.parametrize(
    "asset", sampled(["box 0.05 0.03 0.06", "cylinder 0.025 0.12", "ball 0.03"], 3)
)
def test_nothing_passes_through_anything(asset: str, engine_name: EngineName) -> None:
    """At every knot and half way between, nothing overlaps by more than a resting object may."""
    scene = moved(engine_name, asset)
    links = [f"arm/{link}" for link in ROBOT.visuals if link != "panda_link0"]
    pairs = [(one, other) for one in (*links, "it") for other in ("table", "can", "floor")]
    pairs += [(link, "it") for link in links]

    assert max(overlaps_m(scene, pairs)) < 0.001


def test_what_is_held_is_rigid_in_the_hand(engine_name: EngineName) -> None:
    """From the table to where it stands, its pose in the hand is one and the same."""
    scene = moved(engine_name)
    track = scene.track("it")
    assert track is not None
    start = round(track.start_s / track.step_s)
    hand = scene.track("arm/panda_hand")
    assert hand is not None
    relative = [
        hand.knots[start + k].inverse() @ pose for k, pose in enumerate(track.knots) if k > 0
    ]

    assert len(relative) > 20
    for pose in relative:
        assert pose.translation_m == pytest.approx(relative[0].translation_m, abs=5e-6)
        np.testing.assert_allclose(pose.rotation(), relative[0].rotation(), atol=1e-5)


def test_it_ends_where_it_was_to_be_put_and_stands_as_before(engine_name: EngineName) -> None:
    """At the target, a quarter turn on, as high over the table as when it was found."""
    scene = moved(engine_name)
    track = scene.track("it")
    assert track is not None
    before, after = track.knots[0], track.knots[-1]

    assert after.translation_m[:2] == pytest.approx(TARGET, abs=1e-4)
    assert after.translation_m[2] == pytest.approx(before.translation_m[2], abs=2e-5)
    assert before == scene.body("it").T_world_body
    turned = SE3.about_z(0.5 * math.pi, (0, 0, 0)).rotation() @ before.rotation()
    np.testing.assert_allclose(after.rotation(), turned, atol=1e-4)


def test_what_was_put_down_does_not_move_when_left_alone(
    engine: Engine, engine_name: EngineName
) -> None:
    """Settled again without the arm, it stays where it is to within a millimetre."""
    last = scene_at(moved(engine_name), 1e3)
    alone = replace(
        last,
        bodies=tuple(b for b in last.bodies if not b.name.startswith("arm/")),
        articulations=(), tracks=(), instances=(), groups=(),
    )  # fmt: skip

    settled = accepted(engine, alone)

    resting = settled.body("it").T_world_body.translation_m
    assert math.dist(resting, last.body("it").T_world_body.translation_m) < 1e-3


@pytest.mark.slow
def test_the_same_scene_moves_in_the_same_way_whatever_was_before(
    engine: Engine, engine_name: EngineName
) -> None:
    """A second engine, with another scene in between."""
    engine.settle(going(table_scene(thing("x", "ball 0.03")), ArmGoal("grasp", objects=("x",))))

    assert engine.settle(pick_and_place()).scene == moved(engine_name)


def test_a_way_through_the_table_names_it(engine: Engine) -> None:
    """Joint positions with the hand below the top."""
    fine = (0.3, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785)
    way = [ArmGoal("joints", joint_candidates=(q,)) for q in (fine, INTO_TABLE)]

    settled = engine.settle(going(table_scene(), *way))

    assert settled.rejection is not None
    assert settled.rejection.reason == "arm 'arm', goal 2 of its task: it hits 'table'"
    assert settled.scene.tracks == ()


def test_an_arm_goes_around_a_wall_between_two_free_poses(engine: Engine) -> None:
    """Low on one side, low on the other: the hand is raised over a wall on its way."""
    wall = Body("wall", "box 0.5 0.02 0.2", SE3((0.15, 0.0, TABLE_TOP_Z_M + 0.1)))
    scene = table_scene()
    scene = replace(scene, bodies=(*scene.bodies, wall))
    one, other = above_table(0.05, -0.25, 0.15), above_table(0.05, 0.25, 0.15)
    start = ArmGoal("reach", pose_candidates=(one,))
    way = ArmGoal("reach", pose_candidates=(other,))

    settled = accepted(engine, going(scene, way, start=start))

    hand = settled.track("arm/panda_hand")
    assert hand is not None
    heights = [pose.translation_m[2] for pose in hand.knots]
    assert max(heights) > max(heights[0], heights[-1]) + 0.05
    links = [f"arm/{link}" for link in ROBOT.visuals]
    assert max(overlaps_m(settled, [(link, "wall") for link in links])) == 0.0


@pytest.mark.parametrize("yaw_deg", [0.0, 7.5, 20.0, -50.0])
def test_fingers_are_flush_with_the_faces_of_a_box(engine: Engine, yaw_deg: float) -> None:
    """The hand's Y is the box's Y, or the opposite one, within the tolerance of 0.5 degrees."""
    it = thing("it", "box 0.05 0.03 0.06", x=0.1, y=0.1, above_m=0.031)
    turned = SE3.about_z(math.radians(yaw_deg), it.T_world_body.translation_m)
    scene = table_scene(replace(it, T_world_body=turned), placement="scatter")
    settled = accepted(engine, going(scene, ArmGoal("grasp", objects=("it",))))

    track = settled.articulations[0].joint_track
    assert track is not None
    poses = link_poses(ROBOT, settled.articulations[0].T_world_base, track.knots[-1])
    across = poses["panda_hand"].rotate(np.array([0.0, 1.0, 0.0]))
    cosine = abs(float(across @ turned.rotate(np.array([0.0, 1.0, 0.0]))))
    assert cosine > math.cos(math.radians(0.5))


@pytest.mark.parametrize(("bodies", "placement", "reason"), [
    ((thing("it", "box 0.05 0.03 0.06", x=0.57, y=0.37, above_m=0.031),), "scatter",
     "out of reach"),
    ((thing("low", "box 0.05 0.05 0.05", x=0.1, above_m=0.026),
      thing("high", "box 0.04 0.04 0.04", x=0.1, above_m=0.072)), "stack",
     "no listed object lies free"),
], ids=["too far, not too wide", "one on the other"])  # fmt: skip
def test_objects_that_cannot_be_taken_are_refused_with_the_reason(
    engine: Engine, bodies: tuple[Body, ...], placement: str, reason: str
) -> None:
    """Fingers would fit 1.3 m away; of a stack, neither the carrier nor the carried is free."""
    grasp = ArmGoal("grasp", objects=tuple(body.name for body in bodies))

    assert reason in refusal(engine, going(table_scene(*bodies, placement=placement), grasp)).reason


def test_what_is_too_wide_is_passed_over_for_the_next(engine: Engine) -> None:
    """Of a carton and a block, the block is lifted by a hand's breadth."""
    carton = thing("carton", "box 0.11 0.11 0.1", x=0.1, y=-0.2, above_m=0.051)
    block = thing("block", "box 0.04 0.04 0.06", x=0.1, y=0.15, above_m=0.031)
    scene = table_scene(carton, block, placement="scatter")

    settled = accepted(engine, going(scene, ArmGoal("grasp", objects=("carton", "block"))))

    assert settled.track("carton") is None
    track = settled.track("block")
    assert track is not None
    rise = track.knots[-1].translation_m[2] - track.knots[0].translation_m[2]
    assert rise == pytest.approx(0.1, abs=1e-3)


def test_a_place_without_room_is_passed_over_for_the_next(engine: Engine) -> None:
    """Neither over the edge nor on top of the can, but at the third place."""
    scene = pick_and_place()
    spots = (spot(0.1, 0.395), spot(0.12, -0.05), spot(0.0, -0.25))
    place = ArmGoal("place", pose_candidates=spots)
    arm = replace(scene.articulations[0], task=(scene.articulations[0].task[0], place))

    settled = accepted(engine, replace(scene, articulations=(arm,)))

    track = settled.track("it")
    assert track is not None
    assert track.knots[-1].translation_m[:2] == pytest.approx((0.0, -0.25), abs=1e-4)


def test_what_is_held_from_the_beginning_is_put_down_upright(engine: Engine) -> None:
    """A can in the hand at time 0 stands on the table at the end."""
    hold = ArmGoal("hold", pose_candidates=(above_table(0.1, 0.0, 0.35),), grasped_object="it")
    place = ArmGoal("place", pose_candidates=(spot(0.1, 0.15),))
    scene = table_scene(thing("it", "cylinder 0.025 0.08", x=0.3), placement="scatter")

    settled = accepted(engine, going(scene, place, start=hold))

    track = settled.track("it")
    assert track is not None
    assert track.knots[0] == settled.body("it").T_world_body
    assert track.knots[-1].translation_m == pytest.approx(
        (0.1, 0.15, TABLE_TOP_Z_M + 0.04), abs=2e-4
    )


def test_two_arms_move_in_turn(engine: Engine) -> None:
    """The second starts when the first has come to rest."""
    way = ArmGoal("reach", pose_candidates=(above_table(-0.1, 0.15, 0.3),))
    scene = going(table_scene(), way)
    arm = scene.articulations[0]
    opposite = SE3.about_z(math.pi, (0.5, 0.0, TABLE_TOP_Z_M))
    goals = [ArmGoal("reach", pose_candidates=(above_table(x, -0.25, 0.3),)) for x in (0.3, 0.2)]
    start = replace(arm, goal=ArmGoal("reach", pose_candidates=(above_table(-0.1, 0.2, 0.35),)))
    other = replace(
        arm, name="other", instance_id=8, T_world_base=opposite, goal=goals[0], task=(goals[1],)
    )

    settled = accepted(engine, replace(scene, articulations=(start, other)))

    one, two = (settled.track(f"{name}/panda_hand") for name in ("arm", "other"))
    assert one is not None
    assert two is not None
    assert two.start_s == pytest.approx(one.end_s)


def test_speed_limits_that_no_arm_has_are_not_believed() -> None:
    """A description that states 10 rad/s, and one without a limit."""
    joint = ROBOT.movable[0]

    assert speed_max(joint) == 2.175
    assert speed_max(replace(joint, speed_max=10.0)) == pytest.approx(math.pi)
    assert speed_max(replace(joint, speed_max=0.0)) == 1.5
