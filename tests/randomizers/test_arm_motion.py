"""Ways of robot arms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from gen_data.config.distributions import Constant
from gen_data.core.errors import ConfigError
from gen_data.core.scene import ArmGoal, Articulation, Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.randomizers.arm_motion import ArmMotion, Stop
from tests.randomizers.doubles import FakeAssets, rng_of, two_link_arm

ARM = Articulation("arm", "two_link", 1, SE3((-0.5, 0.0, 0.74)), two_link_arm().home,
                   workspace_m=((-0.2, -0.3, 0.9), (0.4, 0.3, 1.3)))  # fmt: skip
TABLE = SupportSurface("table", "table", SE3((0.0, 0.0, 0.74)), (1.2, 0.8), 1.0)
CLUTTER = ObjectGroup("clutter", ("table",), (), 2, "drop")


def scene(*objects: str, goal: ArmGoal | None = None) -> Scene:
    bodies = tuple(
        Body(f"clutter/{k}", asset, group="clutter", motion="dynamic")
        for k, asset in enumerate(objects)
    )
    arm = replace(ARM, goal=goal)
    return Scene("test", bodies=bodies, surfaces=(TABLE,), groups=(CLUTTER,), articulations=(arm,))


def drawn(on: Scene, **given: object) -> tuple[ArmGoal, ...]:
    motion = ArmMotion(name="motion", **given)  # type: ignore[arg-type]
    return motion(on, FakeAssets(), rng_of("motion")).articulations[0].task


def test_pick_and_place_takes_what_fits_and_puts_it_on_the_table() -> None:
    """Bricks are 2 cm thin; places are on the top, below the workspace, away from its edges."""
    grasp, place = drawn(scene("brick", "brick"), speed=Constant(0.3))

    assert (grasp.kind, place.kind) == ("grasp", "place")
    assert sorted(grasp.objects) == ["clutter/0", "clutter/1"]
    assert grasp.speed == place.speed == 0.3
    spots = np.array([pose.translation_m for pose in place.pose_candidates])
    assert len(spots) == 16
    assert (spots[:, 2] == 0.74).all()
    assert (spots[:, 0] >= -0.2).all()
    assert (spots[:, 0] <= 0.4).all()
    assert (np.abs(spots[:, 1]) <= 0.3).all()
    assert np.ptp(spots[:, :2], axis=0).min() > 0.2


def test_what_the_arm_holds_is_put_down_first() -> None:
    """Then the next object is taken, and it is another one."""
    hold = ArmGoal("hold", pose_candidates=(SE3(),), grasped_object="clutter/0")

    way = drawn(scene("brick", "brick", goal=hold), count=2)

    assert [goal.kind for goal in way] == ["place", "grasp", "place"]
    assert way[1].objects == ("clutter/1",)


def test_reach_visits_poses_over_the_workspace() -> None:
    """As many as counted, each with its candidates."""
    way = drawn(scene(), task=Constant("reach"), count=3, candidates=5)

    assert [goal.kind for goal in way] == ["reach"] * 3
    assert [len(goal.pose_candidates) for goal in way] == [5, 5, 5]
    z = [pose.translation_m[2] for goal in way for pose in goal.pose_candidates]
    assert min(z) >= 0.9
    assert max(z) <= 1.3


def test_a_given_way_is_taken_as_it_stands() -> None:
    """Degrees become radians; the hand points down, turned by its yaw; places lie on the top."""
    way = drawn(
        scene("brick"),
        way=(
            Stop(joints_deg=(10.0, -90.0), opening=0.5),
            Stop(reach_m=(0.1, 0.2, 1.0), yaw_deg=90.0),
            Stop(grasp=("clutter",)),
            Stop(place_m=(0.2, -0.1)),
        ),
    )

    assert way[0].joint_candidates[0] == pytest.approx((math.pi / 18, -math.pi / 2), abs=1e-6)
    assert way[0].gripper_opening == 0.5
    pose = way[1].pose_candidates[0]
    assert pose.translation_m == (0.1, 0.2, 1.0)
    np.testing.assert_allclose(pose.rotate(np.array([0, 0, 1.0])), [0, 0, -1], atol=1e-7)
    np.testing.assert_allclose(pose.rotate(np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-7)
    assert way[2].objects == ("clutter/0",)
    assert way[3].pose_candidates[0].translation_m == (0.2, -0.1, 0.74)


@pytest.mark.parametrize(("given", "message"), [
    ({"way": (Stop(joints_deg=(1.0,)),)}, r"way\[0\].*1 positions for the 2 joints"),
    ({"way": (Stop(place_m=(2.0, 0.0)),)}, r"no surface at \(2.0, 0.0\)"),
    ({"way": (Stop(grasp=("cluter",)),)}, "did you mean 'clutter'"),
    ({"objects": ("cups",)}, "no object group 'cups'"),
])  # fmt: skip
def test_what_cannot_be_is_a_mistake_that_is_named(given: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        drawn(scene("brick"), **given)


def test_a_stop_is_exactly_one_thing() -> None:
    with pytest.raises(ValidationError, match="exactly one"):
        Stop()
    with pytest.raises(ValidationError, match="exactly one"):
        Stop(grasp=("clutter",), place_m=(0.0, 0.0))
