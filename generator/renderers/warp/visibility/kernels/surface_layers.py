"""Surfaces behind see-through ones and in mirrors, on the rays of pixels."""

import warp as wp

from gen_data.renderers.warp.scene.kernels import ray_queries, records
from gen_data.renderers.warp.visibility.kernels import label_resolve

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Limit on the queries of one ray; it bounds the loop, not the image.
QUERIES_MAX = wp.constant(64)
# Least sine of the angle between a reflected ray and a face.
LIFT = wp.constant(1.0e-3)


@wp.kernel
def label_materials(
    world: records.World,
    hits: wp.array[wp.vec2i],
    materials: wp.array[wp.uint16],
    width: int,
    run: int,
    labels: wp.array[wp.uint16],
):
    """Number of the material at every pixel; 0 for the background.

    Args:
        world: The scene.
        hits: First surface of every pixel.
        materials: Number of each material.
        width: Pixels of a row.
        run: Pixels in a row per thread: neighbours on one face share its material.
        labels: The numbers.
    """
    y, segment = wp.tid()
    begin = y * width + segment * run
    known = wp.vec2i(-1, -1)
    label = wp.uint16(0)
    for i in range(begin, begin + run):
        hit = hits[i]
        if hit[0] != known[0] or hit[1] != known[1]:
            known = hit
            label = wp.uint16(0)
            if hit[0] >= 0:
                label = materials[records.surface_index(world, hit)]
        labels[i] = label


@wp.func
def surface_behind(
    view: records.View, world: records.World, before: wp.vec2i, p: wp.vec3, d: wp.vec3
):
    """The next (body, face) on a ray from a point of another one, and its point.

    Args:
        view, world: Camera and scene.
        before: The (body, face) of the point.
        p: The point.
        d: Unit direction.
    """
    at = before
    origin = p
    queries = int(0)
    # A flat face is met once: a second time is rounding.
    while at[0] == before[0] and at[1] == before[1] and queries < QUERIES_MAX:
        origin = ray_queries.passed_origin(origin, d, view.eye_m)
        met = ray_queries.closest_hit(world, origin, d, ray_queries.FARTHEST, records.HOLES)
        origin = origin + d * met.t
        at = met.at
        queries += 1
    if queries == QUERIES_MAX:
        at = wp.vec2i(-1, -1)
    return at, origin


@wp.kernel
def trace_behind(
    view: records.View,
    world: records.World,
    hits: wp.array[wp.vec2i],
    depths: wp.array[float],
    materials: wp.array[wp.uint16],
    see_through: int,
    pixels: wp.array[int],
    behind: wp.array2d[wp.vec2i],
    z_m: wp.array2d[float],
):
    """Surfaces behind the first one on the rays of listed pixels, up to the first opaque one.

    Args:
        view, world: Camera and scene.
        hits, depths: First surface of every pixel, as of GBuffer.
        materials: Number of each material.
        see_through: Number of the materials behind which rays continue.
        pixels: The listed pixels.
        behind: (body, material) of each ray's later surfaces; (-1, -1) for none.
        z_m: Their depths along the optical axis.
    """
    k = wp.tid()
    i = pixels[k]
    way = records.pixel_ray(view, i)
    d = records.fast_normalize(way)
    # Along the optical axis, per metre of the ray.
    slope = 1.0 / wp.length(way)
    if view.lens != records.PINHOLE:
        slope = view.directions[i][2]
    for layer in range(behind.shape[1]):
        behind[k, layer] = wp.vec2i(-1, -1)
    p = view.eye_m + way * depths[i]
    at = hits[i]
    layer = int(0)
    going = bool(True)
    while going:
        at, p = surface_behind(view, world, at, p, d)
        going = False
        if at[0] >= 0:
            surface = records.surface_index(world, at)
            z = wp.dot(p - view.eye_m, d) * slope
            if not z > 0.0:
                z = wp.inf
            behind[k, layer] = wp.vec2i(at[0], surface)
            z_m[k, layer] = z
            layer += 1
            going = int(materials[surface]) == see_through and layer < behind.shape[1]


@wp.kernel
def trace_mirrors(
    view: records.View,
    world: records.World,
    hits: wp.array[wp.vec2i],
    depths: wp.array[float],
    materials: wp.array[wp.uint16],
    see_through: int,
    pixels: wp.array[int],
    mirror: int,
    mirrors: wp.array[int],
    mirrored: wp.array[int],
    places_m: wp.array[wp.vec3],
):
    """The first surface on the ray that a mirror reflects, at listed pixels.

    Args:
        view, world, hits, depths, materials, see_through, pixels: As for ``trace_behind``.
        mirror: Number of mirrors.
        mirrors: Body of the mirror that each pixel shows, also through glass; -1 for none.
        mirrored: Body that is seen in it; -1 for none.
        places_m: The point that is seen, in the world.
    """
    k = wp.tid()
    i = pixels[k]
    way = records.pixel_ray(view, i)
    d = records.fast_normalize(way)
    p = view.eye_m + way * depths[i]
    at = hits[i]
    going = bool(True)
    while going:
        going = False
        if int(materials[records.surface_index(world, at)]) == see_through:
            at, p = surface_behind(view, world, at, p, d)
            going = at[0] >= 0
    mirrors[k] = -1
    mirrored[k] = -1
    if at[0] >= 0:
        if int(materials[records.surface_index(world, at)]) == mirror:
            mirrors[k] = at[0]
            x = float(i % view.width) + 0.5
            y = float(i / view.width) + 0.5
            n = label_resolve.point_at(view, world, at, x, y).normal
            r = d - n * (2.0 * wp.dot(n, d))
            # Smooth normals of curved mirrors may send rays below a face.
            face = label_resolve.make_facet(world, at).across
            g = view.R_world_camera @ records.fast_normalize(face)
            g = g * wp.where(wp.dot(g, d) > 0.0, -1.0, 1.0)
            r = records.fast_normalize(r + g * wp.max(LIFT - wp.dot(r, g), 0.0))
            shown, place = surface_behind(view, world, at, p, r)
            mirrored[k] = shown[0]
            places_m[k] = place
