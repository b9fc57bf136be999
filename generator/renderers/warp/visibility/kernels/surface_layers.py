"""Surfaces behind see-through ones, along the straight rays of pixels."""

import warp as wp

from gen_data.renderers.warp.scene.kernels import ray_queries, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Limit on the queries of one ray; it bounds the loop, not the image.
QUERIES_MAX = wp.constant(64)


@wp.kernel
def label_materials(
    world: records.World,
    hits: wp.array[wp.vec2i],
    materials: wp.array[wp.uint16],
    labels: wp.array[wp.uint16],
):
    """Number of the material at every pixel; 0 for the background."""
    i = wp.tid()
    label = wp.uint16(0)
    if hits[i][0] >= 0:
        label = materials[records.surface_index(world, hits[i])]
    labels[i] = label


@wp.kernel
def list_see_through(
    world: records.World,
    hits: wp.array[wp.vec2i],
    materials: wp.array[wp.uint16],
    see_through: int,
    count: wp.array[int],
    pixels: wp.array[int],
):
    """List the pixels whose first surface is see-through, in any order.

    Args:
        world: The scene.
        hits: First surface of every pixel.
        materials: Number of each material.
        see_through: Number of those that rays continue behind.
        count: Length of the list; 0 at first.
        pixels: The list.
    """
    i = wp.tid()
    if hits[i][0] >= 0:
        if int(materials[records.surface_index(world, hits[i])]) == see_through:
            pixels[wp.atomic_add(count, 0, 1)] = i


@wp.kernel
def trace_behind(
    view: records.View,
    world: records.World,
    hits: wp.array[wp.vec2i],
    materials: wp.array[wp.uint16],
    see_through: int,
    pixels: wp.array[int],
    depths: wp.array[float],
    behind: wp.array2d[wp.vec2i],
    z_m: wp.array2d[float],
):
    """Surfaces behind the first one on the rays of listed pixels, up to the first opaque one.

    Args:
        view, world: Camera and scene.
        hits, materials, see_through, pixels: As for ``list_see_through``.
        depths: Of the first surfaces, as of GBuffer.
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
    before = hits[i]
    layer = int(0)
    queries = int(0)
    going = bool(True)
    while going:
        origin = ray_queries.passed_origin(p, d, view.eye_m)
        met = ray_queries.closest_hit(world, origin, d, ray_queries.FARTHEST, records.HOLES)
        queries += 1
        going = False
        if met.at[0] >= 0:
            p = origin + d * met.t
            surface = records.surface_index(world, met.at)
            # A flat face is met once: a second time is rounding.
            if met.at[0] != before[0] or met.at[1] != before[1]:
                z = wp.dot(p - view.eye_m, d) * slope
                if not z > 0.0:
                    z = wp.inf
                behind[k, layer] = wp.vec2i(met.at[0], surface)
                z_m[k, layer] = z
                layer += 1
            before = met.at
            going = int(materials[surface]) == see_through and layer < behind.shape[1]
            going = going and queries < QUERIES_MAX
