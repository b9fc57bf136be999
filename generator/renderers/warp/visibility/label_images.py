"""Label images, which the ray through each pixel's centre decides."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.capture import Channel
from gen_data.generator.core.scene import Scene
from gen_data.generator.renderers.warp.frame_context import CameraView
from gen_data.generator.renderers.warp.plates import hide_labels
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.visibility.kernels import label_resolve


def label_images(frame: CameraView, channels: frozenset[Channel]) -> dict[Channel, NDArray[Any]]:
    """All requested label channels, as documented at Channel."""
    scene, view, gbuffer = frame.state.scene, frame.view, frame.gbuffer
    images: dict[Channel, NDArray[Any]] = {}
    ids = {
        Channel.INSTANCE: [body.instance_id for body in scene.bodies],
        Channel.PART: [body.part_id for body in scene.bodies],
        Channel.CATEGORY: category_ids(scene),
    }
    for channel in sorted(channels & ids.keys(), key=lambda c: c.value):
        listed = np.array([0, *ids[channel]], dtype=np.uint16)
        table = wp.array(listed, dtype=wp.uint16, device=frame.cache.device)
        inputs = [gbuffer.hits, table]
        images[channel] = _launch(frame, label_resolve.label_ids, inputs, wp.uint16)
    if Channel.Z_DEPTH in channels and view.lens == records.PINHOLE:
        images[Channel.Z_DEPTH] = gbuffer.z_m.numpy().reshape(view.height, view.width).copy()
    elif Channel.Z_DEPTH in channels:
        inputs = [view, gbuffer.z_m]
        images[Channel.Z_DEPTH] = _launch(frame, label_resolve.label_z_depths, inputs, float)
    if Channel.RANGE in channels:
        inputs = [view, gbuffer.z_m]
        images[Channel.RANGE] = _launch(frame, label_resolve.label_ranges, inputs, float)
    if Channel.NORMALS in channels:
        inputs = [view, gbuffer.normals]
        images[Channel.NORMALS] = _launch(frame, label_resolve.label_normals, inputs, wp.vec3)
    if Channel.OBJECT_COORDINATES in channels:
        frames, kernel = box_frames(scene), label_resolve.label_object_coordinates
        boxes = wp.array(frames, dtype=label_resolve.BoxFrame, device=frame.cache.device)
        inputs = [frame.world.record, gbuffer.hits, gbuffer.weights, boxes]
        images[Channel.OBJECT_COORDINATES] = _launch(frame, kernel, inputs, wp.vec3)
    if frame.context.backdrop is not None:
        hide_labels(frame, frame.context.backdrop, images)
    return images


def _launch(frame: CameraView, kernel: wp.Kernel, inputs: list[Any], dtype: Any) -> NDArray[Any]:
    """The image that a kernel computes, [h, w] or [h, w, 3]."""
    image = wp.zeros(frame.pixels, dtype=dtype, device=frame.cache.device)
    frame.launch(kernel, frame.pixels, inputs, [image])
    values: NDArray[Any] = image.numpy()
    return values.reshape(frame.view.height, frame.view.width, *values.shape[1:])


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
