"""G-buffer: the visible surface at every pixel centre."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import boxes, se3
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.native_code import LANES
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels import ray_queries, records
from gen_data.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.renderers.warp.visibility.kernels import label_resolve, rasterizer

_ROUNDING = 1e-4
"""Relative error of depths in single precision, and a margin."""
CORNERS = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])
"""For each corner of a box, whether it is at the high end of each axis, [8, 3]."""


def has_cutouts(body_records: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether rays may pass holes in each body, bool [n]."""
    return np.asarray((body_records["cutouts"] & int(records.HOLES)) != 0)


_PARTS = 32
"""Threads that share the vertices of a body on a GPU."""


def list_drawn(
    world: PackedWorld, view: records.View, seen: NDArray[np.int32], device: wp.Device
) -> wp.array:
    """DrawnBody records of bodies, in the order of drawing.

    Bodies with cut-outs come last, nearest first: few of their pixels then need the alpha test.
    """
    windows, near_m = project_windows(world.body_records[seen], view)
    values = np.zeros(len(seen), dtype=rasterizer.DrawnBody.numpy_dtype())
    values["body"] = seen
    for name, column in zip(("x0", "y0", "width", "height"), windows.T, strict=True):
        values["window"][name] = column
    with np.errstate(divide="ignore"):
        nearness_max = 1.0 / (np.maximum(near_m, 0.0) * (1.0 - _ROUNDING))
    values["nearness_max"] = np.where(near_m > rasterizer.Z_NEAR_M, nearness_max, np.inf)
    cutouts = has_cutouts(world.body_records[seen])
    order = np.lexsort((np.where(cutouts, near_m, 0.0), cutouts))
    return wp.array(values[order], dtype=rasterizer.DrawnBody, device=device)


def canvas_box(view: records.View) -> boxes.BoxPx:
    """The canvas of three by three images, in image coordinates."""
    return boxes.BoxPx(-view.width, -view.height, 2 * view.width, 2 * view.height)


def box_corners(body_records: NDArray[np.void], view: records.View) -> se3.Array:
    """Corners of the boxes of bodies [n] in the camera frame, [n, 3, 8]."""
    ends = np.stack([body_records["low_m"], body_records["high_m"]], axis=1).astype(np.float64)
    corners = ends[:, CORNERS, np.arange(3)] - np.array(view.eye_m, dtype=np.float64)
    R_world_camera = np.array(view.R_world_camera, dtype=np.float64).reshape(3, 3)
    return np.asarray(np.einsum("nki,ij->njk", corners, R_world_camera, optimize=False))


def project_windows(
    body_records: NDArray[np.void], view: records.View
) -> tuple[NDArray[np.int64], se3.Array]:
    """Pixels that bodies may cover before a pinhole, and their least depths [m].

    Returns:
        Windows (x0, y0, width, height), int [n, 4], which may lie outside the image but not
        beyond the canvas; and the depths, [n], which are negative behind the camera.
    """
    canvas = canvas_box(view)
    x, y, z = np.moveaxis(box_corners(body_records, view), 1, 0)
    near_m = z.min(axis=1)
    # A body that reaches behind the camera may cover anything.
    cut = near_m < rasterizer.Z_NEAR_M
    z = np.where(cut[:, None], 1.0, z)
    x_px, y_px = view.fx * x / z + view.cx, view.fy * y / z + view.cy
    lows = np.floor(np.stack([x_px.min(axis=1), y_px.min(axis=1)], axis=1)) - 1.0
    highs = np.ceil(np.stack([x_px.max(axis=1), y_px.max(axis=1)], axis=1)) + 1.0
    least, most = (canvas.x_min, canvas.y_min), (canvas.x_max, canvas.y_max)
    lows = np.where(cut[:, None], least, np.clip(lows, least, most)).astype(np.int64)
    highs = np.where(cut[:, None], most, np.clip(highs, least, most)).astype(np.int64)
    return np.concatenate([lows, highs - lows], axis=1), near_m


Method = Literal["auto", "raster", "rays"]
"""How visibility is determined, as in RenderSettings."""


@dataclass(frozen=True, eq=False, slots=True)
class Projected:
    """Projected vertices of bodies in or near an image, body after body.

    Attributes:
        reached: Numbers of the bodies that may lie on a canvas of three by three images; vertices
            of other bodies are stale.
        in_view: DrawnBody records of the bodies that may lie in the image.
        p_camera: Vertices in the camera frame [m].
        xy: Vertices snapped to the image plane; see
            gen_data.renderers.warp.visibility.kernels.rasterizer.
        extents: Extent records of each reached body, [bodies, parts].
    """

    reached: NDArray[np.int32]
    in_view: wp.array
    p_camera: wp.array
    xy: wp.array
    extents: wp.array


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
        cache.scratch("hits", n + LANES, wp.vec2i)[:n],
        cache.scratch("z", n, float),
        cache.scratch("weights", n, wp.vec2),
        cache.scratch("normals", n, wp.vec3),
        projected,
    )
    if projected is not None:
        _rasterise(world, view, cache, projected, gbuffer.hits)
    else:
        inputs = [view, world.record, rasterizer.Z_NEAR_M]
        launch(ray_queries.trace_pixels, n, inputs, [gbuffer.hits], device=cache.device)
    # One thread per row on the CPU, where threads run one after the other anyway.
    run = view.width if cache.device.is_cpu else 1
    inputs, shape = [view, world.record, run, gbuffer.record], (view.height, view.width // run)
    launch(label_resolve.resolve, shape, inputs, device=cache.device)
    return gbuffer


def project_vertices(world: PackedWorld, view: records.View, cache: DeviceCache) -> Projected:
    """Project vertices into the camera; valid until the next call."""
    count = max(world.vertex_count, 1)
    parts = 1 if cache.device.is_cpu else _PARTS
    reached = bodies_within(world.body_records, view, 1.0)
    # Rounding may let the wider test reject a body that the narrower one accepts: it is outside
    # both.
    in_view = np.intersect1d(reached, bodies_within(world.body_records, view, 0.0))
    projected = Projected(
        reached,
        list_drawn(world, view, in_view, cache.device),
        cache.scratch("p camera", count, wp.vec3),
        cache.scratch("xy", count, wp.vec2i),
        wp.zeros((len(reached), parts), dtype=rasterizer.Extent, device=cache.device),
    )
    bodies = wp.array(projected.reached, dtype=wp.int32, device=cache.device)
    inputs = [view, world.record, bodies]
    outputs = [projected.p_camera, projected.xy, projected.extents]
    shape = (len(bodies), parts)
    launch(rasterizer.project_vertices, shape, inputs, outputs, device=cache.device)
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
    nearness = cache.scratch("nearness", view.width * view.height + LANES, float)
    nearness.zero_()
    hits.fill_(wp.vec2i(-1, -1))
    window = rasterizer.Window()
    window.width, window.height = view.width, view.height
    bodies = projected.in_view
    inputs = [view, window, world.record, bodies, projected.p_camera, projected.xy]
    launch(rasterizer.draw_bodies, len(bodies), inputs, [nearness, hits], device=cache.device)
