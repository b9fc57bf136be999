"""Photographs, scans and labels in a folder of recordings, and their contents.

Anything else is skipped, and counted with the reason. Folders of label images, named like a channel
of a camera (``depth``, ``instance``), are left out, and so are further links to the same file.
"""

import contextlib
import math
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.assets import image_decoding, sandbox
from gen_data.assets.asset_arrays import encode_text
from gen_data.core.asset_types import UInt8
from gen_data.core.capture import POINT, Channel
from gen_data.core.errors import AssetError, StorageError
from gen_data.lab.matching import label_files, point_files
from gen_data.lab.matching.recordings import Box, ImageLabels, Photo, Scan

T = TypeVar("T")

SCAN_ENDINGS = frozenset({".bin", ".pcd", ".ply", ".npy"})
NO_PHOTOS = frozenset(channel.value for channel in Channel if channel is not Channel.RGB)
"""Names of folders that hold label images."""
SIDE_MIN_PX = 64
PIXELS_MAX = 4_000_000
"""Larger photographs are cropped to their middle: statistics need no more."""
POINTS_MIN = 100
BLOCK_PX = 8


@dataclass
class Inventory:
    """Files that were found, used and skipped.

    Attributes:
        found: Number of files by kind.
        used: Number of files by kind that were read.
        skipped: Number of files by kind and reason.
        examples: One of the files of each kind and reason.
        notes: Facts about files that were read, such as their sizes, by kind.
    """

    found: Counter[str] = field(default_factory=Counter)
    used: Counter[str] = field(default_factory=Counter)
    skipped: Counter[tuple[str, str]] = field(default_factory=Counter)
    examples: dict[tuple[str, str], str] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)

    def skip(self, kind: str, reason: str, name: object) -> None:
        """Count a file that is not used."""
        self.skipped[kind, reason] += 1
        self.examples.setdefault((kind, reason), str(name))


@dataclass(frozen=True)
class RealFiles:
    """The files of a folder by kind, sorted by path; ``unread`` are pictures in other formats."""

    folder: Path
    photos: tuple[Path, ...]
    scans: tuple[Path, ...]
    coco: tuple[Path, ...]
    kitti: tuple[Path, ...]
    unread: tuple[Path, ...] = ()


def find_files(folder: Path) -> RealFiles:
    """Sort the files below a folder into kinds.

    Raises:
        StorageError: there is no such folder, or it holds neither photographs nor scans.
    """
    if not folder.is_dir():
        raise StorageError(
            f"{folder}: is not a folder; expected one with photographs or laser scans"
        )
    seen: set[tuple[int, int]] = set()
    photos, scans, coco, kitti, unread = [], [], [], [], []
    for path in files_below(folder):
        inner = path.relative_to(folder).parts
        if any(part.startswith(".") for part in inner):
            continue
        ending, parents = path.suffix.lower(), inner[:-1]
        status = path.stat()
        if status.st_ino and (status.st_dev, status.st_ino) in seen:
            continue
        seen.add((status.st_dev, status.st_ino))
        if ending in image_decoding.PHOTO_SUFFIXES and not NO_PHOTOS.intersection(parents):
            photos.append(path)
        elif ending in SCAN_ENDINGS:
            scans.append(path)
        elif ending == ".json" and parents[-1:] == ("annotations",):
            coco.append(path)
        elif ending == ".txt" and parents[-1:] == ("label_2",):
            kitti.append(path)
        elif ending in image_decoding.UNREAD:
            unread.append(path)
    if not photos and not scans:
        counts = Counter(map(image_decoding.why_unread, unread))
        others = "".join(f"; {count} {why}" for why, count in counts.items())
        raise StorageError(
            f"{folder}: holds no photographs ({', '.join(sorted(image_decoding.PHOTO_SUFFIXES))})"
            f" and no laser scans ({', '.join(sorted(SCAN_ENDINGS))}){others}"
        )
    coco = [path for path in coco if path.stem.startswith("instances")] or coco
    return RealFiles(folder, *map(tuple, (photos, scans, coco, kitti, unread)))


def files_below(folder: Path) -> list[Path]:
    """All files in a folder at any depth, sorted; links to folders are followed, each once.

    Folders that are missing or cannot be read have none.
    """
    found: list[Path] = []
    folders, links, walked = [folder], list[Path](), set[str]()
    while folders or links:
        place = folders.pop() if folders else links.pop()
        if (real := os.path.realpath(place)) in walked:
            continue
        walked.add(real)
        try:
            inner = sorted(place.iterdir(), reverse=True)
        except OSError:
            continue
        for path in inner:
            if path.is_dir():
                (links if path.is_symlink() else folders).append(path)
            elif path.is_file():
                found.append(path)
    return sorted(found)


def choose_evenly(files: Sequence[T], limit: int) -> list[T]:
    """At most so many of the files, spread evenly."""
    if len(files) <= limit:
        return list(files)
    return [files[k * len(files) // limit] for k in range(limit)]


def read_photos(files: RealFiles, limit: int, inventory: Inventory) -> Iterator[Photo]:
    """Read photographs one after the other; unusable ones are counted."""
    inventory.found["photographs"] = len(files.photos) + len(files.unread)
    for path in files.unread:
        why = image_decoding.why_unread(path)
        inventory.skip("photographs", why, path.relative_to(files.folder))
    sizes, remarks = Counter[tuple[int, int]](), Counter[str]()
    for path in choose_evenly(files.photos, limit):
        name = str(path.relative_to(files.folder))
        try:
            arrays = sandbox.run_sandboxed(decode_photo, files.folder, {name: ""})
        except AssetError as error:
            inventory.skip("photographs", _reason(error, path), name)
            continue
        width, height = (int(side) for side in arrays["size_px"])
        inventory.used["photographs"] += 1
        sizes[width, height] += 1
        remarks.update(_remarks(arrays))
        steps = arrays["quantisation"] if len(arrays["quantisation"]) else None
        yield Photo(name, arrays["rgb"], (width, height), steps)
    shown = ", ".join(f"{count} of {w} x {h} px" for (w, h), count in sizes.most_common(3))
    more = f", {len(sizes) - 3} other sizes" if len(sizes) > 3 else ""
    inventory.notes["photographs"] = "; ".join(
        [shown + more, *(f"{count}: {text}" for text, count in remarks.items())]
    )


def _reason(error: AssetError, path: Path) -> str:
    """The fact of an error, without the file and the remedy."""
    return str(error).removeprefix(f"{path}: ").partition(";")[0].strip()


def decode_photo(root: Path, files: Mapping[str, str]) -> dict[str, NDArray[Any]]:
    """Decode one photograph; runs in the sandbox.

    Returns:
        ``rgb``: uint8 [h, w, 3], the middle of large photographs. ``size_px``: whole width and
        height. ``quantisation``: the luma table of a JPEG file, int64 [64] in any order, else [0].
        ``remarks``: lines of text.

    Raises:
        AssetError: it is unreadable, too small or has no colours.
    """
    import io

    from PIL import Image, UnidentifiedImageError

    (name,) = files
    path = root / name
    data = _read_bytes(path)
    rgb = image_decoding.decode_image(data, str(path), color=True)
    height, width = rgb.shape[:2]
    if min(width, height) < SIDE_MIN_PX:
        raise AssetError(f"{path}: smaller than {SIDE_MIN_PX} px; leave it out")
    steps = np.zeros(0, np.int64)
    # Pillow opens no TIFF of colours in floating point.
    with contextlib.suppress(UnidentifiedImageError), Image.open(io.BytesIO(data)) as image:
        if image.mode in ("1", "P", "I", "I;16", "I;16B", "F"):
            raise AssetError(f"{path}: a label or depth image (mode {image.mode}); leave it out")
        if image.mode in ("L", "LA"):
            raise AssetError(f"{path}: without colours; leave it out")
        tables = getattr(image, "quantization", None) or {}
        steps = np.array(tables[min(tables)] if tables else steps, np.int64)
    size_px = np.array([width, height], np.int64)
    return {
        "rgb": _middle(rgb),
        "size_px": size_px,
        "quantisation": steps,
        "remarks": _encode_remarks(data),
    }


def read_rgb(path: Path) -> UInt8:
    """A whole image as RGB [h, w, 3]. Raises AssetError if it cannot be decoded."""
    return read_picture(path)[0]


def read_picture(path: Path) -> tuple[UInt8, tuple[str, ...]]:
    """A whole image as RGB [h, w, 3], and remarks on its unused contents.

    Raises:
        AssetError: it cannot be decoded.
    """
    arrays = sandbox.run_sandboxed(_decode_rgb, path.parent, {path.name: ""})
    return arrays["rgb"], _remarks(arrays)


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise AssetError(f"{path}: {error.strerror}") from None


def _encode_remarks(data: bytes) -> UInt8:
    return encode_text("\n".join(image_decoding.image_remarks(data)))


def _remarks(arrays: Mapping[str, NDArray[Any]]) -> tuple[str, ...]:
    return tuple(arrays["remarks"].tobytes().decode().splitlines())


def _decode_rgb(root: Path, files: Mapping[str, str]) -> dict[str, NDArray[Any]]:
    """Decode an image; runs in the sandbox."""
    (name,) = files
    path = root / name
    data = _read_bytes(path)
    rgb = image_decoding.decode_image(data, str(path), color=True)
    return {"rgb": rgb, "remarks": _encode_remarks(data)}


def _middle(rgb: UInt8) -> UInt8:
    """The middle of a large image, from a corner of JPEG's grid."""
    height, width = rgb.shape[:2]
    if height * width <= PIXELS_MAX:
        return rgb
    scale = math.sqrt(PIXELS_MAX / (height * width))
    rows, columns = (int(side * scale) // BLOCK_PX * BLOCK_PX for side in (height, width))
    top, left = ((a - b) // 2 // BLOCK_PX * BLOCK_PX for a, b in ((height, rows), (width, columns)))
    return np.ascontiguousarray(rgb[top : top + rows, left : left + columns])


def read_scans(files: RealFiles, limit: int, inventory: Inventory) -> Iterator[Scan]:
    """Read scans one after the other; unusable ones are counted."""
    inventory.found["scans"] = len(files.scans)
    scaled = 0
    for path in choose_evenly(files.scans, limit):
        name = str(path.relative_to(files.folder))
        try:
            xyz_m, intensity = _read_scan(path)
        except AssetError as error:
            inventory.skip("scans", str(error), name)
            continue
        if len(xyz_m) < POINTS_MIN:
            inventory.skip("scans", f"fewer than {POINTS_MIN} points", name)
            continue
        # Devices report bytes, or shares of white.
        if intensity.max() > 1.5:
            scaled += 1
            intensity = intensity / 255.0
        inventory.used["scans"] += 1
        yield Scan(name, np.linalg.norm(xyz_m.astype(np.float64), axis=1), intensity)
    if scaled:
        inventory.notes["scans"] = f"intensities of {scaled} divided by 255"


def _read_scan(path: Path) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Positions [n, 3] and intensities [n]. Raises AssetError with the reason alone."""
    try:
        if path.suffix == ".npy":
            points = np.load(path, allow_pickle=False)
            if points.dtype != POINT:
                raise AssetError("a NumPy file without laser points")
            return points["position_m"], points["intensity"].astype(np.float64)
        rows = point_files.read_point_file(path)
    except (OSError, ValueError) as error:
        raise AssetError(f"unreadable ({error})") from None
    if not np.isfinite(rows).all():
        rows = rows[np.isfinite(rows).all(axis=1)]
    return rows[:, :3], rows[:, 3]


def read_labels(
    files: RealFiles, sizes_px: Mapping[str, tuple[int, int]], inventory: Inventory
) -> list[ImageLabels]:
    """Boxes of all labelled images: COCO's if there are any, else KITTI's.

    Args:
        files: The folder.
        sizes_px: Sizes of photographs by name, as KITTI's labels state none.
        inventory: Counts labels that cannot be used.
    """
    listed = list(
        _read_coco(files.coco, inventory)
        if files.coco
        else _read_kitti(files.kitti, sizes_px, inventory)
    )
    inside = [replace(labels, boxes=tuple(_inside(labels))) for labels in listed]
    if lost := sum(len(labels.boxes) for labels in listed) - sum(len(i.boxes) for i in inside):
        inventory.notes["label files"] = f"{lost} boxes outside of their images left out"
    return inside


def _inside(labels: ImageLabels) -> Iterator[Box]:
    """Boxes with an area inside the image."""
    for box in labels.boxes:
        _, x, y, w, h = box
        if label_files.has_area((x, y, x + w, y + h), (labels.width_px, labels.height_px)):
            yield box


def _read_coco(paths: Iterable[Path], inventory: Inventory) -> Iterator[ImageLabels]:
    for path in paths:
        inventory.found["label files"] += 1
        try:
            images = label_files.read_coco(path).images
        except StorageError as error:
            inventory.skip("label files", str(error).removeprefix(f"{path}: "), path.name)
            continue
        if not all(min(image.size_px) > 0 for image in images):
            inventory.skip("label files", "an image without width and height", path.name)
            continue
        inventory.used["label files"] += 1
        yield from (_labels_of(image.size_px, image.objects) for image in images)


def _read_kitti(
    paths: Iterable[Path], sizes_px: Mapping[str, tuple[int, int]], inventory: Inventory
) -> Iterator[ImageLabels]:
    by_stem = {Path(name).stem: size for name, size in sizes_px.items()}
    common = Counter(sizes_px.values()).most_common(1)
    for path in paths:
        inventory.found["label files"] += 1
        size = by_stem.get(path.stem) or (common[0][0] if common else None)
        if size is None:
            inventory.skip("label files", "no photograph states the size of its image", path.name)
            continue
        try:
            objects = label_files.read_kitti(path)
        except StorageError as error:
            inventory.skip("label files", "not labels in KITTI's format", error)
            continue
        inventory.used["label files"] += 1
        yield _labels_of(size, objects)


def _labels_of(size_px: tuple[int, int], objects: Iterable[label_files.RealObject]) -> ImageLabels:
    """Boxes as position and size, without regions of many objects."""
    boxes = tuple(
        (thing.name, x0, y0, x1 - x0, y1 - y0)
        for thing in objects
        for x0, y0, x1, y1 in [thing.box]
        if not thing.is_ignored
    )
    return ImageLabels(*size_px, boxes)
