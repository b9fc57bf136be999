"""Boxes in images along the headings of objects."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.instance_extents import visible_mask
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array

STEP = 0.01
"""Displacement along an axis that shows its direction in the image, as share of the distance."""


class OrientedBoxes2d(Strict):
    """Rectangles around visible pixels, along the heading of each object as the image shows it.

    Annotators of aerial images draw them so and begin at the front (Xia et al., "DOTA: A
    large-scale dataset for object detection in aerial images", CVPR 2018, section 3). The heading
    is the image of the X axis at the centre of the 3D box; where the axis points at the camera,
    the Y axis decides. The smallest rectangle of all directions, which the exporter ``yolo``
    writes, has no front, and follows the heading of long objects only.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["oriented_boxes2d"] = "oriented_boxes2d"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``oriented_box``; None without a visible pixel."""
        if truth.box is None:
            return truth
        forward = image_heading(reading, truth)
        right = np.array([-forward[1], forward[0]])
        corners = mask_corners(visible_mask(reading, truth))
        corners += np.array([truth.box.x_min, truth.box.y_min])
        along, across = corners @ forward, corners @ right
        front, rear = along.max() * forward, along.min() * forward
        left, side = across.min() * right, across.max() * right
        a, b, c, d = (
            (round(float(u), 3), round(float(v), 3))
            for u, v in (front + left, front + side, rear + side, rear + left)
        )
        return replace(truth, oriented_box=(a, b, c, d))


def image_heading(reading: SensorReading, truth: ObjectTruth) -> Array:
    """Unit vector [2] of an object's X axis in the image, at the centre of its 3D box."""
    T_camera_box = reading.camera.T_world_camera.inverse() @ truth.instance.box3d.T_frame_box
    center = np.array(T_camera_box.translation_m)
    axes = T_camera_box.rotation().T[:2] * STEP * float(np.sqrt(center @ center))
    lens = reading.camera.intrinsics
    ends = lens.project(np.concatenate([center + axes, center - axes]))
    x_axis, y_axis = ends[:2] - ends[2:]
    # Turned by a right angle, the left side leads to the front.
    turned = np.array([-y_axis[1], y_axis[0]])
    best = x_axis if x_axis @ x_axis >= 0.01 * (turned @ turned) else turned
    length = float(np.sqrt(best @ best))
    # Outside the lens's field nothing has an image: then the image's columns are as good.
    return np.asarray(best / length) if 0.0 < length < np.inf else np.array([0.0, -1.0])


def mask_corners(mask: NDArray[np.bool_]) -> Array:
    """Corners of the first and last pixel of every row, [4 rows, 2]: their hull is the mask's."""
    rows = np.flatnonzero(mask.any(axis=1))
    first = mask[rows].argmax(axis=1)
    last = mask.shape[1] - mask[rows, ::-1].argmax(axis=1)
    ends = np.concatenate([first, first, last, last])
    return np.stack([ends, np.concatenate([rows, rows + 1, rows, rows + 1])], axis=1).astype(float)
