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
    path_along,
    surface_tolerance,
    way_to_lamp,
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
    """Light that leaves a point towards the viewer [cd/m^2].

    Attributes:
        ambient, lamps: Diffusely, of the sky and of lamps; to be multiplied by the albedo.
        shine: Of lamps, reflected.
        rest: Of the sky, reflected, and the surface's own.
        towards: Where the lamps' light comes from, on average; any length.
    """

    ambient: wp.vec3
    lamps: wp.vec3
    shine: wp.vec3
    rest: wp.vec3
    towards: wp.vec3


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
    light = Light()
    lux = wp.vec3(0.0)
    for j in range(world.lamps.shape[0]):
        visible = lit[j, k]
        if visible > 0.0:
            beam = beam_from(world.lamps[j], p_world)
            n_l = wp.dot(n, beam.direction)
            if n_l > 0.0:
                l = towards_mirror(beam, mirrored, alpha)  # noqa: E741
                n_s = wp.max(wp.dot(n, l), 1.0e-3)
                lobe = specular_lobe(brdf, n, v, l, n_s, 0.5 * beam.spread)
                arriving = beam.normal_lux * (n_l * visible)
                lux += arriving
                light.shine += wp.cw_mul(lobe, beam.normal_lux) * (n_s * visible)
                light.towards += beam.direction * (arriving[0] + arriving[1] + arriving[2])
    ambient = sky_irradiance(world.sky, n) * open_sky
    # Specular occlusion after Lagarde and de Rousiers 2014, with a fixed exponent.
    open_lobe = brdf.n_v + open_sky
    open_lobe = wp.clamp(open_lobe * open_lobe - 1.0 + open_sky, 0.0, 1.0)
    mirror = sky_reflection(world.sky, mirrored, brdf.roughness)
    light.ambient = wp.cw_mul(brdf.matte, ambient)
    light.lamps = wp.cw_mul(brdf.matte, lux) * (1.0 / wp.pi)
    light.rest = wp.cw_mul(brdf.gloss, mirror) * open_lobe + world.surfaces[surface].emission_cd_m2
    return light


@wp.kernel
def light_lattice(
    view: View,
    world: World,
    images: Images,
    lattice: Lattice,
    lit: wp.array(dtype=float, ndim=2),
    open_sky: wp.array(dtype=float, ndim=2),
    lights: wp.array(dtype=Light),
):
    """Light at the lattice's points, on surfaces whose light is gathered; bumps are left out."""
    k = wp.tid()
    surface = lattice.surface[k]
    if surface < 0:
        return
    if not gatherable(world, surface):
        return
    i = lattice.pixel[k]
    p = lattice.p_m[k]
    v = unit(view.eye_m - p)
    look = Look()
    look.albedo = world.surfaces[surface].base_color
    look.roughness = world.surfaces[surface].roughness
    if world.surfaces[surface].texture >= 0:
        z = images.z_m[i]
        weight = images.weights[i]
        look = look_at_hit(view, world, surface, images.hits[i], weight, lattice.normal[k], z, v)
    look.normal = lattice.normal[k]
    lights[k] = light_at(world, surface, look, p, v, lit, open_sky[0, k], k)


@wp.kernel
def shade_points(
    view: View,
    world: World,
    images: Images,
    pixels: wp.array(dtype=int),
    lit: wp.array(dtype=float, ndim=2),
    open_sky: wp.array(dtype=float, ndim=2),
    radiance: wp.array(dtype=wp.vec3),
):
    """Shade a list of pixels, each by itself."""
    k = wp.tid()
    i = pixels[k]
    hit = images.hits[i]
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    v = unit(-d)
    z = images.z_m[i]
    surface = surface_index(world, hit)
    look = look_at_hit(view, world, surface, hit, images.weights[i], images.normals[i], z, v)
    light = light_at(world, surface, look, view.eye_m + d * z, v, lit, open_sky[0, k], k)
    diffuse = wp.cw_mul(light.ambient + light.lamps, look.albedo)
    radiance[i] = diffuse + light.shine + light.rest


@wp.struct
class Corner:
    """One of the four lattice points around a pixel: its index and bilinear weight."""

    q: int
    weight: float


@wp.func
def corner_at(lattice: Lattice, x: int, y: int, k: int):
    """The k-th lattice point around a pixel."""
    column = x / lattice.stride
    row = y / lattice.stride
    wx = float(x - column * lattice.stride) / float(lattice.stride)
    wy = float(y - row * lattice.stride) / float(lattice.stride)
    corner = Corner()
    corner.q = (row + (k >> 1)) * lattice.width + column + (k & 1)
    corner.weight = wp.where((k & 1) == 1, wx, 1.0 - wx) * wp.where(k >= 2, wy, 1.0 - wy)
    return corner


@wp.func
def agreement(
    view: View, images: Images, lattice: Lattice, surface: int, i: int, p: wp.vec3, q: int
):
    """Cosine between the normals of pixel i and lattice point q; 0 if on other surfaces.

    One triangle is taken to be flat.
    """
    cosine = float(0.0)
    if lattice.surface[q] == surface:
        hit = images.hits[lattice.pixel[q]]
        if hit[0] == images.hits[i][0] and hit[1] == images.hits[i][1]:
            cosine = 1.0
        else:
            tolerance_m = surface_tolerance(view, p)
            cosine = agree(p, images.normals[i], lattice.p_m[q], lattice.normal[q], tolerance_m)
    return cosine


@wp.func
def gatherable(world: World, surface: int):
    """Whether a material's light changes slowly enough to be taken from the lattice."""
    smooth = world.surfaces[surface].roughness >= GATHERED_ROUGHNESS
    texture = world.surfaces[surface].texture
    if smooth and texture >= 0:
        smooth = world.surfaces[surface].metallic < 0.05
    return smooth


@wp.func
def gathered(
    view: View,
    world: World,
    images: Images,
    lattice: Lattice,
    lights: wp.array(dtype=Light),
    surface: int,
    x: int,
    y: int,
    p: wp.vec3,
):
    """Mean light of the lattice points around a pixel, and their weight; 0 if none agrees."""
    light = Light()
    total = float(0.0)
    for k in range(4):
        corner = corner_at(lattice, x, y, k)
        w = corner.weight
        if w > 0.0:
            i = y * view.width + x
            if agreement(view, images, lattice, surface, i, p, corner.q) > SMOOTH_COSINE:
                light.ambient += lights[corner.q].ambient * w
                light.lamps += lights[corner.q].lamps * w
                light.shine += lights[corner.q].shine * w
                light.rest += lights[corner.q].rest * w
                light.towards += lights[corner.q].towards * w
                total += w
    return light, total


@wp.func
def on_bump(light: Light, look: Look, n: wp.vec3, v: wp.vec3):
    """Light gathered for a normal, as a normal that a texture tilts would have it.

    The lamps are taken for one, where their light comes from on average.
    """
    tilted = light
    length = wp.length(light.towards)
    if length > 0.0:
        t = light.towards * (1.0 / length)
        before = wp.max(wp.dot(n, t), 0.1)
        after = wp.max(wp.dot(look.normal, t), 0.0)
        tilted.lamps = light.lamps * wp.min(after / before, 3.0)
        h = unit(t + v)
        alpha = look.roughness * look.roughness
        n_h = wp.dot(n, h)
        m_h = wp.dot(look.normal, h)
        narrow = 1.0 - alpha * alpha
        lobe = (1.0 - n_h * n_h * narrow) / wp.max(1.0 - m_h * m_h * narrow, 1.0e-4)
        tilted.shine = light.shine * wp.min(lobe * lobe, 8.0)
    return tilted


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
    """Light every pixel from lattice points, or list it to be shaded by itself.

    Args:
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    y, x = wp.tid()
    i = y * view.width + x
    d = view.R_world_camera @ pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    hit = images.hits[i]
    if hit[0] < 0:
        radiance[i] = wp.vec3(0.0)
        if world.sky.visible != 0:
            radiance[i] = sky_image(world.sky, d)
        return
    z = images.z_m[i]
    surface = surface_index(world, hit)
    found = float(0.0)
    light = Light()
    if gatherable(world, surface):
        p = view.eye_m + d * z
        light, found = gathered(view, world, images, lattice, lights, surface, x, y, p)
    if found == 0.0:
        pixels[wp.atomic_add(count, 0, 1)] = i
        return
    texture = world.surfaces[surface].texture
    albedo = world.surfaces[surface].base_color
    if texture >= 0:
        v = unit(-d)
        n = images.normals[i]
        look = look_at_hit(view, world, surface, hit, images.weights[i], n, z, v)
        albedo = look.albedo
        if world.textures[texture].has_bumps != 0:
            light = on_bump(light, look, n, v)
    diffuse = wp.cw_mul(light.ambient + light.lamps, albedo)
    radiance[i] = (diffuse + light.shine + light.rest) * (1.0 / found)


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
        corner = corner_at(lattice, x, y, c)
        w = corner.weight
        q = corner.q
        if w > 0.0:
            if agreement(view, images, lattice, surface, i, p, q) > 0.0:
                found += w
                sky += lattice_sky[0, q] * w
                for j in range(world.lamps.shape[0]):
                    lit[j, k] = lit[j, k] + wp.max(lattice_lit[j, q], 0.0) * w
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
            if not blocked(world, path_along(origin, way_to_lamp(lamp, origin, disc[k]))):
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
        t = free_path(world, path_along(origin, (x * c[0] + y * c[1] + n * up) * radius_m))
        total += t * (2.0 - t)
    return total / float(disc.shape[0])
