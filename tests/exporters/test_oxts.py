"""KITTI's navigation rows (OXTS)."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.special import fresnel

from gen_data.core.errors import ConfigError
from gen_data.core.motion import STILL, Twist
from gen_data.core.scene import Device
from gen_data.core.scene_time import rig_twist, scene_at
from gen_data.core.se3 import SE3
from gen_data.exporters.kitti_raw import KittiRaw
from gen_data.exporters.nuscenes_can_bus import motion_at
from gen_data.exporters.oxts import (
    GRAVITY_M_S2,
    RigMotion,
    navigation_mount,
    oxts_row,
    rig_motion,
    roll_pitch_yaw,
)
from gen_data.exporters.sequences import Mount
from tests.exporters.drives import DRIVE
from tests.sensors.streetcar import world as driving


def mercator(lat_deg: float, lon_deg: float, scale: float) -> tuple[float, float]:
    """Metres east and north, by the formula of KITTI's devkit (convertOxtsToPose.m)."""
    radius_m = 6378137.0
    north = scale * radius_m * math.log(math.tan((90.0 + lat_deg) * math.pi / 360.0))
    return scale * lon_deg * math.pi * radius_m / 180.0, north


def test_navigation_follows_the_rig(exported: Any, world: Any) -> None:
    """Position and heading by the devkit's projection are on the circle that it drives."""
    drive = exported(KittiRaw()) / DRIVE.format(0)
    rows = [
        np.array((drive / f"oxts/data/{k:010d}.txt").read_text().split(), float) for k in range(4)
    ]
    scale = math.cos(math.radians(rows[0][0]))
    start = mercator(rows[0][0], rows[0][1], scale)
    for k, row in enumerate(rows):
        pose = world.ego_pose(0.1 * k)
        east, north = mercator(row[0], row[1], scale)
        assert len(row) == 30
        assert (east - start[0], north - start[1]) == pytest.approx(
            pose.translation_m[:2], abs=2e-5
        )
        assert row[5] == pytest.approx(0.02 * k, abs=1e-6)
        assert row[8:11] == pytest.approx([10.0, 0.0, 0.0], abs=2e-3)
        assert row[12] == pytest.approx(10.0 * 0.2, abs=0.01)
        assert row[[13, 16]] == pytest.approx(GRAVITY_M_S2)
        assert row[[19, 22]] == pytest.approx(0.2, abs=1e-4)
        assert math.hypot(row[6], row[7]) == pytest.approx(10.0, abs=2e-3)


def test_navigation_has_the_axes_of_a_leaning_unit_and_of_the_compass() -> None:
    """Nose up by 30 degrees: half of gravity forward along its axis, none along the level one."""
    up = SE3((0.0, 0.0, 7.0), (math.cos(math.radians(15)), 0.0, -math.sin(math.radians(15)), 0.0))
    row = np.array(oxts_row(RigMotion(up, STILL), (49.0, 8.0)).split(), float)
    assert row[:3] == pytest.approx([49.0, 8.0, 7.0])
    assert row[3:6] == pytest.approx([0.0, -math.radians(30), 0.0])
    assert row[11:17] == pytest.approx(
        [0.5 * GRAVITY_M_S2, 0.0, math.sqrt(0.75) * GRAVITY_M_S2, 0.0, 0.0, GRAVITY_M_S2]
    )
    # World Y is north, X is east; heading north makes both forward and leftward differ.
    north = SE3.about_z(math.radians(90))
    motion = RigMotion(north, Twist((1.0, 5.0, 0.0)))
    row = np.array(oxts_row(motion, (0.0, 0.0)).split(), float)
    assert row[6:11] == pytest.approx([5.0, 1.0, 5.0, -1.0, 0.0])
    # Rz(yaw) Ry(pitch) Rx(roll), as the devkit builds it.
    roll, pitch, yaw = 0.1, -0.2, 2.8

    def about(axis: int, angle: float) -> Any:
        return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]

    rotation = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    assert roll_pitch_yaw(rotation) == pytest.approx((roll, pitch, yaw))


def test_navigation_of_a_device_is_that_of_its_place_on_the_rig(samples: Any) -> None:
    """1 m to the left in a left turn of 50 m: slower by its share of the radius."""
    device = Device("gnss", "gnss", "ego", SE3((0.0, 1.0, 0.5)))
    scene = replace(samples[1].scene, devices=(device,))
    mount = navigation_mount(scene, "gnss", "ego", "kitti_raw")
    row = np.array(oxts_row(rig_motion(scene, mount), (0.0, 0.0)).split(), float)
    assert row[8:11] == pytest.approx([9.8, 0.0, 0.0], abs=2e-3)
    assert (row[12], row[2]) == (pytest.approx(9.8 * 0.2, abs=0.01), pytest.approx(0.5))
    with pytest.raises(ConfigError, match=r"no device 'imu'.*gnss"):
        navigation_mount(scene, "imu", "ego", "kitti_raw")


def test_a_pose_without_motion_is_where_the_rig_stands(world: Any, tmp_path: Path) -> None:
    """Cameras without a rig have a drive, too: it stands still."""
    info = world.info(7, lidars=("top",))
    folder = world.export(KittiRaw(), info, world.samples, tmp_path)
    row = (folder / DRIVE.format(2) / "oxts/data/0000000000.txt").read_text().split()
    assert float(row[2]) == pytest.approx(1.6)
    assert float(row[8]) == 0.0


def test_a_lever_arm_feels_the_growth_of_a_turn() -> None:
    """On a clothoid, 2 m ahead of the origin: a + dw/dt x r + w x (w x r), dw/dt = 0.2 rad/s^2.

    Goldstein, Classical Mechanics, 4.10. The rows, the CAN bus, the labels and the positions,
    differentiated twice, agree.
    """
    unit_s = math.sqrt(math.pi / 0.2)

    def clothoid(t: float) -> SE3:
        sine, cosine = fresnel(t / unit_s)
        return SE3.about_z(0.1 * t * t, (10.0 * unit_s * cosine, 10.0 * unit_s * sine, 0.0))

    ahead = SE3((2.0, 0.0, 0.0))
    drive = driving(clothoid, seconds=1.0)
    (rig,) = drive.rigs
    on_rig = replace(drive, rigs=(replace(rig, T_body_rig=rig.T_body_rig @ ahead),))
    for k in range(1, 10):
        time_s = round(0.1 * k, 6)
        motion = rig_motion(scene_at(drive, time_s), Mount("ego", ahead))
        row = np.array(oxts_row(motion, (0.0, 0.0)).split(), float)
        turn = 0.2 * time_s
        assert row[[14, 15]] == pytest.approx([-2.0 * turn**2, 10.0 * turn + 0.4], abs=0.03), k
        force = motion_at(on_rig, "ego", time_s).twist.acceleration_m_s2
        assert force == pytest.approx(motion.twist.acceleration_m_s2, abs=1e-6)
        labelled = rig_twist(scene_at(on_rig, time_s), on_rig.rigs[0])
        assert labelled.acceleration_m_s2 == pytest.approx(force, abs=1e-6)


def test_navigation_in_a_growing_turn_is_that_of_its_instant() -> None:
    """10 m/s on a clothoid: turn rate 0.2 t and v times that to the left, from end to end."""
    unit_s = math.sqrt(math.pi / 0.2)

    def clothoid(t: float) -> SE3:
        sine, cosine = fresnel(t / unit_s)
        return SE3.about_z(0.1 * t * t, (10.0 * unit_s * cosine, 10.0 * unit_s * sine, 0.0))

    drive = driving(clothoid, seconds=1.0)
    for k in range(11):
        motion = rig_motion(scene_at(drive, round(0.1 * k, 6)), Mount("ego", SE3()))
        row = np.array(oxts_row(motion, (0.0, 0.0)).split(), float)
        assert row[[19, 22]] == pytest.approx(0.02 * k, abs=1e-5), k
        assert row[[14, 15]] == pytest.approx([0.0, 0.2 * k], abs=0.02), k
