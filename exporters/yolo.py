"""YOLO, as Ultralytics reads it: a data set per task, with one text file per image.

::

    detect/data.yaml                                classes from 0, and the folders of each split
    detect/images/<split>/000000012_color.png       detect/labels/<split>/000000012_color.txt
    segment/...   pose/...   obb/...

Rows are ``class x y ...``, all coordinates divided by the width or height of the image. An image
without objects has an empty file.

* ``detect``: centre, width and height of the box around the visible pixels.
* ``segment``: one polygon around the visible pixels, 0.02 px inside their edges, which OpenCV draws
  exactly; lines without area join its parts and lead to its holes.
* ``obb``: four corners of the smallest rotated rectangle around the visible pixels that lies inside
  the image.
* ``pose``: the box, then ``x y visibility`` of every keypoint of one category (0 = not in the
  image, 1 = hidden, 2 = visible). Objects of other categories are not listed; if no object has
  keypoints, there is no such folder.

Ignored objects are left out: the format cannot exclude a region from training. Equal rows of one
image are written once, as Ultralytics removes repetitions. ``train`` and ``val`` are required:
a data set without one of them names the other split twice.

Reference: https://docs.ultralytics.com/datasets, and ``ultralytics.data.utils``.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from gen_data.core import boxes, skeletons
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import KeypointTruth, ObjectTruth, Sample
from gen_data.core.se3 import Array
from gen_data.exporters import base, coco, fragments, image_files, sensor_selection
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.mask_polygons import (
    Polygon,
    drawable_polygons,
    join_polygons,
    mask_polygons,
)
from gen_data.exporters.sequences import write_text

Task = Literal["detect", "segment", "pose", "obb"]
SPLITS = ("train", "val", "test")
PEOPLE = ("person", "pedestrian")
"""Categories whose keypoints are preferred if none is named."""
_OTHER_SIDE = {"left": "right", "right": "left", "l": "r", "r": "l"}
"""Words in names of keypoints; not the letters of ``L1``."""


class Yolo(base.ExporterBase):
    """YOLO data sets of all cameras with the rgb channel, one per task."""

    type: Literal["yolo"] = "yolo"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="centre and size along the edges of pixels, as fractions of width and height",
        lens=ANY_LENS,
    )

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    tasks: tuple[Task, ...] = Field(("detect", "segment"), min_length=1)
    """Tasks to write: ``detect``, ``segment``, ``pose`` (keypoints) and ``obb`` (rotated boxes)."""
    pose_category: str = ""
    """Category of the task pose; empty = people, else the first category with keypoints."""

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that the tasks require."""
        of_task = {"segment": "instance_masks", "obb": "instance_masks", "pose": "keypoints"}
        return frozenset(of_task[task] for task in self.tasks if task in of_task)

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or there is no such category.
        """
        sensor_selection.check_channels(info, (), self.type)
        if self.pose_category and self.pose_category not in info.categories:
            raise ConfigError(
                f"exporter '{self.type}': pose_category: there is no category "
                f"'{self.pose_category}'{did_you_mean(self.pose_category, info.categories)}"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a JSON line per image with the rows of each task.

        Raises:
            ConfigError: see ``check``.
        """
        self.check(info)
        rows: dict[str, list[dict[str, Any]]] = {}
        names: dict[int, dict[str, None]] = {}
        for sample, sensor in sensor_selection.photographs(info, samples):
            row = self._image_row(info, sample, sensor)
            rows.setdefault(f"{sample.split}.images", []).append(row)
            for thing in (t for t in sample.truth[sensor].objects if not t.ignored):
                listed = names.setdefault(thing.instance.category_id, {})
                listed.update((p.name, None) for p in thing.keypoints or ())
        points = [{"category_id": k, "names": list(names[k])} for k in sorted(names) if names[k]]
        fragments.write_fragments(shard_dir / self.type, {**rows, "keypoints": points})

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the labels of each image and task, and link the images."""
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        pose = self._pose(info, folders) if "pose" in self.tasks else None
        tasks = [task for task in dict.fromkeys(self.tasks) if task != "pose" or pose]
        written = [s for s in SPLITS if any((f / f"{s}.images.jsonl").exists() for f in folders)]
        for split in written:
            for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, f"{split}.images"):
                source = info.media_path(shard_dir, row["sensor"], Channel.RGB, row["sample"])
                for task in tasks:
                    rows = pose.rows(row["pose"]) if task == "pose" and pose else row[task]
                    name = str(row["file_name"])
                    label = dataset_dir / f"{task}/labels/{split}/{name.rpartition('.')[0]}.txt"
                    write_text(label, "".join(f"{line}\n" for line in dict.fromkeys(rows)))
                    image_files.link_or_copy(source, dataset_dir / f"{task}/images/{split}/{name}")
        for task in tasks:
            text = data_text(info, task, written, pose if task == "pose" else None)
            write_text(dataset_dir / task / "data.yaml", text)

    def _image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        camera = sample.truth[sensor].camera.intrinsics
        size = np.array([camera.width_px, camera.height_px], np.float64)
        listed = [t for t in sample.truth[sensor].objects if t.box is not None and not t.ignored]
        form: dict[str, Callable[[ObjectTruth], Any]] = {
            "detect": partial(_detect_row, size),
            "segment": partial(_segment_row, size),
            "pose": partial(_pose_row, size),
            "obb": partial(_obb_row, size),
        }
        return {
            "file_name": coco.image_name(
                sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix
            ),
            "sensor": sensor,
            "sample": sample.index,
            **{task: [form[task](thing) for thing in listed] for task in self.tasks},
        }

    def _pose(self, info: DatasetInfo, folders: Sequence[Path]) -> "_Pose | None":
        """Category and keypoints of the task pose; None if no object has keypoints."""
        names: dict[int, dict[str, None]] = {}
        for line in fragments.fragment_lines(folders, "keypoints"):
            row = json.loads(line)
            names.setdefault(row["category_id"], {}).update(dict.fromkeys(row["names"]))
        by_name = {info.categories[k - 1]: k for k in sorted(names)}
        wanted = [self.pose_category] if self.pose_category else [*PEOPLE, *by_name]
        chosen = next((name for name in wanted if name in by_name), None)
        if chosen is None:
            return None
        number = by_name[chosen]
        return _Pose(chosen, number, skeletons.find_skeleton(names[number]).names)


class _Pose:
    """Category of the task pose.

    Attributes:
        category: Name of the category; its class is 0.
        names: Keypoints in the order of the rows.
    """

    def __init__(self, category: str, category_id: int, names: tuple[str, ...]) -> None:
        self.category, self.category_id, self.names = category, category_id, names

    def rows(self, listed: Iterable[Mapping[str, Any]]) -> Iterator[str]:
        """Rows of the objects of the category; absent keypoints are ``0 0 0``."""
        for thing in listed:
            if thing["category_id"] == self.category_id:
                points = [thing["points"].get(name, "0 0 0") for name in self.names]
                yield " ".join(["0", thing["box"], *points])

    @property
    def flipped(self) -> list[int]:
        """Index of each keypoint in a mirrored image: left and right change places."""
        places = {name: k for k, name in enumerate(self.names)}
        return [places.get(_mirrored(name), k) for k, name in enumerate(self.names)]


def data_text(
    info: DatasetInfo, task: Task, written: Sequence[str], pose: _Pose | None = None
) -> str:
    """Text of ``data.yaml``. Its paths are relative to its folder; JSON strings are valid YAML.

    Args:
        info: The data set.
        task: The task.
        written: Splits with images, at least one.
        pose: Keypoints of the task pose.
    """
    classes = [pose.category] if pose else info.categories
    lines = [f"# {info.name}: YOLO, task {task}"]
    for split in SPLITS:
        if split in written:
            lines.append(f"{split}: images/{split}")
        elif split != "test":
            lines.append(f"{split}: images/{written[0]}  # the data set has no split {split}")
    if pose:
        lines += [f"kpt_shape: [{len(pose.names)}, 3]", f"flip_idx: {pose.flipped}"]
        lines += ["kpt_names:", f"  0: {json.dumps(list(pose.names), ensure_ascii=False)}"]
    lines.append("names:")
    lines += [f"  {k}: {json.dumps(name, ensure_ascii=False)}" for k, name in enumerate(classes)]
    return "".join(f"{line}\n" for line in lines)


def inner_rectangle(points: Polygon, width_px: int, height_px: int) -> Array:
    """Find the smallest rectangle around points with all corners in the image.

    A smallest rectangle has a side on the convex hull (Freeman and Shapira, 1975). One along the
    axes of the image is always inside.

    Args:
        points: Inside the image [px], int64 [n, 2], not all on one line.
        width_px: Width of the image.
        height_px: Height of the image.

    Returns:
        Corners [4, 2] in order.
    """
    hull = cv2.convexHull(points.astype(np.int32))[:, 0].astype(np.float64)
    edges = np.roll(hull, -1, axis=0) - hull
    along = np.concatenate([[[1.0, 0.0]], edges / np.hypot(*edges.T)[:, None]])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # Coordinates along the axes of each direction, [directions, points].
    u = hull[:, 0] * along[:, :1] + hull[:, 1] * along[:, 1:]
    v = hull[:, 0] * across[:, :1] + hull[:, 1] * across[:, 1:]
    u0, u1, v0, v1 = u.min(axis=1), u.max(axis=1), v.min(axis=1), v.max(axis=1)
    ends = ((u0, v0), (u1, v0), (u1, v1), (u0, v1))
    corners = np.stack([a[:, None] * along + b[:, None] * across for a, b in ends], axis=1)
    slack_px = 1e-6
    limits = np.array([width_px, height_px]) + slack_px
    inside = np.all((corners >= -slack_px) & (corners <= limits), axis=(1, 2))
    candidates = np.where(inside, (u1 - u0) * (v1 - v0), np.inf)
    candidates[0] = (u1[0] - u0[0]) * (v1[0] - v0[0])
    found: Array = corners[int(np.argmin(candidates))]
    return found


def _detect_row(size: Array, thing: ObjectTruth) -> str:
    return f"{thing.instance.category_id - 1} {_box(size, thing.box)}"


def _segment_row(size: Array, thing: ObjectTruth) -> str:
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    outline = join_polygons(drawable_polygons(thing.mask))
    return f"{thing.instance.category_id - 1} {_coordinates(outline / size)}"


def _obb_row(size: Array, thing: ObjectTruth) -> str:
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    points = np.concatenate(mask_polygons(thing.mask))
    corners = inner_rectangle(points, int(size[0]), int(size[1]))
    return f"{thing.instance.category_id - 1} {_coordinates(np.clip(corners / size, 0.0, 1.0))}"


def _pose_row(size: Array, thing: ObjectTruth) -> dict[str, Any]:
    """Facts of an object; its row needs the skeleton, which is known after all shards."""
    return {
        "category_id": thing.instance.category_id,
        "box": _box(size, thing.box),
        "points": {point.name: _keypoint(size, point) for point in thing.keypoints or ()},
    }


def _keypoint(size: Array, point: KeypointTruth) -> str:
    if point.visibility == 0:
        return "0 0 0"
    return f"{_coordinates(np.array(point.image_px) / size)} {point.visibility}"


def _box(size: Array, box: boxes.BoxPx | None) -> str:
    assert box is not None, "invisible objects are not listed"
    corners = np.array([[box.x_min, box.y_min], [box.x_max, box.y_max]]) / size
    return _coordinates(np.stack([0.5 * (corners[0] + corners[1]), corners[1] - corners[0]]))


def _coordinates(values: Array) -> str:
    return " ".join(["%.7f"] * values.size) % tuple(values.ravel().tolist())


def _mirrored(name: str) -> str:
    """Name of a keypoint with left and right exchanged, however it joins words."""

    def other_side(found: re.Match[str]) -> str:
        word = found.group()
        other = _OTHER_SIDE.get(word.lower(), "")
        is_number = len(word) == 1 and name[found.end() :][:1].isdigit()
        if not other or is_number:
            return word
        return other.upper() if word.isupper() else other.title() if word.istitle() else other

    return re.sub("[A-Z]?[a-z]+|[A-Z]+", other_side, name)
