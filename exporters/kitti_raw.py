"""KITTI raw data, synchronised and rectified: one drive per sequence.

::

    2011_09_26/calib_cam_to_cam.txt  calib_velo_to_cam.txt  calib_imu_to_velo.txt
    2011_09_26/2011_09_26_drive_0003_sync/
      image_02/data/0000000012.png          image_02/timestamps.txt     (03, and grey 00 and 01)
      velodyne_points/data/0000000012.bin   velodyne_points/timestamps{,_start,_end}.txt
      oxts/data/0000000012.txt              oxts/timestamps.txt, dataformat.txt
      tracklet_labels.xml                   3D boxes of the objects in image_02
    drives.txt                              drive, split, first sample

* A frame is an instant at which camera 02 reads; sensors that do not read then have no file,
  and line ``k`` of a ``timestamps.txt`` is the time of the ``k``-th file of its folder.
* A date has one calibration. If scenes differ in calibration (rig_calibration), each further one
  becomes the next date.
* The cameras of a drive are parallel: the images are rectified. The reference is camera 00, or 02
  without grey cameras; missing cameras have the matrices of the reference.
* Points, boxes and ``oxts`` are exact; each drive starts at noon. ``gen_data.exporters.oxts``,
  ``gen_data.exporters.tracklets`` and, for the axes of scans, ``gen_data.exporters.velodyne``
  describe their files.

Reference: Geiger et al., "Vision meets Robotics: The KITTI Dataset", IJRR 2013.
"""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.exporters import (
    base,
    image_files,
    png,
    point_cloud_io,
    sensor_selection,
    tracklets,
    velodyne,
)
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.oxts import COLUMNS, navigation_mount, oxts_row, rig_motion
from gen_data.exporters.sequences import (
    Frame,
    Mount,
    camera_mount,
    check_one_carrier,
    check_sequence_count,
    frame_facts,
    lidar_mount,
    matrix_numbers,
    read_sequences,
    relative_pose,
    timestamp,
    write_bytes,
    write_frames,
    write_text,
)

DRIVES_MAX = 10_000
"""Drive numbers have four digits."""
NOON_H = 12
CALIB_TIME = "calib_time: 01-Jan-2000 00:00:00\n"
"""Line that readers expect, but skip."""
GREY = ("00", "01")
DATE_FORMAT = "%Y_%m_%d"
Latitude = Annotated[float, Field(gt=-85, lt=85)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
PARALLEL_RAD = 1e-4
"""Largest angle between rectified cameras."""


def _check_date(text: str) -> str:
    try:
        day = datetime.strptime(text, DATE_FORMAT)
    except ValueError as error:
        raise ValueError("expected a date such as 2011_09_26") from error
    if day.strftime(DATE_FORMAT) != text:
        raise ValueError("expected a date with all its digits, such as 2011_09_26")
    return text


class KittiRaw(base.ExporterBase):
    """KITTI raw data: cameras, laser scanner, navigation and tracklets of every sequence."""

    type: Literal["kitti_raw"] = "kitti_raw"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i",
        lens=PINHOLE,
        time="UTC from noon; a sweep has its start, middle and end",
        intensity="0 to 1",
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"visibility"})
    own_classes: ClassVar[bool] = True
    date: Annotated[str, AfterValidator(_check_date)] = "2011_09_26"
    """Day of the recordings, as year_month_day."""
    image_02: str = ""
    """Left colour camera; empty = the sensor of that name, else the first camera."""
    image_03: str = ""
    """Right colour camera; empty = the sensor of that name, if any."""
    image_00: str = ""
    """Left grey camera, converted from rgb; empty = the sensor of that name, if any."""
    image_01: str = ""
    """Right grey camera, converted from rgb; empty = the sensor of that name, if any."""
    lidar: str = ""
    """Laser scanner; empty = the first one by name."""
    oxts: str = ""
    """Device whose pose the navigation rows give; empty = the rig itself."""
    origin_deg: tuple[Latitude, Longitude] = (49.01, 8.43)
    """Latitude and longitude of the world's origin."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: a sensor is missing, a camera is not a pinhole, or there are too many
                sequences.
        """
        cameras = self._cameras(info).values()
        sensor_selection.check_calibrations(info, cameras, self.type)
        if not sensor_selection.laser_scanner(info, self.lidar, self.type):
            raise ConfigError(
                f"exporter '{self.type}': there is no lidar; add a sensor of that type"
            )
        if self.oxts and self.oxts not in info.devices:
            known = ", ".join(info.devices) or "none"
            raise ConfigError(
                f"exporter '{self.type}': there is no device '{self.oxts}' for oxts; "
                f"expected one of: {known}"
            )
        check_sequence_count(info, DRIVES_MAX, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write points and grey images of each frame, and a line for it.

        Raises:
            ConfigError: see ``check``, cameras that are not parallel, or sensors on different
                carriers.
        """
        self.check(info)
        cameras = self._cameras(info)
        rows = []
        for sample in samples:
            if cameras["02"] in sample.truth:
                rows.append(self._row(info, sample, shard_dir))
                self._write_grey(cameras, sample, shard_dir)
        write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write one drive per sequence; every distinct calibration has its own date."""
        dates: dict[str, str] = {}
        drives = []
        for number, frames in read_sequences(shard_dirs, self.type).items():
            calibration = frames[0].row["calibration"]
            key = "".join(calibration[name] for name in sorted(calibration))
            day = datetime.strptime(self.date, DATE_FORMAT) + timedelta(days=len(dates))
            date = dates.setdefault(key, day.strftime(DATE_FORMAT))
            for name, text in calibration.items():
                write_text(dataset_dir / date / name, text)
            drive = f"{date}/{date}_drive_{number:04d}_sync"
            self._write_drive(info, frames, dataset_dir / drive, date)
            drives.append(f"{drive} {frames[0].row['split']} {frames[0].index}\n")
        write_text(dataset_dir / "drives.txt", "".join(drives))

    def _cameras(self, info: DatasetInfo) -> dict[str, str]:
        known = sensor_selection.rgb_cameras(info)
        asked = {
            number: getattr(self, f"image_{number}") or _if_known(known, f"image_{number}")
            for number in ("00", "01", "02", "03")
        }
        first = sensor_selection.pinhole_camera(info, asked["02"], self.type)
        rest = {
            number: sensor_selection.pinhole_camera(info, name, self.type)
            for number, name in asked.items()
            if name and number != "02"
        }
        return {"02": first, **rest}

    def _row(self, info: DatasetInfo, sample: Sample, shard_dir: Path) -> dict[str, Any]:
        cameras = self._cameras(info)
        lidar = sensor_selection.laser_scanner(info, self.lidar, self.type)
        mounts = {name: camera_mount(sample.scene, name) for name in cameras.values()}
        mounts[lidar] = lidar_mount(sample.scene, lidar)
        check_one_carrier(info, self.type, mounts)
        carrier = camera_mount(sample.scene, cameras["02"]).rig
        unit = navigation_mount(sample.scene, self.oxts, carrier, self.type)
        truly = navigation_mount(sample.scene, self.oxts, carrier, self.type, true=True)
        turn = velodyne.turn_to_camera(sample.scene, lidar, cameras["02"])
        row = frame_facts(info, sample) | {
            "time_s": sensor_selection.stamp_s(sample, self.oxts),
            "cameras": {
                number: sensor_selection.stamp_s(sample, name)
                for number, name in cameras.items()
                if name in sample.truth
            },
            "scan": None,
            "oxts": oxts_row(rig_motion(sample.scene, truly), self.origin_deg),
            "boxes": tracklets.frame_boxes(sample, cameras["02"], lidar, turn),
            "calibration": calibration_texts(sample, cameras, lidar, unit),
        }
        if sensor_selection.has_scans(shard_dir, lidar, sample.index):
            points = point_cloud_io.read_points(shard_dir, lidar, sample.index)
            path = shard_dir / self.type / f"velodyne/{sample.index:09d}.bin"
            write_bytes(path, velodyne.scan_bytes(points, turn))
            row["scan"] = sweep_times_s(points, sensor_selection.stamp_s(sample, lidar))
        return row

    def _write_grey(self, cameras: Mapping[str, str], sample: Sample, shard_dir: Path) -> None:
        for number in GREY:
            name = cameras.get(number, "")
            if name in sample.truth:
                image = cv2.imread(str(media_path(shard_dir, name, Channel.RGB, sample.index)))
                path = shard_dir / self.type / f"image_{number}/{sample.index:09d}.png"
                assert image is not None, "images are written before labels"
                write_bytes(path, png.encode_png(luma(image[..., ::-1]), png.RowFilter.SUB, 1))

    def _write_drive(
        self, info: DatasetInfo, frames: Sequence[Frame], folder: Path, date: str
    ) -> None:
        noon = datetime.strptime(date, DATE_FORMAT) + timedelta(hours=NOON_H)

        def write_times(name: str, instants_s: Iterable[float]) -> None:
            lines = (timestamp(noon, time_s) + "\n" for time_s in instants_s)
            write_text(folder / name, "".join(lines))

        for number, camera in self._cameras(info).items():
            write_times(f"image_{number}/timestamps.txt", _instants(frames, number))
            for k, frame in enumerate(frames):
                if number in frame.row["cameras"]:
                    target = folder / f"image_{number}/data/{k:010d}.png"
                    image_files.link_or_copy(self._image(frame, number, camera), target)
        scans = [frame.row["scan"] for frame in frames if frame.row["scan"]]
        for i, name in enumerate(("timestamps_start.txt", "timestamps.txt", "timestamps_end.txt")):
            write_times(f"velodyne_points/{name}", (scan[i] for scan in scans))
        write_times("oxts/timestamps.txt", (frame.row["time_s"] for frame in frames))
        write_text(folder / "oxts/dataformat.txt", COLUMNS)
        for k, frame in enumerate(frames):
            write_text(folder / f"oxts/data/{k:010d}.txt", frame.row["oxts"] + "\n")
            if frame.row["scan"]:
                source = frame.shard_dir / self.type / f"velodyne/{frame.index:09d}.bin"
                image_files.link_or_copy(source, folder / f"velodyne_points/data/{k:010d}.bin")
        boxes = tracklets.tracklets_text([frame.row["boxes"] for frame in frames])
        write_text(folder / "tracklet_labels.xml", boxes)

    def _image(self, frame: Frame, number: str, camera: str) -> Path:
        if number in GREY:
            return frame.shard_dir / self.type / f"image_{number}/{frame.index:09d}.png"
        return media_path(frame.shard_dir, camera, Channel.RGB, frame.index)


def calibration_texts(
    sample: Sample, cameras: Mapping[str, str], lidar: str, unit: Mount
) -> dict[str, str]:
    """Texts of the three calibration files of a date, by name."""
    scene = sample.scene
    reference = camera_mount(scene, cameras.get("00", cameras["02"]))
    turn = velodyne.turn_to_camera(scene, lidar, cameras["02"])
    scanner = velodyne.turned_mount(scene, lidar, turn)
    return {
        "calib_cam_to_cam.txt": cameras_text(scene, cameras, reference, "kitti_raw"),
        "calib_velo_to_cam.txt": _rigid_text(relative_pose(scene, reference, scanner))
        + "delta_f: 0.000000e+00 0.000000e+00\ndelta_c: 0.000000e+00 0.000000e+00\n",
        "calib_imu_to_velo.txt": _rigid_text(relative_pose(scene, scanner, unit)),
    }


def sweep_times_s(points: NDArray[np.void], time_s: float) -> list[float]:
    """Start, reference and end of a sweep [s]; all equal for an instantaneous sweep."""
    last_s = float(points["time_s"].max(initial=0.0))
    return [round(v, 9) for v in (time_s - 0.5 * last_s, time_s, time_s + 0.5 * last_s)]


def luma(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Convert RGB to grey with the weights of Rec. ITU-R BT.601, in 65536ths."""
    weighted = image.astype(np.uint32) @ np.array([19_595, 38_470, 7_471], np.uint32)
    grey: NDArray[np.uint8] = ((weighted + 32_768) >> 16).astype(np.uint8)
    return grey


def projection(camera: Intrinsics, shift_m: Vec3) -> Array:
    """Projection matrix ``P``, [3, 4], of a camera; pixel centres are integers.

    Args:
        camera: Intrinsics.
        shift_m: Position of the reference camera in the camera's frame.
    """
    K = camera.matrix()
    K[:2, 2] -= 0.5
    # einsum keeps one order of summation; BLAS may not.
    return np.column_stack([K, np.einsum("ij,j->i", K, np.array(shift_m), optimize=False)])


def cameras_text(scene: Scene, cameras: Mapping[str, str], reference: Mount, exporter: str) -> str:
    """Format ``calib_cam_to_cam.txt``.

    Args:
        scene: Scene at the instant of the images.
        cameras: Sensors by KITTI's number, including 02.
        reference: Mount of the reference camera.
        exporter: Name in the error text.

    Raises:
        ConfigError: the cameras are not parallel.
    """
    text = CALIB_TIME + "corner_dist: 0.000000e+00\n"
    for number in ("00", "01", "02", "03"):
        name = cameras.get(number, cameras.get("00", cameras["02"]))
        pose = relative_pose(scene, camera_mount(scene, name), reference)
        if 2.0 * float(np.linalg.norm(pose.quaternion_wxyz[1:])) > PARALLEL_RAD:
            raise ConfigError(
                f"exporter '{exporter}': camera '{name}' is not parallel to the reference camera, "
                "but KITTI's images are rectified; give both the same yaw, pitch and roll"
            )
        text += _camera_text(number, scene.camera(name).intrinsics, pose)
    return text


def _camera_text(number: str, camera: Intrinsics, T_camera_reference: SE3) -> str:
    shift_m = T_camera_reference.translation_m
    P = projection(camera, shift_m)
    size_px = np.array([camera.width_px, camera.height_px], float)
    lines: dict[str, Array] = {
        "S": size_px,
        "K": P[:, :3],
        "D": np.zeros(5),
        "R": np.eye(3),
        "T": np.array(shift_m),
        "S_rect": size_px,
        "R_rect": np.eye(3),
        "P_rect": P,
    }
    return "".join(f"{name}_{number}: {matrix_numbers(values)}\n" for name, values in lines.items())


def _rigid_text(pose: SE3) -> str:
    rotation = matrix_numbers(pose.rotation())
    translation = matrix_numbers(np.array(pose.translation_m))
    return f"{CALIB_TIME}R: {rotation}\nT: {translation}\n"


def _instants(frames: Sequence[Frame], number: str) -> list[float]:
    times = (frame.row["cameras"].get(number) for frame in frames)
    return [time_s for time_s in times if time_s is not None]


def _if_known(known: Sequence[str], name: str) -> str:
    return name if name in known else ""
