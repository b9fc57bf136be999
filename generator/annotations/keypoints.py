"""Keypoints of objects: positions and visibility."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.config.base_model import Strict
from gen_data.core.asset_types import Keypoint
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.rolling_shutter_projection import project_rolling_shutter
from gen_data.core.sample import KeypointTruth, ObjectTruth
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array, Vec3

LEAST_COSINE = 1.0 / 3.0
"""Lower bound of the cosine of incidence that converts ray lengths to depths below a surface."""


class Keypoints(Strict):
    """Points of instances that have them: image and camera coordinates, and COCO's visibility.

    0 = not in the image (or outside the lens's field), 1 = in the image but hidden by other objects
    or by the object itself, 2 = visible. A point up to its radius below the surface of its object
    counts as visible. The depth is measured along the surface's normal: a hub behind the face of
    its wheel is visible from the side and obliquely alike.

    With a rolling shutter image coordinates refer to the instant of the point's row, camera
    coordinates to the image's instant.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset(
        {Channel.INSTANCE, Channel.RANGE, Channel.NORMALS}
    )
    type: Literal["keypoints"] = "keypoints"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``keypoints``, in the instance's order; empty for one that has none."""
        instance = truth.instance
        if not instance.keypoints:
            return replace(truth, keypoints=())
        T_camera_world = reading.camera.T_world_camera.inverse()
        T_camera_instance = T_camera_world @ instance.T_world_instance
        places_m = np.array([point.position_m for point in instance.keypoints])
        p_camera = T_camera_instance.apply(places_m)
        p_seen, image_px = p_camera, reading.camera.intrinsics.project(p_camera)
        if reading.camera.shutter.rolls:
            p_seen, image_px = project_rolling_shutter(scene, reading.camera, places_m, instance)
        found = tuple(
            _locate(reading, instance.instance_id, point, position_m, seen)
            for point, position_m, *seen in zip(
                instance.keypoints, p_camera, p_seen, image_px, strict=True
            )
        )
        return replace(truth, keypoints=found)


def _locate(
    reading: SensorReading,
    instance_id: int,
    point: Keypoint,
    p_camera: Array,
    seen: Sequence[Array],
) -> KeypointTruth:
    """One keypoint, at ``p_camera`` at the image's instant.

    ``seen`` is where it is when its row is exposed: camera frame, and image.
    """
    camera = reading.camera.intrinsics
    x, y, z = (float(v) for v in p_camera)
    position_m: Vec3 = (x, y, z)
    p_seen, image_px = seen
    u, v = (float(w) for w in image_px)
    if not (0 <= u < camera.width_px and 0 <= v < camera.height_px):
        return KeypointTruth(point.name, position_m)
    visible = is_visible(reading, instance_id, p_seen, (int(u), int(v)), point.radius_m)
    return KeypointTruth(point.name, position_m, (u, v), 2 if visible else 1)


def is_visible(
    reading: SensorReading,
    instance_id: int,
    p_camera: Array,
    pixel: tuple[int, int],
    radius_m: float,
) -> bool:
    """Whether a point of an instance, in the camera frame [m], is visible at its pixel.

    It may lie ``radius_m`` below the surface. If the pixel (column, row) shows another object
    behind the point, its ray just misses the silhouette: then one of the eight neighbours must
    show the instance.
    """
    column, row = pixel
    left, top = max(column - 1, 0), max(row - 1, 0)
    window = np.s_[top : row + 2, left : column + 2]
    centre = (row - top, column - left)
    own = reading.channels[Channel.INSTANCE][window] == instance_id
    distance_m = math.sqrt(float(p_camera @ p_camera))
    along_m = distance_m - reading.channels[Channel.RANGE][window]
    cosine = np.abs(reading.channels[Channel.NORMALS][window] @ (p_camera / distance_m))
    shallow = along_m * np.maximum(cosine, LEAST_COSINE) <= radius_m
    if own[centre]:
        return bool(shallow[centre])
    return bool(along_m[centre] <= radius_m and (own & shallow).any())
