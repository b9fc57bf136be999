"""Files of a LeRobot data set in both formats that are in use: v3.0 and v2.1.

Both store a row per frame in Parquet files with embedded images. They differ in how episodes share
files, and in whether episodes, tasks and statistics are Parquet or JSON lines.

Reference: https://github.com/huggingface/lerobot, lerobot/datasets: release 0.4.4 (v3.0:
lerobot_dataset.py, utils.py) and 0.3.2 (v2.1: utils.py).
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gen_data.core import capture, interfaces, serialization
from gen_data.exporters.lerobot_statistics import (
    image_statistics,
    merge_statistics,
    number_statistics,
)
from gen_data.exporters.parquet_tables import (
    GROUP_ROWS,
    IMAGE,
    array_column,
    array_feature,
    list_feature,
    open_parquet,
    table_schema,
    value_feature,
)
from gen_data.exporters.sequences import Frame, write_json
from gen_data.exporters.step_geometry import OBJECTS, POSE, PREDICATES, Array, step_array

if TYPE_CHECKING:
    from pyarrow.parquet import ParquetWriter

CHUNK_FILES = 1000
"""Files of a folder, at most; LeRobot's default."""
FILE_BYTES = 100 * 1024**2
"""Images in a file of several episodes, at most; LeRobot's default is 100 MiB."""
EE_POSE = "observation.ee_pose"
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
    "annotation.recovered": "string",
}
"""Features of demonstrations and their types; the last one of twins only."""
COUNTERS = ("frame_index", "episode_index", "index", "task_index")


@dataclass(frozen=True, slots=True)
class _Episode:
    """An episode of a data set.

    Attributes:
        frames: Its frames, in order.
        rows: Numbers and texts of each frame by feature.
        task: Its task in words.
        stats: Statistics of its frames by feature.
    """

    frames: Sequence[Frame]
    rows: Sequence[Mapping[str, Any]]
    task: str
    stats: Mapping[str, Any]


@dataclass(eq=False)
class RobotFiles(ABC):
    """Data set of one robot and split.

    Attributes:
        first: Row of its first frame, whose joints and image sizes hold for all.
        arrays: Arrays of geometry of every step, by feature.
    """

    version: ClassVar[str]

    info: interfaces.DatasetInfo
    folder: Path
    first: Mapping[str, Any]
    arrays: Mapping[str, Array] = field(default_factory=dict)
    _episodes: int = 0
    _frames: int = 0
    _tasks: dict[str, int] = field(default_factory=dict)

    def add_episode(self, frames: Sequence[Frame]) -> None:
        """Write the frames of one episode, and its summary."""
        task = frames[0].row["task"]
        task_index = self._tasks.setdefault(task, len(self._tasks))
        rows = [self._values(frame.row, k, task_index) for k, frame in enumerate(frames)]
        images = image_statistics([frame.row["images"] for frame in frames])
        stats = number_statistics(rows) | {_image_key(name): one for name, one in images.items()}
        self._write_episode(_Episode(frames, rows, task, stats))
        self._episodes += 1
        self._frames += len(frames)

    @abstractmethod
    def close(self) -> None:
        """Write tasks, statistics and totals."""

    @abstractmethod
    def _write_episode(self, episode: _Episode) -> None: ...

    def _write_frames(self, writer: "ParquetWriter", episode: _Episode) -> None:
        """Write the rows of an episode with images; one row group is in memory."""
        import pyarrow

        frames = episode.frames
        for start in range(0, len(frames), GROUP_ROWS):
            group = range(start, min(start + GROUP_ROWS, len(frames)))
            whole = [{**episode.rows[k], **_embedded(self.info, frames[k], k)} for k in group]
            table = pyarrow.Table.from_pylist(
                whole, pyarrow.schema([f for f in writer.schema if f.name not in self.arrays])
            )
            for name, array in self.arrays.items():
                steps = [step_array(self.info, name, array, frames[k]) for k in group]
                table = table.append_column(name, array_column(np.stack(steps)))
            writer.write_table(table.select(writer.schema.names).cast(writer.schema))

    def _values(self, row: Mapping[str, Any], frame_index: int, task_index: int) -> dict[str, Any]:
        """Numbers and texts of one frame by feature."""
        return {
            "observation.state": row["state"],
            "action": row["action"],
            **row["labels"],
            **{name: row["geometry"][name] for name in self._texts()},
            "timestamp": frame_index / self._rate_hz(),
            "frame_index": frame_index,
            "episode_index": self._episodes,
            "index": self._frames + frame_index,
            "task_index": task_index,
        }

    def _rate_hz(self) -> float:
        rate_hz = round(1.0 / self.info.step_s, 6)
        return int(rate_hz) if rate_hz.is_integer() else rate_hz

    def _texts(self) -> tuple[str, ...]:
        """Texts among the features of geometry."""
        return (OBJECTS,) if OBJECTS in self.first.get("geometry", {}) else ()

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
            **dict.fromkeys(self._texts(), value_feature("string")),
            **{name: array_feature(a.dtype, a.shape) for name, a in self.arrays.items()},
            **{_image_key(camera): IMAGE for camera in self.first["images"]},
            "timestamp": value_feature("float32"),
            **dict.fromkeys(COUNTERS, value_feature("int64")),
        }

    def _features(self) -> dict[str, dict[str, Any]]:
        """Features in the form of ``info.json``."""
        joints = self.first["joints"]
        positions = {"dtype": "float32", "shape": [len(joints)], "names": joints}
        number = {"shape": [1], "names": None}
        return {
            "observation.state": positions,
            "action": positions,
            **{
                name: {
                    "dtype": LABELS[name],
                    "shape": [len(np.atleast_1d(value))],
                    "names": self._pose_names() if name == EE_POSE else None,
                }
                for name, value in self.first["labels"].items()
            },
            **{name: {"dtype": "string", **number} for name in self._texts()},
            **{
                name: {
                    "dtype": array.dtype,
                    "shape": [*array.shape],
                    "names": [*array.names] or None,
                    **self._meaning(name),
                }
                for name, array in self.arrays.items()
            },
            **{
                _image_key(camera): {
                    "dtype": "image",
                    "shape": [*reversed(sums["size_px"]), 3],
                    "names": ["height", "width", "channels"],
                }
                for camera, sums in self.first["images"].items()
            },
            "timestamp": {"dtype": "float32", **number},
            **{name: {"dtype": "int64", **number} for name in COUNTERS},
        }

    def _pose_names(self) -> list[str]:
        arms = self.first.get("arms", ())
        return [f"{arm}.{name}" for arm in arms for name in POSE] if arms else [*POSE]

    def _meaning(self, name: str) -> dict[str, Any]:
        """Further keys in ``info.json``: unit of depths, names of numbered predicates."""
        if name.startswith("annotation.depth."):
            return {"unit_m": self.info.depth_scale_m}
        return {"predicates": [*PREDICATES]} if name == "annotation.relation" else {}

    def _facts(self) -> dict[str, Any]:
        """Common contents of ``info.json`` in both formats."""
        return {
            "codebase_version": self.version,
            "robot_type": self.first["robot"],
            "total_episodes": self._episodes,
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": CHUNK_FILES,
            "fps": self._rate_hz(),
            "splits": {self.first["split"]: f"0:{self._episodes}"},
            "video_path": None,
            "features": self._features(),
        }


@dataclass(eq=False)
class FilesV21(RobotFiles):
    """A Parquet file per episode, and JSON lines of episodes, statistics and tasks."""

    version = "v2.1"

    def close(self) -> None:
        """Write tasks and totals."""
        for task, number in self._tasks.items():
            self._append("tasks", {"task_index": number, "task": task})
        totals = {
            "total_videos": 0,
            "total_chunks": -(-self._episodes // CHUNK_FILES),
            "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        }
        write_json(self.folder / "meta/info.json", self._facts() | totals)

    def _write_episode(self, episode: _Episode) -> None:
        number = self._episodes
        chunk = f"chunk-{number // CHUNK_FILES:03d}"
        path = self.folder / f"data/{chunk}/episode_{number:06d}.parquet"
        with open_parquet(path, table_schema(self._columns())) as writer:
            self._write_frames(writer, episode)
        length = len(episode.frames)
        self._append(
            "episodes", {"episode_index": number, "tasks": [episode.task], "length": length}
        )
        self._append("episodes_stats", {"episode_index": number, "stats": episode.stats})

    def _append(self, name: str, row: Mapping[str, Any]) -> None:
        path = self.folder / f"meta/{name}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(serialization.canonical_json(row) + "\n")


@dataclass(eq=False)
class FilesV30(RobotFiles):
    """Files of many episodes each; episodes, statistics and tasks are Parquet tables as well."""

    version = "v3.0"

    _data: "ParquetWriter | None" = None
    _file: int = -1
    _file_bytes: int = 0
    _episode_rows: list[dict[str, Any]] = field(default_factory=list)
    _episode_writer: "ParquetWriter | None" = None
    _stats: dict[str, Any] = field(default_factory=dict)

    def close(self) -> None:
        """Write the last episodes, tasks, statistics and totals."""
        self._flush_episodes()
        for writer in (self._data, self._episode_writer):
            if writer is not None:
                writer.close()
        _write_tasks(self.folder / "meta/tasks.parquet", self._tasks)
        write_json(self.folder / "meta/stats.json", self._stats)
        facts = self._facts()
        for feature in facts["features"].values():
            feature["fps"] = facts["fps"]
        sizes = {
            "data_files_size_in_mb": FILE_BYTES // 1024**2,
            "video_files_size_in_mb": 0,
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        }
        write_json(self.folder / "meta/info.json", facts | sizes)

    def _write_episode(self, episode: _Episode) -> None:
        length = len(episode.frames)
        size = _image_bytes(self.info, episode.frames)
        size += length * sum(
            np.dtype(a.dtype).itemsize * prod(a.shape) for a in self.arrays.values()
        )
        self._write_frames(self._open_data(size), episode)
        chunk, file = divmod(self._file, CHUNK_FILES)
        self._episode_rows.append(
            {
                "episode_index": self._episodes,
                "data/chunk_index": chunk,
                "data/file_index": file,
                "dataset_from_index": self._frames,
                "dataset_to_index": self._frames + length,
                "tasks": [episode.task],
                "length": length,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                **{
                    f"stats/{name}/{key}": value
                    for name, one in episode.stats.items()
                    for key, value in one.items()
                },
            }
        )
        if len(self._episode_rows) == GROUP_ROWS:
            self._flush_episodes()
        stats = episode.stats
        self._stats = merge_statistics(self._stats, stats) if self._stats else dict(stats)

    def _open_data(self, image_bytes: int) -> "ParquetWriter":
        """File of frames that has room for an episode."""
        if self._data is None or self._file_bytes + image_bytes > FILE_BYTES:
            if self._data is not None:
                self._data.close()
            self._file, self._file_bytes = self._file + 1, 0
            chunk, file = divmod(self._file, CHUNK_FILES)
            path = self.folder / f"data/chunk-{chunk:03d}/file-{file:03d}.parquet"
            self._data = open_parquet(path, table_schema(self._columns()))
        self._file_bytes += image_bytes
        return self._data

    def _flush_episodes(self) -> None:
        import pyarrow

        if not self._episode_rows:
            return
        schema = table_schema({name: _table_column(name) for name in self._episode_rows[0]})
        if self._episode_writer is None:
            path = self.folder / "meta/episodes/chunk-000/file-000.parquet"
            self._episode_writer = open_parquet(path, schema)
        self._episode_writer.write_table(pyarrow.Table.from_pylist(self._episode_rows, schema))
        self._episode_rows.clear()


LAYOUTS: dict[str, type[RobotFiles]] = {layout.version: layout for layout in (FilesV30, FilesV21)}
"""Formats by version."""


def _column(dtype: str, length: int) -> dict[str, Any]:
    return value_feature(dtype) if length == 1 else list_feature(value_feature(dtype), length)


def _table_column(name: str) -> dict[str, Any]:
    if name == "tasks":
        return list_feature(value_feature("string"))
    if not name.startswith("stats/"):
        return value_feature("int64")
    if name.endswith("/count"):
        return list_feature(value_feature("int64"))
    numbers = list_feature(value_feature("float64"))
    is_image = name.startswith(f"stats/{_image_key('')}")
    return list_feature(list_feature(numbers)) if is_image else numbers


def _write_tasks(path: Path, tasks: Mapping[str, int]) -> None:
    """Table of tasks, whose index pandas reads from the schema: the sentences."""
    import pyarrow

    column = {"metadata": None, "name": "task_index", "field_name": "task_index",
              "pandas_type": "int64", "numpy_type": "int64"}  # fmt: skip
    index = {"metadata": None, "name": None, "field_name": "__index_level_0__",
             "pandas_type": "unicode", "numpy_type": "object"}  # fmt: skip
    described = {
        "index_columns": ["__index_level_0__"],
        "column_indexes": [],
        "columns": [column, index],
        "creator": {"library": "pyarrow", "version": pyarrow.__version__},
        "pandas_version": "2.0.0",
    }
    columns = [("task_index", pyarrow.int64()), ("__index_level_0__", pyarrow.string())]
    schema = pyarrow.schema(columns, metadata={"pandas": json.dumps(described)})
    values = [list(tasks.values()), list(tasks)]
    with open_parquet(path, schema) as writer:
        writer.write_table(pyarrow.table(values, schema=schema))


def _image_key(camera: str) -> str:
    return f"observation.images.{camera}"


def _image_paths(info: interfaces.DatasetInfo, frame: Frame) -> dict[str, Path]:
    return {
        camera: info.media_path(frame.shard_dir, camera, capture.Channel.RGB, frame.index)
        for camera in frame.row["images"]
    }


def _image_bytes(info: interfaces.DatasetInfo, frames: Sequence[Frame]) -> int:
    paths = (path for frame in frames for path in _image_paths(info, frame).values())
    return sum(path.stat().st_size for path in paths)


def _embedded(info: interfaces.DatasetInfo, frame: Frame, frame_index: int) -> dict[str, Any]:
    """Images of a frame by feature."""
    return {
        _image_key(camera): {
            "bytes": path.read_bytes(),
            "path": f"frame_{frame_index:06d}{path.suffix}",
        }
        for camera, path in _image_paths(info, frame).items()
    }
