"""Sensors on a stand, which are posed as one."""

import math
from typing import Any

import numpy as np
import pytest

from gen_data.config.distributions import Constant
from gen_data.core import errors, scene_time, se3, stereo
from gen_data.core.scene import Region, Scene
from gen_data.randomizers.camera_pose import CameraPose
from gen_data.randomizers.rig_calibration import RigCalibration
from gen_data.scene_templates.stand import Stand
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from tests.randomizers.doubles import FakeAssets, rng_of

FOCUS = Region((0.3, -0.2, 0.8), (1.2, 0.8, 0.25))


def pair(**stand: Any) -> Scene:
    """Two cameras 6 cm apart and a scanner above them, on one stand."""
    scene = Scene("test", focus=FOCUS, interior_m=((-2.3, -1.8, 0.1), (2.3, 1.8, 2.6)))
    scene = Stand(name="pair", **stand).add(scene, FakeAssets())
    for sensor in (
        RgbCamera(name="left", rig="pair", offset_m=(0.0, 0.03, 0.0)),
        RgbCamera(name="right", rig="pair", offset_m=(0.0, -0.03, 0.0)),
        LidarSensor(name="scan", rig="pair", offset_m=(0.0, 0.0, 0.1)),
    ):
        scene = sensor.mount(scene)
    return scene_time.place_sensors(scene)


def posed(scene: Scene, k: int = 0, **given: Any) -> Scene:
    given = {"rig": "pair", **given}
    return CameraPose(name="orbit", **given)(scene, FakeAssets(), rng_of("orbit", k, index=k))


def test_a_fixed_stand_looks_straight_down() -> None:
    """The left camera is 3 cm to the left as seen along the optical axis, 1.7 m up."""
    scene = pair(position_m=(0.5, 0.0, 1.7))

    left = scene.camera("left").T_world_camera
    assert left.translation_m == pytest.approx((0.5, 0.03, 1.7), abs=1e-6)
    np.testing.assert_allclose(left.rotation()[:, 2], [0.0, 0.0, -1.0], atol=1e-7)
    assert stereo.baseline_m(scene.camera("left"), scene.camera("right")) == pytest.approx(0.06)


def test_an_orbiting_stand_keeps_its_pair_rectified() -> None:
    """The first camera is on the orbit; the baseline stays, at every angle and roll."""
    for k in range(40):
        scene = posed(pair(), k, distance_m=Constant(0.9), jitter_m=Constant(0.0))
        left, right = scene.camera("left"), scene.camera("right")

        away_m = np.subtract(left.T_world_camera.translation_m, FOCUS.center_m)
        assert float(np.linalg.norm(away_m)) == pytest.approx(0.9, abs=3e-6)
        assert stereo.baseline_m(left, right) == pytest.approx(0.06, abs=3e-6)


def test_everything_on_a_stand_moves_with_it() -> None:
    """The scanner's place as seen by a camera is its mount's."""
    before, after = pair(), posed(pair(), azimuth_deg=Constant(40.0))

    def seen(scene: Scene) -> se3.SE3:
        return scene.camera("left").T_world_camera.inverse() @ scene.lidar("scan").T_world_lidar

    assert after.lidar("scan").T_world_lidar != before.lidar("scan").T_world_lidar
    np.testing.assert_allclose(seen(after).matrix(), seen(before).matrix(), atol=3e-6)


def test_the_named_camera_of_a_stand_is_aimed() -> None:
    """The focus is on the optical axis of the right camera, not on the left one's."""
    scene = posed(pair(), camera="right", jitter_m=Constant(0.0))

    eye = scene.camera("right").T_world_camera.inverse().apply(np.array(FOCUS.center_m))
    np.testing.assert_allclose(eye[:2], 0.0, atol=5e-6)


@pytest.mark.parametrize(("given", "told"), [
    ({"rig": "paar"}, "there is no stand 'paar'; expected one of pair"),
    ({"camera": "middle"}, "no camera 'middle' on the rig 'pair'; expected one of left, right"),
])  # fmt: skip
def test_an_unknown_name_is_refused(given: dict[str, Any], told: str) -> None:
    with pytest.raises(errors.ConfigError, match=told):
        posed(pair(), **given)


def test_a_whole_rig_is_disturbed_as_one() -> None:
    """Its sensors keep their places on it; its origin moves by 1 cm along each of its axes."""
    scene = pair(pitch_deg=0.0)
    moved = RigCalibration(name="sag", whole=True, offset_m=Constant(0.01), turn_deg=Constant(0.0))(
        scene, FakeAssets(), rng_of("sag")
    )

    assert [c.T_rig_camera for c in moved.cameras] == [c.T_rig_camera for c in scene.cameras]
    assert moved.rig_pose("pair").translation_m == pytest.approx((0.01, 0.01, 1.51))
    assert moved.camera("left").T_world_camera.translation_m == pytest.approx((0.01, 0.04, 1.51))


@pytest.mark.parametrize("turns_deg", [(10, 20, 30), (-170, -89, 5), (60, 90, 0), (0, -90, 0)])
def test_turns_of_a_pose_make_it_again(turns_deg: tuple[float, float, float]) -> None:
    pose = se3.turned((1.0, 2.0, 3.0), *(math.radians(a) for a in turns_deg))
    np.testing.assert_allclose(
        se3.turned((1.0, 2.0, 3.0), *se3.turns_of(pose)).matrix(), pose.matrix(), atol=1e-12
    )
