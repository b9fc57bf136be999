"""Map and CAN bus expansions of nuScenes, read without the devkit."""

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.exporters.arc_paths import arc_paths
from gen_data.exporters.nuscenes import NuScenes
from gen_data.exporters.nuscenes_map import LISTS, segment_type
from gen_data.exporters.road_map import Paint, road_map
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.junction import Junction
from gen_data.scene_templates.road import Road
from gen_data.scene_templates.signals import Signals
from tests.exporters.conftest import SPEED_M_S, TURN_RAD_S, ego_pose
from tests.exporters.datasets import in_scene, made_of
from tests.exporters.drives import drive_info
from tests.libraries import library

LENGTH_M, WIDTH_M = 60.0, 3.5


@cache
def streets() -> Scene:
    """A road with two lanes each way that meets another one, with lights; the last arm has none."""
    shape: dict[str, Any] = {"length_m": LENGTH_M, "lanes": (2, 2)}
    main = Road(name="main", **shape)
    cross = Junction(name="cross", after="main", lanes=2, arms_deg=(0.0, 90.0, 180.0))
    ahead, aside = (Road(name=f"arm{k}", after=f"cross/{k}", **shape) for k in (0, 1))
    signals = Signals(name="signals", junction="cross")
    return build_scene("street", (main, cross, ahead, aside, signals), library())


def on_streets(samples: Sequence[Any]) -> list[Any]:
    """The samples of a drive on these streets; each sequence is in a world of its number."""
    ground = tuple(b for b in streets().bodies if not b.instance_id)
    return [in_scene(s, lanes=streets().lanes, bodies=(*s.scene.bodies, *ground)) for s in samples]


def town(world: Any) -> tuple[Any, Any]:
    """A drive on the streets; the ego of each sequence begins at their start, in the middle."""
    return drive_info(world), on_streets(world.drive())


EXPANDED = NuScenes(key_frame_s=0.1, map_expansion=True, can_bus=True)
every = made_of(EXPANDED, town, library)


@pytest.fixture(scope="module")
def layers(every: Path) -> dict[str, Any]:
    logs = json.loads((every / "v1.0-mini/log.json").read_text())
    paths = [every / f"maps/expansion/{log['location']}.json" for log in logs]
    assert sorted((every / "maps/expansion").iterdir()) == sorted(paths) and len(paths) == 2
    found: dict[str, Any] = json.loads(paths[0].read_text())
    return found


def rings(layers: dict[str, Any], name: str) -> list[Any]:
    """Exteriors [n, 2] of the polygons of a layer."""
    nodes = {row["token"]: (row["x"], row["y"]) for row in layers["node"]}
    polygons = {row["token"]: row["exterior_node_tokens"] for row in layers["polygon"]}
    tokens = [t for row in layers[name]
              for t in row.get("polygon_tokens", [row.get("polygon_token")])]  # fmt: skip
    return [np.array([nodes[node] for node in polygons[token]]) for token in tokens]


def area_m2(ring: Any) -> float:
    """Area of a polygon by the shoelace formula."""
    x, y = ring.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_every_layer_is_there_and_every_token_is_of_a_row(layers: dict[str, Any]) -> None:
    assert set(layers) == {*LISTS, "version", "canvas_edge", "connectivity", "arcline_path_3"}
    assert layers["version"] == "1.3"
    known = {row["token"] for name in LISTS for row in layers[name]}
    assert len(known) == sum(len(layers[name]) for name in LISTS)

    def tokens(value: Any, key: str = "") -> set[str]:
        if isinstance(value, dict):
            return {t for k, v in value.items() for t in tokens(v, k)}
        if isinstance(value, list):
            return {t for v in value for t in tokens(v, key)}
        named = "token" in key or key in ("incoming", "outgoing")
        return {value} if named and value else set()

    assert tokens({k: v for k, v in layers.items() if k != "version"}) <= known
    ways = {row["token"] for name in ("lane", "lane_connector") for row in layers[name]}
    assert set(layers["connectivity"]) == set(layers["arcline_path_3"]) == ways


def test_areas_have_the_sizes_of_the_streets(layers: dict[str, Any]) -> None:
    """Roads of four lanes from kerb to kerb, and lanes and blocks of one and two lanes."""
    road_m2 = LENGTH_M * 4 * WIDTH_M
    sizes = sorted(area_m2(ring) for ring in rings(layers, "road_segment"))
    crossing = [row["is_intersection"] for row in layers["road_segment"]]
    assert Counter(crossing) == {False: 3, True: 1}
    assert sorted(sizes)[:1] != [road_m2] and sum(abs(m2 - road_m2) < 0.01 for m2 in sizes) == 3
    (drivable,) = rings(layers, "drivable_area")
    assert area_m2(drivable) == pytest.approx(sum(sizes), abs=0.05)
    lanes, blocks = rings(layers, "lane"), rings(layers, "road_block")
    assert {round(area_m2(ring), 3) for ring in lanes} == {LENGTH_M * WIDTH_M}
    assert {round(area_m2(ring), 3) for ring in blocks} == {2 * LENGTH_M * WIDTH_M}
    assert (len(lanes), len(blocks), len(layers["ped_crossing"])) == (12, 6, 3)
    width, height = layers["canvas_edge"]
    x, y = np.array([(node["x"], node["y"]) for node in layers["node"]]).T
    assert x.min() > 0.0 and y.min() > 0.0 and x.max() < width and y.max() < height


def test_stop_lines_are_where_they_are_painted_and_name_crosswalks_or_lights(
    layers: dict[str, Any], every: Path
) -> None:
    """Half a metre wide, across both lanes, 1.5 m behind their ends; no light is in the drive."""
    assert Counter(row["stop_line_type"] for row in layers["stop_line"]) == {"PED_CROSSING": 3}
    assert all(len(row["ped_crossing_tokens"]) == 1 for row in layers["stop_line"])
    for ring in rings(layers, "stop_line"):
        assert sorted(np.ptp(ring, axis=0).round(2)) == pytest.approx([0.5, 7.0], abs=0.16)
    roads = road_map(streets(), library())
    for line in roads.stop_lines:
        (x0, y0, _), (x1, y1, _) = line.block.lanes[0].center_m[-2:]
        ahead = np.array([x1 - x0, y1 - y0]) / math.hypot(x1 - x0, y1 - y0)
        along = (line.area.exterior - line.block.end_m) @ ahead
        assert (along.min(), along.max()) == pytest.approx((1.5, 2.0), abs=0.01)
    assert [s.block.name.partition("/")[0] for s in roads.signals if s.block] == [
        "main", "arm0", "arm1",
    ]  # fmt: skip
    for signal in roads.signals:
        colors = [color for color, _ in signal.lamps]
        heights = [place[2] for _, place in signal.lamps]
        assert colors == ["RED", "YELLOW", "GREEN"] and sorted(heights, reverse=True) == heights


def test_dividers_have_the_paint_of_the_road(layers: dict[str, Any]) -> None:
    """Dashes between lanes of one direction, of which the format has one type."""
    types = {s["segment_type"] for row in layers["lane_divider"]
             for s in row["lane_divider_segments"]}  # fmt: skip
    assert types == {"DOUBLE_DASHED_WHITE"} and len(layers["lane_divider"]) == 6
    assert len(layers["road_divider"]) == 3
    inner = [row for row in layers["lane"] if len(row["left_lane_divider_segments"])]
    assert len(inner) == 12


@pytest.mark.parametrize(
    ("markings", "color", "paint", "word"),
    [
        ("double", "white", Paint("solid", is_double=True), "DOUBLE_SOLID_WHITE"),
        ("solid", "white", Paint("solid"), "SINGLE_SOLID_WHITE"),
        ("solid", "yellow", Paint("solid", is_yellow=True), "SINGLE_SOLID_YELLOW"),
        ("dashed", "white", Paint("dashed"), "DOUBLE_DASHED_WHITE"),
        ("none", "white", Paint(), "NIL"),
    ],
)
def test_paint_is_read_from_the_mesh(markings: Any, color: Any, paint: Paint, word: str) -> None:
    road = Road(name="main", length_m=40.0, markings=markings, center_color=color)
    roads = road_map(build_scene("street", (road,), library()), library())
    (divider,) = (d for d in roads.dividers if d.border.kind == "road")
    assert set(divider.paint) == {paint} and segment_type(paint) == word


def test_paths_follow_centre_lines(layers: dict[str, Any]) -> None:
    """Arcs, integrated from their start, end where the next one starts and stay on the line."""
    for paths in layers["arcline_path_3"].values():
        for path, after in pairwise(paths):
            assert path["end_pose"][:2] == after["start_pose"][:2]
        for path in paths:
            x, y, yaw = path["start_pose"]
            sides = {"L": 1.0, "S": 0.0, "R": -1.0}
            for word, length in zip(path["shape"], path["segment_length"], strict=True):
                bend = sides[word] / path["radius"]
                steps = np.linspace(0.0, length, 201)
                middle = yaw + bend * 0.5 * (steps[1:] + steps[:-1])
                x += float((np.cos(middle) * np.diff(steps)).sum())
                y += float((np.sin(middle) * np.diff(steps)).sum())
                yaw += bend * length
            assert math.dist((x, y), path["end_pose"][:2]) < 1e-4
            assert abs(math.remainder(yaw - path["end_pose"][2], math.tau)) < 1e-5


def test_an_arc_has_the_radius_of_a_circle_and_straights_are_joined() -> None:
    angles = np.linspace(0.0, 1.5, 13)
    circle = 20.0 * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1)
    paths = arc_paths(circle)
    assert {path["radius"] for path in paths} == {20.0} and {p["shape"] for p in paths} == {"LSL"}
    assert sum(sum(path["segment_length"]) for path in paths) == pytest.approx(30.0, abs=1e-4)
    (path,) = arc_paths(np.array([[k * 2.0, k * 1.0] for k in range(9)]))
    assert path["segment_length"] == [0.0, pytest.approx(16.0 * math.sqrt(1.25)), 0.0]


def messages(folder: Path, kind: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(
        (folder / f"can_bus/scene-2000_{kind}.json").read_text()
    )
    return found


def test_messages_have_the_motion_of_a_circle(every: Path) -> None:
    """10 m/s at 0.2 rad/s to the left: 2 m/s^2 to its centre, gravity upwards."""
    names = [row["name"] for row in json.loads((every / "v1.0-mini/scene.json").read_text())]
    assert names == ["scene-2000", "scene-2001"]
    (low,) = {
        tuple(r["world_origin"]) for r in json.loads((every / "v1.0-mini/log.json").read_text())
    }
    poses, imu = messages(every, "pose"), messages(every, "ms_imu")
    start_us = min(row["utime"] for row in poses)
    scans = json.loads((every / "v1.0-mini/sample.json").read_text())
    assert min(row["timestamp"] for row in scans) == start_us
    # Four steps of 0.1 s.
    assert (len(poses), len(imu)) == (20, 40)
    for row in poses:
        time_s = (row["utime"] - start_us) * 1e-6
        place = np.array(ego_pose(time_s).translation_m) + low
        # Poses between knots 0.1 s apart are interpolated.
        np.testing.assert_allclose(row["pos"], place, atol=1e-4)
        np.testing.assert_allclose(row["vel"], (SPEED_M_S, 0, 0), atol=5e-3)
        np.testing.assert_allclose(row["accel"], (0, SPEED_M_S * TURN_RAD_S, 9.80665), atol=5e-2)
        np.testing.assert_allclose(row["rotation_rate"], (0, 0, TURN_RAD_S), atol=1e-6)
    assert [row["utime"] for row in imu[::2]] == [row["utime"] for row in poses]
    assert [row["linear_accel"] for row in imu[::2]] == [row["accel"] for row in poses]


def test_steering_and_speed_are_those_of_the_circle(every: Path) -> None:
    """A left turn has a negative angle, of a car's wheelbase on a circle of 50 m."""
    values = [row["value"] for row in messages(every, "steeranglefeedback")]
    wheels = {p.name: p.position_m[0] for p in library().keypoints("car?seed=0")}
    wheelbase_m = wheels["wheel_front_left"] - wheels["wheel_rear_left"]
    expected = -15.0 * math.atan(wheelbase_m * TURN_RAD_S / SPEED_M_S)
    np.testing.assert_allclose(values, expected, rtol=1e-3)
    (row,) = messages(every, "vehicle_monitor")
    assert row["vehicle_speed"] == pytest.approx(36.0, abs=0.02) and row["yaw_rate"] == 11.5


def test_nothing_is_written_unless_asked_for(exported: Any) -> None:
    folder = exported(NuScenes(key_frame_s=0.1))
    assert not (folder / "maps/expansion").exists() and not (folder / "can_bus").exists()
    names = [row["name"] for row in json.loads((folder / "v1.0-mini/scene.json").read_text())]
    assert names == ["gen-scene-000000", "gen-scene-000001"]


def test_messages_without_a_vehicle_are_refused(world: Any, samples: Any, tmp_path: Path) -> None:
    still = [in_scene(s, rigs=(replace(s.scene.rigs[0], body=""),)) for s in samples[:1]]
    with pytest.raises(ConfigError, match="can_bus needs a vehicle that carries 'top'"):
        world.export(NuScenes(can_bus=True), drive_info(world), still, tmp_path)
