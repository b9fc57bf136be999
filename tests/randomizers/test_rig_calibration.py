"""Sensors off their places on rigs."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Device, Lidar, Rig, Scene
from gen_data.core.scene_time import RIG_AXES, place_sensors
from gen_data.core.se3 import SE3
from gen_data.randomizers.rig_calibration import RigCalibration
from tests.randomizers.doubles import FakeAssets, rng_of

LENS = Intrinsics.from_hfov(64, 48, 1.0)
SCENE = place_sensors(
    Scene(
        "rigs",
        bodies=(Body("ego", "car", SE3.about_z(0.3, (5.0, 1.0, 0.0))), Body("hand", "arm")),
        rigs=(Rig("ego", "ego", SE3((-1.0, 0.0, 0.0))), Rig("wrist", "hand")),
        cameras=(
            Camera("front", SE3(), LENS, None, "ego", SE3((1.7, 0.0, 1.5)) @ RIG_AXES.inverse()),
            Camera("eye", SE3(), LENS, None, "wrist"),
            Camera("free", SE3((9.0, 9.0, 9.0)), LENS),
        ),
        lidars=(Lidar("roof", "", SE3((0.9, 0.0, 1.8)), rig="ego"),),
        devices=(Device("imu", "imu", "ego", SE3((-0.05, 0.3, 0.9))),),
    )
)


def drawn(scene_index: int = 0, **given: object) -> Scene:
    randomizer = RigCalibration(name="calibration", **given)  # type: ignore[arg-type]
    return randomizer(SCENE, FakeAssets(), rng_of("calibration", scene_index))


def test_offsets_and_turns_are_along_the_axes_of_each_sensor() -> None:
    """1 cm along each axis; no turn: the camera's axes are right, down, forward."""
    scene = drawn(offset_m=Constant(0.01), turn_deg=Constant(0.0))

    camera, lidar, imu = scene.camera("front"), scene.lidar("roof"), scene.device("imu")
    assert camera.T_rig_camera.translation_m == pytest.approx((1.71, -0.01, 1.49))
    assert lidar.T_rig_lidar.translation_m == pytest.approx((0.91, 0.01, 1.81))
    assert imu.T_rig_device.translation_m == pytest.approx((-0.04, 0.31, 0.91))
    assert camera.T_rig_camera.quaternion_wxyz == pytest.approx(
        SCENE.camera("front").T_rig_camera.quaternion_wxyz
    )


def test_turns_are_as_large_as_they_say() -> None:
    """Three turns of 0.5 degrees about three axes are one of about 0.5 * sqrt(3)."""
    scene = drawn(offset_m=Constant(0.0), turn_deg=Constant(0.5))

    for before, after in (
        (SCENE.lidar("roof").T_rig_lidar, scene.lidar("roof").T_rig_lidar),
        (SCENE.camera("eye").T_rig_camera, scene.camera("eye").T_rig_camera),
    ):
        turn = 2.0 * math.acos(min(1.0, (before.inverse() @ after).quaternion_wxyz[0]))
        assert math.degrees(turn) == pytest.approx(0.5 * math.sqrt(3.0), rel=0.01)


def test_the_world_knows_where_the_sensors_are() -> None:
    """World poses, from which calibration files are written, belong to the moved sensors."""
    scene = drawn()
    T_world_rig = scene.rig_pose("ego")

    for pose, moved in (
        (scene.camera("front").T_world_camera, scene.camera("front").T_rig_camera),
        (scene.lidar("roof").T_world_lidar, scene.lidar("roof").T_rig_lidar),
        (scene.device("imu").T_world_device, scene.device("imu").T_rig_device),
    ):
        np.testing.assert_allclose(pose.matrix(), (T_world_rig @ moved).matrix(), atol=2e-6)
    assert scene.camera("front") != SCENE.camera("front")


def test_only_the_named_rig_is_changed_and_free_cameras_never() -> None:
    """By name, or all of them."""
    one, every = drawn(rig="wrist"), drawn()

    assert (one.lidars, one.devices) == (SCENE.lidars, SCENE.devices)
    assert one.camera("front") == SCENE.camera("front")
    assert one.camera("eye") != SCENE.camera("eye")
    assert every.lidars != SCENE.lidars
    assert one.camera("free") == every.camera("free") == SCENE.camera("free")


def test_sensors_are_drawn_each_for_itself() -> None:
    """Two sensors of a rig do not move together."""
    scene = drawn(offset_m=Uniform(-0.02, 0.02))
    moves = [
        np.subtract(new.translation_m, old.translation_m)
        for new, old in (
            (scene.lidar("roof").T_rig_lidar, SCENE.lidar("roof").T_rig_lidar),
            (scene.device("imu").T_rig_device, SCENE.device("imu").T_rig_device),
        )
    ]

    assert np.abs(moves[0] - moves[1]).max() > 1e-3
    assert np.abs(moves).max() <= 0.02 * math.sqrt(3.0)


def test_a_rig_without_sensors_is_refused() -> None:
    """And so is a scene without rigs: there is nothing to calibrate."""
    with pytest.raises(ConfigError, match=r"no sensor is on a rig 'wrst'; .*ego, wrist .*'wrist'"):
        drawn(rig="wrst")
    bare = replace(SCENE, cameras=(), lidars=(), devices=())
    with pytest.raises(ConfigError, match="rigs with sensors: none"):
        RigCalibration(name="c")(bare, FakeAssets(), rng_of("c"))
