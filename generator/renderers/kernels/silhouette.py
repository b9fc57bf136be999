"""Silhouettes: where each instance would be seen if nothing else were there."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels import raster
from generator.renderers.kernels.records import View, World

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.struct
class Canvas:
    """The part of the mask buffer that an instance is drawn into.

    Attributes:
        body: Number of one of its bodies.
        window: The pixels it covers, in image coordinates.
        first_pixel: Where its mask begins in the buffer.
    """

    body: int
    window: raster.Window
    first_pixel: int


@wp.kernel
def draw_silhouettes(
    view: View,
    world: World,
    p_camera: wp.array(dtype=wp.vec3),
    xy: wp.array(dtype=wp.vec2i),
    canvases: wp.array(dtype=Canvas),
    mask: wp.array(dtype=wp.uint8),
):
    """Write 1 at every pixel centre that a body covers; one body per thread.

    Threads only ever write the same value, so bodies of one instance may be drawn at once.
    """
    canvas = canvases[wp.tid()]
    window = canvas.window
    body = world.bodies[canvas.body]
    geometry = world.geometries[body.geometry]
    for f in range(geometry.face_slots.shape[0]):
        i = body.first_vertex + geometry.faces[3 * f]
        j = body.first_vertex + geometry.faces[3 * f + 1]
        k = body.first_vertex + geometry.faces[3 * f + 2]
        p = xy[i]
        q = xy[j]
        r = xy[k]
        if p[0] != raster.UNSNAPPED and q[0] != raster.UNSNAPPED and r[0] != raster.UNSNAPPED:
            e = raster.edges_of(p, q, r, window)
            if e.covers != 0:
                raster.draw_coverage(e, canvas.first_pixel, window.width, mask)
        elif not raster.beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            polygon, corners = raster.clip(view, p_camera[i], p_camera[j], p_camera[k])
            for t in range(1, corners - 1):
                e = raster.edges_of(
                    raster.snapped(view, polygon[0]),
                    raster.snapped(view, polygon[t]),
                    raster.snapped(view, polygon[t + 1]),
                    window,
                )
                if e.covers != 0:
                    raster.draw_coverage(e, canvas.first_pixel, window.width, mask)
