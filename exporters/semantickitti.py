"""SemanticKITTI: scans with a class and an instance per point, in sequences.

::

    sequences/00/velodyne/000000.bin   float32 x y z intensity
    sequences/00/labels/000000.label   uint32, class | instance << 16
    sequences/00/calib.txt             P0 to P3, Tr
    sequences/00/poses.txt             camera i in camera 0 at the sweeps' instants, 3 x 4
    sequences/00/times.txt             seconds
    split.yaml                         sequences of each split, as semantic-kitti.yaml lists them

Scans are numbered without gaps in the order of samples; ``scans.txt`` names their samples. X of the
points is the X axis of the rig, ahead (``gen_data.exporters.velodyne``).

* **Views of several instants** are one sequence each, numbered by view. Instance ids are
  the scene's. Objects that move at the instant of a scan have a moving class.
* **Views of one instant** form one sequence per split, one sweep apart: train is 00, val 08, test
  11, each from the official split. Views of one scene share a world, and objects keep their
  instance ids from scan to scan; the next scene is elsewhere and has its own instance ids.
  Such a sequence is not a drive: views of a street are a hundred metres apart.
  Train on single scans; a method that joins scans needs views of several instants.

Reference: Behley et al., "SemanticKITTI", ICCV 2019, and semantic-kitti-api, which define classes
and numbers. Vans are cars there; masts are poles, also of signs and lights.
"""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.core.serialization import from_plain
from gen_data.exporters import base, image_files, kitti, point_cloud_io, sensor_selection, velodyne
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.sequences import (
    Frame,
    camera_mount,
    check_one_carrier,
    frame_facts,
    lidar_mount,
    matrix_numbers,
    mounted_pose,
    read_sequences,
    relative_pose,
    write_bytes,
    write_frames,
    write_text,
)

THINGS = {
    "car": 10,
    "van": 10,
    "bicycle": 11,
    "bus": 13,
    "motorcycle": 15,
    "truck": 18,
    "tram": 16,
    "person": 30,
    "pedestrian": 30,
    "cyclist": 31,
    "motorcyclist": 32,
}
"""Countable classes by category."""
STUFF = {
    "building": 50,
    "fence": 51,
    "barrier": 51,
    "tree": 70,
    "hedge": 70,
    "shrub": 70,
    "bush": 70,
    "street_light": 80,
    "traffic_light": 80,
    "traffic_sign": 80,
    "pole": 80,
}
"""Classes of scenery by category; all other categories are other-object."""
OF_SURFACE = {
    "air": 1,
    "mirrored": 1,
    "asphalt": 40,
    "marking": 60,
    "pavement": 48,
    "kerb": 48,
    "grass": 72,
    "leaf": 70,
    "bark": 71,
}
"""Classes by surface, for points without a category; air and mirror images are outliers."""
OTHER_OBJECT, OTHER_GROUND, SIGN, VEGETATION, TRUNK = 99, 49, 81, 70, 71
RIDDEN = {"bicycle": 31, "motorcycle": 32}
"""Classes of objects with a rider, by category."""
MOVING = {10: 252, 11: 253, 30: 254, 31: 253, 32: 255, 15: 255, 16: 256, 13: 257, 18: 258}
"""Moving classes by static class; a moving bicycle or motorcycle has the class of its rider."""
MOVING_M_S = 0.1
"""Speed above which an object counts as moving."""
SEQUENCES = {"train": 0, "val": 8, "test": 11}
OFFICIAL_SPLITS = {"train": "train", "val": "valid", "test": "test"}
SWEEP_S = 0.1
INSTANCES_MAX = 65_535


class SemanticKitti(base.ExporterBase):
    """SemanticKITTI: the scans of one laser scanner with a label per point."""

    type: Literal["semantickitti"] = "semantickitti"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i", lens=PINHOLE, time="s; middle of the sweep", intensity="0 to 1"
    )
    own_classes: ClassVar[bool] = True

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    lidar: str = ""
    """Sensor of the scans; empty = the first one by name."""
    camera: str = ""
    """Sensor that becomes camera 0; empty = the first one by name on the scanner's rig."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without the sensors, or whose camera is not a pinhole.

        Raises:
            ConfigError: a sensor is missing, or the camera is not a pinhole.
        """
        for field, name, known in (
            ("lidar", self.lidar, info.lidars),
            ("camera", self.camera, info.cameras),
        ):
            if not known:
                raise ConfigError(
                    f"exporter '{self.type}': there is no {field}; add a sensor of that type"
                )
            if name and name not in known:
                raise ConfigError(
                    f"exporter '{self.type}': there is no {field} '{name}'; expected one of: "
                    f"{', '.join(known)}{did_you_mean(name, known)}"
                )
        sensor_selection.check_pinholes(info, [self.camera or info.cameras[0]], self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write points and labels of each sample, and a line for its scan.

        Raises:
            ConfigError: see ``check``, or camera and scanner are on different carriers.
        """
        self.check(info)
        lidar = self.lidar or info.lidars[0]
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            if not sensor_selection.has_scans(shard_dir, lidar, sample.index):
                continue
            points = point_cloud_io.read_points(shard_dir, lidar, sample.index)
            stem = folder / f"{sample.index:09d}"
            turn = velodyne.turn_to_rig(sample.scene, lidar)
            write_bytes(stem.with_suffix(".bin"), velodyne.scan_bytes(points, turn))
            write_bytes(stem.with_suffix(".label"), point_labels(points, sample.scene).tobytes())
            camera = self._camera(info, sample.scene, lidar)
            eye = camera_mount(sample.scene, camera, true=True)
            row = {
                "scene": sample.scene_index,
                "time_s": sensor_selection.stamp_s(sample, lidar),
                "T_world_camera": mounted_pose(sample.scene_of(lidar), eye),
                "calib": _calib(sample.scene, camera, lidar),
            }
            rows.append(frame_facts(info, sample) | row)
        write_frames(folder, rows)

    def _camera(self, info: DatasetInfo, scene: Scene, lidar: str) -> str:
        """Camera 0. Raises ConfigError if it moves against the scanner, or is not a pinhole."""
        mounts = {name: camera_mount(scene, name) for name in info.cameras}
        scanner = lidar_mount(scene, lidar)
        beside = [name for name in info.cameras if mounts[name].rig == scanner.rig]
        camera = self.camera or next(iter(beside), info.cameras[0])
        sensor_selection.check_pinholes(info, [camera], self.type)
        check_one_carrier(info, self.type, {lidar: scanner, camera: mounts[camera]})
        return camera

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number the scans of each sequence, and the instances in them."""
        sequences = numbered_sequences(info, shard_dirs, self.type)
        splits: dict[str, list[int]] = {}
        for number, scans in sequences.items():
            _write_sequence(info, scans, dataset_dir / f"sequences/{number:02d}")
            splits.setdefault(scans[0].row["split"], []).append(number)
        lines = (f"  {OFFICIAL_SPLITS[k]}: {splits.get(k, [])}\n" for k in OFFICIAL_SPLITS)
        write_text(dataset_dir / "split.yaml", "split:\n" + "".join(lines))


def point_labels(points: NDArray[np.void], scene: Scene) -> NDArray[np.uint32]:
    """Label each point: class in the lower, instance id in the upper half; uint32 [n]."""
    top = max((i.instance_id for i in scene.instances), default=0)
    of_surface = np.array([OF_SURFACE.get(name, 0) for name in SURFACES], np.uint32)
    named = np.full(top + 1, OTHER_OBJECT, np.uint32)
    counted = np.zeros(top + 1, np.bool_)
    leafy, signed = np.zeros(top + 1, np.bool_), np.zeros(top + 1, np.bool_)
    for thing in scene.instances:
        k, category = thing.instance_id, thing.category
        counted[k] = category in THINGS
        named[k] = THINGS.get(category, STUFF.get(category, OTHER_OBJECT))
        if dict(thing.attributes).get("rider") == "yes":
            named[k] = RIDDEN.get(category, named[k])
        if math.hypot(*thing.twist.velocity_m_s) > MOVING_M_S:
            named[k] = MOVING.get(int(named[k]), named[k])
        leafy[k], signed[k] = named[k] == VEGETATION, category == "traffic_sign"
    ids, surfaces = points["instance_id"].astype(np.int64), points["surface"]
    ground = of_surface[surfaces]
    ground[ground == 0] = OTHER_GROUND
    classes = np.where(ids > 0, named[ids], ground)
    classes[leafy[ids] & (surfaces == SURFACES.index("bark"))] = TRUNK
    classes[signed[ids] & (surfaces == SURFACES.index("sign"))] = SIGN
    things = np.where(counted[ids] & (ids > 0), ids, 0).astype(np.uint32)
    labels: NDArray[np.uint32] = (classes | (things << np.uint32(16))).astype("<u4")
    return labels


def _calib(scene: Scene, camera: str, lidar: str) -> str:
    scanner = velodyne.turned_mount(scene, lidar, velodyne.turn_to_rig(scene, lidar))
    T_camera_velo = relative_pose(scene, camera_mount(scene, camera), scanner)
    calib = kitti.calib_matrices(scene.camera(camera).intrinsics, T_camera_velo.matrix()[:3])
    projections = {k: calib[k] for k in ("P0", "P1", "P2", "P3")}
    return kitti.matrix_lines(projections | {"Tr": calib["Tr_velo_to_cam"]})


def numbered_sequences(
    info: DatasetInfo, shard_dirs: Sequence[Path], exporter: str
) -> dict[int, list[Frame]]:
    """Scans by the number of their sequence: by view, or by split in views of one instant."""
    sequences = read_sequences(shard_dirs, exporter)
    if info.steps_per_scene > 1:
        return sequences
    frames = [frame for scans in sequences.values() for frame in scans]
    together = {
        number: [frame for frame in frames if frame.row["split"] == split]
        for split, number in SEQUENCES.items()
    }
    return {number: scans for number, scans in together.items() if scans}


def _write_sequence(info: DatasetInfo, scans: Sequence[Frame], folder: Path) -> None:
    single = info.steps_per_scene == 1
    numbers: dict[tuple[int, int], int] = {}
    T_first_world = from_plain(SE3, scans[0].row["T_world_camera"]).inverse()
    poses = []
    for k, scan in enumerate(scans):
        stem = scan.shard_dir / "semantickitti" / f"{scan.index:09d}"
        image_files.link_or_copy(stem.with_suffix(".bin"), folder / f"velodyne/{k:06d}.bin")
        target = folder / f"labels/{k:06d}.label"
        if single:
            labels = np.frombuffer(stem.with_suffix(".label").read_bytes(), "<u4")
            write_bytes(target, _renumber(labels, scan.row["scene"], numbers).tobytes())
        else:
            image_files.link_or_copy(stem.with_suffix(".label"), target)
        pose = (T_first_world @ from_plain(SE3, scan.row["T_world_camera"])).rounded(9)
        poses.append(matrix_numbers(pose.matrix()[:3]) + "\n")
    times_s = [SWEEP_S * k if single else scan.row["time_s"] for k, scan in enumerate(scans)]
    write_text(folder / "poses.txt", "".join(poses))
    write_text(folder / "times.txt", "".join(f"{time_s:.6e}\n" for time_s in times_s))
    write_text(folder / "calib.txt", scans[0].row["calib"])
    write_text(folder / "scans.txt", "".join(f"{scan.index}\n" for scan in scans))


def _renumber(
    labels: NDArray[np.uint32], scene: int, numbers: dict[tuple[int, int], int]
) -> NDArray[np.uint32]:
    """Make instance ids unique in the sequence; adds new ones to ``numbers``."""
    ids = labels >> np.uint32(16)
    table = np.zeros(int(ids.max(initial=0)) + 1, np.uint32)
    for old in np.unique(ids[ids > 0]):
        new = numbers.setdefault((scene, int(old)), len(numbers) + 1)
        if new > INSTANCES_MAX:
            raise ConfigError(
                f"exporter 'semantickitti': a sequence holds at most {INSTANCES_MAX} instances; "
                "generate smaller data sets"
            )
        table[old] = new
    renumbered: NDArray[np.uint32] = (labels & np.uint32(0xFFFF)) | (table[ids] << np.uint32(16))
    return renumbered
