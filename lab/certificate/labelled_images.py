"""Labelled images, as labels state them and as readers of exports find them, compared."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.report.stored_labels import ImageLabels, decode_mask

BoxCorners = tuple[float, float, float, float]
"""``x_min, y_min, x_max, y_max``, half-open [px]."""

Rle = Mapping[str, Any]
"""A mask of the whole image in COCO's compressed runs."""


@dataclass(frozen=True)
class LabelledObject:
    """An object in an image.

    Attributes:
        mask: Mask of its visible pixels; None if the format, or the data set, has none.
    """

    category: str
    box: BoxCorners
    mask: Rle | None = None


@dataclass(frozen=True)
class LabelledImage:
    """An image with its objects.

    Attributes:
        index: Number of the sample.
        pixels: Digest of its photograph; empty if it is not stated, or compressed again.
    """

    index: int
    camera: str
    split: str
    size_px: tuple[int, int]
    objects: tuple[LabelledObject, ...]
    pixels: str = ""

    def __str__(self) -> str:
        """Sample and camera."""
        return f"sample {self.index}, {self.camera}"


@dataclass(frozen=True)
class Loaded:
    """Contents of an export, as a reader returns them.

    Attributes:
        images: Labelled images; None for a format whose reader counts only.
        counts: Numbers of files, messages and the like, by name.
        faults: Contradictions that the reader found by itself.
    """

    images: Sequence[LabelledImage] | None = None
    counts: Mapping[str, int] = field(default_factory=dict)
    faults: Sequence[str] = ()


def image_of(image: ImageLabels, rgb: NDArray[np.uint8]) -> LabelledImage:
    """An image as the data set states it, with its photograph; without objects that have no box."""
    return LabelledImage(
        image.index,
        image.camera,
        image.split,
        image.size_px,
        tuple(
            LabelledObject(
                item["instance"]["category"],
                tuple(float(item["box"][k]) for k in ("x_min", "y_min", "x_max", "y_max")),  # type: ignore[arg-type]
                image_mask(item["mask"], image.size_px) if item.get("mask") else None,
            )
            for item in image.objects
            if item.get("box") is not None
        ),
        digest_pixels(rgb),
    )


def digest_pixels(rgb: NDArray[np.uint8]) -> str:
    """Digest of a photograph, uint8 [h, w, 3]."""
    return hashlib.sha256(np.ascontiguousarray(rgb).data).hexdigest()


def image_mask(mask: Mapping[str, Any], size_px: tuple[int, int]) -> Rle:
    """COCO's runs of a plain ``MaskPx`` in an image of width and height ``size_px``."""
    from pycocotools import mask as coco_mask

    crop = decode_mask(mask)
    (height, width), x, y = crop.shape, mask["x_px"], mask["y_px"]
    whole = np.zeros((size_px[1], size_px[0]), np.uint8, order="F")
    whole[y : y + height, x : x + width] = crop
    runs: Rle = coco_mask.encode(whole)
    return runs


def compare_images(
    stated: Iterable[LabelledImage], found: Iterable[LabelledImage], tolerance_px: float
) -> Iterator[str]:
    """Contradictions between labels and an export, in words; none if they agree.

    Args:
        stated: By the labels of the data set.
        found: By the reader, in any order.
        tolerance_px: Largest deviation of a corner.
    """
    by_name: dict[str, LabelledImage] = {}
    for image in found:
        if str(image) in by_name:
            yield f"{image}: is there twice"
        by_name[str(image)] = image
    for image in stated:
        other = by_name.pop(str(image), None)
        if other is None:
            yield f"{image}: is missing"
            continue
        if other.split != image.split:
            yield f"{image}: is in the split {other.split}, expected {image.split}"
        if other.size_px != image.size_px:
            yield f"{image}: has {other.size_px} px, expected {image.size_px}"
        if image.pixels and other.pixels not in ("", image.pixels):
            yield f"{image}: its picture differs from the data set's"
        yield from (f"{image}: {fact}" for fact in _compare_objects(image, other, tolerance_px))
    yield from (f"{name}: is not an image of the data set" for name in by_name)


def _compare_objects(
    image: LabelledImage, other: LabelledImage, tolerance_px: float
) -> Iterator[str]:
    left = list(other.objects)
    for thing in image.objects:
        same = [o for o in left if o.category == thing.category]
        nearest = min(same, key=lambda o: _deviation_px(thing, o), default=None)
        if nearest is None:
            yield f"{thing.category} at {_show(thing)}: is missing"
            continue
        left.remove(nearest)
        if _deviation_px(thing, nearest) > tolerance_px:
            yield f"{thing.category}: box {_show(nearest)}, expected {_show(thing)}"
        elif fact := _compare_masks(thing, nearest):
            yield f"{thing.category} at {_show(thing)}: {fact}"
    yield from (f"{o.category} at {_show(o)}: is not in the labels" for o in left)


def _compare_masks(thing: LabelledObject, other: LabelledObject) -> str:
    """The difference of two masks; empty if they are equal, or one is not stated."""
    from pycocotools import mask as coco_mask

    if thing.mask is None or other.mask is None:
        return ""
    if list(thing.mask["size"]) != list(other.mask["size"]):
        return f"its mask is of an image of {other.mask['size']} px"
    overlap = float(coco_mask.iou([other.mask], [thing.mask], [0])[0, 0])
    return "" if overlap == 1.0 else f"its mask has an IoU of {overlap:.4f} with the labelled one"


def _deviation_px(one: LabelledObject, other: LabelledObject) -> float:
    return max(abs(a - b) for a, b in zip(one.box, other.box, strict=True))


def _show(thing: LabelledObject) -> str:
    return "(" + ", ".join(f"{v:g}" for v in thing.box) + ")"
