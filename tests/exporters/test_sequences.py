"""Sequences in files: KITTI raw, KITTI tracking, MOTChallenge, SemanticKITTI, COCO."""

from __future__ import annotations

import configparser
import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.exporters.coco import Coco
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.kitti_raw import KittiRaw, luma
from gen_data.exporters.kitti_tracking import KittiTracking, truncation_level
from gen_data.exporters.motchallenge import MotChallenge, mot_class
from gen_data.exporters.oxts import (
    GRAVITY_M_S2,
    RigMotion,
    navigation_mount,
    oxts_row,
    rig_motion,
    roll_pitch_yaw,
)
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.semantickitti import SemanticKitti
from gen_data.exporters.sequences import timestamp
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.motion import STILL, Twist
from gen_data.generator.core.scene import Device
from gen_data.generator.core.se3 import SE3

DRIVE = "2011_09_26/2011_09_26_drive_{:04d}_sync"
FRAMES = [f"{k:06d}" for k in range(4)]


@pytest.fixture(scope="module")
def samples(world: Any) -> Any:
    """Two sequences of four steps in three shards: both are cut."""
    return world.drive()


@pytest.fixture(scope="module")
def slow(world: Any) -> Any:
    """The same; the right camera and the scanner read at every second step."""
    return world.drive({"right": 2, "top": 2})


def drive_info(world: Any) -> Any:
    return world.info(8, ("left", "right"), ("top",), steps_per_scene=4)


@pytest.fixture(scope="module")
def exported(world: Any, samples: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Exports once per exporter and remembers the folder."""
    folders: dict[str, Path] = {}

    def export(exporter: Any) -> Path:
        key = repr(exporter)
        if key not in folders:
            folder = tmp_path_factory.mktemp(exporter.type)
            folders[key] = world.export(exporter, drive_info(world), samples, folder)
        return folders[key]

    return export


def stems(folder: Path) -> list[str]:
    """Names of files without their ends, sorted."""
    return sorted(path.stem for path in folder.iterdir())


def calibration(path: Path) -> dict[str, Any]:
    """Numbers of a calibration file by name, read as KITTI's devkit reads it."""
    rows = (line.split(None, 1) for line in path.read_text().splitlines())
    return {
        name.rstrip(":"): np.array(values.split(), float)
        for name, values in rows
        if not name.startswith("calib_time")
    }


def rigid(values: dict[str, Any]) -> Any:
    """[4, 4] of ``R`` and ``T``."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = values["R"].reshape(3, 3), values["T"]
    return matrix


# ---------------------------------------------------------------------------- KITTI raw


def test_a_raw_drive_has_a_file_of_every_sensor_per_step(exported: Any) -> None:
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


def test_raw_files_hold_the_samples_of_their_frames(exported: Any, samples: Any) -> None:
    """Drive 1, frame 2 is sample 6: pixels and points."""
    drive = exported(KittiRaw(image_03="right")) / DRIVE.format(1)

    image = cv2.imread(str(drive / "image_03/data/0000000002.png"))
    points = np.fromfile(drive / "velodyne_points/data/0000000002.bin", "<f4").reshape(-1, 4)

    (rgb,) = (
        array
        for channel, array in samples[6].capture.readings["right"].channels.items()
        if channel.value == "rgb"
    )
    np.testing.assert_array_equal(image[..., ::-1], rgb)
    expected = samples[6].capture.clouds["top"].points
    np.testing.assert_array_equal(points[:, :3], expected["position_m"])


def test_raw_times_are_a_step_apart_and_have_nine_digits(exported: Any) -> None:
    """Every drive begins at noon of the configured day."""
    drive = exported(KittiRaw(date="2020_02_29")) / "2020_02_29/2020_02_29_drive_0001_sync"

    lines = (drive / "oxts/timestamps.txt").read_text().splitlines()

    assert lines[0] == "2020-02-29 12:00:00.000000000"
    assert lines[3] == "2020-02-29 12:00:00.300000000"


def test_times_carry_over_seconds_and_midnight() -> None:
    """Nanoseconds are rounded once, before they are split; times before the start are possible."""
    start = datetime(2011, 9, 26, 23, 59, 59)

    assert timestamp(start, 0.9999999999) == "2011-09-27 00:00:00.000000000"
    assert timestamp(start, -0.05) == "2011-09-26 23:59:58.950000000"


def test_raw_calibration_maps_points_into_the_image_they_belong_to(
    exported: Any, samples: Any
) -> None:
    """By the devkit's formula, P_rect_03 R_rect_00 Tr x: points on a thing fall on its mask."""
    folder = exported(KittiRaw(image_03="right")) / "2011_09_26"
    cameras = calibration(folder / "calib_cam_to_cam.txt")
    T_cam_velo = rigid(calibration(folder / "calib_velo_to_cam.txt"))
    for sample in samples:
        points = sample.capture.clouds["top"].points
        reading = sample.capture.readings["right"]
        (ids,) = (a for c, a in reading.channels.items() if c.value == "instance")
        mine = points[np.isin(points["instance_id"], [1, 2, 4])]
        homogeneous = np.column_stack([mine["position_m"], np.ones(len(mine))])
        p = cameras["P_rect_03"].reshape(3, 4) @ T_cam_velo @ homogeneous.T
        u, v = np.rint(p[:2] / p[2]).astype(int)
        inside = (u >= 1) & (u < 159) & (v >= 1) & (v < 119)
        around = [ids[v[inside] + dv, u[inside] + du] for dv in (-1, 0, 1) for du in (-1, 0, 1)]
        hits = (np.stack(around) == mine["instance_id"][inside]).any(axis=0)
        assert inside.sum() > 20
        assert hits.mean() > 0.95


def test_raw_stereo_baseline_is_that_of_the_rig(exported: Any) -> None:
    """0.54 m between cameras 02 and 03, as pykitti computes it."""
    folder = exported(KittiRaw(image_03="right")) / "2011_09_26"
    cameras = calibration(folder / "calib_cam_to_cam.txt")

    left, right = (cameras[f"P_rect_0{k}"].reshape(3, 4) for k in (2, 3))

    assert left[0, 3] / left[0, 0] - right[0, 3] / right[0, 0] == pytest.approx(0.54)


def mercator(lat_deg: float, lon_deg: float, scale: float) -> tuple[float, float]:
    """Metres east and north, by the formula of KITTI's devkit (convertOxtsToPose.m)."""
    radius_m = 6378137.0
    north = scale * radius_m * math.log(math.tan((90.0 + lat_deg) * math.pi / 360.0))
    return scale * lon_deg * math.pi * radius_m / 180.0, north


def test_navigation_follows_the_rig(exported: Any, world: Any) -> None:
    """Position and heading by the devkit's projection are those of the circle that it drives."""
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


def test_navigation_of_a_leaning_unit_at_rest_feels_gravity_along_its_own_axes() -> None:
    """Nose up by 30 degrees: half of gravity forward along its axis, none along the level one."""
    up = SE3((0.0, 0.0, 7.0), (math.cos(math.radians(15)), 0.0, -math.sin(math.radians(15)), 0.0))
    row = np.array(oxts_row(RigMotion(up, STILL), (49.0, 8.0)).split(), float)

    assert row[:3] == pytest.approx([49.0, 8.0, 7.0])
    assert row[3:6] == pytest.approx([0.0, -math.radians(30), 0.0])
    assert row[11:17] == pytest.approx(
        [0.5 * GRAVITY_M_S2, 0.0, math.sqrt(0.75) * GRAVITY_M_S2, 0.0, 0.0, GRAVITY_M_S2]
    )


def test_navigation_of_a_device_is_that_of_its_place_on_the_rig(samples: Any) -> None:
    """1 m to the left in a left turn of 50 m: slower by its share of the radius."""
    device = Device("gnss", "gnss", "ego", SE3((0.0, 1.0, 0.5)))
    scene = replace(samples[1].scene, devices=(device,))
    mount = navigation_mount(scene, "gnss", "ego", "kitti_raw")
    row = np.array(oxts_row(rig_motion(scene, mount), (0.0, 0.0)).split(), float)

    assert row[8:11] == pytest.approx([9.8, 0.0, 0.0], abs=2e-3)
    assert row[12] == pytest.approx(9.8 * 0.2, abs=0.01)
    assert row[2] == pytest.approx(0.5)
    with pytest.raises(ConfigError, match=r"no device 'imu'.*gnss"):
        navigation_mount(scene, "imu", "ego", "kitti_raw")


def test_navigation_north_and_east() -> None:
    """World Y is north, X is east; heading north makes both forward and leftward differ."""
    north = SE3.about_z(math.radians(90))
    motion = RigMotion(north, Twist((1.0, 5.0, 0.0)))
    row = np.array(oxts_row(motion, (0.0, 0.0)).split(), float)

    assert row[6:11] == pytest.approx([5.0, 1.0, 5.0, -1.0, 0.0])


def test_roll_pitch_and_yaw_multiply_to_the_rotation() -> None:
    """Rz(yaw) Ry(pitch) Rx(roll), as the devkit builds it."""
    roll, pitch, yaw = 0.1, -0.2, 2.8

    def about(axis: int, angle: float) -> Any:
        return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]

    rotation = about(2, yaw) @ about(1, pitch) @ about(0, roll)

    assert roll_pitch_yaw(rotation) == pytest.approx((roll, pitch, yaw))


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


def test_grey_images_have_the_luma_of_the_colours(exported: Any) -> None:
    """Rec. 601: red 76, green 150, blue 29 of 255, as OpenCV has it; the reference moves to 00."""
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


def test_drives_with_another_calibration_have_another_date(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """A date has one calibration."""
    wider = SE3((0.0, 0.0, 1.93))
    moved = [
        replace(s, scene=replace(s.scene, lidars=(replace(s.scene.lidars[0], T_rig_lidar=wider),)))
        if s.scene_index
        else s
        for s in samples
    ]
    folder = world.export(KittiRaw(), drive_info(world), moved, tmp_path)

    assert stems(folder) == ["2011_09_26", "2011_09_27", "drives"]
    heights = [
        calibration(folder / date / "calib_velo_to_cam.txt")["T"][1]
        for date in ("2011_09_26", "2011_09_27")
    ]
    assert heights == pytest.approx([-0.13, -0.33])


def test_cameras_that_look_elsewhere_cannot_be_a_rectified_pair(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """The message names the camera and what to do."""
    sample = samples[0]
    left, right = sample.scene.cameras
    turned = replace(right, T_rig_camera=SE3.about_z(0.1) @ right.T_rig_camera)
    scene = replace(sample.scene, cameras=(left, turned))

    with pytest.raises(ConfigError, match=r"'right' is not parallel.*same yaw"):
        world.export(
            KittiRaw(image_03="right"), drive_info(world), [replace(sample, scene=scene)], tmp_path
        )


# ------------------------------------------------------------------------- KITTI tracking


def test_tracking_labels_have_seventeen_columns_and_lasting_ids(exported: Any) -> None:
    """Frames from 0, ids of the instances, whole numbers for truncation."""
    folder = exported(KittiTracking(low_px=4)) / "training"
    rows = [line.split(" ") for line in (folder / "label_02/0001.txt").read_text().splitlines()]

    assert {len(row) for row in rows} == {17}
    assert [row[0] for row in rows if row[1] == "1"] == ["0", "1", "2", "3"]
    assert {(row[1], row[2]) for row in rows} == {
        ("1", "Car"), ("2", "Pedestrian"), ("4", "Misc")
    }  # fmt: skip
    assert {row[3] for row in rows} <= {"0", "1", "2"}


def test_tracking_lists_sequences_by_split(exported: Any) -> None:
    """TrackEval's lists; images and scans from 0, six digits."""
    folder = exported(KittiTracking(right_camera="right")) / "training"

    lists = {k: (folder / f"evaluate_tracking.seqmap.{k}").read_text() for k in ("train", "val")}
    assert lists == {"train": "0000 empty 000000 000004\n", "val": "0001 empty 000000 000004\n"}
    both = (folder / "evaluate_tracking.seqmap.training").read_text()
    assert both == lists["train"] + lists["val"]
    for kind in ("image_02", "image_03", "velodyne"):
        assert stems(folder / kind / "0001") == FRAMES
    assert len((folder / "oxts/0001.txt").read_text().splitlines()) == 4


def test_tracking_calibration_projects_labels_onto_their_boxes(exported: Any) -> None:
    """The centre of every 3D box falls into its 2D box, by P2; line names are KITTI's."""
    folder = exported(KittiTracking(low_px=4)) / "training"
    calib = calibration(folder / "calib/0000.txt")
    assert list(calib) == ["P0", "P1", "P2", "P3", "R_rect", "Tr_velo_cam", "Tr_imu_velo"]

    assert calib["Tr_imu_velo"].reshape(3, 4)[:, 3] == pytest.approx([0.0, 0.0, -1.73])
    rows = [line.split(" ") for line in (folder / "label_02/0000.txt").read_text().splitlines()]
    assert len(rows) == 12
    for row in rows:
        left, top, right, bottom, height, _, _, x, y, z = map(float, row[6:16])
        u, v, w = calib["P2"].reshape(3, 4) @ [x, y - 0.5 * height, z, 1.0]
        assert left <= u / w <= right
        assert top <= v / w <= bottom


@pytest.mark.parametrize(("share", "level"), [(0.0, 0), (0.15, 0), (0.2, 1), (0.5, 1), (0.6, 2)])
def test_truncation_has_three_levels(share: float, level: int) -> None:
    """KITTI's easy and hard limits are 15 and 50 per cent."""
    assert truncation_level(share) == level


# --------------------------------------------------------------------------- MOTChallenge


def test_mot_rows_count_from_one(exported: Any, samples: Any) -> None:
    """Frames, ids and pixels; boxes are those of the visible pixels."""
    folder = exported(MotChallenge()) / "street-val/street-0001"
    rows = [line.split(",") for line in (folder / "gt/gt.txt").read_text().splitlines()]

    assert stems(folder / "img1") == [f"{k:06d}" for k in range(1, 5)]
    assert [row[0] for row in rows if row[1] == "2"] == ["1", "2", "3", "4"]
    for row in rows:
        truth = samples[4 + int(row[0]) - 1].truth["left"]
        (thing,) = (t for t in truth.objects if t.instance.instance_id == int(row[1]))
        assert thing.box is not None
        assert list(map(int, row[2:6])) == [
            thing.box.x_min + 1, thing.box.y_min + 1, thing.box.width_px, thing.box.height_px
        ]  # fmt: skip
        assert float(row[8]) == pytest.approx(thing.visible_fraction, abs=1e-6)
    assert {(row[1], row[6], row[7]) for row in rows} == {("1", "0", "3"), ("2", "1", "1")}


def test_mot_sequences_describe_themselves(exported: Any) -> None:
    """seqinfo.ini by an ini reader; the list of sequences has TrackEval's header."""
    folder = exported(MotChallenge())
    ini = configparser.ConfigParser()
    ini.read(folder / "street-train/street-0000/seqinfo.ini")

    assert dict(ini["Sequence"]) == {
        "name": "street-0000",
        "imdir": "img1",
        "framerate": "10",
        "seqlength": "4",
        "imwidth": "160",
        "imheight": "120",
        "imext": ".png",
    }
    assert (folder / "seqmaps/street-val.txt").read_text() == "name\nstreet-0001\n"


@pytest.mark.parametrize(
    ("category", "facts", "number"),
    [
        ("person", (), 1),
        ("pedestrian", (("pose", "sitting"),), 7),
        ("motorcycle", (("rider", "yes"),), 2),
        ("motorcycle", (("rider", "no"),), 5),
        ("bicycle", (), 4),
        ("bus", (), 3),
        ("crate", (), 0),
    ],
)
def test_mot_classes(category: str, facts: Any, number: int, world: Any) -> None:
    """Numbers of MOT16's table 5; 0 has no rows."""
    thing = replace(world.instance(1, "car", 0.0, 0.0, 0.0), category=category, attributes=facts)

    assert mot_class(thing) == number


# -------------------------------------------------------------------------- SemanticKITTI


def poses(folder: Path) -> list[Any]:
    """Matrices [4, 4] of ``poses.txt``."""
    rows = [line.split() for line in (folder / "poses.txt").read_text().splitlines()]
    return [np.vstack([np.array(r, float).reshape(3, 4), [0, 0, 0, 1]]) for r in rows]


def test_semantic_sequences_are_views_and_poses_those_of_the_drive(
    exported: Any, world: Any
) -> None:
    """Tr^-1 pose Tr moves the scanner along the circle; times are a step apart."""
    folder = exported(SemanticKitti())
    assert stems(folder / "sequences") == ["00", "01"]
    assert (folder / "split.yaml").read_text() == "split:\n  train: [0]\n  valid: [1]\n  test: []\n"
    sequence = folder / "sequences/01"
    Tr = np.vstack([calibration(sequence / "calib.txt")["Tr"].reshape(3, 4), [0, 0, 0, 1]])

    for k, pose in enumerate(poses(sequence)):
        moved = np.linalg.inv(Tr) @ pose @ Tr
        np.testing.assert_allclose(moved, world.ego_pose(0.1 * k).matrix(), atol=3e-6)
    times = [float(t) for t in (sequence / "times.txt").read_text().split()]
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert (sequence / "scans.txt").read_text().split() == ["4", "5", "6", "7"]


def test_semantic_classes_of_things_that_move(exported: Any) -> None:
    """Moving car 252, moving person 254, with the instance ids of the scene in every scan."""
    for path in sorted((exported(SemanticKitti()) / "sequences/00/labels").iterdir()):
        labels = np.fromfile(path, "<u4")
        assert {(int(v) & 0xFFFF, int(v) >> 16) for v in labels} == {
            (252, 1), (254, 2), (99, 0), (40, 0)
        }  # fmt: skip


def test_semantic_points_of_what_stands_stay_in_the_world(exported: Any, samples: Any) -> None:
    """The crate's points, moved by the poses, stay within its box in all scans."""
    sequence = exported(SemanticKitti()) / "sequences/00"
    Tr = np.vstack([calibration(sequence / "calib.txt")["Tr"].reshape(3, 4), [0, 0, 0, 1]])
    seen = 0
    for k, pose in enumerate(poses(sequence)):
        points = np.fromfile(sequence / f"velodyne/{k:06d}.bin", "<f4").reshape(-1, 4)
        mine = points[samples[k].capture.clouds["top"].points["instance_id"] == 4]
        local = (np.linalg.inv(Tr) @ pose @ Tr) @ np.column_stack(
            [mine[:, :3], np.ones(len(mine))]
        ).T
        centre = np.array([14.0, 4.0, 0.45 - 1.73])
        assert np.linalg.norm(local[:3].T - centre, axis=1).max(initial=0.0) < 1.0
        seen += len(mine)
    assert seen > 10


# ------------------------------------------------------------------------------------ COCO


def test_coco_knows_sequences_frames_and_tracks(exported: Any) -> None:
    """A track is one object in all images of one sequence, whatever the camera."""
    folder = exported(Coco()) / "annotations"
    tracks: dict[str, set[int]] = {}
    for split, number in (("train", 0), ("val", 1)):
        data = json.loads((folder / f"instances_{split}.json").read_text())
        images = {image["id"]: image for image in data["images"]}
        assert {image["sequence_id"] for image in images.values()} == {number}
        assert sorted((i["frame_id"], i["sensor"]) for i in images.values()) == [
            (k, s) for k in range(4) for s in ("left", "right")
        ]
        for image in images.values():
            assert image["time_s"] == pytest.approx(0.1 * image["frame_id"])
        by_instance: dict[int, set[int]] = {}
        for row in data["annotations"]:
            by_instance.setdefault(row["instance_id"], set()).add(row["track_id"])
        assert {k: len(ids) for k, ids in by_instance.items()} == {1: 1, 2: 1, 4: 1}
        tracks[split] = set().union(*by_instance.values())
    assert not tracks["train"] & tracks["val"]


def test_coco_of_single_images_has_no_tracks(world: Any, tmp_path: Path) -> None:
    """A view of one instant is no sequence."""
    folder = world.export(Coco(), world.info(7), world.samples, tmp_path)
    data = json.loads((folder / "annotations/instances_train.json").read_text())

    assert "sequence_id" not in data["images"][0]
    assert "track_id" not in data["annotations"][0]


# ---------------------------------------------------------- sensors that miss some instants


def test_sensors_that_miss_a_step_have_no_files_there(
    world: Any, slow: Any, tmp_path: Path
) -> None:
    """In raw drives: the numbers of the frames stay, times are those of the files."""
    exporter = KittiRaw(image_03="right")
    drive = world.export(exporter, drive_info(world), slow, tmp_path) / DRIVE.format(1)

    assert stems(drive / "image_02/data") == [f"{k:010d}" for k in range(4)]
    for sensor in ("image_03", "velodyne_points"):
        assert stems(drive / sensor / "data") == ["0000000000", "0000000002"]
        lines = (drive / sensor / "timestamps.txt").read_text().splitlines()
        assert [line.split(":")[-1] for line in lines] == ["00.000000000", "00.200000000"]


def test_frames_are_numbered_by_the_camera_that_a_format_is_about(
    world: Any, slow: Any, tmp_path: Path
) -> None:
    """A camera at half the rate has half the frames, without gaps, at half the frame rate."""
    info = drive_info(world)
    mot = world.export(MotChallenge(camera="right"), info, slow, tmp_path / "m")
    tracking = world.export(KittiTracking(camera="right"), info, slow, tmp_path / "t")

    text = (mot / "street-train/street-0000/seqinfo.ini").read_text()
    assert "frameRate=5\nseqLength=2\n" in text
    rows = (tracking / "training/label_02/0001.txt").read_text().splitlines()
    assert {row.split()[0] for row in rows} == {"0", "1"}
    assert stems(tracking / "training/velodyne/0001") == ["000000", "000001"]


@pytest.mark.parametrize(
    "exporter", [Coco(), Kitti(camera="right"), SemanticKitti(), PointClouds(), Kitti()]
)
def test_every_format_can_do_without_some_readings(
    exporter: Any, world: Any, slow: Any, tmp_path: Path
) -> None:
    """Files are those of the steps that were read, and no others."""
    folder = world.export(exporter, drive_info(world), slow, tmp_path)
    even = ["000000", "000002", "000004", "000006"]

    if exporter.type == "coco":
        files = sorted(p.name for p in (folder / "train").iterdir())
        assert [name for name in files if "right" in name] == [
            "000000000_right.png", "000000002_right.png"
        ]  # fmt: skip
        assert len(files) == 6
    elif exporter.type == "semantickitti":
        assert (folder / "sequences/01/scans.txt").read_text().split() == ["4", "6"]
    elif exporter.type == "pointclouds":
        assert stems(folder / "top") == [*(f"000{name}" for name in even), "poses"]
    elif exporter.camera:
        assert stems(folder / "training/label_2") == stems(folder / "training/velodyne") == even
    else:
        assert len(stems(folder / "training/label_2")) == 8
        assert stems(folder / "training/velodyne") == even


# ------------------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("exporter", "message"),
    [
        (KittiRaw(image_02="lefd"), "camera 'lefd'.*did you mean 'left'"),
        (KittiRaw(lidar="velo"), "no lidar 'velo'.*top"),
        (KittiRaw(oxts="gps"), "no device 'gps'.*imu"),
        (KittiTracking(camera="middle"), "camera 'middle'.*left, right"),
        (KittiTracking(lidar="velo"), "no lidar 'velo'"),
        (MotChallenge(camera="middle"), "camera 'middle'.*left, right"),
    ],
)
def test_sensors_that_are_not_there_are_refused(exporter: Any, message: str, world: Any) -> None:
    """Before anything is rendered, naming what there is."""
    with pytest.raises(ConfigError, match=message):
        exporter.check(drive_info(world))


@pytest.mark.parametrize("exporter", [KittiRaw(), KittiTracking(), Kitti()])
def test_rectified_formats_refuse_other_lenses_than_pinholes(exporter: Any, world: Any) -> None:
    """The message names the sensor and its lens."""
    info = drive_info(world)
    sensors = [replace(s, lens="fisheye") if s.name == "left" else s for s in info.sensors]
    info = replace(info, sensors=tuple(sensors))
    with pytest.raises(ConfigError, match=r"'left' has a lens of the model 'fisheye'.*coco"):
        exporter.check(info)


def test_raw_data_needs_a_scanner(world: Any) -> None:
    """KITTI's readers do."""
    with pytest.raises(ConfigError, match="no lidar; add a sensor"):
        KittiRaw().check(world.info(8, ("left",), steps_per_scene=4))


@pytest.mark.parametrize("exporter", [KittiRaw(), KittiTracking(), MotChallenge()])
def test_more_sequences_than_names_are_refused(exporter: Any, world: Any) -> None:
    """Four digits; the error gives the largest number of samples."""
    info = world.info(40_001, ("left",), ("top",), steps_per_scene=4)
    with pytest.raises(
        ConfigError,
        match=r"there are 10001; expected at most 40000 samples",
    ):
        exporter.check(info)


@pytest.mark.parametrize("date", ["2011-09-26", "2011_13_01", "2011_9_26", "today"])
def test_a_date_is_a_day(date: str) -> None:
    """Year, month and day with underscores."""
    with pytest.raises(ValueError, match="2011_09_26"):
        KittiRaw(date=date)


def test_a_pose_without_motion_is_where_the_rig_stands(world: Any, tmp_path: Path) -> None:
    """Cameras without a rig have a drive, too: it stands still."""
    info = world.info(7, lidars=("top",))
    folder = world.export(KittiRaw(), info, world.samples, tmp_path)
    row = (folder / DRIVE.format(2) / "oxts/data/0000000000.txt").read_text().split()

    assert float(row[2]) == pytest.approx(1.6)
    assert float(row[8]) == 0.0
