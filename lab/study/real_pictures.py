"""Labelled pictures of users: folders in the layout of COCO or of KITTI."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gen_data.core.asset_types import UInt8
from gen_data.core.errors import AssetError, ConfigError, StorageError, list_names
from gen_data.lab.matching.label_files import RealObject, read_coco, read_kitti
from gen_data.lab.matching.real_files import read_rgb

_UNSTATED = (0, 0)
_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")


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
            wanted, known = list_names(sorted(classes)), list_names(found) or "none"
            raise ConfigError(
                f"{self.source}: has no object of the classes {wanted}; it has {known}: give the "
                "configuration a label map with these names"
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


def check_judges(real: RealSet) -> None:
    """Refuse pictures that cannot judge a detector.

    Raises:
        ConfigError: there are fewer than two pictures, or no object.
    """
    if len(real.pictures) < 2:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in real.skipped.items())
        raise ConfigError(
            f"{real.source}: 1 picture can be used; expected at least 2, so that scores have an "
            f"interval, and better 200 (skipped: {reasons or 'none'})"
        )
    if not any(not thing.is_ignored for picture in real.pictures for thing in picture.objects):
        raise ConfigError(f"{real.source}: has no labelled object; expected some to be found")


def read_image(path: Path) -> UInt8:
    """RGB image [h, w, 3]. Raises StorageError if it cannot be read."""
    try:
        return read_rgb(path)
    except AssetError as error:
        raise StorageError(str(error)) from error


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
    labels = read_coco(path)
    skipped = Counter({"object with an empty box": labels.empty} if labels.empty else {})
    files = _find_images(root, path, [image.file_name for image in labels.images])
    frames = [
        (image.image_id, file, image.objects, image.size_px)
        for image, file in zip(labels.images, files, strict=True)
    ]
    pictures = sorted(_readable(frames, skipped), key=_by_id)
    return _checked(RealSet(path, tuple(pictures), labels.category_ids, skipped))


def _by_id(picture: RealPicture) -> int:
    return picture.image_id


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
        objects = read_kitti(path)
        names |= {thing.name for thing in objects if thing.name}
        image = images.get(path.stem, root / f"image_2/{path.stem}.png")
        frames.append((number, image, objects, _UNSTATED))
    ids = {name: number for number, name in enumerate(sorted(names), 1)}
    return _checked(RealSet(root / "label_2", tuple(_readable(frames, skipped)), ids, skipped))


def _is_image(path: Path) -> bool:
    return path.suffix.lower() in _SUFFIXES


def _readable(
    frames: Iterable[tuple[int, Path, tuple[RealObject, ...], tuple[int, int]]],
    skipped: Counter[str],
) -> Iterator[RealPicture]:
    """Pictures of (id, path, objects, stated size) whose images exist and can be decoded.

    Boxes do not fit images that were resized since.
    """
    for number, path, objects, stated_px in frames:
        if not path.is_file():
            skipped["image that is missing"] += 1
            continue
        try:
            height, width = read_image(path).shape[:2]
        except StorageError:
            skipped["image that cannot be read"] += 1
            continue
        if stated_px not in (_UNSTATED, (width, height)):
            skipped["image of another size than its labels state"] += 1
            continue
        yield RealPicture(number, path, (width, height), objects)


def _checked(real: RealSet) -> RealSet:
    if not real.pictures:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in real.skipped.items())
        raise ConfigError(f"{real.source}: no picture can be used ({reasons or 'it lists none'})")
    return real
