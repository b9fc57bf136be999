"""Lighting of lattice points, and of single pixels that cannot be interpolated from them."""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels.ground_weathering import (
    apply_coat,
    coat_at,
    footprint,
)
from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.realtime.kernels import shadow_culling, soft_shadows
from gen_data.renderers.warp.scene.kernels import (
    ambient_light,
    analytic_lights,
    material_eval,
    ray_queries,
    records,
)
from gen_data.renderers.warp.scene.kernels.brdf import Brdf, make_brdf, specular_lobe
from gen_data.renderers.warp.scene.kernels.lattice import (
    Lattice,
    cell_at,
    ray_origin,
    sheet_side,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Lamps of a smaller radius over distance, such as the sun: their penumbrae do not matter on
# surfaces too small for the lattice.
SMALL_SPREAD = wp.constant(0.02)
# Highlights of smoother surfaces are too small to be interpolated.
GATHERED_ROUGHNESS = wp.constant(0.25)


@wp.struct
class ListedPixels:
    """Pixels that are shaded individually.

    Attributes:
        pixels: Indices of the pixels.
        lit: Visible fraction of each lamp [lamp, position in the list].
        open_sky: Visible fraction of the hemisphere, [1, position].
        exposed: Exposure to precipitation.
    """

    pixels: wp.array[int]
    lit: wp.array2d[float]
    open_sky: wp.array2d[float]
    exposed: wp.array[float]


@wp.struct
class Probe:
    """Samples that find the visibility of lights.

    Attributes:
        parts: Points of the unit disk at which shadow rays aim.
        disc: Points of the unit disk, lifted to the hemisphere for ambient occlusion.
        centre, few: Fewer of both, for light that is a small share of a pixel; ``few`` by the
            pixel's sample, [samples, points].
        radius_m: Radius of ambient occlusion.
        lit: Scratch: visible fraction of each lamp at the end of a pixel's ray [lamp, pixel].
    """

    parts: wp.array[wp.vec2]
    disc: wp.array[wp.vec2]
    centre: wp.array[wp.vec2]
    few: wp.array2d[wp.vec2]
    radius_m: float
    lit: wp.array2d[float]


@wp.struct
class LatticeLight:
    """Light that leaves a point towards the viewer [cd/m^2].

    Attributes:
        diffuse: Diffuse light, before the albedo.
        rest: Specular reflection and emission.
        towards: Mean direction towards the lamps, weighted by illuminance; any length.
        lamps: Share of lamps in ``diffuse``.
        shine: Share of lamps in ``rest``.
    """

    diffuse: wp.vec3
    rest: wp.vec3
    towards: wp.vec3
    lamps: float
    shine: float


@wp.func
def share_of(a: wp.vec3, b: wp.vec3):
    """Share of ``a`` in ``b``, over all channels."""
    # The floor makes the share of black in black zero.
    return (a[0] + a[1] + a[2]) / wp.max(b[0] + b[1] + b[2], 1.0e-20)


@wp.struct
class LampLight:
    """Light of all lamps at a point.

    Attributes:
        lux: Illuminance of the surface [lx].
        shine: Specular reflection towards the viewer [cd/m^2].
        behind: Illuminance of the other side of a translucent surface [lx].
        shown: Share of ``shine`` of lamps that reflected rays hit themselves.
        towards: Mean direction towards the lamps; any length.
    """

    lux: wp.vec3
    behind: wp.vec3
    shine: wp.vec3
    shown: wp.vec3
    towards: wp.vec3


@wp.func
def sum_lamp_light(
    world: records.World,
    brdf: Brdf,
    n: wp.vec3,
    side: wp.vec3,
    p_world: wp.vec3,
    v: wp.vec3,
    lit: wp.array2d[float],
    k: int,
):
    """Light of all lamps at a point; arguments as for light_at."""
    mirrored = n * (2.0 * wp.dot(n, v)) - v
    alpha = brdf.roughness * brdf.roughness
    light = LampLight()
    for j in range(world.lamps.shape[0]):
        visible = lit[j, k]
        if visible > 0.0:
            beam = analytic_lights.beam_from(world.lamps[j], p_world)
            facing = lit_normal(n, side, beam.direction)
            n_l = analytic_lights.relative_illuminance(world.lamps[j], beam, p_world, facing)
            arriving = beam.normal_lux * (n_l * visible)
            if wp.dot(side, beam.direction) < 0.0:
                light.behind += arriving
            elif n_l > 0.0:
                l = analytic_lights.representative_direction(  # noqa: E741
                    world.lamps[j], beam, p_world, mirrored, alpha
                )
                # The representative point of a wide lamp may be below the horizon while the lamp
                # still contributes: see ``above_horizon_fraction``.
                n_s = wp.max(wp.dot(n, l), 1.0e-3)
                wider = analytic_lights.lobe_widening(world.lamps[j], beam, alpha)
                lobe = specular_lobe(brdf, n, v, l, n_s, wider)
                light.lux += arriving
                shine = wp.cw_mul(lobe, beam.normal_lux) * (n_s * visible)
                shine *= analytic_lights.above_horizon_fraction(world.lamps[j], beam, n)
                light.shine += shine
                if world.lamps[j].shown != 0:
                    light.shown += shine
                light.towards += beam.direction * (arriving[0] + arriving[1] + arriving[2])
    return light


@wp.func
def lit_normal(n: wp.vec3, side: wp.vec3, to_lamp: wp.vec3):
    """The normal whose cosine counts for a lamp; arguments as for light_at.

    On a translucent surface ``side`` separates reflection from transmission, and either counts by
    the absolute cosine of the smooth normal. Its mean over the directions of one side is the same
    for every smooth normal: no energy is gained or lost.
    """
    facing = n
    if wp.dot(side, side) > 0.0 and wp.dot(n, to_lamp) < 0.0:
        facing = -n
    return facing


@wp.func
def specular_occlusion(brdf: Brdf, open_sky: float):
    """Visible fraction of the environment in the specular lobe.

    Source: Lagarde and de Rousiers 2014, with a fixed exponent.
    """
    lobe = brdf.n_v + open_sky
    return wp.clamp(lobe * lobe - 1.0 + open_sky, 0.0, 1.0)


@wp.func
def light_at(
    world: records.World,
    surface: int,
    material: material_eval.SurfaceMaterial,
    side: wp.vec3,
    p_world: wp.vec3,
    v: wp.vec3,
    lit: wp.array2d[float],
    open_sky: float,
    k: int,
):
    """Light of all lamps and of the environment at a point.

    Args:
        side: Direction away from a translucent surface on its visible side, any length; 0 for
            opaque surfaces.
        v: Unit direction to the viewer.
        lit: Visible fraction of each lamp at points [lamp, k]; UNSEEN counts as none.
        open_sky: Visible fraction of the hemisphere.
    """
    n = material.normal
    n_v = wp.dot(n, v)
    brdf = make_brdf(
        world.lobes, material.albedo, material.roughness, material.metallic, material.specular, n_v
    )
    lamps = sum_lamp_light(world, brdf, n, side, p_world, v, lit, k)
    light = LatticeLight()
    light.towards = lamps.towards
    ambient = ambient_light.received_ambience(world, p_world, n, open_sky)
    mirror = ambient_light.ambient_reflection(world, p_world, n * (2.0 * n_v) - v, brdf.roughness)
    # Lambert: illuminance over pi is luminance per albedo.
    lux = lamps.lux * (1.0 / wp.pi)
    received = lux + ambient
    mirrored = specular_occlusion(brdf, open_sky)
    if wp.dot(side, side) > 0.0:
        # Occluders of the sky also occlude a leaf's reflections, at any angle.
        mirrored = wp.min(mirrored, open_sky)
        behind = lamps.behind * (1.0 / wp.pi) + ambient_light.received_ambience(
            world, p_world, -n, open_sky
        )
        received += wp.cw_mul(material.translucency, behind)
    light.diffuse = wp.cw_mul(brdf.matte, received)
    light.rest = wp.cw_mul(brdf.gloss, mirror) * mirrored + lamps.shine
    light.rest += world.surfaces[surface].emission_cd_m2
    light.lamps = share_of(lux, received)
    light.shine = share_of(lamps.shine, light.rest)
    return light


@wp.kernel
def light_lattice(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    lattice: Lattice,
    lit: wp.array2d[float],
    open_sky: wp.array2d[float],
    lights: wp.array[LatticeLight],
    coats: wp.array[wp.vec4],
):
    """Light at the lattice's points on surfaces that are interpolated; bumps are left out.

    Args:
        coats: Field ``mixable`` of a Coat: wetness and snow there; written if the ground is
            covered.
    """
    k = wp.tid()
    surface = lattice.surface[k]
    if surface < 0:
        return
    if not is_gatherable(world, surface):
        return
    i = lattice.pixel[k]
    p = lattice.p_m[k]
    v = records.fast_normalize(view.eye_m - p)
    material = material_eval.plain_material(world, surface, lattice.normal[k])
    if world.surfaces[surface].texture >= 0:
        z = images.z_m[i]
        weight = images.weights[i]
        width_m = records.pixel_width(view, i, z)
        # The texture sets roughness here; pixels apply their own albedo.
        material = material_eval.evaluate_material(
            world, surface, images.hits[i], weight, lattice.normal[k], width_m, v
        )
    if world.ground.covered != 0:
        size_m = footprint(view, p, lattice.normal[k], float(lattice.stride))
        coat = coat_at(world, surface, p, lattice.normal[k], world.ground.exposed[k], size_m)
        material = apply_coat(world, surface, material, coat, lattice.normal[k])
        coats[k] = coat.mixable
    # The pixels apply bumps themselves: see lattice_interpolation.bump_factors.
    material.normal = lattice.normal[k]
    side = sheet_side(world, lattice, k)
    lights[k] = light_at(world, surface, material, side, p, v, lit, open_sky[0, k], k)


@wp.kernel
def shade_points(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    listed: ListedPixels,
    radiance: wp.array[wp.vec3],
):
    """Shade listed pixels individually, except layered surfaces."""
    k = wp.tid()
    i = listed.pixels[k]
    hit = images.hits[i]
    surface = records.surface_index(world, hit)
    if world.surfaces[surface].layered != 0:
        return
    d = records.pixel_ray(view, i)
    v = records.fast_normalize(-d)
    z = images.z_m[i]
    width_m = records.pixel_width(view, i, z)
    material = material_eval.evaluate_material(
        world, surface, hit, images.weights[i], images.normals[i], width_m, v
    )
    p = view.eye_m + d * z
    if world.ground.covered != 0:
        n = images.normals[i]
        coat = coat_at(world, surface, p, n, listed.exposed[k], footprint(view, p, n, 1.0))
        material = apply_coat(world, surface, material, coat, n)
    side = material_eval.sheet_normal(world, surface, hit, images.weights[i])
    light = light_at(world, surface, material, side, p, v, listed.lit, listed.open_sky[0, k], k)
    radiance[i] = wp.cw_mul(light.diffuse, material.albedo) + light.rest


@wp.func
def is_gatherable(world: records.World, surface: int):
    """Whether a material's light varies slowly enough to be interpolated from the lattice."""
    smooth = world.surfaces[surface].roughness >= GATHERED_ROUGHNESS
    smooth = smooth and world.surfaces[surface].layered == 0
    texture = world.surfaces[surface].texture
    if smooth and texture >= 0:
        # A textured metal reflects its colour: light and albedo do not separate.
        smooth = world.surfaces[surface].metallic < 0.05
    return smooth


@wp.func_native(native("realtime/kernels/interpolate_visibility.h"))
def interpolate_visibility(
    lattice: Lattice,
    lamps: int,
    lit: wp.array2d[wp.float32],
    open_sky: wp.array2d[wp.float32],
    covered: int,
    exposed: wp.array[wp.float32],
    body: int,
    p: wp.vec3,
    n: wp.vec3,
    tolerance_m: float,
    column: int,
    row: int,
    right: float,
    down: float,
    listed: ListedPixels,
    k: int,
) -> bool:
    """Visibility at listed pixel k from the lattice's points around it; whether there are any.

    Args:
        lit, open_sky, exposed: Values of the lattice's points; ``exposed`` if the ground is
            covered.
        body, p, n: Body, point and normal of the pixel.
        tolerance_m: Largest distance of points from its tangent plane.
        column, row, right, down: Its cell and its position there.
    """
    ...


@wp.kernel
def find_pixel_visibility(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    lattice: Lattice,
    lattice_lit: wp.array2d[float],
    lattice_sky: wp.array2d[float],
    probe: Probe,
    listed: ListedPixels,
):
    """Visibility of lamps and environment at listed pixels, from lattice points or by rays."""
    k = wp.tid()
    i = listed.pixels[k]
    x = i % view.width
    y = i / view.width
    d = records.pixel_ray(view, i)
    p = view.eye_m + d * images.z_m[i]
    n = images.normals[i]
    body = images.hits[i][0]
    cell = cell_at(view, lattice, x, y)
    found = interpolate_visibility(
        lattice,
        world.lamps.shape[0],
        lattice_lit,
        lattice_sky,
        world.ground.covered,
        world.ground.exposed,
        body,
        p,
        n,
        2.0 * soft_shadows.surface_tolerance(view, p),
        x / lattice.stride,
        y / lattice.stride,
        cell.right,
        cell.down,
        listed,
        k,
    )
    if not found:
        origin = ray_origin(world, images.hits[i], images.weights[i], p, d * images.z_m[i])
        side = material_eval.sheet_normal(
            world, records.surface_index(world, images.hits[i]), images.hits[i], images.weights[i]
        )
        # As by weigh_lamps: of faint lamps the lattice has no light either.
        total = wp.max(wp.max(ambient_light.ambient_irradiance(world, p, n)) * wp.pi, 1.0e-9)
        indoors = ambient_light.is_indoors(world, p)
        for j in range(world.lamps.shape[0]):
            listed.lit[j, k] = soft_shadows.lamp_weight(world.lamps[j], origin, n, side)
            if not indoors or world.lamps[j].kind != analytic_lights.SUN:
                total += wp.max(listed.lit[j, k], 0.0)
        for j in range(world.lamps.shape[0]):
            weight = listed.lit[j, k] / total
            listed.lit[j, k] = 0.0
            if weight > soft_shadows.SMOOTHED_SHARE:
                listed.lit[j, k] = visible_lamp_fraction(
                    world, world.lamps[j], p, origin, n, side, probe.parts
                )
            elif weight > shadow_culling.FAINT_SHARE:
                listed.lit[j, k] = visible_lamp_fraction(
                    world, world.lamps[j], p, origin, n, side, probe.centre
                )
        sky, corners = body_sky_visibility(lattice, lattice_sky, cell.first, body)
        if corners == 0.0:
            sky = visible_sky_fraction(world, body, p, origin, n, side, probe.disc, probe.radius_m)
            corners = 1.0
        listed.open_sky[0, k] = sky / corners
        listed.exposed[k] = sky_exposure_at(world, body, origin, n)


@wp.func
def sky_exposure_at(world: records.World, body: int, origin: wp.vec3, n: wp.vec3):
    """Exposure of a point on a body to precipitation, by a ray."""
    exposed = float(1.0)
    # Steep surfaces hold no water or snow: their exposure is never used.
    if world.ground.covered != 0 and n[2] > 0.1:
        exposed = ray_queries.precipitation_exposure(world, body, origin)
    return exposed


@wp.func
def body_sky_visibility(lattice: Lattice, lattice_sky: wp.array2d[float], q: int, body: int):
    """Sum and number of the sky's visible fractions at a cell's corners on one body.

    Thin parts such as leaves and spokes are as open to the sky as their neighbours, whatever their
    orientation.
    """
    total = float(0.0)
    found = float(0.0)
    for k in range(4):
        corner = q + (k & 1) + wp.where(k >= 2, lattice.width, 0)
        if lattice.body[corner] == body:
            total += lattice_sky[0, corner]
            found += 1.0
    return total, found


@wp.func
def visible_lamp_fraction(
    world: records.World,
    lamp: records.LightRecord,
    p: wp.vec3,
    origin: wp.vec3,
    n: wp.vec3,
    side: wp.vec3,
    parts: wp.array[wp.vec2],
):
    """Visible fraction of a lamp from a point, by up to all ``parts``; one ray for small lamps.

    Args:
        p: The point on its surface.
        origin: Origin of rays on its visible side; those to a lamp behind a translucent surface
            begin on the other side.
        n: Normal of the horizon of opaque surfaces.
        side: As for light_at.
    """
    beam = analytic_lights.beam_from(lamp, origin)
    seen = float(0.0)
    cast = int(0)
    start = origin
    horizon = n
    if wp.dot(side, side) > 0.0:
        horizon = side
        if wp.dot(side, beam.direction) < 0.0:
            start = p * 2.0 - origin
            horizon = -side
    if wp.dot(beam.direction, horizon) > -beam.spread and wp.max(beam.normal_lux) > 0.0:
        for k in range(wp.where(beam.spread < SMALL_SPREAD, 1, parts.shape[0])):
            # Penumbrae are rare: where the first two rays agree, the rest is taken to agree.
            if k < 2 or (seen > 0.0 and seen < float(cast)):
                cast += 1
                if not ray_queries.is_occluded(
                    world,
                    ray_queries.path_along(
                        start, soft_shadows.path_to_lamp(lamp, start, horizon, parts[k])
                    ),
                ):
                    seen += 1.0
    return seen / wp.max(float(cast), 1.0)


@wp.func
def visible_sky_fraction(
    world: records.World,
    body: int,
    p: wp.vec3,
    origin: wp.vec3,
    n: wp.vec3,
    side: wp.vec3,
    disc: wp.array[wp.vec2],
    radius_m: float,
):
    """Visible fraction of the hemisphere within a radius, weighted by the cosine.

    Of a translucent surface of ``body`` it is the mean of both sides, and the body itself hides the
    sky up to CROWN_M, as in soft_shadows.probe_ambient. Other arguments as for
    visible_lamp_fraction.
    """
    if radius_m == 0.0:
        return 1.0
    x, y = soft_shadows.make_frame(n)
    total = float(0.0)
    for k in range(disc.shape[0]):
        c = disc[k]
        # Malley's method: disk points lifted to the hemisphere are distributed by the cosine.
        up = wp.sqrt(1.0 - wp.dot(c, c))
        way = x * c[0] + y * c[1] + n * up
        start = origin
        within = float(1.0)
        if wp.dot(side, side) > 0.0:
            way = way * wp.where((k & 1) == 0, 1.0, -1.0)
            if wp.dot(side, way) < 0.0:
                start = p * 2.0 - origin
            within = ray_queries.free_path_before(
                world, body, ray_queries.path_along(start, way * soft_shadows.CROWN_M), 1.0
            )
        t = ray_queries.free_path(world, ray_queries.path_along(start, way * radius_m))
        # Full occlusion on contact, fading with zero slope at the radius.
        total += wp.min(t * (2.0 - t), wp.max(within, soft_shadows.CROWN_GLOW))
    return total / float(disc.shape[0])
