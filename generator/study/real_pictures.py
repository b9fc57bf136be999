"""Labelled pictures of users: folders in the layout of COCO or of KITTI."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.errors import ConfigError, StorageError

OCCLUSION_LEVELS = ("visible", "partly occluded", "largely occluded")
"""KITTI's levels 0, 1 and 2; its level 3 is "unknown"."""
_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")

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
class RealPicture:
    """A picture with its objects.

    Attributes:
        image_id: Its id in results: that of COCO's file, or a number from 1 in KITTI's order.
        size_px: Width and height.
    """

    image_id: int
    path: Path
    size_px: tuple[int, int]
    objects: tuple[RealObject, ...]


@dataclass(frozen=True)
class RealSet:
    """What was read of a folder.

    Attributes:
        source: The annotation file, or KITTI's folder of labels.
        pictures: Pictures that can be read, ordered by their id.
        category_ids: Ids of the classes in results.
        skipped: Numbers of what was left out, by reason.
    """

    source: Path
    pictures: tuple[RealPicture, ...]
    category_ids: Mapping[str, int]
    skipped: Mapping[str, int]

    def restrict(self, classes: Collection[str]) -> RealSet:
        """The same pictures with the objects of these classes; others are counted as skipped.

        Names agree without regard to case: KITTI's ``Car`` is the class ``car``.

        Raises:
            ConfigError: the folder has no object of these classes.
        """
        by_fold = {name.casefold(): name for name in classes}
        skipped = Counter(self.skipped)
        pictures = []
        for picture in self.pictures:
            objects = []
            for thing in picture.objects:
                name = by_fold.get(thing.name.casefold(), "")
                if name or not thing.name:
                    objects.append(
                        RealObject(name, thing.box, thing.is_ignored or not name, thing.occlusion)
                    )
                else:
                    skipped[f"object of class '{thing.name}', which the configuration lacks"] += 1
            pictures.append(
                RealPicture(picture.image_id, picture.path, picture.size_px, tuple(objects))
            )
        if not any(not thing.is_ignored for picture in pictures for thing in picture.objects):
            found = sorted({thing.name for p in self.pictures for thing in p.objects if thing.name})
            raise ConfigError(
                f"{self.source}: has no object of the classes {', '.join(sorted(classes))}; it has "
                f"{', '.join(found) or 'none'}: give the configuration a label map with these names"
            )
        ids = {
            by_fold[name.casefold()]: number
            for name, number in self.category_ids.items()
            if name.casefold() in by_fold
        }
        return RealSet(self.source, tuple(pictures), ids, skipped)

    def to_coco(self, chosen: Sequence[RealPicture] | None = None) -> dict[str, Any]:
        """COCO's annotations of some pictures, None = all.

        Regions without a class are crowds of every class.
        """
        pictures = self.pictures if chosen is None else chosen
        rows = [
            {"image_id": picture.image_id, "category_id": number, **_coco_box(thing)}
            for picture in pictures
            for thing in picture.objects
            for number in ([self.category_ids[thing.name]] if thing.name else self._ids())
        ]
        return {
            "info": {},
            "images": [
                {"id": p.image_id, "file_name": p.path.name, "width": w, "height": h}
                for p in pictures
                for w, h in [p.size_px]
            ],
            "categories": [{"id": k, "name": name} for name, k in self.category_ids.items()],
            "annotations": [{"id": number, **row} for number, row in enumerate(rows, 1)],
        }

    def _ids(self) -> list[int]:
        return list(self.category_ids.values())


def _coco_box(thing: RealObject) -> dict[str, Any]:
    x0, y0, x1, y1 = thing.box
    width, height = x1 - x0, y1 - y0
    box = {"bbox": [x0, y0, width, height], "area": width * height}
    return box | {"iscrowd": int(thing.is_ignored), "occlusion": thing.occlusion}


def read_real(folder: Path, split: str = "") -> RealSet:
    """Read a folder with labels in the layout of COCO or KITTI.

    COCO: ``annotations/*.json`` or ``*.json``, and the images anywhere below. KITTI: ``label_2``
    and ``image_2``, there or in ``training``. Of a data set with both, COCO's labels are read.

    Args:
        folder: The folder; also one that contains a folder ``coco`` or ``kitti``.
        split: Part of the name of COCO's file, where there are several.

    Raises:
        ConfigError: there are no labels, or several files and the split names none of them.
        StorageError: a file does not have the expected layout.
    """
    for root in (folder, folder / "coco"):
        files = sorted(root.glob("annotations/*.json")) or sorted(root.glob("*.json"))
        files = [path for path in files if _is_instances(path)]
        if files:
            return _read_coco(root, _choose(root, files, split))
    for root in (folder, folder / "training", folder / "kitti/training"):
        if (root / "label_2").is_dir():
            return _read_kitti(root)
    raise ConfigError(
        f"{folder}: there are no labels; expected annotations/*.json in COCO's format, or label_2 "
        "and image_2 in KITTI's"
    )


def read_image(path: Path) -> NDArray[np.uint8]:
    """RGB image [h, w, 3]. Raises StorageError if it cannot be read."""
    image = _decode(path)
    if image is None:
        raise StorageError(f"{path}: cannot be read as an image")
    return image


def _decode(path: Path) -> NDArray[np.uint8] | None:
    try:
        encoded = np.fromfile(path, np.uint8)
    except OSError:
        return None
    image = cv2.imdecode(encoded, cv2.IMREAD_COLOR) if encoded.size else None
    return None if image is None else np.ascontiguousarray(image[..., ::-1])


def _is_instances(path: Path) -> bool:
    """Whether a file can hold annotations of boxes: not those of keypoints, nor other JSON."""
    with path.open("rb") as file:
        head = file.read(4096)
    if "keypoints" in path.stem:
        return False
    return b'"images"' in head or path.parent.name == "annotations"


def _choose(root: Path, files: Sequence[Path], split: str) -> Path:
    """The only file, the one of the split, or that of the validation set."""
    chosen = [path for path in files if split in path.stem]
    if not split and len(files) > 1:
        chosen = [path for path in files if "val" in path.stem]
    if len(chosen) != 1:
        names = ", ".join(path.name for path in files)
        raise ConfigError(
            f"{root}: expected one annotation file, or a split that names one; found {names}"
        )
    return chosen[0]


def _read_coco(root: Path, path: Path) -> RealSet:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        names = {row["id"]: row["name"] for row in content["categories"]}
        objects: dict[int, list[RealObject]] = {row["id"]: [] for row in content["images"]}
        skipped: Counter[str] = Counter()
        for row in content["annotations"]:
            x, y, width, height = row["bbox"]
            if not (width > 0 and height > 0):
                skipped["object with an empty box"] += 1
                continue
            objects[row["image_id"]].append(
                RealObject(
                    names[row["category_id"]],
                    (x, y, x + width, y + height),
                    bool(row.get("iscrowd", 0)),
                    _occlusion(row.get("occlusion")),
                )
            )
        files = _find_images(root, path, [row["file_name"] for row in content["images"]])
        numbers = [row["id"] for row in content["images"]]
    except (ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{path}: not annotations in COCO's format: {error!r}") from error
    pictures = list(_readable(zip(numbers, files, objects.values(), strict=True), skipped))
    ids = {name: number for number, name in names.items()}
    return _checked(RealSet(path, tuple(sorted(pictures, key=_by_id)), ids, skipped))


def _by_id(picture: RealPicture) -> int:
    return picture.image_id


def _occlusion(value: Any) -> str:
    """The level of a hidden fraction, by the bounds of ``gen_data.exporters.kitti``."""
    if isinstance(value, str):
        return value if value in OCCLUSION_LEVELS else ""
    if not isinstance(value, (int, float)):
        return ""
    from gen_data.exporters.kitti import occlusion_level

    return OCCLUSION_LEVELS[occlusion_level(float(value))]


def _find_images(root: Path, annotations: Path, names: Sequence[str]) -> list[Path]:
    """Images by their names in an annotation file; a path without a file where there is none.

    Of several with one name, those in ``<split>/`` win, then those in the fewest folders: an export
    holds depth and label images of the same names in folders of their own.
    """
    known: dict[str, list[Path]] = {}
    for path in sorted(root.rglob("*.*")):
        known.setdefault(path.name, []).append(path)
    images = []
    for name in map(Path, names):
        found = [p for p in known.get(name.name, []) if p.parts[-len(name.parts) :] == name.parts]
        best = max(
            found,
            default=root / name,
            key=lambda p: (p.parent.name in annotations.stem, -len(p.parts)),
        )
        images.append(best)
    return images


def _read_kitti(root: Path) -> RealSet:
    images = {path.stem: path for path in sorted((root / "image_2").glob("*")) if _is_image(path)}
    frames, skipped = [], Counter[str]()
    names: set[str] = set()
    for number, path in enumerate(sorted((root / "label_2").glob("*.txt")), 1):
        objects = [
            _kitti_object(f"{path}:{line}", text)
            for line, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        ]
        names |= {thing.name for thing in objects if thing.name}
        frames.append((number, images.get(path.stem, root / f"image_2/{path.stem}.png"), objects))
    ids = {name: number for number, name in enumerate(sorted(names), 1)}
    return _checked(RealSet(root / "label_2", tuple(_readable(frames, skipped)), ids, skipped))


def _is_image(path: Path) -> bool:
    return path.suffix.lower() in _SUFFIXES


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


def _readable(frames: Any, skipped: Counter[str]) -> Iterator[RealPicture]:
    """Pictures of (id, path, objects) whose images exist and can be decoded."""
    for number, path, objects in frames:
        image = _decode(path)
        if image is None:
            skipped["image that cannot be read" if path.exists() else "image that is missing"] += 1
            continue
        height, width = image.shape[:2]
        yield RealPicture(number, path, (width, height), tuple(objects))


def _checked(real: RealSet) -> RealSet:
    if not real.pictures:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in real.skipped.items())
        raise ConfigError(f"{real.source}: no picture can be used ({reasons or 'it lists none'})")
    return real
