"""LeRobot data sets, format v2.1: episodes of a robot arm, for imitation learning.

::

    <split>/<robot>/                            one data set per split and robot model
        meta/info.json                          frame rate, features, totals
        meta/episodes.jsonl, tasks.jsonl        length and task of each episode
        meta/episodes_stats.jsonl               least, largest, mean value and deviation by feature
        data/chunk-000/episode_000000.parquet   one row per frame, images embedded as PNG

Features: ``observation.state``, the positions of all movable joints [rad or m];
``action``, their positions one step later, which a position controller would be given; and
``observation.images.<camera>``. Demonstrations of tasks (randomizer ``arm_task``) add
``observation.ee_pose``, the grasp frame in the frame of the arm's base [m, quaternion w x y z];
``observation.gripper`` and ``action.gripper``, its opening from 0 to 1; and texts
``annotation.{phase,held,contacts,failure}`` with ``annotation.succeeded``. Of every contact, in
the order of ``contacts`` and separated by commas, ``annotation.contact_forces_n`` has the normal
force and ``annotation.contact_points_m`` the point ``x y z`` in the world. ``timestamp`` is the
frame's number divided by the frame rate.
Joints are named in ``info.json``, in the order of the robot's description.

An episode is a sequence: all instants of one view. Robots of different models have different
joints and hence data sets of their own; so have splits, since training takes all episodes of a data
set. The task is a sentence made of the arm's goals and the objects that move.

Statistics of images are exact over every ``n``-th pixel, with LeRobot's own ``n``: about 150
pixels along the longer side. Bytes of Parquet files depend on the release of pyarrow.

Reference: https://github.com/huggingface/lerobot, release 0.3.2, lerobot/datasets (utils.py,
compute_stats.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr

from gen_data.exporters.base import ANY_FORMAT, ExporterBase, check_installed
from gen_data.exporters.fragments import fragment_rows
from gen_data.exporters.image_files import read_pixels
from gen_data.exporters.parquet_tables import (
    GROUP_ROWS,
    IMAGE,
    list_feature,
    open_parquet,
    table_schema,
    value_feature,
)
from gen_data.exporters.sensor_selection import rgb_camera, rgb_cameras
from gen_data.exporters.sequences import FRAMES, Frame, frame_facts, write_frames, write_text
from gen_data.generator.core.capture import Channel
from gen_data.generator.core.demonstrations import (
    DemonstrationStep,
    demonstration_step,
    joint_positions,
)
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.scene import Articulation, Scene
from gen_data.generator.core.serialization import canonical_json

VERSION = "v2.1"
CHUNK_EPISODES = 1000
STATISTICS_PX, WHOLE_PX = 150, 300
"""Longer side of the images in statistics, and the length below which all pixels count [px]."""
DECIMALS = 9
EE_POSE = "observation.ee_pose"
POSE = ["x", "y", "z", "qw", "qx", "qy", "qz"]
LABELS = {
    EE_POSE: "float32",
    "observation.gripper": "float32",
    "action.gripper": "float32",
    "annotation.phase": "string",
    "annotation.held": "string",
    "annotation.contacts": "string",
    "annotation.contact_forces_n": "string",
    "annotation.contact_points_m": "string",
    "annotation.succeeded": "bool",
    "annotation.failure": "string",
}
"""Features of demonstrations and their types."""
PHRASES = {
    "joints": "move to a posture",
    "reach": "reach a pose",
    "hold": "hold {object}",
    "grasp": "pick up {object}",
    "place": "put it down",
}
"""Phrase for each kind of an arm's goals."""


class LeRobot(ExporterBase):
    """LeRobot v2.1: joint positions and images of the episodes of one arm.

    Attributes:
        arm: Name of the arm; empty = the first one.
        cameras: Names of the cameras; empty = all with the rgb channel.
    """

    type: Literal["lerobot"] = "lerobot"

    image_formats: ClassVar[frozenset[str]] = ANY_FORMAT
    arm: str = ""
    cameras: tuple[str, ...] = ()

    _assets: AssetLibrary | None = PrivateAttr(None)

    def with_assets(self, assets: AssetLibrary) -> LeRobot:
        """Return the exporter with a library that knows the joints of robots."""
        bound = self.model_copy()
        bound._assets = assets
        return bound

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there are no sequences, a camera is missing or skips steps, or a library
                is missing.
        """
        check_installed(self.type, "pyarrow")
        if info.steps_per_scene < 2:
            raise ConfigError(
                f"exporter '{self.type}': episodes are sequences, but steps_per_scene is 1; "
                "set steps_per_scene, and an arm that moves"
            )
        for name in self._cameras(info):
            rate_hz = info.sensor(name).rate_hz
            if rate_hz is not None and rate_hz * info.step_s < 1.0 - 1e-9:
                raise ConfigError(
                    f"exporter '{self.type}': camera '{name}' reads {rate_hz:g} times per second, "
                    f"but frames are {info.step_s:g} s apart; omit its rate_hz, or list the other "
                    "cameras in the exporter's cameras"
                )

    def check_scene(self, scene: Scene) -> None:
        """Reject scenes without the arm.

        Raises:
            ConfigError: the scene has no such arm.
        """
        self._find_arm(scene)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line per frame: joints, task and statistics of images.

        Raises:
            ConfigError: a scene has no such arm; see also ``check``.
        """
        self.check(info)
        rows = (self._row(info, sample, shard_dir) for sample in samples)
        write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the episodes of all shards, then the totals of each data set."""
        lines = fragment_rows(shard_dirs, self.type, FRAMES)
        frames = (Frame(shard_dir, row) for shard_dir, row in lines)
        folders: dict[tuple[str, str], _RobotFiles] = {}
        for _, group in groupby(frames, key=lambda frame: frame.row["sequence"]):
            episode = list(group)
            first = episode[0].row
            key = (first["split"], first["robot"])
            if key not in folders:
                folder = dataset_dir / key[0] / key[1].replace("/", "_")
                folders[key] = _RobotFiles(info, folder, first)
            folders[key].add_episode(episode)
        for files in folders.values():
            files.close()

    def _cameras(self, info: DatasetInfo) -> tuple[str, ...]:
        if not self.cameras:
            return rgb_cameras(info) or (rgb_camera(info, "", self.type),)
        return tuple(rgb_camera(info, name, self.type) for name in self.cameras)

    def _row(self, info: DatasetInfo, sample: Sample, shard_dir: Path) -> dict[str, Any]:
        assert self._assets is not None, "call with_assets first"
        arm = self._find_arm(sample.scene)
        time_s = sample.scene.time_s
        images = {
            camera: _image_sums(info.media_path(shard_dir, camera, Channel.RGB, sample.index))
            for camera in self._cameras(info)
        }
        robot = self._assets.robot(arm.asset)
        step = demonstration_step(arm, robot, time_s, info.step_s)
        return frame_facts(info, sample) | {
            "labels": {} if step is None else _labels(step),
            "robot": arm.asset,
            "joints": [joint.name for joint in robot.movable],
            "state": joint_positions(arm, time_s),
            "action": joint_positions(arm, time_s + info.step_s),
            "task": task_sentence(sample.scene, arm),
            "images": images,
        }

    def _find_arm(self, scene: Scene) -> Articulation:
        for arm in scene.articulations:
            if self.arm in ("", arm.name):
                return arm
        known = ", ".join(arm.name for arm in scene.articulations) or "none"
        raise ConfigError(
            f"exporter '{self.type}': the scene has no arm '{self.arm}'; expected one of: {known}"
            if self.arm
            else f"exporter '{self.type}': the scene has no arm; add an element of type robot and "
            "the randomizer arm_motion"
        )


def _labels(step: DemonstrationStep) -> dict[str, Any]:
    """Features of a demonstration at one instant."""
    pose = (*step.T_base_grasp.translation_m, *step.T_base_grasp.quaternion_wxyz)
    contacts = ", ".join(step.contacts)
    forces = ", ".join(f"{force_n:g}" for force_n in step.contact_forces_n)
    points = ", ".join(f"{x:g} {y:g} {z:g}" for x, y, z in step.contact_points_m)
    values = (pose, step.opening, step.opening_action, step.phase, step.held, contacts, forces,
              points, step.succeeded, step.failure)  # fmt: skip
    return dict(zip(LABELS, values, strict=True))


def _column(dtype: str, length: int) -> dict[str, Any]:
    return value_feature(dtype) if length == 1 else list_feature(value_feature(dtype), length)


def task_sentence(scene: Scene, arm: Articulation) -> str:
    """Task of an arm in words, the same at all instants of a sequence."""
    if arm.assignment is not None:
        return arm.assignment.instruction
    goals = arm.task or ((arm.goal,) if arm.goal is not None else ())
    if not goals:
        return "Stay in place."
    moving = {track.body for track in scene.tracks}
    carried = {
        body.instance_id
        for body in scene.bodies
        if body.name in moving and body.instance_id != arm.instance_id
    }
    names = sorted({i.category for i in scene.instances if i.instance_id in carried})
    thing = f"the {names[0]}" if len(names) == 1 else "an object"
    phrases = [PHRASES[goal.kind].format(object=thing) for goal in goals]
    text = ", then ".join(phrase for phrase, _ in groupby(phrases))
    return f"{text[0].upper()}{text[1:]}."


def _image_sums(path: Path) -> dict[str, Any]:
    """Sums over every n-th pixel by channel, whole numbers from 0 to 255."""
    rgb = read_pixels(path)
    height, width = rgb.shape[:2]
    longer = max(width, height)
    stride = max(1, longer // STATISTICS_PX) if longer >= WHOLE_PX else 1
    values = np.arange(256)
    counts = [np.bincount(rgb[::stride, ::stride, k].ravel(), minlength=256) for k in range(3)]
    present = [np.flatnonzero(count) for count in counts]
    return {
        "size_px": [width, height],
        "count": int(counts[0].sum()),
        "min": [int(found[0]) for found in present],
        "max": [int(found[-1]) for found in present],
        "sum": [int(count @ values) for count in counts],
        "squares": [int(count @ (values * values)) for count in counts],
    }


@dataclass(eq=False)
class _RobotFiles:
    """Data set of one robot and split.

    Attributes:
        first: Row of its first frame, whose joints and image sizes hold for all.
    """

    info: DatasetInfo
    folder: Path
    first: Mapping[str, Any]
    _episodes: int = 0
    _frames: int = 0
    _tasks: dict[str, int] = field(default_factory=dict)

    def add_episode(self, frames: Sequence[Frame]) -> None:
        """Write one episode and its lines in ``meta``."""
        number, task = self._episodes, frames[0].row["task"]
        task_index = self._tasks.setdefault(task, len(self._tasks))
        rows = [self._values(frame.row, k, task_index) for k, frame in enumerate(frames)]
        self._write_rows(frames, rows)
        length = len(frames)
        self._append("episodes", {"episode_index": number, "tasks": [task], "length": length})
        stats = _number_stats(rows) | _image_stats([frame.row["images"] for frame in frames])
        self._append("episodes_stats", {"episode_index": number, "stats": stats})
        self._episodes += 1
        self._frames += length

    def _write_rows(self, frames: Sequence[Frame], rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the Parquet file of an episode; images of one row group are in memory."""
        import pyarrow

        chunk = f"chunk-{self._episodes // CHUNK_EPISODES:03d}"
        path = self.folder / f"data/{chunk}/episode_{self._episodes:06d}.parquet"
        schema = table_schema(self._columns())
        with open_parquet(path, schema) as writer:
            for start in range(0, len(frames), GROUP_ROWS):
                group = range(start, min(start + GROUP_ROWS, len(frames)))
                whole = [{**rows[k], **_embedded(self.info, frames[k], k)} for k in group]
                table = pyarrow.Table.from_pylist(whole, schema)
                writer.write_table(table, row_group_size=len(whole))

    def close(self) -> None:
        """Write tasks and totals."""
        for task, number in self._tasks.items():
            self._append("tasks", {"task_index": number, "task": task})
        write_text(self.folder / "meta/info.json", canonical_json(self._facts()) + "\n")

    def _values(self, row: Mapping[str, Any], frame_index: int, task_index: int) -> dict[str, Any]:
        """Numbers of one frame by feature."""
        return {
            "observation.state": row["state"],
            "action": row["action"],
            **row["labels"],
            "timestamp": frame_index / self._rate_hz(),
            "frame_index": frame_index,
            "episode_index": self._episodes,
            "index": self._frames + frame_index,
            "task_index": task_index,
        }

    def _append(self, name: str, row: Mapping[str, Any]) -> None:
        path = self.folder / f"meta/{name}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(canonical_json(row) + "\n")

    def _rate_hz(self) -> float:
        rate_hz = round(1.0 / self.info.step_s, 6)
        return int(rate_hz) if rate_hz.is_integer() else rate_hz

    def _columns(self) -> dict[str, Any]:
        """Features of the Parquet files, in the form of ``datasets``."""
        positions = list_feature(value_feature("float32"), len(self.first["joints"]))
        return {
            "observation.state": positions,
            "action": positions,
            **{
                name: _column(LABELS[name], len(np.atleast_1d(value)))
                for name, value in self.first["labels"].items()
            },
            **{_image_key(camera): IMAGE for camera in self.first["images"]},
            "timestamp": value_feature("float32"),
            **dict.fromkeys(
                ("frame_index", "episode_index", "index", "task_index"), value_feature("int64")
            ),
        }

    def _facts(self) -> dict[str, Any]:
        """Content of ``info.json``."""
        joints = self.first["joints"]
        positions = {"dtype": "float32", "shape": [len(joints)], "names": joints}
        number = {"shape": [1], "names": None}
        images = {
            _image_key(camera): {
                "dtype": "image",
                "shape": [*reversed(sums["size_px"]), 3],
                "names": ["height", "width", "channels"],
            }
            for camera, sums in self.first["images"].items()
        }
        return {
            "codebase_version": VERSION,
            "robot_type": self.first["robot"],
            "total_episodes": self._episodes,
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "total_videos": 0,
            "total_chunks": -(-self._episodes // CHUNK_EPISODES),
            "chunks_size": CHUNK_EPISODES,
            "fps": self._rate_hz(),
            "splits": {self.first["split"]: f"0:{self._episodes}"},
            "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
            "video_path": None,
            "features": {
                "observation.state": positions,
                "action": positions,
                **{
                    name: {
                        "dtype": LABELS[name],
                        "shape": [len(np.atleast_1d(value))],
                        "names": POSE if name == EE_POSE else None,
                    }
                    for name, value in self.first["labels"].items()
                },
                **images,
                "timestamp": {"dtype": "float32", **number},
                "frame_index": {"dtype": "int64", **number},
                "episode_index": {"dtype": "int64", **number},
                "index": {"dtype": "int64", **number},
                "task_index": {"dtype": "int64", **number},
            },
        }


def _image_key(camera: str) -> str:
    return f"observation.images.{camera}"


def _embedded(info: DatasetInfo, frame: Frame, frame_index: int) -> dict[str, Any]:
    """Images of a frame by feature."""
    paths = {
        camera: info.media_path(frame.shard_dir, camera, Channel.RGB, frame.index)
        for camera in frame.row["images"]
    }
    return {
        _image_key(camera): {
            "bytes": path.read_bytes(),
            "path": f"frame_{frame_index:06d}{path.suffix}",
        }
        for camera, path in paths.items()
    }


def _number_stats(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Statistics of the numbers of an episode by feature, of the values as stored."""
    stats = {}
    for name in rows[0]:
        if isinstance(rows[0][name], str):
            continue
        stored = np.array([row[name] for row in rows])
        if stored.dtype.kind == "f":
            stored = stored.astype(np.float32).astype(np.float64)
        columns = stored.reshape(len(rows), -1).T.tolist()
        stats[name] = {
            "min": [min(values) for values in columns],
            "max": [max(values) for values in columns],
            # fsum is exact: the result is the same on every machine.
            "mean": [_mean(values) for values in columns],
            "std": [_deviation(values) for values in columns],
            "count": [len(rows)],
        }
    return stats


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _deviation(values: Sequence[float]) -> float:
    mean = _mean(values)
    return round(math.sqrt(math.fsum((v - mean) ** 2 for v in values) / len(values)), DECIMALS)


def _image_stats(frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Statistics of the images of an episode by feature, [3, 1, 1] each, as fractions of 255."""
    stats = {}
    for camera in frames[0]:
        sums = [frame[camera] for frame in frames]
        columns: dict[str, list[Any]] = {name: [] for name in ("min", "max", "mean", "std")}
        for k in range(3):
            n = sum(one["count"] for one in sums)
            total = sum(one["sum"][k] for one in sums)
            squares = sum(one["squares"][k] for one in sums)
            # Whole numbers: nothing is lost in the difference.
            deviation = math.sqrt(n * squares - total * total) / n
            columns["min"].append([[min(one["min"][k] for one in sums) / 255.0]])
            columns["max"].append([[max(one["max"][k] for one in sums) / 255.0]])
            columns["mean"].append([[round(total / n / 255.0, DECIMALS)]])
            columns["std"].append([[round(deviation / 255.0, DECIMALS)]])
        stats[_image_key(camera)] = {**columns, "count": [len(frames)]}
    return stats
