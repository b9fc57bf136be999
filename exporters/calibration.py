"""The calibration of every camera in the files of common tools.

::

    0000/opencv/left.yml           camera matrix and distortion (cv::FileStorage)
    0000/ros/left.yaml             camera_info
    0000/kalibr/rig.yaml           camera chain of a rig, or of a camera without one; with its IMU
    samples.csv                    index, split and number of the calibration of every sample
    colmap/000000/cameras.txt      COLMAP model of a scene: cameras, images.txt with a pose for
                                   every photograph in images/, and an empty points3D.txt

* Every distinct calibration has a number: there are several if randomizers vary lenses or mounts.
* In COLMAP's files pixel centres are at halves, as in this project; in all others at integers:
  their principal points are smaller by 0.5.
* Coefficients are the lens's: Brown and Conrady's are ``plumb_bob`` or
  ``rational_polynomial`` of ROS and ``radtan`` of Kalibr, which lacks k3 to k6; Kannala and
  Brandt's are OpenCV's ``fisheye`` and ``equidistant``. Values that a format lacks are left out,
  with a comment in their place. Panoramas are left out.

``gen_data.sensors.calibration`` reads these files.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import capture, errors, serialization
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.reported import reported
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.exporters import base, image_files, sensor_selection, sequences
from gen_data.exporters.calibration_texts import (
    camera_info_text,
    colmap_camera,
    kalibr_text,
    opencv_text,
)
from gen_data.exporters.conventions import Conventions

PANORAMA = "equirectangular"


class CalibrationFiles(base.ExporterBase):
    """Calibration of every camera for OpenCV, ROS, Kalibr and COLMAP; poses for COLMAP."""

    type: Literal["calibration"] = "calibration"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i; i + 0.5 in `colmap`", lens="any except panoramas"
    )
    image_formats = base.ANY_FORMAT

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without a camera that has a calibration.

        Raises:
            ConfigError: there is no camera, or only panoramas.
        """
        if not _cameras(info):
            raise errors.ConfigError(
                f"exporter '{self.type}': no camera has a calibration; add an rgb_camera whose "
                "lens is not a panorama"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line with the calibration and the poses of every sample."""
        self.check(info)
        sequences.write_frames(shard_dir / self.type, [_row(info, sample) for sample in samples])

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write every distinct calibration, the number of each sample's, and COLMAP's models."""
        numbers: dict[str, int] = {}
        table = ["index,split,calibration\n"]
        models: dict[int, _Model] = {}
        for frames in sequences.read_sequences(shard_dirs, self.type).values():
            for frame in frames:
                row = frame.row
                key = serialization.canonical_json(row["texts"])
                if key not in numbers:
                    numbers[key] = len(numbers)
                    for name, text in row["texts"].items():
                        sequences.write_text(dataset_dir / f"{numbers[key]:04d}/{name}", text)
                table.append(f"{row['index']},{row['split']},{numbers[key]}\n")
                models.setdefault(row["scene"], _Model()).add(row["images"])
                for image in row["images"]:
                    source = info.media_path(
                        frame.shard_dir, image["eye"], capture.Channel.RGB, frame.index
                    )
                    folder = dataset_dir / f"colmap/{row['scene']:06d}/images"
                    image_files.link_or_copy(source, folder / image["name"])
        sequences.write_text(dataset_dir / "samples.csv", "".join(table))
        for scene, model in models.items():
            model.write(dataset_dir / f"colmap/{scene:06d}")


class _Model:
    """COLMAP's model of one scene: cameras are numbered from 1 as they appear, images too."""

    def __init__(self) -> None:
        self.cameras: dict[str, int] = {}
        self.images: list[str] = []

    def add(self, images: Sequence[Mapping[str, str]]) -> None:
        for image in images:
            camera = self.cameras.setdefault(image["camera"], len(self.cameras) + 1)
            number = len(self.images) + 1
            # The second line lists points, of which there are none.
            self.images.append(f"{number} {image['pose']} {camera} {image['name']}\n\n")

    def write(self, folder: Path) -> None:
        cameras = "".join(f"{k} {text}\n" for text, k in self.cameras.items())
        sequences.write_text(
            folder / "cameras.txt", f"# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n{cameras}"
        )
        head = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D[] on a line\n"
        sequences.write_text(folder / "images.txt", head + "".join(self.images))
        sequences.write_text(folder / "points3D.txt", "")


def _cameras(info: DatasetInfo) -> tuple[str, ...]:
    return tuple(name for name in info.cameras if info.sensor(name).lens != PANORAMA)


def _row(info: DatasetInfo, sample: Sample) -> dict[str, Any]:
    """Texts of the files by name, and photographs with their poses."""
    images, photographed = [], sensor_selection.rgb_cameras(info)
    for name in _cameras(info):
        if name in sample.truth and name in photographed:
            camera = sample.scene_of(name).camera(name)
            eye = reported(camera).T_world_camera.inverse()
            pose = " ".join(
                repr(round(v, 12) + 0.0) for v in (*eye.quaternion_wxyz, *eye.translation_m)
            )
            file = f"{name}/{info.media_path(Path(), name, capture.Channel.RGB, sample.index).name}"
            text = colmap_camera(camera.intrinsics)
            images.append({"eye": name, "camera": text, "pose": pose, "name": file})
    texts = calibration_texts(sample.scene, _cameras(info))
    return {**sequences.frame_facts(info, sample), "scene": sample.scene_index, "texts": texts,
            "images": images}  # fmt: skip


def calibration_texts(scene: Scene, cameras: Sequence[str]) -> dict[str, str]:
    """Contents of the files of one calibration, by path."""
    texts: dict[str, str] = {}
    chains: dict[str, list[str]] = {}
    for name in cameras:
        lens = scene.camera(name).intrinsics
        texts[f"opencv/{name}.yml"] = opencv_text(lens)
        texts[f"ros/{name}.yaml"] = camera_info_text(name, lens)
        chains.setdefault(scene.camera(name).rig or name, []).append(name)
    for rig, chain in chains.items():
        imu = next((d.name for d in scene.devices if d.rig == rig and d.kind == "imu"), "")
        texts[f"kalibr/{rig.replace('/', '_')}.yaml"] = _chain_text(scene, chain, imu)
    return texts


def _chain_text(scene: Scene, chain: Sequence[str], imu: str) -> str:
    mounts = [sequences.camera_mount(scene, name) for name in chain]
    steps = [None, *(sequences.relative_pose(scene, b, a) for a, b in pairwise(mounts))]
    unit = sequences.device_mount(scene, imu) if imu else None
    poses = [sequences.relative_pose(scene, mount, unit) if unit else None for mount in mounts]
    lenses = [scene.camera(name).intrinsics for name in chain]
    return kalibr_text(list(zip(chain, lenses, steps, poses, strict=True)))
