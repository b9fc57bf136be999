"""Point clouds for viewers and libraries: PLY or PCD files with every field.

::

    <lidar>/000000012.ply    binary little-endian, or 000000012.pcd, PCD 0.7 binary
    <lidar>/poses.jsonl      {"index", "time_s", "sweep_s", "point_time", "T_world_lidar",
                              "boxes": [3D boxes in the lidar frame]}

Pose and boxes are at ``time_s``, the middle of the sweep, which lasts ``sweep_s``. ``time`` of a
point counts from there: ``time_s + time`` is the instant of its pulse; with
``point_time: sweep_start`` it counts from the start of the sweep. Comments in the files repeat it.

Properties: ``x y z intensity time ring instance category surface return_number return_count``, as
described at ``gen_data.core.capture.POINT``. Open3D, PCL, CloudCompare and MeshLab read
both formats and skip unknown fields.

References: Turk, "The PLY Polygon File Format", 1994; PCL, "The PCD file format".
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, errors
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.reported import reported
from gen_data.core.sample import Sample
from gen_data.core.scene import Instance
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, image_files, point_cloud_io
from gen_data.exporters.conventions import POINT_TIME, READING, Conventions
from gen_data.exporters.sensor_selection import has_scans, stamp_s

FILE_POINT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("time", "<f4"),
        ("ring", "<u2"),
        ("instance", "<u2"),
        ("category", "<u2"),
        ("surface", "u1"),
        ("return_number", "u1"),
        ("return_count", "u1"),
    ]
)
PLY_TYPES = {"<f4": "float", "<u2": "uint16", "|u1": "uint8"}
PCD_TYPES = {"<f4": ("4", "F"), "<u2": ("2", "U"), "|u1": ("1", "U")}


class PointClouds(base.ExporterBase):
    """PLY or PCD files of every laser scan.

    Attributes:
        format: Binary PLY, or binary PCD of the Point Cloud Library.
        point_time: Instant from which ``time`` of points counts: the ``sweep_middle``, which is
            the instant of poses and boxes, or the ``sweep_start``.
    """

    type: Literal["pointclouds"] = "pointclouds"
    conventions: ClassVar[Conventions] = Conventions(
        time=f"{READING}; {POINT_TIME}", ring="highest laser", intensity="0 to 1"
    )
    own_classes: ClassVar[bool] = True

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    format: Literal["ply", "pcd"] = "ply"
    point_time: point_cloud_io.PointTime = "sweep_middle"

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without a laser scanner. Raises ConfigError if there is none."""
        if not info.lidars:
            raise errors.ConfigError(
                "exporter 'pointclouds': there is no lidar; add a sensor of that type"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write one file per sweep, and a line with its pose."""
        self.check(info)
        encoded = {"ply": ply_bytes, "pcd": pcd_bytes}[self.format]
        meaning = {**self.conventions.facts(), "point_time": self.point_time}
        kept = list(samples)
        for lidar in info.lidars:
            folder = shard_dir / self.type / lidar
            folder.mkdir(parents=True, exist_ok=True)
            mine = [sample for sample in kept if has_scans(shard_dir, lidar, sample.index)]
            for sample in mine:
                stored = point_cloud_io.read_points(shard_dir, lidar, sample.index)
                sweep_s = point_cloud_io.scanner_at_sweep(sample, lidar).sweep_s
                points = file_points(
                    point_cloud_io.count_times_from(self.point_time, stored, sweep_s)
                )
                path = folder / f"{sample.index:09d}.{self.format}"
                path.write_bytes(encoded(points, meaning))
            lines = "".join(canonical_json(self._pose(sample, lidar)) + "\n" for sample in mine)
            (folder / "poses.jsonl").write_text(lines, encoding="utf-8", newline="\n")

    def _pose(self, sample: Sample, lidar: str) -> dict[str, Any]:
        scanner = point_cloud_io.scanner_at_sweep(sample, lidar)
        return {
            "index": sample.index,
            "time_s": stamp_s(sample, lidar),
            "sweep_s": scanner.sweep_s,
            "point_time": self.point_time,
            "model": scanner.model,
            "T_world_lidar": reported(scanner).T_world_lidar.matrix().tolist(),
            "boxes": [
                {
                    "instance": thing.instance_id,
                    "category": thing.category,
                    "center_m": box.T_frame_box.translation_m,
                    "size_m": box.size_m,
                    "quaternion_wxyz": box.T_frame_box.quaternion_wxyz,
                }
                for thing, box in lidar_boxes(sample, lidar)
            ],
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the files of all shards and join their lines."""
        for lidar in info.lidars:
            folders = [shard_dir / self.type / lidar for shard_dir in shard_dirs]
            target = dataset_dir / lidar
            target.mkdir(parents=True, exist_ok=True)
            for folder in folders:
                for path in sorted(folder.glob(f"*.{self.format}")):
                    image_files.link_or_copy(path, target / path.name)
            lines = "".join((folder / "poses.jsonl").read_text("utf-8") for folder in folders)
            (target / "poses.jsonl").write_text(lines, encoding="utf-8", newline="\n")


def file_points(points: NDArray[np.void]) -> NDArray[np.void]:
    """Records as files hold them, one scalar per property."""
    flat: NDArray[Any] = np.zeros(len(points), FILE_POINT)
    for k, axis in enumerate("xyz"):
        flat[axis] = points["position_m"][:, k]
    flat["time"] = points["time_s"]
    flat["instance"], flat["category"] = points["instance_id"], points["category_id"]
    for name in ("intensity", "ring", "surface", "return_number", "return_count"):
        flat[name] = points[name]
    return flat


def ply_bytes(points: NDArray[np.void], statements: Mapping[str, str]) -> bytes:
    """Encode ``FILE_POINT`` records as a binary PLY file, with comments."""
    properties = [f"property {PLY_TYPES[_kind(name)]} {name}" for name in FILE_POINT.names or ()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {name}: {text}" for name, text in statements.items()),
        f"element vertex {len(points)}",
        *properties,
        "end_header",
    ]
    return ("\n".join(header) + "\n").encode("ascii") + points.tobytes()


def pcd_bytes(points: NDArray[np.void], statements: Mapping[str, str]) -> bytes:
    """Encode ``FILE_POINT`` records as a binary PCD 0.7 file, with comments."""
    names = FILE_POINT.names or ()
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        *(f"# {name}: {text}" for name, text in statements.items()),
        "VERSION 0.7",
        "FIELDS " + " ".join(names),
        "SIZE " + " ".join(PCD_TYPES[_kind(name)][0] for name in names),
        "TYPE " + " ".join(PCD_TYPES[_kind(name)][1] for name in names),
        "COUNT " + " ".join("1" for _ in names),
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(points)}",
        "DATA binary",
    ]
    return ("\n".join(header) + "\n").encode("ascii") + points.tobytes()


def lidar_boxes(sample: Sample, lidar: str) -> list[tuple[Instance, boxes.OrientedBox]]:
    """Boxes of all annotated instances in a laser scanner's frame at its sweep, by id."""
    scene = sample.scene_of(lidar)
    T_lidar_world = point_cloud_io.scanner_at_sweep(sample, lidar).T_world_lidar.inverse()
    things = sorted((i for i in scene.instances if i.annotated), key=lambda i: i.instance_id)
    return [(thing, thing.box3d.seen_from(T_lidar_world)) for thing in things]


def _kind(name: str) -> str:
    return str(FILE_POINT[name].str)
