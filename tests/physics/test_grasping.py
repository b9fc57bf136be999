"""Fingers of several links close on the object between them."""

import math

import numpy as np
import pytest

from gen_data.core.asset_types import ConvexParts, Gripper, Joint, RobotModel
from gen_data.core.se3 import SE3
from gen_data.physics.collision_shapes import collision_shape
from gen_data.physics.manipulation.grasping import Hand
from gen_data.physics.manipulation.joint_trajectories import Leg, limit_speed, sample_positions
from gen_data.physics.world import World
from tests.physics.doubles import box, cylinder

STROKE_M = 0.08
BAR_BEHIND_M = 0.003
"""The bar of a finger is this far behind the face of its pad."""
PADS = {"left": 1.0, "right": -1.0}
COLLISIONS = {
    "palm": (box(0.06, 0.12, 0.04, at=(0.0, 0.0, 0.0)),),
    **{side: (box(0.01, 0.01, 0.06, at=(0.0, s * (0.005 + BAR_BEHIND_M), 0.05)),)
       for side, s in PADS.items()},
    **{f"{side}_pad": (box(0.008, 0.008, 0.02, at=(0.0, s * 0.004, 0.0)),)
       for side, s in PADS.items()},
}  # fmt: skip


def hand_robot() -> RobotModel:
    """A palm with two fingers along Z, each a bar with a pad at its end."""
    fingers = [
        Joint(f"{side}_slide", "prismatic", "palm", side, SE3(), (0.0, s, 0.0), 0.0, 0.5 * STROKE_M)
        for side, s in PADS.items()
    ]
    pads = [
        Joint(f"{side}_fix", "fixed", side, f"{side}_pad", SE3((0.0, 0.0, 0.07)), (1, 0, 0), 0, 0)
        for side in PADS
    ]
    return RobotModel(
        links=("palm", "left", "right", "left_pad", "right_pad"),
        joints=(*fingers, *pads),
        visuals={},
        collisions={link: link for link in COLLISIONS},
        home=(0.04, 0.04),
        gripper=Gripper("palm", SE3((0.0, 0.0, 0.07)), ("left_slide", "right_slide"), STROKE_M),
        no_collide=frozenset(),
    )


def tube(inner_m: float, outer_m: float, height_m: float) -> tuple[np.ndarray, ...]:
    """Sixteen staves around Z; diameters at their edges."""
    return tuple(
        np.array(
            [
                (0.5 * d * math.cos(a), 0.5 * d * math.sin(a), z)
                for d in (inner_m, outer_m)
                for a in (2 * math.pi * k / 16, 2 * math.pi * (k + 1) / 16)
                for z in (-0.5 * height_m, 0.5 * height_m)
            ]
        )
        for k in range(16)
    )


THINGS = {
    "block": (box(0.03, 0.024, 0.05),), "rod": (cylinder(0.02, 0.05),),
    "ring": tube(0.05, 0.064, 0.03), "wide": (box(0.09, 0.09, 0.05),),
}  # fmt: skip


@pytest.fixture
def world(world: World) -> World:
    """The parts of a hand and objects, apart from each other."""
    for name, parts in (*COLLISIONS.items(), *THINGS.items()):
        mass_kg = 0.1 if name in THINGS else 0.0
        world.add(name, collision_shape(ConvexParts(tuple(parts))), SE3((9, 0, 0)), mass_kg=mass_kg)
    return world


def hand(world: World) -> Hand:
    robot = hand_robot()
    assert robot.gripper is not None
    return Hand(robot, robot.gripper, world, lambda link: link)


@pytest.mark.parametrize(("thing", "width_m"), [("block", 0.024), ("rod", 0.04), ("ring", 0.064)])
def test_pads_meet_at_the_width_of_the_thing(world: World, thing: str, width_m: float) -> None:
    """Bars stay behind; a ring is held outside although closed fingers fit into its hole."""
    grasp = hand(world).grasp_in_place(thing, SE3())

    assert grasp is not None
    # Flat pads of 8 mm on polygons: up to 1 - cos(pi / 16) = 2 % less than the diameter.
    assert STROKE_M * grasp.opening == pytest.approx(width_m, abs=0.0015)


def test_a_thing_beside_the_middle_is_centred(world: World) -> None:
    """By the nearest link on either side."""
    grasp = hand(world).grasp_in_place("block", SE3((0.0, 0.006, 0.0)))

    assert grasp is not None and grasp.T_grasp_held is not None
    assert grasp.T_grasp_held.translation_m[1] == pytest.approx(0.0, abs=2e-4)


def test_what_is_wider_than_the_stroke_does_not_fit(world: World) -> None:
    """Nine centimetres between fingers that open by eight."""
    assert hand(world).grasp_in_place("wide", SE3()) is None


def test_fingers_close_around_a_body_where_it_is(world: World) -> None:
    """Half a millimetre off on each side; at a place without it they close."""
    there = SE3.about_z(0.4, (0.2, -0.1, 0.3))
    world.place("block", there)

    around = hand(world).opening_around("block", there)

    assert STROKE_M * around == pytest.approx(0.024 + 2 * 0.0005, abs=0.0008)
    assert hand(world).opening_around("block", SE3()) == 0.0
    assert world.pose("block").translation_m == pytest.approx(there.translation_m, abs=1e-6)


def test_a_leg_is_slowed_down_to_the_speed_of_a_point() -> None:
    """Differences of knots, for a joint that moves the point by 0.3 m per radian."""
    slow = limit_speed(Leg((0.0,), (1.0,), 0.5), [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)], 0.15)

    x_m = 0.3 * np.array([positions[0] for _, positions in sample_positions([slow])])
    fastest_m_s = np.diff(x_m).max() / 0.05
    assert 0.9 * 0.15 < fastest_m_s <= 0.15 + 1e-6
    assert limit_speed(slow, [(0.0, 0.0, 0.0), (0.001, 0.0, 0.0)], 0.15) == slow
