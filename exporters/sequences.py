"""What formats of sequences have in common: frames that belong together, times, calibration.

A sequence is all instants of one view of one scene, number ``index // steps_per_scene`` of the data
set. Its frames are the instants at which the camera (or scanner) that a format is about has read,
numbered without gaps. A shard may end within a sequence: it holds a line of JSON per frame, and
frames are numbered when all shards are merged.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import DatasetInfo
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.scene_time import RIG_AXES
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.core.serialization import canonical_json

FRAMES_NAME = "frames.jsonl"
_FRAMES_MAX = 1_000_000


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame as a shard holds it.

    Attributes:
        shard_dir: Where its images and scans lie.
        row: What the exporter wrote about it.
    """

    shard_dir: Path
    row: Mapping[str, Any]

    @property
    def index(self) -> int:
        """Number of its sample."""
        return int(self.row["index"])


def sequence_number(info: DatasetInfo, index: int) -> int:
    """Number of the sequence that a sample belongs to, from 0."""
    return index // info.steps_per_scene


def sequence_count(info: DatasetInfo) -> int:
    """Number of sequences; the last one may be cut short."""
    return -(-info.n // info.steps_per_scene)


def check_frame_names(info: DatasetInfo, exporter: str) -> None:
    """Refuse a data set with more samples than names of six digits.

    Raises:
        ConfigError: it has.
    """
    if info.n > _FRAMES_MAX:
        raise ConfigError(
            f"exporter '{exporter}': frame names have six digits, {info.n} samples do not fit; "
            f"make at most {_FRAMES_MAX} samples"
        )


def check_sequence_count(info: DatasetInfo, limit: int, exporter: str) -> None:
    """Refuse a data set with more sequences than a format has names for.

    Raises:
        ConfigError: telling how many samples fit.
    """
    if sequence_count(info) > limit:
        raise ConfigError(
            f"exporter '{exporter}': {sequence_count(info)} sequences do not fit, the format has "
            f"names for {limit}; make at most {limit * info.steps_per_scene} samples"
        )


def frame_facts(info: DatasetInfo, sample: Sample) -> dict[str, Any]:
    """What every format's line says about a frame."""
    return {
        "index": sample.index,
        "sequence": sequence_number(info, sample.index),
        "split": sample.split,
        "step": sample.index % info.steps_per_scene,
    }


def write_frames(folder: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write the lines of one shard."""
    write_text(folder / FRAMES_NAME, "".join(canonical_json(row) + "\n" for row in rows))


def read_sequences(shard_dirs: Sequence[Path], exporter: str) -> dict[int, list[Frame]]:
    """Frames by sequence, both in order."""
    sequences: dict[int, list[Frame]] = {}
    for shard_dir in shard_dirs:
        with (shard_dir / exporter / FRAMES_NAME).open(encoding="utf-8") as lines:
            for line in lines:
                row = json.loads(line)
                sequences.setdefault(row["sequence"], []).append(Frame(shard_dir, row))
    return sequences


def frame_rate_hz(info: DatasetInfo, frames: Sequence[Frame]) -> float:
    """Frames per second of a sequence; that of the steps where it has only one frame."""
    steps = frames[1].row["step"] - frames[0].row["step"] if len(frames) > 1 else 1
    return round(1.0 / (steps * info.step_s), 6)


def timestamp(start: datetime, time_s: float) -> str:
    """``YYYY-MM-DD HH:MM:SS.nnnnnnnnn``: nine digits of a second, as KITTI writes times."""
    whole_s, nanoseconds = divmod(round(time_s * 1e9), 1_000_000_000)
    return f"{start + timedelta(seconds=whole_s):%Y-%m-%d %H:%M:%S}.{nanoseconds:09d}"


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a sensor is on what carries it; exact at all instants, unlike poses in the world.

    Attributes:
        rig: Name of the rig; of a camera that stands by itself, behind a slash.
        T_rig_sensor: A camera's own axes, or X forward, Y left, Z up of any other sensor.
    """

    rig: str
    T_rig_sensor: SE3


def camera_mount(scene: Scene, name: str) -> Mount:
    """Of a camera; one that stands by itself carries a rig along its optical axis."""
    camera = scene.camera(name)
    if camera.rig:
        return Mount(camera.rig, camera.T_rig_camera)
    return Mount(f"/{name}", RIG_AXES.inverse())


def lidar_mount(scene: Scene, name: str) -> Mount:
    """Of a laser scanner."""
    lidar = scene.lidar(name)
    if lidar.rig:
        return Mount(lidar.rig, lidar.T_rig_lidar)
    carrier = camera_mount(scene, lidar.camera)
    return Mount(carrier.rig, carrier.T_rig_sensor @ RIG_AXES @ lidar.T_rig_lidar)


def mounted_pose(scene: Scene, mount: Mount) -> SE3:
    """``T_world_sensor`` at the scene's instant."""
    return _rig_pose(scene, mount.rig) @ mount.T_rig_sensor


def relative_pose(scene: Scene, one: Mount, other: Mount) -> SE3:
    """``T_one_other``: free of rounding in the world where both are on one rig."""
    if one.rig == other.rig:
        return (one.T_rig_sensor.inverse() @ other.T_rig_sensor).rounded(9)
    return (mounted_pose(scene, one).inverse() @ mounted_pose(scene, other)).rounded()


def matrix_numbers(matrix: Array) -> str:
    """Numbers of a matrix, row by row, with all the digits that readers need of a rotation."""
    return " ".join(f"{float(value) + 0.0:.12e}" for value in matrix.ravel())


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 with Unix line ends; the folder is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file; the folder is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def _rig_pose(scene: Scene, rig: str) -> SE3:
    if rig.startswith("/"):
        return scene.camera(rig[1:]).T_world_camera @ RIG_AXES
    return scene.rig_pose(rig)
