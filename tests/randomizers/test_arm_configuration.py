"""Goals of robot arms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.config.distributions import Choice, Constant, Uniform
from gen_data.core.asset_types import RobotModel
from gen_data.core.scene import ArmGoal, Articulation, Body, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.arm_configuration import ArmConfiguration
from tests.randomizers.doubles import FakeAssets, rng_of, two_link_arm

WORKSPACE_M = ((-0.2, -0.3, 0.9), (0.4, 0.3, 1.3))
ARM = Articulation("arm", "two_link", 1, SE3((-0.5, 0.0, 0.74)), two_link_arm().home,
                   workspace_m=WORKSPACE_M)  # fmt: skip


class NoGripper(FakeAssets):
    def robot(self, asset_id: str) -> RobotModel:
        return replace(super().robot(asset_id), gripper=None)


def goal(mode: str, *objects: str, scene_index: int = 0, **given: object) -> ArmGoal:
    bodies = tuple(
        Body(f"clutter/{k}", asset, group="clutter", motion="dynamic")
        for k, asset in enumerate(objects)
    )
    scene = Scene("test", bodies=bodies, articulations=(ARM,))
    pose = ArmConfiguration(name="pose", mode=Constant(mode), **given)  # type: ignore[arg-type]
    drawn = pose(scene, FakeAssets(), rng_of("arm", scene_index)).articulations[0].goal
    assert drawn is not None
    return drawn


def test_joint_candidates_are_within_the_share_of_the_limits() -> None:
    """Shoulder +-2 rad and elbow +-2.5 rad, half of it; fingers do not count as arm joints."""
    drawn = goal("joints", candidates=40, range_share=0.5)
    shoulder, elbow = np.array(drawn.joint_candidates).T

    assert drawn.kind == "joints"
    assert len(drawn.joint_candidates) == 40
    assert 0.8 < np.abs(shoulder).max() <= 1.0
    assert 1.0 < np.abs(elbow).max() <= 1.25


def test_hand_is_sent_into_the_workspace_pointing_down() -> None:
    """Grasp frames lean from straight down by the tilt; they are turned any way about it."""
    drawn = goal("reach", candidates=60, tilt_deg=Constant(20.0))
    places = np.array([pose.translation_m for pose in drawn.pose_candidates])
    out_of_hand = np.array([pose.rotate(np.array([0, 0, 1.0])) for pose in drawn.pose_candidates])
    opens = np.array([pose.rotate(np.array([0, 1.0, 0])) for pose in drawn.pose_candidates])

    assert drawn.kind == "reach"
    assert len(places) == 60
    assert (places >= WORKSPACE_M[0]).all()
    assert (places <= WORKSPACE_M[1]).all()
    assert np.allclose(np.degrees(np.arccos(-out_of_hand[:, 2])), 20.0, atol=1e-3)
    assert np.ptp(np.arctan2(opens[:, 1], opens[:, 0])) > math.pi


@pytest.mark.parametrize(("objects", "expected"), [
    (("ball", "bottle", "brick"), {"clutter/2"}),
    (("brick", "can?seed=0", "odd"), {"clutter/0", "clutter/1", "clutter/2"}),
])  # fmt: skip
def test_every_object_that_fits_between_the_fingers_is_held_at_times(
    objects: tuple[str, ...], expected: set[str]
) -> None:
    """The gripper opens 8 cm: a ball of 20 cm and a bottle of 8 cm stay where they are."""
    drawn = [goal("hold", *objects, scene_index=k) for k in range(30)]

    assert {each.grasped_object for each in drawn} == expected
    assert {each.kind for each in drawn} == {"hold"}


def test_arm_reaches_where_there_is_nothing_to_hold() -> None:
    """Nothing fits, or nothing is there."""
    for objects in ((), ("ball",)):
        drawn = goal("hold", *objects)

        assert (drawn.kind, drawn.grasped_object) == ("reach", "")
        assert drawn.pose_candidates


def test_arm_without_a_gripper_moves_its_joints() -> None:
    """Reaching and holding need a grasp frame."""
    scene = Scene("test", articulations=(ARM,))
    pose = ArmConfiguration(name="pose", mode=Constant("hold"))
    drawn = pose(scene, NoGripper(), rng_of()).articulations[0].goal

    assert drawn is not None
    assert (drawn.kind, len(drawn.joint_candidates)) == ("joints", 24)


def test_gripper_opens_by_the_drawn_share() -> None:
    """In [0, 1], whatever the mode."""
    openings = [
        goal("joints", scene_index=k, opening=Uniform(0.3, 0.5)).gripper_opening for k in range(9)
    ]

    assert all(0.3 <= opening <= 0.5 for opening in openings)
    assert len(set(openings)) == 9


def test_modes_come_as_often_as_their_weights_say() -> None:
    """One third each of 300 draws, within four sigma."""
    pose = ArmConfiguration(name="pose", mode=Choice(["joints", "reach", "hold"]), candidates=1)
    scene = Scene("test", bodies=(Body("c/0", "brick", group="c"),), articulations=(ARM,))
    goals = [pose(scene, FakeAssets(), rng_of("m", k)).articulations[0].goal for k in range(300)]
    kinds = [drawn.kind for drawn in goals if drawn]

    assert all(abs(kinds.count(kind) - 100) < 33 for kind in ("joints", "reach", "hold"))
