"""Rays through the two-level hierarchy: bodies above, each mesh's triangles below."""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.alpha_test import (
    OUT_OF_LINE,
    closest_solid_hit,
    first_opaque_hit,
    is_mesh_intersected,
)
from gen_data.generator.renderers.warp.scene.kernels.bvh_traverse import (
    any_in_scene,
    first_in_scene,
)
from gen_data.generator.renderers.warp.scene.kernels.records import (
    CLEAR,
    HOLES,
    View,
    World,
    is_in_view,
    max_of_two,
    min_of_two,
    pixel_direction,
    to_mesh_point,
    to_mesh_vector,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

FARTHEST = wp.constant(1.0e6)
# What is lower than this over a surface keeps rain and snow off it.
SHELTER_M = wp.constant(2.5)
# What shadows pass.
LIGHT = wp.constant(HOLES | CLEAR)


@wp.struct
class RayHit:
    """Where a ray meets a surface.

    Attributes:
        at: (body, face); (-1, -1) where it meets none.
        t: Parameter along the ray; how far it was followed where it meets nothing.
        weight: Barycentric, of the face's second and third corner.
    """

    at: wp.vec2i
    t: float
    weight: wp.vec2


@wp.func
def closest_hit(world: World, o: wp.vec3, d: wp.vec3, reach: float, through: int):
    """The first surface that a ray does not pass.

    Args:
        reach: Largest parameter along the ray.
        through: What it may pass, HOLES or CLEAR or both.
    """
    found = first_in_scene(
        world.tree, world.hierarchy, world.bodies, world.geometries, o, d, reach, through
    )
    met = RayHit()
    met.at = wp.vec2i(int(found[4]), int(found[3]))
    met.t = float(found[0])
    met.weight = wp.vec2(float(found[2]), 1.0 - float(found[1]) - float(found[2]))
    if world.cutout_hierarchy != wp.uint64(0):
        met = closest_cutout_hit(world, o, d, through, met)
    return met


@wp.func(**OUT_OF_LINE)
def closest_cutout_hit(world: World, o: wp.vec3, d: wp.vec3, through: int, before: RayHit):
    """The first point of bodies that may be passed, or what the ray meets before."""
    met = before
    candidates = wp.bvh_query_ray(world.cutout_hierarchy, o, d)
    k = int(0)
    while wp.bvh_query_next(candidates, k, met.t):
        b = world.cutouts[k]
        if (world.bodies[b].cutouts & through) != 0:
            origin = to_mesh_point(world, b, o)
            direction = to_mesh_vector(world, b, d)
            strike = first_opaque_hit(world, b, origin, direction, met.t, through)
            if strike.face >= 0:
                met.t = strike.t
                met.at = wp.vec2i(b, strike.face)
                met.weight = wp.vec2(strike.v, 1.0 - strike.u - strike.v)
    return met


@wp.kernel
def trace_pixels(view: View, world: World, t_min: float, hits: wp.array(dtype=wp.vec2i)):
    """Nearest (body, face) through every pixel centre."""
    i = wp.tid()
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    hit = wp.vec2i(-1, -1)
    if is_in_view(view, i):
        hit = closest_hit(world, view.eye_m + d * t_min, d, FARTHEST, HOLES).at
    hits[i] = hit


@wp.struct
class Path:
    """A straight way in the world, from 0 to 1."""

    origin: wp.vec3
    way: wp.vec3
    inverse: wp.vec3


@wp.func
def path_along(origin: wp.vec3, way: wp.vec3):
    """The path with the reciprocals that box tests need."""
    path = Path()
    path.origin = origin
    path.way = way
    # A grain instead of zero: its reciprocal is large, and its sign does not matter.
    x = wp.where(wp.abs(way[0]) < 1.0e-20, 1.0e-20, way[0])
    y = wp.where(wp.abs(way[1]) < 1.0e-20, 1.0e-20, way[1])
    z = wp.where(wp.abs(way[2]) < 1.0e-20, 1.0e-20, way[2])
    path.inverse = wp.vec3(1.0 / x, 1.0 / y, 1.0 / z)
    return path


@wp.func
def enters_box(world: World, b: int, path: Path):
    """Whether a path may enter a body's box: settles most cases before a query is made."""
    a = wp.cw_mul(world.bodies[b].low_m - path.origin, path.inverse)
    c = wp.cw_mul(world.bodies[b].high_m - path.origin, path.inverse)
    enters = max_of_two(
        max_of_two(min_of_two(a[0], c[0]), min_of_two(a[1], c[1])), min_of_two(a[2], c[2])
    )
    leaves = min_of_two(
        min_of_two(max_of_two(a[0], c[0]), max_of_two(a[1], c[1])), max_of_two(a[2], c[2])
    )
    return max_of_two(enters, 0.0) <= min_of_two(leaves, 1.0)


@wp.func
def is_cut_by(world: World, b: int, path: Path, through: int):
    """Whether a body cuts a path that passes what ``through`` says, HOLES or CLEAR or both."""
    hit = enters_box(world, b, path)
    if hit:
        o = to_mesh_point(world, b, path.origin)
        d = to_mesh_vector(world, b, path.way)
        hit = is_mesh_intersected(world, b, o, d, 1.0, through)
    return hit


@wp.func
def is_blocked_by(world: World, b: int, path: Path):
    """Whether a body keeps light off a path."""
    return is_cut_by(world, b, path, LIGHT)


@wp.func
def is_occluded(world: World, path: Path):
    """Whether anything keeps light off a path."""
    return is_intersected(world, path, LIGHT)


@wp.func
def is_intersected(world: World, path: Path, through: int):
    """Whether anything cuts a path that passes what ``through`` says."""
    hit = any_in_scene(
        world.tree,
        world.hierarchy,
        world.bodies,
        world.geometries,
        path.origin,
        path.way,
        1.0,
        through,
    )
    if not hit and world.cutout_hierarchy != wp.uint64(0):
        hit = is_cut_by_cutouts(world, path, through)
    return hit


@wp.func(**OUT_OF_LINE)
def is_cut_by_cutouts(world: World, path: Path, through: int):
    """Whether a body that may be passed cuts a path."""
    hit = bool(False)
    candidates = wp.bvh_query_ray(world.cutout_hierarchy, path.origin, path.way)
    k = int(0)
    while wp.bvh_query_next(candidates, k, 1.0):
        b = world.cutouts[k]
        if (world.bodies[b].cutouts & through) != 0:
            hit = is_cut_by(world, b, path, through)
            if hit:
                break
    return hit


@wp.func
def is_occluded_by_listed(
    world: World, lists: wp.array(dtype=int, ndim=3), tile: int, j: int, skip: int, path: Path
):
    """Whether anything but ``skip`` cuts the path from a point of a tile to lamp j."""
    hit = bool(False)
    count = lists[tile, j, 0]
    if count < 0:
        return is_occluded(world, path)
    for k in range(count):
        b = lists[tile, j, 1 + k]
        if b != skip:
            hit = is_blocked_by(world, b, path)
            if hit:
                break
    return hit


@wp.func
def free_path(world: World, path: Path):
    """The part of a path that is free, from 0 to 1."""
    return closest_hit(world, path.origin, path.way, 1.0, LIGHT).t


@wp.func
def free_path_of_listed(
    world: World, lists: wp.array(dtype=int, ndim=3), tile: int, skip: int, path: Path
):
    """The part of a path from a point of a tile that is free of anything but ``skip``."""
    j = world.lamps.shape[0]
    free = float(1.0)
    count = lists[tile, j, 0]
    if count < 0:
        return free_path(world, path)
    for k in range(count):
        b = lists[tile, j, 1 + k]
        if b != skip:
            free = free_path_before(world, b, path, free)
    return free


@wp.func
def free_path_before(world: World, b: int, path: Path, free: float):
    """The free part of a path before one body, at most ``free``."""
    if enters_box(world, b, path):
        o = to_mesh_point(world, b, path.origin)
        d = to_mesh_vector(world, b, path.way)
        strike = closest_solid_hit(world, b, o, d, free, LIGHT)
        if strike.face >= 0:
            free = strike.t
    return free


@wp.func
def precipitation_exposure(world: World, origin: wp.vec3):
    """Share of what falls that reaches a point: a ray up, astray by where the point is."""
    x = origin[0] * 5.0
    y = origin[1] * 5.0
    east = 0.15 * wp.sin(1.7 * x + 2.3 * wp.sin(1.3 * y))
    north = 0.15 * wp.sin(1.9 * y + 2.1 * wp.sin(1.1 * x))
    free = float(1.0)
    if is_intersected(world, path_along(origin, wp.vec3(east, north, 1.0) * SHELTER_M), HOLES):
        free = 0.0
    return free
