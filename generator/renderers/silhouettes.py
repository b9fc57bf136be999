"""Amodal silhouettes: each instance as if nothing stood before it, also beside the image."""

from __future__ import annotations

from typing import Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.boxes import BoxPx, tight_box
from generator.core.capture import Silhouette
from generator.core.scene import Scene
from generator.renderers.kernels import raster, rays, records
from generator.renderers.packing import PackedWorld
from generator.renderers.stock import AssetStock
from generator.renderers.visibility import project


def silhouettes(
    scene: Scene,
    world: PackedWorld,
    view: records.View,
    stock: AssetStock,
    method: Literal["auto", "raster", "rays"],
) -> dict[int, Silhouette]:
    """The silhouette of every instance of the scene, on a canvas of three by three images."""
    p_camera, xy = project(world, view, stock)
    boxes = _instance_boxes(scene, world, xy, view, stock)
    windows = np.zeros(max(len(scene.bodies), 1), dtype=raster.Window.numpy_dtype())
    offsets: dict[int, int] = {}
    size = 0
    for instance_id, box in boxes.items():
        offsets[instance_id] = size
        size += box.width_px * box.height_px
    for window, body in zip(windows, scene.bodies, strict=False):
        if body.instance_id in boxes:
            box = boxes[body.instance_id]
            window["x0"], window["y0"] = box.x_min, box.y_min
            window["width"], window["height"] = box.width_px, box.height_px
            window["offset"] = offsets[body.instance_id]
    mask = wp.zeros(size, dtype=wp.uint8, device=stock.device)
    on_device = wp.array(windows, dtype=raster.Window, device=stock.device)
    if method == "raster" or (method == "auto" and stock.device.is_cpu):
        inputs = [view, on_device, world.record, p_camera, xy]
        n = len(scene.bodies)
        wp.launch(raster.draw_silhouettes, n, inputs, [mask], device=stock.device)
    else:
        for b, window in enumerate(windows):
            pixels = int(window["width"]) * int(window["height"])
            inputs = [view, on_device, world.record, b, raster.Z_NEAR_M]
            wp.launch(rays.trace_silhouettes, pixels, inputs, [mask], device=stock.device)
    flat = mask.numpy().astype(np.bool_)
    return {
        instance.instance_id: _cut(instance.instance_id, boxes, offsets, flat)
        for instance in scene.instances
    }


def _instance_boxes(
    scene: Scene, world: PackedWorld, xy: wp.array, view: records.View, stock: AssetStock
) -> dict[int, BoxPx]:
    """Pixels that each instance may cover, within the canvas; absent where there are none."""
    n = len(scene.bodies)
    low = wp.zeros(n, dtype=wp.vec2i, device=stock.device)
    high = wp.zeros(n, dtype=wp.vec2i, device=stock.device)
    wp.launch(raster.frame_bodies, n, [world.record, xy], [low, high], device=stock.device)
    first, last = low.numpy(), high.numpy()
    canvas = BoxPx(-view.width, -view.height, 2 * view.width, 2 * view.height)
    boxes: dict[int, BoxPx] = {}
    for b, body in enumerate(scene.bodies):
        if body.instance_id == 0:
            continue
        box = canvas
        if last[b, 0] != raster.UNSNAPPED:
            (x0, y0), (x1, y1) = first[b].tolist(), last[b].tolist()
            box = BoxPx(x0, y0, x1 + 1, y1 + 1)
        so_far = boxes.get(body.instance_id, box)
        boxes[body.instance_id] = _union(so_far, box)
    clipped = {i: _intersection(box, canvas) for i, box in boxes.items()}
    return {i: box for i, box in clipped.items() if box.width_px > 0 and box.height_px > 0}


def _union(a: BoxPx, b: BoxPx) -> BoxPx:
    return BoxPx(
        min(a.x_min, b.x_min),
        min(a.y_min, b.y_min),
        max(a.x_max, b.x_max),
        max(a.y_max, b.y_max),
    )


def _intersection(a: BoxPx, b: BoxPx) -> BoxPx:
    return BoxPx(
        max(a.x_min, b.x_min),
        max(a.y_min, b.y_min),
        min(a.x_max, b.x_max),
        min(a.y_max, b.y_max),
    )


def _cut(
    instance_id: int, boxes: dict[int, BoxPx], offsets: dict[int, int], flat: NDArray[np.bool_]
) -> Silhouette:
    nothing = Silhouette(instance_id, 0, 0, np.zeros((0, 0), np.bool_))
    if instance_id not in boxes:
        return nothing
    box, first = boxes[instance_id], offsets[instance_id]
    mask = flat[first : first + box.width_px * box.height_px]
    mask = mask.reshape(box.height_px, box.width_px)
    tight = tight_box(mask, box.x_min, box.y_min)
    if tight is None:
        return nothing
    rows = slice(tight.y_min - box.y_min, tight.y_max - box.y_min)
    columns = slice(tight.x_min - box.x_min, tight.x_max - box.x_min)
    return Silhouette(instance_id, tight.x_min, tight.y_min, mask[rows, columns].copy())
