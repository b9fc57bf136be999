"""Soft shadows and ambient occlusion on the lattice, with as few rays as possible.

1. Tiles of the lattice find which bodies can come between them and each lamp (shafts, after
   Haines and Wallace, "Shaft culling for efficient ray-traced radiosity", 1991): most tiles
   find none, and their rays need not be cast.
2. Every point casts one ray per lamp; the sixteen points of a 4 x 4 block aim at sixteen parts of
   the lamp (interleaved sampling, Keller and Heidrich 2001).
3. Where all points of a block's neighbourhood agree, that is the answer. Elsewhere, in penumbrae,
   points cast more rays, and the sixteen neighbours on the same surface are averaged: together
   they have seen all parts of the lamp, whatever the position, so that no pattern remains.
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.lattice import Lattice, same_surface
from generator.renderers.kernels.lighting import SUN, beam_from
from generator.renderers.kernels.records import (
    Lamp,
    View,
    World,
    to_mesh_point,
    to_mesh_vector,
    unit,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

TILE = wp.constant(8)
LIST_LENGTH = wp.constant(48)
UNSEEN = wp.constant(-1.0)
GOLDEN_ANGLE = wp.constant(2.399963)


@wp.struct
class Tile:
    """A ball around the points of a tile, and the plane they lie on if they do."""

    count: int
    centre_m: wp.vec3
    radius_m: float
    flat: int
    normal: wp.vec3
    height_m: float


@wp.func
def tile_of(lattice: Lattice, column: int, row: int, tolerance: float):
    """Bounds of one tile."""
    low = wp.vec3(1.0e9)
    high = wp.vec3(-1.0e9)
    tile = Tile()
    tile.flat = 1
    tile.height_m = -1.0e9
    for y in range(row * TILE, wp.min((row + 1) * TILE, lattice.height)):
        for x in range(column * TILE, wp.min((column + 1) * TILE, lattice.width)):
            i = y * lattice.width + x
            if lattice.body[i] >= 0:
                p = lattice.p_m[i]
                low = wp.min(low, p)
                high = wp.max(high, p)
                if tile.count == 0:
                    tile.normal = lattice.normal[i]
                if wp.dot(lattice.normal[i], tile.normal) < 0.99999:
                    tile.flat = 0
                tile.height_m = wp.max(tile.height_m, wp.dot(p, tile.normal))
                tile.count += 1
    tile.centre_m = (low + high) * 0.5
    tile.radius_m = wp.length(high - low) * 0.5
    return tile


@wp.func
def in_shaft(world: World, b: int, tile: Tile, to_lamp: wp.vec3, radius_m: float):
    """Whether a body's box may touch the shaft between a tile and a ball."""
    body = world.bodies[b]
    geometry = world.geometries[body.geometry]
    low = geometry.low_m
    high = geometry.high_m
    o = to_mesh_point(body, tile.centre_m)
    d = to_mesh_vector(body, to_lamp)
    grown = wp.max(tile.radius_m, radius_m) / body.scale
    t0 = float(0.0)
    t1 = float(1.0)
    for k in range(3):
        a = low[k] - grown - o[k]
        c = high[k] + grown - o[k]
        if wp.abs(d[k]) > 1.0e-9:
            inverse = 1.0 / d[k]
            t0 = wp.max(t0, wp.min(a * inverse, c * inverse))
            t1 = wp.min(t1, wp.max(a * inverse, c * inverse))
        elif a > 0.0 or c < 0.0:
            t1 = -1.0
    return t0 <= t1


@wp.func
def above_tile(world: World, b: int, tile: Tile):
    """Whether any of a body's box rises above the plane of a flat tile."""
    body = world.bodies[b]
    geometry = world.geometries[body.geometry]
    n = wp.transpose(body.R_world_mesh) @ tile.normal
    centre = (geometry.low_m + geometry.high_m) * 0.5
    half = (geometry.high_m - geometry.low_m) * 0.5
    top = wp.dot(n, centre) + wp.dot(wp.abs(n), half)
    return top * body.scale + wp.dot(body.t_world_mesh, tile.normal) > tile.height_m + 1.0e-4


@wp.kernel
def list_occluders(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    ambient_radius_m: float,
    lists: wp.array(dtype=int, ndim=3),
):
    """Bodies that may shade each tile from each lamp; the last list is for ambient occlusion.

    A list begins with its length, which is -1 where it would be too long.
    """
    i = wp.tid()
    tile = tile_of(lattice, i % tile_columns, i / tile_columns, 0.0)
    lamps = world.lamps.shape[0]
    for j in range(lamps + 1):
        lists[i, j, 0] = 0
    if tile.count == 0:
        return
    for b in range(world.bodies.shape[0]):
        candidate = bool(True)
        if tile.flat != 0:
            candidate = above_tile(world, b, tile)
        if candidate:
            for j in range(lamps + 1):
                touches = bool(False)
                if j == lamps:
                    near = Tile()
                    near.centre_m = tile.centre_m
                    near.radius_m = tile.radius_m + ambient_radius_m
                    touches = in_shaft(world, b, near, wp.vec3(0.0), 0.0)
                elif world.lamps[j].kind == SUN:
                    far = world.lamps[j].direction * -1.0e3
                    touches = in_shaft(world, b, tile, far, world.lamps[j].radius * 30.0)
                else:
                    to_lamp = world.lamps[j].position_m - tile.centre_m
                    touches = in_shaft(world, b, tile, to_lamp, world.lamps[j].radius)
                if touches:
                    n = lists[i, j, 0]
                    if n >= 0 and n < LIST_LENGTH:
                        lists[i, j, 1 + n] = b
                        lists[i, j, 0] = n + 1
                    else:
                        lists[i, j, 0] = -1


@wp.func
def blocked_by(world: World, b: int, origin: wp.vec3, path: wp.vec3):
    """Whether a body cuts the straight path."""
    body = world.bodies[b]
    o = to_mesh_point(body, origin)
    d = to_mesh_vector(body, path)
    return wp.mesh_query_ray_anyhit(world.geometries[body.geometry].mesh, o, d, 1.0)


@wp.func
def blocked(
    world: World,
    lists: wp.array(dtype=int, ndim=3),
    tile: int,
    j: int,
    skip: int,
    origin: wp.vec3,
    path: wp.vec3,
):
    """Whether anything but ``skip`` cuts the path from a point of a tile to lamp j."""
    hit = bool(False)
    count = lists[tile, j, 0]
    if count >= 0:
        for k in range(count):
            b = lists[tile, j, 1 + k]
            if not hit and b != skip:
                hit = blocked_by(world, b, origin, path)
    else:
        candidates = wp.bvh_query_ray(world.tree, origin, path)
        b = int(0)
        while wp.bvh_query_next(candidates, b, 1.0):
            if not hit and b != skip:
                hit = blocked_by(world, b, origin, path)
    return hit


@wp.func
def bayer(x: int, y: int):
    """Rank 0..15 within a 4 x 4 block such that near neighbours differ much (Bayer 1973)."""
    q = x ^ y
    return (q & 1) * 8 + (y & 1) * 4 + ((q >> 1) & 1) * 2 + ((y >> 1) & 1)


@wp.func
def sunflower(k: int, n: int):
    """Point k of n spread evenly over the unit disc (Vogel 1979)."""
    r = wp.sqrt((float(k) + 0.5) / float(n))
    a = float(k) * GOLDEN_ANGLE
    return wp.vec2(r * wp.cos(a), r * wp.sin(a))


@wp.func
def path_to_lamp(lamp: Lamp, origin: wp.vec3, k: int, n: int):
    """From a point to part k of n of a lamp."""
    to_lamp = lamp.position_m - origin
    radius = lamp.radius
    if lamp.kind == SUN:
        to_lamp = lamp.direction * -1.0e3
        radius = lamp.radius * 1.0e3
    z = unit(to_lamp)
    x = unit(wp.cross(wp.where(wp.abs(z[2]) < 0.9, wp.vec3(0.0, 0.0, 1.0), wp.vec3(1.0, 0.0, 0.0)), z))
    y = wp.cross(z, x)
    s = sunflower(k, n)
    return to_lamp + (x * s[0] + y * s[1]) * radius
