"""Exact triangle rasteriser (CPU device only: bodies are drawn one after another).

Vertices are snapped to 1/256 px and edges evaluated in 64-bit integers with the top-left rule:
triangles that share an edge neither overlap nor leave a gap. Pixels are sampled at their centres.

Source: Pineda, "A parallel algorithm for polygon rasterization", SIGGRAPH 1988.
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels.records import View, World, max_of_two
from gen_data.renderers.warp.visibility.kernels.alpha_cutouts import Cutout, make_cutout

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

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
class Extent:
    """Least and largest snapped coordinates of a body's vertices, and their largest depth [m]."""

    low: wp.vec2i
    high: wp.vec2i
    farthest_m: float


@wp.struct
class Outline:
    """Where the silhouette of a body is written.

    Attributes:
        window: The pixels that the body may cover; may lie outside the image.
        first_row, last_row: Rows of the window to draw.
        first_pixel: Index in the buffer of the window's first pixel.
        stride: Pixels between rows of the buffer.
    """

    body: int
    window: Window
    first_row: int
    last_row: int
    first_pixel: int
    stride: int


@wp.struct
class Box:
    """Pixels of a window, first and last of each axis."""

    x_first: int
    x_last: int
    y_first: int
    y_last: int


@wp.struct
class Edge:
    """Edge function: value at a first pixel, and steps per pixel; inside is >= 0."""

    value: wp.int64
    dx: wp.int64
    dy: wp.int64


@wp.struct
class Edges:
    """Edge functions of a triangle over a box of pixels; ``covers`` is 0 if it has no area."""

    covers: int
    box: Box
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
    extents: wp.array2d[Extent],
):
    """Vertices in the camera frame and on the snapped image plane, of listed bodies.

    Args:
        extents: Extents of each listed body, in one part per thread that works on it; the depth of
            a part without vertices is negative.
    """
    row, part = wp.tid()
    parts = extents.shape[1]
    b = bodies[row]
    A = world.bodies[b].A_camera_mesh
    t = world.bodies[b].t_camera_mesh
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    low = wp.vec2i(2147483647, 2147483647)
    high = wp.vec2i(UNSNAPPED, UNSNAPPED)
    farthest_m = float(-1.0)
    for i in range(part, geometry.vertices_m.shape[0], parts):
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
        low = wp.vec2i(wp.min(low[0], q[0]), wp.min(low[1], q[1]))
        high = wp.vec2i(wp.max(high[0], q[0]), wp.max(high[1], q[1]))
        farthest_m = max_of_two(farthest_m, p[2])
    extent = Extent()
    extent.low = low
    extent.high = high
    extent.farthest_m = farthest_m
    extents[row, part] = extent


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
def pixel_box(p: wp.vec2i, q: wp.vec2i, r: wp.vec2i, window: Window, reach: int):
    """The box of pixels of a window whose centres a triangle may cover; empty if last < first.

    Args:
        reach: Distance along each axis by which the triangle is enlarged [1/256 px].
    """
    x_low, x_high = wp.min(p[0], wp.min(q[0], r[0])), wp.max(p[0], wp.max(q[0], r[0]))
    y_low, y_high = wp.min(p[1], wp.min(q[1], r[1])), wp.max(p[1], wp.max(q[1], r[1]))
    box = Box()
    # Centres are at 256 i + 128: lows are rounded up to them, highs down.
    box.x_first = wp.max(((x_low - reach + 127) >> 8) - window.x0, 0)
    box.x_last = wp.min(((x_high + reach - 128) >> 8) - window.x0, window.width - 1)
    box.y_first = wp.max(((y_low - reach + 127) >> 8) - window.y0, 0)
    box.y_last = wp.min(((y_high + reach - 128) >> 8) - window.y0, window.height - 1)
    return box


@wp.func
def is_empty(box: Box):
    """Whether a box has no pixels."""
    return box.x_first > box.x_last or box.y_first > box.y_last


@wp.func
def make_edges(p: wp.vec2i, q: wp.vec2i, r: wp.vec2i, window: Window, box: Box):
    """Edge functions over a box of pixels, of a triangle of either orientation."""
    edges = Edges()
    edges.box = box
    area = wp.int64(q[0] - p[0]) * wp.int64(r[1] - p[1])
    area -= wp.int64(r[0] - p[0]) * wp.int64(q[1] - p[1])
    # Degenerate after snapping: it covers no centre.
    if area == wp.int64(0):
        return edges
    # Centre of the first pixel, in snapped units.
    x = ((box.x_first + window.x0) << 8) + 128
    y = ((box.y_first + window.y0) << 8) + 128
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
def largest_nearness(p0: wp.vec3, p1: wp.vec3, p2: wp.vec3):
    """1/z of the nearest of three camera-frame points, bounded [1/m]."""
    z_low = wp.min(p0[2], wp.min(p1[2], p2[2]))
    # Snapping moves edges by up to 1/512 px: depth beyond the triangle is clamped to its corners'.
    return 1.0 / wp.max(z_low, 0.5 * Z_NEAR_M)


@wp.func
def depth_plane(view: View, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3, window: Window):
    """1/z over the window's pixels, of the plane through three camera-frame points."""
    plane = DepthPlane()
    plane.low = 1.0 / wp.max(p0[2], wp.max(p1[2], p2[2]))
    plane.high = largest_nearness(p0, p1, p2)
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


@wp.func_native(native("visibility/kernels/draw_nearest.h"))
def draw_nearest(
    world: World,
    edges: Edges,
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
    ...


@wp.func_native(native("visibility/kernels/draw_coverage.h"))
def draw_coverage(
    world: World,
    edges: Edges,
    plane: DepthPlane,
    cutout: Cutout,
    outline: Outline,
    mask: wp.array[wp.uint8],
):
    """Write 1 where the triangle covers a pixel centre and has no hole.

    Args:
        plane: Needed only for a cutout with a texture.
        mask: LANES longer than all outlines.
    """
    ...


@wp.func_native(native("visibility/kernels/is_filled.h"))
def is_filled(box: Box, outline: Outline, mask: wp.array[wp.uint8]) -> bool:
    """Whether all pixels of a box of an outline's window are drawn."""
    ...


@wp.func_native(native("visibility/kernels/is_hidden.h"))
def is_hidden(box: Box, nearness_max: float, stride: int, nearness: wp.array[float]) -> bool:
    """Whether all pixels of a box of an image are at least as near as ``nearness_max`` [1/m]."""
    ...


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
def in_rows(box: Box, first_row: int, last_row: int):
    """The part of a box in some rows of its window."""
    part = box
    part.y_first = wp.max(box.y_first, first_row)
    part.y_last = wp.min(box.y_last, last_row)
    return part


@wp.func
def fan_edges(view: View, polygon: Polygon, t: int, window: Window, reach: int):
    """Edge functions of the t-th triangle of a polygon's fan."""
    return fan_edges_in(view, polygon, t, window, reach, 0, window.height - 1)


@wp.func
def fan_edges_in(
    view: View,
    polygon: Polygon,
    t: int,
    window: Window,
    reach: int,
    first_row: int,
    last_row: int,
):
    """As ``fan_edges``, over some rows of the window."""
    p = snap_to_grid(view, polygon[0])
    q = snap_to_grid(view, polygon[t])
    r = snap_to_grid(view, polygon[t + 1])
    edges = Edges()
    box = in_rows(pixel_box(p, q, r, window, reach), first_row, last_row)
    if not is_empty(box):
        edges = make_edges(p, q, r, window, box)
    return edges


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
def window_in_image(window: Window, image: Window):
    """The box of an image's pixels in a window."""
    box = Box()
    box.x_first = wp.max(window.x0, 0)
    box.x_last = wp.min(window.x0 + window.width, image.width) - 1
    box.y_first = wp.max(window.y0, 0)
    box.y_last = wp.min(window.y0 + window.height, image.height) - 1
    return box


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

    Bodies with cut-outs come last: few of their pixels then need the alpha test.

    Args:
        nearness: 1/z [1/m]; must be 0 on entry. It and ``hits`` are LANES longer than the image.
        hits: Unchanged where nothing is hit.
    """
    drawn = bodies[wp.tid()]
    stride = window.width
    whole = window_in_image(drawn.window, window)
    if is_hidden(whole, drawn.nearness_max, stride, nearness):
        return
    b = drawn.body
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    for f in range(geometry.face_slots.shape[0]):
        i = first + geometry.faces[3 * f]
        j = first + geometry.faces[3 * f + 1]
        k = first + geometry.faces[3 * f + 2]
        if xy[i][0] != UNSNAPPED and xy[j][0] != UNSNAPPED and xy[k][0] != UNSNAPPED:
            box = pixel_box(xy[i], xy[j], xy[k], window, 0)
            if not is_empty(box):
                nearest = largest_nearness(p_camera[i], p_camera[j], p_camera[k])
                if not is_hidden(box, nearest, stride, nearness):
                    e = make_edges(xy[i], xy[j], xy[k], window, box)
                    if e.covers != 0:
                        plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
                        cutout = make_cutout(view, world, b, f)
                        draw_nearest(world, e, plane, cutout, b, f, stride, nearness, hits)
        # A vertex lies outside the guard band: clip, and draw the polygon as a fan.
        elif not is_beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            polygon, corners = clip(view, p_camera[i], p_camera[j], p_camera[k])
            plane = depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
            # Corners behind the near plane bound nothing: the visible part ends at the near plane.
            plane.high = 1.0 / Z_NEAR_M
            cutout = make_cutout(view, world, b, f)
            for t in range(1, corners - 1):
                e = fan_edges(view, polygon, t, window, 0)
                if e.covers != 0:
                    draw_nearest(world, e, plane, cutout, b, f, stride, nearness, hits)
