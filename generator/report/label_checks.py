"""Checks that labels of one image agree with each other and with the image's size."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gen_data.core import intrinsics, scene
from gen_data.core.boxes import OrientedBox, tight_box
from gen_data.core.se3 import SE3
from gen_data.core.serialization import from_plain
from gen_data.report.stored_labels import ImageLabels, decode_mask

Item = Mapping[str, Any]

EXAMPLES_MAX = 12
"""Findings of one check that are kept as examples; all are counted."""
FRACTION_TOLERANCE = 0.01
BOX_MARGIN_PX = 2.0
"""Largest distance by which a 2D box may exceed the projection of the 3D box."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One contradiction: the object with its image, and the fact."""

    index: int
    camera: str
    instance_id: int
    category: str
    fact: str


@dataclass
class CheckResult:
    """Result of one check over a data set.

    Attributes:
        checked: Number of objects with the annotations that the check compares.
        found: Number of findings.
        examples: The first findings.
    """

    title: str
    checked: int = 0
    found: int = 0
    examples: list[Finding] = field(default_factory=list)

    def add(self, image: ImageLabels, item: Item, fact: str | None) -> None:
        """Count a checked object, and its finding if there is one."""
        self.checked += 1
        if fact is None:
            return
        self.found += 1
        if len(self.examples) < EXAMPLES_MAX:
            plain = item["instance"]
            self.examples.append(
                Finding(image.index, image.camera, plain["instance_id"], plain["category"], fact)
            )


class LabelChecks:
    """All checks, with their results so far."""

    def __init__(self) -> None:
        self.results = tuple(CheckResult(title) for title in CHECKS)

    def add(self, image: ImageLabels) -> None:
        """Check all objects of an image."""
        for item in image.objects:
            for result, check in zip(self.results, CHECKS.values(), strict=True):
                for fact in check(image, item):
                    result.add(image, item, fact)


def _empty_box(_: ImageLabels, item: Item) -> Iterator[str | None]:
    """A box is absent or without area although pixels are visible, or present without any."""
    box, pixels = item.get("box"), item["visible_px"]
    if box is None:
        yield f"no box for {pixels} visible pixels" if pixels else None
    elif box["x_min"] >= box["x_max"] or box["y_min"] >= box["y_max"]:
        yield f"box {_corners(box)} has no area"
    else:
        yield None if pixels else f"box {_corners(box)} without visible pixels"


def _outside(image: ImageLabels, item: Item) -> Iterator[str | None]:
    box = item.get("box")
    if box is None:
        return
    width, height = image.size_px
    inside = box["x_min"] >= 0 and box["y_min"] >= 0
    inside = inside and box["x_max"] <= width and box["y_max"] <= height
    yield None if inside else f"box {_corners(box)} in an image of {width} x {height} px"


def _box_of_mask(_: ImageLabels, item: Item) -> Iterator[str | None]:
    """The box is not the tight box of the mask."""
    box, mask = item.get("box"), item.get("mask")
    if box is None or mask is None:
        return
    tight = tight_box(decode_mask(mask), mask["x_px"], mask["y_px"])
    fits = tight is not None and _corners(box) == (
        tight.x_min,
        tight.y_min,
        tight.x_max,
        tight.y_max,
    )
    yield None if fits else f"box {_corners(box)}, mask {tight}"


def _mask_area(_: ImageLabels, item: Item) -> Iterator[str | None]:
    """The number of pixels of the mask is not the stated number."""
    mask, pixels = item.get("mask"), item["visible_px"]
    if mask is not None:
        area = sum(mask["pixels"]["runs"][1::2])
        yield None if area == pixels else f"mask of {area} pixels, visible_px {pixels}"


def _visible_in_amodal(_: ImageLabels, item: Item) -> Iterator[str | None]:
    """The box of visible pixels is not inside the box of the whole silhouette."""
    box, whole = item.get("box"), item.get("amodal_box")
    if box is None or whole is None:
        return
    inside = box["x_min"] >= whole["x_min"] and box["y_min"] >= whole["y_min"]
    inside = inside and box["x_max"] <= whole["x_max"] and box["y_max"] <= whole["y_max"]
    yield None if inside else f"box {_corners(box)}, amodal box {_corners(whole)}"


def _fractions(_: ImageLabels, item: Item) -> Iterator[str | None]:
    """A fraction is outside [0, 1], or visible != (1 - occlusion) (1 - truncation)."""
    visible, hidden, cut = (item.get(k) for k in ("visible_fraction", "occlusion", "truncation"))
    if visible is None or hidden is None or cut is None:
        return
    product = (1.0 - hidden) * (1.0 - cut)
    valid = all(0.0 <= value <= 1.0 for value in (visible, hidden, cut))
    agree = valid and abs(visible - product) <= FRACTION_TOLERANCE
    yield None if agree else f"visible {visible:g}, occlusion {hidden:g}, truncation {cut:g}"


def _keypoints(image: ImageLabels, item: Item) -> Iterator[str | None]:
    width, height = image.size_px
    points = item.get("keypoints")
    if not points:
        return
    wrong = []
    for point in points:
        u, v = point["image_px"]
        if point["visibility"] and not (0.0 <= u <= width and 0.0 <= v <= height):
            wrong.append(f"{point['name']} at ({u:.1f}, {v:.1f})")
    yield ", ".join(wrong) or None


def _box_in_space(image: ImageLabels, item: Item) -> Iterator[str | None]:
    """The 2D box exceeds the projection of the 3D box.

    Checked for straight lenses without rolling shutter, and boxes in front of the camera: the
    image of a convex body is then inside the image of its corners.
    """
    box, plain = item.get("box"), item.get("box3d_camera")
    camera = image.truth["camera"]
    if box is None or plain is None or camera["shutter"]["readout_s"]:
        return
    if camera["intrinsics"]["lens"]["model"] != "pinhole":
        return
    corners_m = _box_of_all(image, item).corners()
    if corners_m[:, 2].min() <= 0.0:
        return
    corners_px = from_plain(intrinsics.Intrinsics, camera["intrinsics"]).project(corners_m)
    low, high = corners_px.min(axis=0), corners_px.max(axis=0)
    beyond = np.array(
        [*(low - (box["x_min"], box["y_min"])), *((box["x_max"], box["y_max"]) - high)]
    )
    excess = float(beyond.max())
    yield None if excess <= BOX_MARGIN_PX else f"box {_corners(box)} exceeds it by {excess:.1f} px"


def _box_of_all(image: ImageLabels, item: Item) -> OrientedBox:
    """The 3D box in the camera's frame, around the mirrors too where labels leave them out."""
    if item["instance"].get("body_bounds_m") is None:
        return from_plain(OrientedBox, item["box3d_camera"])
    whole = replace(from_plain(scene.Instance, item["instance"]), body_bounds_m=None)
    return whole.box3d.seen_from(from_plain(SE3, image.truth["camera"]["T_world_camera"]).inverse())


def _corners(box: Item) -> tuple[int, int, int, int]:
    return box["x_min"], box["y_min"], box["x_max"], box["y_max"]


CHECKS: Mapping[str, Callable[[ImageLabels, Item], Iterator[str | None]]] = {
    "Box without area, or without visible pixels": _empty_box,
    "Box outside the image": _outside,
    "Box differs from the tight box of the mask": _box_of_mask,
    "Mask differs from the number of visible pixels": _mask_area,
    "Box of visible pixels exceeds the amodal box": _visible_in_amodal,
    "Fractions contradict each other": _fractions,
    "Labelled keypoint outside the image": _keypoints,
    "2D box exceeds the projected 3D box": _box_in_space,
}
"""Functions by title: each yields None for a checked object, or the contradiction.

They yield nothing for an object without the annotations that they compare.
"""
