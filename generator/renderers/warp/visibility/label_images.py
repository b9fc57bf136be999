"""Label images, which the ray through each pixel's centre decides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.capture import Channel
from gen_data.generator.core.scene import Scene
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer
from gen_data.generator.renderers.warp.visibility.kernels import label_resolve


def label_images(
    scene: Scene,
    world: PackedWorld,
    view: records.View,
    gbuffer: GBuffer,
    channels: frozenset[Channel],
) -> dict[Channel, NDArray[Any]]:
    """All requested label channels, as documented at Channel."""
    shape = (view.height, view.width)
    images: dict[Channel, NDArray[Any]] = {}
    ids = {
        Channel.INSTANCE: [body.instance_id for body in scene.bodies],
        Channel.PART: [body.part_id for body in scene.bodies],
        Channel.CATEGORY: category_ids(scene),
    }
    for channel in sorted(channels & ids.keys(), key=lambda c: c.value):
        images[channel] = _ids(gbuffer, ids[channel]).reshape(shape)
    if Channel.Z_DEPTH in channels:
        images[Channel.Z_DEPTH] = _z_depths(view, gbuffer).reshape(shape)
    if Channel.RANGE in channels:
        inputs = [view, gbuffer.z_m]
        images[Channel.RANGE] = _launch(label_resolve.label_ranges, inputs, float, gbuffer).reshape(
            shape
        )
    if Channel.NORMALS in channels:
        inputs = [view, gbuffer.normals]
        normals = _launch(label_resolve.label_normals, inputs, wp.vec3, gbuffer)
        images[Channel.NORMALS] = normals.reshape(*shape, 3)
    if Channel.OBJECT_COORDINATES in channels:
        frames = wp.array(
            box_frames(scene), dtype=label_resolve.BoxFrame, device=gbuffer.hits.device
        )
        inputs = [world.record, gbuffer.hits, gbuffer.weights, frames]
        coordinates = _launch(label_resolve.label_object_coordinates, inputs, wp.vec3, gbuffer)
        images[Channel.OBJECT_COORDINATES] = coordinates.reshape(*shape, 3)
    return images


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


def _z_depths(view: records.View, gbuffer: GBuffer) -> NDArray[np.float32]:
    if view.lens == records.PINHOLE:
        z_m: NDArray[np.float32] = gbuffer.z_m.numpy().copy()
        return z_m
    return _launch(label_resolve.label_z_depths, [view, gbuffer.z_m], float, gbuffer)


def _ids(gbuffer: GBuffer, of_bodies: Sequence[int]) -> NDArray[np.uint16]:
    ids = np.array([0, *of_bodies], dtype=np.uint16)
    table = wp.array(ids, dtype=wp.uint16, device=gbuffer.hits.device)
    return _launch(label_resolve.label_ids, [gbuffer.hits, table], wp.uint16, gbuffer)


def _launch(kernel: wp.Kernel, inputs: list[Any], dtype: Any, gbuffer: GBuffer) -> NDArray[Any]:
    pixels = len(gbuffer.hits)
    image = wp.zeros(pixels, dtype=dtype, device=gbuffer.hits.device)
    wp.launch(kernel, pixels, inputs, [image], device=gbuffer.hits.device)
    values: NDArray[Any] = image.numpy()
    return values
