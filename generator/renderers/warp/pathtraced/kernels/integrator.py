"""Paths of light, from the camera: one thread per pixel, one path after the other.

Source: Kajiya, "The rendering equation", SIGGRAPH 1986, with next-event estimation, multiple
importance sampling and Russian roulette as in Pharr, Jakob and Humphreys, "Physically Based
Rendering", 4th ed., chapters 13 and 14.

Every vertex asks one source for light and goes on in one direction. What a surface is made of in
shares, such as glass and paint, is decided by lot, so that a vertex is one thing at a time. Clear
panes and opacity bend nothing: paths and shadows go straight through them.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.atmosphere.kernels.ground_weathering import (
    apply_coat,
    coat_at,
)
from gen_data.generator.renderers.warp.atmosphere.kernels.water_reflections import water_at
from gen_data.generator.renderers.warp.pathtraced.kernels.bsdf import (
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
from gen_data.generator.renderers.warp.pathtraced.kernels.emitters import (
    AT_INFINITY,
    SKY,
    LightSample,
    SkyTable,
    SourceChoice,
    choose_source,
    draw_ball,
    draw_panel,
    draw_sky,
    intersect_lamp,
    lamp_weight,
    power_heuristic,
    sky_density,
    sky_light,
    sky_place,
    sky_weight,
)
from gen_data.generator.renderers.warp.pathtraced.kernels.sampler import (
    hash_bits,
    morton_index,
    random_number,
    random_pair,
)
from gen_data.generator.renderers.warp.realtime.kernels.clearcoat_glass import maps_at
from gen_data.generator.renderers.warp.realtime.kernels.soft_shadows import make_frame
from gen_data.generator.renderers.warp.scene.kernels.alpha_test import OUT_OF_LINE
from gen_data.generator.renderers.warp.scene.kernels.analytic_lights import is_panel
from gen_data.generator.renderers.warp.scene.kernels.brdf import directional_albedo
from gen_data.generator.renderers.warp.scene.kernels.colorimetry import luminance
from gen_data.generator.renderers.warp.scene.kernels.dielectrics import (
    WATER_F0,
    fresnel_dielectric,
    pane_reflectance,
    pane_transmittance,
)
from gen_data.generator.renderers.warp.scene.kernels.material_eval import (
    SurfaceMaterial,
    evaluate_material,
)
from gen_data.generator.renderers.warp.scene.kernels.ray_offsets import offset_origin
from gen_data.generator.renderers.warp.scene.kernels.ray_queries import (
    RayHit,
    closest_hit,
    is_intersected,
    path_along,
    precipitation_exposure,
)
from gen_data.generator.renderers.warp.scene.kernels.records import (
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
from gen_data.generator.renderers.warp.visibility.kernels.label_resolve import face_viewer
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Straight passages that are not counted as bounces.
PASSAGES_MAX = wp.constant(64)
# Paths of which less than this is left, of what the first surface leaves, go on by lot, and then
# with this much: dark things are seen as well as bright ones. Measured: half the variance, for the
# same time, of going on with probability of what is left.
WORTH = wp.constant(0.25)
# Rougher panes scatter what they let through.
CLEAR_ROUGHNESS = wp.constant(0.1)
# Probability at least of what an interface reflects, and of what it lets through.
LOT_FLOOR = wp.constant(0.02)
# Numbers that one segment of a path takes, in pairs.
PAIRS = wp.constant(4)


@wp.struct
class Budget:
    """How much is spent on a pixel.

    Attributes:
        first: Number of the first sample.
        samples: How many are taken now.
        whole: How many a pixel gets in all.
        sample_bits: Bits that number these.
        bounces: Number of times that light is scattered at most.
        key: Of the image: tells its noise from that of others.
        clear: 1 where some surface lets light through, so that shadows have to look closer.
        lights: Bits of the techniques: 1 asks sources for light, 2 meets them by chance; 3 for an
            image, the others to check one against the other.
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
    """A surface where a path meets it.

    Attributes:
        p: World [m].
        flat: Normal of the face, to the side that the path comes from.
        look: What it looks like; its normal is for shading.
        surface: Its material.
        outside: Whether that side is the face's front.
        glow: What it sends out by itself [cd/m^2].
        clear: Share of what is below the specular layer that lets light pass.
        opacity: Share of what is behind that it hides.
        film, film_f0, film_roughness: Of a coat, or of water.
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
    """The last vertex that chose a direction, for what that direction meets.

    Attributes:
        p: Where the ray began.
        n: Normal there.
        density: Of the direction; below zero where sources could not have been asked.
        total: Weights of all sources there [lx].
        way_m: From there to where the path is now.
    """

    p: wp.vec3
    n: wp.vec3
    density: float
    total: float
    way_m: float


@wp.func
def make_vertex(world: World, hit: RayHit, d: wp.vec3, width_m: float):
    """The surface at a hit, dry and bare."""
    b = hit.at[0]
    g = world.bodies[b].geometry
    corner = face_vertices(world, g, hit.at[1])
    p0 = vertex_at(world, g, corner[0])
    R = world.bodies[b].R_world_mesh
    v = Vertex()
    e1 = vertex_at(world, g, corner[1]) - p0
    e2 = vertex_at(world, g, corner[2]) - p0
    m = p0 + e1 * hit.weight[0] + e2 * hit.weight[1]
    v.p = R @ (m * world.bodies[b].scale) + world.bodies[b].t_world_mesh
    v.flat = R @ fast_normalize(wp.cross(e1, e2))
    v.outside = wp.dot(v.flat, d) < 0.0
    side = wp.where(v.outside, 1.0, -1.0)
    v.flat = v.flat * side
    n = normal_at(world, g, corner[0]) * (1.0 - hit.weight[0] - hit.weight[1])
    n += normal_at(world, g, corner[1]) * hit.weight[0]
    n += normal_at(world, g, corner[2]) * hit.weight[1]
    smooth = face_viewer((R @ n) * side, d)
    v.surface = surface_index(world, hit.at)
    weight = wp.vec2(hit.weight[0] + 1.0 - side, hit.weight[1])
    v.material = evaluate_material(world, v.surface, hit.at, weight, smooth, width_m, -d)
    v.glow = world.surfaces[v.surface].emission_cd_m2
    v.opacity = 1.0
    if world.surfaces[v.surface].layered != 0:
        v = add_layers(world, v, hit.at, weight, width_m)
    if world.ground.covered != 0:
        v = add_weather(world, v, smooth, width_m)
    v.material.normal = face_viewer(v.material.normal, d)
    return v


@wp.func(**OUT_OF_LINE)
def add_layers(world: World, v: Vertex, at: wp.vec2i, weight: wp.vec2, width_m: float):
    """A surface with all there is to it."""
    maps = maps_at(world, v.surface, at, weight, width_m)
    v.material.metallic *= maps.metallic
    v.glow = wp.cw_mul(v.glow, maps.glow)
    v.clear = world.surfaces[v.surface].transmission * (1.0 - v.material.metallic)
    if v.clear > 0.0:
        ior = world.surfaces[v.surface].ior
        normal = (ior - 1.0) / (ior + 1.0)
        v.material.specular = normal * normal / 0.08
    v.opacity = world.surfaces[v.surface].opacity
    v.film = world.surfaces[v.surface].coat
    v.film_f0 = COAT_F0
    v.film_roughness = world.surfaces[v.surface].coat_roughness
    return v


@wp.func(**OUT_OF_LINE)
def add_weather(world: World, v: Vertex, n: wp.vec3, width_m: float):
    """A surface as the weather leaves it; ``n`` is its normal without bumps."""
    exposed = float(1.0)
    if n[2] > 0.1:
        exposed = precipitation_exposure(world, offset_origin(v.p, v.flat))
    coat = coat_at(world, v.surface, v.p, n, exposed, width_m)
    v.material = apply_coat(world, v.surface, v.material, coat, n)
    bare = 1.0 - wp.min(coat.snow, 1.0)
    v.clear *= bare
    v.film *= bare
    v.opacity = 1.0 - (1.0 - v.opacity) * bare
    wet = water_at(world, v.surface, v.p, n, exposed, width_m)
    if wet[0] > v.film:
        v.film = wet[0]
        v.film_f0 = WATER_F0
        v.film_roughness = wp.sqrt(wet[1])
    return v


@wp.func
def straight_transmittance(world: World, v: Vertex, d: wp.vec3):
    """Transmittance of what bends nothing: gaps in opacity, and clear panes."""
    through = wp.vec3(1.0, 1.0, 1.0) * (1.0 - v.opacity)
    if v.clear > 0.0 and is_clear_pane(world, v.surface):
        cosine = wp.min(wp.abs(wp.dot(v.material.normal, d)), 1.0)
        f = fresnel_dielectric(cosine, world.surfaces[v.surface].ior)
        through += pane_transmittance(f, v.material.albedo) * (v.opacity * v.clear)
    return through


@wp.func
def is_clear_pane(world: World, surface: int):
    """Whether what a surface lets through goes straight on."""
    smooth = world.surfaces[surface].roughness < CLEAR_ROUGHNESS
    return world.surfaces[surface].thin != 0 and smooth


@wp.func
def may_pass_straight(world: World, surface: int):
    """Whether light may pass a surface unbent."""
    pane = world.surfaces[surface].transmission > 0.0 and is_clear_pane(world, surface)
    return pane or world.surfaces[surface].opacity < 1.0


@wp.func
def transmittance(world: World, o: wp.vec3, d: wp.vec3, distance_m: float, clear: int):
    """What is left of light from a distance."""
    through = wp.vec3(1.0, 1.0, 1.0)
    if clear != 0:
        through = pane_chain_transmittance(world, o, d, distance_m)
    elif is_intersected(world, path_along(o, d * distance_m), HOLES):
        through = wp.vec3(0.0)
    return through


@wp.func(**OUT_OF_LINE)
def pane_chain_transmittance(world: World, o: wp.vec3, d: wp.vec3, distance_m: float):
    """What is left of light where some surfaces let it through."""
    through = wp.vec3(1.0, 1.0, 1.0)
    origin = o
    rest_m = distance_m
    passages = int(0)
    going = bool(True)
    while going:
        hit = closest_hit(world, origin, d, rest_m, HOLES)
        going = False
        if hit.at[0] >= 0:
            leaves = wp.vec3(0.0)
            if may_pass_straight(world, surface_index(world, hit.at)):
                v = make_vertex(world, hit, d, 0.0)
                leaves = straight_transmittance(world, v, d)
                origin = offset_origin(v.p, -v.flat)
            through = wp.cw_mul(through, leaves)
            passages += 1
            rest_m -= hit.t
            if passages == PASSAGES_MAX:
                through = wp.vec3(0.0)
            going = wp.max(through) > 0.0 and rest_m > 0.0
    return through


@wp.func
def hit_lamp_light(world: World, budget: Budget, a: Anchor, d: wp.vec3, end_m: float):
    """Light of the lamps that a stretch of a ray meets, up to a distance from its anchor.

    Also 1 where the body at its end shows one of them: that body's own light is the lamp's.
    """
    light = wp.vec3(0.0)
    shown = int(0)
    for j in range(world.lamps.shape[0]):
        g = intersect_lamp(world.lamps[j], a.p, d)
        if g.distance_m > a.way_m and g.distance_m < end_m:
            part = float(1.0)
            if a.density >= 0.0 and budget.lights != 2:
                # Density of the other technique: source by its share of all weights, then
                # direction.
                asked = g.density * lamp_weight(world.lamps[j], a.p, a.n) / wp.max(a.total, 1.0e-20)
                # Where only the asking is on trial (1), what is met counts for nothing.
                part = power_heuristic(a.density, asked) * float(budget.lights >> 1)
            light += g.radiance * part
            shown = wp.max(shown, world.lamps[j].shown)
    return light, shown


@wp.func
def hit_sky_light(world: World, table: SkyTable, budget: Budget, a: Anchor, d: wp.vec3):
    """Light of the sky that a ray meets."""
    light = wp.vec3(0.0)
    if world.sky.luminance > 0.0:
        place = sky_place(world.sky, d)
        part = float(1.0)
        if a.density >= 0.0 and budget.lights != 2 and table.part > 0.0:
            asked = sky_density(table, place) * sky_weight(world.sky, table, a.n)
            asked = asked / wp.max(a.total, 1.0e-20)
            part = power_heuristic(a.density, asked) * float(budget.lights >> 1)
        light = sky_light(world.sky, place) * part
    return light


@wp.func
def to_shading_frame(v: wp.vec3, x: wp.vec3, y: wp.vec3, n: wp.vec3):
    """World to the shading frame."""
    return wp.vec3(wp.dot(x, v), wp.dot(y, v), wp.dot(n, v))


@wp.func
def sample_source(
    world: World,
    table: SkyTable,
    budget: Budget,
    s: Bsdf,
    v: Vertex,
    o: wp.vec3,
    x: wp.vec3,
    y: wp.vec3,
    choice: SourceChoice,
    u: wp.vec2,
):
    """Light of one source that a vertex sends on; x, y complete its shading frame."""
    light = wp.vec3(0.0)
    g = LightSample()
    if choice.source == SKY:
        g = draw_sky(world.sky, table, u)
    elif is_panel(world.lamps[choice.source]):
        g = draw_panel(world.lamps[choice.source], o, u)
    else:
        g = draw_ball(world.lamps[choice.source], o, u)
    l = to_shading_frame(g.direction, x, y, v.material.normal)  # noqa: E741
    # Above both horizons: light must not leak through a face by its shading normal.
    if g.distance_m > 0.0 and l[2] > 0.0 and wp.dot(g.direction, v.flat) > 0.0:
        f, density = evaluate(s, l)
        asked = g.density * choice.part
        f = wp.cw_mul(f, g.radiance)
        if asked > 0.0 and wp.max(f) > 0.0:
            part = float(1.0)
            # Alone, the technique has all the light and needs no weight.
            if budget.lights == 3:
                part = power_heuristic(asked, density)
            through = transmittance(world, o, g.direction, g.distance_m, budget.clear)
            light = wp.cw_mul(f, through) * (part / asked)
    return light


@wp.struct
class ChosenLobe:
    """What a vertex is, after the lot.

    Attributes:
        kind: One of OPAQUE, STRAIGHT, SOLID and ROUGH_PANE.
        bsdf: What reflects.
        weight: What is left of light that passes, over the probability of that.
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
    """Probability of reflection, not too far from what it brings."""
    p = reflected / wp.max(reflected + passed, 1.0e-9)
    if passed > 0.0:
        p = wp.clamp(p, LOT_FLOOR, 1.0 - LOT_FLOOR)
    return p


@wp.func(**OUT_OF_LINE)
def choose_glass_lobe(world: World, v: Vertex, w: wp.vec3, lot: float):
    """Glass; of panes, whether they reflect or let pass. ``w`` is to where the path comes from."""
    out = ChosenLobe()
    tint = v.material.albedo
    alpha = roughness_to_alpha(v.material.roughness)
    ior = world.surfaces[v.surface].ior
    if world.surfaces[v.surface].thin != 0:
        f = fresnel_dielectric(w[2], ior)
        back = pane_reflectance(f, tint)
        on = pane_transmittance(f, tint)
        p = reflection_probability(luminance(back), luminance(on))
        out.bsdf = make_interface(w, alpha, 0.0)
        out.bsdf.f0 = wp.vec3(1.0, 1.0, 1.0)
        out.bsdf.f90 = 1.0
        # Over the probability of the lot, so that the mean over lots is right.
        out.weight = on * (1.0 / (1.0 - p))
        # All that rough facets hide is scattered on.
        part = directional_albedo(world.lobes, wp.sqrt(alpha), w[2])
        # A pane of F0 1 would lose what single scattering loses: it is given back.
        boost = 1.0 / (part[0] + part[1])
        out.bsdf.scale = back * (boost / p)
        if lot < p:
            out.kind = OPAQUE
        elif is_clear_pane(world, v.surface):
            out.kind = STRAIGHT
        else:
            out.kind = ROUGH_PANE
            out.bsdf.scale = wp.vec3(boost, boost, boost)
    else:
        out.bsdf = make_interface(w, alpha, wp.where(v.outside, ior, 1.0 / ior))
        # One half of the tint on the way in, the other on the way out.
        out.weight = wp.vec3(wp.sqrt(tint[0]), wp.sqrt(tint[1]), wp.sqrt(tint[2]))
        out.kind = SOLID
    return out


@wp.func
def choose_lobe(world: World, v: Vertex, w: wp.vec3, key: wp.uint32, pair: int, sample: wp.uint32):
    """What a vertex is; ``w`` points to where the path comes from, in the shading frame."""
    out = ChosenLobe()
    lot = float(0.0)
    if v.opacity < 1.0 or v.clear > 0.0:
        lot = random_pair(key, pair, sample)[0]
    if v.opacity < 1.0:
        if lot >= v.opacity:
            out.kind = STRAIGHT
            out.weight = wp.vec3(1.0, 1.0, 1.0)
            return out
        # What is left of a lot below a bound is a fresh one on [0, 1): no second draw is due.
        lot = lot / v.opacity
    if lot < v.clear:
        return choose_glass_lobe(world, v, w, lot / v.clear)
    out.bsdf = make_bsdf(
        world.lobes,
        w,
        v.material.albedo,
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
    """How a path goes on from a vertex.

    Attributes:
        light: That the vertex sends back from the source it has asked.
        weight: Of what the new direction brings.
        straight: Whether nothing has happened.
        o, d: The next ray, if ``weight`` is not 0.
        density, total: As of an Anchor.
    """

    light: wp.vec3
    weight: wp.vec3
    straight: bool
    o: wp.vec3
    d: wp.vec3
    density: float
    total: float


@wp.func
def scatter_path(
    world: World,
    table: SkyTable,
    budget: Budget,
    v: Vertex,
    d: wp.vec3,
    key: wp.uint32,
    pair: int,
    sample: wp.uint32,
):
    """Light that a vertex sends back at once, and where the path goes on.

    Args:
        d: Direction in which the path has come.
        key, pair, sample: Of the first of its PAIRS pairs of numbers.
    """
    n = v.material.normal
    x, y = make_frame(n)
    w = to_shading_frame(-d, x, y, n)
    # Bumps may turn a normal away from where the path comes from; the model needs Z > 0.
    w = wp.vec3(w[0], w[1], wp.max(w[2], 1.0e-3))
    dealt = choose_lobe(world, v, w, key, pair, sample)
    step = Step()
    step.density = -1.0
    step.straight = dealt.kind == STRAIGHT
    step.o = offset_origin(v.p, -v.flat)
    step.d = d
    step.weight = dealt.weight
    if step.straight:
        return step
    u = random_pair(key, pair + 1, sample)
    choices = random_pair(key, pair + 2, sample)
    sent = Scattering()
    if dealt.kind == SOLID:
        sent = scatter_glass(dealt.bsdf, choices[0], u)
    else:
        sent = scatter(dealt.bsdf, choices[0], u)
    if dealt.kind == ROUGH_PANE:
        # A rough pane scatters on as it would reflect, mirrored in its plane.
        sent.l = wp.vec3(sent.l[0], sent.l[1], -sent.l[2])
        sent.density = -1.0
    step.weight = sent.weight
    side = v.flat
    if sent.l[2] <= 0.0:
        side = -v.flat
        step.weight = wp.cw_mul(sent.weight, dealt.weight)
    o = offset_origin(v.p, v.flat)
    # Inside glass nothing is asked: what is outside is seen by going there.
    if dealt.kind == OPAQUE or (dealt.kind == SOLID and v.outside):
        choice = choose_source(world, table, o, n, choices[1])
        step.density = sent.density
        step.total = choice.total
        if choice.part > 0.0 and budget.lights != 2:
            u = random_pair(key, pair + 3, sample)
            step.light = sample_source(world, table, budget, dealt.bsdf, v, o, x, y, choice, u)
    step.o = offset_origin(v.p, side)
    step.d = x * sent.l[0] + y * sent.l[1] + n * sent.l[2]
    # A shading normal has sent it into the face: that light is lost, as in a groove.
    if wp.dot(step.d, side) <= 0.0:
        step.weight = wp.vec3(0.0)
    return step


@wp.func
def make_anchor(step: Step, n: wp.vec3):
    """The anchor that a vertex with a normal becomes, where a path has just left it."""
    a = Anchor()
    a.p = step.o
    a.n = n
    a.density = step.density
    a.total = step.total
    return a


@wp.func
def trace_path(
    view: View,
    world: World,
    table: SkyTable,
    budget: Budget,
    i: int,
    key: wp.uint32,
    sample: wp.uint32,
):
    """Light that one path brings to pixel i [cd/m^2]."""
    place = random_pair(key, 0, sample)
    way = pixel_direction(view, float(i % view.width) + place[0], float(i / view.width) + place[1])
    length = wp.length(way)
    d = fast_normalize(view.R_world_camera @ way)
    a = Anchor()
    a.p = view.eye_m
    a.density = -1.0
    # Where the rasterised image begins: both tiers show the same.
    a.way_m = Z_NEAR_M * length
    o = view.eye_m + d * a.way_m
    # Samples share the pixel: each stands for a part of it.
    cone = pixel_width(view, i, 1.0) / (length * wp.sqrt(float(budget.whole)))
    width_m = float(0.0)
    light = wp.vec3(0.0)
    through = wp.vec3(1.0, 1.0, 1.0)
    worth = float(0.0)
    bounces = int(0)
    passages = int(0)
    going = bool(True)
    while going:
        going = False
        hit = closest_hit(world, o, d, AT_INFINITY, HOLES)
        # Farther than suns, which are at infinity and would else lie behind the end.
        end_m = a.way_m + wp.where(hit.at[0] < 0, 2.0 * AT_INFINITY, hit.t)
        shown = int(0)
        # Cameras do not see lamps without a body, as in the other tier.
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
                        # A direction stands for those around it that are not drawn.
                        spread = wp.sqrt(1.0 / (a.density * float(budget.whole)))
                        cone = wp.max(cone, wp.min(spread, 0.5))
                    # Relative to the first surface: dark ones are followed as far as bright ones.
                    worth = wp.where(bounces == 1, WORTH * wp.max(through), worth)
                    keep = wp.max(through) / wp.max(worth, 1.0e-20)
                    if going and keep < 1.0:
                        going = random_number(key, pair, sample) < keep
                        # Survivors stand for those that have died (Russian roulette): the mean
                        # stays.
                        through = through * (1.0 / keep)
    return light


@wp.kernel
def trace_paths(
    view: View,
    world: World,
    table: SkyTable,
    budget: Budget,
    light: wp.array(dtype=wp.vec3),
):
    """Add the light of some samples to every pixel."""
    i = wp.tid()
    if not is_in_view(view, i):
        return
    # Pixels whose places are too many for the sequence's numbers begin others.
    place = morton_index(i % view.width, i / view.width)
    bits = wp.uint32(budget.sample_bits)
    key = budget.key
    if budget.sample_bits > 0:
        key = hash_bits(key ^ (place >> (wp.uint32(32) - bits)))
    first = (place << bits) + wp.uint32(budget.first)
    total = wp.vec3(0.0)
    for k in range(budget.samples):
        total += trace_path(view, world, table, budget, i, key, first + wp.uint32(k))
    light[i] = light[i] + total


@wp.kernel
def scale_light(factor: float, light: wp.array(dtype=wp.vec3)):
    """Multiply all light by a factor."""
    i = wp.tid()
    light[i] = light[i] * factor
