"""Rays through the two-level hierarchy: bodies above, each mesh's triangles below."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import (
    View,
    World,
    pixel_direction,
    to_mesh_point,
    to_mesh_vector,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

FARTHEST = wp.constant(1.0e6)


@wp.func
def nearest_hit(world: World, origin: wp.vec3, direction: wp.vec3, t_min: float):
    """(body, face) of the first surface beyond ``t_min``; (-1, -1) where there is none.

    Parameters along the ray are in units of the direction's length.
    """
    nearest = float(FARTHEST)
    hit = wp.vec2i(-1, -1)
    start = origin + direction * t_min
    candidates = wp.bvh_query_ray(world.tree, start, direction)
    b = int(0)
    while wp.bvh_query_next(candidates, b, nearest):
        o = to_mesh_point(world, b, start)
        d = to_mesh_vector(world, b, direction)
        mesh = world.geometries[world.bodies[b].geometry].mesh
        answer = wp.mesh_query_ray(mesh, o, d, nearest)
        if answer.result:
            nearest = answer.t
            hit = wp.vec2i(b, answer.face)
    return hit


@wp.kernel
def trace_pixels(view: View, world: World, t_min: float, hits: wp.array(dtype=wp.vec2i)):
    """Nearest (body, face) through every pixel centre."""
    i = wp.tid()
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = view.R_world_camera @ pixel_direction(view, x, y)
    hits[i] = nearest_hit(world, view.eye_m, d, t_min)
