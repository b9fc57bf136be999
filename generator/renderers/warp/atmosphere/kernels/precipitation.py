"""Falling rain and snow."""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels.fog import phase_function
from gen_data.renderers.warp.scene.kernels import analytic_lights, environment_lighting
from gen_data.renderers.warp.scene.kernels.records import View, World, fast_normalize, floor_int

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.struct
class Streak:
    """Motion-blurred image of one particle.

    Attributes:
        start_px, end_px: Ends of its axis.
        radius_px: Half its width, at least half a pixel.
        opacity: Share of the background that it hides, averaged over the exposure.
        z_m: Depth.
        p_m: Position in the world.
        radiance: Radiance towards the camera [cd/m^2]; written by ``light_streaks``.
    """

    start_px: wp.vec2
    end_px: wp.vec2
    radius_px: float
    opacity: float
    z_m: float
    p_m: wp.vec3
    radiance: wp.vec3


@wp.kernel
def light_streaks(view: View, world: World, streaks: wp.array[Streak]):
    """Radiance of particles towards the camera: ambient light and light of lamps."""
    k = wp.tid()
    p = streaks[k].p_m
    d = fast_normalize(p - view.eye_m)
    # The mean of the sphere and of the upper hemisphere: drops refract light from all around, most
    # of it from above.
    mean = world.sky.irradiance[0] * world.sky.luminance
    c = (mean + environment_lighting.sky_irradiance(world.sky, wp.vec3(0.0, 0.0, 1.0))) * 0.5
    for j in range(world.lamps.shape[0]):
        beam = analytic_lights.beam_from(world.lamps[j], p)
        c += beam.normal_lux * phase_function(wp.dot(d, beam.direction))
    streaks[k].radiance = c


@wp.kernel
def draw_streaks(
    width: int,
    z_m: wp.array[float],
    streaks: wp.array[Streak],
    first: wp.array[int],
    listed: wp.array[int],
    radiance: wp.array[wp.vec3],
):
    """Blend particles over each row of the image where no surface is nearer.

    Args:
        first: First entry of each row in ``listed``, and the end of the last row.
        listed: Numbers of streaks, distant ones first.
    """
    y = wp.tid()
    # Distant streaks first: nearer ones are blended over them.
    for k in range(first[y], first[y + 1]):
        s = listed[k]
        a = streaks[s].start_px
        along = streaks[s].end_px - a
        radius = streaks[s].radius_px
        squared = wp.max(wp.dot(along, along), 1.0e-6)
        low = wp.min(a[0], a[0] + along[0]) - radius - 0.5
        high = wp.max(a[0], a[0] + along[0]) + radius + 0.5
        for x in range(wp.max(floor_int(low), 0), wp.min(floor_int(high) + 1, width)):
            q = wp.vec2(float(x) + 0.5, float(y) + 0.5) - a
            # Distance to the streak's axis; one pixel of ramp antialiases its edge.
            t = wp.clamp(wp.dot(q, along) / squared, 0.0, 1.0)
            away = wp.length(q - along * t)
            cover = wp.clamp(radius + 0.5 - away, 0.0, 1.0) * streaks[s].opacity
            i = y * width + x
            if cover > 0.0 and streaks[s].z_m < z_m[i]:
                radiance[i] = radiance[i] * (1.0 - cover) + streaks[s].radiance * cover
