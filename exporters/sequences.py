"""Helpers of formats with sequences: frames, times, calibration and file writing.

A sequence consists of all instants of one view of one scene; its number is ``index //
steps_per_scene``. Its frames are the instants at which the format's camera (or scanner) reads,
numbered without gaps. A shard may end within a sequence: it contains a JSON line per frame, and
merging the shards numbers the frames. In formats that state no times, a frame that is missing ends
a sequence (``even_sequences``).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import chain, count, groupby, pairwise
from pathlib import Path
from typing import Any

from gen_data.core import errors, interfaces, scene_time, se3
from gen_data.core.reported import reported
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.serialization import canonical_json
from gen_data.exporters.fragments import fragment_rows, write_fragment

FRAMES = "frames"
_FRAMES_MAX = 1_000_000


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame of a shard.

    Attributes:
        shard_dir: Folder of its images and scans.
        row: The exporter's JSON line for it.
    """

    shard_dir: Path
    row: Mapping[str, Any]

    @property
    def index(self) -> int:
        """Index of its sample."""
        return int(self.row["index"])


def sequence_number(info: interfaces.DatasetInfo, index: int) -> int:
    """Number of the sequence that a sample belongs to, from 0."""
    return index // info.steps_per_scene


def sequence_count(info: interfaces.DatasetInfo) -> int:
    """Number of sequences; the last one may be incomplete."""
    return -(-info.n // info.steps_per_scene)


def check_frame_names(info: interfaces.DatasetInfo, exporter: str) -> None:
    """Reject a data set with more samples than names of six digits.

    Raises:
        ConfigError: there are too many samples.
    """
    if info.n > _FRAMES_MAX:
        raise errors.ConfigError(
            f"exporter '{exporter}': frame names have six digits, but there are {info.n} samples; "
            f"expected at most {_FRAMES_MAX}"
        )


def check_sequence_count(info: interfaces.DatasetInfo, limit: int, exporter: str) -> None:
    """Reject a data set with more sequences than a format has names for.

    Raises:
        ConfigError: there are too many; the text gives the largest number of samples.
    """
    if sequence_count(info) > limit:
        raise errors.ConfigError(
            f"exporter '{exporter}': the format has names for {limit} sequences, but there are "
            f"{sequence_count(info)}; expected at most {limit * info.steps_per_scene} samples"
        )


def frame_facts(info: interfaces.DatasetInfo, sample: Sample) -> dict[str, Any]:
    """Keys of a frame's line that all formats have."""
    return {
        "index": sample.index,
        "sequence": sequence_number(info, sample.index),
        "split": sample.split,
        "step": sample.index % info.steps_per_scene,
    }


def write_frames(folder: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write the lines of one shard."""
    write_fragment(folder, FRAMES, rows)


def read_sequences(shard_dirs: Sequence[Path], exporter: str) -> dict[int, list[Frame]]:
    """Read the frames of all shards by sequence, both in order."""
    sequences: dict[int, list[Frame]] = {}
    for shard_dir, row in fragment_rows(shard_dirs, exporter, FRAMES):
        sequences.setdefault(row["sequence"], []).append(Frame(shard_dir, row))
    return sequences


def even_sequences(
    info: interfaces.DatasetInfo, shard_dirs: Sequence[Path], exporter: str
) -> dict[int, list[Frame]]:
    """Read sequences of frames at even distances, in order; a gap ends a sequence.

    The frames after it are another one, numbered behind all views. The distance is the smallest in
    the data set: a camera that reads every second step has no gaps.
    """
    sequences = read_sequences(shard_dirs, exporter)
    pairs = chain.from_iterable(map(pairwise, sequences.values()))
    steps = min((later.index - frame.index for frame, later in pairs), default=1)
    even: dict[int, list[Frame]] = {}
    numbers = count(max((sequence_count(info), *(number + 1 for number in sequences))))
    for number, frames in sequences.items():
        first, *others = unbroken_episodes(frames, steps)
        even[number] = first
        even |= {next(numbers): part for part in others}
    return dict(sorted(even.items()))


def unbroken_episodes(frames: Iterable[Frame], steps: int = 1) -> Iterator[list[Frame]]:
    """Yield the frames of each sequence, in order; a sample that does not exist ends an episode.

    For formats whose frames are a number of steps apart by definition.
    """

    def run_of(item: tuple[int, Frame]) -> tuple[int, int]:
        place, frame = item
        return frame.row["sequence"], frame.index - steps * place

    for _, run in groupby(enumerate(frames), key=run_of):
        yield [frame for _, frame in run]


def frame_rate_hz(info: interfaces.DatasetInfo, frames: Sequence[Frame]) -> float:
    """Frame rate of a sequence; the rate of the steps if it has only one frame."""
    steps = frames[1].row["step"] - frames[0].row["step"] if len(frames) > 1 else 1
    return round(1.0 / (steps * info.step_s), 6)


def timestamp(start: datetime, time_s: float) -> str:
    """Format a time as KITTI does: ``YYYY-MM-DD HH:MM:SS.nnnnnnnnn``."""
    whole_s, nanoseconds = divmod(round(time_s * 1e9), 1_000_000_000)
    return f"{start + timedelta(seconds=whole_s):%Y-%m-%d %H:%M:%S}.{nanoseconds:09d}"


@dataclass(frozen=True, slots=True)
class Mount:
    """Pose of a sensor on its rig; exact at all instants, unlike poses in the world.

    Attributes:
        rig: Name of the rig; a slash and the camera's name for a camera without a rig.
        T_rig_sensor: Camera axes for cameras; X forward, Y left, Z up for other sensors.
    """

    rig: str
    T_rig_sensor: se3.SE3


def camera_mount(scene: Scene, name: str, *, true: bool = False) -> Mount:
    """Mount of a camera; a camera without a rig is its own rig, along its optical axis.

    Mounts are as calibrations state them, or ``true``: without the errors of calibrations.
    """
    camera = scene.camera(name)
    pose = camera.T_rig_camera if camera.rig else scene_time.RIG_AXES.inverse()
    error = None if true else camera.T_sensor_reported
    return Mount(camera.rig or f"/{name}", pose if error is None else pose @ error)


def lidar_mount(scene: Scene, name: str, *, true: bool = False) -> Mount:
    """Mount of a laser scanner."""
    lidar = scene.lidar(name) if true else reported(scene.lidar(name))
    return _carried_mount(scene, lidar.rig, lidar.camera, lidar.T_rig_lidar)


def device_mount(scene: Scene, name: str) -> Mount:
    """Mount of a device."""
    device = reported(scene.device(name))
    return _carried_mount(scene, device.rig, device.camera, device.T_rig_device)


def _carried_mount(scene: Scene, rig: str, camera: str, T_rig_sensor: se3.SE3) -> Mount:
    """Mount of a sensor on a rig; on its camera if it has none."""
    if rig:
        return Mount(rig, T_rig_sensor)
    carrier = camera_mount(scene, camera, true=True)
    return Mount(carrier.rig, carrier.T_rig_sensor @ scene_time.RIG_AXES @ T_rig_sensor)


def mounted_pose(scene: Scene, mount: Mount) -> se3.SE3:
    """``T_world_sensor`` at the scene's instant."""
    return _rig_pose(scene, mount.rig) @ mount.T_rig_sensor


def relative_pose(scene: Scene, one: Mount, other: Mount) -> se3.SE3:
    """``T_one_other``; independent of world poses, and their rounding, on a common rig."""
    if one.rig == other.rig:
        return (one.T_rig_sensor.inverse() @ other.T_rig_sensor).rounded(9)
    return (mounted_pose(scene, one).inverse() @ mounted_pose(scene, other)).rounded()


def check_one_carrier(
    info: interfaces.DatasetInfo, exporter: str, mounts: Mapping[str, Mount]
) -> None:
    """Refuse sensors that move against each other, where a sequence has one calibration.

    Args:
        info: The data set.
        exporter: Name in the error text.
        mounts: Mounts by sensor.

    Raises:
        ConfigError: the text names two sensors. Cameras without a rig stand still.
    """
    (first, mount), *others = mounts.items()
    for name, other in others:
        still = mount.rig.startswith("/") and other.rig.startswith("/")
        if info.steps_per_scene > 1 and other.rig != mount.rig and not still:
            raise errors.ConfigError(
                f"exporter '{exporter}': '{first}' and '{name}' are on different carriers, but the "
                "format has one calibration for a sequence; name sensors of one rig, or list them "
                "in the exporter's cameras: and sensors:"
            )


def matrix_numbers(matrix: se3.Array) -> str:
    """Format a matrix row by row, with enough digits for rotations."""
    return " ".join(f"{float(value) + 0.0:.12e}" for value in matrix.ravel())


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 with Unix line ends; creates the folder."""
    write_bytes(path, text.encode("utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Write a canonical JSON document and a line end; creates the folder."""
    write_text(path, canonical_json(value) + "\n")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file; creates the folder."""
    try:
        path.write_bytes(data)
    except FileNotFoundError:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _rig_pose(scene: Scene, rig: str) -> se3.SE3:
    if rig.startswith("/"):
        return scene.camera(rig[1:]).T_world_camera @ scene_time.RIG_AXES
    return scene.rig_pose(rig)
