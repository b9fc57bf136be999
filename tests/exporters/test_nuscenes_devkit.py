"""nuScenes by its own devkit: a data set without faults, and damaged copies with them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
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
from tests.exporters import nuscenes_devkit as checks
from tests.exporters.nuscenes_devkit import find_faults, open_devkit

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
    rows = table_rows(
        Radar.columns,
        sample.index % 4 and 1,
        time_s=scene.time_s,
        range_m=np.hypot(x, y),
        azimuth_rad=np.arctan2(y, x),
        instance_id=1,
    )
    tables = {"front": Measurements("front", scene.device("front"), rows, scene.time_s)}
    capture = Capture(sample.capture.readings, sample.capture.clouds, tables)
    return replace(sample, scene=scene, capture=capture)


@pytest.fixture(scope="module")
def driven(samples: Any) -> Any:
    """The drive with a radar."""
    return [with_radar(sample) for sample in samples]


@pytest.fixture(scope="module")
def folder(world: Any, driven: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All steps as key frames."""
    info = world.info(8, ("left", "right"), ("top",), steps_per_scene=4, devices={"front": "radar"})
    exporter = NuScenes(key_frame_s=0.1)
    made: Path = world.export(exporter, info, driven, tmp_path_factory.mktemp("nuscenes"))
    return made


def test_the_devkit_finds_no_fault(folder: Path, driven: Any) -> None:
    """Points, velocities, projections, radars, maps, and the boxes as predictions."""
    assert find_faults(folder, driven) == []


def test_radar_detections_are_counted_and_read(folder: Path, driven: Any) -> None:
    """In the frame of the radar the car's detection is where the car is."""
    from nuscenes.utils.data_classes import RadarPointCloud

    devkit = open_devkit(folder)
    counts = [row["num_radar_pts"] for row in devkit.sample_annotation]
    assert sorted(counts)[-6:] == [1] * 6 and sum(counts) == 6
    for k, sample in enumerate(devkit.sample):
        token = sample["data"]["RADAR_FRONT"]
        path, boxes, _ = devkit.get_sample_data(token)
        points = RadarPointCloud.from_file(path).points
        assert points.shape == (18, min(k % 4, 1))
        (car,) = [box for box in boxes if box.name == "vehicle.car"]
        assert np.abs(points[:2].T - car.center[:2]).max(initial=0.0) < 1e-3


def test_the_tracking_evaluation_scores_the_boxes_as_perfect(folder: Path, tmp_path: Path) -> None:
    """AMOTA 1 for each class; AMOTA falls if a track changes its id at every key frame."""
    from nuscenes.eval.common.config import config_factory
    from nuscenes.eval.tracking.evaluate import TrackingEval

    devkit = open_devkit(folder)
    owner = {row["token"]: row["instance_token"] for row in devkit.sample_annotation}

    def amota(name_track: Callable[[str, str], str], name: str) -> dict[str, float]:
        results: dict[str, list[dict[str, Any]]] = {row["token"]: [] for row in devkit.sample}
        for token, boxes in checks.predictions(devkit).items():
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
        path.write_text(json.dumps({"meta": checks.META, "results": results}))
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
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """IoU 1 for each class that is there, and less where a third of the points has another one."""
    from nuscenes.eval.lidarseg import utils
    from nuscenes.eval.lidarseg.evaluate import LidarSegEval

    devkit = open_devkit(folder)
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


def edit(name: str, change: Callable[[list[dict[str, Any]]], object]) -> Callable[[Path], None]:
    """Damage that changes the rows of a table."""

    def damage(folder: Path) -> None:
        path = folder / V / f"{name}.json"
        rows = json.loads(path.read_text())
        change(rows)
        path.unlink()
        path.write_text(json.dumps(rows))

    return damage


def each(change: Callable[[dict[str, Any]], object]) -> Callable[[list[dict[str, Any]]], object]:
    """Change of every row."""
    return lambda rows: [change(row) for row in rows]


def rewrite(pattern: str, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    """Damage that changes the bytes of files; they are links, so that each is written anew."""

    def damage(folder: Path) -> None:
        for path in sorted(folder.glob(pattern)):
            data = change(path.read_bytes())
            path.unlink()
            path.write_bytes(data)

    return damage


def other_axes(data: bytes) -> bytes:
    """Points with x forward and y left."""
    points = np.frombuffer(data, "<f4").reshape(-1, 5).copy()
    points[:, 0], points[:, 1] = points[:, 1].copy(), -points[:, 0]
    return points.tobytes()


def roll(values: list[float]) -> list[float]:
    """The first value last: ``w x y z`` becomes ``x y z w``."""
    return [*values[1:], values[0]]


DAMAGES: dict[str, tuple[Callable[[Path], None], str]] = {
    "sizes as length, width, height": (
        edit("sample_annotation", each(lambda r: r.update(size=[r["size"][i] for i in (1, 0, 2)]))),
        "points",
    ),
    "quaternions with the scalar last": (
        edit("sample_annotation", each(lambda r: r.update(rotation=roll(r["rotation"])))),
        "points",
    ),
    "a point too many": (
        edit("sample_annotation", each(lambda r: r.update(num_lidar_pts=r["num_lidar_pts"] + 1))),
        "points",
    ),
    "boxes at their foot": (
        edit(
            "sample_annotation",
            each(lambda r: r["translation"].__setitem__(2, r["translation"][2] - r["size"][2] / 2)),
        ),
        "points",
    ),
    "scans with x forward": (rewrite("samples/LIDAR_TOP/*", other_axes), "points"),
    "scans of four columns": (
        rewrite(
            "samples/LIDAR_TOP/*",
            lambda data: np.frombuffer(data, "<f4").reshape(-1, 5)[:, :4].tobytes(),
        ),
        "not five numbers",
    ),
    "labels of the next point": (
        rewrite("lidarseg/v1.0-mini/*", lambda data: data[1:] + data[:1]),
        "panoptic labels|another class",
    ),
    "a label file is missing": (
        lambda folder: next((folder / f"lidarseg/{V}").iterdir()).unlink(),
        "refused",
    ),
    "times in milliseconds": (
        edit("sample", each(lambda r: r.update(timestamp=r["timestamp"] // 1000))),
        "moves at",
    ),
    "a track that ends early": (
        edit("instance", each(lambda r: r.update(nbr_annotations=r["nbr_annotations"] - 1))),
        "a track of",
    ),
    "no map": (lambda folder: shutil.rmtree(folder / "maps"), "refused"),
    "mounts with the scalar last": (
        edit("calibrated_sensor", each(lambda r: r.update(rotation=roll(r["rotation"])))),
        "points|no box around",
    ),
    "principal point in the corner": (
        edit(
            "calibrated_sensor",
            each(lambda r: r["camera_intrinsic"] and r["camera_intrinsic"][0].__setitem__(2, 0.0)),
        ),
        "no box around",
    ),
    "radar files without an end": (rewrite("samples/RADAR_FRONT/*", lambda d: d[:-1]), "refused"),
    "poses without the map's origin": (
        edit(
            "ego_pose", each(lambda r: r["translation"].__setitem__(0, r["translation"][0] - 200))
        ),
        "beside the map",
    ),
}


@pytest.mark.damage("nuscenes")
@pytest.mark.parametrize("name", sorted(DAMAGES))
def test_the_devkit_finds_damage(
    folder: Path, driven: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """The same checks find every damaged copy."""
    # The evaluator refuses broken data in its own ways; the checks before it must find them.
    monkeypatch.setattr(checks, "detection_faults", lambda *_: iter(()))
    damage, expected = DAMAGES[name]
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)

    damage(copy)

    faults = "\n".join(find_faults(copy, driven))
    assert any(part in faults for part in expected.split("|")), faults


def test_the_evaluator_finds_predictions_elsewhere(folder: Path, tmp_path: Path) -> None:
    """Predictions 0.3 m to the side have that error, and still an AP."""
    devkit = open_devkit(folder)
    truth = checks.predictions

    def moved(devkit: Any) -> Any:
        found = truth(devkit)
        for boxes in found.values():
            for box in boxes:
                box["translation"] = [box["translation"][0] + 0.3, *box["translation"][1:]]
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checks, "predictions", moved)
        faults = list(checks.detection_faults(devkit, folder))

    assert "car: trans_err 0.300" in faults
    assert not any("AP" in fault for fault in faults)
