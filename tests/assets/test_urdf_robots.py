"""Robots: kinematics as stated by the URDF, geometry link by link."""

import math

import numpy as np
import pytest

from gen_data.assets.library import Library
from gen_data.core.kinematics import link_poses
from gen_data.core.se3 import SE3

ROBOTS = ("franka_panda", "kuka_iiwa", "xarm6")
TOOLED = ("franka_panda_suction", "kuka_iiwa_gripper", "kuka_iiwa_suction", "xarm6_gripper")
"""The same arms with tools made by code."""


def test_the_panda_has_the_joints_reach_and_colour_of_its_maker(library: Library) -> None:
    """At zero the flange is at (0.088, 0, 0.926) m and looks down (Franka, DH table)."""
    robot = library.robot("franka_panda")
    flange = link_poses(robot, SE3(), (0.0,) * 9)["panda_link8"]
    assert flange.translation_m == pytest.approx((0.088, 0.0, 0.926), abs=1e-6)
    assert flange.rotate(np.array([0.0, 0.0, 1.0])) == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    # Order of the movable joints: arm from base to hand, then fingers.
    names = [joint.name for joint in robot.movable]
    assert names == [*(f"panda_joint{k}" for k in range(1, 8)),
                     "panda_finger_joint1", "panda_finger_joint2"]  # fmt: skip
    assert robot.movable[8].mimic == "panda_finger_joint1"
    assert robot.home == pytest.approx(
        (0, -math.pi / 4, 0, -3 * math.pi / 4, 0, math.pi / 2, math.pi / 4, 0.04, 0.04), abs=1e-6
    )
    assert robot.gripper is not None
    assert robot.gripper.stroke_m == 0.08
    # link0 and link7 are shown by untextured collision meshes; nothing is whiter than snow.
    for link in ("panda_link0", "panda_link1", "panda_link7"):
        (material,) = library.materials(f"franka_panda/{link}")
        assert material.base_color == (0.85, 0.85, 0.85)
        assert not material.texture
    forearm = [m.base_color for m in library.materials("franka_panda/panda_link5")]
    assert min(max(color) for color in forearm) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", TOOLED)
def test_tools_point_out_of_the_flange_and_close_at_the_grasp(library: Library, name: str) -> None:
    """Closed fingers meet at the grasp frame's origin; a cup's rim is there, below its tube."""
    robot = library.robot(name)
    gripper = robot.gripper
    assert gripper is not None
    closed = tuple(
        0.0 if joint.name in gripper.finger_joints else q
        for joint, q in zip(robot.movable, robot.home, strict=True)
    )
    poses = link_poses(robot, SE3(), closed)
    T_grasp_world = (poses[gripper.link] @ gripper.T_link_grasp).inverse()
    tips = [link for link in robot.links if link.endswith("finger")] or [gripper.link]
    parts = [
        (T_grasp_world @ poses[tip]).apply(library.mesh(f"{name}/{tip}").vertices_m) for tip in tips
    ]
    points = np.concatenate(parts)
    if gripper.cup is not None:
        rim = points[points[:, 2] > -1e-6]
        assert points[:, 2].max() == pytest.approx(0.0, abs=1e-6)
        assert np.hypot(rim[:, 0], rim[:, 1]).max() == pytest.approx(0.017, abs=1e-3)
        assert gripper.cup.force_n == pytest.approx(60e3 * math.pi * 0.015**2, abs=0.1)
    else:
        assert points[:, 2].min() < 0.0 < points[:, 2].max()
        assert points[:, 1].min() == pytest.approx(-points[:, 1].max(), abs=1e-6)
        assert np.abs(points[:, 1]).min() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_the_grasp_frame_lies_between_the_finger_tips(library: Library) -> None:
    """Fully open, the tips are 0.08 m apart along the grasp frame's Y, at its height."""
    robot = library.robot("franka_panda")
    poses = link_poses(robot, SE3(), robot.home)
    assert robot.gripper is not None
    T_grasp_world = (poses["panda_hand"] @ robot.gripper.T_link_grasp).inverse()
    tips = {}
    for side in ("left", "right"):
        link = f"panda_{side}finger"
        points = library.mesh(robot.visuals[link]).vertices_m.astype(np.float64)
        tips[side] = (T_grasp_world @ poses[link]).apply(points)
    assert tips["left"][:, 1].min() == pytest.approx(0.04, abs=0.001)
    assert tips["right"][:, 1].max() == pytest.approx(-0.04, abs=0.001)
    for points in tips.values():
        assert points[:, 2].max() == pytest.approx(0.009, abs=0.003)


@pytest.mark.parametrize("name", ROBOTS)
def test_links_come_root_first_collide_and_may_touch_others(library: Library, name: str) -> None:
    """Each link after its parent; one home position per movable joint."""
    robot = library.robot(name)
    assert [j.child for j in robot.joints] == list(robot.links[1:])
    seen = {robot.links[0]}
    for joint in robot.joints:
        assert joint.parent in seen
        seen.add(joint.child)
    for joint, position in zip(robot.movable, robot.home, strict=True):
        assert joint.lower <= position <= joint.upper
    # Pairs that a joint connects are allowed, base and last link are not.
    for joint in robot.joints:
        assert (joint.parent, joint.child) in robot.no_collide
    solid = list(robot.collisions)
    assert (solid[0], solid[-1]) not in robot.no_collide
    # At most 35,000 triangles for a robot, and hulls close to the visible mesh.
    total = 0
    for link, asset_id in robot.visuals.items():
        mesh = library.mesh(asset_id)
        total += len(mesh.faces)
        hull = np.concatenate(library.convex_parts(robot.collisions[link]).parts_m)
        low, high = np.array(mesh.bounds_m())
        assert hull.min(axis=0) == pytest.approx(low, abs=0.02)
        assert hull.max(axis=0) == pytest.approx(high, abs=0.02)
    assert 5_000 < total < 35_000


def test_links_can_be_asked_for_by_id(library: Library) -> None:
    """A link has the licence and category of its robot."""
    link = library.get("franka_panda/panda_link3")
    assert (link.kind, link.category, link.licence) == ("object", "robot", "Apache-2.0")
    assert [a.asset_id for a in library.find({"arm"}, "robot")] == sorted((*ROBOTS, *TOOLED))
