"""What a denoiser looks at besides the light: colours and normals of what is seen first."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.path import vertex_of
from generator.renderers.kernels.path_lights import AT_INFINITY
from generator.renderers.kernels.path_random import mixed_bits, random_pair
from generator.renderers.kernels.raster import Z_NEAR_M
from generator.renderers.kernels.rays import first_met
from generator.renderers.kernels.records import HOLES, View, World, pixel_direction, shows, unit

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.kernel
def trace_guides(
    view: View,
    world: World,
    samples: int,
    albedo: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
):
    """Means over each pixel's square; where nothing is seen, white and no normal."""
    i = wp.tid()
    if not shows(view, i):
        return
    colors = wp.vec3(0.0)
    normals = wp.vec3(0.0)
    pixel = mixed_bits(wp.uint32(i))
    for k in range(samples):
        place = random_pair(pixel, 0, wp.uint32(k))
        x = float(i % view.width) + place[0]
        y = float(i / view.width) + place[1]
        d = unit(view.R_world_camera @ pixel_direction(view, x, y))
        hit = first_met(world, view.eye_m + d * Z_NEAR_M, d, AT_INFINITY, HOLES)
        if hit.at[0] < 0:
            colors += wp.vec3(1.0, 1.0, 1.0)
        else:
            v = vertex_of(world, hit, d, 0.0)
            colors += v.look.albedo
            normals += v.look.normal
    albedo[i] = colors * (1.0 / float(samples))
    normal[i] = normals * (1.0 / float(samples))
