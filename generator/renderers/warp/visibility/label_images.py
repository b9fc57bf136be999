"""Label images, which the ray through each pixel's centre decides."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.scene import Scene
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.visibility import layers, mirrors
from gen_data.renderers.warp.visibility.frame_context import CameraView
from gen_data.renderers.warp.visibility.kernels import label_resolve
from gen_data.renderers.warp.visibility.plates import hide_labels


def label_images(frame: CameraView, channels: frozenset[Channel]) -> dict[Channel, NDArray[Any]]:
    """All requested label channels, as documented at Channel."""
    drawn = draw_labels(frame, channels)
    images = read_images(drawn, frame.view.height, frame.view.width)
    parts = trace_further(frame, channels)
    return images | further_images(frame, images, parts, channels)


def trace_further(
    frame: CameraView, channels: frozenset[Channel]
) -> tuple[layers.SparseLabels, ...]:
    """Requested labels of surfaces that a frame shows through glass and in mirrors."""
    return layers.trace_behind(frame, channels), mirrors.trace_mirrors(frame, channels)


def further_images(
    frame: CameraView,
    images: Mapping[Channel, NDArray[Any]],
    parts: Sequence[layers.SparseLabels],
    channels: frozenset[Channel],
) -> dict[Channel, NDArray[Any]]:
    """Images of layers and mirrors: first layers are among images, further labels in parts."""
    lens = frame.state.camera.intrinsics
    mirrored = mirrors.mirror_images(channels, parts, lens.height_px, lens.width_px)
    return layers.stack_layers(frame, images, parts) | mirrored


@dataclass(frozen=True, eq=False, slots=True)
class DrawnLabels:
    """Label channels on the device, in the order of the arrays of ``memory``; flat."""

    channels: tuple[Channel, ...]
    memory: Readback


def read_images(drawn: DrawnLabels, height: int, width: int) -> dict[Channel, NDArray[Any]]:
    """Label channels on the host, [h, w] or [h, w, 3]."""
    flat = drawn.memory.numpy() if drawn.channels else ()
    return {
        channel: values.reshape(height, width, *values.shape[1:])
        for channel, values in zip(drawn.channels, flat, strict=True)
    }


_DTYPES: dict[Channel, Any] = {
    Channel.CATEGORY: wp.uint16,
    Channel.INSTANCE: wp.uint16,
    Channel.PART: wp.uint16,
    Channel.Z_DEPTH: float,
    Channel.RANGE: float,
    Channel.NORMALS: wp.vec3,
    Channel.OBJECT_COORDINATES: wp.vec3,
    Channel.DEPTH_LAYERS: float,
    Channel.INSTANCE_LAYERS: wp.uint16,
    Channel.MATERIAL_LAYERS: wp.uint16,
}
"""Types of pixels; of layers, these are the first."""
_Z_DEPTHS = frozenset({Channel.Z_DEPTH, Channel.DEPTH_LAYERS})


def empty_labels(channels: frozenset[Channel], pixels: int, device: wp.Device) -> DrawnLabels:
    """Memory for those channels that are labels."""
    labels = tuple(channel for channel in _DTYPES if channel in channels)
    dtypes = [_DTYPES[channel] for channel in labels]
    return DrawnLabels(labels, Readback.allocate(pixels, dtypes, device))


def draw_labels(frame: CameraView, channels: frozenset[Channel]) -> DrawnLabels:
    """All requested label channels, on the device."""
    drawn = empty_labels(channels, frame.pixels, frame.cache.device)
    for channel, image in zip(drawn.channels, drawn.memory.parts, strict=True):
        _draw_label(frame, channel, image)
        if frame.context.backdrop is not None:
            hide_labels(frame, frame.context.backdrop, image, _nothing(channel))
    return drawn


def _nothing(channel: Channel) -> Any:
    is_distance = channel is Channel.RANGE or channel in _Z_DEPTHS
    return math.inf if is_distance else _DTYPES[channel](0)


def _draw_label(frame: CameraView, channel: Channel, image: wp.array) -> None:
    scene, view, gbuffer = frame.state.scene, frame.view, frame.gbuffer
    if channel in _Z_DEPTHS and view.lens == records.PINHOLE:
        wp.copy(image, gbuffer.z_m)
    elif channel in _Z_DEPTHS:
        frame.launch(label_resolve.label_z_depths, frame.pixels, [view, gbuffer.z_m], [image])
    elif channel is Channel.RANGE:
        frame.launch(label_resolve.label_ranges, frame.pixels, [view, gbuffer.z_m], [image])
    elif channel is Channel.NORMALS:
        frame.launch(label_resolve.label_normals, frame.pixels, [view, gbuffer.normals], [image])
    elif channel is Channel.OBJECT_COORDINATES:
        frames = box_frames(scene)
        boxes = wp.array(frames, dtype=label_resolve.BoxFrame, device=frame.cache.device)
        inputs = [frame.world.record, gbuffer.hits, gbuffer.weights, boxes]
        frame.launch(label_resolve.label_object_coordinates, frame.pixels, inputs, [image])
    elif channel is Channel.MATERIAL_LAYERS:
        layers.draw_materials(frame, image)
    else:
        ids = np.array([0, *_body_ids(scene, channel)], dtype=np.uint16)
        table = wp.array(ids, dtype=wp.uint16, device=frame.cache.device)
        frame.launch(label_resolve.label_ids, frame.pixels, [gbuffer.hits, table], [image])


def _body_ids(scene: Scene, channel: Channel) -> list[int]:
    if channel is Channel.CATEGORY:
        return category_ids(scene)
    name = "part_id" if channel is Channel.PART else "instance_id"
    return [getattr(body, name) for body in scene.bodies]


def category_ids(scene: Scene) -> list[int]:
    """Category id of each body's instance; 0 for unlabelled background."""
    by_instance = {instance.instance_id: instance.category_id for instance in scene.instances}
    return [by_instance.get(body.instance_id, 0) for body in scene.bodies]


def box_frames(scene: Scene) -> NDArray[np.void]:
    """Per body, the transform from its mesh frame to the unit cube of its instance's box."""
    frames = np.zeros(len(scene.bodies), dtype=label_resolve.BoxFrame.numpy_dtype())
    instances = {instance.instance_id: instance for instance in scene.instances}
    for frame, body in zip(frames, scene.bodies, strict=True):
        instance = instances.get(body.instance_id)
        if instance is None:
            continue
        T_instance_body = instance.T_world_instance.inverse() @ body.T_world_body
        low = np.asarray(instance.box_min_m)
        # A flat box has no extent along its thickness; any position is valid, here 0.
        size = np.maximum(np.asarray(instance.box_max_m) - low, 1e-9)
        frame["A_box_mesh"] = T_instance_body.rotation() * body.scale / size[:, None]
        frame["t_box_mesh"] = (np.asarray(T_instance_body.translation_m) - low) / size
        frame["labelled"] = 1
    return frames
