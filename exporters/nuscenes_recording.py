"""Scenes of nuScenes: key frames of a sequence, and the rows of its readings and objects."""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from gen_data.exporters.nuscenes_tables import Row, Tokens
from gen_data.exporters.sensor_selection import row_stamp_s
from gen_data.exporters.sequences import Frame

LIDAR_TOP = "LIDAR_TOP"
FILE_FORMATS = {".png": "png", ".jpg": "jpg", ".pcd.bin": "pcd", ".pcd": "pcd"}
"""Values of ``fileformat`` by ending of the file."""
START_US = 1_577_836_800_000_000
"""Before the first sequence: the beginning of ``nuscenes_tables.DAY``, UTC."""
PAUSE_US = 10_000_000
"""Time between sequences."""


def scene_name(sequence: int) -> str:
    """Name of the scene of a sequence; unlike official names, it is in no official split."""
    return f"gen-scene-{sequence:06d}"


@dataclass(frozen=True, eq=False)
class Recording:
    """One sequence: a scene of nuScenes.

    Attributes:
        token: Tokens of the data set.
        version: Name of the folder of the tables.
        frames: All its instants, in order.
        keys: Positions of the key frames in ``frames``; at least one.
        name_of: Name of a scene by the number of its sequence.
    """

    token: Tokens
    version: str
    frames: Sequence[Frame]
    keys: Sequence[int]
    name_of: Callable[[int], str] = scene_name

    @property
    def number(self) -> int:
        """Number of the sequence."""
        return int(self.frames[0].row["sequence"])

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.name_of(self.number)

    def rows(self) -> Iterator[tuple[str, Row]]:
        """Yield all rows, each with its table; sensors' calibrations may repeat."""
        yield "scene", self._scene_row()
        for k, key in enumerate(self.keys):
            around = self._sample_token(k - 1), self._sample_token(k + 1)
            row = self.frames[key].row
            yield (
                "sample",
                {
                    "token": self._sample_token(k),
                    "timestamp": self.time_us(row_stamp_s(row["readings"][LIDAR_TOP])),
                    "scene_token": self.token("scene", self.number),
                    "prev": around[0],
                    "next": around[1],
                },
            )
        for channel in sorted({c for frame in self.frames for c in frame.row["readings"]}):
            yield from self._reading_rows(channel)
        for table in ("lidarseg", "panoptic"):
            for key in self.keys:
                yield table, self._point_label_row(table, self.frames[key])
        yield from self._object_rows()

    def files(self) -> Iterator[tuple[Frame, str, str]]:
        """Yield the files of all readings: frame, channel and path in the data set."""
        keys = set(self.keys)
        for k, frame in enumerate(self.frames):
            for channel, reading in frame.row["readings"].items():
                yield frame, channel, reading_file(frame, channel, reading, is_key=k in keys)

    def point_label_files(self) -> Iterator[tuple[Frame, str, str]]:
        """Yield the labels of the points of key frames: frame, table and path in the data set."""
        for key in self.keys:
            for table in ("lidarseg", "panoptic"):
                row = self._point_label_row(table, self.frames[key])
                yield self.frames[key], table, row["filename"]

    def _scene_row(self) -> Row:
        row = self.frames[0].row
        return {
            "token": self.token("scene", self.number),
            "name": self.name,
            "description": f"sequence {self.number} of world {row['scene']}, split {row['split']}",
            "log_token": self.token("log", row["scene"]),
            "nbr_samples": len(self.keys),
            "first_sample_token": self._sample_token(0),
            "last_sample_token": self._sample_token(len(self.keys) - 1),
        }

    def _sample_token(self, k: int) -> str:
        """Token of key frame ``k``; empty if there is none."""
        if not 0 <= k < len(self.keys):
            return ""
        return self.token("sample", self.frames[self.keys[k]].index)

    def time_us(self, time_s: float) -> int:
        """Time stamp of an instant of the sequence [us]."""
        info = self.token.info
        whole_s = math.ceil(info.steps_per_scene * info.step_s)
        start_us = START_US + PAUSE_US + self.number * (whole_s * 1_000_000 + PAUSE_US)
        return start_us + round(time_s * 1e6)

    def _reading_rows(self, channel: str) -> Iterator[tuple[str, Row]]:
        read = [k for k, frame in enumerate(self.frames) if channel in frame.row["readings"]]
        tokens = ["", *(self.token("sample_data", self.frames[k].index, channel) for k in read), ""]
        for n, k in enumerate(read, 1):
            frame = self.frames[k]
            reading = frame.row["readings"][channel]
            following = min(bisect_left(self.keys, k), len(self.keys) - 1)
            is_key = self.keys[following] == k
            stamp_us = self.time_us(row_stamp_s(reading))
            ego_pose = {"token": tokens[n], "timestamp": stamp_us, **reading["ego"]}
            calibrated = {
                "sensor_token": self.token("sensor", channel),
                "camera_intrinsic": reading["intrinsic"],
                **reading["mount"],
            }
            calibrated["token"] = self.token("calibrated_sensor", calibrated)
            yield "ego_pose", ego_pose
            yield "calibrated_sensor", calibrated
            yield (
                "sample_data",
                {
                    "token": tokens[n],
                    "sample_token": self._sample_token(following),
                    "ego_pose_token": ego_pose["token"],
                    "calibrated_sensor_token": calibrated["token"],
                    "timestamp": stamp_us,
                    "fileformat": FILE_FORMATS[reading["suffix"]],
                    "is_key_frame": is_key,
                    "width": reading["size_px"][0],
                    "height": reading["size_px"][1],
                    "filename": reading_file(frame, channel, reading, is_key=is_key),
                    "prev": tokens[n - 1],
                    "next": tokens[n + 1],
                },
            )

    def _point_label_row(self, table: str, frame: Frame) -> Row:
        key = self.token("sample_data", frame.index, LIDAR_TOP)
        ending = {"lidarseg": "lidarseg.bin", "panoptic": "panoptic.npz"}[table]
        file = f"{table}/{self.version}/{key}_{ending}"
        return {"token": key, "sample_data_token": key, "filename": file}

    def _object_rows(self) -> Iterator[tuple[str, Row]]:
        """Rows of all objects, each from the first to the last key frame that shows it."""
        tracks: dict[int, list[tuple[int, Row]]] = {}
        for k, key in enumerate(self.keys):
            for box in self.frames[key].row["boxes"]:
                track = tracks.setdefault(box["id"], [])
                if box["seen"] or track:
                    track.append((k, box))
        for number, track in sorted(tracks.items()):
            while track and not track[-1][1]["seen"]:
                track.pop()
            if track:
                yield from self._track_rows(number, track)

    def _track_rows(
        self, number: int, track: Sequence[tuple[int, Row]]
    ) -> Iterator[tuple[str, Row]]:
        instance = self.token("instance", self.number, number)
        indices = [self.frames[self.keys[k]].index for k, _ in track]
        tokens = ["", *(self.token("sample_annotation", i, number) for i in indices), ""]
        yield (
            "instance",
            {
                "token": instance,
                "category_token": self.token("category", track[0][1]["category"]),
                "nbr_annotations": len(track),
                "first_annotation_token": tokens[1],
                "last_annotation_token": tokens[-2],
            },
        )
        for n, (k, box) in enumerate(track, 1):
            attribute = box["attribute"]
            yield (
                "sample_annotation",
                {
                    "token": tokens[n],
                    "sample_token": self._sample_token(k),
                    "instance_token": instance,
                    "visibility_token": box["visibility"],
                    "attribute_tokens": [self.token("attribute", attribute)] if attribute else [],
                    "translation": box["translation"],
                    "size": box["size"],
                    "rotation": box["rotation"],
                    "num_lidar_pts": box["lidar"],
                    "num_radar_pts": box["radar"],
                    "prev": tokens[n - 1],
                    "next": tokens[n + 1],
                },
            )


def reading_file(frame: Frame, channel: str, reading: Row, *, is_key: bool) -> str:
    """Path of a reading in the data set; images have the same stem as in COCO."""
    folder = "samples" if is_key else "sweeps"
    stem = f"{frame.index:09d}_{reading['sensor']}"
    return f"{folder}/{channel}/{stem}{reading['suffix']}"


def key_frames(frames: Sequence[Frame], period_s: float) -> list[int]:
    """Positions of frames with a scan of the top lidar, at least a period apart."""
    keys: list[int] = []
    last_s = -math.inf
    for k, frame in enumerate(frames):
        reading = frame.row["readings"].get(LIDAR_TOP)
        if reading is not None and reading["time_s"] >= last_s + period_s - 1e-6:
            keys.append(k)
            last_s = reading["time_s"]
    return keys
