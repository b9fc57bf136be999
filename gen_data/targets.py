"""Training targets: arrays of one sample, for the usual tasks.

A target is a function of a Sample; these return NumPy arrays, which ``gen_data.torch`` turns into
tensors. A target has one camera, the first with a colour image unless ``camera`` names another:
``functools.partial(detection_target, camera="right")``. Images are [3, height, width], uint8, RGB.
Boxes, masks, labels and keypoints have the names, types and conventions of torchvision's reference
training: boxes are ``x_min, y_min, x_max, y_max`` in pixels, half-open; label 0 is background,
label ``k`` the ``k``-th category. Objects that a label map ignores are left out, as torchvision's
reference leaves out crowds: its detectors would learn them. ``ignored=True`` keeps them, for losses
that mask them: ``iscrowd`` is 1, and the label 0 if the map has no class for them.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.api.sample import CameraReading, Sample
from gen_data.core.errors import ConfigError
from gen_data.core.sample import ObjectTruth
from gen_data.core.skeletons import find_skeleton

Arrays = dict[str, NDArray[Any]]


def image_target(sample: Sample, camera: str = "") -> NDArray[np.uint8]:
    """Colour image of a camera.

    Args:
        sample: The sample.
        camera: Name of the camera; empty = the first one with a colour image.
    """
    return _channels_first(_camera(sample, camera).rgb)


def detection_target(
    sample: Sample, camera: str = "", *, ignored: bool = False
) -> tuple[NDArray[np.uint8], Arrays]:
    """Image and boxes of the visible annotated objects.

    Returns:
        The image, and ``boxes`` float32 [n, 4], ``labels`` int64 [n], ``area`` float32 [n],
        ``iscrowd`` int64 [n]: 1 for ignored objects;
        ``image_id`` int64 []: the image's id in the COCO export, unique among all cameras.
    """
    reading = _camera(sample, camera)
    return _channels_first(reading.rgb), _boxes(sample, reading, _visible(reading, ignored))


def segmentation_target(
    sample: Sample, camera: str = "", *, ignored: bool = False
) -> tuple[NDArray[np.uint8], Arrays]:
    """As ``detection_target``, with ``masks`` uint8 [n, height, width] of the visible pixels.

    Raises:
        ConfigError: the camera writes no instance ids.
    """
    reading = _camera(sample, camera)
    objects = _visible(reading, ignored)
    ids = _channel(reading, "instance")
    numbers = np.array([thing.instance.instance_id for thing in objects], ids.dtype)
    masks = (ids == numbers[:, None, None]).astype(np.uint8)
    return _channels_first(reading.rgb), _boxes(sample, reading, objects) | {"masks": masks}


def keypoint_target(
    sample: Sample, camera: str = "", category: str = "", *, ignored: bool = False
) -> tuple[NDArray[np.uint8], Arrays]:
    """As ``detection_target`` for the objects of one category with keypoints.

    Adds ``keypoints`` float32 [n, k, 3]: x, y and COCO's visibility, of all points of the skeleton.
    Without such an object, k is 0.

    Args:
        sample: The sample.
        camera: Name of the camera; empty = the first one with a colour image.
        category: Name of the category; empty = all, which must have one skeleton.
        ignored: Whether to keep objects that a label map ignores.

    Raises:
        ConfigError: objects have several skeletons, whose points a model would mix up:
            torchvision's loss takes rows of any number of points without an error.
    """
    reading = _camera(sample, camera)
    jointed = [
        thing
        for thing in _visible(reading, ignored)
        if thing.keypoints and category in ("", thing.instance.category)
    ]
    kinds = {find_skeleton([p.name for p in thing.keypoints or ()]) for thing in jointed}
    if len(kinds) > 1:
        found = sorted({thing.instance.category for thing in jointed})
        raise ConfigError(
            f"sample {sample.index} has objects with different keypoints: {', '.join(found)}; name "
            f'one, such as functools.partial(keypoint_target, category="{found[-1]}")'
        )
    skeleton = next(iter(kinds), None)
    rows = []
    for thing in jointed:
        points = {p.name: (*p.image_px, p.visibility) for p in thing.keypoints or ()}
        names = skeleton.names if skeleton is not None else ()
        rows.append([points.get(name, (0.0, 0.0, 0)) for name in names])
    count = len(skeleton.names) if skeleton is not None else 0
    keypoints = np.array(rows, np.float32).reshape(len(rows), count, 3)
    target = _boxes(sample, reading, jointed) | {"keypoints": keypoints}
    return _channels_first(reading.rgb), target


def semantic_target(
    sample: Sample, camera: str = ""
) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Image and category id of every pixel, int64 [height, width]; 0 = no category."""
    reading = _camera(sample, camera)
    return _channels_first(reading.rgb), _channel(reading, "category").astype(np.int64)


def depth_target(sample: Sample, camera: str = "") -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Image and depth along the optical axis [m], float32 [1, height, width]; inf = nothing."""
    reading = _camera(sample, camera)
    return _channels_first(reading.rgb), _channel(reading, "depth")[None]


def stereo_target(
    sample: Sample, left: str, right: str
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]:
    """Both images, and the disparity of the left one [px], float32 [height, width]; 0 = none."""
    reading = _camera(sample, left)
    pair = _channels_first(reading.rgb), _channels_first(_camera(sample, right).rgb)
    return *pair, _channel(reading, "disparity")


def flow_target(
    sample: Sample, camera: str = ""
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]:
    """Image, flow to the next instant [px], float32 [2, height, width], and where it is known."""
    reading = _camera(sample, camera)
    flow = np.moveaxis(_channel(reading, "flow_forward"), -1, 0)
    known = np.isfinite(flow).all(axis=0)
    return _channels_first(reading.rgb), np.where(known, flow, np.float32(0.0)), known


def lidar_target(sample: Sample, lidar: str = "") -> tuple[NDArray[np.float32], Arrays]:
    """Points and 3D boxes of the objects with points, in the scanner's frame.

    Args:
        sample: The sample.
        lidar: Name of the scanner; empty = the first one.

    Returns:
        Points float32 [n, 4]: x, y, z [m] and intensity. ``boxes`` float32 [m, 7]: centre x, y, z,
        length, width, height [m] and yaw [rad] about z, 0 along x; ``labels`` int64 [m];
        ``points`` int64 [m], the number of points on each object.

    Raises:
        UnknownNameError: there is no such scanner.
        ConfigError: the data set has no 3D boxes in the scanner's frame.
    """
    name = lidar or next(iter(sample.lidars), "")
    cloud = sample.lidars[name]
    truth = sample.ego.boxes3d if sample.ego is not None else None
    if truth is None or name not in truth:
        raise ConfigError(
            f"sample {sample.index} has no 3D boxes in the frame of '{name}'; add the annotation "
            "boxes3d"
        )
    ids, counts = np.unique(cloud.points["instance_id"], return_counts=True)
    hits = dict(zip(ids.tolist(), counts.tolist(), strict=True))
    classes = {i.instance_id: i.category_id for i in sample.scene.instances if i.annotated}
    seen = [n for n in truth[name] if hits.get(n, 0) > 0 and classes.get(n, 0) > 0]
    boxes = []
    for number in seen:
        box = truth[name][number]
        w, x, y, z = box.T_frame_box.quaternion_wxyz
        yaw_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        boxes.append((*box.T_frame_box.translation_m, *box.size_m, yaw_rad))
    points = np.column_stack([cloud.points["position_m"], cloud.points["intensity"]])
    return points.astype(np.float32), {
        "boxes": np.array(boxes, np.float32).reshape(-1, 7),
        "labels": np.array([classes[n] for n in seen], np.int64),
        "points": np.array([hits[n] for n in seen], np.int64),
    }


def _camera(sample: Sample, name: str) -> CameraReading:
    if name:
        return sample.cameras[name]
    for reading in sample.cameras.values():
        if "rgb" in reading.channels:
            return reading
    raise ConfigError(f"sample {sample.index} has no colour image; add an rgb_camera")


def _channel(reading: CameraReading, name: str) -> NDArray[Any]:
    channels: Mapping[str, NDArray[Any]] = reading.channels
    if name not in channels:
        raise ConfigError(
            f"camera '{reading.name}' has no channel '{name}'; add it to the channels of the sensor"
        )
    return channels[name]


def _channels_first(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(np.moveaxis(rgb, -1, 0))


def _visible(reading: CameraReading, ignored: bool) -> list[ObjectTruth]:
    return [
        thing
        for thing in reading.objects
        if thing.instance.annotated and thing.box is not None and (ignored or not thing.ignored)
    ]


def _boxes(sample: Sample, reading: CameraReading, objects: Sequence[ObjectTruth]) -> Arrays:
    boxes = [(b.x_min, b.y_min, b.x_max, b.y_max) for t in objects if (b := t.box) is not None]
    return {
        "boxes": np.array(boxes, np.float32).reshape(-1, 4),
        "labels": np.array([t.instance.category_id for t in objects], np.int64),
        "area": np.array([t.visible_px for t in objects], np.float32),
        "iscrowd": np.array([t.ignored for t in objects], np.int64),
        "image_id": np.array(sample.image_id(reading.name), np.int64),
    }
