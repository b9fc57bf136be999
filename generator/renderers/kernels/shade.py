"""Light at what is seen: fully on the lattice and where surfaces turn sharply, gathered elsewhere."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.brdf import make_brdf, specular_lobe
from generator.renderers.kernels.lattice import Lattice, agree, ray_origin
from generator.renderers.kernels.lighting import beam_from, towards_mirror
from generator.renderers.kernels.look import Look, look_at_hit
from generator.renderers.kernels.occlusion import (
    blocked,
    free_path,
    frame_of,
    path_to_lamp,
    surface_tolerance,
)
from generator.renderers.kernels.records import (
    Lamp,
    View,
    World,
    pixel_direction,
    surface_index,
    unit,
)
from generator.renderers.kernels.sky import sky_image, sky_irradiance, sky_reflection

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Light of two points may be mixed if their normals differ by less than eight degrees.
SMOOTH_COSINE = wp.constant(0.99)
# Highlights of smoother surfaces are too small to be gathered.
GATHERED_ROUGHNESS = wp.constant(0.25)


@wp.struct
class Images:
    """What is seen at every pixel centre, flat; as in generator.renderers.visibility.Seen."""

    hits: wp.array(dtype=wp.vec2i)
    z_m: wp.array(dtype=float)
    weights: wp.array(dtype=wp.vec2)
    normals: wp.array(dtype=wp.vec3)


@wp.struct
class Light:
    """Light that leaves a point towards the viewer [cd/m^2], but for the diffuse albedo.

    Attributes:
        diffuse: To be multiplied by the albedo.
        rest: Reflections and the surface's own light.
    """

    diffuse: wp.vec3
    rest: wp.vec3


@wp.func
def light_at(
    world: World,
    surface: int,
    look: Look,
    p_world: wp.vec3,
    v: wp.vec3,
    lit: wp.array(dtype=float, ndim=2),
    open_sky: float,
    k: int,
):
    """Light of all lamps and of the sky at a point.

    Args:
        v: To the viewer.
        lit: Visible part of each lamp at points [lamp, k]; UNSEEN is none.
        open_sky: Visible part of the hemisphere.
    """
    n = look.normal
    n_v = wp.dot(n, v)
    metallic = world.surfaces[surface].metallic
    brdf = make_brdf(look.albedo, look.roughness, metallic, world.surfaces[surface].specular, n_v)
    mirrored = n * (2.0 * n_v) - v
    alpha = brdf.roughness * brdf.roughness
    lux = wp.vec3(0.0)
    rest = world.surfaces[surface].emission_cd_m2
    for j in range(world.lamps.shape[0]):
        visible = lit[j, k]
        if visible > 0.0:
            beam = beam_from(world.lamps[j], p_world)
            n_l = wp.dot(n, beam.direction)
            if n_l > 0.0:
                l = towards_mirror(beam, mirrored, alpha)  # noqa: E741
                n_s = wp.max(wp.dot(n, l), 1.0e-3)
                lobe = specular_lobe(brdf, n, v, l, n_s, 0.5 * beam.spread)
                lux += beam.normal_lux * (n_l * visible)
                rest += wp.cw_mul(lobe, beam.normal_lux) * (n_s * visible)
    ambient = sky_irradiance(world.sky, n) * open_sky
    # Specular occlusion after Lagarde and de Rousiers 2014, with a fixed exponent.
    open_lobe = brdf.n_v + open_sky
    open_lobe = wp.clamp(open_lobe * open_lobe - 1.0 + open_sky, 0.0, 1.0)
    rest += wp.cw_mul(brdf.gloss, sky_reflection(world.sky, mirrored, brdf.roughness)) * open_lobe
    light = Light()
    light.diffuse = wp.cw_mul(brdf.matte, lux * (1.0 / wp.pi) + ambient)
    light.rest = rest
    return light


@wp.kernel
def shade_points(
    view: View,
    world: World,
    images: Images,
    pixels: wp.array(dtype=int),
    lit: wp.array(dtype=float, ndim=2),
    open_sky: wp.array(dtype=float, ndim=2),
    lights: wp.array(dtype=Light),
    radiance: wp.array(dtype=wp.vec3),
):
    """Shade a list of pixels; ``lights`` are theirs to share."""
    k = wp.tid()
    i = pixels[k]
    hit = images.hits[i]
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    light = Light()
    if hit[0] >= 0:
        z = images.z_m[i]
        v = unit(-d)
        surface = surface_index(world, hit)
        weight = images.weights[i]
        look = look_at_hit(view, world, surface, hit, weight, images.normals[i], z, v)
        p = view.eye_m + d * z
        light = light_at(world, surface, look, p, v, lit, open_sky[0, k], k)
        radiance[i] = wp.cw_mul(light.diffuse, look.albedo) + light.rest
    elif world.sky.visible != 0:
        radiance[i] = sky_image(world.sky, d)
    else:
        radiance[i] = wp.vec3(0.0)
    lights[k] = light


@wp.func
def neighbour(lattice: Lattice, x: int, y: int, k: int):
    """The k-th of the four lattice points around a pixel, or -1.

    Odd columns have a point on either side, even ones lie on one; rows likewise.
    """
    column = (x + (k & 1)) >> 1
    row = (y + (k >> 1)) >> 1
    twice = ((k & 1) == 1 and (x & 1) == 0) or (k >= 2 and (y & 1) == 0)
    q = row * lattice.width + column
    if twice or column >= lattice.width or row >= lattice.height:
        q = -1
    return q


@wp.func
def agreement(
    view: View, images: Images, lattice: Lattice, surface: int, i: int, p: wp.vec3, q: int
):
    """Cosine between the normals of pixel i and lattice point q; 0 if on other surfaces.

    One triangle is taken to be flat.
    """
    cosine = float(0.0)
    if q >= 0:
        if images.hits[lattice.pixel[q]] == images.hits[i]:
            cosine = 1.0
        elif lattice.surface[q] == surface:
            tolerance_m = surface_tolerance(view, p)
            cosine = agree(p, images.normals[i], lattice.p_m[q], lattice.normal[q], tolerance_m)
    return cosine


@wp.func
def gatherable(world: World, surface: int):
    """Whether a material's light changes slowly enough to be taken from the lattice."""
    smooth = world.surfaces[surface].roughness >= GATHERED_ROUGHNESS
    texture = world.surfaces[surface].texture
    if smooth and texture >= 0:
        smooth = world.surfaces[surface].metallic < 0.05 and world.textures[texture].has_bumps == 0
    return smooth


@wp.kernel
def gather_light(
    view: View,
    world: World,
    images: Images,
    lattice: Lattice,
    lights: wp.array(dtype=Light),
    count: wp.array(dtype=int),
    pixels: wp.array(dtype=int),
    radiance: wp.array(dtype=wp.vec3),
):
    """Light every pixel off the lattice from lattice points, or list it to be shaded by itself.

    Args:
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    i = wp.tid()
    x = i % view.width
    y = i / view.width
    if (x & 1) == 0 and (y & 1) == 0:
        return
    d = view.R_world_camera @ pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    hit = images.hits[i]
    if hit[0] < 0:
        radiance[i] = wp.vec3(0.0)
        if world.sky.visible != 0:
            radiance[i] = sky_image(world.sky, d)
        return
    z = images.z_m[i]
    p = view.eye_m + d * z
    surface = surface_index(world, hit)
    diffuse = wp.vec3(0.0)
    rest = wp.vec3(0.0)
    found = float(0.0)
    if gatherable(world, surface):
        for k in range(4):
            q = neighbour(lattice, x, y, k)
            if agreement(view, images, lattice, surface, i, p, q) > SMOOTH_COSINE:
                diffuse += lights[q].diffuse
                rest += lights[q].rest
                found += 1.0
    if found == 0.0:
        pixels[wp.atomic_add(count, 0, 1)] = i
        return
    weight = images.weights[i]
    v = unit(-d)
    albedo = look_at_hit(view, world, surface, hit, weight, images.normals[i], z, v).albedo
    radiance[i] = (wp.cw_mul(diffuse, albedo) + rest) * (1.0 / found)


@wp.kernel
def look_around(
    view: View,
    world: World,
    images: Images,
    lattice: Lattice,
    lattice_lit: wp.array(dtype=float, ndim=2),
    lattice_sky: wp.array(dtype=float, ndim=2),
    disc: wp.array(dtype=wp.vec2),
    radius_m: float,
    pixels: wp.array(dtype=int),
    lit: wp.array(dtype=float, ndim=2),
    open_sky: wp.array(dtype=float, ndim=2),
):
    """What listed pixels see of lamps and sky: the mean of lattice points, or by rays.

    Args:
        disc: Four points of the unit disc.
        radius_m: Of ambient occlusion.
    """
    k = wp.tid()
    i = pixels[k]
    x = i % view.width
    y = i / view.width
    d = view.R_world_camera @ pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    hit = images.hits[i]
    p = view.eye_m + d * images.z_m[i]
    surface = surface_index(world, hit)
    found = float(0.0)
    sky = float(0.0)
    for j in range(world.lamps.shape[0]):
        lit[j, k] = 0.0
    for c in range(4):
        q = neighbour(lattice, x, y, c)
        if agreement(view, images, lattice, surface, i, p, q) > 0.0:
            found += 1.0
            sky += lattice_sky[0, q]
            for j in range(world.lamps.shape[0]):
                lit[j, k] = lit[j, k] + wp.max(lattice_lit[j, q], 0.0)
    if found > 0.0:
        open_sky[0, k] = sky / found
        for j in range(world.lamps.shape[0]):
            lit[j, k] = lit[j, k] / found
    else:
        n = images.normals[i]
        origin = ray_origin(world, hit, images.weights[i], p, d * images.z_m[i])
        for j in range(world.lamps.shape[0]):
            lit[j, k] = seen_part(world, world.lamps[j], origin, n, disc)
        open_sky[0, k] = seen_sky(world, origin, n, disc, radius_m)


@wp.func
def seen_part(world: World, lamp: Lamp, origin: wp.vec3, n: wp.vec3, disc: wp.array(dtype=wp.vec2)):
    """How much of a lamp a point sees."""
    beam = beam_from(lamp, origin)
    seen = float(0.0)
    if wp.dot(beam.direction, n) > -beam.spread and wp.max(beam.normal_lux) > 0.0:
        for k in range(disc.shape[0]):
            if not blocked(world, origin, path_to_lamp(lamp, origin, disc[k])):
                seen += 1.0
    return seen / float(disc.shape[0])


@wp.func
def seen_sky(
    world: World, origin: wp.vec3, n: wp.vec3, disc: wp.array(dtype=wp.vec2), radius_m: float
):
    """How open a point is to the sky."""
    if radius_m == 0.0:
        return 1.0
    x, y = frame_of(n)
    total = float(0.0)
    for k in range(disc.shape[0]):
        c = disc[k]
        up = wp.sqrt(1.0 - wp.dot(c, c))
        t = free_path(world, origin, (x * c[0] + y * c[1] + n * up) * radius_m)
        total += t * (2.0 - t)
    return total / float(disc.shape[0])
