"""Rain and snow in the air, and drops on the lens."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.ground import lumps, smooth
from generator.renderers.kernels.lighting import beam_from
from generator.renderers.kernels.records import View, World, floor_int, unit
from generator.renderers.kernels.sky import sky_irradiance
from generator.renderers.kernels.weather import scattering

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.struct
class Streak:
    """The trace of one particle during the exposure, in the image.

    Attributes:
        start_px, end_px: Ends of its axis.
        radius_px: Half its width, at least half a pixel.
        opacity: Part of the background that it hides, in the mean over the exposure.
        z_m: Depth.
        p_m: Where it is, world.
        radiance: What it shines with [cd/m^2]; filled in by ``light_streaks``.
    """

    start_px: wp.vec2
    end_px: wp.vec2
    radius_px: float
    opacity: float
    z_m: float
    p_m: wp.vec3
    radiance: wp.vec3


@wp.kernel
def light_streaks(view: View, world: World, streaks: wp.array(dtype=Streak)):
    """Light that particles send to the camera: the sky's from all sides, and that of lamps."""
    k = wp.tid()
    p = streaks[k].p_m
    d = unit(p - view.eye_m)
    mean = world.sky.irradiance[0] * world.sky.luminance
    c = (mean + sky_irradiance(world.sky, wp.vec3(0.0, 0.0, 1.0))) * 0.5
    for j in range(world.lamps.shape[0]):
        beam = beam_from(world.lamps[j], p)
        c += beam.normal_lux * scattering(wp.dot(d, beam.direction))
    streaks[k].radiance = c


@wp.kernel
def draw_streaks(
    width: int,
    z_m: wp.array(dtype=float),
    streaks: wp.array(dtype=Streak),
    first: wp.array(dtype=int),
    listed: wp.array(dtype=int),
    radiance: wp.array(dtype=wp.vec3),
):
    """Lay particles over each row of the image, where nothing nearer hides them.

    Args:
        first: Where each row's list begins, and the end of the last.
        listed: Numbers of streaks, far ones first.
    """
    y = wp.tid()
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
            t = wp.clamp(wp.dot(q, along) / squared, 0.0, 1.0)
            away = wp.length(q - along * t)
            cover = wp.clamp(radius + 0.5 - away, 0.0, 1.0) * streaks[s].opacity
            i = y * width + x
            if cover > 0.0 and streaks[s].z_m < z_m[i]:
                radiance[i] = radiance[i] * (1.0 - cover) + streaks[s].radiance * cover


@wp.func
def blurred_at(image: wp.array(dtype=wp.vec3, ndim=2), x: float, y: float):
    """A small image at a place in [0, 1] x [0, 1], bilinear."""
    u = wp.clamp(x, 0.0, 1.0) * float(image.shape[1] - 1)
    v = wp.clamp(y, 0.0, 1.0) * float(image.shape[0] - 1)
    i = wp.min(int(v), image.shape[0] - 2)
    j = wp.min(int(u), image.shape[1] - 2)
    fu = u - float(j)
    fv = v - float(i)
    top = image[i, j] * (1.0 - fu) + image[i, j + 1] * fu
    bottom = image[i + 1, j] * (1.0 - fu) + image[i + 1, j + 1] * fu
    return top * (1.0 - fv) + bottom * fv


@wp.kernel
def refract_in_drops(
    width: int,
    height: int,
    drops: wp.array(dtype=wp.vec4),
    image: wp.array(dtype=wp.vec3, ndim=2),
    radiance: wp.array(dtype=wp.vec3),
):
    """Show the scene small, upside down and blurred in each drop on the lens.

    Args:
        drops: Centre and radius [px], and a number that shapes the outline.
        image: The scene, small and blurred.
    """
    i = wp.tid()
    x = float(i % width) + 0.5
    y = float(i / width) + 0.5
    for k in range(drops.shape[0]):
        drop = drops[k]
        ox = (x - drop[0]) / drop[2]
        oy = (y - drop[1]) / drop[2]
        if wp.abs(ox) < 1.4 and wp.abs(oy) < 1.4:
            seed = int(drop[3])
            # Outlines wobble; drops hang a little.
            wobble = 1.0 + 0.22 * lumps(1.3 * ox + 7.0, 1.3 * oy + 7.0, seed)
            off = wp.sqrt(ox * ox + 0.8 * oy * oy) * wobble
            cover = smooth(1.0, 0.78, off)
            if cover > 0.0:
                # A drop is a lens of some ninety degrees; towards its rim it bends more.
                bend = 0.30 + 0.12 * off * off
                u = 0.5 + 0.5 * (drop[0] / float(width) - 0.5) - bend * ox
                v = 0.5 + 0.5 * (drop[1] / float(height) - 0.5) - bend * oy
                rim = 1.0 - 0.55 * smooth(0.55, 1.0, off)
                seen = blurred_at(image, u, v) * rim
                radiance[i] = radiance[i] * (1.0 - cover) + seen * cover


@wp.struct
class Between:
    """Two neighbours of a coarse image in one direction, and the share of the second."""

    first: int
    after: int
    part: float


@wp.func
def between(i: int, factor: int, count: int):
    """Where pixel i of an image lies in one that is coarser by a factor, of ``count`` pixels."""
    place = (float(i) + 0.5) / float(factor) - 0.5
    place = wp.clamp(place, 0.0, float(count - 1))
    at = Between()
    at.first = wp.min(int(place), wp.max(count - 2, 0))
    at.after = wp.min(at.first + 1, count - 1)
    at.part = place - float(at.first)
    return at


@wp.kernel
def mix_coarse(
    veil: wp.array(dtype=wp.vec3, ndim=2),
    factor: int,
    width: int,
    weight: float,
    share: float,
    radiance: wp.array(dtype=wp.vec3),
):
    """Give a share of the light to a coarser image, bilinearly enlarged and weighted."""
    i = wp.tid()
    row = between(i / width, factor, veil.shape[0])
    column = between(i % width, factor, veil.shape[1])
    left = veil[row.first, column.first] * (1.0 - row.part)
    left += veil[row.after, column.first] * row.part
    right = veil[row.first, column.after] * (1.0 - row.part)
    right += veil[row.after, column.after] * row.part
    light = (left * (1.0 - column.part) + right * column.part) * weight
    radiance[i] = radiance[i] * (1.0 - share) + light * share
