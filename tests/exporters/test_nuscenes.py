"""nuScenes: tables, poses, files and classes, read without the devkit."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import POINT
from gen_data.core.measurement_dtypes import table_rows
from gen_data.core.motion import Trajectory, Twist
from gen_data.core.scene import Body, Lane, ObjectGroup, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters import nuscenes_files
from gen_data.exporters.nuscenes import NuScenes
from gen_data.exporters.nuscenes_classes import attribute_of, category_of, classes
from gen_data.exporters.nuscenes_frames import annotated_things, views_by_instance, visibility_level
from gen_data.sensors.radar.radar_sensor import Radar
from tests.exporters.datasets import in_scene, scanning
from tests.exporters.drives import drive_info

ORIGIN_M = (50.0, 50.0, 0.0)
"""Of a world without lanes, in the global frame."""


def table(folder: Path, name: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads((folder / f"v1.0-mini/{name}.json").read_text())
    return rows


def by_token(folder: Path, name: str) -> dict[str, dict[str, Any]]:
    rows = table(folder, name)
    found = {row["token"]: row for row in rows}
    assert len(found) == len(rows)
    return found


def pose(row: Mapping[str, Any]) -> SE3:
    return SE3(tuple(row["translation"]), tuple(row["rotation"]))


def readings(folder: Path, channel: str) -> list[dict[str, Any]]:
    """Rows of ``sample_data`` of a channel, in order, with the poses of ego and sensor."""
    calibrated, egos = by_token(folder, "calibrated_sensor"), by_token(folder, "ego_pose")
    sensors = by_token(folder, "sensor")
    found = []
    for row in table(folder, "sample_data"):
        mount = calibrated[row["calibrated_sensor_token"]]
        if sensors[mount["sensor_token"]]["channel"] == channel:
            found.append(row | {"mount": mount, "ego": egos[row["ego_pose_token"]]})
    return found


@pytest.fixture(scope="module")
def every(exported: Any) -> Path:
    folder: Path = exported(NuScenes(key_frame_s=0.1))
    return folder


def test_steps_between_key_frames_are_sweeps(exported: Any) -> None:
    """A sweep belongs to the key frame that follows, the last ones to the last."""
    folder = exported(NuScenes(key_frame_s=0.2))
    samples = by_token(folder, "sample")
    rows = readings(folder, "CAM_LEFT")
    assert [row["is_key_frame"] for row in rows] == [True, False, True, False] * 2
    assert [row["filename"].split("/")[0] for row in rows[:2]] == ["samples", "sweeps"]
    assert all((folder / row["filename"]).exists() for row in rows)
    owners = [samples[row["sample_token"]]["timestamp"] - rows[0]["timestamp"] for row in rows[:4]]
    assert owners == [0, 200_000, 200_000, 200_000]
    assert [scene["nbr_samples"] for scene in table(folder, "scene")] == [2, 2]
    assert len(table(folder, "lidarseg")) == len(list(folder.glob("lidarseg/*/*.bin"))) == 4


def test_times_are_microseconds_and_chains_follow_them(every: Path) -> None:
    """Steps are 100 ms apart; a chain begins and ends with an empty token."""
    for channel in ("CAM_LEFT", "CAM_RIGHT", "LIDAR_TOP"):
        rows = readings(every, channel)
        assert len(rows) == 8
        for first in (0, 4):
            chain = rows[first : first + 4]
            assert np.diff([row["timestamp"] for row in chain]).tolist() == [100_000] * 3
            tokens = [row["token"] for row in chain]
            assert [row["next"] for row in chain] == [*tokens[1:], ""]
            assert [row["prev"] for row in chain] == ["", *tokens[:-1]]
    assert rows[4]["timestamp"] - rows[3]["timestamp"] > 1_000_000


def test_poses_intrinsics_and_scans_are_those_of_the_sensors(every: Path, samples: Any) -> None:
    """Ego and mount together are the sensor in the world; pixel centres are whole numbers."""
    T_global_world = SE3(ORIGIN_M)
    for sample, row in zip(samples, readings(every, "CAM_RIGHT"), strict=True):
        camera = sample.truth["right"].camera
        made = pose(row["ego"]) @ pose(row["mount"])
        expected = T_global_world @ camera.T_world_camera
        np.testing.assert_allclose(made.matrix(), expected.matrix(), atol=3e-6)
        K = camera.intrinsics.matrix() - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
        np.testing.assert_allclose(row["mount"]["camera_intrinsic"], K)
        assert (row["width"], row["height"]) == (160, 120)
    (origin,) = {tuple(log["world_origin"]) for log in table(every, "log")}
    assert origin == ORIGIN_M
    # X right, y forward, intensity to 255; the mount turns them back to the world.
    for sample, row in zip(samples, readings(every, "LIDAR_TOP"), strict=True):
        points = np.fromfile(every / row["filename"], "<f4").reshape(-1, 5)
        cloud = sample.capture.clouds["top"].points
        np.testing.assert_array_equal(points[:, 0], -cloud["position_m"][:, 1])
        np.testing.assert_array_equal(points[:, 1], cloud["position_m"][:, 0])
        np.testing.assert_array_equal(points[:, 3], np.rint(255 * cloud["intensity"]))
        (scanner,) = sample.scene.lidars
        T_global_scan = pose(row["ego"]) @ pose(row["mount"])
        made = T_global_scan.apply(points[:, :3].astype(float))
        expected = scanner.T_world_lidar.apply(cloud["position_m"].astype(float)) + ORIGIN_M
        np.testing.assert_allclose(made, expected, atol=1e-4)


@pytest.mark.parametrize(("yaw_deg", "turns"), [(0, 3), (-90, 0), (90, 2), (180, 1), (-85, 0)])
def test_files_of_a_scanner_look_ahead_however_it_is_mounted(yaw_deg: int, turns: int) -> None:
    """A point ahead of the ego is along y, one on its left along negative x."""
    mount = SE3.about_z(np.radians(yaw_deg))
    assert nuscenes_files.quarter_turns(mount) == turns
    points = np.zeros(2, POINT)
    ego_m = np.array([[10.0, 0.0, 1.0], [0.0, 10.0, 1.0]])
    points["position_m"] = mount.inverse().apply(ego_m)
    xyz = np.frombuffer(nuscenes_files.lidar_bytes(points, turns), "<f4").reshape(-1, 5)[:, :3]
    np.testing.assert_allclose(xyz, [[0, 10, 1], [-10, 0, 1]], atol=1.0)
    assert np.isclose(np.linalg.norm(xyz[0]), np.sqrt(101.0))


def test_the_lowest_laser_is_ring_0_and_radar_files_have_the_fields_of_the_device() -> None:
    """Position and radial velocity of a detection 30 degrees to the left that approaches."""
    points = np.zeros(3, POINT)
    points["ring"] = [0, 30, 31]
    rings = np.frombuffer(nuscenes_files.lidar_bytes(points, 0), "<f4").reshape(-1, 5)[:, 4]
    assert rings.tolist() == [31, 1, 0]
    rows = table_rows(
        Radar.columns,
        2,
        range_m=[10.0, 20.0],
        azimuth_rad=[np.pi / 6, 0.0],
        velocity_m_s=[-8.0, -5.0],
        velocity_compensated_m_s=[-3.0, 0.1],
        rcs_dbsm=[12.5, 3.0],
    )
    head, body = nuscenes_files.radar_bytes(rows).split(b"DATA binary\n")
    points = np.frombuffer(body[:-1], nuscenes_files.RADAR_POINT)
    assert nuscenes_files.RADAR_POINT.itemsize == 43
    assert b"WIDTH 2\n" in head
    np.testing.assert_allclose(points["x"], [10 * np.cos(np.pi / 6), 20], rtol=1e-6)
    np.testing.assert_allclose(points["y"], [5, 0], atol=1e-5)
    np.testing.assert_allclose(points["vy"], [-4, 0], atol=1e-5)
    np.testing.assert_allclose(points["vy_comp"], [-1.5, 0], atol=1e-5)
    assert points["dyn_prop"].tolist() == [2, 1]
    assert points["id"].tolist() == [0, 1]


def test_boxes_count_the_pulses_that_hit_and_points_are_labelled(every: Path, samples: Any) -> None:
    """Of a noise-free scan, whose points lie on the faces: each hit counts."""
    annotations = by_token(every, "sample_annotation")
    instances = by_token(every, "instance")
    categories = by_token(every, "category")
    found: dict[tuple[int, str], int] = {}
    order = {row["token"]: k for k, row in enumerate(table(every, "sample"))}
    for row in annotations.values():
        name = categories[instances[row["instance_token"]]["category_token"]]["name"]
        found[order[row["sample_token"]], name] = row["num_lidar_pts"]
    for k, sample in enumerate(samples):
        ids = sample.capture.clouds["top"].points["instance_id"]
        for number, name in ((1, "vehicle.car"), (2, "human.pedestrian.adult")):
            assert found[k, name] == int((ids == number).sum())
    assert sum(found.values()) > 100
    # Class by point; instance numbers count per category and stay the same.
    index = {row["name"]: row["index"] for row in table(every, "category")}
    labels = {row["sample_data_token"]: row["filename"] for row in table(every, "lidarseg")}
    panoptic = {row["sample_data_token"]: row["filename"] for row in table(every, "panoptic")}
    names = ("flat.driveable_surface", "vehicle.car", "human.pedestrian.adult", "static.other")
    expected = dict(zip((0, 1, 2, 4), map(index.__getitem__, names), strict=True))
    for sample, row in zip(samples, readings(every, "LIDAR_TOP"), strict=True):
        points = sample.capture.clouds["top"].points
        made = np.fromfile(every / labels[row["token"]], np.uint8)
        assert made.tolist() == [expected[k] for k in points["instance_id"].tolist()]
        whole = np.load(every / panoptic[row["token"]])["data"]
        assert whole.dtype == np.uint16
        assert (whole // 1000 == made).all()
        assert (whole % 1000 == (points["instance_id"] > 0)).all()


def test_boxes_are_in_the_global_frame_with_width_first(every: Path, samples: Any) -> None:
    """The car: width 1.8, length 4, height 1.5, 2 mm more on every side."""
    categories = {row["token"]: row["name"] for row in table(every, "category")}
    (car, _) = [
        row
        for row in table(every, "instance")
        if categories[row["category_token"]] == "vehicle.car"
    ]
    annotations = by_token(every, "sample_annotation")
    row = annotations[car["first_annotation_token"]]
    for sample in samples[:4]:
        thing = sample.scene.instance(1)
        expected = np.add(thing.T_world_instance.apply(np.array([0.0, 0.0, 0.75])), ORIGIN_M)
        np.testing.assert_allclose(row["translation"], expected, atol=1e-5)
        np.testing.assert_allclose(row["size"], [1.804, 4.004, 1.504])
        heading = pose(row).rotation()[:, 0]
        np.testing.assert_allclose(heading, thing.T_world_instance.rotation()[:, 0], atol=1e-6)
        row = annotations.get(row["next"], {})
    assert row == {}
    assert car["nbr_annotations"] == 4


def swept(sample: Any) -> Any:
    """The sample with a sweep of 100 ms whose pulses hit everything at its end."""
    cloud = sample.capture.clouds["top"]
    points = cloud.points.copy()
    points["time_s"] = 0.1
    return scanning(sample, points, lidar=replace(cloud.lidar, sweep_s=0.1))


@pytest.mark.parametrize(("boxes_at", "ahead_m"), [("pulse", 0.4), ("step", 0.0)])
def test_boxes_are_where_pulses_hit_the_object(
    world: Any, samples: Any, tmp_path: Path, boxes_at: Any, ahead_m: float
) -> None:
    """Half a sweep later, the car at 8 m/s is 0.4 m ahead; the crate is where it was."""
    sample = swept(samples[1])
    exporter = NuScenes(boxes_at=boxes_at, box_margin_m=0.0)
    folder = world.export(exporter, drive_info(world), [sample], tmp_path)
    moved = {}
    for row in table(folder, "sample_annotation"):
        centre = np.subtract(row["translation"], ORIGIN_M)
        places = [i.T_world_instance.translation_m[:2] for i in sample.scene.instances]
        nearest = np.argmin(np.linalg.norm(centre[:2] - places, axis=1))
        thing = sample.scene.instances[nearest]
        offset = thing.T_world_instance.inverse().apply(centre)
        moved[thing.instance_id] = round(float(offset[0]), 4)
    assert moved == {1: ahead_m, 2: round(ahead_m * 1.5 / 8.0, 4), 4: 0.0}


def test_ignored_objects_have_no_box_and_visibility_adds_up(world: Any, samples: Any) -> None:
    """Two cameras that show a half each show all; half of it hidden is level 2."""
    sample = samples[0]
    image = sample.truth["left"]
    flagged = tuple(replace(t, ignored=t.instance.instance_id == 2) for t in image.objects)
    instances = tuple(
        replace(i, annotated=False) if i.instance_id == 4 else i for i in sample.scene.instances
    )
    one = {**sample.truth, "left": replace(image, objects=flagged)}
    both = {name: replace(view, objects=flagged) for name, view in sample.truth.items()}
    changed = in_scene(sample, instances=instances)
    assert set(annotated_things(sample)) == {1, 2, 4}
    assert set(annotated_things(replace(changed, truth=both))) == {1}
    # An object that counts in one image, such as a car at its border, has its box.
    assert set(annotated_things(replace(changed, truth=one))) == {1, 2}
    views = views_by_instance(samples[0])[1]
    half = [replace(view, visible_px=100, occlusion=0.0, truncation=0.5) for view in views[:2]]
    assert len(views) == 2
    assert (visibility_level(half), visibility_level(half[:1])) == ("4", "2")
    assert visibility_level([replace(view, occlusion=0.5) for view in half]) == "2"
    assert visibility_level([replace(view, occlusion=0.3) for view in half]) == "3"
    assert visibility_level([]) == "1"


def test_a_hidden_object_keeps_its_track(world: Any, samples: Any, tmp_path: Path) -> None:
    """It is annotated from the first to the last key frame that senses it, without a gap."""
    hidden = []
    for k, sample in enumerate(samples[:4]):
        unseen = (1, 2) if k == 1 else (2,) if k == 3 else ()
        hidden.append(without(sample, unseen))
    folder = world.export(NuScenes(key_frame_s=0.1), drive_info(world), hidden, tmp_path)
    counts = {row["category_token"]: row["nbr_annotations"] for row in table(folder, "instance")}
    names = {row["token"]: row["name"] for row in table(folder, "category")}
    assert {names[k]: n for k, n in counts.items()} == {
        "vehicle.car": 4,
        "human.pedestrian.adult": 3,
        "static.other": 4,
    }
    levels = [row for row in table(folder, "sample_annotation") if row["num_lidar_pts"] == 0]
    assert [row["visibility_token"] for row in levels] == ["1", "1"]


def without(sample: Any, numbers: tuple[int, ...]) -> Any:
    """The sample of which no sensor senses some instances."""
    truth = {
        name: replace(
            image, objects=tuple(t for t in image.objects if t.instance.instance_id not in numbers)
        )
        for name, image in sample.truth.items()
    }
    points = sample.capture.clouds["top"].points
    sensed = points[~np.isin(points["instance_id"], numbers)]
    return replace(scanning(sample, sensed), truth=truth)


def test_maps_show_where_one_may_drive() -> None:
    """Ten pixels per metre, the last row at y = 0; the origin is below and left of all lanes."""
    lanes = (Lane("a", "driving", ((-20.0, 5.0, 0.0), (20.0, 5.0, 0.0)), 4.0),
             Lane("b", "sidewalk", ((-20.0, 12.0, 0.0), (20.0, 12.0, 0.0)), 2.0))  # fmt: skip
    area = nuscenes_files.map_area(lanes)
    mask = cv2.imdecode(
        np.frombuffer(nuscenes_files.map_bytes(lanes, area), np.uint8), cv2.IMREAD_UNCHANGED
    )

    def is_driveable(x_m: float, y_m: float) -> bool:
        x, y, _ = area.T_global_world.apply(np.array([x_m, y_m, 0.0]))
        return bool(mask[mask.shape[0] - round(10 * y), round(10 * x)])

    assert area.low_m == (-70, -45)
    assert mask.shape == (10 * area.size_m[1], 10 * area.size_m[0])
    assert set(np.unique(mask)) == {0, 255}
    assert [is_driveable(0, y) for y in (2.8, 3.2, 6.8, 7.2, 12.0)] == [
        False, True, True, False, False
    ]  # fmt: skip
    assert [is_driveable(x, 5) for x in (-20.3, -19.7, 19.7, 20.3)] == [False, True, True, False]


def test_classes_have_names_of_nuscenes_and_attributes_tell_how_objects_stand(world: Any) -> None:
    """Tables refer to known categories and surfaces."""
    names = [name for name, _ in classes().categories]
    assert len(names) == len(set(names)) == 32
    assert set(classes().things.values()) | set(classes().surfaces.values()) <= set(names)
    assert set(classes().surfaces) <= set(SURFACES)
    # Parked next to the lanes, stopped in traffic, moving by speed, people by their pose.
    groups = tuple(
        ObjectGroup(name, (), (), 1, "along", lanes=(kind,))
        for name, kind in (("parked", "parking"), ("traffic", "driving"))
    )
    still = Trajectory("waiting", 1.0, (SE3(), SE3()))
    scene = Scene("street", groups=groups, tracks=(still,))
    car = world.instance(1, "car", 0.0, 0.0, 0.0)
    fast = replace(car, twist=Twist((3.0, 0.0, 0.0)))
    person = world.instance(2, "pedestrian", 0.0, 0.0, 0.0)

    def attribute(thing: Any, body: str = "", group: str = "", **facts: str) -> str:
        thing = replace(thing, attributes=tuple(facts.items()))
        owner = Body(body, "asset", group=group) if body else None
        return attribute_of(category_of(thing), thing, owner, scene)

    assert attribute(fast, "a", "parked") == "vehicle.moving"
    assert attribute(car, "a", "parked") == "vehicle.parked"
    assert attribute(car, "a", "traffic") == "vehicle.stopped"
    assert (attribute(car, "waiting"), attribute(car, "a")) == ("vehicle.stopped", "vehicle.parked")
    assert attribute(person, "a", pose="sitting") == "pedestrian.sitting_lying_down"
    assert attribute(person, "a", pose="walk") == "pedestrian.moving"
    assert attribute(person, "waiting", pose="walk") == "pedestrian.standing"
    ridden = replace(car, category="motorcycle")
    assert attribute(ridden, rider="yes") == "cycle.with_rider"
    assert attribute(ridden, rider="no") == "cycle.without_rider"
    child = replace(person, subcategory="child")
    assert category_of(child) == "human.pedestrian.child"


def test_a_scan_without_returns_is_a_key_frame(world: Any, samples: Any, tmp_path: Path) -> None:
    """Its files are empty; boxes that cameras see count no point."""
    empty = scanning(samples[0], samples[0].capture.clouds["top"].points[:0])
    folder = world.export(NuScenes(), drive_info(world), [empty], tmp_path)
    (row,) = readings(folder, "LIDAR_TOP")
    assert (folder / row["filename"]).stat().st_size == 0
    assert {row["num_lidar_pts"] for row in table(folder, "sample_annotation")} == {0}
    (labels,) = table(folder, "panoptic")
    assert np.load(folder / labels["filename"])["data"].shape == (0,)
