"""KITTI tracking: one sequence per view, labels with persistent ids.

::

    training/image_02/0003/000012.png    training/label_02/0003.txt
    training/image_03/0003/000012.png    training/calib/0003.txt
    training/velodyne/0003/000012.bin    training/oxts/0003.txt
    training/evaluate_tracking.seqmap.training   all sequences, with their number of frames
    training/evaluate_tracking.seqmap.train      sequences of a split; also val, test

A frame is an instant at which camera 02 reads, numbered without gaps: after a frame that is
missing, another sequence starts, numbered behind all views. Labels have 17 columns,
separated by blanks: ``frame track_id type truncated occluded alpha left top right bottom h w l x y
z rotation_y``. They equal the rows of the exporter ``kitti``, but objects without laser points keep
their labels, ``track_id`` is the instance id (-1 for DontCare), ``truncated`` is 0, 1 or 2, and
sitting people are ``Person``, as in KITTI's evaluation code. X of the points is ahead of camera 02
(``gen_data.exporters.velodyne``).

Reference: Geiger et al., "Are we ready for Autonomous Driving?", CVPR 2012, and the readme of the
tracking development kit; TrackEval reads the folder ``training`` as it is.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.core.scene import Scene
from gen_data.exporters import image_files, kitti, sequences, velodyne
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.kitti_raw import Latitude, Longitude, projection
from gen_data.exporters.oxts import navigation_mount, oxts_row, rig_motion
from gen_data.exporters.point_cloud_io import read_points
from gen_data.exporters.sensor_selection import (
    check_calibrations,
    has_scans,
    laser_scanner,
    pinhole_camera,
)

SEQUENCES_MAX = 10_000
"""Names of sequences have four digits."""
SLIGHTLY_TRUNCATED, LARGELY_TRUNCATED = 0.15, 0.5
"""Fractions outside above which ``truncated`` is 1 and 2: KITTI's easy and hard limits."""


class KittiTracking(kitti.KittiLabels):
    """KITTI tracking: images, labels, scans and navigation of every sequence."""

    type: Literal["kitti_tracking"] = "kitti_tracking"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i",
        box="first and last pixel (i), of the projected 3D box, or of annotated figures",
        lens=PINHOLE,
        time="number of the frame",
        intensity="0 to 1",
    )
    camera: str = ""
    """Sensor that becomes camera 02; empty = the first one, by name, with the rgb channel."""
    right_camera: str = ""
    """Sensor that becomes camera 03; empty = none."""
    lidar: str = ""
    """Laser scanner; empty = the first one by name, if any."""
    oxts: str = ""
    """Device whose pose the navigation rows give; empty = the rig itself."""
    origin_deg: tuple[Latitude, Longitude] = (49.01, 8.43)
    """Latitude and longitude of the world's origin."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: a sensor is not there, a camera is not a pinhole, two categories are
                written alike, or there are too many sequences.
        """
        check_calibrations(info, self._cameras(info).values(), self.type)
        laser_scanner(info, self.lidar, self.type)
        self.check_types(info, self.type)
        sequences.check_sequence_count(info, SEQUENCES_MAX, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the points of each frame, and a line with its labels."""
        self.check(info)
        camera, lidar = self._cameras(info)["02"], laser_scanner(info, self.lidar, self.type)
        rows = []
        for sample in samples:
            if camera not in sample.truth:
                continue
            rows.append(self._row(info, sample))
            if has_scans(shard_dir, lidar, sample.index):
                points = read_points(shard_dir, lidar, sample.index)
                turn = velodyne.turn_to_camera(sample.scene, lidar, camera)
                path = shard_dir / self.type / f"velodyne/{sample.index:09d}.bin"
                sequences.write_bytes(path, velodyne.scan_bytes(points, turn))
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link images and scans, join labels, and list the sequences."""
        folder = dataset_dir / "training"
        seqmaps: dict[str, list[str]] = {"training": [], "train": [], "val": [], "test": []}
        for number, frames in sequences.even_sequences(info, shard_dirs, self.type).items():
            name = f"{number:04d}"
            self._write_sequence(info, frames, folder, name)
            for split in ("training", frames[0].row["split"]):
                line = f"{name} empty 000000 {len(frames):06d}\n"
                seqmaps.setdefault(split, []).append(line)
        for split, lines in seqmaps.items():
            sequences.write_text(folder / f"evaluate_tracking.seqmap.{split}", "".join(lines))

    def _cameras(self, info: DatasetInfo) -> dict[str, str]:
        cameras = {"02": pinhole_camera(info, self.camera, self.type)}
        if self.right_camera:
            cameras["03"] = pinhole_camera(info, self.right_camera, self.type)
        return cameras

    def _row(self, info: DatasetInfo, sample: Sample) -> dict[str, Any]:
        cameras, scene = self._cameras(info), sample.scene
        mounts = {name: sequences.camera_mount(scene, name) for name in cameras.values()}
        if lidar := laser_scanner(info, self.lidar, self.type):
            mounts[lidar] = sequences.lidar_mount(scene, lidar)
        sequences.check_one_carrier(info, self.type, mounts)
        carrier = sequences.camera_mount(scene, cameras["02"]).rig
        unit = navigation_mount(scene, self.oxts, carrier, self.type)
        truly = navigation_mount(scene, self.oxts, carrier, self.type, true=True)
        truth = sample.truth[cameras["02"]]
        things = {thing.instance.instance_id: thing for thing in truth.objects}
        return sequences.frame_facts(info, sample) | {
            "cameras": [number for number, name in cameras.items() if name in sample.truth],
            "oxts": oxts_row(rig_motion(scene, truly), self.origin_deg),
            "calib": calib_text(scene, cameras, lidar, unit),
            "labels": [
                tracking_label(row, things[instance_id])
                for row, instance_id in kitti.label_rows(truth, self)
            ],
        }

    def _write_sequence(
        self, info: DatasetInfo, frames: Sequence[sequences.Frame], folder: Path, name: str
    ) -> None:
        labels = [f"{k} {row}\n" for k, frame in enumerate(frames) for row in frame.row["labels"]]
        sequences.write_text(folder / f"label_02/{name}.txt", "".join(labels))
        sequences.write_text(
            folder / f"oxts/{name}.txt", "".join(f.row["oxts"] + "\n" for f in frames)
        )
        sequences.write_text(folder / f"calib/{name}.txt", frames[0].row["calib"])
        for k, frame in enumerate(frames):
            for number, camera in self._cameras(info).items():
                if number in frame.row["cameras"]:
                    source = media_path(frame.shard_dir, camera, Channel.RGB, frame.index)
                    image_files.link_or_copy(source, folder / f"image_{number}/{name}/{k:06d}.png")
            scan = frame.shard_dir / self.type / f"velodyne/{frame.index:09d}.bin"
            if scan.exists():
                image_files.link_or_copy(scan, folder / f"velodyne/{name}/{k:06d}.bin")


def tracking_label(row: str, thing: ObjectTruth) -> str:
    """Convert a row of ``label_2`` to the columns after the frame's number."""
    kind, _, *rest = row.split(" ")
    if kind == "DontCare":
        return f"-1 {row}"
    assert thing.truncation is not None, "the annotation visibility is in `needs`"
    kind = "Person" if kind == "Person_sitting" else kind
    columns = (thing.instance.instance_id, kind, truncation_level(thing.truncation), *rest)
    return " ".join(map(str, columns))


def truncation_level(truncation: float) -> int:
    """KITTI's level 0, 1 or 2, by the fraction of the silhouette outside the image."""
    return int(truncation > SLIGHTLY_TRUNCATED) + int(truncation > LARGELY_TRUNCATED)


def calib_text(scene: Scene, cameras: Mapping[str, str], lidar: str, unit: sequences.Mount) -> str:
    """Format the seven lines of a sequence's calibration; camera 02 is the reference.

    Without a laser scanner, the camera's frame takes the place of the scanner's.
    """
    reference = sequences.camera_mount(scene, cameras["02"])
    scanner = reference
    if lidar:
        turn = velodyne.turn_to_camera(scene, lidar, cameras["02"])
        scanner = velodyne.turned_mount(scene, lidar, turn)
    T_camera_velo = sequences.relative_pose(scene, reference, scanner).matrix()[:3]
    T_velo_imu = sequences.relative_pose(scene, scanner, unit).matrix()[:3]
    lines = []
    for k in range(4):
        name = cameras.get(f"{k:02d}", cameras["02"])
        shift_m = sequences.relative_pose(
            scene, sequences.camera_mount(scene, name), reference
        ).translation_m
        P = projection(scene.camera(name).intrinsics, shift_m)
        lines.append(f"P{k}: {sequences.matrix_numbers(P)}\n")
    lines.append(f"R_rect {sequences.matrix_numbers(np.eye(3))}\n")
    lines.append(f"Tr_velo_cam {sequences.matrix_numbers(T_camera_velo)}\n")
    lines.append(f"Tr_imu_velo {sequences.matrix_numbers(T_velo_imu)}\n")
    return "".join(lines)
