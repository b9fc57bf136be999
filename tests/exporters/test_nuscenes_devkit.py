"""nuScenes by its own devkit: velocities, points, maps, radars and its evaluations."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.capture import Capture, Measurements
from gen_data.core.measurement_dtypes import table_rows
from gen_data.core.scene import Device
from gen_data.core.scene_time import place_sensors
from gen_data.core.se3 import SE3
from gen_data.exporters.nuscenes import NuScenes
from gen_data.sensors.radar.radar_sensor import Radar
from tests.exporters.datasets import made_of
from tests.exporters.test_nuscenes_expansions import EXPANDED, streets, town
from tests.libraries import library

# The devkit and its dependencies are older than the NumPy and Matplotlib that they run with.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
V = "v1.0-mini"


def with_radar(sample: Any) -> Any:
    """The sample with a radar on the bumper that detects the car, and nothing in every fourth."""
    radar = Device("front", "radar", "ego", SE3((3.0, 0.0, 0.5)), model="ARS408-21")
    scene = place_sensors(replace(sample.scene, devices=(radar,)))
    T_radar_world = scene.device("front").T_world_device.inverse()
    car = scene.instance(1)
    x, y, _ = T_radar_world.apply(np.array(car.T_world_instance.translation_m))
    values = {"range_m": np.hypot(x, y), "azimuth_rad": np.arctan2(y, x), "instance_id": 1}
    rows = table_rows(Radar.columns, sample.index % 4 and 1, time_s=scene.time_s, **values)
    tables = {"front": Measurements("front", scene.device("front"), rows, scene.time_s)}
    capture = Capture(sample.capture.readings, sample.capture.clouds, tables)
    return replace(sample, scene=scene, capture=capture)


@pytest.fixture(scope="module")
def driven(world: Any) -> Any:
    return radar_drive(world)[1]


def radar_drive(world: Any) -> tuple[Any, Any]:
    info = world.info(8, ("left", "right"), ("top",), steps_per_scene=4, devices={"front": "radar"})
    return info, list(map(with_radar, world.drive()))


folder = made_of(NuScenes(key_frame_s=0.1), radar_drive)
expanded = made_of(EXPANDED, town, library)


@pytest.fixture(scope="module")
def devkit(folder: Path) -> Any:
    from nuscenes.nuscenes import NuScenes

    return NuScenes(V, str(folder), verbose=False)


def detection_faults(devkit: Any, predicted: Callable[[Any], Any], folder: Path) -> Iterator[str]:
    """Faults that the evaluation of predictions finds: less than AP 1, and errors of classes."""
    from nuscenes.eval.common.config import config_factory
    from nuscenes.eval.detection.evaluate import DetectionEval

    result = folder.parent / "predictions.json"
    result.write_text(json.dumps({"meta": META, "results": predicted(devkit)}))
    config, target = config_factory("detection_cvpr_2019"), str(folder.parent / "evaluation")
    evaluation = DetectionEval(devkit, config, str(result), "all", target, verbose=False)
    metrics, _ = evaluation.evaluate()
    boxes = [b for k in evaluation.gt_boxes.sample_tokens for b in evaluation.gt_boxes[k]]
    present = {box.detection_name for box in boxes}
    if present != {"car", "pedestrian"}:
        yield f"evaluated classes: {sorted(present)}"
    for name in sorted(present):
        if abs(metrics.mean_dist_aps[name] - 1.0) > 1e-6:
            yield f"{name}: AP {metrics.mean_dist_aps[name]:.3f}"
        for error in ("trans_err", "scale_err", "orient_err", "vel_err", "attr_err"):
            if not metrics.get_label_tp(name, error) < 1e-6:
                yield f"{name}: {error} {metrics.get_label_tp(name, error):.3f}"


META = {
    f"use_{name}": name in ("camera", "lidar", "radar")
    for name in ("camera", "lidar", "radar", "map", "external")
}


def predictions(devkit: Any) -> dict[str, list[dict[str, Any]]]:
    """All boxes with points as predictions of a detector, by sample."""
    from nuscenes.eval.detection.utils import category_to_detection_name

    results: dict[str, list[dict[str, Any]]] = {row["token"]: [] for row in devkit.sample}
    for row in devkit.sample_annotation:
        name = category_to_detection_name(row["category_name"])
        if name is not None and row["num_lidar_pts"] + row["num_radar_pts"] > 0:
            attribute = devkit.get("attribute", row["attribute_tokens"][0])["name"]
            results[row["sample_token"]].append(
                {key: row[key] for key in ("sample_token", "translation", "size", "rotation")}
                | {"velocity": devkit.box_velocity(row["token"])[:2].tolist()}
                | {"detection_name": name, "detection_score": 0.9, "attribute_name": attribute}
            )
    return results


def test_boxes_contain_the_points_that_they_count_and_move_as_the_objects_on_maps(
    folder: Path, devkit: Any, driven: Any
) -> None:
    """Away from the ends of tracks."""
    steps = {int(row["timestamp"]): k for k, row in enumerate(devkit.sample)}
    for row in devkit.sample_annotation:
        if row["prev"] and row["next"]:
            sample = driven[steps[devkit.get("sample", row["sample_token"])["timestamp"]]]
            velocity = devkit.box_velocity(row["token"])
            speeds = [
                np.linalg.norm(t.twist.velocity_m_s - velocity) for t in sample.scene.instances
            ]
            assert min(speeds) < 0.05, row["category_name"]
    # Their margin contains the points on the faces, by the devkit's geometry.
    from nuscenes.utils.data_classes import LidarPointCloud
    from nuscenes.utils.geometry_utils import points_in_box

    counted = 0
    for sample in devkit.sample:
        path, boxes, _ = devkit.get_sample_data(sample["data"]["LIDAR_TOP"])
        xyz = LidarPointCloud.from_file(path).points[:3].astype(float)
        for box in boxes:
            count = devkit.get("sample_annotation", box.token)["num_lidar_pts"]
            assert points_in_box(box, xyz).sum() == count, box.name
            counted += count
    assert counted > 100
    for scene in devkit.scene:
        log = devkit.get("log", scene["log_token"])
        mask = devkit.get("map", log["map_token"])["mask"].mask()
        for row in (s for s in devkit.sample if s["scene_token"] == scene["token"]):
            data = devkit.get("sample_data", row["data"]["LIDAR_TOP"])
            x, y, _ = devkit.get("ego_pose", data["ego_pose_token"])["translation"]
            assert 0 <= 10 * x < mask.shape[1] and 0 <= 10 * y < mask.shape[0]


def test_the_evaluation_scores_the_boxes_as_perfect_and_predictions_elsewhere_worse(
    folder: Path, devkit: Any
) -> None:
    """AP 1 and no error of every class that is there."""
    assert list(detection_faults(devkit, predictions, folder)) == []

    # Predictions 0.3 m to the side have that error, and still an AP.
    def moved(devkit: Any) -> Any:
        found = predictions(devkit)
        for boxes in found.values():
            for box in boxes:
                box["translation"] = [box["translation"][0] + 0.3, *box["translation"][1:]]
        return found

    faults = list(detection_faults(devkit, moved, folder))
    assert "car: trans_err 0.300" in faults
    assert not any("AP" in fault for fault in faults)


def test_radar_detections_are_counted_and_read(folder: Path, devkit: Any, driven: Any) -> None:
    """In the frame of the radar the car's detection is where the car is."""
    from nuscenes.utils.data_classes import RadarPointCloud

    counts = [row["num_radar_pts"] for row in devkit.sample_annotation]
    assert sorted(counts)[-6:] == [1] * 6 and sum(counts) == 6
    for k, sample in enumerate(devkit.sample):
        token = sample["data"]["RADAR_FRONT"]
        path, boxes, _ = devkit.get_sample_data(token)
        points = RadarPointCloud.from_file(path).points
        assert points.shape == (18, min(k % 4, 1))
        (car,) = [box for box in boxes if box.name == "vehicle.car"]
        assert np.abs(points[:2].T - car.center[:2]).max(initial=0.0) < 1e-3


def test_the_tracking_evaluation_is_perfect(folder: Path, devkit: Any, tmp_path: Path) -> None:
    """AMOTA 1 for each class; AMOTA falls if a track changes its id at every key frame."""
    from nuscenes.eval.common.config import config_factory
    from nuscenes.eval.tracking.evaluate import TrackingEval

    owner = {row["token"]: row["instance_token"] for row in devkit.sample_annotation}

    def amota(name_track: Callable[[str, str], str], name: str) -> dict[str, float]:
        results: dict[str, list[dict[str, Any]]] = {row["token"]: [] for row in devkit.sample}
        for token, boxes in predictions(devkit).items():
            annotated = devkit.get("sample", token)["anns"]
            at = {tuple(devkit.get("sample_annotation", k)["translation"]): k for k in annotated}
            for box in boxes:
                track = name_track(token, owner[at[tuple(box["translation"])]])
                kept = ("sample_token", "translation", "size", "rotation", "velocity")
                results[token].append(
                    {key: box[key] for key in kept}
                    | {"tracking_id": track, "tracking_name": box["detection_name"]}
                    | {"tracking_score": 0.9}
                )
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps({"meta": META, "results": results}))
        evaluation = TrackingEval(
            config_factory("tracking_nips_2019"),
            str(path), "all", str(tmp_path / name), V, str(folder), verbose=False,
        )  # fmt: skip
        metrics, _ = evaluation.evaluate()
        return {k: v for k, v in metrics.label_metrics["amota"].items() if not np.isnan(v)}

    perfect = amota(lambda _, instance: instance, "perfect")
    assert perfect["car"] == perfect["pedestrian"] == pytest.approx(1.0, abs=1e-6)
    # The devkit's recall levels pass over tracks without a match to their own id.
    broken = amota(lambda token, instance: f"{token[:8]}{instance}", "broken")
    assert broken["car"] < 0.9


def test_the_lidarseg_evaluation_scores_the_labels_as_perfect(
    folder: Path, devkit: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """IoU 1 for each class that is there, and less where a third of the points has another one."""
    from nuscenes.eval.lidarseg import utils
    from nuscenes.eval.lidarseg.evaluate import LidarSegEval

    names = [row["name"] for row in devkit.scene]
    monkeypatch.setattr(utils, "create_splits_scenes", lambda verbose: {"val": names})

    def score(change: Callable[[Any], Any], name: str) -> list[float]:
        target = tmp_path / name / "lidarseg/val"
        target.mkdir(parents=True)
        mapper = utils.LidarsegClassMapper(devkit)
        for row in devkit.lidarseg:
            labels = np.fromfile(folder / row["filename"], np.uint8)
            # 0 is ignored as truth and forbidden in predictions.
            guess = np.maximum(change(mapper.convert_label(labels)), 1).astype(np.uint8)
            guess.tofile(target / f"{row['sample_data_token']}_lidarseg.bin")
        ious = LidarSegEval(devkit, str(tmp_path / name), "val").evaluate()["iou_per_class"]
        return [float(iou) for iou in ious.values() if not np.isnan(iou)]

    perfect = score(lambda labels: labels, "perfect")
    assert perfect == [1.0] * len(perfect) and len(perfect) > 1
    other = score(lambda labels: np.where(np.arange(len(labels)) % 3, labels, 1), "other")
    assert min(other) < 0.7


def test_the_map_api_renders_every_layer_and_finds_the_closest_lane(
    expanded: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also the lanes that come next; the centre lines agree with the scene within 2 cm."""
    import matplotlib as mpl
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    mpl.use("Agg")
    from nuscenes.map_expansion import map_api

    def patch(polygon: Any, **style: Any) -> PathPatch:
        """A polygon; descartes 1.1 fails with Shapely 2."""
        return PathPatch(Outline(np.asarray(polygon.exterior.coords)), **style)

    monkeypatch.setattr(map_api.descartes, "PolygonPatch", patch)
    (log, _) = json.loads((expanded / V / "log.json").read_text())
    monkeypatch.setattr(map_api, "locations", [log["location"]])
    roads = map_api.NuScenesMap(str(expanded), log["location"])

    figure, axes = roads.render_layers(roads.non_geometric_layers, figsize=(4, 4))
    drawn = len(axes.patches) + len(axes.lines)
    assert drawn == sum(len(getattr(roads, name)) for name in roads.non_geometric_layers)
    mpl.pyplot.close(figure)
    lanes = {lane.name: lane for lane in streets().lanes}
    low = np.array(log["world_origin"][:2])
    for name in ("main/forward0", "main/forward1", "main/backward0", "arm1/backward1"):
        line = np.array(lanes[name].center_m)[:, :2] + low
        x, y = line[len(line) // 3]
        found = roads.get_closest_lane(x + 0.4, y - 0.3, radius=3.0)
        path = np.array(roads.discretize_lanes([found], 0.5)[found])
        gaps = np.linalg.norm(path[:, None, :2] - line[None], axis=2)
        assert gaps.min(axis=0).max() < 0.26, "every point of the lane is on the path"
        ahead, left = (
            line[-1] - line[0],
            np.array([line[0, 1] - line[-1, 1], line[-1, 0] - line[0, 0]]),
        )
        aside = (path[:, :2] - line[0]) @ left / np.linalg.norm(ahead)
        assert np.abs(aside).max() < 0.02
        assert roads.record_on_point(x, y, "road_block")
        following = roads.get_outgoing_lane_ids(found)
        assert len(following) == len(lanes[name].successors)


def test_the_can_bus_api_reads_poses_that_agree_with_the_tables(expanded: Path) -> None:
    from nuscenes.can_bus.can_bus_api import NuScenesCanBus
    from nuscenes.nuscenes import NuScenes

    devkit, bus = NuScenes(V, str(expanded), verbose=False), NuScenesCanBus(str(expanded))
    for scene in devkit.scene:
        poses = {row["utime"]: row for row in bus.get_messages(scene["name"], "pose")}
        for kind in ("ms_imu", "steeranglefeedback", "vehicle_monitor"):
            assert len(bus.get_messages(scene["name"], kind)) > 0
        sample = devkit.get("sample", scene["first_sample_token"])
        for _ in range(scene["nbr_samples"]):
            data = devkit.get("sample_data", sample["data"]["LIDAR_TOP"])
            ego = devkit.get("ego_pose", data["ego_pose_token"])
            pose = poses[ego["timestamp"]]
            np.testing.assert_allclose(pose["pos"], ego["translation"], atol=1e-6)
            np.testing.assert_allclose(pose["orientation"], ego["rotation"], atol=1e-6)
            sample = devkit.get("sample", sample["next"]) if sample["next"] else sample
