"""G-buffer: the visible surface at every pixel centre.

Bodies with cut-outs are ray-traced into the z-buffer of rasterised images.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.boxes import BoxPx
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.scene.kernels import ray_queries, records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.kernels import label_resolve, rasterizer

_ROUNDING = 1e-4
"""Relative error of depths in single precision, and a margin."""
CORNERS = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])
"""For each corner of a box, whether it is at the high end of each axis, [8, 3]."""


def has_cutouts(body_records: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether rays may pass holes in each body, bool [n]."""
    return np.asarray((body_records["cutouts"] & int(records.HOLES)) != 0)


def trace_over(
    world: PackedWorld,
    view: records.View,
    seen: NDArray[np.int32],
    nearness: wp.array,
    hits: wp.array,
    samples: tuple[wp.array, Array] | None = None,
) -> None:
    """Add listed bodies to a z-buffer of pixel centres, or of samples, in place.

    ``samples`` are listed pixels and the positions of samples in each.
    """
    from gen_data.generator.renderers.warp.visibility.kernels import alpha_cutouts

    device = hits.device
    # Nearest first, so that whatever hides the bodies behind is known before their turn.
    near_m = box_corners(world.body_records[seen], view)[:, 2].min(axis=1)
    order = np.argsort(near_m, kind="stable")
    rows = []
    for number, z_m in zip(seen[order].tolist(), near_m[order].tolist(), strict=True):
        box = project_window(world.body_records, number, view)
        nearness_max = 1.0 / (z_m * (1.0 - _ROUNDING)) if z_m > rasterizer.Z_NEAR_M else math.inf
        window = (box.x_min, box.y_min, box.width_px, box.height_px)
        rows.append((number, window, nearness_max))
    values = np.array(rows, dtype=alpha_cutouts.CutoutBody.numpy_dtype())
    bodies = wp.array(values, dtype=alpha_cutouts.CutoutBody, device=device)
    inputs = [view, world.record, bodies, rasterizer.Z_NEAR_M]
    kernel, count = alpha_cutouts.trace_centres, view.height
    if samples is not None:
        pixels, parts = samples
        inputs += [pixels, wp.array(parts, dtype=wp.vec2, device=device)]
        kernel, count = alpha_cutouts.trace_samples, len(pixels)
    wp.launch(kernel, count, inputs, [nearness, hits], device=device)


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


Method = Literal["auto", "raster", "rays"]
"""How visibility is determined, as in RenderSettings."""


@dataclass(frozen=True, eq=False, slots=True)
class Projected:
    """Projected vertices of bodies in or near an image, body after body.

    Attributes:
        reached: Numbers of the bodies that may lie on a canvas of three by three images; vertices
            of other bodies are stale.
        in_view: Numbers of the bodies that may lie in the image.
        p_camera: Vertices in the camera frame [m].
        xy: Vertices snapped to the image plane; see
            gen_data.generator.renderers.warp.visibility.kernels.rasterizer.
    """

    reached: NDArray[np.int32]
    in_view: NDArray[np.int32]
    p_camera: wp.array
    xy: wp.array


@dataclass(frozen=True, eq=False, slots=True)
class GBuffer:
    """Flat images of the visible surfaces, row by row.

    Attributes:
        hits: (body, face); (-1, -1) for the background.
        z_m: Depth along the optical axis for a pinhole, else along the ray; inf for the background.
        weights: Barycentric (u, v); u + 2 where the back of a triangle is visible.
        normals: Smooth unit normals, world frame, towards the camera; 0 for the background.
        projected: Rasterised vertices; None where rays were traced.
    """

    hits: wp.array
    z_m: wp.array
    weights: wp.array
    normals: wp.array
    projected: Projected | None

    @property
    def record(self) -> records.GBufferRecord:
        """The images as kernels read and write them."""
        images = records.GBufferRecord()
        images.hits, images.z_m = self.hits, self.z_m
        images.weights, images.normals = self.weights, self.normals
        return images


def find_visible(
    world: PackedWorld, view: records.View, cache: DeviceCache, method: Method
) -> GBuffer:
    """Find the surfaces at all pixel centres of a view."""
    n = view.width * view.height
    # Straight edges have straight images only for a pinhole.
    drawn = method == "raster" or (method == "auto" and cache.device.is_cpu)
    drawn = drawn and view.lens == records.PINHOLE
    projected = project_vertices(world, view, cache) if drawn else None
    gbuffer = GBuffer(
        cache.scratch("hits", n, wp.vec2i),
        cache.scratch("z", n, float),
        cache.scratch("weights", n, wp.vec2),
        cache.scratch("normals", n, wp.vec3),
        projected,
    )
    if projected is not None:
        _rasterise(world, view, cache, projected, gbuffer.hits)
    else:
        inputs = [view, world.record, rasterizer.Z_NEAR_M]
        wp.launch(ray_queries.trace_pixels, n, inputs, [gbuffer.hits], device=cache.device)
    # One thread per row on the CPU, where threads run one after the other anyway.
    run = view.width if cache.device.is_cpu else 1
    inputs, shape = [view, world.record, run, gbuffer.record], (view.height, view.width // run)
    wp.launch(label_resolve.resolve, shape, inputs, device=cache.device)
    return gbuffer


def project_vertices(world: PackedWorld, view: records.View, cache: DeviceCache) -> Projected:
    """Project vertices into the camera; valid until the next call."""
    count = max(world.vertex_count, 1)
    reached = bodies_within(world.body_records, view, 1.0)
    # Rounding may let the wider test reject a body that the narrower one accepts: it is outside
    # both.
    in_view = np.intersect1d(reached, bodies_within(world.body_records, view, 0.0))
    projected = Projected(
        reached,
        in_view,
        cache.scratch("p camera", count, wp.vec3),
        cache.scratch("xy", count, wp.vec2i),
    )
    bodies = wp.array(projected.reached, dtype=wp.int32, device=cache.device)
    inputs = [view, world.record, bodies]
    outputs = [projected.p_camera, projected.xy]
    wp.launch(rasterizer.project_vertices, len(bodies), inputs, outputs, device=cache.device)
    return projected


def bodies_within(
    body_records: NDArray[np.void], view: records.View, margin: float
) -> NDArray[np.int32]:
    """Numbers, ascending, of the bodies whose boxes reach into an image's frustum.

    The frustum extends beyond each side of the image by ``margin`` images.
    """
    x, y, z = np.moveaxis(box_corners(body_records, view), 1, 0)
    # One more pixel absorbs all rounding.
    beyond_x, beyond_y = margin * view.width + 1.0, margin * view.height + 1.0
    outside = [
        z < rasterizer.Z_NEAR_M,
        view.fx * x + (view.cx + beyond_x) * z < 0.0,
        view.fx * x + (view.cx - view.width - beyond_x) * z > 0.0,
        view.fy * y + (view.cy + beyond_y) * z < 0.0,
        view.fy * y + (view.cy - view.height - beyond_y) * z > 0.0,
    ]
    hidden = np.any([side.all(axis=1) for side in outside], axis=0)
    return np.flatnonzero(~hidden).astype(np.int32)


def _rasterise(
    world: PackedWorld, view: records.View, cache: DeviceCache, projected: Projected, hits: wp.array
) -> None:
    nearness = cache.scratch("nearness", view.width * view.height, float)
    nearness.zero_()
    hits.fill_(wp.vec2i(-1, -1))
    window = rasterizer.Window()
    window.width, window.height = view.width, view.height
    cutouts = has_cutouts(world.body_records)[projected.in_view]
    bodies = wp.array(projected.in_view[~cutouts], dtype=wp.int32, device=cache.device)
    inputs = [view, window, world.record, bodies, projected.p_camera, projected.xy]
    wp.launch(rasterizer.draw_bodies, len(bodies), inputs, [nearness, hits], device=cache.device)
    if cutouts.any():
        trace_over(world, view, projected.in_view[cutouts], nearness, hits)
