"""Anti-aliasing of colour where surfaces meet within a pixel.

Coverage is sampled by rays at parts of the pixel; colour is taken from the pixel centres nearby
that see the same surface, so that nothing is shaded twice.

Source: Chajdas, McGuire and Luebke, "Subpixel reconstruction antialiasing", I3D 2011.
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.holes import hole_at, solid_hit
from generator.renderers.kernels.rays import FARTHEST
from generator.renderers.kernels.records import (
    HOLES,
    View,
    World,
    pixel_direction,
    shows,
    to_mesh_point,
    to_mesh_vector,
)
from generator.renderers.kernels.shade import Images
from generator.renderers.kernels.surface import facet_of

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Faces that meet at less than 25 degrees look like one surface.
CREASE_COSINE = wp.constant(0.9)
# Places in a 3 x 3 block, row by row, as hexadecimal digits from the last: centre, sides, corners.
ORDER = wp.constant(wp.int64(0x862075314))

Vector8 = wp.types.vector(length=8, dtype=wp.float32)
Vector8i = wp.types.vector(length=8, dtype=wp.int32)


@wp.func
def clamped_pixel(view: View, x: int, y: int):
    """Index of the pixel of the image nearest to (x, y)."""
    return wp.clamp(y, 0, view.height - 1) * view.width + wp.clamp(x, 0, view.width - 1)


@wp.func
def differ(images: Images, i: int, j: int):
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
def find_edges(view: View, images: Images, count: wp.array(dtype=int), pixels: wp.array(dtype=int)):
    """List the pixels that an edge may cross.

    Args:
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    y = wp.tid()
    for x in range(view.width):
        i = y * view.width + x
        if (
            differ(images, i, clamped_pixel(view, x + 1, y))
            or differ(images, i, clamped_pixel(view, x - 1, y))
            or differ(images, i, clamped_pixel(view, x, y + 1))
            or differ(images, i, clamped_pixel(view, x, y - 1))
        ):
            pixels[wp.atomic_add(count, 0, 1)] = i


@wp.struct
class Parts:
    """What the parts of one pixel see.

    Attributes:
        nearness: 1/z of the nearest surface so far [1/m]; 0 for none.
        source: Pixel whose centre sees the same surface and lends its colour; -1 for none.
    """

    nearness: Vector8
    source: Vector8i


@wp.func
def nearby(view: View, x: int, y: int, k: int):
    """The k-th pixel of the nine around (x, y): itself, then sides, then corners."""
    m = int((ORDER >> wp.int64(4 * k)) & wp.int64(15))
    return clamped_pixel(view, x + m % 3 - 1, y + m / 3 - 1)


@wp.func
def seen_before(view: View, images: Images, x: int, y: int, k: int):
    """Whether an earlier of the nine pixels sees the same face as the k-th."""
    hit = images.hits[nearby(view, x, y, k)]
    before = bool(False)
    for m in range(k):
        other = images.hits[nearby(view, x, y, m)]
        if other[0] == hit[0] and other[1] == hit[1]:
            before = True
    return before


@wp.func
def cover(
    view: View,
    world: World,
    images: Images,
    offsets: wp.array(dtype=wp.vec2),
    x: int,
    y: int,
    source: int,
    parts: Parts,
):
    """Give the parts of pixel (x, y) to the face that pixel ``source`` sees where it is nearest."""
    hit = images.hits[source]
    facet = facet_of(world, hit)
    pierced = (world.bodies[hit[0]].pierced & HOLES) != 0
    for s in range(offsets.shape[0]):
        x_px = float(x) + offsets[s][0]
        y_px = float(y) + offsets[s][1]
        d = pixel_direction(view, x_px, y_px)
        det = wp.dot(d, facet.across)
        # Barycentric weights and depth without a division: all have det for a factor.
        side = wp.where(det < 0.0, -1.0, 1.0)
        u = wp.dot(d, facet.along_u) * side
        v = wp.dot(d, facet.along_v) * side
        w = det * side
        if u >= 0.0 and v >= 0.0 and u + v <= w and facet.depth * side > 0.0:
            nearness = det / facet.depth
            seen = nearness > parts.nearness[s]
            if seen and pierced:
                weights = wp.vec3(w - u - v, u, v) * (1.0 / w)
                seen = not hole_at(world, hit[0], hit[1], weights)
            if seen:
                parts.nearness[s] = nearness
                parts.source[s] = source
    return parts


@wp.func
def traced_source(
    view: View, world: World, images: Images, x: int, y: int, x_px: float, y_px: float, t_min: float
):
    """The pixel around (x, y) that sees the body a ray meets first, for faces no centre sees.

    A body that no centre around sees has no colour to lend: it is not looked for.
    """
    d = view.R_world_camera @ pixel_direction(view, x_px, y_px)
    origin = view.eye_m + d * t_min
    nearest = float(FARTHEST)
    source = int(-1)
    normal = wp.vec3(0.0)
    last = int(-1)
    for k in range(9):
        j = nearby(view, x, y, k)
        b = images.hits[j][0]
        if b < 0:
            if source < 0:
                source = j
        elif b != last:
            last = b
            o = to_mesh_point(world, b, origin)
            answer = solid_hit(world, b, o, to_mesh_vector(world, b, d), nearest, HOLES)
            if answer.result:
                nearest = answer.t
                source = j
                normal = world.bodies[b].R_world_mesh @ answer.normal
    if nearest < FARTHEST:
        source = most_alike(view, images, x, y, source, normal)
    return source


@wp.func
def most_alike(view: View, images: Images, x: int, y: int, source: int, normal: wp.vec3):
    """Of the pixels around (x, y) that see the body of ``source``, the one turned most alike."""
    best = float(-1.0)
    found = source
    for k in range(9):
        j = nearby(view, x, y, k)
        if images.hits[j][0] == images.hits[source][0]:
            cosine = wp.abs(wp.dot(images.normals[j], normal))
            if cosine > best + 0.05:
                best = cosine
                found = j
    return found


@wp.func
def tone_weight(exposed: wp.vec3):
    """Weight of a sample: bright ones count less, as they would after the tone curve."""
    return 1.0 / (1.0 + 0.2126 * exposed[0] + 0.7152 * exposed[1] + 0.0722 * exposed[2])


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
    mixed: wp.array(dtype=wp.vec3),
):
    """Radiance of listed pixels: the mean over parts of the pixel, in the order of the list.

    Args:
        offsets: At most eight sample positions within the pixel, [0, 1).
        t_min: z-depth from which surfaces are seen.
    """
    row = wp.tid()
    i = pixels[row]
    mixed[row] = radiance[i]
    if not shows(view, i):
        return
    x = i % view.width
    y = i / view.width
    parts = Parts()
    for s in range(offsets.shape[0]):
        parts.source[s] = -1
    for k in range(9):
        j = nearby(view, x, y, k)
        if images.hits[j][0] >= 0 and not seen_before(view, images, x, y, k):
            parts = cover(view, world, images, offsets, x, y, j, parts)
    total = wp.vec3(0.0)
    weights = float(0.0)
    for s in range(offsets.shape[0]):
        source = parts.source[s]
        if source < 0:
            x_px = float(x) + offsets[s][0]
            y_px = float(y) + offsets[s][1]
            source = traced_source(view, world, images, x, y, x_px, y_px, t_min)
        if source >= 0:
            exposed = radiance[source] * exposure
            w = tone_weight(exposed)
            total += exposed * w
            weights += w
    if weights > 0.0:
        mixed[row] = total * (1.0 / (weights * exposure))
