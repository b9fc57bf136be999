"""KITTI raw data: drives, times, calibration, tracklets and grey images."""

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.se3 import SE3
from gen_data.exporters.kitti_raw import KittiRaw, luma
from gen_data.exporters.sequences import timestamp
from tests.exporters.datasets import in_scene
from tests.exporters.drives import DRIVE, calibration, drive_info, rigid, stems


def test_raw_files_hold_the_samples_of_their_frames(exported: Any, samples: Any) -> None:
    """Two drives of four frames, whatever the shards; ten digits."""
    folder = exported(KittiRaw(image_03="right"))
    names = [f"{k:010d}" for k in range(4)]
    for number in (0, 1):
        drive = folder / DRIVE.format(number)
        for sensor in ("image_02", "image_03", "velodyne_points", "oxts"):
            assert stems(drive / sensor / "data") == names
            assert len((drive / sensor / "timestamps.txt").read_text().splitlines()) == 4
    rows = [line.split() for line in (folder / "drives.txt").read_text().splitlines()]
    assert rows == [[DRIVE.format(0), "train", "0"], [DRIVE.format(1), "val", "4"]]
    # Drive 1, frame 2 is sample 6: pixels and points.
    drive = exported(KittiRaw(image_03="right")) / DRIVE.format(1)
    image = cv2.imread(str(drive / "image_03/data/0000000002.png"))
    points = np.fromfile(drive / "velodyne_points/data/0000000002.bin", "<f4").reshape(-1, 4)
    rgb = samples[6].capture.readings["right"].channels[Channel.RGB]
    np.testing.assert_array_equal(image[..., ::-1], rgb)
    expected = samples[6].capture.clouds["top"].points
    np.testing.assert_array_equal(points[:, :3], expected["position_m"])


def test_raw_times_have_nine_digits_and_grey_images_the_luma_of_colours(exported: Any) -> None:
    """Every drive begins at noon of the configured day."""
    drive = exported(KittiRaw(date="2020_02_29")) / "2020_02_29/2020_02_29_drive_0001_sync"
    lines = (drive / "oxts/timestamps.txt").read_text().splitlines()
    assert lines[0] == "2020-02-29 12:00:00.000000000"
    assert lines[3] == "2020-02-29 12:00:00.300000000"
    # Nanoseconds are rounded once, before they are split; times before the start are possible.
    start = datetime(2011, 9, 26, 23, 59, 59)
    assert timestamp(start, 0.9999999999) == "2011-09-27 00:00:00.000000000"
    assert timestamp(start, -0.05) == "2011-09-26 23:59:58.950000000"
    # Rec. 601: red 76, green 150, blue 29 of 255, as OpenCV has it; the reference moves to 00.
    primaries = np.eye(3, dtype=np.uint8)[None] * 255
    assert luma(primaries).tolist() == [[76, 150, 29]]
    folder = exported(KittiRaw(image_00="left", image_02="right"))
    grey = cv2.imread(
        str(folder / DRIVE.format(0) / "image_00/data/0000000000.png"), cv2.IMREAD_UNCHANGED
    )
    cameras = calibration(folder / "2011_09_26/calib_cam_to_cam.txt")
    assert grey.shape == (120, 160)
    assert cameras["P_rect_00"][3] == 0.0
    assert cameras["P_rect_02"][3] / cameras["P_rect_02"][0] == pytest.approx(-0.54)


def test_raw_calibration_maps_points_into_their_image(exported: Any, samples: Any) -> None:
    """By the devkit's formula, P_rect_03 R_rect_00 Tr x: points on an object fall on its mask."""
    folder = exported(KittiRaw(image_03="right")) / "2011_09_26"
    cameras = calibration(folder / "calib_cam_to_cam.txt")
    T_cam_velo = rigid(calibration(folder / "calib_velo_to_cam.txt"))
    for sample in samples:
        points = sample.capture.clouds["top"].points
        reading = sample.capture.readings["right"]
        ids = reading.channels[Channel.INSTANCE]
        mine = points[np.isin(points["instance_id"], [1, 2, 4])]
        homogeneous = np.column_stack([mine["position_m"], np.ones(len(mine))])
        p = cameras["P_rect_03"].reshape(3, 4) @ T_cam_velo @ homogeneous.T
        u, v = np.rint(p[:2] / p[2]).astype(int)
        inside = (u >= 1) & (u < 159) & (v >= 1) & (v < 119)
        around = [ids[v[inside] + dv, u[inside] + du] for dv in (-1, 0, 1) for du in (-1, 0, 1)]
        hits = (np.stack(around) == mine["instance_id"][inside]).any(axis=0)
        assert inside.sum() > 20
        assert hits.mean() > 0.95
    # 0.54 m between cameras 02 and 03, as pykitti computes it.
    left, right = (cameras[f"P_rect_0{k}"].reshape(3, 4) for k in (2, 3))
    assert left[0, 3] / left[0, 0] - right[0, 3] / right[0, 0] == pytest.approx(0.54)


def test_tracklets_enclose_the_points_of_their_object(exported: Any, samples: Any) -> None:
    """Every labelled point lies in the box of its frame, to a centimetre; sizes are those known."""
    drive = exported(KittiRaw()) / DRIVE.format(1)
    root = ET.parse(drive / "tracklet_labels.xml").getroot().find("tracklets")
    assert root is not None
    items = root.findall("item")
    assert root.findtext("count") == "3"
    assert [item.findtext("objectType") for item in items] == ["Car", "Pedestrian", "Misc"]
    for item, number in zip(items, (1, 2, 4), strict=True):
        height, width, length = (float(item.findtext(k) or 0) for k in "hwl")
        first = int(item.findtext("first_frame") or 0)
        poses = item.findall("poses/item")
        assert len(poses) == int(item.findtext("poses/count") or 0) == 4
        for k, pose in enumerate(poses, first):
            x, y, z, yaw = (float(pose.findtext(n) or 0) for n in ("tx", "ty", "tz", "rz"))
            points = samples[4 + k].capture.clouds["top"].points
            mine = points[points["instance_id"] == number]["position_m"] - [x, y, z]
            c, s = math.cos(yaw), math.sin(yaw)
            along, across = c * mine[:, 0] + s * mine[:, 1], c * mine[:, 1] - s * mine[:, 0]
            assert (np.abs(along) <= 0.5 * length + 0.01).all()
            assert (np.abs(across) <= 0.5 * width + 0.01).all()
            assert ((mine[:, 2] > -0.01) & (mine[:, 2] < height + 0.01)).all()
            assert pose.findtext("state") == "2"


def test_another_calibration_has_another_date(world: Any, samples: Any, tmp_path: Path) -> None:
    wider = SE3((0.0, 0.0, 1.93))
    moved = [
        in_scene(s, lidars=(replace(s.scene.lidars[0], T_rig_lidar=wider),)) if s.scene_index else s
        for s in samples
    ]
    folder = world.export(KittiRaw(), drive_info(world), moved, tmp_path)
    assert stems(folder) == ["2011_09_26", "2011_09_27", "drives"]
    heights = [
        calibration(folder / date / "calib_velo_to_cam.txt")["T"][1]
        for date in ("2011_09_26", "2011_09_27")
    ]
    assert heights == pytest.approx([-0.13, -0.33])


def test_cameras_that_look_elsewhere_are_no_pair(world: Any, samples: Any, tmp_path: Path) -> None:
    """The message names the camera and the remedy."""
    sample = samples[0]
    left, right = sample.scene.cameras
    turned = replace(right, T_rig_camera=SE3.about_z(0.1) @ right.T_rig_camera)
    apart = in_scene(sample, cameras=(left, turned))
    with pytest.raises(ConfigError, match=r"'right' is not parallel.*same yaw"):
        world.export(KittiRaw(image_03="right"), drive_info(world), [apart], tmp_path)


@pytest.mark.parametrize("date", ["2011-09-26", "2011_13_01", "2011_9_26", "today"])
def test_a_date_is_a_day(date: str) -> None:
    with pytest.raises(ValueError, match="2011_09_26"):
        KittiRaw(date=date)
