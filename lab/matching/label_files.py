"""Boxes in label files of users, in the layouts of COCO and KITTI."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gen_data.core.errors import StorageError

OCCLUSION_LEVELS = ("visible", "partly occluded", "largely occluded")
"""KITTI's levels 0, 1 and 2; its level 3 is "unknown"."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class RealObject:
    """A labelled object.

    Attributes:
        name: Its class; empty = a region of objects of any class, which is always ignored.
        box: ``x_min, y_min, x_max, y_max`` [px], half-open.
        is_ignored: It counts neither as an object nor as background.
        occlusion: One of ``OCCLUSION_LEVELS``; empty = not annotated.
    """

    name: str
    box: Box
    is_ignored: bool = False
    occlusion: str = ""


@dataclass(frozen=True, slots=True)
class CocoImage:
    """An image of a COCO file.

    Attributes:
        file_name: As stated; empty = not stated.
        size_px: Stated width and height; 0 = not stated.
    """

    image_id: int
    file_name: str
    size_px: tuple[int, int]
    objects: tuple[RealObject, ...]


@dataclass(frozen=True)
class CocoLabels:
    """Content of a COCO file.

    Attributes:
        images: In the order of the file.
        category_ids: By name.
        empty: Number of objects without an area, which are left out.
    """

    images: tuple[CocoImage, ...]
    category_ids: Mapping[str, int]
    empty: int


def read_coco(path: Path) -> CocoLabels:
    """Read a file of annotations. Raises StorageError if it does not have COCO's layout."""
    try:
        content = json.loads(path.read_bytes())
        names = {row["id"]: str(row["name"]) for row in content["categories"]}
        objects: dict[Any, list[RealObject]] = {row["id"]: [] for row in content["images"]}
        empty = 0
        for row in content["annotations"]:
            x, y, width, height = map(float, row["bbox"])
            if not (width > 0 and height > 0):
                empty += 1
                continue
            objects[row["image_id"]].append(
                RealObject(
                    names[row["category_id"]],
                    (x, y, x + width, y + height),
                    bool(row.get("iscrowd", 0)),
                    _occlusion(row.get("occlusion")),
                )
            )
        images = tuple(
            CocoImage(
                row["id"],
                str(row.get("file_name", "")),
                (int(row.get("width", 0)), int(row.get("height", 0))),
                tuple(objects[row["id"]]),
            )
            for row in content["images"]
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise StorageError(f"{path}: not annotations in COCO's format: {error!r}") from error
    return CocoLabels(images, {name: number for number, name in names.items()}, empty)


def read_kitti(path: Path) -> tuple[RealObject, ...]:
    """Read the labels of one image. Raises StorageError with the line that is not KITTI's."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise StorageError(f"{path}: not labels in KITTI's format: {error}") from error
    return tuple(_kitti_object(f"{path}:{number}", line) for number, line in enumerate(lines, 1))


def _kitti_object(place: str, line: str) -> RealObject:
    try:
        kind, _, level, _, *sides = line.split()[:8]
        x0, y0, x1, y1 = map(float, sides)
        occluded = int(float(level))
    except ValueError as error:
        raise StorageError(f"{place}: not a label in KITTI's format: {error}") from error
    # KITTI's sides are inclusive pixel numbers.
    box = (x0, y0, x1 + 1.0, y1 + 1.0)
    if kind == "DontCare":
        return RealObject("", box, True)
    known = 0 <= occluded < len(OCCLUSION_LEVELS)
    return RealObject(kind, box, False, OCCLUSION_LEVELS[occluded] if known else "")


def _occlusion(value: Any) -> str:
    """The level of a hidden fraction, by the bounds of ``gen_data.exporters.kitti``."""
    if isinstance(value, str):
        return value if value in OCCLUSION_LEVELS else ""
    if not isinstance(value, (int, float)):
        return ""
    from gen_data.exporters.kitti import occlusion_level

    return OCCLUSION_LEVELS[occlusion_level(float(value))]
