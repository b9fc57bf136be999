"""Scene flow of laser points to the next scan, as data sets of point clouds have it.

::

    kitti/<split>/000012_000003.npz              sequence and step, as FlowNet3D's KITTI files
    av2/<split>/<log>/<time>.feather             as annotations of Argoverse 2's challenge

* **kitti**: ``pos1`` [n, 3], ``pos2`` [m, 3], ``gt`` [n, 3], float32: points of this scan and the
  next one, each in the scanner's frame at the middle of the sweep (X forward, Y left, Z up), and
  where the first ones are in the second frame, minus ``pos1``. ``pos1`` lacks points without a
  flow, for which the format has no mark; ground is included.
* **av2**: ``flow_tx_m``, ``flow_ty_m``, ``flow_tz_m`` (float32), ``is_valid``, ``is_dynamic``
  (moves by at least 5 cm besides the ego's motion), ``is_close`` (at most 35 m along x and y),
  ``category_indices`` (uint8; 0 = none), a row per point of the scan, in the ego's frame of both
  instants. Logs, times and the order of points are as in ``argoverse2``.

The flow of a point is where its surface is one period of the scanner after the pulse left, minus
where it was then; the motion of the ego is in it. Returns from the air and by way of mirrors have
no surface there: they are not valid, and have the flow of the static world. The last scan of a
sequence, and one whose next scan is missing, has no file.

Reference: Liu et al., "FlowNet3D", CVPR 2019; Wilson et al., "Argoverse 2", NeurIPS Datasets and
Benchmarks 2021, and its evaluation of scene flow in av2-api.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core.asset_types import SURFACES
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.core.point_motion import moved_points
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3, Array
from gen_data.exporters import base, image_files, sequences
from gen_data.exporters.argoverse2 import CLASSES, feather_bytes, time_ns_of
from gen_data.exporters.conventions import Conventions
from gen_data.exporters.npz import npz_bytes
from gen_data.exporters.nuscenes_classes import category_of
from gen_data.exporters.point_cloud_io import read_points
from gen_data.exporters.sensor_selection import has_scans, instant_s, laser_scanner, stamp_s

Layout = Literal["kitti", "av2"]
INDICES: Mapping[str, int] = {
    "ANIMAL": 1,
    "ARTICULATED_BUS": 2,
    "BICYCLE": 3,
    "BUS": 7,
    "CONSTRUCTION_CONE": 9,
    "LARGE_VEHICLE": 11,
    "MOTORCYCLE": 14,
    "PEDESTRIAN": 17,
    "REGULAR_VEHICLE": 19,
    "STROLLER": 23,
    "TRUCK": 25,
    "VEHICULAR_TRAILER": 27,
    "WHEELCHAIR": 28,
    "WHEELED_DEVICE": 29,
}
"""Numbers of the classes: places among Argoverse 2's thirty in alphabetical order, from 1."""
DYNAMIC_M, CLOSE_M = 0.05, 35.0
NOWHERE = (SURFACES.index("air"), SURFACES.index("mirrored"))
"""Surfaces of returns that are not where they seem to be, or nothing."""
LEVEL = 1
"""Of compression."""


class LidarFlow(base.AssetExporter):
    """Scene flow of a laser scanner's points to the next scan.

    Attributes:
        layouts: Layouts to write.
        lidar: Laser scanner; empty = the first one by name.
    """

    type: Literal["lidar_flow"] = "lidar_flow"
    conventions: ClassVar[Conventions] = Conventions(time="ns (av2); middle of the sweep")
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    layouts: tuple[Layout, ...] = Field(("kitti", "av2"), min_length=1)
    lidar: str = ""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set whose points have no next scan, or no common frame.

        Raises:
            ConfigError: there is no laser scanner, its scans are raw, a sequence has only one, or a
                package is missing.
        """
        if "av2" in self.layouts:
            base.check_installed(self.type, "pyarrow")
        lidar = laser_scanner(info, self.lidar, self.type)
        place = f"exporter '{self.type}'"
        if not lidar:
            raise ConfigError(f"{place}: there is no lidar; add a sensor of that type")
        if info.sensor(lidar).motion_distortion == "raw":
            raise ConfigError(
                f"{place}: lidar '{lidar}' has motion_distortion: raw, whose points are in the"
                " frames of their pulses; expected deskewed or none"
            )
        if _period_steps(info, lidar) >= info.steps_per_scene:
            raise ConfigError(
                f"{place}: lidar '{lidar}' scans once in a sequence; expected steps_per_scene above"
                f" {_period_steps(info, lidar)}"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the points and the flow of each scan, and a line for it.

        Raises:
            ConfigError: see ``check``.
        """
        self.check(info)
        lidar, folder, rows = laser_scanner(info, self.lidar, self.type), shard_dir / self.type, []
        period_steps = _period_steps(info, lidar)
        at_once = info.sensor(lidar).motion_distortion == "none"
        for sample in samples:
            if not has_scans(shard_dir, lidar, sample.index):
                continue
            points = read_points(shard_dir, lidar, sample.index)
            row = sequences.frame_facts(info, sample) | {"time_s": stamp_s(sample, lidar)}
            rows.append(row)
            arrays = {"position_m": points["position_m"]}
            if row["step"] + period_steps < info.steps_per_scene:
                now = scene_at(sample.scene_of(lidar), instant_s(sample, lidar))
                delays_s = points["time_s"] - 0.5 * now.lidar(lidar).sweep_s
                delays_s = np.zeros(len(points)) if at_once else delays_s.astype(np.float64)
                then = scene_at(now, now.time_s + period_steps * info.step_s)
                flow = scene_flow(now, then, self.library, lidar, points, delays_s)
                arrays |= {"flow_m": flow.flow_m.astype(np.float32), "valid": flow.valid}
                if "av2" in self.layouts:
                    data = annotation_bytes(now, lidar, points, flow)
                    sequences.write_bytes(folder / f"{sample.index:09d}.feather", data)
            if "kitti" in self.layouts:
                sequences.write_bytes(_scan_path(folder, sample.index), npz_bytes(arrays, LEVEL))
        sequences.write_frames(folder, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write a file for every pair of scans that follow each other."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        period_steps = _period_steps(info, laser_scanner(info, self.lidar, self.type))
        for number, frames in sequences.read_sequences(shard_dirs, self.type).items():
            for frame, later in pairwise(frames):
                if later.index - frame.index != period_steps:
                    continue
                split, folder = frame.row["split"], frame.shard_dir / self.type
                if "kitti" in self.layouts:
                    name = f"{number:06d}_{frame.row['step']:06d}.npz"
                    path = dataset_dir / "kitti" / split / name
                    sequences.write_bytes(path, self._pair(frame, later))
                if "av2" in self.layouts:
                    log = f"{info.name}-{number:06d}"
                    name = f"{time_ns_of(info, number, frame.row['time_s'])}.feather"
                    source = folder / f"{frame.index:09d}.feather"
                    image_files.link_or_copy(source, dataset_dir / "av2" / split / log / name)

    def _pair(self, frame: sequences.Frame, later: sequences.Frame) -> bytes:
        one, two = (np.load(_scan_path(f.shard_dir / self.type, f.index)) for f in (frame, later))
        valid = one["valid"]
        pair = {
            "pos1": one["position_m"][valid],
            "pos2": two["position_m"],
            "gt": one["flow_m"][valid],
        }
        return npz_bytes(pair, LEVEL)


@dataclass(frozen=True, eq=False, slots=True)
class SceneFlow:
    """Flow of points; arrays are [n].

    Attributes:
        flow_m: Place in the scanner's frame then, minus place in its frame now [m], [n, 3].
        moved_m: Way in the world [m].
        valid: Whether the point is on a surface whose motion is known.
    """

    flow_m: Array
    moved_m: Array
    valid: NDArray[np.bool_]


def scene_flow(
    now: Scene,
    then: Scene,
    assets: AssetLibrary,
    lidar: str,
    points: NDArray[np.void],
    delays_s: Array,
) -> SceneFlow:
    """Flow of the points of a scan to another instant.

    Args:
        now: The scene at the instant of the scan.
        then: The scene at the other instant.
        assets: Meshes of its bodies.
        lidar: Name of the scanner.
        points: Records of ``POINT`` [n].
        delays_s: When their pulses left, after the scan's instant [s], [n].
    """
    p_now = points["position_m"].astype(np.float64)
    p_world = now.lidar(lidar).T_world_lidar.apply(p_now)
    p_then, known = moved_points(now, then, assets, p_world, points["instance_id"], delays_s)
    flow_m = then.lidar(lidar).T_world_lidar.inverse().apply(p_then) - p_now
    moved_m = np.sqrt(((p_then - p_world) ** 2).sum(axis=1))
    return SceneFlow(flow_m, moved_m, known & ~np.isin(points["surface"], NOWHERE))


def annotation_bytes(scene: Scene, lidar: str, points: NDArray[np.void], flow: SceneFlow) -> bytes:
    """Encode an annotation of Argoverse 2's challenge; ``scene`` is at the scan's instant."""
    import pyarrow as pa

    mount = sequences.lidar_mount(scene, lidar, true=True)
    T_ego_lidar = sequences.relative_pose(scene, sequences.Mount(mount.rig, SE3()), mount)
    p_ego = T_ego_lidar.apply(points["position_m"].astype(np.float64))
    flow_ego = np.asarray(T_ego_lidar.rotate(flow.flow_m)).astype(np.float32)
    numbers = np.zeros(np.iinfo(np.uint16).max + 1, np.uint8)
    for instance in scene.instances:
        numbers[instance.instance_id] = INDICES.get(CLASSES.get(category_of(instance), ""), 0)
    columns = {
        "category_indices": numbers[points["instance_id"]],
        "is_close": (np.abs(p_ego[:, :2]) <= CLOSE_M).all(axis=1),
        "is_dynamic": flow.moved_m >= DYNAMIC_M,
        "is_valid": flow.valid,
        **{f"flow_t{axis}_m": flow_ego[:, k] for k, axis in enumerate("xyz")},
    }
    return feather_bytes({name: pa.array(column) for name, column in columns.items()})


def _period_steps(info: DatasetInfo, lidar: str) -> int:
    """Steps from one scan to the next."""
    rate_hz = info.sensor(lidar).rate_hz
    return 1 if rate_hz is None else max(1, round(1.0 / (rate_hz * info.step_s)))


def _scan_path(folder: Path, index: int) -> Path:
    return folder / f"{index:09d}.npz"
