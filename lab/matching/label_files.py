"""Boxes in label files of users, in the layouts of COCO, KITTI, YOLO and Pascal VOC."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

import yaml

from gen_data.core.errors import StorageError
from gen_data.exporters.kitti_boxes import UprightBox

OCCLUSION_LEVELS = ("visible", "partly occluded", "largely occluded")
"""KITTI's levels 0, 1 and 2; its level 3 is "unknown"."""

Box = tuple[float, float, float, float]
V = TypeVar("V")

SHOWN_MAX = 60
"""Letters of a wrong value in a message."""
SHARE_MAX = 2.0
"""Boxes of YOLO with larger values are in pixels: in shares, they would be far outside."""
_KITTI_2D = ("truncated", "occluded", "alpha", "left", "top", "right", "bottom")
_KITTI_3D = ("height", "width", "length", "x", "y", "z", "rotation_y")


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
    """Read a file of annotations.

    Raises:
        StorageError: it does not have COCO's layout; with the row, the field and its value.
    """
    try:
        return _coco_labels(json.loads(path.read_bytes()))
    except (OSError, ValueError) as error:
        raise StorageError(f"{path}: not annotations in COCO's format: {error}") from error


def _coco_labels(content: Any) -> CocoLabels:
    names: dict[Any, str] = {}
    for place, row in _rows(content, "categories"):
        name = _field(place, row, "name", str, "a name")
        if names.setdefault(_id(place, row), name) != name:
            raise ValueError(f"{place}: categories share an id; expected one each")
    listed: dict[Any, Any] = {}
    for place, row in _rows(content, "images"):
        file_name = row.get("file_name")
        if listed.setdefault(_id(place, row), file_name) != file_name:
            raise ValueError(f"{place}: images share an id; expected one each")
    objects: dict[Any, list[RealObject]] = {number: [] for number in listed}
    annotations = _rows(content, "annotations")
    is_level = any(_number(row.get("occlusion")) > 1.0 for _, row in annotations)
    empty = 0
    for place, row in annotations:
        box = _field(place, row, "bbox", _coco_box, "four numbers: x, y, width, height")
        if not has_area(box):
            empty += 1
            continue
        _field(place, row, "image_id", objects.__getitem__, "the id of an image").append(
            RealObject(
                _field(place, row, "category_id", names.__getitem__, "the id of a category"),
                box,
                bool(row.get("iscrowd", 0)),
                _occlusion(row.get("occlusion"), is_level),
                _share(row.get("truncation")),
            )
        )
    images = tuple(
        CocoImage(
            row["id"],
            _posix(row.get("file_name", "")),
            (_pixels(place, row, "width"), _pixels(place, row, "height")),
            tuple(objects[row["id"]]),
        )
        for place, row in _rows(content, "images")
    )
    return CocoLabels(images, {name: number for number, name in names.items()}, empty)


def _rows(content: Any, kind: str) -> list[tuple[str, Mapping[str, Any]]]:
    """Rows of one of COCO's lists, with their places in words."""
    rows = content.get(kind) if isinstance(content, dict) else None
    if not isinstance(rows, list):
        raise ValueError(f"there is no list '{kind}'")
    placed: list[tuple[str, Mapping[str, Any]]] = []
    for number, row in enumerate(rows):
        if not isinstance(row, dict):
            raise ValueError(f"{kind}[{number}] is {_shown(row)}; expected fields in {{}}")
        placed.append((f"{kind}[{number}]", row))
    return placed


def _field(
    place: str, row: Mapping[str, Any], name: str, read: Callable[[Any], V], expected: str
) -> V:
    """The value of a field. Raises ValueError if it is missing, or ``read`` refuses it."""
    try:
        return read(row[name])
    except (KeyError, TypeError, ValueError, OverflowError):
        stated = f" (id {_shown(row['id'])})" if "id" in row else ""
        fact = f"{name} is {_shown(row[name])}" if name in row else f"there is no '{name}'"
        raise ValueError(f"{place}{stated}: {fact}; expected {expected}") from None


def _shown(value: Any) -> str:
    """A value of JSON in a line, cut."""
    text = json.dumps(value)
    return text if len(text) <= SHOWN_MAX else f"{text[:SHOWN_MAX]}..."


def _id(place: str, row: Mapping[str, Any]) -> Any:
    def read(value: Any) -> Any:
        hash(value)
        return value

    return _field(place, row, "id", read, "a number")


def _pixels(place: str, row: Mapping[str, Any], side: str) -> int:
    """Width or height; 0 = not stated."""
    return _field(place, {**row, side: row.get(side) or 0}, side, int, "a number of pixels")


def _coco_box(value: Any) -> Box:
    x, y, width, height = map(float, value)
    if not math.isfinite(x + y + width + height):
        raise ValueError
    return (x, y, x + width, y + height)


def _finite(value: Any, field: str) -> float:
    """A number. Raises ValueError with the field and its value."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{field} is {_shown(value)}; expected a number")
    return number


def has_area(box: Box, size_px: tuple[float, float] = (math.inf, math.inf)) -> bool:
    """Whether a box has an area, inside an image if its width and height are given.

    Without a size, places left of an image and above it count as well.
    """
    x0, y0, x1, y1 = box
    if not (x0 < x1 and y0 < y1):
        return False
    width, height = size_px
    return math.isinf(width) or (x1 > 0.0 and y1 > 0.0 and x0 < width and y0 < height)


def is_there(path: Path, kind: Callable[[Path], bool] = Path.is_file) -> bool:
    """Whether there is a file, or another kind of path; names may be too long to be any."""
    try:
        return kind(path)
    except OSError:
        return False


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
    kind, *texts = line.split()[:15]
    try:
        if len(texts) < len(_KITTI_2D):
            columns = f"{len(texts) + 1} columns; expected 15, or 8 without a box in space"
            raise ValueError(columns)
        # The viewing angle follows from the others.
        fields = (f for f in zip(_KITTI_2D + _KITTI_3D, texts, strict=False) if f[0] != "alpha")
        outside, level, x0, y0, x1, y1, *metric = (_finite(text, name) for name, text in fields)
    except ValueError as error:
        raise StorageError(f"{place}: not a label in KITTI's format: {error}") from error
    occluded = int(level)
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
        UprightBox((metric[0], metric[1], metric[2]), (metric[3], metric[4], metric[5]), metric[6])
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
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise StorageError(f"{path}: no file of YOLO's classes: {_yaml_fact(error)}") from error
    stated = content.get("names") if isinstance(content, dict) else None
    names = stated
    if isinstance(stated, dict) and stated.keys() == set(range(len(stated))):
        names = [stated[k] for k in range(len(stated))]
    if not isinstance(names, list):
        fact = "there are no 'names'" if stated is None else f"names is {str(stated)[:SHOWN_MAX]}"
        raise StorageError(
            f"{path}: no file of YOLO's classes: {fact}; expected a list, or numbers from 0 with "
            "names, such as names: [cup, plate]"
        )
    return [str(name) for name in names], "kpt_shape" in content


def _yaml_fact(error: Exception) -> str:
    """Line and fact of an error of syntax."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"line {error.problem_mark.line + 1}: {error.problem}"
    return str(error)


@dataclass(frozen=True)
class YoloSplits:
    """Splits of a ``data.yaml``.

    Attributes:
        places: Folders, lists and images that it names, where they exist.
        missing: Key and name of the others.
    """

    places: Sequence[Path] = ()
    missing: Sequence[tuple[str, str]] = ()


def yolo_splits(path: Path, split: str = "") -> YoloSplits:
    """Splits of a file that ``read_yolo_classes`` has read; none of a list of classes.

    ``split`` is a part of the name of the wanted ones, empty = all. Names refer to its ``path``,
    or to its own folder where there is no such path.
    """
    if path.suffix not in (".yaml", ".yml"):
        return YoloSplits()
    content = yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    base = path.parent / str(content.get("path") or "")
    base = base if is_there(base, Path.is_dir) else path.parent
    places, missing = [], []
    for key in ("train", "val", "test"):
        stated = (content.get(key) or []) if split in key else []
        for name in map(str, stated if isinstance(stated, list) else [stated]):
            # Roboflow writes ../train/images for train/images.
            options = (base / name, base / name.removeprefix("../"))
            found = next((path for path in options if is_there(path, Path.exists)), None)
            if found is None:
                missing.append((key, name))
            else:
                places.append(found)
    return YoloSplits(list(dict.fromkeys(places)), missing)


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
            kind, *values = (_finite(t, f"column {k}") for k, t in enumerate(line.split(), 1))
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
            if (most := max(map(abs, box))) > SHARE_MAX:
                raise ValueError(
                    f"its box reaches to {most:g}; expected shares of the image's width and "
                    "height: divide pixels by them"
                )
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
        size = [
            int(_finite(root.findtext(f"size/{side}") or 0, side)) for side in ("width", "height")
        ]
        objects = tuple(_voc_object(item) for item in root.iter("object"))
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise StorageError(f"{path}: not annotations in VOC's format: {error}") from error
    return _posix(root.findtext("filename") or ""), (size[0], size[1]), objects


def _voc_object(item: ElementTree.Element) -> RealObject:
    name = item.findtext("name")
    sides = {side: item.findtext(f"bndbox/{side}") for side in ("xmin", "ymin", "xmax", "ymax")}
    if name is None or None in sides.values():
        raise ValueError("an object without a name or a box")
    x0, y0, x1, y1 = (_finite(text, f"{side} of '{name}'") for side, text in sides.items())
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
    """A number; -1 for anything else, and for whole numbers beyond all floats."""
    try:
        return float(value) if isinstance(value, (int, float)) else -1.0
    except OverflowError:
        return -1.0


def _share(value: Any) -> float | None:
    """A number from 0 to 1; None = something else."""
    number = _number(value)
    return number if 0.0 <= number <= 1.0 else None
