"""OpenLane and CULane on a straight road, by rays of Embree and closed formulas."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.annotations.lanes import Lanes
from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, Sample
from gen_data.core.scene import Body, Camera, Rig, Scene
from gen_data.core.scene_time import RIG_AXES
from gen_data.core.se3 import SE3
from gen_data.exporters.culane import CULane
from gen_data.exporters.openlane import OpenLane
from tests.embree import RayCaster, placed
from tests.exporters.datasets import made_of
from tests.exporters.test_nuscenes_expansions import WIDTH_M, streets
from tests.libraries import library

SIZE_PX, EYE_M, AHEAD_M, LANE_Y_M = (480, 300), (0.5, 0.0, 1.5), 4.0, -1.5 * WIDTH_M
"""The camera on its rig, and the rig on the road, whose middle is the X axis: 60 m long, with two
lanes of 3.5 m each way, in the outer one. A car is 16 m before it, in the inner one."""
CROWN = 0.025
"""Fall of the road to its gutters, at height 0."""
NAME = "segment-000000_front/000000000"


@cache
def scene() -> Scene:
    town = streets()
    lens = Intrinsics.from_hfov(*SIZE_PX, hfov_rad=1.3)
    T_rig_camera = SE3(EYE_M) @ RIG_AXES.inverse()
    ego = SE3((AHEAD_M, LANE_Y_M, 0.0))
    camera = Camera("front", ego @ T_rig_camera, lens, rig="ego", T_rig_camera=T_rig_camera)
    car = library().bounds_m("car?seed=0")[0][2]
    bodies = (*town.bodies, Body("ego", "car?seed=0", ego), Body(
        "car", "car?seed=0", SE3((AHEAD_M + 16.0, -0.5 * WIDTH_M, -car)), instance_id=99
    ))  # fmt: skip
    return replace(town, bodies=bodies, cameras=(camera,), rigs=(Rig("ego", "ego"),))


@cache
def caster() -> RayCaster:
    return RayCaster(*(placed(b, library()) for b in scene().bodies if b.name != "ego"))


@cache
def sample() -> Sample:
    (camera,) = scene().cameras
    rays = camera.T_world_camera.rotate(camera.intrinsics.pixel_rays())
    range_m = caster().cast(camera.T_world_camera.translation_m, rays).distance
    red = np.minimum(range_m, 255.0).astype(np.uint8)
    rgb = np.stack([red, np.zeros_like(red), np.full_like(red, 9)], axis=-1)
    channels = {Channel.RANGE: range_m, Channel.RGB: rgb}
    reading = SensorReading("front", camera, channels)
    truth = Lanes().annotate_image(scene(), library(), reading, ImageTruth(camera, ()))
    return Sample(0, 0, 0, "train", scene(), Capture({"front": reading}), {"front": truth})


def height_m(y_m: float) -> float:
    """Height of the road at a distance from its middle."""
    return CROWN * (2.0 * WIDTH_M - abs(y_m))


def road(world: Any) -> tuple[Any, list[Sample]]:
    return world.info(1, ("front",), media={"front": (Channel.RGB,)}, devices={}), [sample()]


def write(world: Any, exporter: Any, folder: Path, *changes: Sample) -> Path:
    info, samples = road(world)
    made: Path = world.export(exporter, info, changes or samples, folder, assets=library())
    return made


@pytest.fixture(scope="module")
def openlane(world: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = write(world, OpenLane(), tmp_path_factory.mktemp("openlane"))
    check_edges(folder)
    listed = (folder / "lane3d_1000/training.txt").read_text()
    assert listed == f"training/{NAME}.json\n"
    row = row_of(folder)
    assert (folder / "images" / row["file_path"]).exists()
    return row


def row_of(folder: Path) -> dict[str, Any]:
    row: dict[str, Any] = json.loads((folder / f"lane3d_1000/training/{NAME}.json").read_text())
    return row


def on_ground(row: dict[str, Any], line: dict[str, Any]) -> Any:
    """Points of a line [n, 3] in the vehicle's frame, by the extrinsic of the file."""
    T_vehicle_camera = np.array(row["extrinsic"])
    points = np.vstack([line["xyz"], np.ones(len(line["xyz"][0]))])
    return (T_vehicle_camera @ points)[:3].T


def own_road(row: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Any]]:
    """Lines along the road before the junction, with their points on the ground."""
    for line in row["lane_lines"]:
        points = on_ground(row, line)
        if points[0, 0] < 30.0 and np.ptp(points[:, 1]) < 0.1:
            yield line, points


def check_edges(folder: Path) -> None:
    """The edges of the road are where they are, and project to their pixels."""
    row = row_of(folder)
    K, edges = np.array(row["intrinsic"]), []
    for line, points in own_road(row):
        if line["category"] >= 20:
            edges.append(round(float(points[:, 1].mean()) + LANE_Y_M, 2))
            ahead, left, up = np.array(line["xyz"])
            uv = K @ np.stack([-left / ahead, -up / ahead, np.ones_like(ahead)])
            np.testing.assert_allclose(uv[:2], line["uv"], atol=0.02)
    assert sorted(edges) == [-7.0, 7.0]


def check_photograph(folder: Path) -> None:
    image = cv2.imread(str(folder / f"train/{NAME}.png"))[..., ::-1]
    np.testing.assert_array_equal(image, sample().capture.readings["front"].channels[Channel.RGB])


def test_lines_are_on_the_borders_of_the_road_and_project_to_their_pixels(openlane: Any) -> None:
    """Five borders 3.5 m apart, from the gutters to the crown."""
    found = {}
    for line, points in own_road(openlane):
        y_m = points[:, 1] + LANE_Y_M
        found[round(float(y_m.mean()), 2)] = line
        np.testing.assert_allclose(y_m, y_m.mean(), atol=1e-3)
        np.testing.assert_allclose(points[:, 2], height_m(y_m.mean()), atol=2e-3)
        assert (np.diff(points[:, 0]) > 0.0).all(), "from near to far"
    assert sorted(found) == [-7.0, -3.5, 0.0, 3.5, 7.0]
    # White dashes between lanes and in the middle; edges without paint.
    assert [found[y]["category"] for y in sorted(found)] == [21, 1, 1, 1, 20]
    assert [found[y]["attribute"] for y in sorted(found)] == [3, 2, 1, 0, 0]
    assert len({line["track_id"] for line in found.values()}) == 5


def test_visibility_is_that_of_rays_to_the_points(openlane: Any) -> None:
    """Rays to points just above and 30 cm above the ground agree, and so does the label."""
    eye = np.array(scene().cameras[0].T_world_camera.translation_m)
    seen = hidden = 0
    for line in openlane["lane_lines"]:
        points = on_ground(openlane, line) + np.array((AHEAD_M, LANE_Y_M, 0.0))
        low, high = (
            caster().is_blocked(eye, points + np.array((0.0, 0.0, above_m)) - eye, 0.0, 1.0)
            for above_m in (0.02, 0.3)
        )
        visible = np.array(line["visibility"]) > 0.5
        # The label of a pixel is decided at its centre: silhouettes are a pixel wide.
        certain = (low == high) & ~on_silhouette(np.array(line["uv"]).T)
        assert (visible == ~low)[certain].all(), line["track_id"]
        seen += int((visible & certain).sum())
        hidden += int((~visible & certain).sum())
    assert seen > 50 and hidden > 10


def on_silhouette(uv: Any) -> Any:
    """Whether pixels around a point show surfaces that are 2 m apart or more in range."""
    range_m = np.minimum(sample().capture.readings["front"].channels[Channel.RANGE], 1e3)
    kernel = np.ones((3, 3), np.uint8)
    step = cv2.dilate(range_m, kernel) / cv2.erode(range_m, kernel)
    columns, rows = np.floor(uv + 0.5).astype(int).T
    return step[np.minimum(rows, SIZE_PX[1] - 1), np.minimum(columns, SIZE_PX[0] - 1)] > 1.5


def f_score(row: dict[str, Any], predicted: Sequence[Any]) -> tuple[float, float]:
    """F1 of predicted lines [n, 3] in the vehicle's frame, and their mean error aside [m].

    As OpenLane evaluates: lines are compared at every metre ahead in their common range; a match
    has three quarters of these points within 1.5 m, aside and up.
    """
    truth = [points for _, points in own_road(row)]
    matched, errors = 0, []
    for line in predicted:
        for other in truth:
            low, high = max(line[0, 0], other[0, 0], 3.0), min(line[-1, 0], other[-1, 0], 103.0)
            ahead = np.arange(np.ceil(low), high)
            gaps = [
                np.interp(ahead, line[:, 0], line[:, k])
                - np.interp(ahead, other[:, 0], other[:, k])
                for k in (1, 2)
            ]
            if (np.hypot(*gaps) < 1.5).mean() >= 0.75:
                matched += 1
                errors.append(float(np.abs(gaps[0]).mean()))
                break
    precision, recall = matched / len(predicted), matched / len(truth)
    score = 2.0 * precision * recall / (precision + recall) if matched else 0.0
    return score, float(np.mean(errors)) if errors else np.inf


def test_the_road_as_prediction_scores_perfectly_and_elsewhere_worse(openlane: Any) -> None:
    x = np.arange(0.0, 56.0)
    roads = [np.column_stack([x, np.full_like(x, y - LANE_Y_M), np.full_like(x, height_m(y))])
             for y in (-7.0, -3.5, 0.0, 3.5, 7.0)]  # fmt: skip
    score, error_m = f_score(openlane, roads)
    assert score == 1.0 and error_m < 1e-3
    score, error_m = f_score(openlane, [road + np.array((0.0, 0.5, 0.0)) for road in roads])
    assert score == 1.0 and error_m == pytest.approx(0.5, abs=1e-3)
    assert f_score(openlane, [road + np.array((0.0, 1.75, 0.0)) for road in roads])[0] == 0.0


def test_a_camera_on_no_rig_has_its_vehicle_on_the_ground_below_it(
    world: Any, tmp_path: Path
) -> None:
    one = sample()
    truth = one.truth["front"]
    camera = replace(truth.camera, rig="", T_rig_camera=SE3())
    loose = replace(one, truth={"front": replace(truth, camera=camera)},
                    scene=replace(one.scene, cameras=(camera,)))  # fmt: skip
    row = row_of(write(world, OpenLane(), tmp_path, loose))
    expected = np.eye(4)
    expected[2, 3] = EYE_M[2] - height_m(LANE_Y_M)
    np.testing.assert_allclose(row["extrinsic"], expected, atol=1e-3)


@pytest.mark.parametrize("yaw", [np.pi, 2.0])
def test_lines_of_a_camera_do_not_depend_on_the_front_of_its_vehicle(
    openlane: Any, world: Any, tmp_path: Path, yaw: float
) -> None:
    """A camera at the back or side of a turned vehicle, at the same place in the world."""
    one = sample()
    truth = one.truth["front"]
    T_rig_camera = SE3.about_z(yaw, (-0.8, 0.3, 0.0)) @ truth.camera.T_rig_camera
    camera = replace(truth.camera, T_rig_camera=T_rig_camera)
    turned = replace(one, truth={"front": replace(truth, camera=camera)})
    row = row_of(write(world, OpenLane(), tmp_path, turned))
    found, expected = leading_away(row), leading_away(openlane)
    assert {1, 2, 3} <= {line["attribute"] for line in found}
    for line, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(line["xyz"], other["xyz"], atol=2e-4)
        assert {**line, "xyz": 0} == {**other, "xyz": 0}
    np.testing.assert_allclose(row["extrinsic"], (T_rig_camera @ RIG_AXES).matrix(), atol=1e-8)


def leading_away(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Lines that have a nearest end: roads square to the view have none."""
    return [line for line in row["lane_lines"] if np.ptp(line["xyz"][0]) > 0.1]


culane = made_of(CULane(edges=True), road, library)


def text_lines(folder: Path) -> list[Any]:
    lines = (folder / f"train/{NAME}.lines.txt").read_text().splitlines()
    return [np.array(line.split(), float).reshape(-1, 2) for line in lines]


def drawn(line: Any) -> Any:
    """A line 30 px wide, as CULane's evaluation compares them."""
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    cv2.polylines(mask, [np.rint(line).astype(np.int32)], False, 1, 30)
    return mask > 0


def test_lists_name_images_and_masks_and_tell_which_lines_exist(culane: Path) -> None:
    """Two borders to the left, one to the right; the mask has their numbers along their points."""
    check_photograph(culane)
    assert (culane / "list/train.txt").read_text() == f"/train/{NAME}.png\n"
    gt = (culane / "list/train_gt.txt").read_text()
    assert gt == f"/train/{NAME}.png /laneseg_label_w16/train/{NAME}.png 1 1 1 0\n"
    mask = cv2.imread(str(culane / gt.split()[1][1:]), cv2.IMREAD_UNCHANGED)
    assert mask.shape == SIZE_PX[::-1] and set(np.unique(mask)) == {0, 1, 2, 3}
    lines = text_lines(culane)
    assert len(lines) == 3
    for number, line in enumerate(lines, 1):
        u, v = line.round().astype(int).T
        values = mask[v, np.clip(u, 0, SIZE_PX[0] - 1)]
        # Lines overlap near the vanishing point.
        assert (values == number).mean() > 0.5 and (values > 0).all()
        assert (np.diff(line[:, 1]) == -10).all() and (line[:, 1] % 10 == 0).all()


def test_projected_borders_score_perfectly_by_the_overlap_of_wide_lines(culane: Path) -> None:
    """An IoU of more than 0.95 with lines of the road projected by a pinhole."""
    lens = scene().cameras[0].intrinsics
    for line, y_m in zip(text_lines(culane), (0.0, -3.5, -7.0), strict=True):
        v = line[:, 1]
        # y = f X / Z + c at integer pixel centres; the border is below the eye.
        down_m = EYE_M[2] - height_m(y_m)
        depth = lens.fy_px * down_m / (v + 0.5 - lens.cy_px)
        u = lens.cx_px - 0.5 - lens.fx_px * (y_m - LANE_Y_M) / depth
        np.testing.assert_allclose(line[:, 0], u, atol=0.5)
        one, other = drawn(line), drawn(np.column_stack([u, v]))
        assert (one & other).sum() / (one | other).sum() > 0.95
        shifted = drawn(np.column_stack([u + 45.0, v]))
        assert (one & shifted).sum() / (one | shifted).sum() < 0.5


def test_edges_without_paint_are_lines_only_if_asked_for(world: Any, tmp_path: Path) -> None:
    folder = write(world, CULane(), tmp_path)
    assert (folder / "list/train_gt.txt").read_text().split()[2:] == ["1", "1", "0", "0"]
