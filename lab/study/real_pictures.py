"""Labelled pictures of users: folders in the layout of COCO, KITTI, YOLO or Pascal VOC."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from gen_data.assets.image_decoding import PHOTO_SUFFIXES, UNREAD, why_unread
from gen_data.core.asset_types import UInt8
from gen_data.core.errors import AssetError, ConfigError, StorageError, did_you_mean, list_names
from gen_data.lab.matching import label_files
from gen_data.lab.matching.label_files import RealObject
from gen_data.lab.matching.real_files import choose_evenly, files_below, read_picture, read_rgb

_IMAGES = re.compile(rb'"(images|annotations)"\s*:\s*\[\s*[{\]]')
"""A list of objects: plans of data sets have lists of names there."""
_NAMES = re.compile(rb"""(^|[{,])\s*["']?names["']?\s*:""", re.MULTILINE)
_SPLITS = re.compile(rb"""^{?["']?(train|val|nc)["']?\s*:""", re.MULTILINE)
"""Keys of the ``data.yaml`` of YOLO."""
_AMBIGUOUS = "image whose name several files have"
_WORD_MIN = 3
"""Letters from which on the beginning of a split's name stands for it: ``val`` for ``valid``."""


@dataclass(frozen=True, slots=True)
class RealPicture:
    """A picture with its objects.

    Attributes:
        image_id: Its id in results: the id in COCO's file, or a number from 1 in KITTI's order.
        size_px: Width and height.
        scan: Points of KITTI's laser scanner; None = there are none.
    """

    image_id: int
    path: Path
    size_px: tuple[int, int]
    objects: tuple[RealObject, ...]
    scan: Path | None = None


@dataclass(frozen=True)
class RealSet:
    """Pictures and labels read from a folder.

    Attributes:
        source: The annotation file, or KITTI's folder of labels.
        pictures: Pictures that can be read, ordered by their id.
        category_ids: Ids of the classes in results.
        skipped: Numbers of pictures and labels left out, by reason.
        layout: One of ``LAYOUTS``.
    """

    source: Path
    pictures: tuple[RealPicture, ...]
    category_ids: Mapping[str, int]
    skipped: Mapping[str, int]
    layout: str = "coco"

    def restrict(self, classes: Collection[str]) -> "RealSet":
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
                        replace(thing, name=name, is_ignored=thing.is_ignored or not name)
                    )
                else:
                    skipped[f"object of class '{thing.name}', which the configuration lacks"] += 1
            pictures.append(replace(picture, objects=tuple(objects)))
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
        return replace(self, pictures=tuple(pictures), category_ids=ids, skipped=skipped)

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


def read_real(
    folder: Path, split: str | None = "", *, layout: str = "", most: int | None = None
) -> RealSet:
    """Read a folder with labels, in the first of ``LAYOUTS`` that it has.

    COCO: ``annotations/*.json`` or ``*.json``, and the images anywhere below. KITTI: ``label_2``
    and ``image_2``. YOLO: a YAML file with ``names``, whose splits are read if it has some, or
    ``classes.txt``; labels are in ``labels`` where images are in ``images``, else next to them.
    VOC: ``Annotations`` and ``JPEGImages``, or any XML files with the images next to them.

    Args:
        folder: The folder; also one that contains the folders of an export.
        split: Part of the name of COCO's file, where there are several, or of a split of YOLO's
            data.yaml, empty = all of these; None = read all of both.
        layout: The only layout to look for; empty = any.
        most: Largest number of pictures, chosen evenly; None = all.

    Raises:
        ConfigError: there are no labels, or several files and the split names none of them.
        StorageError: a file does not have the expected layout, or no picture can be read.
    """
    for name, find in LAYOUTS.items():
        if layout in ("", name) and (read := find(folder, split, most)):
            return replace(read(), layout=name)
    for path in _yolo_yamls(folder) if layout in ("", "yolo") else ():
        if path.stem == "data" or _SPLITS.search(path.read_bytes()):
            label_files.read_yolo_classes(path)
    raise ConfigError(
        f"{folder}: there are no labels; expected annotations/*.json in COCO's format, label_2 "
        "and image_2 in KITTI's, labels and data.yaml in YOLO's, or Annotations and JPEGImages "
        "in VOC's"
    )


def check_judges(real: RealSet) -> None:
    """Refuse pictures that cannot judge a detector.

    Raises:
        ConfigError: there are fewer than two pictures, or no object.
    """
    if len(real.pictures) < 2:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in real.skipped.items())
        raise ConfigError(
            f"{real.source}: 1 picture can be used; expected at least 2, to give scores an "
            f"interval, and better 200; skipped: {reasons or 'none'}"
        )
    if not any(not thing.is_ignored for picture in real.pictures for thing in picture.objects):
        raise ConfigError(f"{real.source}: has no labelled object; expected some to be found")


def read_image(path: Path) -> UInt8:
    """RGB image [h, w, 3]. Raises StorageError if it cannot be read."""
    try:
        return read_rgb(path)
    except AssetError as error:
        raise StorageError(str(error)) from error


Found = Callable[[], RealSet] | None
"""Reads the labels that were found; None = there are none."""


def _find_coco(folder: Path, split: str | None, most: int | None) -> Found:
    for root in (folder, folder / "coco"):
        listed = (root.glob(at) for at in ("annotations/*.json", "*.json", "*/_annotations.*.json"))
        sorts = ([path for path in sorted(at) if _is_instances(path)] for at in listed)
        files = next(filter(None, sorts), [])
        # COCO's own folder has captions, too.
        files = [path for path in files if path.stem.startswith("instances")] or files
        if files:
            return partial(_read_coco, root, _choose(root, files, split), most)
    return None


def _find_kitti(folder: Path, split: str | None, most: int | None) -> Found:
    for root in (folder, folder / "training", folder / "kitti/training"):
        if (root / "label_2").is_dir():
            _refuse_split(root, split)
            return partial(_read_kitti, root, most)
    return None


def _find_yolo(folder: Path, split: str | None, most: int | None) -> Found:
    for root in (folder, folder / "detect", folder / "yolo/detect"):
        files = [path for path in _yolo_yamls(root) if _NAMES.search(path.read_bytes())]
        files += [root / name for name in ("classes.txt", "labels/classes.txt", "obj.names")]
        classes = next(filter(Path.is_file, files), None)
        if classes is not None:
            return partial(_read_yolo, root, classes, split or "", most)
    return None


def _yolo_yamls(root: Path) -> list[Path]:
    return [*sorted(root.glob("*.yaml")), *sorted(root.glob("*.yml"))]


def _find_voc(folder: Path, split: str | None, most: int | None) -> Found:
    for at in ("Annotations", "VOC*/*/Annotations", "voc/VOC*/*/Annotations"):
        if files := sorted(folder.glob(f"{at}/**/*.xml")):
            break
    else:
        files = [p for p in files_below(folder) if p.suffix == ".xml" and _is_voc(p)]
    if not files:
        return None
    _refuse_split(folder, split)
    return partial(_read_voc, files, most)


def _refuse_split(place: Path, split: str | None) -> None:
    """Refuse a split of labels that have none."""
    if split:
        raise ConfigError(
            f"{place}: its labels have no split '{split[:40]}'; expected COCO's files, YOLO's "
            "data.yaml with splits, or no split"
        )


LAYOUTS: Mapping[str, Callable[[Path, str | None, int | None], Found]] = {
    "coco": _find_coco,
    "kitti": _find_kitti,
    "yolo": _find_yolo,
    "voc": _find_voc,
}
"""Layouts by the name of the exporter that writes them."""


def _is_instances(path: Path) -> bool:
    """Whether a file can hold annotations of boxes: not of keypoints, nor other JSON."""
    with path.open("rb") as file:
        head = file.read(4096)
    if "keypoints" in path.stem:
        return False
    return bool(_IMAGES.search(head)) or path.parent.name == "annotations"


def _is_voc(path: Path) -> bool:
    with path.open("rb") as file:
        return b"<annotation" in file.read(512)


def _choose(root: Path, files: Sequence[Path], split: str | None) -> Sequence[Path]:
    """The only file, the one of the split, or the one of the validation set; None = all files."""
    if split is None:
        return files
    # Roboflow has a folder for each split, and one name for all files.
    names_of = {path: path.relative_to(root).as_posix() for path in files}
    wanted = split or ("val" if len(files) > 1 else "")
    chosen = [p for p in files if wanted in names_of[p].removeprefix("annotations/")]
    if len(chosen) != 1:
        names = ", ".join(names_of.values())
        raise ConfigError(
            f"{root}: expected one annotation file, or a split that names one; found {names}"
        )
    return chosen


@dataclass(frozen=True, slots=True)
class _Frame:
    """A picture that is to be read; see ``RealPicture``.

    Attributes:
        stated_px: Size that the labels state; 0 = not stated.
        is_relative: Boxes are in shares of width and height.
    """

    image_id: int
    path: Path
    objects: tuple[RealObject, ...]
    stated_px: tuple[int, int] = (0, 0)
    is_relative: bool = False
    scan: Path | None = None


def _read_coco(root: Path, paths: Sequence[Path], most: int | None) -> RealSet:
    frames: list[_Frame] = []
    skipped, ids = Counter[str](), dict[str, int]()
    known, ambiguous = _images_by_name(root), list[str]()
    for path in paths:
        labels = label_files.read_coco(path)
        ids |= labels.category_ids
        if labels.empty:
            skipped["object with an empty box"] += labels.empty
        for image in labels.images:
            found = _find_image(root, path, image.file_name, known)
            if len(found) > 1:
                ambiguous.append(image.file_name)
            else:
                file = found[0] if found else root / image.file_name
                frames.append(_Frame(image.image_id, file, image.objects, image.size_px))
    if ambiguous:
        skipped[f"{_AMBIGUOUS} (such as {ambiguous[0]})"] = len(ambiguous)
    frames = _join_listed(frames, skipped)
    # Ids of some tools are texts.
    by_id = sorted(
        _readable(frames, most, skipped), key=lambda p: (isinstance(p.image_id, str), p.image_id)
    )
    pictures = tuple(by_id)
    source = paths[0] if len(paths) == 1 else paths[0].parent
    return _checked(RealSet(source, pictures, ids, skipped))


def _join_listed(frames: Iterable[_Frame], skipped: Counter[str]) -> list[_Frame]:
    """Frames with one for each image: files may list it again, with the same or other objects."""
    joined: dict[Path, _Frame] = {}
    for frame in frames:
        first = joined.setdefault(frame.path, frame)
        if first is not frame:
            skipped["image that is listed again, read once"] += 1
            more = [thing for thing in frame.objects if thing not in first.objects]
            joined[frame.path] = replace(first, objects=(*first.objects, *more))
    return list(joined.values())


def _images_by_name(root: Path) -> dict[str, list[Path]]:
    known: dict[str, list[Path]] = {}
    for path in files_below(root):
        known.setdefault(path.name, []).append(path)
    return known


def _find_image(
    root: Path, annotations: Path, stated: str, known: Mapping[str, Sequence[Path]]
) -> list[Path]:
    """Images that a name in an annotation file can mean: none, one, or several.

    Of several with one name, images next to the annotations win, then images in folders of the
    split, which the annotations' name has, then in ``images``, then in the fewest folders: an
    export holds depth and label images of the same names in separate folders.
    """
    name = Path(stated)
    found = [p for p in known.get(name.name, []) if p.parts[-len(name.parts) :] == name.parts]
    # The word `instances` stands for the kind of labels, not for a split.
    words = set(re.split(r"[\W_]+", annotations.stem.casefold())) - {"instances"}

    def rank(path: Path) -> tuple[bool, int, bool, int]:
        folders = [folder.casefold() for folder in path.relative_to(root).parts[:-1]]
        splits = sum(_is_split(folder, words) for folder in folders)
        return path == annotations.parent / name, splits, "images" in folders, -len(folders)

    best = max(map(rank, found), default=None)
    return [path for path in found if rank(path) == best]


def _is_split(folder: str, words: Iterable[str]) -> bool:
    return any(
        folder == word
        or (min(len(folder), len(word)) >= _WORD_MIN
            and (folder.startswith(word) or word.startswith(folder)))
        for word in words
    )  # fmt: skip


def _read_kitti(root: Path, most: int | None) -> RealSet:
    images = {path.stem: path for path in _images_among((root / "image_2").glob("*"))}
    frames = []
    for number, path in enumerate(sorted((root / "label_2").glob("*.txt")), 1):
        image = images.get(path.stem, root / f"image_2/{path.stem}.png")
        scan = root / f"velodyne/{path.stem}.bin"
        objects = label_files.read_kitti(path)
        frames.append(_Frame(number, image, objects, scan=scan if scan.is_file() else None))
    missing = sum(frame.scan is None for frame in frames)
    skipped = Counter({"scan that is missing": missing} if 0 < missing < len(frames) else {})
    return _numbered(root / "label_2", frames, most, skipped)


def _read_yolo(root: Path, classes: Path, split: str, most: int | None) -> RealSet:
    names, has_keypoints = label_files.read_yolo_classes(classes)
    below = files_below(root)
    splits = label_files.yolo_splits(classes, split)
    places = splits.places
    if not places:
        _refuse_split(classes, split)
    if places:
        images = {_yolo_labels(path): path for path in _listed_images(places)}
        folders = {_yolo_labels(place / "image.png").parent for place in places if place.is_dir()}
        listed = {path for folder in folders for path in files_below(folder)} | images.keys()
    else:
        images = {_yolo_labels(path): path for path in _images_among(below)}
        listed = {p for p in below if "labels" in p.relative_to(root).parts} | images.keys()
    labels = {path for path in listed if path.suffix == ".txt" and label_files.is_there(path)}
    # LabelImg puts its list of classes next to the labels.
    labels = {path for path in labels if path != classes and path.name != "classes.txt"}
    skipped, frames = Counter[str](), []
    known = {path.parent.relative_to(root).as_posix() for path in _images_among(below)}
    instead = "" if places else "; all images below are read"
    for key, name in splits.missing:
        nearest = did_you_mean(name, known)
        skipped[f"{key} of {classes.name}: '{name}', which is missing{nearest}{instead}"] += 1
    for number, path in enumerate(sorted(labels | images.keys()), 1):
        if path not in labels and not why_unread(images[path]):
            skipped["image without a label file, read as one without objects"] += 1
        objects = label_files.read_yolo(path, names, has_keypoints) if path in labels else ()
        image = images.get(path, path.with_suffix(".png"))
        frames.append(_Frame(number, image, objects, is_relative=True))
    ids = {name: number for number, name in enumerate(names, 1)}
    return _checked(RealSet(classes, tuple(_readable(frames, most, skipped)), ids, skipped))


def _listed_images(places: Iterable[Path]) -> Iterator[Path]:
    """Images in folders, of lists, and single ones."""
    for place in places:
        if place.is_dir():
            yield from _images_among(files_below(place))
        elif place.suffix == ".txt":
            for line in filter(None, map(str.strip, place.read_text("utf-8-sig").splitlines())):
                # Ultralytics takes names that begin with ./ from the list's folder.
                yield place.parent / line
        else:
            yield place


def _yolo_labels(image: Path) -> Path:
    """A file next to the image, or by Ultralytics' rule: the last ``images`` becomes ``labels``."""
    nearby = image.with_suffix(".txt")
    before, images, after = nearby.as_posix().rpartition("/images/")
    return (
        nearby if label_files.is_there(nearby) or not images else Path(f"{before}/labels/{after}")
    )


def _read_voc(paths: Sequence[Path], most: int | None) -> RealSet:
    frames = []
    for number, path in enumerate(paths, 1):
        stated, size_px, objects = label_files.read_voc(path)
        frames.append(_Frame(number, _voc_image(path, Path(stated)), objects, size_px))
    return _numbered(paths[0].parent, frames, most, Counter())


def _voc_image(path: Path, stated: Path) -> Path:
    """The image of a file of annotations, which has its name; other names may be outdated."""
    near, inner = path.parent.parent, Path()
    if "Annotations" in path.parts:
        at = len(path.parts) - path.parts[::-1].index("Annotations")
        near, inner = Path(*path.parts[: at - 1]), Path(*path.parts[at:-1])
    folders = (near / "JPEGImages" / inner, path.parent, near / "images" / inner, near / inner)
    same = [f"{path.stem}{e}" for s in (*PHOTO_SUFFIXES, *UNREAD) for e in (s, s.upper())]
    names = [stated.name, *same] if stated.stem == path.stem else [*same, stated.name]
    listed = (folder / name for name in names if name for folder in folders)
    return next(filter(label_files.is_there, listed), folders[0] / f"{path.stem}.jpg")


def _numbered(
    source: Path, frames: Sequence[_Frame], most: int | None, skipped: Counter[str]
) -> RealSet:
    """A set whose classes are the sorted names of its objects."""
    names = {thing.name for frame in frames for thing in frame.objects if thing.name}
    ids = {name: number for number, name in enumerate(sorted(names), 1)}
    return _checked(RealSet(source, tuple(_readable(frames, most, skipped)), ids, skipped))


def _images_among(paths: Iterable[Path]) -> list[Path]:
    """Sorted images; unread formats come first, so readable images of a name replace them."""
    images = (p for p in paths if p.suffix.lower() in PHOTO_SUFFIXES or why_unread(p))
    return sorted(images, key=lambda path: (not why_unread(path), path))


def _readable(
    frames: Sequence[_Frame], most: int | None, skipped: Counter[str]
) -> Iterator[RealPicture]:
    """Pictures whose images exist and can be decoded.

    Boxes do not fit images that were resized since.
    """
    chosen = choose_evenly(frames, len(frames) if most is None else most)
    if len(chosen) < len(frames):
        skipped["picture beyond the largest number"] += len(frames) - len(chosen)
    left_out: dict[str, list[str]] = {}
    for frame in chosen:
        found = _read_frame(frame)
        if isinstance(found, str):
            left_out.setdefault(found, []).append(frame.path.name[: label_files.SHOWN_MAX])
            continue
        width, height, remarks = found
        skipped.update(f"image that is read, but: {text}" for text in remarks)
        objects = _scaled(frame.objects, width, height) if frame.is_relative else frame.objects
        kept = tuple(o for o in objects if label_files.has_area(o.box, (width, height)))
        empty = sum(not label_files.has_area(thing.box) for thing in objects)
        outside = len(objects) - len(kept) - empty
        counts = {"object with an empty box": empty, "object outside of its image": outside}
        skipped.update({reason: count for reason, count in counts.items() if count})
        yield RealPicture(frame.image_id, frame.path, (width, height), kept, frame.scan)
    skipped.update({f"{why} (such as {names[0]})": len(names) for why, names in left_out.items()})


def _read_frame(frame: _Frame) -> tuple[int, int, tuple[str, ...]] | str:
    """Width, height, and remarks on the image; or why it is left out."""
    if not label_files.is_there(frame.path):
        return "image that is missing"
    if why := why_unread(frame.path):
        return f"image: {why}"
    try:
        pixels, remarks = read_picture(frame.path)
    except AssetError:
        return "image that cannot be read"
    height, width = pixels.shape[:2]
    if any(a not in (0, b) for a, b in zip(frame.stated_px, (width, height), strict=True)):
        return "image of another size than its labels state"
    return width, height, remarks


def _scaled(objects: Iterable[RealObject], width: int, height: int) -> tuple[RealObject, ...]:
    return tuple(
        replace(thing, box=(x0 * width, y0 * height, x1 * width, y1 * height))
        for thing in objects
        for x0, y0, x1, y1 in [thing.box]
    )


def _checked(real: RealSet) -> RealSet:
    if not real.pictures:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in real.skipped.items())
        raise StorageError(
            f"{real.source}: no picture can be used: {reasons or 'it lists none'}; expected the "
            "images that the labels name, below the same folder"
        )
    return real
