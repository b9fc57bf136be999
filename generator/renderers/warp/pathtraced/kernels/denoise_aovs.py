"""Auxiliary images for the denoiser: albedo and normals of the first visible surfaces."""

import warp as wp

from gen_data.renderers.warp.pathtraced.kernels import emitters, integrator, sampler
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.kernels.ray_queries import closest_hit
from gen_data.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.kernel
def trace_guides(
    view: records.View,
    world: records.World,
    samples: int,
    albedo: wp.array[wp.vec3],
    normal: wp.array[wp.vec3],
):
    """Mean albedo and normal over each pixel's square; white and no normal for the background."""
    i = wp.tid()
    if not records.is_in_view(view, i):
        return
    colors = wp.vec3(0.0)
    normals = wp.vec3(0.0)
    # Independent sequences per pixel: correlated ones would look like structure to the denoiser.
    pixel = sampler.hash_bits(wp.uint32(i))
    for k in range(samples):
        place = sampler.random_pair(pixel, 0, wp.uint32(k))
        x = float(i % view.width) + place[0]
        y = float(i / view.width) + place[1]
        d = records.fast_normalize(view.R_world_camera @ records.pixel_direction(view, x, y))
        hit = closest_hit(world, view.eye_m + d * Z_NEAR_M, d, emitters.AT_INFINITY, records.HOLES)
        if hit.at[0] < 0:
            # The background counts as white.
            colors += wp.vec3(1.0, 1.0, 1.0)
        else:
            v = integrator.make_vertex(world, hit, d, 0.0)
            colors += v.material.albedo
            normals += v.material.normal
    albedo[i] = colors * (1.0 / float(samples))
    normal[i] = normals * (1.0 / float(samples))
