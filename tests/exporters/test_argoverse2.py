"""Argoverse 2: tables, scans, boxes and maps, read without the devkit."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.scene_time import RIG_AXES
from gen_data.core.se3 import SE3
from gen_data.exporters.argoverse2 import Argoverse2
from gen_data.exporters.argoverse_map import argoverse_map, mark_type, without_holes
from gen_data.exporters.road_map import Area, Paint, road_map
from tests.exporters.datasets import made_of
from tests.exporters.test_nuscenes_expansions import streets, town
from tests.libraries import library

LOG = "train/street-000000"


dataset = made_of(Argoverse2(), town, library)


@pytest.fixture(scope="module")
def log(dataset: Path) -> Path:
    return dataset / LOG


def table(path: Path) -> list[dict[str, Any]]:
    from pyarrow import feather

    rows: list[dict[str, Any]] = feather.read_table(path).to_pylist()
    return rows


def pose(row: dict[str, Any]) -> SE3:
    w, x, y, z, *t = (row[k] for k in ("qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m"))
    return SE3(tuple(t), (w, x, y, z))


def check_log(folder: Path, samples: Any) -> None:
    """Cameras, scans and boxes are where they are in the world."""
    log = folder / LOG
    mounts = {r["sensor_name"]: r for r in table(log / "calibration/egovehicle_SE3_sensor.feather")}
    lenses = {r["sensor_name"]: r for r in table(log / "calibration/intrinsics.feather")}
    egos = {r["timestamp_ns"]: r for r in table(log / "city_SE3_egovehicle.feather")}
    boxes = table(log / "annotations.feather")
    scans = sorted((log / "sensors/lidar").iterdir())
    assert (
        set(mounts) == {"left", "right", "up_lidar", "down_lidar"} and len(egos) == len(scans) == 4
    )
    for sample, path in zip(samples, scans, strict=False):
        time_ns = int(path.stem)
        T_city_ego = pose(egos[time_ns])
        camera = sample.truth["right"].camera
        made = T_city_ego @ pose(mounts["right"])
        np.testing.assert_allclose(made.matrix(), camera.T_world_camera.matrix(), atol=3e-6)
        K = camera.intrinsics
        values = [lenses["right"][k] for k in ("fx_px", "fy_px", "cx_px", "cy_px")]
        assert values == pytest.approx([K.fx_px, K.fy_px, K.cx_px - 0.5, K.cy_px - 0.5])
        cloud = sample.capture.clouds["top"]
        points = np.array([[r["x"], r["y"], r["z"]] for r in table(path)])
        city = T_city_ego.apply(points)
        expected = sample.scene.lidars[0].T_world_lidar.apply(cloud.points["position_m"])
        np.testing.assert_allclose(city, expected, atol=1e-4)
        here = [row for row in boxes if row["timestamp_ns"] == time_ns]
        assert {row["category"] for row in here} == {"REGULAR_VEHICLE", "PEDESTRIAN"}
        car = next(row for row in here if row["category"] == "REGULAR_VEHICLE")
        (thing,) = (i for i in sample.scene.instances if i.category == "car")
        T_city_box = T_city_ego @ pose(car)
        np.testing.assert_allclose(T_city_box.matrix(), thing.box3d.T_frame_box.matrix(), atol=3e-6)
        assert (car["length_m"], car["width_m"], car["height_m"]) == (4.0, 1.8, 1.5)
        hits = int((cloud.points["instance_id"] == thing.instance_id).sum())
        assert car["num_interior_pts"] == hits


def test_sensors_scans_and_boxes_are_where_they_are_in_the_world(log: Path, samples: Any) -> None:
    check_log(log.parents[1], samples)
    times = sorted(int(path.stem) for path in (log / "sensors/lidar").iterdir())
    assert np.diff(times).tolist() == [100_000_000] * 3
    images = sorted(int(path.stem) for path in (log / "sensors/cameras/left").iterdir())
    assert images == times
    # The mount of a camera turns its axes: X right, Y down, Z forward.
    mount = next(r for r in table(log / "calibration/egovehicle_SE3_sensor.feather")
                 if r["sensor_name"] == "left")  # fmt: skip
    expected = SE3((0.3, 0.0, 1.6)) @ RIG_AXES.inverse()
    np.testing.assert_allclose(pose(mount).matrix(), expected.matrix(), atol=1e-6)


def test_maps_have_the_lanes_of_the_street_with_marks_and_links(log: Path) -> None:
    (path,) = (log / "map").glob("log_map_archive_street-000000____GEN_city_0.json")
    roads = json.loads(path.read_text())
    assert roads == json.loads(json.dumps(argoverse_map(road_map(streets(), library()))))
    lanes = {lane.name: k for k, lane in enumerate(streets().lanes, 1)}
    segments = {row["id"]: row for row in roads["lane_segments"].values()}
    inner, outer = (segments[lanes[f"main/forward{k}"]] for k in (0, 1))
    assert (inner["left_lane_mark_type"], inner["right_lane_mark_type"]) == ("DASHED_WHITE",) * 2
    assert (outer["left_lane_mark_type"], outer["right_lane_mark_type"]) == ("DASHED_WHITE", "NONE")
    assert (inner["right_neighbor_id"], outer["left_neighbor_id"]) == (outer["id"], inner["id"])
    oncoming = segments[lanes["main/backward0"]]
    assert (
        oncoming["left_lane_mark_type"] == "DASHED_WHITE" and oncoming["left_neighbor_id"] is None
    )
    for name, number in lanes.items():
        lane = next(k for k in streets().lanes if k.name == name)
        if lane.kind == "driving":
            row = segments[number]
            assert row["is_intersection"] == lane.junction
            assert row["successors"] == [lanes[other] for other in lane.successors]
            assert all(number in segments[k]["predecessors"] for k in row["successors"])
    y = {point["y"] for point in inner["left_lane_boundary"]}
    assert y == {0.0} and {p["z"] for p in inner["left_lane_boundary"]} == {0.175}
    assert len(roads["pedestrian_crossings"]) == 3
    edges = [row[edge] for row in roads["pedestrian_crossings"].values()
             for edge in ("edge1", "edge2")]  # fmt: skip
    assert all(len(edge) == 2 for edge in edges)


def test_drivable_areas_with_holes_are_cut() -> None:
    """A square of 10 m with two holes of 1 m2: pieces without holes have its area."""
    square = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)])
    hole = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)])
    pieces = list(without_holes(Area(square, (hole + 2.0, hole + 6.0))))
    areas = [0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) for x, y in
             (piece.T for piece in pieces)]  # fmt: skip
    assert len(pieces) > 1 and sum(areas) == pytest.approx(98.0)


def test_marks_have_the_types_of_the_format() -> None:
    assert mark_type(Paint()) == "NONE"
    assert mark_type(Paint("solid", is_double=True, is_yellow=True)) == "DOUBLE_SOLID_YELLOW"
    assert mark_type(Paint("dashed", is_double=True)) == "DOUBLE_DASH_WHITE"
    assert mark_type(Paint("dashed", is_yellow=True)) == "DASHED_YELLOW"
