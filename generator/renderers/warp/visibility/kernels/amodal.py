"""Amodal silhouettes for a pinhole: each instance as if nothing else were there."""

import warp as wp

from gen_data.renderers.warp.scene.kernels.records import View, World
from gen_data.renderers.warp.visibility.kernels import alpha_cutouts, rasterizer

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.kernel
def draw_silhouettes(
    view: View,
    world: World,
    p_camera: wp.array[wp.vec3],
    xy: wp.array[wp.vec2i],
    outlines: wp.array[rasterizer.Outline],
    parts: int,
    mask: wp.array[wp.uint8],
):
    """Write 1 at every pixel centre that bodies cover.

    All threads write the same value, so bodies of one instance may be drawn concurrently, and so
    may faces of a body.

    Args:
        parts: Threads that share the faces of an outline.
    """
    number, part = wp.tid()
    outline = outlines[number]
    geometry = world.geometries[world.bodies[outline.body].geometry]
    first = world.bodies[outline.body].first_vertex
    for f in range(part, geometry.face_slots.shape[0], parts):
        i = first + geometry.faces[3 * f]
        j = first + geometry.faces[3 * f + 1]
        k = first + geometry.faces[3 * f + 2]
        if (
            xy[i][0] != rasterizer.UNSNAPPED
            and xy[j][0] != rasterizer.UNSNAPPED
            and xy[k][0] != rasterizer.UNSNAPPED
        ):
            box = rasterizer.pixel_box(xy[i], xy[j], xy[k], outline.window, 0)
            box = rasterizer.in_rows(box, outline.first_row, outline.last_row)
            if rasterizer.is_empty(box) or rasterizer.is_filled(box, outline, mask):
                continue
            e = rasterizer.make_edges(xy[i], xy[j], xy[k], outline.window, box)
            if e.covers != 0:
                cutout = alpha_cutouts.make_cutout(view, world, outline.body, f)
                plane = rasterizer.DepthPlane()
                if cutout.texture >= 0:
                    plane = rasterizer.depth_plane(
                        view, p_camera[i], p_camera[j], p_camera[k], outline.window
                    )
                rasterizer.draw_coverage(world, e, plane, cutout, outline, mask)
        elif not rasterizer.is_beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            # A vertex lies outside the snapping range: clip first, then draw the polygon as a fan.
            polygon, corners = rasterizer.clip(view, p_camera[i], p_camera[j], p_camera[k])
            cutout = alpha_cutouts.make_cutout(view, world, outline.body, f)
            plane = rasterizer.depth_plane(
                view, p_camera[i], p_camera[j], p_camera[k], outline.window
            )
            plane.high = 1.0 / rasterizer.Z_NEAR_M
            for t in range(1, corners - 1):
                e = rasterizer.fan_edges_in(
                    view, polygon, t, outline.window, 0, outline.first_row, outline.last_row
                )
                if e.covers != 0:
                    rasterizer.draw_coverage(world, e, plane, cutout, outline, mask)


@wp.kernel
def pack_bits(words: wp.array[wp.uint64], bits: wp.array[wp.uint8]):
    """Pack eight bytes of 0 or 1 each into one, the first byte into the lowest bit."""
    i = wp.tid()
    # The product moves the lowest bit of byte k to bit 56 + k.
    bits[i] = wp.uint8((words[i] * wp.uint64(0x0102040810204080)) >> wp.uint64(56))
