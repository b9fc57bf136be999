"""Ray-traced bodies with cut-outs, merged into the rasteriser's z-buffer.

Loaded only if a scene has such a body.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.alpha_test import closest_solid_hit
from gen_data.generator.renderers.warp.scene.kernels.records import (
    HOLES,
    View,
    World,
    pixel_direction,
    to_mesh_point,
    to_mesh_vector,
)
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import Outline, Window

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

FARTHEST = wp.constant(1.0e6)


@wp.struct
class CutoutBody:
    """A body with cut-outs, the window of pixels that it may cover, and its largest 1/z."""

    body: int
    window: Window
    nearness_max: float


@wp.func
def is_in_window(window: Window, x: int, y: int):
    """Whether a pixel lies in a window."""
    right = x - window.x0
    down = y - window.y0
    return right >= 0 and right < window.width and down >= 0 and down < window.height


@wp.func
def trace_nearness(
    view: View, world: World, b: int, x_px: float, y_px: float, z_near_m: float, behind: float
):
    """1/z of a body at a point of the image, and its face; (0, -1) if not in front.

    Args:
        behind: 1/z of the nearest surface so far; 0 for none.
    """
    nearness = float(0.0)
    face = int(-1)
    d = view.R_world_camera @ pixel_direction(view, x_px, y_px)
    o = to_mesh_point(world, b, view.eye_m + d * z_near_m)
    reach = float(FARTHEST)
    if behind > 0.0:
        # With z = 1 in the direction, the ray's parameter is z-depth, counted from the near plane.
        reach = 1.0 / behind - z_near_m
    answer = closest_solid_hit(world, b, o, to_mesh_vector(world, b, d), reach, HOLES)
    if answer.face >= 0:
        nearness = 1.0 / (answer.t + z_near_m)
        face = answer.face
    return nearness, face


@wp.kernel
def trace_centres(
    view: View,
    world: World,
    bodies: wp.array[CutoutBody],
    z_near_m: float,
    nearness: wp.array[float],
    hits: wp.array[wp.vec2i],
):
    """Z-buffer over pixel centres, as rasterizer.draw_bodies; one image row per thread."""
    y = wp.tid()
    for k in range(bodies.shape[0]):
        window = bodies[k].window
        b = bodies[k].body
        if y >= window.y0 and y < window.y0 + window.height:
            for x in range(wp.max(window.x0, 0), wp.min(window.x0 + window.width, view.width)):
                i = y * view.width + x
                if nearness[i] < bodies[k].nearness_max:
                    near, face = trace_nearness(
                        view, world, b, float(x) + 0.5, float(y) + 0.5, z_near_m, nearness[i]
                    )
                    if near > nearness[i]:
                        nearness[i] = near
                        hits[i] = wp.vec2i(b, face)


@wp.kernel
def trace_samples(
    view: View,
    world: World,
    bodies: wp.array[CutoutBody],
    z_near_m: float,
    pixels: wp.array[int],
    offsets: wp.array[wp.vec2],
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Z-buffer over samples of listed pixels, as msaa.draw_samples.

    Args:
        offsets: Sample positions within a pixel, [0, 1).
    """
    row = wp.tid()
    x = pixels[row] % view.width
    y = pixels[row] / view.width
    for k in range(bodies.shape[0]):
        b = bodies[k].body
        if is_in_window(bodies[k].window, x, y):
            for s in range(offsets.shape[0]):
                if nearness[row, s] < bodies[k].nearness_max:
                    x_px = float(x) + offsets[s][0]
                    y_px = float(y) + offsets[s][1]
                    near, face = trace_nearness(
                        view, world, b, x_px, y_px, z_near_m, nearness[row, s]
                    )
                    if near > nearness[row, s]:
                        nearness[row, s] = near
                        hits[row, s] = wp.vec2i(b, face)


@wp.kernel
def trace_outlines(
    view: View, world: World, outlines: wp.array[Outline], z_near_m: float, mask: wp.array[wp.uint8]
):
    """Write 1 at every pixel centre that a body covers, for a pinhole; one row per thread."""
    k, row = wp.tid()
    window = outlines[k].window
    if row >= window.height:
        return
    for column in range(window.width):
        i = outlines[k].first_pixel + row * outlines[k].stride + column
        # Another body of the same instance may have covered the pixel already.
        if mask[i] == wp.uint8(0):
            x_px = float(window.x0 + column) + 0.5
            y_px = float(window.y0 + row) + 0.5
            near, _face = trace_nearness(view, world, outlines[k].body, x_px, y_px, z_near_m, 0.0)
            if near > 0.0:
                mask[i] = wp.uint8(1)
