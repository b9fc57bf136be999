"""Streams of the labels of an exported data set (COCO's, or else KITTI's) and of KITTI's scans.

COCO files are read line by line, with an image or annotation per line as
``gen_data.exporters.coco`` writes them: memory does not grow with the data set.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gen_data.core import scene, se3
from gen_data.core.errors import StorageError, no_folder
from gen_data.exporters.kitti import occlusion_level, official_type

INSTANCES = "instances_"
SCANS_MAX = 200
"""Largest number of scans to read, chosen evenly: scans are similar."""


@dataclass(frozen=True, slots=True)
class Label:
    """One object in one image.

    Attributes:
        image: Split and name of its image.
        kind: KITTI's type.
        occlusion_level: KITTI's 0, 1, 2; None = not annotated.
        truncation, visible_fraction: Fractions; None = not annotated.
        distance_m: Horizontal distance from the camera to the box's centre; None = not annotated.
        size_lwh_m: Length (along X), width, height; None = not annotated.
        asset: Id of its asset; empty = not known.
    """

    image: tuple[str, str]
    category: str
    kind: str
    width_px: float
    height_px: float
    occlusion_level: int | None = None
    truncation: float | None = None
    visible_fraction: float | None = None
    distance_m: float | None = None
    size_lwh_m: se3.Vec3 | None = None
    asset: str = ""


@dataclass(frozen=True, slots=True)
class Points:
    """Numbers of keypoints of one object: outside the image, hidden, and visible."""

    category: str
    counts: tuple[int, int, int]


class Picture(NamedTuple):
    """An image, with or without objects."""

    split: str
    name: str


@dataclass(frozen=True, slots=True)
class Scan:
    """One sweep.

    Attributes:
        points: Number of points.
        dark: Number of points with reflectance 0.
        cars: Horizontal distance [m] and number of points of every unoccluded car.
    """

    points: int
    dark: int
    cars: tuple[tuple[float, int], ...]


def read_records(folder: Path) -> Iterator[Picture | Label | Points]:
    """Yield all images, then all objects, of each file of a data set.

    Args:
        folder: Folder of a data set (with ``coco/`` or ``kitti/``), or of one of its formats.

    Raises:
        StorageError: no labels are found, or a file does not have the expected layout.
    """
    for root in (folder / "coco", folder):
        files = sorted((root / "annotations").glob("*.json"))
        if files:
            for path in files:
                yield from _read_coco(path)
            return
    for root in (folder / "kitti", folder):
        if (root / "training" / "label_2").is_dir():
            yield from _read_kitti(root)
            return
    if not folder.exists():
        raise StorageError(no_folder(folder))
    raise StorageError(
        f"{folder}: there are no labels in coco/annotations or kitti/training/label_2; expected "
        "the folder of a data set exported as coco or kitti"
    )


def _read_coco(path: Path) -> Iterator[Picture | Label | Points]:
    kind, _, split = path.stem.rpartition("_")
    names: dict[int, str] = {}
    points = kind != INSTANCES.rstrip("_")
    for section, row in _rows(path):
        if section == "categories":
            names[row["id"]] = row["name"]
        elif section == "annotations":
            category = names[row["category_id"]]
            yield _points(category, row) if points else _label(split, category, row)
        elif not points:
            yield Picture(split, str(row["id"]))


def _rows(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    with path.open(encoding="utf-8", newline="\n") as file:
        head = file.readline().rstrip("\n,")
        section = ""
        try:
            for category in json.loads(head + "}")["categories"]:
                yield "categories", category
            for line in file:
                if line.startswith('"'):
                    section = line.split('"')[1]
                elif line.startswith("{"):
                    yield section, json.loads(line.rstrip(",\n"))
        except (ValueError, KeyError) as error:
            raise StorageError(
                f"{path}: not written by gen-data (an image or annotation per line): {error}"
            ) from error


def _label(split: str, category: str, row: dict[str, Any]) -> Label:
    facts = {k: v for k, v in row.get("attributes", {}).items() if isinstance(v, str)}
    instance = scene.Instance(
        row["id"], "", category, row["category_id"], "", attributes=tuple(sorted(facts.items()))
    )
    hidden = row.get("occlusion")
    box = row.get("box3d")
    return Label(
        (split, str(row["image_id"])),
        category,
        official_type(instance),
        row["bbox"][2],
        row["bbox"][3],
        None if hidden is None else occlusion_level(hidden),
        row.get("truncation"),
        row.get("visible_fraction"),
        None if box is None else math.hypot(box["center_m"][0], box["center_m"][2]),
        None if box is None else tuple(box["size_m"]),
        row.get("attributes", {}).get("asset", ""),
    )


def _points(category: str, row: dict[str, Any]) -> Points:
    states = row["keypoints"][2::3]
    return Points(category, (states.count(0), states.count(1), states.count(2)))


def _read_kitti(root: Path) -> Iterator[Picture | Label]:
    for listing in sorted((root / "ImageSets").glob("*.txt")):
        for frame in listing.read_text(encoding="utf-8").split():
            yield Picture(listing.stem, frame)
            path = root / f"training/label_2/{frame}.txt"
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if not line.startswith("DontCare"):
                    yield _kitti_label(f"{path}:{number}", (listing.stem, frame), line)


def _kitti_label(place: str, image: tuple[str, str], line: str) -> Label:
    kind, *texts = line.split(" ")
    try:
        truncated, level, _, left, top, right, bottom, h, w, length, x, _, z, _ = map(float, texts)
    except ValueError as error:
        raise StorageError(f"{place}: not the 15 columns of a KITTI label: {error}") from error
    return Label(
        image,
        kind,
        kind,
        right - left + 1,
        bottom - top + 1,
        int(level),
        truncated,
        distance_m=math.hypot(x, z),
        size_lwh_m=(length, w, h),
    )


def read_scans(folder: Path) -> Iterator[Scan]:
    """Read the scans of a data set, or of its ``kitti`` folder; none without a laser scanner.

    Raises:
        StorageError: a file does not have the expected layout.
    """
    for root in (folder / "kitti/training", folder / "training"):
        labelled = sorted((root / "velodyne_labels").glob("*.label"))
        for path in labelled[:: max(1, math.ceil(len(labelled) / SCANS_MAX))]:
            yield _read_scan(root, path)


def _read_scan(root: Path, path: Path) -> Scan:
    try:
        points = np.fromfile(root / f"velodyne/{path.stem}.bin", "<f4").reshape(-1, 4)
        rows = np.fromfile(path, "<u4") >> np.uint32(16)
        lines = (root / f"label_2/{path.stem}.txt").read_text(encoding="utf-8").splitlines()
        if len(rows) != len(points):
            raise ValueError(f"{len(rows)} labels for {len(points)} points")
        counts = np.bincount(rows, minlength=len(lines) + 1)
        labels = [line.split(" ") for line in lines]
        cars = tuple(
            (math.hypot(float(label[11]), float(label[13])), int(counts[number]))
            for number, label in enumerate(labels, 1)
            if label[0] == "Car" and label[2] == "0"
        )
    except (OSError, ValueError, IndexError) as error:
        raise StorageError(f"{path}: not a scan with labels in KITTI's format: {error}") from error
    return Scan(len(points), int((points[:, 3] == 0.0).sum()), cars)
