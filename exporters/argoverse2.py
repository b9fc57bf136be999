"""Argoverse 2: sensors, poses, boxes and the vector map of every sequence.

::

    <split>/<log>/calibration/{egovehicle_SE3_sensor,intrinsics}.feather
    <split>/<log>/city_SE3_egovehicle.feather          poses at the instants of all readings
    <split>/<log>/annotations.feather                  boxes in the ego's frame at each sweep
    <split>/<log>/sensors/lidar/<time>.feather         points in the ego's frame
    <split>/<log>/sensors/cameras/<camera>/<time>.jpg  links to the photographs
    <split>/<log>/map/log_map_archive_<log>____GEN_city_0.json

A log is a sequence, ``<name>-000012``. Times are nanoseconds; sequences begin on 2020-01-01, one
after the other. The city is the world, the ego the rig that carries the scanner. Files are Arrow
IPC ("feather"). Cameras keep their names; the devkit's are ``ring_front_center`` and alike. It
lists ``.jpg`` only: use ``rgb_encoding: {format: jpeg}``; PNG files keep their ending.

* **The scanner** has the names ``up_lidar`` and ``down_lidar``, of which the devkit requires both.
* **Points** are ``x y z`` (float32), ``intensity`` (0 to 255), ``laser_number`` and ``offset_ns``,
  from the file's instant, the middle of the sweep. They are where the scanner reports them:
  ``motion_distortion: none`` gives sweeps without the ego's motion.
* **Boxes** are where objects are at that instant; ``num_interior_pts`` counts hits of the object.
  Objects have classes by ``nuscenes_classes.yaml``; without a class here they are left out.
* **Map**: lanes with marks read from the paint, links and neighbours; crosswalks; drivable areas
  from kerb to kerb, cut where they have holes. Not written: the raster of ground heights.

Reference: Wilson et al., "Argoverse 2", NeurIPS Datasets and Benchmarks 2021, and av2-api.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.se3 import SE3
from gen_data.exporters import base, image_files, nuscenes_classes, sensor_selection
from gen_data.exporters.argoverse_map import argoverse_map
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.nuscenes_frames import annotated_things, rig_pose_at
from gen_data.exporters.nuscenes_recording import PAUSE_US, START_US
from gen_data.exporters.point_cloud_io import read_points
from gen_data.exporters.road_map import road_map
from gen_data.exporters.sequences import (
    Frame,
    Mount,
    camera_mount,
    check_one_carrier,
    frame_facts,
    lidar_mount,
    read_sequences,
    relative_pose,
    write_bytes,
    write_frames,
    write_json,
)

CLASSES: Mapping[str, str] = {
    "animal": "ANIMAL",
    "human.pedestrian.adult": "PEDESTRIAN",
    "human.pedestrian.child": "PEDESTRIAN",
    "human.pedestrian.construction_worker": "PEDESTRIAN",
    "human.pedestrian.personal_mobility": "WHEELED_DEVICE",
    "human.pedestrian.police_officer": "PEDESTRIAN",
    "human.pedestrian.stroller": "STROLLER",
    "human.pedestrian.wheelchair": "WHEELCHAIR",
    "movable_object.trafficcone": "CONSTRUCTION_CONE",
    "vehicle.bicycle": "BICYCLE",
    "vehicle.bus.bendy": "ARTICULATED_BUS",
    "vehicle.bus.rigid": "BUS",
    "vehicle.car": "REGULAR_VEHICLE",
    "vehicle.construction": "LARGE_VEHICLE",
    "vehicle.emergency.ambulance": "LARGE_VEHICLE",
    "vehicle.emergency.police": "REGULAR_VEHICLE",
    "vehicle.motorcycle": "MOTORCYCLE",
    "vehicle.trailer": "VEHICULAR_TRAILER",
    "vehicle.truck": "TRUCK",
}
"""Classes by category of nuScenes."""
POSE = ("qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m")
SIZES = ("length_m", "width_m", "height_m")
INTRINSICS = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "k3", "height_px", "width_px")
LIDARS = ("down_lidar", "up_lidar")
"""Names of the scanners, which the devkit requires."""
CITY = "GEN"

Row = dict[str, Any]


class Argoverse2(base.AssetExporter):
    """Argoverse 2 sensor data set: images, scans, poses, boxes and vector maps."""

    type: Literal["argoverse2"] = "argoverse2"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i",
        lens=PINHOLE,
        time="ns; middle of the exposure or sweep",
        ring="highest laser",
        intensity="0 to 255",
    )
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    lidar: str = ""
    """Laser scanner; empty = the first one by name."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there is no laser scanner, a camera is not a pinhole, no category has a
                class in this format, or a package is missing.
        """
        base.check_installed(self.type, "pyarrow", "shapely")
        if not sensor_selection.laser_scanner(info, self.lidar, self.type):
            raise ConfigError(
                f"exporter '{self.type}': there is no lidar; add a sensor of that type, such as "
                "{type: lidar, name: up_lidar, model: VLP-32C}"
            )
        sensor_selection.check_pinholes(info, sensor_selection.rgb_cameras(info), self.type)
        things = nuscenes_classes.classes().things.items()
        known = [ours for ours, theirs in things if theirs in CLASSES and "/" not in ours]
        base.check_classes(self.type, info, known)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write scans and maps, and a line per sample. Raises ConfigError as ``check`` does."""
        self.check(info)
        lidar, folder = (
            sensor_selection.laser_scanner(info, self.lidar, self.type),
            shard_dir / self.type,
        )
        rows = []
        mapped: set[int] = set()
        for sample in samples:
            if sample.scene_index not in mapped:
                mapped.add(sample.scene_index)
                roads = argoverse_map(road_map(sample.scene, self.library))
                write_json(folder / _map_file(sample.scene_index), roads)
            row = _row(info, sample, lidar)
            if sensor_selection.has_scans(shard_dir, lidar, sample.index):
                points = read_points(shard_dir, lidar, sample.index)
                T_ego_lidar = _pose_of(row["mounts"][lidar])
                sweep_s = sample.scene.lidar(lidar).sweep_s
                path = folder / f"{sample.index:09d}.feather"
                write_bytes(path, scan_bytes(points, T_ego_lidar, sweep_s))
                row["scan"] = True
                row["boxes"] = list(_boxes(sample, lidar, points))
            rows.append(row)
        write_frames(folder, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the tables of every log, and link images, scans and maps."""
        for number, frames in read_sequences(shard_dirs, self.type).items():
            log = f"{info.name}-{number:06d}"
            self._write_log(info, frames, dataset_dir / frames[0].row["split"] / log)

    def _write_log(self, info: DatasetInfo, frames: Sequence[Frame], folder: Path) -> None:
        number = int(frames[0].row["sequence"])
        mounts: dict[str, Row] = {}
        lenses: dict[str, Row] = {}
        egos: dict[int, Row] = {}
        boxes: list[Row] = []
        for frame in frames:
            mounts |= frame.row["mounts"]
            lenses |= frame.row["lenses"]
            for sensor, ego in frame.row["egos"].items():
                time_ns = time_ns_of(info, number, ego["time_s"])
                egos[time_ns] = ego["pose"]
                if sensor in frame.row["lenses"]:
                    suffix = info.encoding(sensor, Channel.RGB).suffix
                    image = {"sensor": sensor, "sample": frame.index}
                    target = folder / f"sensors/cameras/{sensor}/{time_ns}{suffix}"
                    image_files.link_photograph(info, frame.shard_dir, image, target)
                elif frame.row["scan"]:
                    source = frame.shard_dir / self.type / f"{frame.index:09d}.feather"
                    target = folder / f"sensors/lidar/{time_ns}.feather"
                    image_files.link_or_copy(source, target)
                    boxes += [{"timestamp_ns": time_ns, **box} for box in frame.row["boxes"]]
        world = frames[0].row["scene"]
        target = folder / f"map/log_map_archive_{folder.name}____{CITY}_city_{world}.json"
        image_files.link_or_copy(frames[0].shard_dir / self.type / _map_file(world), target)
        scanner = mounts.pop(sensor_selection.laser_scanner(info, self.lidar, self.type))
        mounts |= dict.fromkeys(LIDARS, scanner)
        poses = [{"sensor_name": name, **mounts[name]} for name in sorted(mounts)]
        _write_table(folder / "calibration/egovehicle_SE3_sensor.feather", poses, POSE)
        seen = [{"sensor_name": name, **lenses[name]} for name in sorted(lenses)]
        _write_table(folder / "calibration/intrinsics.feather", seen, INTRINSICS)
        track = [{"timestamp_ns": time_ns, **egos[time_ns]} for time_ns in sorted(egos)]
        _write_table(folder / "city_SE3_egovehicle.feather", track, POSE)
        columns = ("track_uuid", "category", *SIZES, *POSE, "num_interior_pts")
        _write_table(folder / "annotations.feather", boxes, columns)


def scan_bytes(points: NDArray[np.void], T_ego_lidar: SE3, sweep_s: float) -> bytes:
    """Encode a sweep; ``points`` are records of ``POINT`` [n]."""
    import pyarrow as pa

    x, y, z = T_ego_lidar.apply(points["position_m"].astype(np.float64)).astype(np.float32).T
    offset_ns = np.rint((points["time_s"] - 0.5 * sweep_s) * 1e9).astype(np.int32)
    return feather_bytes(
        {
            "x": pa.array(x),
            "y": pa.array(y),
            "z": pa.array(z),
            "intensity": pa.array(np.rint(255.0 * points["intensity"]).astype(np.uint8)),
            "laser_number": pa.array(points["ring"].astype(np.uint8)),
            "offset_ns": pa.array(offset_ns),
        }
    )


def feather_bytes(columns: Mapping[str, Any]) -> bytes:
    """Encode columns as an Arrow file, uncompressed: bytes of codecs depend on their build."""
    import pyarrow as pa
    from pyarrow import ipc

    table = pa.table(dict(columns))
    sink = pa.BufferOutputStream()
    with ipc.new_file(sink, table.schema) as writer:
        writer.write_table(table)
    data: bytes = sink.getvalue().to_pybytes()
    return data


def _write_table(path: Path, rows: Sequence[Row], columns: Sequence[str]) -> None:
    """Write rows; the first column is ``timestamp_ns`` or ``sensor_name``."""
    import pyarrow as pa

    texts, whole = {"sensor_name", "track_uuid", "category"}, {"timestamp_ns", "num_interior_pts"}
    whole |= {"height_px", "width_px"}
    first = "sensor_name" if path.parent.name == "calibration" else "timestamp_ns"
    made = {}
    for name in (first, *columns):
        kind = pa.string() if name in texts else pa.int64() if name in whole else pa.float64()
        made[name] = pa.array([row[name] for row in rows], kind)
    write_bytes(path, feather_bytes(made))


def _map_file(world: int) -> str:
    return f"maps/{world:06d}.json"


def time_ns_of(info: DatasetInfo, number: int, time_s: float) -> int:
    """Stamp [ns] of an instant of the sequence of a number."""
    whole_s = -(-info.steps_per_scene * info.step_s // 1)
    start_us = START_US + PAUSE_US + number * (int(whole_s) * 1_000_000 + PAUSE_US)
    return start_us * 1000 + round(time_s * 1e9)


def _pose_row(pose: SE3) -> Row:
    pose = pose.rounded(9)
    return dict(zip(POSE, (*pose.quaternion_wxyz, *pose.translation_m), strict=True))


def _pose_of(row: Mapping[str, float]) -> SE3:
    w, x, y, z, tx, ty, tz = (row[name] for name in POSE)
    return SE3((tx, ty, tz), (w, x, y, z))


def _row(info: DatasetInfo, sample: Sample, lidar: str) -> Row:
    """Line of a sample: mounts of the sensors, lenses, and the ego at the readings."""
    scene = sample.scene
    scanner = lidar_mount(scene, lidar)
    ego, cameras = scanner.rig, sensor_selection.rgb_cameras(info)
    on_rigs = {lidar: scanner} | {name: camera_mount(scene, name) for name in cameras}
    check_one_carrier(info, "argoverse2", on_rigs)
    mounts = {lidar: relative_pose(scene, Mount(ego, SE3()), scanner)}
    lenses = {}
    read = {lidar: sensor_selection.stamp_s(sample, lidar)}
    for name in cameras:
        if name in sample.truth:
            mounts[name] = relative_pose(scene, Mount(ego, SE3()), on_rigs[name])
            lens = sample.truth[name].camera.intrinsics
            values = (lens.fx_px, lens.fy_px, lens.cx_px - 0.5, lens.cy_px - 0.5, 0.0, 0.0, 0.0,
                      lens.height_px, lens.width_px)  # fmt: skip
            lenses[name] = dict(zip(INTRINSICS, values, strict=True))
            read[name] = sensor_selection.stamp_s(sample, name)
    return frame_facts(info, sample) | {
        "scene": sample.scene_index,
        "mounts": {name: _pose_row(pose) for name, pose in mounts.items()},
        "lenses": lenses,
        "egos": {
            name: {"time_s": time_s, "pose": _pose_row(rig_pose_at(scene, ego, time_s))}
            for name, time_s in read.items()
        },
        "scan": False,
        "boxes": [],
    }


def _boxes(sample: Sample, lidar: str, points: NDArray[np.void]) -> Iterable[Row]:
    """Boxes in the ego's frame at the true instant of a sweep: they fit its points."""
    time_s, ego = sensor_selection.instant_s(sample, lidar), lidar_mount(sample.scene, lidar).rig
    T_ego_world = rig_pose_at(sample.scene, ego, time_s).rounded(9).inverse()
    counts = np.bincount(points["instance_id"].astype(np.int64), minlength=1)
    own = _ego_instance(sample, lidar)
    for number, thing in annotated_things(sample).items():
        category = CLASSES.get(thing.category)
        if category is None or number == own:
            continue
        box = thing.box(time_s, 0.0)
        sizes = dict(zip(SIZES, (round(v, 6) for v in box.size_m), strict=True))
        yield {
            "track_uuid": f"{sample.scene_index:06d}-{sample.view_index:03d}-{number:05d}",
            "category": category,
            **sizes,
            **_pose_row(T_ego_world @ box.T_frame_box),
            "num_interior_pts": int(counts[number]) if number < len(counts) else 0,
        }


def _ego_instance(sample: Sample, lidar: str) -> int:
    rig = lidar_mount(sample.scene, lidar).rig
    body = "" if rig.startswith("/") else sample.scene.rig(rig).body
    return sample.scene.body(body).instance_id if body else 0
