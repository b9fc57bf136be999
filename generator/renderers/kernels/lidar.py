"""Rays of laser scanners: what they hit first, and how much of the light comes straight back."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import (
    World,
    corners_of,
    normal_at,
    surface_index,
    unit,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

PI = wp.constant(3.14159265)


@wp.struct
class Infrared:
    """What a surface does to a laser's light that comes back the way it went.

    Attributes:
        even, rim: Diffuse reflectance is ``even * cosine + rim * sine^2`` of incidence.
        specular: Fresnel reflectance at normal incidence.
        alpha: Width of the specular lobe (GGX).
        retro: Reflectance of a retro-reflector, in units of a white matte surface seen square on.
    """

    even: float
    rim: float
    specular: float
    alpha: float
    retro: float


@wp.struct
class Scan:
    """Where rays start and how they spread.

    Attributes:
        R_world_lidar, eye_m: Pose of the scanner.
        reach_m: Rays end here.
        spread: Tangent of the angle between a beam's axis and the rays around it.
        subrays: 1 or 7.
        run: Rays per thread.
    """

    R_world_lidar: wp.mat33
    eye_m: wp.vec3
    reach_m: float
    spread: float
    subrays: int
    run: int


@wp.struct
class Travel:
    """What moves while beams leave one after the other.

    Attributes:
        keys: Poses that every mover has over the sweep; 0 = nothing moves, nothing else is read.
        rows: Row of each body among the movers; -1 = it stands still.
        B_mesh_lidar, eye_mesh: Directions and origin of the lidar frame in movers' mesh frames,
            [mover, key].
        phases: When each beam leaves, in keys.
        origins_m: Where it begins in the lidar frame.
    """

    keys: int
    rows: wp.array(dtype=int)
    B_mesh_lidar: wp.array(dtype=wp.mat33, ndim=2)
    eye_mesh: wp.array(dtype=wp.vec3, ndim=2)
    phases: wp.array(dtype=float)
    origins_m: wp.array(dtype=wp.vec3)


@wp.struct
class Ray:
    """A ray in the lidar frame.

    Attributes:
        key, share: It leaves this share of a step after this key.
    """

    direction: wp.vec3
    origin_m: wp.vec3
    key: int
    share: float


@wp.func
def ray_of_beam(axis: wp.vec3, k: int, spread: float):
    """The axis of a beam, or one of six rays around it."""
    if k == 0:
        return axis
    helper = wp.where(wp.abs(axis[2]) < 0.9, wp.vec3(0.0, 0.0, 1.0), wp.vec3(1.0, 0.0, 0.0))
    across = unit(wp.cross(helper, axis))
    up = wp.cross(axis, across)
    turn = float(k - 1) * (PI / 3.0)
    return unit(axis + (across * wp.cos(turn) + up * wp.sin(turn)) * spread)


@wp.func
def returned(light: Infrared, cosine: float):
    """Reflectance for light that returns along its way, incidence included.

    The diffuse term is Lambert's, ``even * cosine``, or that of a rough surface, whose facets face
    the scanner however it looks (Oren and Nayar, "Generalization of Lambert's reflectance model",
    1994, with light and eye on one side). The lobe is GGX with its half vector along the ray, in
    units of a white matte surface: ``pi * D * F * G / (4 cosine^2) * cosine`` with Smith's G, both
    ways alike (Walter et al., "Microfacet models for refraction", 2007).
    A retro-reflector keeps its entrance angles to about 60 degrees (ASTM D4956).
    """
    c = wp.max(cosine, 1.0e-3)
    a2 = light.alpha * light.alpha
    c2 = c * c
    base = c2 * (a2 - 1.0) + 1.0
    g1 = 2.0 * c / (c + wp.sqrt(a2 + (1.0 - a2) * c2))
    lobe = a2 / (base * base) * light.specular * g1 * g1 / (4.0 * c)
    diffuse = light.even * c + light.rim * (1.0 - c2)
    return diffuse + lobe + light.retro * c * wp.clamp((c - 0.35) * 4.0, 0.0, 1.0)


@wp.struct
class Nearest:
    """The nearest hit of a ray so far; body -1 where there is none.

    Attributes:
        u, v: Weights of the face's first two vertices.
    """

    range_m: float
    body: int
    face: int
    u: float
    v: float


@wp.func
def mover_frame(travel: Travel, m: int, ray: Ray):
    """Directions of the lidar frame in the mesh frame of mover m when a ray leaves."""
    before = travel.B_mesh_lidar[m, ray.key]
    return before + (travel.B_mesh_lidar[m, ray.key + 1] - before) * ray.share


@wp.func
def nearer(world: World, travel: Travel, b: int, ray: Ray, hit: Nearest):
    """The hit, or a nearer one on a body.

    From the scanner's own frame: what is far from the world's origin loses nothing.
    """
    d = world.bodies[b].B_mesh_camera @ ray.direction
    o = world.bodies[b].eye_mesh
    if travel.keys > 0:
        m = travel.rows[b]
        if m >= 0:
            B = mover_frame(travel, m, ray)
            before = travel.eye_mesh[m, ray.key]
            o = before + (travel.eye_mesh[m, ray.key + 1] - before) * ray.share
            o += B @ ray.origin_m
            d = B @ ray.direction
        else:
            o += world.bodies[b].B_mesh_camera @ ray.origin_m
    mesh = world.geometries[world.bodies[b].geometry].mesh
    answer = wp.mesh_query_ray(mesh, o, d, hit.range_m)
    if answer.result:
        hit.range_m = answer.t
        hit.body = b
        hit.face = answer.face
        hit.u = answer.u
        hit.v = answer.v
    return hit


@wp.func
def normal_of(scan: Scan, world: World, travel: Travel, ray: Ray, hit: Nearest):
    """Interpolated unit normal of a hit, lidar frame."""
    g = world.bodies[hit.body].geometry
    corner = corners_of(world, g, hit.face)
    n = normal_at(world, g, corner[0]) * hit.u
    n += normal_at(world, g, corner[1]) * hit.v
    n += normal_at(world, g, corner[2]) * (1.0 - hit.u - hit.v)
    if travel.keys > 0:
        m = travel.rows[hit.body]
        if m >= 0:
            return unit(wp.transpose(mover_frame(travel, m, ray)) @ n)
    return wp.transpose(scan.R_world_lidar) @ (world.bodies[hit.body].R_world_mesh @ unit(n))


@wp.kernel
def scan_beams(
    scan: Scan,
    world: World,
    travel: Travel,
    lights: wp.array(dtype=Infrared),
    axes: wp.array(dtype=wp.vec3),
    ranges_m: wp.array(dtype=float),
    reflectances: wp.array(dtype=float),
    cosines: wp.array(dtype=float),
    hits: wp.array(dtype=wp.vec2i),
):
    """First hit of every ray; ray k of beam i is at ``i * subrays + k``.

    Each thread takes ``run`` rays, one after the other: what the last one hit is tried first, and
    mostly leaves nothing else to try. Hits are (body, material), (-1, -1) where there is nothing.
    """
    t = wp.tid()
    end = wp.min((t + 1) * scan.run, ranges_m.shape[0])
    last = int(-1)
    for i in range(t * scan.run, end):
        beam = i / scan.subrays
        ray = Ray()
        ray.direction = ray_of_beam(axes[beam], i % scan.subrays, scan.spread)
        eye_m = scan.eye_m
        if travel.keys > 0:
            ray.origin_m = travel.origins_m[beam]
            ray.key = wp.min(int(travel.phases[beam]), travel.keys - 2)
            ray.share = travel.phases[beam] - float(ray.key)
            eye_m += scan.R_world_lidar @ ray.origin_m
        hit = Nearest()
        hit.range_m = scan.reach_m
        hit.body = -1
        if last >= 0:
            hit = nearer(world, travel, last, ray, hit)
        tried = last
        candidates = wp.bvh_query_ray(world.tree, eye_m, scan.R_world_lidar @ ray.direction)
        b = int(0)
        while wp.bvh_query_next(candidates, b, hit.range_m):
            if b != tried:
                hit = nearer(world, travel, b, ray, hit)
        last = hit.body
        if hit.body < 0:
            hits[i] = wp.vec2i(-1, -1)
            ranges_m[i] = wp.inf
            reflectances[i] = 0.0
            cosines[i] = 0.0
        else:
            n_lidar = normal_of(scan, world, travel, ray, hit)
            cosine = wp.min(wp.abs(wp.dot(n_lidar, ray.direction)), 1.0)
            material = surface_index(world, wp.vec2i(hit.body, hit.face))
            hits[i] = wp.vec2i(hit.body, material)
            ranges_m[i] = hit.range_m
            cosines[i] = cosine
            reflectances[i] = returned(lights[material], cosine)
