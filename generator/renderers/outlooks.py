"""Silhouettes before lenses that bend straight edges: by rays, on a canvas of 3 x 3 images.

The canvas goes on where the lens's model does: its pixels beside the image look where a larger
sensor behind the same lens would, and nowhere beyond the lens's field.
"""

from __future__ import annotations

import math

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.boxes import BoxPx
from generator.core.geometry import Float32
from generator.core.scene import Camera, Scene
from generator.core.se3 import Array
from generator.renderers.kernels import records
from generator.renderers.kernels.raster import Z_NEAR_M
from generator.renderers.kernels.silhouette import Outlook, trace_silhouettes
from generator.renderers.optics import NODE_STRIDE_PX
from generator.renderers.packing import PackedWorld
from generator.renderers.stock import AssetStock

EMPTY = BoxPx(0, 0, 0, 0)


def traced_masks(
    scene: Scene, world: PackedWorld, view: records.View, camera: Camera, stock: AssetStock
) -> tuple[dict[int, BoxPx], NDArray[np.uint8]]:
    """Per annotated instance a box that holds its silhouette, and the pixels of all boxes."""
    optics = stock.optics(camera.intrinsics)
    annotated = sorted(i.instance_id for i in scene.instances if i.annotated)
    boxes = dict.fromkeys(annotated, EMPTY)
    of_bodies: dict[int, BoxPx] = {}
    R_camera_world = camera.T_world_camera.rotation().T
    step_rad = _widest_step(optics.nodes)
    for number, body in enumerate(scene.bodies):
        if body.instance_id in boxes:
            low_m = world.placed["low_m"][number].astype(np.float64)
            high_m = world.placed["high_m"][number].astype(np.float64)
            away = R_camera_world @ (0.5 * (low_m + high_m) - camera.T_world_camera.translation_m)
            radius_m = 0.5 * math.sqrt(float(((high_m - low_m) ** 2).sum()))
            box = box_around_ball(optics.nodes, step_rad, away, radius_m)
            of_bodies[number] = _on_canvas(box, view)
            boxes[body.instance_id] = around(boxes[body.instance_id], of_bodies[number])
    outlooks, size = _outlooks(scene, boxes, of_bodies)
    mask = wp.zeros(size, dtype=wp.uint8, device=stock.device)
    if len(outlooks):
        shape = (len(outlooks), int(outlooks["window"]["height"].max()))
        records_ = wp.array(outlooks, dtype=Outlook, device=stock.device)
        inputs = [view, world.record, optics.nodes_on_device, NODE_STRIDE_PX, Z_NEAR_M, records_]
        wp.launch(trace_silhouettes, shape, inputs, [mask], device=stock.device)
    pixels: NDArray[np.uint8] = mask.numpy()
    return boxes, pixels


def box_around_ball(nodes: Float32, step_rad: float, away_m: Array, radius_m: float) -> BoxPx:
    """Pixels, counted from the canvas's first, outside of which no ray meets a ball; may be empty.

    Args:
        nodes: Unit directions at every few pixels of the canvas, NaN where nothing is shown.
        step_rad: Widest angle between neighbours of them.
        away_m: The ball's centre in the camera frame.
        radius_m: Its radius.
    """
    rows, columns = nodes.shape[:2]
    distance_m = math.sqrt(float((away_m * away_m).sum()))
    if distance_m <= radius_m:
        return BoxPx(0, 0, columns * NODE_STRIDE_PX, rows * NODE_STRIDE_PX)
    # Every pixel that is shown has a node within a diagonal of a cell.
    reach_rad = math.asin(radius_m / distance_m) + 1.5 * step_rad
    cosines = nodes @ (away_m / distance_m).astype(np.float32)
    near = cosines >= math.cos(min(reach_rad, math.pi))
    if not near.any():
        return EMPTY
    ys, xs = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    return BoxPx(
        (int(xs[0]) - 2) * NODE_STRIDE_PX,
        (int(ys[0]) - 2) * NODE_STRIDE_PX,
        (int(xs[-1]) + 2) * NODE_STRIDE_PX + 1,
        (int(ys[-1]) + 2) * NODE_STRIDE_PX + 1,
    )


def around(a: BoxPx, b: BoxPx) -> BoxPx:
    """Smallest box around two, of which either may be empty."""
    if not a.width_px * a.height_px:
        return b
    if not b.width_px * b.height_px:
        return a
    return BoxPx(
        min(a.x_min, b.x_min), min(a.y_min, b.y_min), max(a.x_max, b.x_max), max(a.y_max, b.y_max)
    )


def _widest_step(nodes: Float32) -> float:
    """Largest angle between neighbouring nodes that are both shown [rad]."""
    widest = 0.0
    for a, b in ((nodes[1:], nodes[:-1]), (nodes[:, 1:], nodes[:, :-1])):
        chords = ((a - b) ** 2).sum(axis=-1)
        widest = max(widest, float(np.max(chords, initial=0.0, where=np.isfinite(chords))))
    return 2.0 * math.asin(min(0.5 * math.sqrt(widest), 1.0))


def _on_canvas(box: BoxPx, view: records.View) -> BoxPx:
    """The part of a box on the canvas, in image coordinates."""
    inside = box.clipped(3 * view.width, 3 * view.height)
    if inside is None:
        return EMPTY
    return BoxPx(
        inside.x_min - view.width,
        inside.y_min - view.height,
        inside.x_max - view.width,
        inside.y_max - view.height,
    )


def _outlooks(
    scene: Scene, boxes: dict[int, BoxPx], of_bodies: dict[int, BoxPx]
) -> tuple[NDArray[np.void], int]:
    """One record per body that may be on the canvas, and the pixels of all instances' boxes."""
    first_pixels, size = {}, 0
    for instance_id, box in boxes.items():
        first_pixels[instance_id] = size
        size += box.width_px * box.height_px
    listed = [(number, box) for number, box in of_bodies.items() if box != EMPTY]
    values = np.zeros(len(listed), dtype=Outlook.numpy_dtype())
    for value, (number, box) in zip(values, listed, strict=True):
        instance_id = scene.bodies[number].instance_id
        whole = boxes[instance_id]
        value["body"] = number
        value["window"]["x0"], value["window"]["y0"] = box.x_min, box.y_min
        value["window"]["width"], value["window"]["height"] = box.width_px, box.height_px
        offset = (box.y_min - whole.y_min) * whole.width_px + box.x_min - whole.x_min
        value["first_pixel"] = first_pixels[instance_id] + offset
        value["stride"] = whole.width_px
    return values, size
