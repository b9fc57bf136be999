"""Path integrator: one thread per pixel, one path after another.

Source: Kajiya, "The rendering equation", SIGGRAPH 1986, with next-event estimation, multiple
importance sampling and Russian roulette as in Pharr, Jakob and Humphreys, "Physically Based
Rendering", 4th ed., chapters 13 and 14.

Every vertex samples one light source and continues in one direction. One component of a mixed
material, such as glass and paint, is chosen at random: a vertex has a single BSDF. Clear panes and
opacity refract nothing: paths and shadow rays pass straight through them.
"""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels import ground_weathering, water_reflections
from gen_data.renderers.warp.pathtraced.kernels import emitters, sampler
from gen_data.renderers.warp.pathtraced.kernels.bsdf import (
    COAT_F0,
    Bsdf,
    Scattering,
    evaluate,
    make_bsdf,
    make_interface,
    roughness_to_alpha,
    scatter,
    scatter_glass,
)
from gen_data.renderers.warp.realtime.kernels import clearcoat_glass, soft_shadows
from gen_data.renderers.warp.scene.kernels import analytic_lights, brdf, ray_queries
from gen_data.renderers.warp.scene.kernels.alpha_test import OUT_OF_LINE
from gen_data.renderers.warp.scene.kernels.material_eval import SurfaceMaterial, evaluate_material
from gen_data.renderers.warp.scene.kernels.records import (
    HOLES,
    View,
    World,
    face_vertices,
    fast_normalize,
    is_in_view,
    normal_at,
    pixel_direction,
    pixel_width,
    surface_index,
    vertex_at,
)
from gen_data.renderers.warp.visibility.kernels import label_resolve, rasterizer

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Limit on straight passages, which are not counted as bounces.
PASSAGES_MAX = wp.constant(64)
# Russian roulette: paths whose throughput falls below this share of that after the first surface
# survive at random, and then with this throughput: dark surfaces are sampled as well as bright
# ones. Measured: half the variance, for the same time, of survival in proportion to throughput.
SURVIVAL_SHARE = wp.constant(0.25)
# Rougher panes scatter the light that they transmit.
CLEAR_ROUGHNESS = wp.constant(0.1)
# Lower bound on the probabilities of reflection and of transmission at an interface.
PROBABILITY_FLOOR = wp.constant(0.02)
# Pairs of random numbers per path segment.
PAIRS = wp.constant(4)


@wp.struct
class Budget:
    """Number of samples and bounces of an image.

    Attributes:
        first: Number of the first sample.
        samples: Samples of this launch.
        whole: Samples per pixel in all launches.
        sample_bits: Bits that number all samples.
        bounces: Maximum number of scattering events.
        key: Key of the image's noise.
        clear: 1 if some surface transmits light straight and shadow rays have to accumulate
            transmittance.
        lights: Bits of techniques: 1 samples light sources, 2 hits them by BSDF sampling; 3 for
            images, the others to validate one against the other.
    """

    first: int
    samples: int
    whole: int
    sample_bits: int
    bounces: int
    key: wp.uint32
    clear: int
    lights: int


@wp.struct
class Vertex:
    """A surface point on a path.

    Attributes:
        p: Position in the world [m].
        flat: Geometric normal on the side that the path comes from.
        look: Material; its normal is the shading normal.
        surface: Index of the material.
        outside: Whether that side is the face's front.
        glow: Emission [cd/m^2].
        clear: Share of the light below the specular layer that is transmitted.
        opacity: Share of the background that it hides.
        film, film_f0, film_roughness: Weight, F0 and roughness of a coat or a film of water.
    """

    p: wp.vec3
    flat: wp.vec3
    material: SurfaceMaterial
    surface: int
    outside: bool
    glow: wp.vec3
    clear: float
    opacity: float
    film: float
    film_f0: float
    film_roughness: float


@wp.struct
class Anchor:
    """The last vertex that scattered, for MIS weights of the sources that its ray hits.

    Attributes:
        p: Origin of the ray.
        n: Normal there.
        sheet: 1 if it is lit from both sides.
        density: Density of the direction; negative if no source was sampled there.
        total: Sum of all source weights there [lx].
        way_m: Distance from there to the path's current segment.
    """

    p: wp.vec3
    n: wp.vec3
    sheet: int
    density: float
    total: float
    way_m: float


@wp.func
def make_vertex(world: World, hit: ray_queries.RayHit, d: wp.vec3, width_m: float):
    """The vertex at a hit, with its layers and weather."""
    b = hit.at[0]
    g = world.bodies[b].geometry
    corner = face_vertices(world, g, hit.at[1])
    p0 = vertex_at(world, g, corner[0])
    R = world.bodies[b].R_world_mesh
    v = Vertex()
    e1 = vertex_at(world, g, corner[1]) - p0
    e2 = vertex_at(world, g, corner[2]) - p0
    m = p0 + e1 * hit.weight[0] + e2 * hit.weight[1]
    # From barycentric weights: more accurate than the ray's parameter at a distance.
    v.p = R @ (m * world.bodies[b].scale) + world.bodies[b].t_world_mesh
    v.flat = R @ fast_normalize(wp.cross(e1, e2))
    v.outside = wp.dot(v.flat, d) < 0.0
    side = wp.where(v.outside, 1.0, -1.0)
    v.flat = v.flat * side
    n = normal_at(world, g, corner[0]) * (1.0 - hit.weight[0] - hit.weight[1])
    n += normal_at(world, g, corner[1]) * hit.weight[0]
    n += normal_at(world, g, corner[2]) * hit.weight[1]
    # Interpolated normals may face away from the ray; the BSDF needs a positive cosine.
    smooth = label_resolve.face_viewer((R @ n) * side, d)
    v.surface = surface_index(world, hit.at)
    weight = wp.vec2(hit.weight[0] + 1.0 - side, hit.weight[1])
    v.material = evaluate_material(world, v.surface, hit.at, weight, smooth, width_m, -d)
    v.glow = world.surfaces[v.surface].emission_cd_m2
    v.opacity = 1.0
    if world.surfaces[v.surface].layered != 0:
        v = add_layers(world, v, hit.at, weight, width_m)
    if world.ground.covered != 0:
        v = add_weather(world, v, b, smooth, width_m)
    v.material.normal = label_resolve.face_viewer(v.material.normal, d)
    return v


@wp.func(**OUT_OF_LINE)
def add_layers(world: World, v: Vertex, at: wp.vec2i, weight: wp.vec2, width_m: float):
    """Add further maps, transmission, opacity and coat to a vertex."""
    maps = clearcoat_glass.maps_at(world, v.surface, at, weight, width_m)
    v.material.metallic *= maps.metallic
    v.glow = wp.cw_mul(v.glow, maps.glow)
    v.clear = world.surfaces[v.surface].transmission * (1.0 - v.material.metallic)
    if v.clear > 0.0:
        ior = world.surfaces[v.surface].ior
        # F0 of the refractive index, expressed as Burley's ``specular`` (0.08 at 1).
        normal = (ior - 1.0) / (ior + 1.0)
        v.material.specular = normal * normal / 0.08
    v.opacity = world.surfaces[v.surface].opacity
    v.film = world.surfaces[v.surface].coat
    v.film_f0 = COAT_F0
    v.film_roughness = world.surfaces[v.surface].coat_roughness
    return v


@wp.func(**OUT_OF_LINE)
def add_weather(world: World, v: Vertex, b: int, n: wp.vec3, width_m: float):
    """Add water and snow to a vertex on body b; ``n`` is its normal without bumps."""
    exposed = float(1.0)
    if n[2] > 0.1:
        exposed = ray_queries.precipitation_exposure(
            world, b, ray_queries.offset_origin(v.p, v.flat)
        )
    coat = ground_weathering.coat_at(world, v.surface, v.p, n, exposed, width_m)
    v.material = ground_weathering.apply_coat(world, v.surface, v.material, coat, n)
    bare = 1.0 - wp.min(coat.snow, 1.0)
    v.clear *= bare
    v.film *= bare
    v.opacity = 1.0 - (1.0 - v.opacity) * bare
    wet = water_reflections.water_at(world, v.surface, v.p, n, exposed, width_m)
    # A vertex has one film: the stronger of coat and water.
    if wet[0] > v.film:
        v.film = wet[0]
        v.film_f0 = brdf.WATER_F0
        v.film_roughness = wp.sqrt(wet[1])
    return v


@wp.func
def straight_transmittance(world: World, v: Vertex, d: wp.vec3):
    """Transmittance without refraction: opacity below 1, and clear panes."""
    through = wp.vec3(1.0, 1.0, 1.0) * (1.0 - v.opacity)
    if v.clear > 0.0 and is_clear_pane(world, v.surface):
        cosine = wp.min(wp.abs(wp.dot(v.material.normal, d)), 1.0)
        f = brdf.fresnel_dielectric(cosine, world.surfaces[v.surface].ior)
        through += brdf.pane_transmittance(f, v.material.albedo) * (v.opacity * v.clear)
    return through


@wp.func
def is_clear_pane(world: World, surface: int):
    """Whether a surface transmits light without scattering or refracting it."""
    smooth = world.surfaces[surface].roughness < CLEAR_ROUGHNESS
    return world.surfaces[surface].thin != 0 and smooth


@wp.func
def may_pass_straight(world: World, surface: int):
    """Whether light may pass a surface in a straight line."""
    pane = world.surfaces[surface].transmission > 0.0 and is_clear_pane(world, surface)
    return pane or world.surfaces[surface].opacity < 1.0


@wp.func
def transmittance(world: World, o: wp.vec3, d: wp.vec3, distance_m: float, clear: int):
    """Transmittance of a segment, 0 if it is blocked."""
    through = wp.vec3(1.0, 1.0, 1.0)
    if clear != 0:
        through = pane_chain_transmittance(world, o, d, distance_m)
    elif ray_queries.is_intersected(world, ray_queries.path_along(o, d * distance_m), HOLES):
        through = wp.vec3(0.0)
    return through


@wp.func(**OUT_OF_LINE)
def pane_chain_transmittance(world: World, o: wp.vec3, d: wp.vec3, distance_m: float):
    """Transmittance of a segment that may pass several clear surfaces."""
    through = wp.vec3(1.0, 1.0, 1.0)
    origin = o
    rest_m = distance_m
    passages = int(0)
    going = bool(True)
    while going:
        # March from surface to surface until the light or an opaque surface is reached.
        hit = ray_queries.closest_hit(world, origin, d, rest_m, HOLES)
        going = False
        if hit.at[0] >= 0:
            leaves = wp.vec3(0.0)
            if may_pass_straight(world, surface_index(world, hit.at)):
                v = make_vertex(world, hit, d, 0.0)
                leaves = straight_transmittance(world, v, d)
                origin = ray_queries.offset_origin(v.p, -v.flat)
            through = wp.cw_mul(through, leaves)
            passages += 1
            rest_m -= hit.t
            if passages == PASSAGES_MAX:
                through = wp.vec3(0.0)
            going = wp.max(through) > 0.0 and rest_m > 0.0
    return through


@wp.func
def hit_lamp_light(world: World, budget: Budget, a: Anchor, d: wp.vec3, end_m: float):
    """MIS-weighted light of the lamps on a ray's segment that ends at ``end_m`` from the anchor.

    Also 1 if a lamp is shown by the body at the segment's end, whose emission is then the lamp's
    own.
    """
    light = wp.vec3(0.0)
    shown = int(0)
    for j in range(world.lamps.shape[0]):
        g = emitters.intersect_lamp(world.lamps[j], a.p, d)
        # Straight passages split the ray: each lamp counts in one segment only.
        if g.distance_m > a.way_m and g.distance_m < end_m:
            part = float(1.0)
            if a.density >= 0.0 and budget.lights != 2:
                # Density of the other technique: the source's share of all weights, times its
                # density.
                weight = emitters.lamp_weight_at(world.lamps[j], a.p, a.n, a.sheet)
                asked = g.density * weight / wp.max(a.total, 1.0e-20)
                # If only source sampling is under test (1), hits count for nothing.
                part = emitters.power_heuristic(a.density, asked) * float(budget.lights >> 1)
            light += g.radiance * part
            shown = wp.max(shown, world.lamps[j].shown)
    return light, shown


@wp.func
def hit_sky_light(world: World, table: emitters.SkyTable, budget: Budget, a: Anchor, d: wp.vec3):
    """MIS-weighted light of the environment that a ray hits."""
    light = wp.vec3(0.0)
    if world.sky.luminance > 0.0:
        place = emitters.sky_place(world.sky, d)
        part = float(1.0)
        if a.density >= 0.0 and budget.lights != 2 and table.part > 0.0:
            asked = emitters.sky_density(table, place) * emitters.sky_weight_at(
                world.sky, table, a.n, a.sheet
            )
            asked = asked / wp.max(a.total, 1.0e-20)
            part = emitters.power_heuristic(a.density, asked) * float(budget.lights >> 1)
        light = emitters.sky_light(world.sky, place) * part
    return light


@wp.func
def to_shading_frame(v: wp.vec3, x: wp.vec3, y: wp.vec3, n: wp.vec3):
    """World vector in the shading frame."""
    return wp.vec3(wp.dot(x, v), wp.dot(y, v), wp.dot(n, v))


@wp.func
def sample_source(
    world: World,
    table: emitters.SkyTable,
    budget: Budget,
    s: Bsdf,
    v: Vertex,
    o: wp.vec3,
    x: wp.vec3,
    y: wp.vec3,
    choice: emitters.SourceChoice,
    u: wp.vec2,
):
    """Reflected light of one sampled source; x, y complete the vertex's shading frame."""
    light = wp.vec3(0.0)
    g = emitters.LightSample()
    if choice.source == emitters.SKY:
        g = emitters.draw_sky(world.sky, table, u)
    elif analytic_lights.is_panel(world.lamps[choice.source]):
        g = emitters.draw_panel(world.lamps[choice.source], o, u)
    else:
        g = emitters.draw_ball(world.lamps[choice.source], o, u)
    l = to_shading_frame(g.direction, x, y, v.material.normal)  # noqa: E741
    # Above both horizons: light must not leak through a face because of its shading normal. Sheets
    # are lit from either side.
    before = wp.dot(g.direction, v.flat) > 0.0
    if g.distance_m > 0.0 and ((l[2] > 0.0 and before) or s.p_passed > 0.0):
        f, density = evaluate(s, l)
        asked = g.density * choice.part
        f = wp.cw_mul(f, g.radiance)
        if asked > 0.0 and wp.max(f) > 0.0:
            part = float(1.0)
            # As the only technique it carries all light and needs no weight.
            if budget.lights == 3:
                part = emitters.power_heuristic(asked, density)
            # The shadow ray comes last: it is the most expensive part.
            start = o
            if not before:
                start = ray_queries.offset_origin(v.p, -v.flat)
            through = transmittance(world, start, g.direction, g.distance_m, budget.clear)
            light = wp.cw_mul(f, through) * (part / asked)
    return light


@wp.struct
class ChosenLobe:
    """The BSDF lobe of a vertex, after random selection.

    Attributes:
        kind: One of OPAQUE, STRAIGHT, SOLID and ROUGH_PANE.
        bsdf: BSDF of the reflected part.
        weight: Transmittance over the probability of transmission.
    """

    kind: int
    bsdf: Bsdf
    weight: wp.vec3


OPAQUE = wp.constant(0)
STRAIGHT = wp.constant(1)
SOLID = wp.constant(2)
ROUGH_PANE = wp.constant(3)


@wp.func
def reflection_probability(reflected: float, passed: float):
    """Probability of choosing reflection, in proportion to luminance but bounded."""
    p = reflected / wp.max(reflected + passed, 1.0e-9)
    if passed > 0.0:
        p = wp.clamp(p, PROBABILITY_FLOOR, 1.0 - PROBABILITY_FLOOR)
    return p


@wp.func(**OUT_OF_LINE)
def choose_glass_lobe(world: World, v: Vertex, w: wp.vec3, xi: float):
    """Glass; for panes, choose between reflection and transmission.

    ``w`` points to where the path comes from.
    """
    out = ChosenLobe()
    tint = v.material.albedo
    alpha = roughness_to_alpha(v.material.roughness)
    ior = world.surfaces[v.surface].ior
    if world.surfaces[v.surface].thin != 0:
        f = brdf.fresnel_dielectric(w[2], ior)
        back = brdf.pane_reflectance(f, tint)
        on = brdf.pane_transmittance(f, tint)
        p = reflection_probability(brdf.luminance(back), brdf.luminance(on))
        out.bsdf = make_interface(w, alpha, 0.0)
        out.bsdf.f0 = wp.vec3(1.0, 1.0, 1.0)
        out.bsdf.f90 = 1.0
        # Divided by the probability of the choice: the estimate stays unbiased.
        out.weight = on * (1.0 / (1.0 - p))
        # Multiple scattering returns the light that rough facets mask.
        part = brdf.directional_albedo(world.lobes, wp.sqrt(alpha), w[2])
        # At F0 1 single scattering would lose energy: it is restored.
        boost = 1.0 / (part[0] + part[1])
        out.bsdf.scale = back * (boost / p)
        if xi < p:
            out.kind = OPAQUE
        elif is_clear_pane(world, v.surface):
            out.kind = STRAIGHT
        else:
            out.kind = ROUGH_PANE
            out.bsdf.scale = wp.vec3(boost, boost, boost)
    else:
        out.bsdf = make_interface(w, alpha, wp.where(v.outside, ior, 1.0 / ior))
        # Half of the tint on entry, the other half on exit.
        out.weight = wp.vec3(wp.sqrt(tint[0]), wp.sqrt(tint[1]), wp.sqrt(tint[2]))
        out.kind = SOLID
    return out


@wp.func
def choose_lobe(
    world: World,
    v: Vertex,
    w: wp.vec3,
    flat: wp.vec3,
    key: wp.uint32,
    pair: int,
    sample: wp.uint32,
):
    """Choose the lobe of a vertex at random.

    ``w`` points to where the path comes from, ``flat`` is the face's normal, in the shading frame.
    """
    out = ChosenLobe()
    xi = float(0.0)
    if v.opacity < 1.0 or v.clear > 0.0:
        xi = sampler.random_pair(key, pair, sample)[0]
    if v.opacity < 1.0:
        if xi >= v.opacity:
            out.kind = STRAIGHT
            out.weight = wp.vec3(1.0, 1.0, 1.0)
            return out
        # Rescaled below its bound, a random number is uniform on [0, 1) again: no second draw is
        # needed.
        xi = xi / v.opacity
    if xi < v.clear:
        return choose_glass_lobe(world, v, w, xi / v.clear)
    out.bsdf = make_bsdf(
        world.lobes,
        w,
        v.material.albedo,
        v.material.translucency,
        flat,
        v.material.roughness,
        v.material.metallic,
        v.material.specular,
        v.film,
        v.film_f0,
        v.film_roughness,
    )
    return out


@wp.struct
class Step:
    """Continuation of a path at a vertex.

    Attributes:
        light: Reflected light of the sampled source.
        weight: Weight of the radiance from the new direction.
        straight: Whether the path passes without scattering.
        o, d: The next ray, if ``weight`` is not 0.
        sheet, density, total: As for Anchor.
    """

    light: wp.vec3
    weight: wp.vec3
    straight: bool
    o: wp.vec3
    d: wp.vec3
    sheet: int
    density: float
    total: float


@wp.func
def scatter_path(
    world: World,
    table: emitters.SkyTable,
    budget: Budget,
    v: Vertex,
    d: wp.vec3,
    key: wp.uint32,
    pair: int,
    sample: wp.uint32,
):
    """Sample a light source and the next direction at a vertex.

    Args:
        d: Direction of the arriving path.
        key, pair, sample: Identify the first of its PAIRS pairs of random numbers.
    """
    n = v.material.normal
    x, y = soft_shadows.make_frame(n)
    w = to_shading_frame(-d, x, y, n)
    # Bumps may turn the normal away from the path; the BSDF needs Z > 0.
    w = wp.vec3(w[0], w[1], wp.max(w[2], 1.0e-3))
    dealt = choose_lobe(world, v, w, to_shading_frame(v.flat, x, y, n), key, pair, sample)
    sheet = wp.where(dealt.bsdf.p_passed > 0.0, 1, 0)
    step = Step()
    step.density = -1.0
    step.straight = dealt.kind == STRAIGHT
    step.o = ray_queries.offset_origin(v.p, -v.flat)
    step.d = d
    step.weight = dealt.weight
    if step.straight:
        return step
    u = sampler.random_pair(key, pair + 1, sample)
    choices = sampler.random_pair(key, pair + 2, sample)
    sent = Scattering()
    if dealt.kind == SOLID:
        sent = scatter_glass(dealt.bsdf, choices[0], u)
    else:
        sent = scatter(dealt.bsdf, choices[0], u)
    if dealt.kind == ROUGH_PANE:
        # A rough pane transmits like it reflects, mirrored at its plane.
        sent.l = wp.vec3(sent.l[0], sent.l[1], -sent.l[2])
        sent.density = -1.0
    step.weight = sent.weight
    side = v.flat
    if sheet != 0:
        if wp.dot(dealt.bsdf.flat, sent.l) < 0.0:
            side = -v.flat
    elif sent.l[2] <= 0.0:
        side = -v.flat
        step.weight = wp.cw_mul(sent.weight, dealt.weight)
    o = ray_queries.offset_origin(v.p, v.flat)
    # No source is sampled inside glass: refracted paths have to find the outside themselves.
    if dealt.kind == OPAQUE or (dealt.kind == SOLID and v.outside):
        choice = emitters.choose_source(world, table, o, n, sheet, choices[1])
        step.density = sent.density
        step.sheet = sheet
        step.total = choice.total
        if choice.part > 0.0 and budget.lights != 2:
            u = sampler.random_pair(key, pair + 3, sample)
            step.light = sample_source(world, table, budget, dealt.bsdf, v, o, x, y, choice, u)
    step.o = ray_queries.offset_origin(v.p, side)
    step.d = x * sent.l[0] + y * sent.l[1] + n * sent.l[2]
    # The shading normal has sent it into the face: that light is lost, as in a groove.
    if wp.dot(step.d, side) <= 0.0:
        step.weight = wp.vec3(0.0)
    return step


@wp.func
def make_anchor(step: Step, n: wp.vec3):
    """The anchor of a path that has just left a vertex with the given normal."""
    a = Anchor()
    a.p = step.o
    a.n = n
    a.sheet = step.sheet
    a.density = step.density
    a.total = step.total
    return a


@wp.func
def trace_path(
    view: View,
    world: World,
    table: emitters.SkyTable,
    budget: Budget,
    i: int,
    key: wp.uint32,
    sample: wp.uint32,
):
    """Light that one path brings to pixel i [cd/m^2]."""
    place = sampler.random_pair(key, 0, sample)
    way = pixel_direction(view, float(i % view.width) + place[0], float(i / view.width) + place[1])
    length = wp.length(way)
    d = fast_normalize(view.R_world_camera @ way)
    a = Anchor()
    a.p = view.eye_m
    a.density = -1.0
    # Same near plane as the rasteriser: both tiers show the same surfaces.
    a.way_m = rasterizer.Z_NEAR_M * length
    o = view.eye_m + d * a.way_m
    # Texture footprints: each sample covers its share of the pixel.
    cone = pixel_width(view, i, 1.0) / (length * wp.sqrt(float(budget.whole)))
    width_m = float(0.0)
    light = wp.vec3(0.0)
    through = wp.vec3(1.0, 1.0, 1.0)
    survival = float(0.0)
    bounces = int(0)
    passages = int(0)
    going = bool(True)
    while going:
        going = False
        hit = ray_queries.closest_hit(world, o, d, emitters.AT_INFINITY, HOLES)
        # Beyond suns, which are at AT_INFINITY and would otherwise lie behind the segment's end.
        end_m = a.way_m + wp.where(hit.at[0] < 0, 2.0 * emitters.AT_INFINITY, hit.t)
        shown = int(0)
        # Cameras do not show lamps without a body, as in the realtime tier.
        if bounces > 0:
            met, shown = hit_lamp_light(world, budget, a, d, end_m)
            light += wp.cw_mul(through, met)
        if hit.at[0] < 0:
            if bounces > 0 or world.sky.visible != 0:
                light += wp.cw_mul(through, hit_sky_light(world, table, budget, a, d))
        else:
            width_m += cone * hit.t
            v = make_vertex(world, hit, d, width_m)
            if shown == 0:
                light += wp.cw_mul(through, v.glow)
            if bounces < budget.bounces and passages < PASSAGES_MAX:
                # Pair 0 is the position in the pixel; every segment has its own dimensions.
                pair = 1 + PAIRS * (bounces + passages)
                step = scatter_path(world, table, budget, v, d, key, pair, sample)
                light += wp.cw_mul(through, step.light)
                through = wp.cw_mul(through, step.weight)
                going = wp.max(through) > 0.0
                o = step.o
                d = step.d
                if step.straight:
                    passages += 1
                    a.way_m = end_m
                else:
                    bounces += 1
                    a = make_anchor(step, v.material.normal)
                    if a.density > 0.0:
                        # Footprint by density: a sampled direction represents its neighbourhood.
                        spread = wp.sqrt(1.0 / (a.density * float(budget.whole)))
                        cone = wp.max(cone, wp.min(spread, 0.5))
                    # Relative to the first surface: paths from dark ones are followed as far as
                    # from bright ones.
                    survival = wp.where(bounces == 1, SURVIVAL_SHARE * wp.max(through), survival)
                    keep = wp.max(through) / wp.max(survival, 1.0e-20)
                    if going and keep < 1.0:
                        going = sampler.random_number(key, pair, sample) < keep
                        # Russian roulette: survivors carry the weight of terminated paths, which
                        # keeps the mean.
                        through = through * (1.0 / keep)
    return light


@wp.kernel
def trace_paths(
    view: View, world: World, table: emitters.SkyTable, budget: Budget, light: wp.array[wp.vec3]
):
    """Add the light of some samples to every pixel."""
    i = wp.tid()
    if not is_in_view(view, i):
        return
    # Morton numbers that exceed the sequence's 32 bits start another sequence.
    place = sampler.morton_index(i % view.width, i / view.width)
    bits = wp.uint32(budget.sample_bits)
    key = budget.key
    if budget.sample_bits > 0:
        key = sampler.hash_bits(key ^ (place >> (wp.uint32(32) - bits)))
    first = (place << bits) + wp.uint32(budget.first)
    total = wp.vec3(0.0)
    for k in range(budget.samples):
        total += trace_path(view, world, table, budget, i, key, first + wp.uint32(k))
    light[i] = light[i] + total


@wp.kernel
def scale_light(factor: float, light: wp.array[wp.vec3]):
    """Multiply all light by a factor."""
    i = wp.tid()
    light[i] = light[i] * factor
