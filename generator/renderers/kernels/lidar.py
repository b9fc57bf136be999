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
    """

    R_world_lidar: wp.mat33
    eye_m: wp.vec3
    reach_m: float
    spread: float
    subrays: int


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


@wp.kernel
def scan_beams(
    scan: Scan,
    world: World,
    lights: wp.array(dtype=Infrared),
    axes: wp.array(dtype=wp.vec3),
    ranges_m: wp.array(dtype=float),
    reflectances: wp.array(dtype=float),
    cosines: wp.array(dtype=float),
    hits: wp.array(dtype=wp.vec2i),
):
    """First hit of every ray; ray k of beam i is at ``i * subrays + k``.

    Hits are (body, material), (-1, -1) where there is nothing.
    """
    i = wp.tid()
    ray = ray_of_beam(axes[i / scan.subrays], i % scan.subrays, scan.spread)
    nearest = float(scan.reach_m)
    hit = wp.vec2i(-1, -1)
    u = float(0.0)
    v = float(0.0)
    candidates = wp.bvh_query_ray(world.tree, scan.eye_m, scan.R_world_lidar @ ray)
    b = int(0)
    while wp.bvh_query_next(candidates, b, nearest):
        # From the scanner's own frame: what is far from the world's origin loses nothing.
        d = world.bodies[b].B_mesh_camera @ ray
        mesh = world.geometries[world.bodies[b].geometry].mesh
        answer = wp.mesh_query_ray(mesh, world.bodies[b].eye_mesh, d, nearest)
        if answer.result:
            nearest = answer.t
            hit = wp.vec2i(b, answer.face)
            u = answer.u
            v = answer.v
    if hit[0] < 0:
        hits[i] = hit
        ranges_m[i] = wp.inf
        reflectances[i] = 0.0
        cosines[i] = 0.0
        return
    g = world.bodies[hit[0]].geometry
    corner = corners_of(world, g, hit[1])
    n = normal_at(world, g, corner[0]) * u
    n += normal_at(world, g, corner[1]) * v
    n += normal_at(world, g, corner[2]) * (1.0 - u - v)
    n_lidar = wp.transpose(scan.R_world_lidar) @ (world.bodies[hit[0]].R_world_mesh @ unit(n))
    cosine = wp.min(wp.abs(wp.dot(n_lidar, ray)), 1.0)
    material = surface_index(world, hit)
    hits[i] = wp.vec2i(hit[0], material)
    ranges_m[i] = nearest
    cosines[i] = cosine
    reflectances[i] = returned(lights[material], cosine)
