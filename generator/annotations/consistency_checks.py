"""Consistency checks of labels, which also run in production: contradictions are never written."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations import instance_extents
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import SensorReading
from gen_data.core.sample import MaskPx, ObjectTruth
from gen_data.core.se3 import SE3

ROTATION_TOLERANCE = 1e-6
"""Largest element of R^T R - I."""


def check_truth(reading: SensorReading, truth: ObjectTruth) -> None:
    """Check one object's labels against each other and against the images.

    Raises:
        SampleError: they contradict each other; names sensor, instance and contradiction.
    """
    for fault in _faults(reading, truth):
        raise instance_extents.instance_error(reading, truth.instance, fault)


def _faults(reading: SensorReading, truth: ObjectTruth) -> Iterator[str]:
    if truth.instance.category_id < 1:
        yield f"it is annotated and its category '{truth.instance.category}' has no id"
    visible = instance_extents.visible_mask(reading, truth)
    if int(np.count_nonzero(visible)) != truth.visible_px:
        yield f"its box does not hold its {truth.visible_px} visible pixels"
    if truth.box is not None:
        yield from _box_faults(reading, truth.box, visible)
    if truth.mask is not None:
        yield from _mask_faults(truth.mask, truth.box, visible)
    yield from _silhouette_faults(reading, truth, visible)
    yield from _share_faults(truth)
    yield from _pose_faults(truth)
    yield from _keypoint_faults(reading, truth)


def _box_faults(reading: SensorReading, box: BoxPx, visible: NDArray[np.bool_]) -> Iterator[str]:
    camera = reading.camera.intrinsics
    if box.clipped(camera.width_px, camera.height_px) != box:
        yield f"its box {box} leaves the image of {camera.width_px} x {camera.height_px} px"
    elif not _is_tight(visible):
        yield f"its box {box} is not the tight box of its visible pixels"


def _mask_faults(mask: MaskPx, box: BoxPx | None, visible: NDArray[np.bool_]) -> Iterator[str]:
    corner = (box.x_min, box.y_min) if box else (0, 0)
    if (mask.x_px, mask.y_px) != corner or not np.array_equal(mask.pixels, visible):
        yield "its mask is not its visible pixels"


def _silhouette_faults(
    reading: SensorReading, truth: ObjectTruth, visible: NDArray[np.bool_]
) -> Iterator[str]:
    silhouette = reading.silhouettes.get(truth.instance.instance_id)
    if silhouette is None:
        return
    outer = instance_extents.silhouette_box(silhouette)
    if outer is not None and not _is_tight(silhouette.mask):
        yield "its silhouette is not stored tight"
    if truth.box is None:
        return
    if outer is None or truth.box.intersection(outer) != truth.box:
        yield f"its visible box {truth.box} leaves the box {outer} of its silhouette"
    elif (visible > instance_extents.silhouette_crop(silhouette, truth.box)).any():
        yield "pixels are visible that are not in its silhouette"


def _share_faults(truth: ObjectTruth) -> Iterator[str]:
    for name in ("visible_fraction", "occlusion", "truncation"):
        share = getattr(truth, name)
        # Written to make NaN a fault.
        if share is not None and not 0.0 <= share <= 1.0:
            yield f"its {name} is {share}, outside [0, 1]"


def _pose_faults(truth: ObjectTruth) -> Iterator[str]:
    for name in ("box3d_world", "box3d_camera"):
        box = getattr(truth, name)
        if box is not None:
            # A flat object has one side of length 0; a point is a box that was never measured.
            if not (all(0 <= side < math.inf for side in box.size_m) and max(box.size_m) > 0):
                yield f"its {name} has the size {box.size_m} m"
            if not _is_rigid(box.T_frame_box):
                yield f"its {name} has a pose that is not rigid: {box.T_frame_box}"
    if truth.T_camera_object is not None and not _is_rigid(truth.T_camera_object):
        yield f"its T_camera_object is not a rigid pose: {truth.T_camera_object}"


def _keypoint_faults(reading: SensorReading, truth: ObjectTruth) -> Iterator[str]:
    camera = reading.camera.intrinsics
    for point in truth.keypoints or ():
        u, v = point.image_px
        if not all(math.isfinite(x) for x in (*point.position_m, u, v)):
            yield f"its keypoint '{point.name}' is nowhere: {point}"
        elif point.visibility and not (0 <= u < camera.width_px and 0 <= v < camera.height_px):
            yield f"its keypoint '{point.name}' at ({u}, {v}) px is not in the image"
        elif point.visibility == 0 and (u, v) != (0, 0):
            yield f"its keypoint '{point.name}' is not in the image and has a place there"
        if point.visibility == 2 and truth.box is None:
            yield f"its keypoint '{point.name}' is visible and the object is not"


def _is_tight(mask: NDArray[np.bool_]) -> bool:
    return bool(mask[0].any() and mask[-1].any() and mask[:, 0].any() and mask[:, -1].any())


def _is_rigid(pose: SE3) -> bool:
    rotation = pose.rotation()
    drift = np.einsum("ki,kj->ij", rotation, rotation) - np.eye(3)
    # A NaN anywhere makes the comparison false.
    return all(math.isfinite(v) for v in pose.translation_m) and bool(
        np.abs(drift).max() <= ROTATION_TOLERANCE
    )
