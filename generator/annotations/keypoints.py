"""Named points of objects: where they are, and whether they can be seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from generator.core.capture import Channel, Reading
from generator.core.geometry import Keypoint
from generator.core.sample import KeypointTruth, ObjectTruth
from generator.core.scene import Scene
from generator.core.se3 import Array, Vec3


@dataclass(frozen=True, slots=True)
class Keypoints:
    """Points of instances that have them: image and camera coordinates, and COCO's visibility.

    0 = not in the image (or behind the camera), 1 = in the image and hidden, by other things or
    by the object itself, 2 = visible. A point may lie as deep as its own radius below the surface
    that is seen there.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.Z_DEPTH})

    def annotate(self, scene: Scene, reading: Reading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``keypoints``, in the instance's order; empty for one that has none."""
        instance = truth.instance
        T_camera_world = reading.camera.T_world_camera.inverse()
        T_camera_instance = T_camera_world @ instance.T_world_instance
        found = tuple(
            _seen(
                reading,
                instance.instance_id,
                point,
                T_camera_instance.apply(np.array(point.position_m)),
            )
            for point in instance.keypoints
        )
        return replace(truth, keypoints=found)


def _seen(reading: Reading, instance_id: int, point: Keypoint, p_camera: Array) -> KeypointTruth:
    camera = reading.camera.intrinsics
    x, y, z = (float(v) for v in p_camera)
    position_m: Vec3 = (x, y, z)
    if z <= 0:
        return KeypointTruth(point.name, position_m)
    u, v = (float(w) for w in camera.project(p_camera))
    if not (0 <= u < camera.width_px and 0 <= v < camera.height_px):
        return KeypointTruth(point.name, position_m)
    # Depths differ by less than distances along a slanted ray do.
    slack_m = point.radius_m * z / math.sqrt(x * x + y * y + z * z)
    visible = is_visible(reading, instance_id, (int(u), int(v)), z - slack_m)
    return KeypointTruth(point.name, position_m, (u, v), 2 if visible else 1)


def is_visible(
    reading: Reading, instance_id: int, pixel: tuple[int, int], nearest_m: float
) -> bool:
    """Whether the surface of an instance is seen at a pixel, and no nearer than it may be.

    Whatever is nearer at the pixel itself hides the point. Where the pixel shows something that
    lies behind the point, its ray just misses the silhouette: then one of the eight neighbours
    has to show the instance.

    Args:
        reading: With ids and z-depth.
        instance_id: Of the instance that the point belongs to.
        pixel: Column and row.
        nearest_m: Least z-depth of the surface through which the point is still seen.
    """
    ids, z_depth_m = reading.channels[Channel.INSTANCE], reading.channels[Channel.Z_DEPTH]
    column, row = pixel
    if z_depth_m[row, column] < nearest_m:
        return False
    if ids[row, column] == instance_id:
        return True
    around = np.s_[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return bool(((ids[around] == instance_id) & (z_depth_m[around] >= nearest_m)).any())
