"""Suction cups, hinges in the hand and forces of contacts, against formulas."""

import math

import numpy as np
import pytest

from gen_data.core.asset_types import SuctionCup
from gen_data.core.scene import BodyJoint
from gen_data.core.se3 import SE3
from gen_data.physics.collision_shapes import collision_shape
from gen_data.physics.manipulation.suction import is_sealed, needed_force_n
from gen_data.physics.world import World, joint_position
from tests.physics.doubles import _parts

CUP = SuctionCup(0.015, 40.0)
DOWN = SE3(quaternion_wxyz=(0.0, 1.0, 0.0, 0.0))
"""A hand that looks down."""
TOP_M = 1.025
"""Height of the top of the block in ``put_block``."""


def put_block(world: World) -> None:
    """A table of which the top is at 1 m, and a block of 0.1 x 0.1 x 0.025 m and 2 kg on it."""
    world.add("table", collision_shape(_parts("box 1 1 0.1")), SE3((0.0, 0.0, 0.95)))
    block = collision_shape(_parts("box 0.1 0.1 0.025"))
    world.add("block", block, SE3((0.0, 0.0, 1.0125)), mass_kg=2.0)


def turned(angle_deg: float) -> SE3:
    """A turn about X."""
    half = math.radians(0.5 * angle_deg)
    return SE3(quaternion_wxyz=(math.cos(half), math.sin(half), 0.0, 0.0))


def test_forces_of_contacts_add_up_to_the_weight(world: World) -> None:
    """2 kg at rest: m g = 19.62 N, at points under the block, at the height of the table."""
    put_block(world)
    world.step(240)
    contacts = [c for c in world.contacts() if {c.one, c.other} == {"block", "table"}]
    assert math.fsum(c.force_n for c in contacts) == pytest.approx(2.0 * 9.81, rel=0.01)
    for contact in contacts:
        assert np.abs(contact.point_m[:2]).max() < 0.0515
        assert contact.point_m[2] == pytest.approx(1.0, abs=0.002)


def test_asking_for_contacts_changes_nothing(world: World) -> None:
    """A block that slides and is asked about at every step ends where another one does."""
    poses = []
    for asked in (False, True):
        world.reset()
        put_block(world)
        world.place("block", SE3((0.0, 0.0, 1.03)) @ turned(8.0))
        for _ in range(60):
            world.step(1)
            if asked:
                world.contacts()
        poses.append(world.pose("block"))
    assert poses[0] == poses[1]


def test_rays_hit_a_block_where_its_face_is(world: World) -> None:
    """From 0.5 m above the top; next to the block; and from its inside."""
    put_block(world)
    origins = np.array([[0.04, -0.04, TOP_M + 0.5], [0.06, 0.0, TOP_M + 0.5], [0.0, 0.0, 1.01]])
    found = world.hits_m("block", origins, np.array([0.0, 0.0, -1.0]))
    assert found == pytest.approx([0.5, np.inf, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("x_m", "gap_m", "tilt_deg", "seals"),
    [
        (0.0, 0.0005, 0.0, True),
        (0.034, 0.0005, 0.0, True),  # the rim is 1 mm within the edge
        (0.037, 0.0005, 0.0, False),  # the rim is 2 mm beyond it
        (0.0, 0.003, 0.0, False),
        (0.0, 0.0005, 3.0, True),  # its rim deviates by 0.015 sin 3 deg = 0.8 mm
        (0.0, 0.0005, 7.0, False),
        (0.0, 0.0, 5.3, False),  # within 1.5 mm all around, but not normal
    ],
)
def test_a_cup_seals_where_its_whole_rim_lies_on_a_face(
    world: World, x_m: float, gap_m: float, tilt_deg: float, seals: bool
) -> None:
    """Beyond an edge, too far from the face, or too oblique, it does not."""
    put_block(world)
    cup_at = SE3((x_m, 0.0, TOP_M + gap_m)) @ turned(tilt_deg) @ DOWN
    assert is_sealed(world, "block", cup_at, CUP) == seals


def test_a_cup_bears_weight_and_acceleration() -> None:
    """3 kg at rest need m g; sideways at 4 m/s^2, the length of both together."""
    assert needed_force_n(3.0, np.zeros(3)) == pytest.approx(29.43)
    assert needed_force_n(3.0, np.array([4.0, 0.0, 0.0])) == pytest.approx(
        3.0 * math.hypot(9.81, 4.0)
    )


def test_a_thing_on_a_moving_hinge_turns_by_contact_only(world: World) -> None:
    """A rod that friction holds 40 deg aslant is pressed down with its end on the table.

    The end is 0.1 m from the hinge, which goes down by 2 cm after it has come to the table: the
    angle becomes acos((0.1 cos 40 deg - 0.02) / 0.1).
    """
    world.add("table", collision_shape(_parts("box 1 1 0.1")), SE3((0.0, 0.0, 0.95)))
    rod = collision_shape(_parts("box 0.002 0.02 0.2"))
    start = math.radians(40.0)
    hinge_m = 0.1 * math.cos(start) + 0.001 * math.sin(start)
    lean = SE3(quaternion_wxyz=(math.cos(0.5 * start), 0.0, math.sin(0.5 * start), 0.0))
    # The hinge is at the rod's middle: gravity does not turn it.
    world.add("rod", rod, SE3((0.0, 0.0, 1.002 + hinge_m)) @ lean, mass_kg=0.05)
    joint = BodyJoint("rod", "revolute", (0.0, 1.0, 0.0), lower=-3.1, upper=3.1, friction=0.02)
    home = world.pose("rod")
    world.hinge("rod", joint)
    world.step(24)
    assert joint_position(joint, home, world.pose("rod")) == pytest.approx(0.0, abs=0.01)
    for k in range(1, 481):
        home = SE3((0.0, 0.0, 1.002 + hinge_m - 0.022 * k / 480)) @ lean
        world.carry("rod", home)
        world.step(1)
    angle = start + joint_position(joint, home, world.pose("rod"))
    pressed = world.pose("rod").translation_m[2]
    world.unhinge("rod")
    world.step(240)
    fallen = world.pose("rod").translation_m[2]
    needed = math.degrees(math.acos((0.1 * math.cos(start) - 0.02) / 0.1))
    assert math.degrees(angle) == pytest.approx(needed, abs=1.5)
    assert pressed == pytest.approx(1.0 + hinge_m - 0.02, abs=1e-6)
    assert fallen == pytest.approx(1.001, abs=0.002)
