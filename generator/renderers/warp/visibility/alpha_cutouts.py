"""Bodies with cut-outs in rasterised images: ray-traced into the z-buffer."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.boxes import BoxPx
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M


def has_cutouts(body_records: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether rays may pass holes in each body, bool [n]."""
    holes: NDArray[np.bool_] = (body_records["cutouts"] & int(records.HOLES)) != 0
    return holes


def trace_over(
    world: PackedWorld, view: records.View, seen: NDArray[np.int32], nearness: wp.array, hits: Any
) -> None:
    """Add listed bodies to a z-buffer of pixel centres, in place."""
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    bodies = _upload_bodies(world, view, seen, hits.device)
    inputs = [view, world.record, bodies, Z_NEAR_M]
    wp.launch(
        alpha_cutouts.trace_centres, view.height, inputs, [nearness, hits], device=hits.device
    )


def trace_over_samples(
    world: PackedWorld,
    view: records.View,
    seen: NDArray[np.int32],
    pixels: wp.array,
    parts: Array,
    nearness: wp.array,
    hits: wp.array,
) -> None:
    """Add listed bodies to a z-buffer of listed pixels' samples, in place."""
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    device = hits.device
    bodies = _upload_bodies(world, view, seen, device)
    offsets = wp.array(parts, dtype=wp.vec2, device=device)
    inputs = [view, world.record, bodies, Z_NEAR_M, pixels, offsets]
    wp.launch(alpha_cutouts.trace_samples, len(pixels), inputs, [nearness, hits], device=device)


def trace_outlines(
    world: PackedWorld, view: records.View, canvases: NDArray[np.void], mask: wp.array
) -> None:
    """Draw silhouettes of bodies with cut-outs into the mask pixels of their Canvas records."""
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    outlines = np.zeros(len(canvases), dtype=alpha_cutouts.Outline.numpy_dtype())
    for outline, canvas in zip(outlines, canvases, strict=True):
        whole = canvas["window"]
        around = BoxPx(
            int(whole["x0"]),
            int(whole["y0"]),
            int(whole["x0"] + whole["width"]),
            int(whole["y0"] + whole["height"]),
        )
        box = _intersect(project_window(world.body_records[canvas["body"]], view), around)
        outline["body"] = canvas["body"]
        outline["window"] = _window_fields(box)
        offset = (box.y_min - around.y_min) * around.width_px + box.x_min - around.x_min
        outline["first_pixel"] = canvas["first_pixel"] + offset
        outline["stride"] = around.width_px
    shape = (len(outlines), int(outlines["window"]["height"].max(initial=0)))
    listed = wp.array(outlines, dtype=alpha_cutouts.Outline, device=mask.device)
    inputs = [view, world.record, listed, Z_NEAR_M]
    wp.launch(alpha_cutouts.trace_outlines, shape, inputs, [mask], device=mask.device)


def project_window(body_records: np.void, view: records.View) -> BoxPx:
    """Pixels that a body may cover before a pinhole; may lie outside the image."""
    ends = np.stack([body_records["low_m"], body_records["high_m"]]).astype(np.float64)
    picks = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])
    corners = ends[picks, np.arange(3)] - np.array(view.eye_m, dtype=np.float64)
    R_world_camera = np.array(view.R_world_camera, dtype=np.float64).reshape(3, 3)
    x, y, z = np.einsum("ki,ij->jk", corners, R_world_camera, optimize=False)
    everywhere = BoxPx(-view.width, -view.height, 2 * view.width, 2 * view.height)
    if z.min() < Z_NEAR_M:
        return everywhere
    x_px, y_px = view.fx * x / z + view.cx, view.fy * y / z + view.cy
    low = np.floor([x_px.min(), y_px.min()]) - 1.0
    high = np.ceil([x_px.max(), y_px.max()]) + 1.0
    return _intersect(BoxPx(int(low[0]), int(low[1]), int(high[0]), int(high[1])), everywhere)


def _upload_bodies(
    world: PackedWorld, view: records.View, seen: NDArray[np.int32], device: wp.Device
) -> wp.array:
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    values = np.zeros(len(seen), dtype=alpha_cutouts.CutoutBody.numpy_dtype())
    for value, number in zip(values, seen.tolist(), strict=True):
        value["body"] = number
        value["window"] = _window_fields(project_window(world.body_records[number], view))
    return wp.array(values, dtype=alpha_cutouts.CutoutBody, device=device)


def _window_fields(box: BoxPx) -> tuple[int, int, int, int]:
    return (box.x_min, box.y_min, box.width_px, box.height_px)


def _intersect(box: BoxPx, bounds: BoxPx) -> BoxPx:
    """Intersection of two boxes; empty, at the second's corner, if they are disjoint."""
    x_min, y_min = max(box.x_min, bounds.x_min), max(box.y_min, bounds.y_min)
    x_max, y_max = min(box.x_max, bounds.x_max), min(box.y_max, bounds.y_max)
    if x_min >= x_max or y_min >= y_max:
        return BoxPx(bounds.x_min, bounds.y_min, bounds.x_min, bounds.y_min)
    return BoxPx(x_min, y_min, x_max, y_max)
