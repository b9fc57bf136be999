"""Rays of laser scanners: first hits, reflectance, and secondary hits behind panes and mirrors."""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels.ground_weathering import (
    Coat,
    coat_at,
    estimate_porosity,
)
from gen_data.renderers.warp.lidar.kernels import ray_packets
from gen_data.renderers.warp.scene.kernels import alpha_test, ray_queries, records
from gen_data.renderers.warp.scene.kernels.brdf import WATER_F0, fresnel_schlick

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

PI = wp.constant(3.14159265)
# Reflectance of fresh and settled snow near 905 nm (Wiscombe and Warren, "A model for the spectral
# albedo of snow", 1980: 0.9 to 0.75 for grains of 0.1 to 1 mm).
SNOW = wp.constant(0.85)
# Share of its reflectance that porous ground loses under water: total reflection in the water
# returns light to the ground, and stones reflect less at once (Lekner and Dorf 1988, for
# reflectances of 0.2 and an index of 1.5). Cameras use Lagarde's value, which is for darker ground.
DARKENED = wp.constant(0.6)
# Share of a marking's retro-reflection that water suppresses: a quarter remains (EN 1436, classes R
# and RW).
DROWNED = wp.constant(0.75)
# Faces along one ray: panes, and the surface behind them.
FACES_MAX = wp.constant(9)
# Two faces of glass closer than this form one pane.
PANE_M = wp.constant(0.05)
# Width of a leaf, and of a beam at the scanner.
LEAF_M = wp.constant(0.07)
APERTURE_M = wp.constant(0.01)


@wp.struct
class Infrared:
    """Reflection of a surface for laser light, back towards its source.

    Attributes:
        even, rim: Diffuse reflectance is ``even * cosine + rim * sine^2`` of incidence.
        specular: Fresnel reflectance at normal incidence.
        alpha: Width of the specular lobe (GGX).
        retro: Reflectance of a retro-reflector, relative to a white Lambertian surface at normal
            incidence.
        mirror: Fresnel reflectance at normal incidence of a mirror; 0 for all other surfaces.
        clear: Transmittance of one passage at normal incidence.
        filled: Share of a beam much wider than a leaf that a surface returns as one echo; 1 for
            whatever has no gaps.
    """

    even: float
    rim: float
    specular: float
    alpha: float
    retro: float
    mirror: float
    clear: float
    filled: float


@wp.struct
class Scan:
    """Origin and divergence of a scan's rays.

    Attributes:
        R_world_lidar, eye_m: Pose of the scanner.
        reach_m: Maximum range.
        spread: Tangent of the angle between a beam's axis and the rays around it.
        subrays: Rays per beam: 1 or 7.
        run, threads: Rays per run, and threads, which process runs in turn.
        divergence_rad: Full divergence of a beam, for the size of its footprint.
    """

    R_world_lidar: wp.mat33
    eye_m: wp.vec3
    reach_m: float
    spread: float
    subrays: int
    run: int
    threads: int
    divergence_rad: float


@wp.struct
class BodyMotion:
    """Motion of bodies and of the scanner during a scan.

    Attributes:
        keys: Poses per moving body over the sweep; 0 if nothing moves, and the other fields are
            unused.
        rows: Row of each body among the moving ones; -1 for static bodies.
        B_mesh_lidar, eye_mesh: Directions and origin of the lidar frame in the moving bodies' mesh
            frames, [mover, key].
        phases: Emission time of each beam, in keys.
        origins_m: Its origin in the lidar frame.
    """

    keys: int
    rows: wp.array[int]
    B_mesh_lidar: wp.array2d[wp.mat33]
    eye_mesh: wp.array2d[wp.vec3]
    phases: wp.array[float]
    origins_m: wp.array[wp.vec3]


@wp.struct
class Ray:
    """A ray in the lidar frame.

    Attributes:
        key, share: Emission time: the key before it, and the fraction of the step after that key.
    """

    direction: wp.vec3
    origin_m: wp.vec3
    key: int
    share: float


@wp.func
def beam_direction(axis: wp.vec3, k: int, spread: float):
    """The axis of a beam, or one of six directions around it."""
    if k == 0:
        return axis
    # Any axis far from parallel keeps the digits of the cross product.
    helper = wp.where(wp.abs(axis[2]) < 0.9, wp.vec3(0.0, 0.0, 1.0), wp.vec3(1.0, 0.0, 0.0))
    across = records.fast_normalize(wp.cross(helper, axis))
    up = wp.cross(axis, across)
    # Six around one: the densest regular pattern in a round beam.
    turn = float(k - 1) * (PI / 3.0)
    return records.fast_normalize(axis + (across * wp.cos(turn) + up * wp.sin(turn)) * spread)


@wp.func
def backscatter(light: Infrared, cosine: float):
    """Reflectance towards the source, including the cosine of incidence.

    The diffuse term is Lambert's, ``even * cosine``, or the term of a rough surface, whose facets
    face the scanner at any angle (Oren and Nayar, "Generalization of Lambert's reflectance model",
    1994, for coincident source and viewer). The lobe is GGX with its half vector along the ray,
    relative to a white Lambertian surface: ``pi * D * F * G / (4 cosine^2) * cosine`` with Smith's
    G, equal both ways (Walter et al., "Microfacet models for refraction", 2007). A retro-reflector
    works up to entrance angles of about 60 degrees (ASTM D4956).
    """
    # The lobe divides by the cosine; within 0.06 degrees of grazing nothing returns.
    c = wp.max(cosine, 1.0e-3)
    a2 = light.alpha * light.alpha
    c2 = c * c
    base = c2 * (a2 - 1.0) + 1.0
    g1 = 2.0 * c / (c + wp.sqrt(a2 + (1.0 - a2) * c2))
    lobe = a2 / (base * base) * light.specular * g1 * g1 / (4.0 * c)
    diffuse = light.even * c + light.rim * (1.0 - c2)
    return diffuse + lobe + light.retro * c * wp.clamp((c - 0.35) * 4.0, 0.0, 1.0)


@wp.func
def echo_share(scan: Scan, light: Infrared, range_m: float):
    """Share of a ray's light that returns as one echo, by the width of the beam part it represents.

    A beam narrower than a leaf hits a leaf or a gap. A wider one hits leaves at several depths
    and gaps between them, and its echo is fainter: scanners lose trees before walls of the same
    reflectance.
    """
    share = float(1.0)
    if light.filled < 1.0:
        width_m = APERTURE_M + scan.divergence_rad * range_m
        # Several rays share the beam's area.
        area_m2 = width_m * width_m / float(scan.subrays)
        share = light.filled + (1.0 - light.filled) * LEAF_M * LEAF_M / (LEAF_M * LEAF_M + area_m2)
    return share


@wp.struct
class Nearest:
    """The nearest hit of a ray so far; body -1 for none.

    Attributes:
        u, v: Weights of the face's first two vertices.
    """

    range_m: float
    body: int
    face: int
    u: float
    v: float


@wp.func
def mover_frame(motion: BodyMotion, m: int, ray: Ray):
    """Directions of the lidar frame in the mesh frame of mover m when a ray is emitted."""
    # Interpolated matrices deviate from rotations by the square of the small angle between keys.
    before = motion.B_mesh_lidar[m, ray.key]
    return before + (motion.B_mesh_lidar[m, ray.key + 1] - before) * ray.share


@wp.func
def intersect_body(
    world: records.World, motion: BodyMotion, b: int, ray: Ray, hit: Nearest, offset: bool
):
    """The nearer of a hit and the first point of a body.

    Computed in the scanner's own frame: positions far from the world's origin lose no precision.
    """
    d = world.bodies[b].B_mesh_camera @ ray.direction
    o = world.bodies[b].eye_mesh
    m = int(-1)
    if motion.keys > 0:
        m = motion.rows[b]
    if m >= 0:
        B = mover_frame(motion, m, ray)
        before = motion.eye_mesh[m, ray.key]
        o = before + (motion.eye_mesh[m, ray.key + 1] - before) * ray.share
        o += B @ ray.origin_m
        d = B @ ray.direction
    elif offset:
        o += world.bodies[b].B_mesh_camera @ ray.origin_m
    answer = alpha_test.closest_solid_hit(world, b, o, d, hit.range_m, records.HOLES)
    if answer.face >= 0:
        hit.range_m = answer.t
        hit.body = b
        hit.face = answer.face
        hit.u = answer.u
        hit.v = answer.v
    return hit


@wp.func
def hit_normal(scan: Scan, world: records.World, motion: BodyMotion, ray: Ray, hit: Nearest):
    """Interpolated unit normal of a hit, lidar frame."""
    g = world.bodies[hit.body].geometry
    corner = records.face_vertices(world, g, hit.face)
    n = records.normal_at(world, g, corner[0]) * hit.u
    n += records.normal_at(world, g, corner[1]) * hit.v
    n += records.normal_at(world, g, corner[2]) * (1.0 - hit.u - hit.v)
    if motion.keys > 0:
        m = motion.rows[hit.body]
        if m >= 0:
            # The transpose of mesh-from-lidar; its scale cancels in the normalisation.
            return records.fast_normalize(wp.transpose(mover_frame(motion, m, ray)) @ n)
    return wp.transpose(scan.R_world_lidar) @ (
        world.bodies[hit.body].R_world_mesh @ records.fast_normalize(n)
    )


@wp.func
def make_ray(scan: Scan, motion: BodyMotion, axes: wp.array[wp.vec3], i: int):
    """Ray i of all, in the lidar frame."""
    beam = int(i)
    k = int(0)
    if scan.subrays > 1:
        # Divisions are slow.
        beam = i / scan.subrays
        k = i % scan.subrays
    ray = Ray()
    ray.direction = beam_direction(axes[beam], k, scan.spread)
    if motion.keys > 0:
        ray.origin_m = motion.origins_m[beam]
        # A pulse emitted exactly at the last key belongs to the step before it.
        ray.key = wp.min(int(motion.phases[beam]), motion.keys - 2)
        ray.share = motion.phases[beam] - float(ray.key)
    return ray


@wp.func
def world_origin(scan: Scan, ray: Ray, offset: bool):
    """Origin of a ray in the world; the lidar frame's origin unless it is ``offset``."""
    eye_m = scan.eye_m
    if offset:
        eye_m += scan.R_world_lidar @ ray.origin_m
    return eye_m


@wp.func
def first_hit(
    scan: Scan,
    world: records.World,
    motion: BodyMotion,
    boxes: ray_packets.Boxes,
    listed: ray_packets.ListedBodies,
    ray: Ray,
    likely: int,
    gone_m: float,
    offset: bool,
):
    """The first hit of a ray; the ``likely`` body, if not -1, is tested first.

    Args:
        listed: Bodies that the ray may hit.
        gone_m: Distance of the ray's origin along the ray of the list.
        offset: Whether the ray may start elsewhere than at the lidar frame's origin.
    """
    hit = Nearest()
    hit.range_m = scan.reach_m
    hit.body = -1
    if likely >= 0:
        # Neighbouring rays mostly hit the same body: its range rejects most other boxes.
        hit = intersect_body(world, motion, likely, ray, hit, offset)
    eye_m = world_origin(scan, ray, offset)
    inverse = records.reciprocals(scan.R_world_lidar @ ray.direction)
    # An overflowing list: test every body's box.
    count = wp.where(listed.count < 0, boxes.lows_m.shape[0], listed.count)
    for k in range(count):
        b = int(k)
        if listed.count >= 0:
            # Bodies are sorted by distance: none of the rest can be nearer.
            if boxes.enters_m[listed.row, k] - gone_m >= hit.range_m:
                break
            b = boxes.listed[listed.row, k]
        if b != likely:
            if ray_packets.is_box_entered(boxes, b, eye_m, inverse, hit.range_m):
                hit = intersect_body(world, motion, b, ray, hit, offset)
    return hit


@wp.func
def coat_at_hit(
    scan: Scan, world: records.World, ray: Ray, range_m: float, hit: wp.vec2i, n_lidar: wp.vec3
):
    """Water and snow at the end of a ray, at a (body, material)."""
    n = scan.R_world_lidar @ n_lidar
    if wp.dot(n_lidar, ray.direction) > 0.0:
        n = -n
    p = scan.eye_m + scan.R_world_lidar @ (ray.origin_m + ray.direction * range_m)
    exposed = float(1.0)
    if n[2] > 0.1:
        exposed = ray_queries.precipitation_exposure(
            world, hit[0], p + n * ray_queries.SHELTER_OFFSET_M
        )
    # A footprint grows by 1 / cosine; beyond fifty beam widths its length no longer matters.
    slant = wp.max(wp.abs(wp.dot(n_lidar, ray.direction)), 0.02)
    return coat_at(world, hit[1], p, n, exposed, scan.divergence_rad * range_m / slant)


@wp.func
def apply_weather(world: records.World, light: Infrared, coat: Coat, surface: int, cosine: float):
    """A surface under water and snow.

    Water darkens rough ground also at wavelengths that it does not absorb (Lekner and Dorf, "Why
    some things are darker when wet", 1988), and reflects oblique rays away in both directions: wet
    roads vanish at a distance. Wojtanowski et al., "Comparison of 905 nm and 1550 nm semiconductor
    laser rangefinders' performance deterioration due to adverse environmental conditions", 2014,
    measured it.
    """
    porous = estimate_porosity(world, surface)
    film = wp.max(coat.puddle, 0.5 * porous * coat.wet)
    # Two passages of the water's surface here, two more in ``kept``: down and up.
    passes = 1.0 - film * fresnel_schlick(WATER_F0, cosine)
    kept = (1.0 - DARKENED * porous * coat.wet) * passes * passes
    bare = 1.0 - wp.min(coat.snow, 1.0)
    below = Infrared()
    below.even = light.even * kept * bare + SNOW * (1.0 - bare)
    below.rim = light.rim * kept * bare
    below.specular = light.specular * (1.0 - coat.puddle) * bare
    below.alpha = light.alpha
    below.retro = light.retro * (1.0 - DROWNED * porous * coat.wet) * bare
    return below


@wp.func
def ray_index(scan: Scan, order: wp.array[int], j: int):
    """Index of the ray at a position in the order of beams; an empty order is the identity."""
    i = int(j)
    if order.shape[0] > 0:
        if scan.subrays > 1:
            i = order[j / scan.subrays] * scan.subrays + j % scan.subrays
        else:
            i = order[j]
    return i


@wp.func
def add_ray(
    bundle: ray_packets.Bundle, scan: Scan, motion: BodyMotion, axes: wp.array[wp.vec3], i: int
):
    """The bundle extended by ray i of all."""
    ray = make_ray(scan, motion, axes, i)
    return ray_packets.extend_bundle(
        bundle, world_origin(scan, ray, True), scan.R_world_lidar @ ray.direction
    )


@wp.kernel
def scan_beams(
    scan: Scan,
    world: records.World,
    motion: BodyMotion,
    boxes: ray_packets.Boxes,
    lights: wp.array[Infrared],
    axes: wp.array[wp.vec3],
    order: wp.array[int],
    ranges_m: wp.array[float],
    reflectances: wp.array[float],
    cosines: wp.array[float],
    hits: wp.array[wp.vec2i],
    normals: wp.array[wp.vec3],
    puddles: wp.array[float],
):
    """First hit of every ray; ray k of beam i is at ``i * subrays + k``.

    Each thread processes runs of ``run`` rays in turn; the body that the previous ray hit is tested
    first, and mostly excludes all others. Hits are (body, material), (-1, -1) for none; normals, in
    the lidar frame, are written for mirrors, and puddles, shares of standing water, if the ground
    is covered.

    Args:
        order: Order of beams in which neighbours are adjacent; empty if they already are.
    """
    t = wp.tid()
    for begin in range(t * scan.run, ranges_m.shape[0], scan.threads * scan.run):
        end = wp.min(begin + scan.run, ranges_m.shape[0])
        bundle = ray_packets.empty_bundle()
        for j in range(begin, end):
            bundle = add_ray(bundle, scan, motion, axes, ray_index(scan, order, j))
        listed = ray_packets.list_bodies(boxes, t, bundle, scan.reach_m)
        last = int(-1)
        for j in range(begin, end):
            i = ray_index(scan, order, j)
            ray = make_ray(scan, motion, axes, i)
            hit = first_hit(scan, world, motion, boxes, listed, ray, last, 0.0, motion.keys > 0)
            last = hit.body
            if hit.body < 0:
                hits[i] = wp.vec2i(-1, -1)
                ranges_m[i] = wp.inf
                reflectances[i] = 0.0
                cosines[i] = 0.0
                if world.ground.covered != 0:
                    puddles[i] = 0.0
            else:
                n_lidar = hit_normal(scan, world, motion, ray, hit)
                cosine = wp.min(wp.abs(wp.dot(n_lidar, ray.direction)), 1.0)
                material = records.surface_index(world, wp.vec2i(hit.body, hit.face))
                hits[i] = wp.vec2i(hit.body, material)
                ranges_m[i] = hit.range_m
                cosines[i] = cosine
                if lights[material].mirror > 0.0 or world.ground.covered != 0:
                    normals[i] = n_lidar
                share = echo_share(scan, lights[material], hit.range_m)
                if world.ground.covered == 0:
                    reflectances[i] = share * backscatter(lights[material], cosine)
                else:
                    coat = coat_at_hit(scan, world, ray, hit.range_m, hits[i], n_lidar)
                    light = apply_weather(world, lights[material], coat, material, cosine)
                    reflectances[i] = share * backscatter(light, cosine)
                    puddles[i] = coat.puddle * (1.0 - wp.min(coat.snow, 1.0))


@wp.kernel
def trace_behind_panes(
    scan: Scan,
    world: records.World,
    motion: BodyMotion,
    boxes: ray_packets.Boxes,
    lights: wp.array[Infrared],
    axes: wp.array[wp.vec3],
    selected: wp.array[int],
    first_m: wp.array[float],
    ranges_m: wp.array[float],
    reflectances: wp.array[float],
    hits: wp.array[wp.vec2i],
):
    """Last surfaces on selected rays that have hit a pane, behind it and any further pane."""
    t = wp.tid()
    for begin in range(t * scan.run, selected.shape[0], scan.threads * scan.run):
        end = wp.min(begin + scan.run, selected.shape[0])
        bundle = ray_packets.empty_bundle()
        for j in range(begin, end):
            bundle = add_ray(bundle, scan, motion, axes, selected[j])
        listed = ray_packets.list_bodies(boxes, t, bundle, ray_packets.FAR_M)
        for j in range(begin, end):
            hits[j] = wp.vec2i(-1, -1)
            ray = make_ray(scan, motion, axes, selected[j])
            begin_m = ray.origin_m
            # Start just before the pane: its own face must be found first.
            way_m = wp.max(first_m[selected[j]] - ray_queries.LASER_OFFSET_M, 0.0)
            passed = float(1.0)
            for face in range(FACES_MAX):
                if passed > 0.0:
                    ray.origin_m = begin_m + ray.direction * way_m
                    hit = first_hit(scan, world, motion, boxes, listed, ray, -1, way_m, True)
                    if hit.body < 0:
                        passed = 0.0
                    else:
                        way_m += hit.range_m + ray_queries.LASER_OFFSET_M
                        n = hit_normal(scan, world, motion, ray, hit)
                        cosine = wp.min(wp.abs(wp.dot(n, ray.direction)), 1.0)
                        material = records.surface_index(world, wp.vec2i(hit.body, hit.face))
                        clear = lights[material].clear
                        if face > 0:
                            # A pane's echo is overwritten by the echo of the surface behind it, if
                            # any.
                            hits[j] = wp.vec2i(hit.body, material)
                            ranges_m[j] = way_m - ray_queries.LASER_OFFSET_M
                            reflected = backscatter(lights[material], cosine)
                            share = echo_share(scan, lights[material], way_m)
                            reflectances[j] = passed * share * reflected
                        if clear == 0.0:
                            passed = 0.0
                        elif face == 0 or hit.range_m > PANE_M:
                            # Two faces of one pane count once; the light passes each pane twice.
                            kept = clear * (1.0 - fresnel_schlick(lights[material].mirror, cosine))
                            passed *= kept * kept


@wp.func
def reflect_ray(ray: Ray, n: wp.vec3, range_m: float):
    """A ray after reflection at the given range, at a surface with normal n."""
    facing = wp.dot(n, ray.direction)
    ray.origin_m = ray.origin_m + ray.direction * range_m
    ray.direction = records.fast_normalize(ray.direction - n * (2.0 * facing))
    # Off the mirror along both directions: it must not be hit again.
    ray.origin_m += ray.direction * ray_queries.LASER_OFFSET_M - n * (
        wp.sign(facing) * ray_queries.LASER_OFFSET_M
    )
    return ray


@wp.kernel
def trace_mirrors(
    scan: Scan,
    world: records.World,
    motion: BodyMotion,
    boxes: ray_packets.Boxes,
    lights: wp.array[Infrared],
    axes: wp.array[wp.vec3],
    selected: wp.array[int],
    first_m: wp.array[float],
    first_hits: wp.array[wp.vec2i],
    normals: wp.array[wp.vec3],
    waters: wp.array[float],
    ranges_m: wp.array[float],
    reflectances: wp.array[float],
    hits: wp.array[wp.vec2i],
    places_m: wp.array[wp.vec3],
):
    """Surfaces that selected rays hit after one reflection at a mirror.

    The light returns by the same path, so the mirror attenuates it twice.

    Args:
        waters: Share of a puddle at each selected ray's end; 0 if the material itself is the
            mirror.
        places_m: Points of these surfaces, lidar frame; empty if they are not requested.
    """
    t = wp.tid()
    for begin in range(t * scan.run, selected.shape[0], scan.threads * scan.run):
        end = wp.min(begin + scan.run, selected.shape[0])
        bundle = ray_packets.empty_bundle()
        for j in range(begin, end):
            i = selected[j]
            ray = reflect_ray(make_ray(scan, motion, axes, i), normals[i], first_m[i])
            bundle = ray_packets.extend_bundle(
                bundle, world_origin(scan, ray, True), scan.R_world_lidar @ ray.direction
            )
        listed = ray_packets.list_bodies(boxes, t, bundle, scan.reach_m)
        last = int(-1)
        for j in range(begin, end):
            i = selected[j]
            ray = make_ray(scan, motion, axes, i)
            cosine = wp.min(wp.abs(wp.dot(normals[i], ray.direction)), 1.0)
            kept = fresnel_schlick(lights[first_hits[i][1]].mirror, cosine)
            if waters[j] > 0.0:
                kept = waters[j] * fresnel_schlick(WATER_F0, cosine)
            ray = reflect_ray(ray, normals[i], first_m[i])
            hit = first_hit(scan, world, motion, boxes, listed, ray, last, 0.0, True)
            last = hit.body
            hits[j] = wp.vec2i(-1, -1)
            if hit.body >= 0:
                n = hit_normal(scan, world, motion, ray, hit)
                material = records.surface_index(world, wp.vec2i(hit.body, hit.face))
                hits[j] = wp.vec2i(hit.body, material)
                ranges_m[j] = first_m[i] + ray_queries.LASER_OFFSET_M + hit.range_m
                if places_m.shape[0] > 0:
                    places_m[j] = ray.origin_m + ray.direction * hit.range_m
                cosine = wp.min(wp.abs(wp.dot(n, ray.direction)), 1.0)
                kept *= kept * echo_share(scan, lights[material], ranges_m[j])
                reflectances[j] = kept * backscatter(lights[material], cosine)
