"""Anti-aliasing of radiance at edges, by rays.

Coverage is sampled at several points of a pixel; colour is taken from nearby pixel centres that
show the same surface: no point is shaded twice.

Source: Chajdas, McGuire and Luebke, "Subpixel reconstruction antialiasing", I3D 2011.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import alpha_test, ray_queries, records
from gen_data.renderers.warp.visibility.kernels import edge_detection, label_resolve

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

Vector8 = wp.types.vector(length=8, dtype=wp.float32)
Vector8i = wp.types.vector(length=8, dtype=wp.int32)


@wp.struct
class Parts:
    """Nearest surfaces at the samples of one pixel.

    Attributes:
        nearness: 1/z of the nearest surface so far [1/m]; 0 for none.
        source: Pixel whose centre shows the same surface and provides its colour; -1 for none.
    """

    nearness: Vector8
    source: Vector8i


@wp.func
def is_face_repeated(view: records.View, images: records.GBufferRecord, x: int, y: int, k: int):
    """Whether an earlier of the nine pixels shows the same face as the k-th."""
    hit = images.hits[edge_detection.neighbour_pixel(view, x, y, k)]
    before = bool(False)
    for m in range(k):
        other = images.hits[edge_detection.neighbour_pixel(view, x, y, m)]
        if other[0] == hit[0] and other[1] == hit[1]:
            before = True
    return before


@wp.func
def cover(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    offsets: wp.array[wp.vec2],
    x: int,
    y: int,
    source: int,
    parts: Parts,
):
    """Assign the samples of pixel (x, y) to the face of pixel ``source`` where it is nearest."""
    hit = images.hits[source]
    facet = label_resolve.make_facet(world, hit)
    cutouts = (world.bodies[hit[0]].cutouts & records.HOLES) != 0
    for s in range(offsets.shape[0]):
        x_px = float(x) + offsets[s][0]
        y_px = float(y) + offsets[s][1]
        d = records.pixel_direction(view, x_px, y_px)
        det = wp.dot(d, facet.across)
        # Barycentric weights and depth without a division: all are scaled by det.
        side = wp.where(det < 0.0, -1.0, 1.0)
        u = wp.dot(d, facet.along_u) * side
        v = wp.dot(d, facet.along_v) * side
        w = det * side
        if u >= 0.0 and v >= 0.0 and u + v <= w and facet.depth * side > 0.0:
            nearness = det / facet.depth
            seen = nearness > parts.nearness[s]
            if seen and cutouts:
                weights = wp.vec3(w - u - v, u, v) * (1.0 / w)
                seen = not alpha_test.is_hole(world, hit[0], hit[1], weights)
            if seen:
                parts.nearness[s] = nearness
                parts.source[s] = source
    return parts


@wp.func
def trace_source(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    x: int,
    y: int,
    x_px: float,
    y_px: float,
    t_min: float,
):
    """The pixel around (x, y) that shows the body at a sample, for faces no centre shows.

    Only bodies of the nine pixels are traced: no other has a colour to provide.
    """
    d = view.R_world_camera @ records.pixel_direction(view, x_px, y_px)
    origin = view.eye_m + d * t_min
    nearest = float(ray_queries.FARTHEST)
    source = int(-1)
    normal = wp.vec3(0.0)
    last = int(-1)
    for k in range(9):
        j = edge_detection.neighbour_pixel(view, x, y, k)
        b = images.hits[j][0]
        if b < 0:
            if source < 0:
                source = j
        elif b != last:
            last = b
            o = records.to_mesh_point(world, b, origin)
            answer = alpha_test.closest_solid_hit(
                world, b, o, records.to_mesh_vector(world, b, d), nearest, records.HOLES
            )
            if answer.face >= 0:
                nearest = answer.t
                source = j
                normal = records.flat_normal(world, wp.vec2i(b, answer.face))
    if nearest < ray_queries.FARTHEST:
        source = edge_detection.most_similar_normal(view, images, x, y, source, normal)
    return source


@wp.kernel
def antialias(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    radiance: wp.array[wp.vec3],
    pixels: wp.array[int],
    offsets: wp.array[wp.vec2],
    t_min: float,
    mixed: wp.array[wp.vec3],
):
    """Radiance of listed pixels: the mean over their samples, in the order of the list.

    Args:
        offsets: At most eight sample positions within the pixel, [0, 1).
        t_min: z-depth of the near plane.
    """
    row = wp.tid()
    i = pixels[row]
    mixed[row] = radiance[i]
    if not records.is_in_view(view, i):
        return
    x = i % view.width
    y = i / view.width
    parts = Parts()
    for s in range(offsets.shape[0]):
        parts.source[s] = -1
    for k in range(9):
        j = edge_detection.neighbour_pixel(view, x, y, k)
        if images.hits[j][0] >= 0 and not is_face_repeated(view, images, x, y, k):
            parts = cover(view, world, images, offsets, x, y, j, parts)
    total = wp.vec3(0.0)
    lit = int(0)
    for s in range(offsets.shape[0]):
        source = parts.source[s]
        if source < 0:
            x_px = float(x) + offsets[s][0]
            y_px = float(y) + offsets[s][1]
            # No visible face nearby covers the sample: other faces of the same bodies may.
            source = trace_source(view, world, images, x, y, x_px, y_px, t_min)
        if source >= 0:
            total += radiance[source]
            lit += 1
    if lit > 0:
        mixed[row] = total * (1.0 / float(lit))
