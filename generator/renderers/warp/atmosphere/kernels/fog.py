"""Fog, and the glow of lamps in it.

Sources: Koschmieder, "Theorie der horizontalen Sichtweite", 1924 (Beer and Lambert's law with
airlight); Henyey and Greenstein, Astrophysical Journal 93, 1941 (forward scattering); Kulla and
Fajardo, "Importance sampling techniques for path tracing in participating media", EGSR 2012
(equiangular points on a ray that passes a lamp).
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels.analytic_lights import SUN, beam_from
from gen_data.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    LightRecord,
    View,
    World,
    pixel_ray,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Asymmetry parameter of the phase function of fog droplets.
FORWARD = wp.constant(0.75)
# Equiangular samples per ray and lamp.
LAMP_POINTS = wp.constant(4)
# The glow varies slowly: it is computed at every fourth pixel of every fourth row.
GLOW_STRIDE = wp.constant(4)
GLOW_REACH_M = wp.constant(300.0)
FAR_M = wp.constant(1.0e9)


@wp.struct
class Fog:
    """Fog of a scene.

    Attributes:
        extinction_per_m: Extinction coefficient at height 0.
        height_m: Scale height, over which density falls by a factor of e; 0 for homogeneous fog.
    """

    extinction_per_m: float
    height_m: float


@wp.func
def optical_depth(fog: Fog, z_m: float, up: float, distance_m: float):
    """Optical depth of a segment that starts at height z and rises by ``up`` per metre."""
    if fog.height_m <= 0.0:
        return fog.extinction_per_m * distance_m
    s = up / fog.height_m
    x = s * distance_m
    # (1 - exp(-x)) / s, or its series for level rays, where it would be 0 / 0.
    way_m = distance_m * (1.0 - 0.5 * x)
    if wp.abs(x) > 1.0e-3:
        way_m = (1.0 - wp.exp(wp.clamp(-x, -60.0, 60.0))) / s
    return fog.extinction_per_m * wp.exp(-z_m / fog.height_m) * way_m


@wp.func
def phase_function(cosine: float):
    """Henyey-Greenstein phase function [1/sr] of the cosine of the scattering angle."""
    g = FORWARD
    q = 1.0 + g * g - 2.0 * g * cosine
    return (1.0 - g * g) / (4.0 * wp.pi * q * wp.sqrt(q))


@wp.func
def lamp_glow(fog: Fog, lamp: LightRecord, eye: wp.vec3, d: wp.vec3, distance_m: float):
    """In-scattered light of one lamp along a ray, without shadows [cd/m^2]."""
    nearest_m = wp.dot(lamp.position_m - eye, d)
    off = lamp.position_m - eye - d * nearest_m
    apart_m = wp.max(wp.length(off), wp.max(lamp.radius, 0.05))
    # Angles at the lamp between the ray's ends and its nearest point (Kulla and Fajardo 2012).
    start = wp.atan2(-nearest_m, apart_m)
    end = wp.atan2(distance_m - nearest_m, apart_m)
    total = wp.vec3(0.0)
    for k in range(LAMP_POINTS):
        angle = start + (end - start) * (float(k) + 0.5) / float(LAMP_POINTS)
        t = nearest_m + apart_m * wp.tan(angle)
        p = eye + d * t
        beam = beam_from(lamp, p)
        depth = optical_depth(fog, eye[2], d[2], t)
        depth += fog.extinction_per_m * beam.distance_m
        local = fog.extinction_per_m
        if fog.height_m > 0.0:
            local = local * wp.exp(-p[2] / fog.height_m)
        # The equiangular density cancels the inverse square of the distance.
        squared = apart_m * apart_m + (t - nearest_m) * (t - nearest_m)
        part = local * wp.exp(-depth) * phase_function(wp.dot(d, beam.direction)) * squared
        total += beam.normal_lux * part
    return total * ((end - start) / (apart_m * float(LAMP_POINTS)))


@wp.func
def seen_distance(images: GBufferRecord, i: int, length: float):
    """Distance to the surface at pixel i [m]; FAR_M for none."""
    distance_m = float(FAR_M)
    if images.hits[i][0] >= 0:
        distance_m = images.z_m[i] * length
    return distance_m


@wp.func
def glow_along(view: View, world: World, images: GBufferRecord, fog: Fog, i: int):
    """In-scattered light of all lamps along the ray of pixel i [cd/m^2]."""
    d = pixel_ray(view, i)
    length = wp.length(d)
    reach_m = wp.min(seen_distance(images, i, length), GLOW_REACH_M)
    glow = wp.vec3(0.0)
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind != SUN:
            glow += lamp_glow(fog, world.lamps[j], view.eye_m, d * (1.0 / length), reach_m)
    return glow


@wp.kernel
def glow_at_points(
    view: View, world: World, images: GBufferRecord, fog: Fog, columns: int, glow: wp.array[wp.vec3]
):
    """The glow of lamps at the points of a sparse grid."""
    k = wp.tid()
    x = wp.min((k % columns) * GLOW_STRIDE, view.width - 1)
    y = wp.min((k / columns) * GLOW_STRIDE, view.height - 1)
    glow[k] = glow_along(view, world, images, fog, y * view.width + x)


@wp.func
def glow_between(
    view: View,
    world: World,
    images: GBufferRecord,
    fog: Fog,
    columns: int,
    glow: wp.array[wp.vec3],
    i: int,
):
    """The glow at pixel i, interpolated from the grid; computed directly where depths differ."""
    x = i % view.width
    y = i / view.width
    column = x / GLOW_STRIDE
    row = y / GLOW_STRIDE
    right = float(x - column * GLOW_STRIDE) / float(GLOW_STRIDE)
    down = float(y - row * GLOW_STRIDE) / float(GLOW_STRIDE)
    z_m = wp.min(images.z_m[i], GLOW_REACH_M)
    total = wp.vec3(0.0)
    alike = bool(True)
    for k in range(4):
        u = column + (k & 1)
        v = row + k / 2
        j = wp.min(v * GLOW_STRIDE, view.height - 1) * view.width
        j += wp.min(u * GLOW_STRIDE, view.width - 1)
        # Across a depth edge the length of fog differs: interpolation would leave a halo.
        if wp.abs(wp.min(images.z_m[j], GLOW_REACH_M) - z_m) > 0.1 * z_m:
            alike = False
        w = wp.where((k & 1) == 1, right, 1.0 - right) * wp.where(k >= 2, down, 1.0 - down)
        total += glow[v * columns + u] * w
    if not alike:
        total = glow_along(view, world, images, fog, i)
    return total


@wp.kernel
def fill_with_fog(
    view: View,
    world: World,
    images: GBufferRecord,
    fog: Fog,
    columns: int,
    glow: wp.array[wp.vec3],
    radiance: wp.array[wp.vec3],
):
    """Attenuate every pixel by fog and add the fog's in-scattered light.

    Args:
        columns: Points of the grid in a row; 0 without any lamp.
        glow: Glow at those points.
    """
    i = wp.tid()
    d = pixel_ray(view, i)
    length = wp.length(d)
    distance_m = seen_distance(images, i, length)
    d = d * (1.0 / length)
    # Bounded: nothing remains visible beyond an optical depth of 80.
    clear = wp.exp(-wp.min(optical_depth(fog, view.eye_m[2], d[2], distance_m), 80.0))
    # The first coefficient of irradiance is the mean over the sphere: fog scatters from everywhere.
    air = world.sky.irradiance[0] * world.sky.luminance
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind == SUN:
            air += world.lamps[j].power * phase_function(-wp.dot(d, world.lamps[j].direction))
    lit = radiance[i] * clear + air * (1.0 - clear)
    if columns > 0:
        lit += glow_between(view, world, images, fog, columns, glow, i)
    radiance[i] = lit
