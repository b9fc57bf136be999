"""Auxiliary images for the denoiser: albedo and normals of the first visible surfaces."""

import warp as wp

from gen_data.renderers.warp.pathtraced.kernels.emitters import AT_INFINITY
from gen_data.renderers.warp.pathtraced.kernels.integrator import make_vertex
from gen_data.renderers.warp.pathtraced.kernels.sampler import hash_bits, random_pair
from gen_data.renderers.warp.scene.kernels.ray_queries import closest_hit
from gen_data.renderers.warp.scene.kernels.records import (
    HOLES,
    View,
    World,
    fast_normalize,
    is_in_view,
    pixel_direction,
)
from gen_data.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.kernel
def trace_guides(
    view: View, world: World, samples: int, albedo: wp.array[wp.vec3], normal: wp.array[wp.vec3]
):
    """Mean albedo and normal over each pixel's square; white and no normal for the background."""
    i = wp.tid()
    if not is_in_view(view, i):
        return
    colors = wp.vec3(0.0)
    normals = wp.vec3(0.0)
    # Independent sequences per pixel: correlated ones would look like structure to the denoiser.
    pixel = hash_bits(wp.uint32(i))
    for k in range(samples):
        place = random_pair(pixel, 0, wp.uint32(k))
        x = float(i % view.width) + place[0]
        y = float(i / view.width) + place[1]
        d = fast_normalize(view.R_world_camera @ pixel_direction(view, x, y))
        hit = closest_hit(world, view.eye_m + d * Z_NEAR_M, d, AT_INFINITY, HOLES)
        if hit.at[0] < 0:
            # The background counts as white.
            colors += wp.vec3(1.0, 1.0, 1.0)
        else:
            v = make_vertex(world, hit, d, 0.0)
            colors += v.material.albedo
            normals += v.material.normal
    albedo[i] = colors * (1.0 / float(samples))
    normal[i] = normals * (1.0 / float(samples))
