"""Laser scans on disk: one NumPy file of ``POINT`` records per sweep, written before labels.

``numpy.load`` reads them; every field is described at ``gen_data.core.capture.POINT``.
Exporters make their own files from these.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import capture, errors, interfaces, scene, se3
from gen_data.core.reported import reported
from gen_data.core.sample import Sample

PointTime = Literal["sweep_middle", "sweep_start"]
"""Instant from which times of points count."""


def write_cloud(cloud: capture.PointCloud, shard_dir: Path, index: int) -> None:
    """Write one sweep to its ``cloud_path``, and its origins to their ``origins_path``."""
    path = interfaces.cloud_path(shard_dir, cloud.sensor, index)
    arrays = {path: cloud.points}
    if cloud.origins is not None:
        arrays[interfaces.origins_path(shard_dir, cloud.sensor, index)] = cloud.origins
    for path, records in arrays.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            np.lib.format.write_array(file, records, version=(1, 0), allow_pickle=False)


def scanner_at_sweep(sample: Sample, lidar: str) -> scene.Lidar:
    """Laser scanner at the instant of its sweep; the scene's if it has no reading."""
    cloud = sample.capture.clouds.get(lidar)
    return cloud.lidar if cloud is not None else sample.scene.lidar(lidar)


def read_points(shard_dir: Path, sensor: str, index: int) -> NDArray[np.void]:
    """Read the points of one sweep. Raises StorageError if the file is missing or damaged."""
    path = interfaces.cloud_path(shard_dir, sensor, index)
    try:
        points: NDArray[np.void] = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise errors.StorageError(
            f"{path}: cannot be read ({error}); generate the data set again"
        ) from error
    if points.dtype != capture.POINT:
        raise errors.StorageError(f"{path}: contains no laser points; generate the data set again")
    return points


def class_facts(info: interfaces.DatasetInfo, scene: scene.Scene) -> dict[str, Any]:
    """Key ``classes`` of a frame's line: classes by instance id, if a label map has others."""
    if not info.own_categories:
        return {}
    return {"classes": {str(i.instance_id): i.category_id for i in scene.instances}}


def with_classes(records: NDArray[np.void], classes: Mapping[str, int] | None) -> NDArray[np.void]:
    """Points, or rows of a device, with the category ids of ``class_facts``; None = their own.

    Stored ids are of the data set's categories, which a label map merges, divides and orders.
    """
    columns = records.dtype.names or ()
    if classes is None or not {"instance_id", "category_id"} <= {*columns}:
        return records
    mapped: NDArray[np.void] = records.copy()
    mapped["category_id"] = class_table(classes)[records["instance_id"]]
    return mapped


def class_table(classes: Mapping[str, int]) -> NDArray[np.uint16]:
    """Class of every instance id, [65536]; 0 = none."""
    table = np.zeros(1 + np.iinfo(np.uint16).max, np.uint16)
    table[[int(number) for number in classes]] = [*classes.values()]
    return table


def count_times_from(base: PointTime, points: NDArray[np.void], sweep_s: float) -> NDArray[np.void]:
    """Points whose ``time_s`` counts from an instant of the sweep; they are stored from its start.

    Poses, boxes and stamps are at the middle: with ``sweep_middle``, which makes half of the times
    negative, stamp plus time is the instant of the pulse.
    """
    if base == "sweep_start":
        return points
    moved: NDArray[np.void] = points.copy()
    moved["time_s"] -= np.float32(0.5 * sweep_s)
    return moved


def T_camera_lidar(  # noqa: N802
    sample: Sample, camera: str, lidar: str, *, true: bool = False
) -> se3.SE3:
    """Transform from lidar to camera coordinates, as calibrations state it, or the true one.

    On a common rig it is the rig's calibration, at whatever instants the two read.
    """
    view, scanner = sample.truth[camera].camera, scanner_at_sweep(sample, lidar)
    view, scanner = (view, scanner) if true else (reported(view), reported(scanner))
    if view.rig and view.rig == scanner.rig:
        return view.T_rig_camera.inverse() @ scanner.T_rig_lidar
    return view.T_world_camera.inverse() @ scanner.T_world_lidar
