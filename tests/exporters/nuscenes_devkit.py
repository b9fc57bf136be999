"""Checks of a nuScenes data set by the official devkit; each returns the lines it finds broken."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

SWAY_M = 0.02
"""Tolerance of counts of points: noise-free points lie on the faces of boxes."""


def open_devkit(folder: Path) -> Any:
    """Load all tables."""
    from nuscenes.nuscenes import NuScenes

    return NuScenes("v1.0-mini", str(folder), verbose=False)


def find_faults(folder: Path, samples: Sequence[Any]) -> list[str]:
    """Everything that the devkit finds broken; a data set that it refuses has one fault.

    Args:
        folder: The data set; every step is a key frame.
        samples: What it was made of.
    """
    try:
        devkit = open_devkit(folder)
    except (AssertionError, KeyError, IndexError, OSError) as error:
        return [f"refused: {type(error).__name__} {error}"]
    checks: list[Callable[[], Iterator[str]]] = [
        lambda: chain_faults(devkit),
        lambda: point_faults(devkit, folder),
        lambda: velocity_faults(devkit, samples),
        lambda: projection_faults(devkit, samples),
        lambda: radar_faults(devkit),
        lambda: map_faults(devkit),
        lambda: detection_faults(devkit, folder),
    ]
    return [fault for check in checks for fault in check()]


def chain_faults(devkit: Any) -> Iterator[str]:
    """Chains from the first to the last row have all rows, forward in time."""
    for scene in devkit.scene:
        count, times, token = 0, [], scene["first_sample_token"]
        while token:
            row = devkit.get("sample", token)
            count, token = count + 1, row["next"]
            times.append(row["timestamp"])
        if count != scene["nbr_samples"] or (np.diff(times) <= 0).any():
            yield f"samples of {scene['name']}: {count}"
    for instance in devkit.instance:
        count, token = 0, instance["first_annotation_token"]
        while token:
            row = devkit.get("sample_annotation", token)
            if row["instance_token"] != instance["token"]:
                yield "a track changes its object"
            count, token = count + 1, row["next"]
        if count != instance["nbr_annotations"]:
            yield f"a track of {instance['nbr_annotations']} boxes has {count}"


def point_faults(devkit: Any, folder: Path) -> Iterator[str]:
    """Boxes contain the points that they count, and points have their class and instance."""
    from nuscenes.utils.data_classes import LidarPointCloud
    from nuscenes.utils.geometry_utils import points_in_box

    counted = 0
    for sample in devkit.sample:
        path, boxes, _ = devkit.get_sample_data(sample["data"]["LIDAR_TOP"])
        if Path(path).stat().st_size % 20:
            yield f"{path}: not five numbers per point"
            continue
        xyz = LidarPointCloud.from_file(path).points[:3].astype(float)
        labels, whole = point_labels(devkit, folder, sample["data"]["LIDAR_TOP"])
        if len(labels) != xyz.shape[1] or len(whole) != xyz.shape[1]:
            yield f"{path}: {len(labels)} labels of {xyz.shape[1]} points"
            continue
        if (whole // 1000 != labels).any():
            yield f"{path}: panoptic labels of other classes"
        for box in boxes:
            row = devkit.get("sample_annotation", box.token)
            inner, outer = box.copy(), box.copy()
            inner.wlh, outer.wlh = box.wlh - 2 * SWAY_M, box.wlh + 2 * SWAY_M
            deep, near = points_in_box(inner, xyz), points_in_box(outer, xyz)
            counted += row["num_lidar_pts"]
            if not deep.sum() <= row["num_lidar_pts"] <= near.sum():
                yield f"{box.name}: {row['num_lidar_pts']} points, {deep.sum()} to {near.sum()}"
            if points_in_box(box, xyz).sum() != row["num_lidar_pts"]:
                yield f"{box.name}: the margin does not contain the points on the faces"
            index = devkit.lidarseg_name2idx_mapping[box.name]
            if (labels[deep] != index).any() or len(set(whole[deep].tolist())) > 1:
                yield f"{box.name}: points of another class or instance"
    if counted < 100:
        yield "hardly a box has points"


def point_labels(devkit: Any, folder: Path, token: str) -> tuple[Any, Any]:
    """Lidarseg and panoptic labels of a scan."""
    (semantic,) = [row for row in devkit.lidarseg if row["sample_data_token"] == token]
    (panoptic,) = [row for row in devkit.panoptic if row["sample_data_token"] == token]
    return (
        np.fromfile(folder / semantic["filename"], np.uint8),
        np.load(folder / panoptic["filename"])["data"],
    )


def velocity_faults(devkit: Any, samples: Sequence[Any]) -> Iterator[str]:
    """Velocities from neighbouring boxes are those of the objects, away from the ends."""
    steps = {int(row["timestamp"]): k for k, row in enumerate(devkit.sample)}
    for row in devkit.sample_annotation:
        if row["prev"] and row["next"]:
            sample = samples[steps[devkit.get("sample", row["sample_token"])["timestamp"]]]
            velocity = devkit.box_velocity(row["token"])
            speeds = [
                np.linalg.norm(t.twist.velocity_m_s - velocity) for t in sample.scene.instances
            ]
            if not min(speeds) < 0.05:
                yield f"{row['category_name']}: moves at {velocity}"


def projection_faults(devkit: Any, samples: Sequence[Any]) -> Iterator[str]:
    """The projection of an object's box contains its mask, and little else."""
    from nuscenes.utils.geometry_utils import view_points

    names = {"CAM_LEFT": "left", "CAM_RIGHT": "right"}
    compared = 0
    for sample, row in zip(samples, devkit.sample, strict=True):
        for channel, sensor in names.items():
            _, boxes, K = devkit.get_sample_data(row["data"][channel])
            for thing in sample.truth[sensor].objects:
                if thing.box is None or thing.truncation > 0 or thing.occlusion > 0:
                    continue
                seen = thing.box
                frames = [projected(view_points, box, K) for box in boxes]
                if not any(
                    low[0] <= seen.x_min and low[1] <= seen.y_min
                    and high[0] >= seen.x_max and high[1] >= seen.y_max
                    and (high - low).prod() < 1.5 * seen.width_px * seen.height_px + 60
                    for low, high in frames
                ):  # fmt: skip
                    yield f"{thing.instance.category}: no box around its mask in {channel}"
                compared += 1
    if compared < 10:
        yield "hardly an object is in an image"


def projected(view_points: Any, box: Any, K: Any) -> tuple[Any, Any]:
    """Low and high corner of a projected box, grown by a pixel; pixel edges are whole numbers."""
    uv = view_points(box.corners(), K, normalize=True)[:2] + 0.5
    return uv.min(axis=1) - 1.0, uv.max(axis=1) + 1.0


def radar_faults(devkit: Any) -> Iterator[str]:
    """Files of radars can be read, and detections lie within reach, ahead."""
    from nuscenes.utils.data_classes import RadarPointCloud

    for row in devkit.sample_data:
        if row["sensor_modality"] == "radar":
            path = devkit.get_sample_data_path(row["token"])
            try:
                points = RadarPointCloud.from_file(path).points
            except AssertionError:
                yield f"{path}: refused"
                continue
            if not (np.hypot(points[0], points[1]) < 250).all() or (points[0] < 0).any():
                yield f"{path}: detections out of reach"


def map_faults(devkit: Any) -> Iterator[str]:
    """Every log has a map, which contains the poses of the ego."""
    for scene in devkit.scene:
        log = devkit.get("log", scene["log_token"])
        mask = devkit.get("map", log["map_token"])["mask"].mask()
        for row in devkit.sample:
            if row["scene_token"] == scene["token"]:
                data = devkit.get("sample_data", row["data"]["LIDAR_TOP"])
                x, y, _ = devkit.get("ego_pose", data["ego_pose_token"])["translation"]
                if not (0 <= 10 * x < mask.shape[1] and 0 <= 10 * y < mask.shape[0]):
                    yield f"{scene['name']}: the ego is beside the map, at {x:.1f}, {y:.1f}"


def detection_faults(devkit: Any, folder: Path) -> Iterator[str]:
    """The boxes as predictions: AP 1 and no error for every class that is there."""
    from nuscenes.eval.common.config import config_factory
    from nuscenes.eval.detection.evaluate import DetectionEval

    result = folder.parent / "predictions.json"
    result.write_text(json.dumps({"meta": META, "results": predictions(devkit)}))
    evaluation = DetectionEval(
        devkit,
        config_factory("detection_cvpr_2019"),
        str(result),
        "all",
        str(folder.parent / "evaluation"),
        verbose=False,
    )
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
    "use_camera": True,
    "use_lidar": True,
    "use_radar": True,
    "use_map": False,
    "use_external": False,
}


def predictions(devkit: Any) -> dict[str, list[dict[str, Any]]]:
    """All boxes with points as predictions of a detector, by sample."""
    from nuscenes.eval.detection.utils import category_to_detection_name

    results: dict[str, list[dict[str, Any]]] = {row["token"]: [] for row in devkit.sample}
    for row in devkit.sample_annotation:
        name = category_to_detection_name(row["category_name"])
        if name is not None and row["num_lidar_pts"] + row["num_radar_pts"] > 0:
            results[row["sample_token"]].append(
                {
                    "sample_token": row["sample_token"],
                    "translation": row["translation"],
                    "size": row["size"],
                    "rotation": row["rotation"],
                    "velocity": devkit.box_velocity(row["token"])[:2].tolist(),
                    "detection_name": name,
                    "detection_score": 0.9,
                    "attribute_name": devkit.get("attribute", row["attribute_tokens"][0])["name"],
                }
            )
    return results
