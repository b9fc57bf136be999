"""Labels of a finished data set, streamed from its shards, and the statistics of its objects.

Lines of ``labels.jsonl`` are parsed as plain JSON, one at a time: building every annotation as a
typed value would take most of the time of a report.
"""

import json
import math
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import errors, scene, se3, serialization
from gen_data.exporters.kitti import occlusion_level, official_type
from gen_data.report.label_files import Label, Picture, Points
from gen_data.report.label_statistics import Column, Survey, add_record
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.stored import StoredSamples

COLUMNS = (
    "index", "camera", "category", "width_px", "height_px", "visible_px", "visible_fraction",
    "occlusion", "truncation", "distance_m", "azimuth_rad", "elevation_rad", "lidar_points",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ImageLabels:
    """Labels of one image, as plain JSON values.

    Attributes:
        index: Number of the sample.
        truth: The image's ``ImageTruth``; an object's ``instance`` is the whole instance.
    """

    index: int
    split: str
    camera: str
    truth: Mapping[str, Any]

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        intrinsics = self.truth["camera"]["intrinsics"]
        return intrinsics["width_px"], intrinsics["height_px"]

    @property
    def objects(self) -> list[dict[str, Any]]:
        """The image's objects: plain ``ObjectTruth``; annotations that are None may be absent."""
        objects: list[dict[str, Any]] = self.truth["objects"]
        return objects


@dataclass
class ObjectStatistics:
    """Statistics of all objects and images of a data set.

    Attributes:
        survey: Statistics for the tables of any report.
        rows: Rows of ``COLUMNS``, one per object; NaN = not annotated. ``camera`` and ``category``
            are positions in ``cameras`` and ``categories``.
        splits: Split of each sample by its number.
    """

    cameras: tuple[str, ...]
    categories: tuple[str, ...]
    survey: Survey = field(default_factory=Survey)
    rows: "array[float]" = field(default_factory=lambda: array("d"))
    splits: dict[int, str] = field(default_factory=dict)

    def columns(self) -> dict[str, Column]:
        """All columns, float64 [objects]."""
        table = np.array(self.rows).reshape(-1, len(COLUMNS))
        return {name: table[:, k] for k, name in enumerate(COLUMNS)}

    def add(self, image: ImageLabels) -> None:
        """Count an image and its objects."""
        self.splits[image.index] = image.split
        add_record(self.survey, Picture(image.split, _image_name(image)))
        for item in image.objects:
            for record in _records(image, item):
                add_record(self.survey, record)
            self.rows.extend(self._row(image, item))

    def _row(self, image: ImageLabels, item: Mapping[str, Any]) -> tuple[float, ...]:
        box = item.get("box")
        width_px = math.nan if box is None else box["x_max"] - box["x_min"]
        height_px = math.nan if box is None else box["y_max"] - box["y_min"]
        points = item.get("lidar_points")
        fractions = (item.get(k) for k in ("visible_fraction", "occlusion", "truncation"))
        category = item["instance"]["category"]
        return (
            image.index,
            self.cameras.index(image.camera),
            self.categories.index(category) if category in self.categories else -1,
            width_px,
            height_px,
            item["visible_px"],
            *(math.nan if value is None else value for value in fractions),
            distance_m(item),
            *_viewpoint(item),
            math.nan if not points else sum(points.values()),
        )


def read_images(stored: StoredSamples) -> Iterator[ImageLabels]:
    """Yield the labels of every image of a data set, in order of samples and cameras.

    Raises:
        StorageError: a file of labels is missing or damaged.
    """
    for shard in range(stored.plan.shard_count):
        path = stored.shard_dir(shard) / LABELS_NAME
        try:
            with path.open(encoding="utf-8") as file:
                for line in file:
                    yield from _parse_line(line)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise errors.StorageError(
                f"{path}: its labels cannot be read ({error}); check the data set with:\n"
                f"    gen-data verify {stored.folder} --full"
            ) from error


def _parse_line(line: str) -> Iterator[ImageLabels]:
    row = json.loads(line)
    instances = {i["instance_id"]: i for i in row["instances"]}
    for camera, truth in sorted(row["truth"].items()):
        for item in truth["objects"]:
            if isinstance(item["instance"], int):
                item["instance"] = instances[item["instance"]]
        yield ImageLabels(row["index"], row["split"], camera, truth)


def decode_mask(mask: Mapping[str, Any]) -> NDArray[np.bool_]:
    """Pixels of a plain ``MaskPx``, bool [h, w]."""
    pixels: NDArray[np.bool_] = serialization.from_plain(np.ndarray[Any, Any], mask["pixels"])
    return pixels


def distance_m(item: Mapping[str, Any]) -> float:
    """Distance from the camera's centre to the centre of the 3D box [m]; NaN without one."""
    box = item.get("box3d_camera")
    return math.nan if box is None else math.hypot(*box["T_frame_box"]["translation_m"])


def _viewpoint(item: Mapping[str, Any]) -> tuple[float, float]:
    """Azimuth and elevation of the camera, seen from an object [rad]; NaN without a pose.

    In the frame of the object: azimuth 0 is on its +X side and pi/2 on its +Y side.
    """
    box = item.get("box3d_camera")
    pose = item.get("T_camera_object") or (box and box["T_frame_box"])
    if pose is None:
        return math.nan, math.nan
    x, y, z = serialization.from_plain(se3.SE3, pose).inverse().translation_m
    return math.atan2(y, x), math.atan2(z, math.hypot(x, y))


def _image_name(image: ImageLabels) -> str:
    return f"{image.index}_{image.camera}"


def _records(image: ImageLabels, item: Mapping[str, Any]) -> Iterator[Label | Points]:
    """Records of an object for the tables of any report; none for one without visible pixels."""
    box, plain = item.get("box"), item["instance"]
    if box is None:
        return
    attributes = tuple((name, value) for name, value in plain["attributes"])
    instance = scene.Instance(0, "", plain["category"], 0, "", attributes=attributes)
    hidden, box3d = item.get("occlusion"), item.get("box3d_camera")
    center_m = box3d and box3d["T_frame_box"]["translation_m"]
    yield Label(
        (image.split, _image_name(image)),
        plain["category"],
        official_type(instance),
        box["x_max"] - box["x_min"],
        box["y_max"] - box["y_min"],
        None if hidden is None else occlusion_level(hidden),
        item.get("truncation"),
        item.get("visible_fraction"),
        None if center_m is None else math.hypot(center_m[0], center_m[2]),
        None if box3d is None else tuple(box3d["size_m"]),
        plain["asset"],
    )
    points = item.get("keypoints")
    if points:
        states = [point["visibility"] for point in points]
        yield Points(plain["category"], (states.count(0), states.count(1), states.count(2)))
