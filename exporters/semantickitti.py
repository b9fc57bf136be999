"""SemanticKITTI: scans with a class and an instance per point, one sequence per split.

::

    sequences/00/velodyne/000000.bin   float32 x y z intensity         train is 00, val 08, test 11:
    sequences/00/labels/000000.label   uint32, class | instance << 16  a sequence of each official
    sequences/00/calib.txt             P0 to P3, Tr                    split
    sequences/00/poses.txt             camera i in camera 0, 3 x 4
    sequences/00/times.txt             seconds, one step apart

Scans are numbered without gaps in the order of samples; ``scans.txt`` names their samples. Over the
steps of a view things keep their instance id from scan to scan. The next view begins elsewhere,
with instance ids of its own: nothing is followed across a jump. Things that move at the instant of
a scan have the ``moving-`` classes.

Reference: Behley et al., "SemanticKITTI", ICCV 2019, and semantic-kitti-api, whose classes and
numbers these are. A van is a car there; a mast is a pole, also that of a sign or a light.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from exporters.clouds import T_camera_lidar, read_points, xyzi_bytes
from exporters.images import link_or_copy
from exporters.kitti import calib_matrices, matrix_lines
from generator.config.strict import Strict
from generator.core.errors import ConfigError
from generator.core.geometry import SURFACES
from generator.core.interfaces import DatasetInfo
from generator.core.sample import Sample
from generator.core.scene import Scene
from generator.core.serial import canonical_json

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
MOVING = {10: 252, 31: 253, 30: 254, 32: 255, 16: 256, 13: 257, 18: 258}
"""Classes of things under way, by their class at rest; motorcycles have none."""
MOVING_M_S = 0.05
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
"""Classes of scenery by category; everything else that has a category is other-object."""
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
"""Classes by surface, for what has no category; air and what mirrors show are outliers."""
OTHER_OBJECT, OTHER_GROUND, SIGN, VEGETATION, TRUNK = 99, 49, 81, 70, 71
SEQUENCES = {"train": "00", "val": "08", "test": "11"}
INSTANCES_MAX = 65_535


class SemanticKitti(Strict):
    """SemanticKITTI: the scans of one laser scanner with a label per point."""

    type: Literal["semantickitti"] = "semantickitti"
    lidar: str = ""
    """Sensor whose scans these are; empty = the first one by name."""
    camera: str = ""
    """Sensor that becomes camera 0; empty = the first one by name."""

    @property
    def needs(self) -> frozenset[str]:
        """Annotators whose fields it reads."""
        return frozenset()

    def check(self, info: DatasetInfo) -> None:
        """Refuse a data set without the sensors that are named.

        Raises:
            ConfigError: telling which.
        """
        for field, name, known in (
            ("lidar", self.lidar, info.lidars),
            ("camera", self.camera, info.sensors),
        ):
            if not known or (name and name not in known):
                raise ConfigError(
                    f"exporter 'semantickitti': there is no {field} '{name}'; "
                    f"sensors of that kind: {', '.join(known) or 'none'}"
                )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write points and labels of each sample, and a line about its scan."""
        self.check(info)
        lidar, camera = self.lidar or info.lidars[0], self.camera or info.sensors[0]
        folder = shard_dir / self.type
        folder.mkdir(parents=True, exist_ok=True)
        lines = []
        for sample in samples:
            points = read_points(shard_dir, lidar, sample.index)
            stem = folder / f"{sample.index:09d}"
            stem.with_suffix(".bin").write_bytes(xyzi_bytes(points))
            stem.with_suffix(".label").write_bytes(point_labels(points, sample.scene).tobytes())
            view = sample.truth[camera].camera
            calib = calib_matrices(view.intrinsics, T_camera_lidar(sample, camera, lidar)[:3])
            scan = {
                "index": sample.index,
                "view": [sample.scene_index, sample.view_index],
                "split": sample.split,
                "pose": [float(v) for v in view.T_world_camera.matrix().ravel()],
                "calib": matrix_lines({k: calib[k] for k in ("P0", "P1", "P2", "P3")})
                + matrix_lines({"Tr": calib["Tr_velo_to_cam"]}),
            }
            lines.append(canonical_json(scan) + "\n")
        (folder / "scans.jsonl").write_text("".join(lines), encoding="utf-8", newline="\n")

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number the scans of each split, and the things in them."""
        scans = list(_scans([shard_dir / self.type for shard_dir in shard_dirs]))
        for split, number in SEQUENCES.items():
            mine = [(folder, scan) for folder, scan in scans if scan["split"] == split]
            if mine:
                _write_sequence(mine, dataset_dir / "sequences" / number, info.step_s)


def point_labels(points: NDArray[np.void], scene: Scene) -> NDArray[np.uint32]:
    """Class in the lower and instance id in the upper half, little-endian uint32 [n]."""
    top = max((i.instance_id for i in scene.instances), default=0)
    of_surface = np.array([OF_SURFACE.get(name, 0) for name in SURFACES], np.uint32)
    named = np.full(top + 1, OTHER_OBJECT, np.uint32)
    counted = np.zeros(top + 1, np.bool_)
    leafy, signed = np.zeros(top + 1, np.bool_), np.zeros(top + 1, np.bool_)
    for thing in scene.instances:
        k, category = thing.instance_id, thing.category
        counted[k] = category in THINGS
        named[k] = THINGS.get(category, STUFF.get(category, OTHER_OBJECT))
        if max(map(abs, thing.twist.velocity_m_s)) > MOVING_M_S:
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


def _scans(folders: Sequence[Path]) -> Iterator[tuple[Path, dict[str, Any]]]:
    for folder in folders:
        for line in (folder / "scans.jsonl").read_text("utf-8").splitlines():
            yield folder, json.loads(line)


def _write_sequence(
    scans: Sequence[tuple[Path, dict[str, Any]]], folder: Path, step_s: float
) -> None:
    (folder / "labels").mkdir(parents=True, exist_ok=True)
    numbers: dict[tuple[int, int, int], int] = {}
    first = np.linalg.inv(np.array(scans[0][1]["pose"]).reshape(4, 4))
    poses = []
    for k, (source, scan) in enumerate(scans):
        stem = source / f"{scan['index']:09d}"
        link_or_copy(stem.with_suffix(".bin"), folder / f"velodyne/{k:06d}.bin")
        labels = np.frombuffer(stem.with_suffix(".label").read_bytes(), "<u4")
        labels = _renumbered(labels, tuple(scan["view"]), numbers)
        (folder / f"labels/{k:06d}.label").write_bytes(labels.tobytes())
        pose = first @ np.array(scan["pose"]).reshape(4, 4)
        poses.append(" ".join(f"{v + 0.0:.9e}" for v in pose[:3].ravel()) + "\n")
    _write(folder / "poses.txt", "".join(poses))
    _write(folder / "times.txt", "".join(f"{step_s * k:.6e}\n" for k in range(len(scans))))
    _write(folder / "calib.txt", scans[0][1]["calib"])
    _write(folder / "scans.txt", "".join(f"{scan['index']}\n" for _, scan in scans))


def _renumbered(
    labels: NDArray[np.uint32], view: tuple[int, int], numbers: dict[tuple[int, int, int], int]
) -> NDArray[np.uint32]:
    """Labels with instance ids that are unique in the sequence; ``numbers`` grows."""
    ids = labels >> np.uint32(16)
    table = np.zeros(int(ids.max(initial=0)) + 1, np.uint32)
    for old in np.unique(ids[ids > 0]):
        new = numbers.setdefault((*view, int(old)), len(numbers) + 1)
        if new > INSTANCES_MAX:
            raise ConfigError(
                f"exporter 'semantickitti': a sequence holds {INSTANCES_MAX} instances at most; "
                "make smaller data sets"
            )
        table[old] = new
    renumbered: NDArray[np.uint32] = (labels & np.uint32(0xFFFF)) | (table[ids] << np.uint32(16))
    return renumbered


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
