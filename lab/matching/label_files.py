"""Boxes in label files of users, in the layouts of COCO, KITTI, YOLO and Pascal VOC."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml

from gen_data.core.errors import StorageError
from gen_data.exporters.kitti_boxes import UprightBox

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
        truncation: Share outside the image; VOC has 0 and 1 only. None = not annotated.
        box3d: In the frame of the camera; None = not annotated.
    """

    name: str
    box: Box
    is_ignored: bool = False
    occlusion: str = ""
    truncation: float | None = None
    box3d: UprightBox | None = None


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
        for kind, name in (("images", "file_name"), ("categories", "name")):
            rows = {(row["id"], row.get(name)) for row in content[kind]}
            if len(rows) > len({number for number, _ in rows}):
                raise ValueError(f"{kind} share an id; expected one each")
        is_level = any(_number(row.get("occlusion")) > 1.0 for row in content["annotations"])
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
                    _occlusion(row.get("occlusion"), is_level),
                    _share(row.get("truncation")),
                )
            )
        images = tuple(
            CocoImage(
                row["id"],
                _posix(row.get("file_name", "")),
                (int(row.get("width", 0)), int(row.get("height", 0))),
                tuple(objects[row["id"]]),
            )
            for row in content["images"]
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise StorageError(f"{path}: not annotations in COCO's format: {error!r}") from error
    return CocoLabels(images, {name: number for number, name in names.items()}, empty)


def _posix(name: object) -> str:
    """A path as tools on Windows write it, too."""
    return str(name).replace("\\", "/")


def read_kitti(path: Path) -> tuple[RealObject, ...]:
    """Read the labels of one image. Raises StorageError with the line that is not KITTI's."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        raise StorageError(f"{path}: not labels in KITTI's format: {error}") from error
    return tuple(
        _kitti_object(f"{path}:{number}", line)
        for number, line in enumerate(lines, 1)
        if line.strip()
    )


def _kitti_object(place: str, line: str) -> RealObject:
    try:
        kind, truncated, level, _, *sides = line.split()[:8]
        x0, y0, x1, y1 = map(float, sides)
        outside, occluded = float(truncated), int(float(level))
        metric = tuple(map(float, line.split()[8:15]))
    except ValueError as error:
        raise StorageError(f"{place}: not a label in KITTI's format: {error}") from error
    # KITTI's sides are inclusive pixel numbers.
    box = (x0, y0, x1 + 1.0, y1 + 1.0)
    if kind == "DontCare":
        return RealObject("", box, True)
    known = 0 <= occluded < len(OCCLUSION_LEVELS)
    return RealObject(
        kind,
        box,
        False,
        OCCLUSION_LEVELS[occluded] if known else "",
        outside if outside >= 0.0 else None,
        # Labels of 2D boxes alone have no further columns, or -1 as sizes.
        UprightBox(metric[:3], metric[3:6], metric[6])
        if len(metric) == 7 and metric[0] > 0.0
        else None,
    )


def read_yolo_classes(path: Path) -> tuple[list[str], bool]:
    """Class names of ``data.yaml`` or ``classes.txt``, and whether rows have keypoints.

    Raises:
        StorageError: the file has another layout.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        if path.suffix not in (".yaml", ".yml"):
            return [line.strip() for line in text.rstrip().splitlines()], False
        content = yaml.safe_load(text)
        names = content["names"]
        listed = [names[k] for k in range(len(names))]
        return [str(name) for name in listed], "kpt_shape" in content
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise StorageError(f"{path}: no list of classes in YOLO's format: {error!r}") from error


def yolo_images(path: Path, split: str = "") -> list[Path]:
    """Folders, lists and images that ``data.yaml`` names as its splits, where they exist.

    ``split`` is a part of the name of the wanted ones, empty = all. Names refer to its ``path``,
    or to its own folder where there is no such path.
    """
    if path.suffix not in (".yaml", ".yml"):
        return []
    content = yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    base = path.parent / str(content.get("path") or "")
    base = base if base.is_dir() else path.parent
    found = []
    for key in ("train", "val", "test"):
        stated = (content.get(key) or []) if split in key else []
        for name in [stated] if isinstance(stated, str) else stated:
            # Roboflow writes ../train/images for train/images.
            places = (base / str(name), base / str(name).removeprefix("../"))
            found += list(filter(Path.exists, places))[:1]
    return list(dict.fromkeys(found))


def read_yolo(path: Path, names: Sequence[str], has_keypoints: bool) -> tuple[RealObject, ...]:
    """Read the labels of one image; boxes are in shares of its width and height.

    Rows have a class and a box (centre and size), or the corners of a polygon, whose tight box is
    taken, as Ultralytics does.

    Raises:
        StorageError: a line has another layout.
    """
    objects = []
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        raise StorageError(f"{path}: not labels in YOLO's format: {error}") from error
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            kind, *values = map(float, line.split())
            if len(values) == 4 or has_keypoints:
                x, y, w, h = values[:4]
                box = (x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h)
            elif len(values) >= 6 and len(values) % 2 == 0:
                xs, ys = values[::2], values[1::2]
                box = (min(xs), min(ys), max(xs), max(ys))
            else:
                raise ValueError(f"{len(values) + 1} columns")
            if not 0 <= int(kind) < len(names):
                raise ValueError(f"class {kind:g}, expected 0 to {len(names) - 1}")
        except ValueError as error:
            raise StorageError(f"{path}:{number}: not a label in YOLO's format: {error}") from error
        objects.append(RealObject(names[int(kind)], box))
    return tuple(objects)


def read_voc(path: Path) -> tuple[str, tuple[int, int], tuple[RealObject, ...]]:
    """Read one XML file: name of the image, its size (0 = not stated), and its objects.

    Raises:
        StorageError: it has another layout.
    """
    try:
        root = ElementTree.parse(path).getroot()
        size = [int(root.findtext(f"size/{side}") or 0) for side in ("width", "height")]
        objects = tuple(_voc_object(item) for item in root.iter("object"))
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise StorageError(f"{path}: not annotations in VOC's format: {error}") from error
    return _posix(root.findtext("filename") or ""), (size[0], size[1]), objects


def _voc_object(item: ElementTree.Element) -> RealObject:
    name = item.findtext("name")
    sides = [item.findtext(f"bndbox/{side}") for side in ("xmin", "ymin", "xmax", "ymax")]
    if name is None or None in sides:
        raise ValueError("an object without a name or a box")
    x0, y0, x1, y1 = (float(side or "") for side in sides)
    occluded, truncated = item.findtext("occluded"), item.findtext("truncated")
    return RealObject(
        name,
        # Pixels count from 1, and the last one is included.
        (x0 - 1.0, y0 - 1.0, x1, y1),
        item.findtext("difficult") == "1",
        {"0": OCCLUSION_LEVELS[0], "1": OCCLUSION_LEVELS[1]}.get(occluded or "", ""),
        {"0": 0.0, "1": 1.0}.get(truncated or ""),
    )


def _occlusion(value: Any, is_level: bool) -> str:
    """The level of a hidden fraction, by the bounds of ``gen_data.exporters.kitti``.

    Some data sets number levels, as KITTI does: their files have numbers above 1.
    """
    if isinstance(value, str):
        return value if value in OCCLUSION_LEVELS else ""
    if is_level:
        number = _number(value)
        return dict(enumerate(OCCLUSION_LEVELS)).get(int(number), "") if number % 1.0 == 0.0 else ""
    share = _share(value)
    if share is None:
        return ""
    from gen_data.exporters.kitti import occlusion_level

    return OCCLUSION_LEVELS[occlusion_level(share)]


def _number(value: Any) -> float:
    """A number; -1 for anything else."""
    return float(value) if isinstance(value, (int, float)) else -1.0


def _share(value: Any) -> float | None:
    """A number from 0 to 1; None = something else."""
    number = _number(value)
    return number if 0.0 <= number <= 1.0 else None
