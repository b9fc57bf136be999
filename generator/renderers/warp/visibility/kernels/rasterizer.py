"""Exact triangle rasteriser (CPU device only: bodies are drawn one after another).

Vertices are snapped to 1/256 px and edges evaluated in 64-bit integers with the top-left rule:
triangles that share an edge neither overlap nor leave a gap. Pixels are sampled at their centres.

Source: Pineda, "A parallel algorithm for polygon rasterization", SIGGRAPH 1988.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import View, World
from gen_data.generator.renderers.warp.visibility.kernels.alpha_cutouts import (
    Cutout,
    is_solid_at,
    make_cutout,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Near plane; it keeps 1/z at most 100.
Z_NEAR_M = wp.constant(0.01)
# Guard band: farther vertices are clipped, which keeps snapped coordinates below 2^24 and edge
# products below 2^50. Single precision still resolves 1/256 px there.
GUARD_PX = wp.constant(32768.0)
# Marks vertices outside the guard band; snapped coordinates stay below 2^24.
UNSNAPPED = wp.constant(wp.int32(-(2**31)))

# A triangle clipped by five planes has at most eight corners.
Polygon = wp.types.matrix(shape=(9, 3), dtype=wp.float32)


@wp.struct
class Window:
    """The rectangle of pixels to draw; ``x0``, ``y0`` in the image."""

    x0: int
    y0: int
    width: int
    height: int


@wp.struct
class DrawnBody:
    """A body, the pixels that it may cover, and its largest 1/z [1/m]."""

    body: int
    window: Window
    nearness_max: float


@wp.struct
class Outline:
    """Where the silhouette of a body is written.

    Attributes:
        window: The pixels that the body may cover; may lie outside the image.
        first_pixel: Index in the buffer of the window's first pixel.
        stride: Pixels between rows of the buffer.
    """

    body: int
    window: Window
    first_pixel: int
    stride: int


@wp.struct
class Edge:
    """Edge function: value at a first pixel, and steps per pixel; inside is >= 0."""

    value: wp.int64
    dx: wp.int64
    dy: wp.int64


@wp.struct
class Edges:
    """The edge functions of a triangle over its box of pixels, relative to the window."""

    covers: int
    x_first: int
    x_last: int
    y_first: int
    y_last: int
    a: Edge
    b: Edge
    c: Edge


@wp.struct
class DepthPlane:
    """1/z of a triangle over the image, linear in pixels: ``c + x * dx + y * dy``, bounded."""

    c: float
    dx: float
    dy: float
    low: float
    high: float


@wp.func
def snap_to_grid(view: View, p: wp.vec3):
    """Image coordinates of a camera-frame point in units of 1/256 px."""
    x = p[0] / p[2] * view.fx + view.cx
    y = p[1] / p[2] * view.fy + view.cy
    # Floor of x + 0.5, not round: halves go the same way on both sides of zero.
    return wp.vec2i(int(wp.floor(x * 256.0 + 0.5)), int(wp.floor(y * 256.0 + 0.5)))


@wp.func
def guard_distance(view: View, p: wp.vec3, plane: int):
    """Signed distance, up to scale, to one of the five planes that bound the guard band."""
    d = p[2] - Z_NEAR_M
    if plane == 1:
        d = p[2] * GUARD_PX - view.fx * p[0]
    elif plane == 2:
        d = p[2] * GUARD_PX + view.fx * p[0]
    elif plane == 3:
        d = p[2] * GUARD_PX - view.fy * p[1]
    elif plane == 4:
        d = p[2] * GUARD_PX + view.fy * p[1]
    return d


@wp.kernel
def project_vertices(
    view: View,
    world: World,
    bodies: wp.array[int],
    p_camera: wp.array[wp.vec3],
    xy: wp.array[wp.vec2i],
):
    """Vertices in the camera frame and on the snapped image plane, one listed body per thread."""
    b = bodies[wp.tid()]
    A = world.bodies[b].A_camera_mesh
    t = world.bodies[b].t_camera_mesh
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    for i in range(geometry.vertices_m.shape[0]):
        p = A @ geometry.vertices_m[i] + t
        q = wp.vec2i(UNSNAPPED, UNSNAPPED)
        if (
            p[2] >= Z_NEAR_M
            and wp.abs(p[0]) * view.fx <= p[2] * GUARD_PX
            and wp.abs(p[1]) * view.fy <= p[2] * GUARD_PX
        ):
            q = snap_to_grid(view, p)
        p_camera[first + i] = p
        xy[first + i] = q


@wp.func
def first_centre(fixed: int):
    """First pixel whose centre is at or after a snapped coordinate."""
    # A centre is at 256 i + 128; the shift rounds (fixed - 128) / 256 up.
    return (fixed + 127) >> 8


@wp.func
def last_centre(fixed: int):
    """Last pixel whose centre is at or before a snapped coordinate."""
    return (fixed - 128) >> 8


@wp.func
def edge_between(p: wp.vec2i, q: wp.vec2i, x: int, y: int):
    """Edge function from p to q at a snapped point; positive on its right (y is down)."""
    dx = wp.int64(p[1] - q[1])
    dy = wp.int64(q[0] - p[0])
    edge = Edge()
    edge.value = wp.int64(x - p[0]) * dx + wp.int64(y - p[1]) * dy
    # Top-left rule: left and top edges own the centres on them.
    if not (dx > wp.int64(0) or (dx == wp.int64(0) and dy > wp.int64(0))):
        edge.value -= wp.int64(1)
    edge.dx = dx * wp.int64(256)
    edge.dy = dy * wp.int64(256)
    return edge


@wp.func
def make_edges(p: wp.vec2i, q: wp.vec2i, r: wp.vec2i, window: Window):
    """Edge functions of a triangle of either orientation, and the box of pixels it may cover."""
    edges = Edges()
    x_low, x_high = wp.min(p[0], wp.min(q[0], r[0])), wp.max(p[0], wp.max(q[0], r[0]))
    y_low, y_high = wp.min(p[1], wp.min(q[1], r[1])), wp.max(p[1], wp.max(q[1], r[1]))
    edges.x_first = wp.max(first_centre(x_low) - window.x0, 0)
    edges.x_last = wp.min(last_centre(x_high) - window.x0, window.width - 1)
    edges.y_first = wp.max(first_centre(y_low) - window.y0, 0)
    edges.y_last = wp.min(last_centre(y_high) - window.y0, window.height - 1)
    if edges.x_first > edges.x_last or edges.y_first > edges.y_last:
        return edges
    area = wp.int64(q[0] - p[0]) * wp.int64(r[1] - p[1])
    area -= wp.int64(r[0] - p[0]) * wp.int64(q[1] - p[1])
    # Degenerate after snapping: it covers no centre.
    if area == wp.int64(0):
        return edges
    # Centre of the first pixel, in snapped units.
    x = ((edges.x_first + window.x0) << 8) + 128
    y = ((edges.y_first + window.y0) << 8) + 128
    if area > wp.int64(0):
        edges.a = edge_between(p, q, x, y)
        edges.b = edge_between(q, r, x, y)
        edges.c = edge_between(r, p, x, y)
    else:
        edges.a = edge_between(q, p, x, y)
        edges.b = edge_between(r, q, x, y)
        edges.c = edge_between(p, r, x, y)
    edges.covers = 1
    return edges


@wp.func
def span_start(e: wp.int64, dx: wp.int64, first: int):
    """Smallest step >= first at which ``e + step * dx >= 0``."""
    start = first
    if e < wp.int64(0):
        if dx > wp.int64(0):
            # Rounded up; the limit keeps the 64-bit quotient within 32 bits.
            start = wp.max(first, int(wp.min((dx - e - wp.int64(1)) / dx, wp.int64(1 << 30))))
        else:
            start = 1 << 30
    return start


@wp.func
def span_end(e: wp.int64, dx: wp.int64, last: int):
    """Largest step <= last at which ``e + step * dx >= 0``."""
    end = last
    if dx < wp.int64(0) and e >= wp.int64(0):
        end = wp.min(last, int(wp.min(e / -dx, wp.int64(1 << 30))))
    return end


@wp.func
def depth_plane(view: View, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3, window: Window):
    """1/z over the window's pixels, of the plane through three camera-frame points."""
    plane = DepthPlane()
    z_low = wp.min(p0[2], wp.min(p1[2], p2[2]))
    z_high = wp.max(p0[2], wp.max(p1[2], p2[2]))
    plane.low = 1.0 / z_high
    # Snapping moves edges by up to 1/512 px: depth beyond the triangle is clamped to its corners'.
    plane.high = 1.0 / wp.max(z_low, 0.5 * Z_NEAR_M)
    n = wp.cross(p1 - p0, p2 - p0)
    d = wp.dot(n, p0)
    if d == 0.0:
        # Seen edge-on: pixels are covered by snapping alone, and any depth in between will do.
        plane.c = plane.low
        return plane
    # 1/z is linear in the image: n . (x, y, 1) / (n . p0) along rays (x, y, 1).
    n = n / d
    plane.dx = n[0] * view.inverse_fx
    plane.dy = n[1] * view.inverse_fy
    x = (float(window.x0) + 0.5 - view.cx) * plane.dx
    y = (float(window.y0) + 0.5 - view.cy) * plane.dy
    plane.c = n[2] + x + y
    return plane


@wp.func
def draw_nearest(
    world: World,
    e: Edges,
    plane: DepthPlane,
    cutout: Cutout,
    body: int,
    face: int,
    stride: int,
    nearness: wp.array[float],
    hits: wp.array[wp.vec2i],
):
    """Write (body, face) where the triangle has no hole and is nearer than the buffer.

    The window's first pixel must be the image's.
    """
    a = e.a.value
    b = e.b.value
    c = e.c.value
    count = e.x_last - e.x_first
    for y in range(e.y_first, e.y_last + 1):
        first = int(0)
        last = count
        # Short rows are tested pixel by pixel: faster than the divisions.
        if count > 8:
            first = span_start(a, e.a.dx, span_start(b, e.b.dx, span_start(c, e.c.dx, 0)))
            last = span_end(a, e.a.dx, span_end(b, e.b.dx, span_end(c, e.c.dx, count)))
        a_here = a + wp.int64(first) * e.a.dx
        b_here = b + wp.int64(first) * e.b.dx
        c_here = c + wp.int64(first) * e.c.dx
        row = plane.c + float(y) * plane.dy
        pixel = y * stride + e.x_first + first
        # A while loop: Warp's range loops cost more than this body.
        x = int(e.x_first + first)
        while x <= e.x_first + last:
            # One sign test for three edges: the sign bit of the bitwise or is set if any is.
            if (a_here | b_here | c_here) >= wp.int64(0):
                w = wp.clamp(row + float(x) * plane.dx, plane.low, plane.high)
                if w > nearness[pixel]:
                    if is_solid_at(world, cutout, float(x) + 0.5, float(y) + 0.5, w):
                        nearness[pixel] = w
                        hits[pixel] = wp.vec2i(body, face)
            a_here += e.a.dx
            b_here += e.b.dx
            c_here += e.c.dx
            pixel += 1
            x += 1
        a += e.a.dy
        b += e.b.dy
        c += e.c.dy


@wp.func
def draw_coverage(
    world: World,
    e: Edges,
    plane: DepthPlane,
    cutout: Cutout,
    outline: Outline,
    mask: wp.array[wp.uint8],
):
    """Write 1 where the triangle covers a pixel centre and has no hole.

    Args:
        plane: Needed only for a cutout with a texture.
    """
    a = e.a.value
    b = e.b.value
    c = e.c.value
    count = e.x_last - e.x_first
    for y in range(e.y_first, e.y_last + 1):
        first = int(0)
        last = count
        if count > 8:
            first = span_start(a, e.a.dx, span_start(b, e.b.dx, span_start(c, e.c.dx, 0)))
            last = span_end(a, e.a.dx, span_end(b, e.b.dx, span_end(c, e.c.dx, count)))
        a_here = a + wp.int64(first) * e.a.dx
        b_here = b + wp.int64(first) * e.b.dx
        c_here = c + wp.int64(first) * e.c.dx
        pixel = int(outline.first_pixel + y * outline.stride + e.x_first + first)
        end = pixel + last - first
        row = plane.c + float(y) * plane.dy
        x = int(e.x_first + first)
        while pixel <= end:
            if (a_here | b_here | c_here) >= wp.int64(0):
                w = wp.clamp(row + float(x) * plane.dx, plane.low, plane.high)
                x_px = float(x + outline.window.x0) + 0.5
                y_px = float(y + outline.window.y0) + 0.5
                if is_solid_at(world, cutout, x_px, y_px, w):
                    mask[pixel] = wp.uint8(1)
            a_here += e.a.dx
            b_here += e.b.dx
            c_here += e.c.dx
            pixel += 1
            x += 1
        a += e.a.dy
        b += e.b.dy
        c += e.c.dy


@wp.func
def clip(view: View, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3):
    """Part of a triangle inside the five guard planes, as corners and their number.

    Source: Sutherland and Hodgman, "Reentrant polygon clipping", CACM 17(1), 1974.
    """
    polygon = Polygon()
    polygon[0] = p0
    polygon[1] = p1
    polygon[2] = p2
    n = int(3)
    for plane in range(5):
        clipped = Polygon()
        m = int(0)
        for i in range(n):
            p = polygon[i]
            q = polygon[(i + 1) % n]
            dp = guard_distance(view, p, plane)
            dq = guard_distance(view, q, plane)
            if dp >= 0.0:
                clipped[m] = p
                m += 1
                if dq < 0.0:
                    clipped[m] = p + (q - p) * (dp / (dp - dq))
                    m += 1
            elif dq >= 0.0:
                # Interpolate from inside to outside whatever the edge's direction: neighbouring
                # triangles then get identical points.
                clipped[m] = q + (p - q) * (dq / (dq - dp))
                m += 1
        polygon = clipped
        n = m
    return polygon, n


@wp.func
def fan_edges(view: View, polygon: Polygon, t: int, window: Window):
    """Edge functions of the t-th triangle of a polygon's fan."""
    p = snap_to_grid(view, polygon[0])
    q = snap_to_grid(view, polygon[t])
    r = snap_to_grid(view, polygon[t + 1])
    return make_edges(p, q, r, window)


@wp.func
def is_beyond_guard(view: View, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3):
    """Whether a triangle lies entirely outside one of the guard planes."""
    outside = bool(False)
    for plane in range(5):
        if (
            guard_distance(view, p0, plane) < 0.0
            and guard_distance(view, p1, plane) < 0.0
            and guard_distance(view, p2, plane) < 0.0
        ):
            outside = True
    return outside


@wp.func
def is_hidden(drawn: DrawnBody, width: int, height: int, nearness: wp.array[float]):
    """Whether nearer surfaces fill all pixels of an image that a body may cover."""
    hidden = bool(True)
    y = int(wp.max(drawn.window.y0, 0))
    y_end = wp.min(drawn.window.y0 + drawn.window.height, height)
    x_first = wp.max(drawn.window.x0, 0)
    x_end = wp.min(drawn.window.x0 + drawn.window.width, width)
    while hidden and y < y_end:
        x = int(x_first)
        while hidden and x < x_end:
            hidden = nearness[y * width + x] >= drawn.nearness_max
            x += 1
        y += 1
    return hidden


@wp.kernel
def draw_bodies(
    view: View,
    window: Window,
    world: World,
    bodies: wp.array[DrawnBody],
    p_camera: wp.array[wp.vec3],
    xy: wp.array[wp.vec2i],
    nearness: wp.array[float],
    hits: wp.array[wp.vec2i],
):
    """Z-buffer of listed bodies: the nearest (body, face) at every pixel centre.

    Bodies with cut-outs come last, so that few of their pixels need the alpha test.

    Args:
        nearness: 1/z [1/m]; must be 0 on entry.
        hits: Unchanged where nothing is hit.
    """
    drawn = bodies[wp.tid()]
    if is_hidden(drawn, window.width, window.height, nearness):
        return
    b = drawn.body
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    for f in range(geometry.face_slots.shape[0]):
        i = first + geometry.faces[3 * f]
        j = first + geometry.faces[3 * f + 1]
        k = first + geometry.faces[3 * f + 2]
        if xy[i][0] != UNSNAPPED and xy[j][0] != UNSNAPPED and xy[k][0] != UNSNAPPED:
            e = make_edges(xy[i], xy[j], xy[k], window)
            if e.covers != 0:
                plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
                cutout = make_cutout(view, world, b, f)
                draw_nearest(world, e, plane, cutout, b, f, window.width, nearness, hits)
        # A vertex lies outside the guard band: clip, and draw the polygon as a fan.
        elif not is_beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            polygon, corners = clip(view, p_camera[i], p_camera[j], p_camera[k])
            plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
            # Corners behind the near plane bound nothing: the visible part ends at the near plane.
            plane.high = 1.0 / Z_NEAR_M
            cutout = make_cutout(view, world, b, f)
            for t in range(1, corners - 1):
                e = fan_edges(view, polygon, t, window)
                if e.covers != 0:
                    draw_nearest(world, e, plane, cutout, b, f, window.width, nearness, hits)
