"""The shipped rigs, and changes to them that are refused."""

import math
from functools import cache

import numpy as np
import pytest

from gen_data.assemble import config, pipeline_factory
from gen_data.core import errors, scene_time, se3
from gen_data.core.scene import Scene
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from tests.libraries import library


@cache
def rig_scene(name: str, *overrides: str) -> Scene:
    """The nominal scene of a configuration, every sensor in its place."""
    spec = config.load_config(name, overrides=overrides)
    return scene_time.place_sensors(pipeline_factory.nominal_scene(spec, spec.probes[0], library()))


def on_rig(scene: Scene, pose: se3.SE3) -> se3.SE3:
    return scene.rig_pose("ego").inverse() @ pose


@pytest.mark.slow
def test_kittis_colour_cameras_are_a_stereo_pair() -> None:
    """0.54 m apart along the left camera's X axis, parallel, 1.65 m above the ground; 721.5 px."""
    scene = rig_scene("kitti_rig")
    left, right = scene.camera("image_02"), scene.camera("image_03")
    between = (left.T_world_camera.inverse() @ right.T_world_camera).matrix()

    np.testing.assert_allclose(between[:3, 3], [0.54, 0.0, 0.0], atol=2e-6)
    np.testing.assert_allclose(between[:3, :3], np.eye(3), atol=1e-6)
    assert on_rig(scene, left.T_world_camera).translation_m[2] == pytest.approx(1.65, abs=1e-5)
    assert left.intrinsics.fx_px == pytest.approx(721.5377, abs=0.5)


@pytest.mark.slow
def test_kittis_navigation_unit_is_where_its_calibration_has_it() -> None:
    """``calib_imu_to_velo``: (-0.81, 0.32, -0.80), to a centimetre."""
    scene = rig_scene("kitti_rig")
    scanner = scene.lidar("velodyne").T_world_lidar
    offset = (scene.device("oxts_imu").T_world_device.inverse() @ scanner).translation_m
    assert offset == pytest.approx((0.81, 0.32, 0.80), abs=0.01)


@pytest.mark.slow
def test_nuscenes_cameras_see_all_around() -> None:
    """Every direction at the horizon is in some camera's field of view."""
    scene = rig_scene("nuscenes_rig")
    spans = []
    for camera in scene.cameras:
        axis = on_rig(scene, camera.T_world_camera).rotation()[:, 2]
        half = math.atan(0.5 * camera.intrinsics.width_px / camera.intrinsics.fx_px)
        spans.append((math.atan2(axis[1], axis[0]), half))

    assert len(spans) == 6
    for angle in np.linspace(-math.pi, math.pi, 721):
        assert any(abs(math.remainder(angle - yaw, math.tau)) < half for yaw, half in spans)


def test_nuscenes_cameras_are_released_as_the_scanner_passes_them() -> None:
    """At a camera's offset in time, a clockwise turn of 50 ms has reached its axis, to a degree."""
    spec = config.load_config("nuscenes_rig")
    scanner = next(s for s in spec.sensors if isinstance(s, LidarSensor))
    cameras = [s for s in spec.sensors if isinstance(s, RgbCamera)]
    for camera in cameras:
        after_s = camera.time_offset_s - scanner.time_offset_s
        looks_deg = scanner.yaw_deg - 360.0 * scanner.rotation_hz * after_s
        assert abs(math.remainder(looks_deg - camera.yaw_deg, 360.0)) < 1.0
    assert len({camera.time_offset_s for camera in cameras}) == 6


@pytest.mark.slow
def test_a_sensor_inside_its_carrier_is_refused() -> None:
    """A camera in the middle of the car sees nothing but the car."""
    with pytest.raises(errors.ConfigError, match=r"'image_02': offset_m is .* inside 'ego'"):
        rig_scene("kitti_rig", "sensors.image_02.offset_m=[1.0, 0, 0.7]")


@pytest.mark.slow
def test_elements_that_a_configuration_adds_can_be_overridden_by_name() -> None:
    spec = config.load_config("kitti_rig", overrides=("elements.ego.asset=car?seed=4",))

    assert next(e for e in spec.probes[0].elements if e.name == "ego").asset == "car?seed=4"
