"""Anti-aliasing of colour where surfaces meet within a pixel.

Coverage is sampled by rays at parts of the pixel; colour is taken from the pixel centres nearby
that see the same surface, so that nothing is shaded twice.

Source: Chajdas, McGuire and Luebke, "Subpixel reconstruction antialiasing", I3D 2011.
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.rays import FARTHEST
from generator.renderers.kernels.records import (
    View,
    World,
    pixel_direction,
    surface_index,
    to_mesh_point,
    to_mesh_vector,
)
from generator.renderers.kernels.shade import Images
from generator.renderers.kernels.tone import developed

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Faces that meet at less than 25 degrees look like one surface.
CREASE_COSINE = wp.constant(0.9)


@wp.func
def clamped_pixel(view: View, x: int, y: int):
    """Index of the pixel of the image nearest to (x, y)."""
    return wp.clamp(y, 0, view.height - 1) * view.width + wp.clamp(x, 0, view.width - 1)


@wp.func
def differ(view: View, images: Images, i: int, j: int):
    """Whether an edge runs between two neighbouring pixels."""
    a = images.hits[i]
    b = images.hits[j]
    edge = bool(False)
    if a[0] != b[0]:
        edge = True
    elif a[1] != b[1]:
        edge = wp.dot(images.normals[i], images.normals[j]) < CREASE_COSINE
        # One body before itself: depths that are far from each other's tangent planes.
        nearer = wp.min(images.z_m[i], images.z_m[j])
        if wp.abs(images.z_m[i] - images.z_m[j]) > 0.05 * nearer:
            edge = True
    return edge


@wp.kernel
def find_edges(
    view: View, images: Images, count: wp.array(dtype=int), pixels: wp.array(dtype=int)
):
    """List the pixels that an edge may cross.

    Args:
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    y = wp.tid()
    for x in range(view.width):
        i = y * view.width + x
        if (
            differ(view, images, i, clamped_pixel(view, x + 1, y))
            or differ(view, images, i, clamped_pixel(view, x - 1, y))
            or differ(view, images, i, clamped_pixel(view, x, y + 1))
            or differ(view, images, i, clamped_pixel(view, x, y - 1))
        ):
            pixels[wp.atomic_add(count, 0, 1)] = i


@wp.struct
class Sight:
    """What a ray through a part of a pixel meets first."""

    hit: wp.vec2i
    t: float
    normal: wp.vec3


@wp.func
def look_for(world: World, b: int, origin: wp.vec3, d: wp.vec3, sight: Sight):
    """The nearer of what was seen so far and body b."""
    nearer = sight
    o = to_mesh_point(world, b, origin)
    e = to_mesh_vector(world, b, d)
    mesh = world.geometries[world.bodies[b].geometry].mesh
    answer = wp.mesh_query_ray(mesh, o, e, sight.t)
    if answer.result:
        nearer.t = answer.t
        nearer.hit = wp.vec2i(b, answer.face)
        n = world.bodies[b].R_world_mesh @ answer.normal
        nearer.normal = n * wp.where(wp.dot(n, d) > 0.0, -1.0, 1.0)
    return nearer


@wp.func
def colour_nearby(
    view: View,
    world: World,
    images: Images,
    radiance: wp.array(dtype=wp.vec3),
    x_px: float,
    y_px: float,
    sight: Sight,
):
    """Radiance of the nearest pixel centre on the same surface; fourth value 0 if there is none."""
    x = int(x_px)
    y = int(y_px)
    best = float(1.0e9)
    found = int(-1)
    for k in range(9):
        j = clamped_pixel(view, x + k % 3 - 1, y + k / 3 - 1)
        hit = images.hits[j]
        if hit[0] == sight.hit[0]:
            dx = float(x + k % 3 - 1) + 0.5 - x_px
            dy = float(y + k / 3 - 1) + 0.5 - y_px
            distance = dx * dx + dy * dy
            if hit[1] != sight.hit[1] and hit[0] >= 0:
                if surface_index(world, hit) != surface_index(world, sight.hit):
                    distance += 100.0
                # The sample's normal is its triangle's own, the pixel's is smooth.
                if wp.dot(images.normals[j], sight.normal) < 0.7:
                    distance += 10.0
            if distance < best:
                best = distance
                found = j
    c = wp.vec4(0.0)
    if found >= 0:
        r = radiance[found]
        c = wp.vec4(r[0], r[1], r[2], 1.0)
    return c


@wp.kernel
def antialias(
    view: View,
    world: World,
    images: Images,
    radiance: wp.array(dtype=wp.vec3),
    pixels: wp.array(dtype=int),
    offsets: wp.array(dtype=wp.vec2),
    exposure: float,
    t_min: float,
    curve: wp.array(dtype=wp.uint8),
    rgb: wp.array(dtype=wp.uint8, ndim=2),
):
    """Replace the bytes of listed pixels by the mean over parts of the pixel.

    Args:
        offsets: Sample positions within the pixel, [0, 1).
        t_min: z-depth from which surfaces are seen.
    """
    i = pixels[wp.tid()]
    x = i % view.width
    y = i / view.width
    total = wp.vec3(0.0)
    weights = float(0.0)
    for s in range(offsets.shape[0]):
        x_px = float(x) + offsets[s][0]
        y_px = float(y) + offsets[s][1]
        d = view.R_world_camera @ pixel_direction(view, x_px, y_px)
        origin = view.eye_m + d * t_min
        sight = Sight()
        sight.hit = wp.vec2i(-1, -1)
        sight.t = FARTHEST
        # A body that no centre around sees has no colour to take: it need not be looked for.
        b0 = images.hits[i][0]
        if b0 >= 0:
            sight = look_for(world, b0, origin, d, sight)
        b1 = int(-1)
        b2 = int(-1)
        for k in range(9):
            b = images.hits[clamped_pixel(view, x + k % 3 - 1, y + k / 3 - 1)][0]
            if b >= 0 and b != b0 and b != b1 and b != b2:
                sight = look_for(world, b, origin, d, sight)
                b2 = b1
                b1 = b
        c = colour_nearby(view, world, images, radiance, x_px, y_px, sight)
        if c[3] > 0.0:
            exposed = wp.vec3(c[0], c[1], c[2]) * exposure
            # Bright samples count less, as they would after the tone curve.
            w = 1.0 / (1.0 + 0.2126 * exposed[0] + 0.7152 * exposed[1] + 0.0722 * exposed[2])
            total += exposed * w
            weights += w
    if weights > 0.0:
        mean = total * (1.0 / weights)
        rgb[i, 0] = developed(mean[0], curve)
        rgb[i, 1] = developed(mean[1], curve)
        rgb[i, 2] = developed(mean[2], curve)
