"""Layered surfaces of the realtime tier: clear coats, glass, mirrors and further maps.

Only pixels that show such a surface are shaded here, and only scenes with one load this module. A
pixel's own light is computed as in
gen_data.renderers.warp.realtime.kernels.lattice_lighting; up to three rays add reflections and the
view behind.

* A **clear coat** is a second GGX layer of reflectance 0.04; its reflection is subtracted from
  all layers below (KHR_materials_clearcoat; Filament, "Physically based rendering", 4.9). It is
  smooth over the bumps of the base.
* **Glass** reflects by Fresnel's equations. A thin pane transmits the rest without bending it, all
  inter-reflections summed, and tints it once; a solid refracts, and its surface tints entering and
  leaving light by the square root of its colour.
* **Mirrors**, that is metals, coats and glass of a roughness below MIRROR_ROUGHNESS, reflect the
  scene by one ray, shaded at its end with lamps, their shadows and the environment; reflections in
  that surface show the environment. Rougher ones reflect the environment alone.
"""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels import ground_weathering
from gen_data.renderers.warp.realtime.kernels import lattice_lighting
from gen_data.renderers.warp.scene.kernels import (
    ambient_light,
    analytic_lights,
    environment_lighting,
    lattice,
    material_eval,
    records,
    texture_sampling,
)
from gen_data.renderers.warp.scene.kernels.alpha_test import OUT_OF_LINE, uv_at
from gen_data.renderers.warp.scene.kernels.brdf import (
    fresnel_dielectric,
    make_brdf,
    pane_reflectance,
    pane_transmittance,
    refract,
)
from gen_data.renderers.warp.scene.kernels.ray_queries import FARTHEST, closest_hit, passed_origin
from gen_data.renderers.warp.visibility.kernels import edge_detection, label_resolve

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 1})

# Ambient occlusion is traced only where a ray's end contributes more than this share of the pixel.
AMBIENT_SHARE = wp.constant(0.2)
# Ends of rays that contribute less than this share take fewer samples of each light.
SAMPLED_SHARE = wp.constant(0.6)
# Lamps with a smaller share of the light at a ray's end cast no visible shadows there.
FAINT_SHARE = wp.constant(1.0 / 256.0)
# Surfaces clearer than this show little but highlights: their shadows are not traced.
MOSTLY_CLEAR = wp.constant(0.9)
# Neighbours on a layered surface with more contrast than this are supersampled.
CONTRAST = wp.constant(0.15)
# Pixels with more of it take both further samples: next to a lamp or a window, whose luminance is
# tens of times larger, neighbours that take different ones would be white and dark in turn.
STARK_CONTRAST = wp.constant(0.5)
# Limit on the clear surfaces along one ray.
SURFACES_MAX = wp.constant(8)


@wp.struct
class Maps:
    """Values of a texture's further maps at a point.

    Attributes:
        metallic: Factor on metallic.
        occlusion: Factor on ambient light.
        glow: Factor on emission, linear RGB.
    """

    metallic: float
    occlusion: float
    glow: wp.vec3


@wp.func
def texels_per_m2(world: records.World, surface: int, hit: wp.vec2i):
    """Texels of the finest level per area of a face [1/m^2]."""
    texture = world.surfaces[surface].texture
    size = float(world.textures[texture].width * world.textures[texture].height)
    scale_m = world.surfaces[surface].texture_scale_m
    if scale_m > 0.0:
        wide = float(world.textures[texture].width) / scale_m
        return wide * wide
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    uv = world.geometries[g].uvs[corner[0]]
    d1 = world.geometries[g].uvs[corner[1]] - uv
    d2 = world.geometries[g].uvs[corner[2]] - uv
    p = records.vertex_at(world, g, corner[0])
    e1 = (records.vertex_at(world, g, corner[1]) - p) * world.bodies[b].scale
    e2 = (records.vertex_at(world, g, corner[2]) - p) * world.bodies[b].scale
    # Twice the face's area, as the UV determinant below is twice its area: the factors cancel.
    area_m2 = wp.max(wp.length(wp.cross(e1, e2)), 1.0e-12)
    return wp.abs(d1[0] * d2[1] - d1[1] * d2[0]) * size / area_m2


@wp.func
def texture_mix(texels: wp.array[wp.uint32], first: int, width: int, height: int, uv: wp.vec2):
    """Four channels of one mip level at a point, [0, 1]."""
    return texture_sampling.mix_texels(
        texels, texture_sampling.taps_at(first, width, height, uv[0], uv[1])
    ) * (1.0 / texture_sampling.FULL)


@wp.func
def maps_at(world: records.World, surface: int, hit: wp.vec2i, weight: wp.vec2, footprint_m: float):
    """The further maps of a surface at a point, averaged over a footprint."""
    maps = Maps()
    maps.metallic = 1.0
    maps.occlusion = 1.0
    maps.glow = wp.vec3(1.0)
    t = world.surfaces[surface].texture
    if t >= 0:
        if world.textures[t].has_shares + world.textures[t].has_glow > 0:
            u = records.first_weight(weight)
            weights = wp.vec3(1.0 - u - weight[1], u, weight[1])
            uv = uv_at(world, surface, hit[0], hit[1], weights)
            texels = texels_per_m2(world, surface, hit) * footprint_m * footprint_m
            s = texture_sampling.make_sampler(world, t, 0.5 * wp.log2(wp.max(texels, 1.0e-6)))
            # One level without blending: these maps are smooth.
            if world.textures[t].has_shares != 0:
                c = texture_mix(world.textures[t].shares, s.first, s.width, s.height, uv)
                maps.metallic = c[0]
                maps.occlusion = c[1]
            if world.textures[t].has_glow != 0:
                c = texture_mix(world.textures[t].glow, s.first, s.width, s.height, uv)
                maps.glow = wp.vec3(c[0] * c[0], c[1] * c[1], c[2] * c[2])
    return maps


@wp.struct
class SurfaceHit:
    """Intersection of a ray with a surface; ``hit`` is (-1, -1) for a miss.

    Attributes:
        t: Parameter along the ray.
        weight: Barycentric weights, as label_resolve.resolve stores them.
        normal: Smooth unit normal, facing against the ray.
        entering: 1 if the ray comes from outside.
    """

    hit: wp.vec2i
    t: float
    weight: wp.vec2
    normal: wp.vec3
    entering: int


@wp.func
def trace_surface(world: records.World, origin: wp.vec3, d: wp.vec3):
    """The first surface along a ray."""
    first = closest_hit(world, origin, d, FARTHEST, records.HOLES)
    m = SurfaceHit()
    m.hit = first.at
    m.t = first.t
    if m.hit[0] >= 0:
        g = world.bodies[m.hit[0]].geometry
        corner = records.face_vertices(world, g, m.hit[1])
        v = first.weight[0]
        w = first.weight[1]
        m.entering = wp.where(wp.dot(records.flat_normal(world, m.hit), d) < 0.0, 1, 0)
        n = (
            records.normal_at(world, g, corner[0]) * (1.0 - v - w)
            + records.normal_at(world, g, corner[1]) * v
        )
        n += records.normal_at(world, g, corner[2]) * w
        side = wp.where(m.entering != 0, 1.0, -1.0)
        m.normal = label_resolve.face_viewer(world.bodies[m.hit[0]].R_world_mesh @ n * side, d)
        # Adds 2 to the weight where the back of the face is hit, as records.is_back_face expects.
        m.weight = wp.vec2(v + 1.0 - side, w)
    return m


@wp.func
def curvature(world: records.World, hit: wp.vec2i):
    """Mean curvature of a face from its vertex normals [1/m]; positive where convex.

    Source: Akenine-Moeller et al., "Improved shader and texture level of detail using ray cones",
    JCGT 2021, equation 9.
    """
    g = world.bodies[hit[0]].geometry
    corner = records.face_vertices(world, g, hit[1])
    total = float(0.0)
    for k in range(3):
        i = corner[k]
        j = corner[(k + 1) % 3]
        way = records.vertex_at(world, g, j) - records.vertex_at(world, g, i)
        turn = records.normal_at(world, g, j) - records.normal_at(world, g, i)
        total += wp.dot(turn, way) / wp.max(wp.dot(way, way), 1.0e-12)
    return total / (3.0 * world.bodies[hit[0]].scale)


@wp.func
def lift_over_horizon(r: wp.vec3, n: wp.vec3):
    """Lift a reflected direction that bumps have turned below the surface."""
    # At least about one degree above the horizon: the ray must leave the surface.
    return records.fast_normalize(r + n * wp.max(0.02 - wp.dot(r, n), 0.0))


@wp.func(**OUT_OF_LINE)
def evaluate_with_maps(
    world: records.World,
    surface: int,
    hit: wp.vec2i,
    weight: wp.vec2,
    n: wp.vec3,
    width_m: float,
    v: wp.vec3,
):
    """Material of a surface with all its maps, and the further maps themselves."""
    material = material_eval.evaluate_material(world, surface, hit, weight, n, width_m, v)
    slant = wp.sqrt(wp.max(wp.dot(n, v), 0.05))
    maps = maps_at(world, surface, hit, weight, width_m / slant)
    material.metallic *= maps.metallic
    return material, maps


@wp.func
def find_visible_lamps(
    world: records.World,
    probe: lattice_lighting.Probe,
    m: SurfaceHit,
    origin: wp.vec3,
    side: wp.vec3,
    p: wp.vec3,
    share: float,
    k: int,
):
    """Visible fractions of the lamps that matter at the end of a ray, into ``probe.lit``.

    Args:
        origin: Origin of rays from there.
        side: As for light_at.
        share: As for light_at_hit.
    """
    parts = probe.parts
    if share < SAMPLED_SHARE * float(probe.few.shape[0]):
        parts = probe.centre
    faint_lux = FAINT_SHARE * wp.pi * wp.max(ambient_light.ambient_irradiance(world, p, m.normal))
    indoors = ambient_light.is_indoors(world, p)
    for j in range(world.lamps.shape[0]):
        # As in soft_shadows.weigh_lamps.
        if indoors and world.lamps[j].kind == analytic_lights.SUN:
            continue
        faint_lux += FAINT_SHARE * wp.max(analytic_lights.beam_from(world.lamps[j], p).normal_lux)
    for j in range(world.lamps.shape[0]):
        if wp.max(analytic_lights.beam_from(world.lamps[j], p).normal_lux) > faint_lux:
            probe.lit[j, k] = lattice_lighting.visible_lamp_fraction(
                world, world.lamps[j], p, origin, m.normal, side, parts
            )


@wp.func
def light_at_hit(
    world: records.World,
    probe: lattice_lighting.Probe,
    m: SurfaceHit,
    material: material_eval.SurfaceMaterial,
    occlusion: float,
    p: wp.vec3,
    d: wp.vec3,
    share: float,
    clear: float,
    sample: int,
    k: int,
):
    """Light of the surface at the end of a ray, towards the ray's origin [cd/m^2].

    Args:
        share: Largest weight of that light in the pixel.
        clear: Share of clear glass, whose highlights need no shadows.
        sample: Number of the pixel's sample.
    """
    origin = lattice.ray_origin(world, m.hit, m.weight, p, d)
    surface = records.surface_index(world, m.hit)
    side = material_eval.sheet_normal(world, surface, m.hit, m.weight)
    # Scratch memory holds values of earlier rays: set every lamp.
    for j in range(world.lamps.shape[0]):
        probe.lit[j, k] = 1.0
    if clear < MOSTLY_CLEAR:
        find_visible_lamps(world, probe, m, origin, side, p, share, k)
    open_sky = occlusion
    disc = probe.disc
    if share < SAMPLED_SHARE * float(probe.few.shape[0]):
        disc = probe.few[sample]
    if share > AMBIENT_SHARE and clear < MOSTLY_CLEAR:
        open_sky *= lattice_lighting.visible_sky_fraction(
            world, m.hit[0], p, origin, m.normal, side, disc, probe.radius_m
        )
    return lattice_lighting.light_at(world, surface, material, side, p, -d, probe.lit, open_sky, k)


@wp.struct
class Ray:
    """A secondary ray that leaves a layered surface.

    Attributes:
        share: Weight of its radiance in the pixel.
        roughness: Roughness of the reflecting layer, by which the sky is blurred.
        spread: Opening angle of its cone [rad]; ``width_m`` is the cone's width at its origin.
        mirrored: 1 for reflections, which show the sky even where pixels do not.
    """

    origin: wp.vec3
    d: wp.vec3
    share: wp.vec3
    roughness: float
    width_m: float
    spread: float
    mirrored: int


@wp.func
def sky_along(world: records.World, ray: Ray):
    """Radiance of the sky along a ray that hits nothing."""
    c = wp.vec3(0.0)
    if ray.mirrored != 0:
        # Prefiltered maps lack the parts that lamps represent; the difference adds them in their
        # own shape.
        c = environment_lighting.sky_reflection(world.sky, ray.d, ray.roughness)
        c += environment_lighting.sky_image(world.sky, ray.d) - environment_lighting.sky_rest(
            world.sky, ray.d
        )
    elif world.sky.visible != 0:
        c = environment_lighting.sky_image(world.sky, ray.d)
    return c


@wp.func
def sqrt_color(color: wp.vec3):
    """The square root of a colour, channel by channel."""
    return wp.vec3(wp.sqrt(color[0]), wp.sqrt(color[1]), wp.sqrt(color[2]))


@wp.func
def continue_ray(
    world: records.World,
    ray: Ray,
    m: SurfaceHit,
    material: material_eval.SurfaceMaterial,
    clear: float,
    opacity: float,
):
    """The ray behind a surface, with its direction and weight.

    Args:
        clear: Share of the light below the specular layer that is transmitted.
    """
    surface = records.surface_index(world, m.hit)
    c = wp.min(-wp.dot(ray.d, m.normal), 1.0)
    ior = world.surfaces[surface].ior
    onward = ray.share * (1.0 - opacity)
    way = ray.d
    if clear > 0.0:
        if world.surfaces[surface].thin != 0:
            f = fresnel_dielectric(c, ior)
            passed = pane_transmittance(f, material.albedo)
            onward += wp.cw_mul(ray.share, passed) * (clear * opacity)
        else:
            eta = wp.where(m.entering != 0, ior, 1.0 / ior)
            way = refract(ray.d, m.normal, eta)
            f = fresnel_dielectric(c, eta)
            onward += wp.cw_mul(ray.share, sqrt_color(material.albedo)) * (
                (1.0 - f) * clear * opacity
            )
            side = wp.where(m.entering != 0, 1.0, -1.0)
            # Refraction at a curved surface focuses or spreads the ray's cone (Akenine-Moeller et
            # al. 2021).
            ray.spread -= (1.0 - 1.0 / eta) * side * curvature(world, m.hit) * ray.width_m
            if wp.dot(way, way) == 0.0:
                # Total internal reflection.
                way = ray.d + m.normal * (2.0 * c)
                onward = ray.share * (clear * opacity)
    ray.share = onward
    ray.d = way
    return ray


@wp.func
def radiance_along(
    view: records.View,
    world: records.World,
    probe: lattice_lighting.Probe,
    ray: Ray,
    sample: int,
    k: int,
):
    """Weighted radiance along a ray, including surfaces behind clear ones."""
    total = wp.vec3(0.0)
    surfaces = int(0)
    going = bool(True)
    while going:
        going = False
        m = trace_surface(world, ray.origin, ray.d)
        if m.hit[0] < 0:
            total += wp.cw_mul(ray.share, sky_along(world, ray))
        else:
            p = ray.origin + ray.d * m.t
            # A cone that converges has a focus; behind it the width grows again.
            ray.width_m = wp.abs(ray.width_m + ray.spread * m.t)
            surface = records.surface_index(world, m.hit)
            v = -ray.d
            n = m.normal
            material, maps = evaluate_with_maps(world, surface, m.hit, m.weight, n, ray.width_m, v)
            if world.ground.covered != 0:
                lifted = lattice.ray_origin(world, m.hit, m.weight, p, ray.d)
                exposed = lattice_lighting.sky_exposure_at(world, m.hit[0], lifted, n)
                coat = ground_weathering.coat_at(world, surface, p, n, exposed, ray.width_m)
                material = ground_weathering.apply_coat(world, surface, material, coat, n)
            clear = world.surfaces[surface].transmission * (1.0 - material.metallic)
            opacity = world.surfaces[surface].opacity
            # Inside a solid only the transmitted ray counts: the back of its surface reflects no
            # light.
            if clear == 0.0 or m.entering != 0 or world.surfaces[surface].thin != 0:
                share = wp.max(ray.share)
                light = light_at_hit(
                    world, probe, m, material, maps.occlusion, p, ray.d, share, clear, sample, k
                )
                own = wp.cw_mul(light.diffuse, material.albedo) * (1.0 - clear) + light.rest
                own += wp.cw_mul(world.surfaces[surface].emission_cd_m2, maps.glow - wp.vec3(1.0))
                total += wp.cw_mul(ray.share, own) * opacity
            if clear > 0.0 or opacity < 1.0:
                ray = continue_ray(world, ray, m, material, clear, opacity)
                ray.origin = passed_origin(p, ray.d, view.eye_m)
                surfaces += 1
                # Weights below 0.2 % are invisible; the sky stands in for whatever the ray would
                # still hit.
                going = surfaces < SURFACES_MAX and wp.max(ray.share) > 0.002
                if not going:
                    total += wp.cw_mul(ray.share, sky_along(world, ray))
    return total


@wp.struct
class Layers:
    """Shaded layers of a surface at a pixel.

    Attributes:
        own: Light that needs no secondary ray [cd/m^2].
        mirror, coat, behind: Weights of the rays that the base and the coat reflect, and of the
            refracted ray; 0 if no ray is needed.
        straight: Weight of the unrefracted background.
        n: Normal with bumps.
    """

    own: wp.vec3
    mirror: wp.vec3
    coat: float
    behind: wp.vec3
    straight: float
    n: wp.vec3


@wp.func
def glass_shares(world: records.World, surface: int, albedo: wp.vec3, c: float):
    """Reflectance and transmittance of glass from outside, at the cosine ``c`` of incidence."""
    f = fresnel_dielectric(c, world.surfaces[surface].ior)
    mirrored = wp.vec3(f)
    passed = sqrt_color(albedo) * (1.0 - f)
    if world.surfaces[surface].thin != 0:
        mirrored = pane_reflectance(f, albedo)
        passed = pane_transmittance(f, albedo)
    return mirrored, passed


@wp.func
def add_clearcoat(
    world: records.World,
    surface: int,
    layers: Layers,
    coat: float,
    n: wp.vec3,
    p: wp.vec3,
    v: wp.vec3,
    lit: wp.array2d[float],
    open_sky: float,
    k: int,
):
    """Add a clear coat of the given weight, which attenuates all layers below it."""
    c = wp.clamp(wp.dot(n, v), 0.0, 1.0)
    rough = world.surfaces[surface].coat_roughness
    lacquer = make_brdf(world.lobes, wp.vec3(0.0), rough, 0.0, 0.5, c)
    share = coat * lacquer.gloss[0]
    lamps = lattice_lighting.sum_lamp_light(world, lacquer, n, wp.vec3(0.0), p, v, lit, k)
    layers.own = layers.own * (1.0 - share) + lamps.shine * coat
    layers.mirror = layers.mirror * (1.0 - share)
    layers.behind = layers.behind * (1.0 - share)
    if lacquer.roughness < records.MIRROR_ROUGHNESS:
        layers.coat = share
        # The reflected ray will find these lamps itself: do not count them twice.
        layers.own -= lamps.shown * coat
    else:
        sky = ambient_light.ambient_reflection(world, p, n * (2.0 * c) - v, lacquer.roughness)
        layers.own += sky * (share * lattice_lighting.specular_occlusion(lacquer, open_sky))
    return layers


@wp.func
def layers_at(
    world: records.World,
    surface: int,
    material: material_eval.SurfaceMaterial,
    maps: Maps,
    bare: float,
    n: wp.vec3,
    side: wp.vec3,
    p: wp.vec3,
    v: wp.vec3,
    lit: wp.array2d[float],
    open_sky: float,
    k: int,
):
    """Split a pixel's light into its own part and the weights of secondary rays.

    Args:
        bare: Share that no snow covers.
        n: Normal without bumps.
        side: As for light_at.
    """
    layers = Layers()
    layers.n = material.normal
    n_v = wp.dot(material.normal, v)
    clear = world.surfaces[surface].transmission * (1.0 - material.metallic) * bare
    specular = material.specular
    if clear > 0.0:
        ior = world.surfaces[surface].ior
        # F0 of the refractive index, expressed as Burley's ``specular`` (0.08 at 1).
        normal = (ior - 1.0) / (ior + 1.0)
        specular = normal * normal / 0.08
    brdf = make_brdf(
        world.lobes, material.albedo, material.roughness, material.metallic, specular, n_v
    )
    gloss = brdf.gloss
    if clear > 0.0:
        c = wp.clamp(wp.dot(n, v), 0.0, 1.0)
        mirrored, passed = glass_shares(world, surface, material.albedo, c)
        gloss = gloss * (1.0 - clear) + mirrored * clear
        layers.behind = passed * clear
    lamps = lattice_lighting.sum_lamp_light(world, brdf, material.normal, side, p, v, lit, k)
    ambient = ambient_light.received_ambience(world, p, material.normal, open_sky)
    diffuse = wp.cw_mul(brdf.matte, material.albedo) * (1.0 - clear)
    received = lamps.lux * (1.0 / wp.pi) + ambient
    if wp.dot(side, side) > 0.0:
        behind = ambient_light.received_ambience(world, p, -material.normal, open_sky)
        behind += lamps.behind * (1.0 / wp.pi)
        received += wp.cw_mul(material.translucency, behind)
    layers.own = wp.cw_mul(diffuse, received) + lamps.shine
    layers.own += wp.cw_mul(world.surfaces[surface].emission_cd_m2, maps.glow)
    if brdf.roughness < records.MIRROR_ROUGHNESS and (material.metallic >= 0.5 or clear > 0.0):
        layers.mirror = gloss
        # The reflected ray will find these lamps itself: do not count them twice.
        layers.own -= lamps.shown
    else:
        # Rough layers reflect the prefiltered environment, dimmed by specular occlusion.
        sky = ambient_light.ambient_reflection(
            world, p, material.normal * (2.0 * n_v) - v, brdf.roughness
        )
        layers.own += wp.cw_mul(gloss, sky) * lattice_lighting.specular_occlusion(brdf, open_sky)
    coat = world.surfaces[surface].coat * bare
    if coat > 0.0:
        layers = add_clearcoat(world, surface, layers, coat, n, p, v, lit, open_sky, k)
    opacity = 1.0 - (1.0 - world.surfaces[surface].opacity) * bare
    layers.own = layers.own * opacity
    layers.mirror = layers.mirror * opacity
    layers.coat = layers.coat * opacity
    layers.behind = layers.behind * opacity
    layers.straight = 1.0 - opacity
    return layers


@wp.func
def make_layer_ray(
    view: records.View,
    world: records.World,
    layers: Layers,
    part: int,
    hit: wp.vec2i,
    weight: wp.vec2,
    n: wp.vec3,
    p: wp.vec3,
    way: wp.vec3,
    width_m: float,
):
    """One secondary ray of a pixel: 0 base reflection, 1 coat, 2 refracted, 3 straight behind.

    Its weight is 0 where there is none.
    """
    ray = Ray()
    surface = records.surface_index(world, hit)
    d = records.fast_normalize(way)
    ray.d = d
    ray.width_m = width_m
    ray.spread = width_m / wp.max(wp.length(way), 1.0e-6)
    if part < 2:
        m = n
        ray.share = wp.vec3(layers.coat)
        ray.roughness = world.surfaces[surface].coat_roughness
        if part == 0:
            m = layers.n
            ray.share = layers.mirror
            ray.roughness = world.surfaces[surface].roughness
        ray.d = lift_over_horizon(d - m * (2.0 * wp.dot(m, d)), n)
        ray.origin = lattice.ray_origin(world, hit, weight, p, way)
        ray.mirrored = 1
        side = wp.where(records.is_back_face(weight), -1.0, 1.0)
        # A convex mirror widens the ray's cone by twice the turn of its normal (Akenine-Moeller et
        # al. 2021).
        ray.spread += 2.0 * side * curvature(world, hit) * width_m
    else:
        ray.share = wp.vec3(layers.straight)
        if part == 2:
            ray.share = layers.behind
            if world.surfaces[surface].thin != 0:
                ray.share += wp.vec3(layers.straight)
            else:
                ior = world.surfaces[surface].ior
                eta = wp.where(records.is_back_face(weight), 1.0 / ior, ior)
                bent = refract(d, layers.n, eta)
                side = wp.where(records.is_back_face(weight), -1.0, 1.0)
                ray.spread -= (1.0 - 1.0 / eta) * side * curvature(world, hit) * width_m
                if wp.dot(bent, bent) > 0.0:
                    ray.d = bent
        elif world.surfaces[surface].thin != 0:
            # Already part of the refracted ray: a pane bends nothing.
            ray.share = wp.vec3(0.0)
        ray.origin = passed_origin(p, ray.d, view.eye_m)
    return ray


# Two kernels call this function: compiled out of line, it exists once.
@wp.func(**OUT_OF_LINE)
def layered_radiance(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    x_px: float,
    y_px: float,
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    sample: int,
    k: int,
):
    """Radiance of the layered surface of the k-th pixel, at a point of the image within it.

    Args:
        sample: Number of the pixel's sample.
    """
    i = listed.pixels[k]
    hit = images.hits[i]
    surface = records.surface_index(world, hit)
    point = label_resolve.point_at(view, world, hit, x_px, y_px)
    n = point.normal
    v = records.fast_normalize(-point.way)
    p = view.eye_m + point.way
    width_m = records.pixel_width(view, i, images.z_m[i])
    material, maps = evaluate_with_maps(world, surface, hit, point.weight, n, width_m, v)
    bare = float(1.0)
    if world.ground.covered != 0:
        coat = ground_weathering.coat_at(
            world, surface, p, n, listed.exposed[k], ground_weathering.footprint(view, p, n, 1.0)
        )
        material = ground_weathering.apply_coat(world, surface, material, coat, n)
        bare = 1.0 - wp.min(coat.snow, 1.0)
    sky = listed.open_sky[0, k] * maps.occlusion
    side = material_eval.sheet_normal(world, surface, hit, point.weight)
    layers = layers_at(world, surface, material, maps, bare, n, side, p, v, listed.lit, sky, k)
    c = layers.own
    for part in range(4):
        ray = make_layer_ray(view, world, layers, part, hit, point.weight, n, p, point.way, width_m)
        if wp.max(ray.share) > 0.0:
            c += radiance_along(view, world, probe, ray, sample, k)
    return c


@wp.kernel
def shade_layers(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    radiance: wp.array[wp.vec3],
):
    """Shade the listed pixels that show layered surfaces, each by itself."""
    k = wp.tid()
    i = listed.pixels[k]
    # lattice_lighting.shade_points has shaded all others.
    if world.surfaces[records.surface_index(world, images.hits[i])].layered != 0:
        x = float(i % view.width) + 0.5
        y = float(i / view.width) + 0.5
        radiance[i] = layered_radiance(view, world, images, x, y, listed, probe, 0, k)


@wp.func
def contrast(a: wp.vec3, b: wp.vec3):
    """Michelson contrast of two colours' channel sums, 0 to 1."""
    light = a[1] + a[0] + a[2]
    other = b[1] + b[0] + b[2]
    return wp.abs(light - other) / wp.max(light + other, 1.0e-12)


@wp.func
def contrast_around(
    view: records.View, images: records.GBufferRecord, radiance: wp.array[wp.vec3], i: int
):
    """Largest contrast between a pixel and its four neighbours that show the same body."""
    x = i % view.width
    y = i / view.width
    largest = float(0.0)
    for side in range(4):
        # Sides 0 to 3 are below, right, above and left.
        u = wp.clamp(x + (side & 1) * (1 - (side & 2)), 0, view.width - 1)
        v = wp.clamp(y + (1 - (side & 1)) * (1 - (side & 2)), 0, view.height - 1)
        j = v * view.width + u
        if images.hits[j][0] == images.hits[i][0]:
            largest = wp.max(largest, contrast(radiance[i], radiance[j]))
    return largest


@wp.kernel
def find_contrasts(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    listed: lattice_lighting.ListedPixels,
    radiance: wp.array[wp.vec3],
    count: wp.array[int],
    places: wp.array[int],
):
    """List the layered pixels among listed ones that show edges by reflection or refraction.

    Args:
        count: Length of the new list; 0 at first.
        places: The new list, in any order.
    """
    k = wp.tid()
    i = listed.pixels[k]
    if world.surfaces[records.surface_index(world, images.hits[i])].layered == 0:
        return
    if contrast_around(view, images, radiance, i) > CONTRAST:
        places[wp.atomic_add(count, 0, 1)] = k


@wp.kernel
def shade_contrasts(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    places: wp.array[int],
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    offsets: wp.array[wp.vec2],
    white: float,
    brightest: float,
    radiance: wp.array[wp.vec3],
    pixels: wp.array[int],
    mixed: wp.array[wp.vec3],
):
    """Radiance of pixels with contrasts: the mean over their centre and one or two more points.

    Args:
        offsets: Two positions within a pixel, [0, 1); neighbours take one of them in turn, or both
            where contrasts are stark, and in means of tones.
        white, brightest: As for msaa.mix_samples.
        radiance: Radiance of the centres.
        pixels: The pixels.
        mixed: Result, in their order.
    """
    place = wp.tid()
    k = places[place]
    i = listed.pixels[k]
    x = i % view.width
    y = i / view.width
    total = edge_detection.to_tone(radiance[i], white, brightest)
    count = float(1.0)
    both = white > 0.0 or contrast_around(view, images, radiance, i) > STARK_CONTRAST
    for s in range(2):
        if both or s == ((x + y) & 1):
            x_px = float(x) + offsets[s][0]
            y_px = float(y) + offsets[s][1]
            sample = layered_radiance(view, world, images, x_px, y_px, listed, probe, s, k)
            total += edge_detection.to_tone(sample, white, brightest)
            count += 1.0
    pixels[place] = i
    mixed[place] = edge_detection.from_tone(total / count, white)
