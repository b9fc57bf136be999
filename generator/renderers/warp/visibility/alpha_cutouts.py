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
from gen_data.generator.renderers.warp.visibility.kernels import rasterizer

CORNERS = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])
"""For each corner of a box, whether it is at the high end of each axis, [8, 3]."""


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
    inputs = [view, world.record, bodies, rasterizer.Z_NEAR_M]
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
    inputs = [view, world.record, bodies, rasterizer.Z_NEAR_M, pixels, offsets]
    wp.launch(alpha_cutouts.trace_samples, len(pixels), inputs, [nearness, hits], device=device)


def trace_outlines(
    world: PackedWorld, view: records.View, outlines: NDArray[np.void], mask: wp.array
) -> None:
    """Draw silhouettes of bodies with cut-outs into the mask pixels of their Outline records."""
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    for outline in outlines:
        x0, y0, width, height = outline["window"].tolist()
        around = BoxPx(x0, y0, x0 + width, y0 + height)
        box = project_window(world.body_records, outline["body"], view).intersection(around)
        outline["first_pixel"] += (box.y_min - y0) * outline["stride"] + box.x_min - x0
        outline["window"] = (box.x_min, box.y_min, box.width_px, box.height_px)
    shape = (len(outlines), int(outlines["window"]["height"].max(initial=0)))
    listed = wp.array(outlines, dtype=rasterizer.Outline, device=mask.device)
    inputs = [view, world.record, listed, rasterizer.Z_NEAR_M]
    wp.launch(alpha_cutouts.trace_outlines, shape, inputs, [mask], device=mask.device)


def canvas_box(view: records.View) -> BoxPx:
    """The canvas of three by three images, in image coordinates."""
    return BoxPx(-view.width, -view.height, 2 * view.width, 2 * view.height)


def box_corners(body_records: NDArray[np.void], view: records.View) -> Array:
    """Corners of the boxes of bodies [n] in the camera frame, [n, 3, 8]."""
    ends = np.stack([body_records["low_m"], body_records["high_m"]], axis=1).astype(np.float64)
    corners = ends[:, CORNERS, np.arange(3)] - np.array(view.eye_m, dtype=np.float64)
    R_world_camera = np.array(view.R_world_camera, dtype=np.float64).reshape(3, 3)
    return np.asarray(np.einsum("nki,ij->njk", corners, R_world_camera, optimize=False))


def project_window(body_records: NDArray[np.void], body: int, view: records.View) -> BoxPx:
    """Pixels that a body may cover before a pinhole; may lie outside the image."""
    ((x, y, z),) = box_corners(body_records[[body]], view)
    if z.min() < rasterizer.Z_NEAR_M:
        return canvas_box(view)
    x_px, y_px = view.fx * x / z + view.cx, view.fy * y / z + view.cy
    low = np.floor([x_px.min(), y_px.min()]) - 1.0
    high = np.ceil([x_px.max(), y_px.max()]) + 1.0
    box = BoxPx(int(low[0]), int(low[1]), int(high[0]), int(high[1]))
    return box.intersection(canvas_box(view))


def _upload_bodies(
    world: PackedWorld, view: records.View, seen: NDArray[np.int32], device: wp.Device
) -> wp.array:
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    boxes = [project_window(world.body_records, number, view) for number in seen.tolist()]
    rows = [
        (number, (box.x_min, box.y_min, box.width_px, box.height_px))
        for number, box in zip(seen.tolist(), boxes, strict=True)
    ]
    values = np.array(rows, dtype=alpha_cutouts.CutoutBody.numpy_dtype())
    return wp.array(values, dtype=alpha_cutouts.CutoutBody, device=device)
