"""Reflections in water on the ground: blurred in films, sharp in puddles.

Films vary slowly over the image: their reflections are traced from lattice points and averaged
around each. Puddles are traced pixel by pixel.
"""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels import ground_weathering
from gen_data.renderers.warp.scene.kernels import analytic_lights, brdf, distortion
from gen_data.renderers.warp.scene.kernels.environment_lighting import sky_irradiance, sky_rest
from gen_data.renderers.warp.scene.kernels.lattice import (
    Lattice,
    cell_at,
    cell_corner,
    ray_origin,
)
from gen_data.renderers.warp.scene.kernels.ray_queries import closest_hit, precipitation_exposure
from gen_data.renderers.warp.scene.kernels.records import (
    HOLES,
    GBufferRecord,
    View,
    World,
    fast_normalize,
    flat_normal,
    pixel_ray,
    surface_index,
)
from gen_data.renderers.warp.scene.kernels.texture_sampling import make_sampler, texel_at

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Length of reflected rays.
MIRRORED_M = wp.constant(1.0e3)

# Smoother films are traced like puddles.
SHARP = wp.constant(0.02)
# Spread of a film's slopes on rough ground.
FILM_SLOPE = wp.constant(0.16)
# Golden angle, pi (3 - sqrt(5)): a spiral with this step covers a disk evenly (Vogel 1979).
GOLDEN_ANGLE = wp.constant(2.39996323)
# Points closer than this share their exposure.
BESIDE_M = wp.constant(0.12)
# Points to either side over which films are averaged: a whole period of the pattern of slopes.
FILM_REACH = wp.constant(8)


@wp.kernel
def probe_exposure(world: World, lattice: Lattice, exposed: wp.array[float]):
    """Exposure of each lattice point to precipitation, by one ray each."""
    k = wp.tid()
    exposed[k] = 1.0
    if lattice.body[k] >= 0 and lattice.normal[k][2] > 0.1:
        exposed[k] = precipitation_exposure(world, lattice.body[k], lattice.origin_m[k])


@wp.kernel
def average_exposure(lattice: Lattice, probed: wp.array[float], exposed: wp.array[float]):
    """Mean of probe_exposure over nearby points on the same material."""
    k = wp.tid()
    column = k % lattice.width
    row = k / lattice.width
    total = probed[k]
    weights = float(1.0)
    if lattice.body[k] >= 0:
        for v in range(wp.max(row - 1, 0), wp.min(row + 2, lattice.height)):
            for u in range(wp.max(column - 2, 0), wp.min(column + 3, lattice.width)):
                q = v * lattice.width + u
                if lattice.surface[q] == lattice.surface[k]:
                    off = lattice.p_m[q] - lattice.p_m[k]
                    if wp.dot(off, off) < BESIDE_M * BESIDE_M:
                        total += probed[q]
                        weights += 1.0
    exposed[k] = total / weights


@wp.func
def water_at(
    world: World, surface: int, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float
):
    """Share of a point that reflects as water, and the roughness of that water."""
    # Water runs off slopes above 60 degrees.
    if n[2] < 0.5:
        return wp.vec2(0.0)
    porous = ground_weathering.estimate_porosity(world, surface)
    puddle = ground_weathering.puddle_at(world, surface, p, n, exposed, footprint_m) * porous
    film = world.ground.wetness * wp.clamp(n[2], 0.0, 1.0) * exposed * porous
    # A film follows the grain of the ground: half of it reflects, and not sharply.
    share = wp.max(puddle, 0.5 * film) * (
        1.0 - ground_weathering.snow_at(world, p, n, exposed, footprint_m)
    )
    return wp.vec2(share, FILM_SLOPE * (1.0 - puddle) * (1.0 - puddle))


@wp.func
def mean_color(world: World, surface: int):
    """A material's mean colour, without the detail of its texture."""
    color = world.surfaces[surface].base_color
    texture = world.surfaces[surface].texture
    if texture >= 0:
        # Beyond the last level of any texture: its mean.
        coarsest = make_sampler(world, texture, 30.0)
        color = wp.cw_mul(color, texel_at(world, texture, coarsest, 0.5, 0.5, False).albedo)
    return color


@wp.func
def reflected_sky(world: World, d: wp.vec3, width: float):
    """Radiance of the sky in one direction, with suns blurred by an angle."""
    c = sky_rest(world.sky, d)
    for j in range(world.lamps.shape[0]):
        if world.lamps[j].kind == analytic_lights.SUN:
            # Gaussian in the angle: 1 - cos is half its square; blur and sun add in quadrature.
            away = wp.max(1.0 - wp.dot(d, -world.lamps[j].direction), 0.0)
            spread = 0.5 * (width * width + world.lamps[j].radius * world.lamps[j].radius)
            c += world.lamps[j].power * (wp.exp(-away / spread) / (2.0 * wp.pi * spread))
    return c


@wp.func
def reflected_surface(
    view: View,
    world: World,
    images: GBufferRecord,
    radiance: wp.array[wp.vec3],
    origin: wp.vec3,
    d: wp.vec3,
    t: float,
    hit: wp.vec2i,
    normal: wp.vec3,
):
    """Radiance of a surface that a reflected ray hits: from the image, else without shadows."""
    p = origin + d * t
    q = wp.transpose(view.R_world_camera) @ (p - view.eye_m)
    c = wp.vec3(-1.0)
    j, depth_m = distortion.project_to_pixel(view, q)
    if j >= 0:
        # The image shows that very point: same body, same depth.
        if images.hits[j][0] == hit[0] and wp.abs(images.z_m[j] - depth_m) < 0.05 + 0.02 * depth_m:
            c = radiance[j]
    if c[0] < 0.0:
        surface = surface_index(world, hit)
        n = normal
        if wp.dot(n, d) > 0.0:
            n = -n
        # Outside the image or hidden in it: 0.7 stands for average ambient occlusion.
        light = sky_irradiance(world.sky, n) * 0.7
        for j in range(world.lamps.shape[0]):
            beam = analytic_lights.beam_from(world.lamps[j], p)
            light += beam.normal_lux * (wp.max(wp.dot(n, beam.direction), 0.0) / wp.pi)
        c = wp.cw_mul(light, mean_color(world, surface)) + world.surfaces[surface].emission_cd_m2
    return c


@wp.func
def reflected_radiance(
    view: View,
    world: World,
    images: GBufferRecord,
    radiance: wp.array[wp.vec3],
    origin: wp.vec3,
    d: wp.vec3,
    width: float,
):
    """Radiance along a reflected ray."""
    m = closest_hit(world, origin, d, MIRRORED_M, HOLES)
    if m.at[0] < 0:
        return reflected_sky(world, d, width)
    normal = flat_normal(world, m.at)
    return reflected_surface(view, world, images, radiance, origin, d, m.t, m.at, normal)


@wp.func
def facet_reflection(
    view: View,
    world: World,
    images: GBufferRecord,
    radiance: wp.array[wp.vec3],
    p: wp.vec3,
    origin: wp.vec3,
    m: wp.vec3,
    width: float,
):
    """Weighted radiance [cd/m^2] and reflectance of a facet of water with normal m."""
    d = fast_normalize(p - view.eye_m)
    # Facets that face away would reflect from below; at least one degree of incidence remains.
    c = wp.max(-wp.dot(d, m), 0.02)
    r = d + m * (2.0 * c)
    # A tilted facet would reflect the ground on which it lies.
    r = fast_normalize(wp.vec3(r[0], r[1], wp.max(r[2], 0.02)))
    fresnel = brdf.fresnel_schlick(brdf.WATER_F0, c)
    seen = reflected_radiance(view, world, images, radiance, origin, r, 0.02 + width) * fresnel
    return wp.vec4(seen[0], seen[1], seen[2], fresnel)


@wp.kernel
def mirror_in_films(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    radiance: wp.array[wp.vec3],
    water: wp.array[wp.vec2],
    films: wp.array[wp.vec4],
):
    """Water at the lattice's points, and one reflected ray of the film there.

    Args:
        water: Share and roughness of water at each point.
        films: As of facet_reflection; not written without water.
    """
    k = wp.tid()
    water[k] = wp.vec2(0.0)
    if lattice.body[k] < 0:
        return
    p = lattice.p_m[k]
    n = lattice.normal[k]
    size_m = ground_weathering.footprint(view, p, n, float(lattice.stride))
    wet = water_at(world, lattice.surface[k], p, n, world.ground.exposed[k], size_m)
    # Less than one percent of water is not worth a ray.
    if wet[0] < 0.01:
        return
    water[k] = wet
    # Every 8 x 8 block of points shares one even distribution of slopes, with neighbours far apart
    # in it.
    x = k % lattice.width
    y = k / lattice.width
    place = float(((x % 8) * 24 + (y % 8) * 19) % 64) + 0.5
    # The square root makes the distribution even over the disk of slopes (Vogel's spiral).
    slope = wp.max(wet[1], 0.25 * FILM_SLOPE) * wp.sqrt(place / 64.0)
    tilt = wp.vec3(wp.cos(GOLDEN_ANGLE * place), wp.sin(GOLDEN_ANGLE * place), 0.0) * slope
    seen = facet_reflection(
        view, world, images, radiance, p, lattice.origin_m[k], fast_normalize(n + tilt), FILM_SLOPE
    )
    # A few rays sample small bright lamps unevenly; their highlights are shaded elsewhere: clamp.
    limit = 30.0 * wp.max(radiance[lattice.pixel[k]])
    limit += 4.0 * wp.max(world.sky.irradiance[0]) * world.sky.luminance
    brightest = wp.max(wp.max(seen[0], wp.max(seen[1], seen[2])), 1.0e-9)
    dimmed = wp.min(limit * seen[3] / brightest, 1.0)
    films[k] = wp.vec4(seen[0] * dimmed, seen[1] * dimmed, seen[2] * dimmed, seen[3])


@wp.kernel
def blur_films(
    images: GBufferRecord,
    lattice: Lattice,
    water: wp.array[wp.vec2],
    films: wp.array[wp.vec4],
    step: int,
    spread: wp.array[wp.vec4],
):
    """Average over points of similar depth along a row (``step`` 1) or column (``step`` width)."""
    k = wp.tid()
    if water[k][0] == 0.0:
        return
    place = k % lattice.width
    size = lattice.width
    if step > 1:
        place = k / lattice.width
        size = lattice.height
    z = images.z_m[lattice.pixel[k]]
    total = wp.vec4(0.0)
    weights = float(0.0)
    for o in range(wp.max(-FILM_REACH, -place), wp.min(FILM_REACH, size - 1 - place) + 1):
        q = k + o * step
        if water[q][0] > 0.0 and wp.abs(images.z_m[lattice.pixel[q]] - z) < 0.2 * z:
            # A tent filter averages the pattern's period as evenly as a box, without its corners.
            w = float(FILM_REACH + 1 - wp.abs(o))
            total += films[q] * w
            weights += w
    spread[k] = total * (1.0 / weights)


@wp.struct
class Around:
    """Water around a pixel, interpolated from lattice points on its surface, and its reflections.

    Attributes:
        found: Sum of weights; 0 if no point lies on the surface.
        film: Weighted sum of facet_reflection over points with water.
        films: Sum of their weights.
    """

    found: float
    water: wp.vec2
    exposed: float
    film: wp.vec4
    films: float


@wp.func
def around_pixel(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    water: wp.array[wp.vec2],
    films: wp.array[wp.vec4],
    i: int,
):
    """Water around pixel i."""
    x = i % view.width
    y = i / view.width
    cell = cell_at(view, lattice, x, y)
    z = images.z_m[i]
    surface = surface_index(world, images.hits[i])
    around = Around()
    for k in range(4):
        q, w = cell_corner(lattice, cell, k)
        if lattice.body[q] >= 0 and wp.abs(images.z_m[lattice.pixel[q]] - z) < 0.1 * z:
            # A trace of every neighbour: a pixel on an unusable lattice point needs a fallback.
            w += 1.0e-4
            around.exposed += world.ground.exposed[q] * w
            if lattice.surface[q] == surface:
                around.water += water[q] * w
                around.found += w
            if water[q][0] > 0.0:
                around.film += films[q] * w
                around.films += w
    return around


@wp.kernel
def mirror_in_puddles(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    radiance: wp.array[wp.vec3],
    ripples: float,
    water: wp.array[wp.vec2],
    films: wp.array[wp.vec4],
    laid: wp.array[wp.vec4],
):
    """Reflections of water at each pixel: traced in puddles, elsewhere from films around.

    Args:
        ripples: Slope of waves on puddles.
        laid: Light to be added [cd/m^2], and the share of the light below that it hides.
    """
    i = wp.tid()
    laid[i] = wp.vec4(0.0)
    hit = images.hits[i]
    if hit[0] < 0:
        return
    n = images.normals[i]
    if n[2] < 0.5:
        return
    around = around_pixel(view, world, images, lattice, water, films, i)
    wet = around.water
    way = pixel_ray(view, i) * images.z_m[i]
    p = view.eye_m + way
    if around.found > 0.0:
        wet = wet * (1.0 / around.found)
    elif around.films > 0.0:
        size_m = ground_weathering.footprint(view, p, n, 1.0)
        wet = water_at(world, surface_index(world, hit), p, n, wp.min(around.exposed, 1.0), size_m)
    if wet[0] < 0.01:
        return
    if wet[1] > SHARP and around.films > 0.0:
        laid[i] = around.film * (wet[0] / around.films)
        return
    origin = ray_origin(world, hit, images.weights[i], p, way)
    # Waves smaller than a pixel would flicker between pixels.
    slope = ripples * wp.min(5.0 / images.z_m[i], 1.0)
    tilt_x = ground_weathering.fractal_noise(p[0], p[1], 0.09, world.ground.seed + 48) * slope
    tilt_y = ground_weathering.fractal_noise(p[0], p[1], 0.09, world.ground.seed + 52) * slope
    m = fast_normalize(n + wp.vec3(tilt_x, tilt_y, 0.0))
    laid[i] = facet_reflection(view, world, images, radiance, p, origin, m, wet[1]) * wet[0]


@wp.kernel
def lay_water(laid: wp.array[wp.vec4], radiance: wp.array[wp.vec3]):
    """Blend reflections of water over the image."""
    i = wp.tid()
    c = laid[i]
    if c[3] > 0.0:
        radiance[i] = radiance[i] * (1.0 - c[3]) + wp.vec3(c[0], c[1], c[2])
