"""What weather does to what is seen: shelter from it, water that mirrors, fog.

Sources: Koschmieder, "Theorie der horizontalen Sichtweite", 1924 (Beer and Lambert's law with
airlight); Henyey and Greenstein, Astrophysical Journal 93, 1941 (forward scattering); Kulla and
Fajardo, "Importance sampling techniques for path tracing in participating media", EGSR 2012
(equiangular points on a ray that passes a lamp).
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.ground import (
    lumps,
    patches,
    porosity_of,
    puddle_at,
    snow_at,
)
from generator.renderers.kernels.lattice import ray_origin
from generator.renderers.kernels.lighting import SUN, beam_from
from generator.renderers.kernels.rays import blocked, path_along
from generator.renderers.kernels.records import (
    Lamp,
    View,
    World,
    pixel_direction,
    surface_index,
    to_mesh_point,
    to_mesh_vector,
    unit,
)
from generator.renderers.kernels.shade import Images
from generator.renderers.kernels.sky import sky_image, sky_irradiance
from generator.renderers.kernels.texturing import sampler_of, texel_at

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# What is lower than this over a surface keeps rain and snow off it.
SHELTER_M = wp.constant(2.5)
# Fresnel reflectance of water at normal incidence.
WATER_F0 = wp.constant(0.02)
# Asymmetry of scattering by fog.
FORWARD = wp.constant(0.75)
# Films smoother than this mirror like puddles.
SHARP = wp.constant(0.02)
LAMP_POINTS = wp.constant(4)
GOLDEN_ANGLE = wp.constant(2.39996323)
GLOW_STRIDE = wp.constant(4)
GLOW_REACH_M = wp.constant(300.0)
FAR_M = wp.constant(1.0e9)


@wp.kernel
def find_shelter(view: View, world: World, images: Images, exposed: wp.array(dtype=float)):
    """Share of what falls that reaches each pixel's point: a ray straight up, a little astray."""
    i = wp.tid()
    exposed[i] = 1.0
    hit = images.hits[i]
    if hit[0] < 0:
        return
    n = images.normals[i]
    if n[2] <= 0.1:
        return
    d = view.R_world_camera @ pixel_direction(
        view, float(i % view.width) + 0.5, float(i / view.width) + 0.5
    )
    offset = d * images.z_m[i]
    origin = ray_origin(world, hit, images.weights[i], view.eye_m + offset, offset)
    east = 0.35 * lumps(origin[0] * 5.0, origin[1] * 5.0, 7)
    north = 0.35 * lumps(origin[0] * 5.0, origin[1] * 5.0, 8)
    if blocked(world, path_along(origin, wp.vec3(east, north, 1.0) * SHELTER_M)):
        exposed[i] = 0.0


@wp.func
def water_at(world: World, surface: int, p: wp.vec3, n: wp.vec3, exposed: float):
    """How much of a point is a mirror of water, and how rough that mirror is."""
    porous = porosity_of(world, surface)
    puddle = puddle_at(world, p, n, exposed) * porous
    film = world.ground.wetness * wp.clamp(n[2], 0.0, 1.0) * exposed * porous
    # A film follows the grain of the ground: half of it mirrors, and not sharply.
    share = wp.max(puddle, 0.5 * film) * (1.0 - snow_at(world, p, n, exposed))
    return wp.vec2(share, 0.16 * (1.0 - puddle) * (1.0 - puddle))


@wp.func
def mean_color(world: World, surface: int):
    """A material's colour without the detail of its texture."""
    color = world.surfaces[surface].base_color
    texture = world.surfaces[surface].texture
    if texture >= 0:
        coarsest = sampler_of(world, texture, 30.0)
        color = wp.cw_mul(color, texel_at(world, texture, coarsest, 0.5, 0.5, False).albedo)
    return color


@wp.func
def mirrored_sky(world: World, d: wp.vec3, width: float):
    """Sky in one direction, with the suns that are blurred over an angle."""
    c = sky_image(world.sky, d)
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind == SUN:
            away = wp.max(1.0 - wp.dot(d, -world.lamps[j].direction), 0.0)
            spread = 0.5 * (width * width + world.lamps[j].radius * world.lamps[j].radius)
            c += world.lamps[j].power * (wp.exp(-away / spread) / (2.0 * wp.pi * spread))
    return c


@wp.func
def mirrored_body(
    view: View,
    world: World,
    images: Images,
    radiance: wp.array(dtype=wp.vec3),
    origin: wp.vec3,
    d: wp.vec3,
    t: float,
    hit: wp.vec2i,
    normal: wp.vec3,
):
    """Light of what a mirrored ray meets: as the image shows it, else without shadows."""
    p = origin + d * t
    q = wp.transpose(view.R_world_camera) @ (p - view.eye_m)
    c = wp.vec3(-1.0)
    if q[2] > 0.05:
        x = int(q[0] / q[2] * view.fx + view.cx)
        y = int(q[1] / q[2] * view.fy + view.cy)
        if x >= 0 and x < view.width and y >= 0 and y < view.height:
            j = y * view.width + x
            if images.hits[j][0] == hit[0] and wp.abs(images.z_m[j] - q[2]) < 0.05 + 0.02 * q[2]:
                c = radiance[j]
    if c[0] < 0.0:
        surface = surface_index(world, hit)
        n = normal
        if wp.dot(n, d) > 0.0:
            n = -n
        light = sky_irradiance(world.sky, n) * 0.7
        for j in range(world.lamps.shape[0]):
            beam = beam_from(world.lamps[j], p)
            light += beam.normal_lux * (wp.max(wp.dot(n, beam.direction), 0.0) / wp.pi)
        c = wp.cw_mul(light, mean_color(world, surface)) + world.surfaces[surface].emission_cd_m2
    return c


@wp.func
def mirrored(
    view: View,
    world: World,
    images: Images,
    radiance: wp.array(dtype=wp.vec3),
    origin: wp.vec3,
    d: wp.vec3,
    width: float,
):
    """Radiance along a mirrored ray."""
    nearest = float(1.0e3)
    hit = wp.vec2i(-1, -1)
    normal = wp.vec3(0.0)
    candidates = wp.bvh_query_ray(world.tree, origin, d)
    b = int(0)
    while wp.bvh_query_next(candidates, b, nearest):
        mesh = world.geometries[world.bodies[b].geometry].mesh
        o = to_mesh_point(world, b, origin)
        answer = wp.mesh_query_ray(mesh, o, to_mesh_vector(world, b, d), nearest)
        if answer.result:
            nearest = answer.t
            hit = wp.vec2i(b, answer.face)
            normal = world.bodies[b].R_world_mesh @ answer.normal
    if hit[0] < 0:
        return mirrored_sky(world, d, width)
    return mirrored_body(view, world, images, radiance, origin, d, nearest, hit, normal)


@wp.kernel
def mirror_in_water(
    view: View,
    world: World,
    images: Images,
    radiance: wp.array(dtype=wp.vec3),
    ripples: float,
    water: wp.array(dtype=wp.vec2),
    mirror: wp.array(dtype=wp.vec4),
):
    """Trace what water on the ground mirrors.

    Args:
        ripples: Slope of waves on puddles.
        water: Share of each pixel that is water, and how rough it is.
        mirror: What it mirrors [cd/m^2], and its reflectance, for a pixel all of water.
    """
    i = wp.tid()
    water[i] = wp.vec2(0.0)
    hit = images.hits[i]
    if hit[0] < 0:
        return
    n = images.normals[i]
    if n[2] < 0.5:
        return
    x = i % view.width
    y = i / view.width
    d = view.R_world_camera @ pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    way = d * images.z_m[i]
    p = view.eye_m + way
    wet = water_at(world, surface_index(world, hit), p, n, world.ground.exposed[i])
    if wet[0] < 0.01:
        return
    water[i] = wet
    d = unit(d)
    origin = ray_origin(world, hit, images.weights[i], p, way)
    # Waves finer than a pixel would flicker from pixel to pixel.
    slope = ripples * wp.min(5.0 / images.z_m[i], 1.0)
    tilt_x = patches(p[0], p[1], 0.09, world.ground.seed + 48) * slope
    tilt_y = patches(p[0], p[1], 0.09, world.ground.seed + 52) * slope
    if wet[1] > SHARP:
        # The pixels of any square of eight share one even spread of slopes, neighbours far from
        # each other in it.
        place = float(((x % 8) * 24 + (y % 8) * 19) % 64) + 0.5
        rough = wet[1] * wp.sqrt(place / 64.0)
        tilt_x += rough * wp.cos(GOLDEN_ANGLE * place)
        tilt_y += rough * wp.sin(GOLDEN_ANGLE * place)
    m = unit(n + wp.vec3(tilt_x, tilt_y, 0.0))
    c = wp.max(-wp.dot(d, m), 0.02)
    r = d + m * (2.0 * c)
    r = unit(wp.vec3(r[0], r[1], wp.max(r[2], 0.02)))
    grazing = 1.0 - c
    squared = grazing * grazing
    fresnel = WATER_F0 + (1.0 - WATER_F0) * squared * squared * grazing
    seen = mirrored(view, world, images, radiance, origin, r, 0.02 + wet[1])
    if wet[1] > SHARP:
        # One ray per pixel does not find small bright lamps evenly; their lobes are shaded already.
        limit = 100.0 * wp.max(radiance[i])
        limit += 4.0 * wp.max(world.sky.irradiance[0]) * world.sky.luminance
        seen = seen * wp.min(limit / wp.max(wp.max(seen), 1.0e-9), 1.0)
    seen = seen * fresnel
    mirror[i] = wp.vec4(seen[0], seen[1], seen[2], fresnel)


@wp.func
def film_around(
    view: View,
    images: Images,
    water: wp.array(dtype=wp.vec2),
    mirror: wp.array(dtype=wp.vec4),
    i: int,
):
    """What the rough film around a pixel mirrors, in the mean over eight by eight pixels."""
    x = i % view.width
    y = i / view.width
    total = mirror[i] * 1.0e-3
    weights = float(1.0e-3)
    for dy in range(-4, 5):
        for dx in range(-4, 5):
            u = x + dx
            v = y + dy
            if u >= 0 and u < view.width and v >= 0 and v < view.height:
                j = v * view.width + u
                near = wp.abs(images.z_m[j] - images.z_m[i]) < 0.15 * images.z_m[i]
                if near and water[j][1] > SHARP:
                    # Halves at the ends: every place of a square of eight counts alike.
                    w = wp.where(wp.abs(dx) == 4, 0.5, 1.0) * wp.where(wp.abs(dy) == 4, 0.5, 1.0)
                    total += mirror[j] * w
                    weights += w
    return total * (1.0 / weights)


@wp.kernel
def lay_water(
    view: View,
    images: Images,
    water: wp.array(dtype=wp.vec2),
    mirror: wp.array(dtype=wp.vec4),
    radiance: wp.array(dtype=wp.vec3),
):
    """Lay what water mirrors over what is seen."""
    i = wp.tid()
    share = water[i][0]
    if share == 0.0:
        return
    seen = mirror[i]
    if water[i][1] > SHARP:
        seen = film_around(view, images, water, mirror, i)
    seen = seen * share
    radiance[i] = radiance[i] * (1.0 - seen[3]) + wp.vec3(seen[0], seen[1], seen[2])


@wp.struct
class Fog:
    """Fog of a scene.

    Attributes:
        extinction_per_m: At height 0.
        height_m: Over which it thins by a factor of e; 0 = evenly thick.
    """

    extinction_per_m: float
    height_m: float


@wp.func
def optical_depth(fog: Fog, z_m: float, up: float, distance_m: float):
    """Extinction summed along a way that starts at height z and rises by ``up`` per metre."""
    if fog.height_m <= 0.0:
        return fog.extinction_per_m * distance_m
    s = up / fog.height_m
    x = s * distance_m
    # (1 - exp(-x)) / s, and its limit on level ways.
    way_m = distance_m * (1.0 - 0.5 * x)
    if wp.abs(x) > 1.0e-3:
        way_m = (1.0 - wp.exp(wp.clamp(-x, -60.0, 60.0))) / s
    return fog.extinction_per_m * wp.exp(-z_m / fog.height_m) * way_m


@wp.func
def scattering(cosine: float):
    """Part of the light scattered per steradian at an angle; Henyey and Greenstein."""
    g = FORWARD
    q = 1.0 + g * g - 2.0 * g * cosine
    return (1.0 - g * g) / (4.0 * wp.pi * q * wp.sqrt(q))


@wp.func
def glow_of_lamp(fog: Fog, lamp: Lamp, eye: wp.vec3, d: wp.vec3, distance_m: float):
    """Light of one lamp that the fog along a ray sends to the eye, without shadows."""
    nearest_m = wp.dot(lamp.position_m - eye, d)
    off = lamp.position_m - eye - d * nearest_m
    apart_m = wp.max(wp.length(off), wp.max(lamp.radius, 0.05))
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
        part = local * wp.exp(-depth) * scattering(wp.dot(d, beam.direction)) * squared
        total += beam.normal_lux * part
    return total * ((end - start) / (apart_m * float(LAMP_POINTS)))


@wp.func
def seen_distance(images: Images, i: int, length: float):
    """Distance to what pixel i sees [m]; FAR_M for nothing."""
    distance_m = float(FAR_M)
    if images.hits[i][0] >= 0:
        distance_m = images.z_m[i] * length
    return distance_m


@wp.func
def glow_along(view: View, world: World, images: Images, fog: Fog, i: int):
    """Light of all lamps that the fog before pixel i scatters to the camera."""
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    length = wp.length(d)
    reach_m = wp.min(seen_distance(images, i, length), GLOW_REACH_M)
    glow = wp.vec3(0.0)
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind != SUN:
            glow += glow_of_lamp(fog, world.lamps[j], view.eye_m, d * (1.0 / length), reach_m)
    return glow


@wp.kernel
def glow_at_points(
    view: View, world: World, images: Images, fog: Fog, columns: int, glow: wp.array(dtype=wp.vec3)
):
    """The glow of lamps at every few pixels of every few rows."""
    k = wp.tid()
    x = wp.min((k % columns) * GLOW_STRIDE, view.width - 1)
    y = wp.min((k / columns) * GLOW_STRIDE, view.height - 1)
    glow[k] = glow_along(view, world, images, fog, y * view.width + x)


@wp.func
def glow_between(
    view: View,
    world: World,
    images: Images,
    fog: Fog,
    columns: int,
    glow: wp.array(dtype=wp.vec3),
    i: int,
):
    """The glow at pixel i, from the points around it, or by itself where depths differ."""
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
    images: Images,
    fog: Fog,
    columns: int,
    glow: wp.array(dtype=wp.vec3),
    radiance: wp.array(dtype=wp.vec3),
):
    """Dim every pixel by the fog before it, and add the light that the fog scatters.

    Args:
        columns: Points of the glow in a row; 0 = no lamp glows.
        glow: Of lamps, at those points.
    """
    i = wp.tid()
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    length = wp.length(d)
    distance_m = seen_distance(images, i, length)
    d = d * (1.0 / length)
    clear = wp.exp(-wp.min(optical_depth(fog, view.eye_m[2], d[2], distance_m), 80.0))
    # The mean over the sphere: the first coefficient of irradiance.
    air = world.sky.irradiance[0] * world.sky.luminance
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind == SUN:
            air += world.lamps[j].power * scattering(-wp.dot(d, world.lamps[j].direction))
    lit = radiance[i] * clear + air * (1.0 - clear)
    if columns > 0:
        lit += glow_between(view, world, images, fog, columns, glow, i)
    radiance[i] = lit
