"""Amodal silhouettes for lenses with distortion: by rays, on a canvas of 3 x 3 images.

The canvas extends the lens model: its pixels outside the image look where a larger sensor behind
the same lens would, and nowhere beyond the lens's field.
"""

from __future__ import annotations

import math

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.boxes import BoxPx
from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.distortion_lut import NODE_STRIDE_PX
from gen_data.generator.renderers.warp.visibility.kernels.amodal_lens import (
    AmodalWindow,
    trace_silhouettes,
)
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M

EMPTY = BoxPx(0, 0, 0, 0)
_CORNERS = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])


def trace_masks(
    scene: Scene, world: PackedWorld, view: records.View, camera: Camera, cache: DeviceCache
) -> tuple[dict[int, BoxPx], NDArray[np.uint8]]:
    """A bounding box of each annotated instance's silhouette, and the masks of all boxes."""
    optics = cache.optics(camera.intrinsics)
    annotated = sorted(i.instance_id for i in scene.instances if i.annotated)
    boxes = dict.fromkeys(annotated, EMPTY)
    of_bodies: dict[int, BoxPx] = {}
    R_camera_world = camera.T_world_camera.rotation().T
    step_rad = _widest_step(optics.nodes)
    for number, body in enumerate(scene.bodies):
        if body.instance_id in boxes:
            ends_m = np.stack([world.body_records[end][number] for end in ("low_m", "high_m")])
            axis, half_rad = bounding_cone(ends_m - np.array(camera.T_world_camera.translation_m))
            cosines = optics.nodes @ (R_camera_world @ axis).astype(np.float32)
            # Every visible pixel has a node within the diagonal of a cell.
            box = box_around(cosines >= math.cos(min(half_rad + 1.5 * step_rad, math.pi)))
            of_bodies[number] = _clip_to_canvas(box, view)
            boxes[body.instance_id] = union_box(boxes[body.instance_id], of_bodies[number])
    windows, size = _window_records(scene, boxes, of_bodies)
    mask = wp.zeros(size, dtype=wp.uint8, device=cache.device)
    if len(windows):
        shape = (len(windows), int(windows["window"]["height"].max()))
        records_ = wp.array(windows, dtype=AmodalWindow, device=cache.device)
        inputs = [view, world.record, optics.nodes_on_device, NODE_STRIDE_PX, Z_NEAR_M, records_]
        wp.launch(trace_silhouettes, shape, inputs, [mask], device=cache.device)
    pixels: NDArray[np.uint8] = mask.numpy()
    return boxes, pixels


def bounding_cone(ends_m: Array) -> tuple[Array, float]:
    """Axis and half angle of a cone from the origin around a box; pi if it contains the origin.

    Args:
        ends_m: Low and high corner, [2, 3].
    """
    centre = ends_m.mean(axis=0)
    distance_m = math.sqrt(float((centre * centre).sum()))
    radius_m = 0.5 * math.sqrt(float(((ends_m[1] - ends_m[0]) ** 2).sum()))
    if distance_m <= radius_m:
        return np.array([0.0, 0.0, 1.0]), math.pi
    axis = centre / distance_m
    corners = ends_m[_CORNERS, [0, 1, 2]]
    cosines = corners @ axis / np.sqrt((corners * corners).sum(axis=1))
    least = float(cosines.min())
    # Cones below 90 degrees are convex: one that contains all corners contains the box.
    narrow_rad = math.acos(min(least, 1.0)) if least > 0.0 else math.pi
    return axis, min(narrow_rad, math.asin(radius_m / distance_m))


def box_around(marked: NDArray[np.bool_]) -> BoxPx:
    """Bounding box of marked nodes and two more cells, from the canvas's first pixel.

    May be empty.

    Args:
        marked: Flags of nodes, [rows, columns].
    """
    if not marked.any():
        return EMPTY
    ys, xs = np.flatnonzero(marked.any(axis=1)), np.flatnonzero(marked.any(axis=0))
    return BoxPx(
        (int(xs[0]) - 2) * NODE_STRIDE_PX,
        (int(ys[0]) - 2) * NODE_STRIDE_PX,
        (int(xs[-1]) + 2) * NODE_STRIDE_PX + 1,
        (int(ys[-1]) + 2) * NODE_STRIDE_PX + 1,
    )


def union_box(a: BoxPx, b: BoxPx) -> BoxPx:
    """Smallest box around two boxes, either of which may be empty."""
    if not a.width_px * a.height_px:
        return b
    if not b.width_px * b.height_px:
        return a
    return BoxPx(
        min(a.x_min, b.x_min), min(a.y_min, b.y_min), max(a.x_max, b.x_max), max(a.y_max, b.y_max)
    )


def mask_offsets(boxes: dict[int, BoxPx]) -> tuple[dict[int, int], int]:
    """First pixel of each instance's mask in a common buffer, and the buffer's size."""
    first_pixels, size = {}, 0
    for instance_id, box in boxes.items():
        first_pixels[instance_id] = size
        size += box.width_px * box.height_px
    return first_pixels, size


def _widest_step(nodes: Float32) -> float:
    """Largest angle between neighbouring visible nodes [rad]."""
    widest = 0.0
    for a, b in ((nodes[1:], nodes[:-1]), (nodes[:, 1:], nodes[:, :-1])):
        chords = ((a - b) ** 2).sum(axis=-1)
        widest = max(widest, float(np.max(chords, initial=0.0, where=np.isfinite(chords))))
    return 2.0 * math.asin(min(0.5 * math.sqrt(widest), 1.0))


def _clip_to_canvas(box: BoxPx, view: records.View) -> BoxPx:
    """Part of a box on the canvas, in image coordinates."""
    inside = box.clipped(3 * view.width, 3 * view.height)
    if inside is None:
        return EMPTY
    return BoxPx(
        inside.x_min - view.width,
        inside.y_min - view.height,
        inside.x_max - view.width,
        inside.y_max - view.height,
    )


def _window_records(
    scene: Scene, boxes: dict[int, BoxPx], of_bodies: dict[int, BoxPx]
) -> tuple[NDArray[np.void], int]:
    """One record per body that may be on the canvas, and the size of all instances' boxes."""
    first_pixels, size = mask_offsets(boxes)
    listed = [(number, box) for number, box in of_bodies.items() if box != EMPTY]
    values = np.zeros(len(listed), dtype=AmodalWindow.numpy_dtype())
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
