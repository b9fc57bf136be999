"""Multisampling of edge pixels by the rasteriser (CPU device only).

Triangles are drawn again into samples of the pixels that edges cross; colour is taken from nearby
pixel centres that show the same surface, as in
gen_data.generator.renderers.warp.visibility.kernels.edge_antialiasing.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    View,
    World,
    flat_normal,
    min_of_two,
)
from gen_data.generator.renderers.warp.visibility.kernels.alpha_cutouts import (
    Cutout,
    is_solid_at,
    make_cutout,
)
from gen_data.generator.renderers.warp.visibility.kernels.edge_detection import (
    most_similar_normal,
    neighbour_pixel,
)
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import (
    UNSNAPPED,
    Z_NEAR_M,
    DepthPlane,
    DrawnBody,
    Window,
    clip,
    depth_plane,
    is_beyond_guard,
    is_hidden,
    snap_to_grid,
    span_end,
    span_start,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Larger than the nearness of any surface.
UNLISTED = wp.constant(1.0e30)
# A block is a run of 2^4 pixels of a row.
BLOCK_SHIFT = wp.constant(4)
BLOCK_PX = wp.constant(16)
# Triangles whose boxes span more blocks than this are not tested as a whole.
BLOCKS_MAX = wp.constant(32)


@wp.func
def blocks_per_row(width: int):
    """Number of blocks that hold a row of pixels."""
    return (width + BLOCK_PX - 1) >> BLOCK_SHIFT


@wp.kernel
def number_pixels(
    view: View,
    images: GBufferRecord,
    pixels: wp.array[int],
    numbers: wp.array[int],
    floors: wp.array[float],
    block_floors: wp.array[float],
):
    """Position in the list of every listed pixel, and the least nearness that matters there.

    A surface behind all those of the surrounding centres has no colour to take.

    Args:
        floors: 1/z [1/m]; must be UNLISTED on entry.
        block_floors: The least floor of each block, row by row; must be UNLISTED on entry.
    """
    k = wp.tid()
    i = pixels[k]
    farthest = float(0.0)
    for m in range(9):
        j = neighbour_pixel(view, i % view.width, i / view.width, m)
        farthest = wp.max(farthest, images.z_m[j])
    numbers[i] = k
    # Two percent of slack: a surface's depth changes within a pixel.
    floors[i] = 0.98 / farthest
    row = (i / view.width) * blocks_per_row(view.width)
    wp.atomic_min(block_floors, row + ((i % view.width) >> BLOCK_SHIFT), floors[i])


@wp.struct
class Side:
    """Edge function: value at a point, steps per 1/256 px, and its variation over half a pixel.

    Inside is >= 0.
    """

    value: wp.int64
    dx: wp.int64
    dy: wp.int64
    reach: wp.int64


@wp.struct
class Triangle:
    """A face of a body with its corners snapped to the image plane."""

    body: int
    face: int
    p: wp.vec2i
    q: wp.vec2i
    r: wp.vec2i
    plane: DepthPlane
    cutout: Cutout


@wp.func
def make_side(p: wp.vec2i, q: wp.vec2i, area: wp.int64, x: int, y: int):
    """Edge function from p to q of a triangle with signed ``area``, at a snapped point."""
    side = Side()
    # Both orientations are drawn: the sign makes the inside positive.
    turn = wp.where(area > wp.int64(0), wp.int64(1), wp.int64(-1))
    side.dx = wp.int64(p[1] - q[1]) * turn
    side.dy = wp.int64(q[0] - p[0]) * turn
    side.value = wp.int64(x - p[0]) * side.dx + wp.int64(y - p[1]) * side.dy
    # Top-left rule: left and top edges own the points on them.
    if not (side.dx > wp.int64(0) or (side.dx == wp.int64(0) and side.dy > wp.int64(0))):
        side.value -= wp.int64(1)
    side.reach = wp.int64(128) * (wp.abs(side.dx) + wp.abs(side.dy))
    return side


@wp.func
def span_from(last: int, a: wp.int64, b: wp.int64, c: wp.int64, ea: Side, eb: Side, ec: Side):
    """First pixel of a row from 0 to ``last`` that edges with values a, b, c may reach."""
    start = int(0)
    # Shorter rows are tested pixel by pixel.
    if last > 8:
        pixel = wp.int64(256)
        start = span_start(a + ea.reach, pixel * ea.dx, start)
        start = span_start(b + eb.reach, pixel * eb.dx, start)
        start = span_start(c + ec.reach, pixel * ec.dx, start)
    return start


@wp.func
def span_to(last: int, a: wp.int64, b: wp.int64, c: wp.int64, ea: Side, eb: Side, ec: Side):
    """Last pixel of a row from 0 to ``last`` that three edges may reach."""
    end = last
    if last > 8:
        pixel = wp.int64(256)
        end = span_end(a + ea.reach, pixel * ea.dx, end)
        end = span_end(b + eb.reach, pixel * eb.dx, end)
        end = span_end(c + ec.reach, pixel * ec.dx, end)
    return end


@wp.func
def covers(ea: Side, eb: Side, ec: Side, a: wp.int64, b: wp.int64, c: wp.int64, at: wp.vec2i):
    """Whether a triangle whose edges have values a, b, c covers the point at offset ``at``."""
    right = wp.int64(at[0])
    down = wp.int64(at[1])
    inside = a + right * ea.dx + down * ea.dy
    inside = inside | (b + right * eb.dx + down * eb.dy)
    inside = inside | (c + right * ec.dx + down * ec.dy)
    return inside >= wp.int64(0)


@wp.func
def draw_sample(
    world: World,
    triangle: Triangle,
    x: int,
    y: int,
    centre: float,
    at: wp.vec2i,
    k: int,
    s: int,
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Write (body, face) into sample s of row k where a triangle that covers it is nearest.

    Args:
        x, y: The pixel.
        centre: 1/z of the triangle's plane at the pixel's centre [1/m].
        at: Position of the sample from the centre [1/256 px].
    """
    plane = triangle.plane
    # 1 / 256: offsets are in snapped units.
    right = 0.00390625 * float(at[0])
    down = 0.00390625 * float(at[1])
    w = wp.clamp(centre + (right * plane.dx + down * plane.dy), plane.low, plane.high)
    if w > nearness[k, s]:
        x_px = float(x) + 0.5 + right
        y_px = float(y) + 0.5 + down
        if is_solid_at(world, triangle.cutout, x_px, y_px, w):
            nearness[k, s] = w
            hits[k, s] = wp.vec2i(triangle.body, triangle.face)


@wp.func
def draw_triangle_samples(
    world: World,
    numbers: wp.array[int],
    floors: wp.array[float],
    block_floors: wp.array[float],
    window: Window,
    offsets: wp.array[wp.vec2i],
    triangle: Triangle,
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Write (body, face) into the samples of numbered pixels where a triangle is nearest."""
    p = triangle.p
    q = triangle.q
    r = triangle.r
    plane = triangle.plane
    area = wp.int64(q[0] - p[0]) * wp.int64(r[1] - p[1])
    area -= wp.int64(r[0] - p[0]) * wp.int64(q[1] - p[1])
    if area == wp.int64(0):
        return
    x_first = wp.max(wp.min(p[0], wp.min(q[0], r[0])) >> 8, 0)
    x_last = wp.min(wp.max(p[0], wp.max(q[0], r[0])) >> 8, window.width - 1)
    y_first = wp.max(wp.min(p[1], wp.min(q[1], r[1])) >> 8, 0)
    y_last = wp.min(wp.max(p[1], wp.max(q[1], r[1])) >> 8, window.height - 1)
    # Edge values at the first pixel's centre.
    x_px, y_px = (x_first << 8) + 128, (y_first << 8) + 128
    ea = make_side(p, q, area, x_px, y_px)
    eb = make_side(q, r, area, x_px, y_px)
    ec = make_side(r, p, area, x_px, y_px)
    pixel = wp.int64(256)
    # Largest change of 1/z from a pixel's centre to its corner.
    slack = 0.5 * (wp.abs(plane.dx) + wp.abs(plane.dy))
    for y in range(y_first, y_last + 1):
        rows = wp.int64(y - y_first) * pixel
        a = ea.value + rows * ea.dy
        b = eb.value + rows * eb.dy
        c = ec.value + rows * ec.dy
        start = span_from(x_last - x_first, a, b, c, ea, eb, ec)
        end = span_to(x_last - x_first, a, b, c, ea, eb, ec)
        a += wp.int64(start) * pixel * ea.dx
        b += wp.int64(start) * pixel * eb.dx
        c += wp.int64(start) * pixel * ec.dx
        blocks = y * blocks_per_row(window.width)
        # While loops: Warp's range loops cost more than their bodies.
        x = int(x_first + start)
        while x <= x_first + end:
            last = wp.min(x | (BLOCK_PX - 1), x_first + end)
            near = plane.c + float(y) * plane.dy
            near += wp.max(float(x) * plane.dx, float(last) * plane.dx) + slack
            if wp.min(near, plane.high) < block_floors[blocks + (x >> BLOCK_SHIFT)]:
                # Nothing of the block is listed, or all of it is hidden there.
                run = wp.int64(last + 1 - x) * pixel
                a += run * ea.dx
                b += run * eb.dx
                c += run * ec.dx
                x = last + 1
            while x <= last:
                i = y * window.width + x
                if plane.high >= floors[i] and (
                    (a + ea.reach) | (b + eb.reach) | (c + ec.reach)
                ) >= wp.int64(0):
                    row = plane.c + float(y) * plane.dy + float(x) * plane.dx
                    if row + slack >= floors[i]:
                        k = numbers[i]
                        s = int(0)
                        while s < offsets.shape[0]:
                            at = offsets[s]
                            if covers(ea, eb, ec, a, b, c, at):
                                draw_sample(world, triangle, x, y, row, at, k, s, nearness, hits)
                            s += 1
                a += pixel * ea.dx
                b += pixel * eb.dx
                c += pixel * ec.dx
                x += 1


@wp.func
def floor_below(floors: wp.array[float], window: Window, p: wp.vec2i, q: wp.vec2i, r: wp.vec2i):
    """Lowest floor within a triangle's box; 0 if the box is too large to scan."""
    x_first = wp.max(wp.min(p[0], wp.min(q[0], r[0])) >> 8, 0)
    x_last = wp.min(wp.max(p[0], wp.max(q[0], r[0])) >> 8, window.width - 1)
    y_first = wp.max(wp.min(p[1], wp.min(q[1], r[1])) >> 8, 0)
    y_last = wp.min(wp.max(p[1], wp.max(q[1], r[1])) >> 8, window.height - 1)
    lowest = float(UNLISTED)
    if x_first <= x_last and y_first <= y_last:
        if (x_last - x_first) * (y_last - y_first) > 64:
            return 0.0
        for y in range(y_first, y_last + 1):
            i = int(y * window.width + x_first)
            while i <= y * window.width + x_last:
                lowest = min_of_two(lowest, floors[i])
                i += 1
    return lowest


@wp.kernel
def draw_samples(
    view: View,
    window: Window,
    world: World,
    bodies: wp.array[DrawnBody],
    p_camera: wp.array[wp.vec3],
    xy: wp.array[wp.vec2i],
    numbers: wp.array[int],
    floors: wp.array[float],
    block_floors: wp.array[float],
    offsets: wp.array[wp.vec2i],
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Z-buffer of listed bodies over samples of numbered pixels, as draw_bodies over centres.

    Args:
        numbers: Row of each pixel in the outputs.
        floors: Nearness below which a pixel takes nothing; UNLISTED for unlisted pixels.
        block_floors: The least floor of each block.
        offsets: Sample positions, from the middle of a pixel [1/256 px].
        nearness: 1/z [1/m]; must be 0 on entry.
        hits: Unchanged where nothing is hit.
    """
    drawn = bodies[wp.tid()]
    if is_hidden(drawn, window.width, window.height, floors):
        return
    b = drawn.body
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    for f in range(geometry.face_slots.shape[0]):
        i = first + geometry.faces[3 * f]
        j = first + geometry.faces[3 * f + 1]
        k = first + geometry.faces[3 * f + 2]
        if xy[i][0] != UNSNAPPED and xy[j][0] != UNSNAPPED and xy[k][0] != UNSNAPPED:
            floor = floor_below(floors, window, xy[i], xy[j], xy[k])
            near = bool(False)
            if floor < UNLISTED:
                z = wp.min(p_camera[i][2], wp.min(p_camera[j][2], p_camera[k][2]))
                # Skip triangles that are entirely behind everything visible nearby.
                near = floor * z <= 1.0
            if near:
                triangle = Triangle()
                triangle.body = b
                triangle.face = f
                triangle.p = xy[i]
                triangle.q = xy[j]
                triangle.r = xy[k]
                triangle.plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
                triangle.cutout = make_cutout(view, world, b, f)
                draw_triangle_samples(
                    world, numbers, floors, block_floors, window, offsets, triangle, nearness, hits
                )
        elif not is_beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            polygon, corners = clip(view, p_camera[i], p_camera[j], p_camera[k])
            triangle = Triangle()
            triangle.body = b
            triangle.face = f
            triangle.plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
            triangle.plane.high = 1.0 / Z_NEAR_M
            triangle.cutout = make_cutout(view, world, b, f)
            for t in range(1, corners - 1):
                triangle.p = snap_to_grid(view, polygon[0])
                triangle.q = snap_to_grid(view, polygon[t])
                triangle.r = snap_to_grid(view, polygon[t + 1])
                draw_triangle_samples(
                    world, numbers, floors, block_floors, window, offsets, triangle, nearness, hits
                )


@wp.func
def color_source(view: View, world: World, images: GBufferRecord, x: int, y: int, hit: wp.vec2i):
    """The pixel around (x, y) that provides the colour of a sample; -1 if none shows its body."""
    source = int(-1)
    same_face = bool(False)
    others = int(0)
    for k in range(9):
        j = neighbour_pixel(view, x, y, k)
        if not same_face and images.hits[j][0] == hit[0]:
            if images.hits[j][1] == hit[1] or hit[0] < 0:
                same_face = True
                source = j
            else:
                others += 1
                if source < 0:
                    source = j
    if not same_face and others > 1:
        # Several faces of the body are near, none of them the sample's: choose by orientation.
        source = most_similar_normal(view, images, x, y, source, flat_normal(world, hit))
    return source


@wp.kernel
def mix_samples(
    view: View,
    world: World,
    images: GBufferRecord,
    radiance: wp.array[wp.vec3],
    pixels: wp.array[int],
    hits: wp.array2d[wp.vec2i],
    mixed: wp.array[wp.vec3],
):
    """Radiance of listed pixels: the mean over their samples, in the order of the list."""
    row = wp.tid()
    i = pixels[row]
    x = i % view.width
    y = i / view.width
    total = wp.vec3(0.0)
    lit = int(0)
    last = wp.vec2i(-2, -2)
    source = int(-1)
    for s in range(hits.shape[1]):
        hit = hits[row, s]
        if hit[0] != last[0] or hit[1] != last[1]:
            source = color_source(view, world, images, x, y, hit)
            last = hit
        if source >= 0:
            total += radiance[source]
            lit += 1
    mixed[row] = radiance[i]
    if lit > 0:
        mixed[row] = total * (1.0 / float(lit))
