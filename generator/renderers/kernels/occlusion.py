"""Soft shadows and ambient occlusion on the lattice, with as few rays as possible.

1. Tiles of the lattice find which bodies can come between them and each lamp (shafts, after
   Haines and Wallace, "Shaft culling for efficient ray-traced radiosity", 1991): most tiles
   find none, and their rays need not be cast.
2. Points cast one ray per lamp, half of them only where the other half differ; the sixteen points of a 4 x 4 block aim at sixteen parts of
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
    corners_of,
    greater,
    lesser,
    to_mesh_point,
    to_mesh_vector,
    unit,
    vertex_at,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

TILE = wp.constant(8)
LIST_LENGTH = wp.constant(48)
UNSEEN = wp.constant(-1.0)
TRIANGLES_LOOKED_AT = wp.constant(64)
# Where a sun is taken to be; no scene is larger.
SUN_DISTANCE_M = wp.constant(1.0e3)


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
def tile_of(lattice: Lattice, column: int, row: int):
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


@wp.struct
class Shaft:
    """All straight ways from a tile to a lamp, in a body's mesh frame.

    Attributes:
        start, way: From the tile's centre to the lamp's.
        radius, end_radius: Of a tube around it that holds the tile, and the lamp.
        normal, height: Plane below which nothing shades the tile, if ``flat``.
    """

    start: wp.vec3
    way: wp.vec3
    radius: float
    end_radius: float
    flat: int
    normal: wp.vec3
    height: float


@wp.func
def shaft_to(world: World, b: int, tile: Tile, way: wp.vec3, radius_m: float):
    """The shaft from a tile along a way, to a ball, seen from body b."""
    shrink = 1.0 / world.bodies[b].scale
    shaft = Shaft()
    shaft.start = to_mesh_point(world, b, tile.centre_m)
    shaft.way = to_mesh_vector(world, b, way)
    shaft.radius = tile.radius_m * shrink
    shaft.end_radius = radius_m * shrink
    shaft.flat = tile.flat
    shaft.normal = wp.transpose(world.bodies[b].R_world_mesh) @ tile.normal
    height_m = tile.height_m + 1.0e-4 - wp.dot(world.bodies[b].t_world_mesh, tile.normal)
    shaft.height = height_m * shrink
    return shaft


@wp.func
def overlap(shaft: Shaft, low: wp.vec3, high: wp.vec3, grown: float):
    """The stretch of a shaft's axis that lies in a grown box; empty if it ends before it begins."""
    t0 = float(0.0)
    t1 = float(1.0)
    for k in range(3):
        a = low[k] - grown - shaft.start[k]
        c = high[k] + grown - shaft.start[k]
        inverse = 1.0 / wp.where(wp.abs(shaft.way[k]) < 1.0e-20, 1.0e-20, shaft.way[k])
        t0 = greater(t0, lesser(a * inverse, c * inverse))
        t1 = lesser(t1, greater(a * inverse, c * inverse))
    return t0, t1


@wp.func
def touches(shaft: Shaft, low: wp.vec3, high: wp.vec3):
    """Whether a box may reach into a shaft."""
    if shaft.flat != 0:
        top = wp.dot(shaft.normal, (low + high) * 0.5)
        if top + wp.dot(wp.abs(shaft.normal), (high - low) * 0.5) <= shaft.height:
            return False
    # The shaft is as wide as its wider end, then only as wide as where the box may touch it.
    t0, t1 = overlap(shaft, low, high, wp.max(shaft.radius, shaft.end_radius))
    for _ in range(2):
        if t0 <= t1:
            widening = shaft.end_radius - shaft.radius
            grown = shaft.radius + wp.max(widening * t0, widening * t1)
            t0, t1 = overlap(shaft, low, high, grown)
    return t0 <= t1


@wp.func
def triangles_touch(shaft: Shaft, world: World, g: int):
    """Whether any triangle may reach into a shaft; True where it is tedious to know.

    Bodies that surround the scene (a room) or are long and slanted have boxes that touch
    everything; their triangles do not.
    """
    here = wp.vec3(shaft.radius, shaft.radius, shaft.radius)
    there = wp.vec3(shaft.end_radius, shaft.end_radius, shaft.end_radius)
    end = shaft.start + shaft.way
    query = wp.mesh_query_aabb(
        world.geometries[g].mesh,
        wp.min(shaft.start - here, end - there),
        wp.max(shaft.start + here, end + there),
    )
    found = bool(False)
    face = int(0)
    looked_at = int(0)
    while wp.mesh_query_aabb_next(query, face):
        corner = corners_of(world, g, face)
        a = vertex_at(world, g, corner[0])
        b = vertex_at(world, g, corner[1])
        c = vertex_at(world, g, corner[2])
        rises = bool(True)
        if shaft.flat != 0:
            top = wp.max(wp.dot(shaft.normal, a), wp.dot(shaft.normal, b))
            rises = wp.max(top, wp.dot(shaft.normal, c)) > shaft.height
        looked_at += 1
        if looked_at > TRIANGLES_LOOKED_AT:
            found = True
        elif rises and touches(shaft, wp.min(a, wp.min(b, c)), wp.max(a, wp.max(b, c))):
            found = True
        if found:
            break
    return found


@wp.func
def may_shade(world: World, b: int, tile: Tile, way: wp.vec3, radius_m: float):
    """Whether a body may come between a tile and a ball at the end of a way."""
    # Box against box first: it settles most cases.
    here = wp.vec3(tile.radius_m, tile.radius_m, tile.radius_m)
    there = wp.vec3(radius_m, radius_m, radius_m)
    end = tile.centre_m + way
    low = wp.min(tile.centre_m - here, end - there) - world.bodies[b].high_m
    high = wp.max(tile.centre_m + here, end + there) - world.bodies[b].low_m
    if wp.max(low) > 0.0 or wp.min(high) < 0.0:
        return False
    g = world.bodies[b].geometry
    shaft = shaft_to(world, b, tile, way, radius_m)
    shades = touches(shaft, world.geometries[g].low_m, world.geometries[g].high_m)
    if shades:
        shades = triangles_touch(shaft, world, g)
    return shades


@wp.func
def may_shade_from(world: World, b: int, tile: Tile, lamp: Lamp):
    """Whether a body may come between a tile and a lamp."""
    way = lamp.position_m - tile.centre_m
    radius_m = lamp.radius
    if lamp.kind == SUN:
        way = lamp.direction * -SUN_DISTANCE_M
        radius_m = lamp.radius * SUN_DISTANCE_M
    return may_shade(world, b, tile, way, radius_m)


@wp.func
def append(lists: wp.array(dtype=int, ndim=3), tile: int, j: int, b: int):
    """Put a body on a list, or mark the list as too long."""
    n = lists[tile, j, 0]
    if n >= 0 and n < LIST_LENGTH:
        lists[tile, j, 1 + n] = b
        lists[tile, j, 0] = n + 1
    else:
        lists[tile, j, 0] = -1


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
    tile = tile_of(lattice, i % tile_columns, i / tile_columns)
    lamps = world.lamps.shape[0]
    for j in range(lamps + 1):
        lists[i, j, 0] = 0
    if tile.count == 0:
        return
    near = tile
    near.radius_m = tile.radius_m + ambient_radius_m
    for b in range(world.bodies.shape[0]):
        for j in range(lamps):
            if may_shade_from(world, b, tile, world.lamps[j]):
                append(lists, i, j, b)
        if may_shade(world, b, near, wp.vec3(0.0), near.radius_m):
            append(lists, i, lamps, b)


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
    enters = greater(greater(lesser(a[0], c[0]), lesser(a[1], c[1])), lesser(a[2], c[2]))
    leaves = lesser(lesser(greater(a[0], c[0]), greater(a[1], c[1])), greater(a[2], c[2]))
    return greater(enters, 0.0) <= lesser(leaves, 1.0)


@wp.func
def blocked_by(world: World, b: int, path: Path):
    """Whether a body cuts a path."""
    hit = enters_box(world, b, path)
    if hit:
        o = to_mesh_point(world, b, path.origin)
        d = to_mesh_vector(world, b, path.way)
        mesh = world.geometries[world.bodies[b].geometry].mesh
        hit = wp.mesh_query_ray_anyhit(mesh, o, d, 1.0)
    return hit


@wp.func
def blocked(world: World, path: Path):
    """Whether anything cuts a path."""
    hit = bool(False)
    candidates = wp.bvh_query_ray(world.tree, path.origin, path.way)
    b = int(0)
    while wp.bvh_query_next(candidates, b, 1.0):
        if not hit:
            hit = blocked_by(world, b, path)
    return hit


@wp.func
def blocked_by_listed(
    world: World, lists: wp.array(dtype=int, ndim=3), tile: int, j: int, skip: int, path: Path
):
    """Whether anything but ``skip`` cuts the path from a point of a tile to lamp j."""
    hit = bool(False)
    count = lists[tile, j, 0]
    if count < 0:
        return blocked(world, path)
    for k in range(count):
        b = lists[tile, j, 1 + k]
        if b != skip:
            hit = blocked_by(world, b, path)
            if hit:
                break
    return hit


@wp.func
def bayer(x: int, y: int):
    """Rank 0..15 within a 4 x 4 block such that near neighbours differ much (Bayer 1973)."""
    q = x ^ y
    return (q & 1) * 8 + (y & 1) * 4 + ((q >> 1) & 1) * 2 + ((y >> 1) & 1)


@wp.func
def frame_of(z: wp.vec3):
    """Two unit vectors that complete a right-handed frame.

    Source: Duff et al., "Building an orthonormal basis, revisited", JCGT 2017.
    """
    sign = wp.where(z[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z[2])
    b = z[0] * z[1] * a
    x = wp.vec3(1.0 + sign * z[0] * z[0] * a, sign * b, -sign * z[0])
    y = wp.vec3(b, sign + z[1] * z[1] * a, -z[1])
    return x, y


@wp.func
def way_to_lamp(lamp: Lamp, origin: wp.vec3, part: wp.vec2):
    """From a point to a part of a lamp's disc."""
    to_lamp = lamp.position_m - origin
    radius = lamp.radius
    if lamp.kind == SUN:
        to_lamp = lamp.direction * -SUN_DISTANCE_M
        radius = lamp.radius * SUN_DISTANCE_M
    x, y = frame_of(unit(to_lamp))
    return to_lamp + (x * part[0] + y * part[1]) * radius


@wp.func
def tile_index(lattice: Lattice, i: int, tile_columns: int):
    """The tile a lattice point belongs to."""
    return ((i / lattice.width) / TILE) * tile_columns + (i % lattice.width) / TILE


@wp.func
def settled(lattice: Lattice, values: wp.array(dtype=float, ndim=2), j: int, x: int, y: int):
    """What the points beside, above and below a point agree on; UNSEEN if they do not.

    Each of them must be there, on the same material.
    """
    i = y * lattice.width + x
    value = float(UNSEEN)
    if x > 0 and y > 0 and x < lattice.width - 1 and y < lattice.height - 1:
        own = lattice.surface[i]
        value = values[j, i - 1]
        for k in range(4):
            q = i + wp.where(k < 2, 1, lattice.width) * wp.where((k & 1) == 0, 1, -1)
            if lattice.surface[q] != own or values[j, q] != value:
                value = UNSEEN
    return value


@wp.kernel
def probe_lamps(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array(dtype=int, ndim=3),
    disc: wp.array(dtype=wp.vec2),
    parity: int,
    lit: wp.array(dtype=float, ndim=2),
):
    """One ray per point and lamp: 1, 0, or UNSEEN where the lamp lights nothing anyway.

    Args:
        disc: Forty-eight points of the unit disc; a point looks at one of three in a row.
        parity: 0 to probe the black fields of a chessboard. 1, after that, for the white ones:
            they are probed only where black ones around them differ.
    """
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    if ((x + y) & 1) != parity:
        return
    tile = tile_index(lattice, i, tile_columns)
    for j in range(world.lamps.shape[0]):
        value = float(UNSEEN)
        if lattice.body[i] >= 0:
            if parity == 1:
                value = settled(lattice, lit, j, x, y)
            if value == UNSEEN:
                value = probed(world, lattice, lists, tile, i, j, disc[3 * bayer(x, y) + 1])
        lit[j, i] = value


@wp.func
def probed(
    world: World,
    lattice: Lattice,
    lists: wp.array(dtype=int, ndim=3),
    tile: int,
    i: int,
    j: int,
    part: wp.vec2,
):
    """Whether point i sees a part of lamp j."""
    value = float(UNSEEN)
    origin = lattice.origin_m[i]
    beam = beam_from(world.lamps[j], origin)
    if (
        wp.dot(beam.direction, lattice.normal[i]) > -beam.spread
        and wp.max(beam.normal_lux) > 0.0
    ):
        value = 1.0
        if lists[tile, j, 0] != 0:
            path = path_along(origin, way_to_lamp(world.lamps[j], origin, part))
            if blocked_by_listed(world, lists, tile, j, lattice.skip[i], path):
                value = 0.0
    return value


@wp.kernel
def classify_blocks(
    lattice: Lattice, values: wp.array(dtype=float, ndim=2), classes: wp.array(dtype=int, ndim=3)
):
    """What the points of each aligned 4 x 4 block say: bits 1 for zeros, 2 for ones, 4 for else."""
    row, column, j = wp.tid()
    found = int(0)
    for y in range(4 * row, wp.min(4 * row + 4, lattice.height)):
        for x in range(4 * column, wp.min(4 * column + 4, lattice.width)):
            value = values[j, y * lattice.width + x]
            if value == 0.0:
                found = found | 1
            elif value == 1.0:
                found = found | 2
            elif value != UNSEEN:
                found = found | 4
    classes[row, column, j] = found


@wp.func
def classes_around(classes: wp.array(dtype=int, ndim=3), x: int, y: int, j: int):
    """What the blocks say that a 4 x 4 window around a point touches."""
    last_row = classes.shape[0] - 1
    last_column = classes.shape[1] - 1
    x0 = wp.max((x - 2) >> 2, 0)
    y0 = wp.max((y - 2) >> 2, 0)
    x1 = wp.min((x + 1) >> 2, last_column)
    y1 = wp.min((y + 1) >> 2, last_row)
    return classes[y0, x0, j] | classes[y0, x1, j] | classes[y1, x0, j] | classes[y1, x1, j]


@wp.func
def window_bits(lattice: Lattice, values: wp.array(dtype=float, ndim=2), j: int, i: int):
    """What the points of the same material say in the 4 x 4 window around a point."""
    x = i % lattice.width
    y = i / lattice.width
    own = lattice.surface[i]
    found = int(0)
    for v in range(wp.max(y - 2, 0), wp.min(y + 2, lattice.height)):
        for u in range(wp.max(x - 2, 0), wp.min(x + 2, lattice.width)):
            k = v * lattice.width + u
            if lattice.surface[k] == own:
                value = values[j, k]
                found = found | wp.where(value == 1.0, 2, wp.where(value == 0.0, 1, 0))
    return found


@wp.func
def window_sum(
    lattice: Lattice,
    values: wp.array(dtype=float, ndim=2),
    j: int,
    i: int,
    half: int,
    tolerance_m: float,
):
    """Sum and number of the values in a window around a point, on its own surface."""
    x = i % lattice.width
    y = i / lattice.width
    total = float(0.0)
    count = float(0.0)
    for v in range(wp.max(y - half, 0), wp.min(y + half, lattice.height)):
        for u in range(wp.max(x - half, 0), wp.min(x + half, lattice.width)):
            k = v * lattice.width + u
            value = values[j, k]
            if value != UNSEEN and same_surface(lattice, i, k, tolerance_m):
                total += value
                count += 1.0
    return total, count


@wp.func
def window_mean(
    lattice: Lattice,
    values: wp.array(dtype=float, ndim=2),
    j: int,
    i: int,
    tolerance_m: float,
):
    """Mean over the 4 x 4 window around a point, or 8 x 8 where its surface ends nearby."""
    total, count = window_sum(lattice, values, j, i, 2, tolerance_m)
    if count < 12.0:
        # Half a window has seen half of the lamp, or of the sky.
        total, count = window_sum(lattice, values, j, i, 4, tolerance_m)
    mean = values[j, i]
    if count > 0.0:
        mean = total / count
    return mean


@wp.kernel
def refine_lamps(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array(dtype=int, ndim=3),
    disc: wp.array(dtype=wp.vec2),
    classes: wp.array(dtype=int, ndim=3),
    probed: wp.array(dtype=float, ndim=2),
    lit: wp.array(dtype=float, ndim=2),
):
    """Two more rays where a lamp is neither seen by all points around nor by none.

    Args:
        disc: As for probe_lamps.
    """
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    tile = tile_index(lattice, i, tile_columns)
    for j in range(world.lamps.shape[0]):
        value = probed[j, i]
        if value != UNSEEN and (classes_around(classes, x, y, j) & 3) == 3:
            if window_bits(lattice, probed, j, i) == 3:
                seen = value
                origin = lattice.origin_m[i]
                for k in range(2):
                    part = disc[3 * bayer(x, y) + 2 * k]
                    path = path_along(origin, way_to_lamp(world.lamps[j], origin, part))
                    if not blocked_by_listed(world, lists, tile, j, lattice.skip[i], path):
                        seen += 1.0
                value = seen / 3.0
        lit[j, i] = value


@wp.func
def surface_tolerance(view: View, p: wp.vec3):
    """How far from a point's tangent plane its neighbours may be: three pixels' width."""
    return 3.0 * view.pixel_rad * wp.length(p - view.eye_m)


@wp.kernel
def smooth_lattice(
    view: View,
    lattice: Lattice,
    classes: wp.array(dtype=int, ndim=3),
    values: wp.array(dtype=float, ndim=2),
    smoothed: wp.array(dtype=float, ndim=2),
):
    """Average the values of neighbours on one surface, wherever they differ."""
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    for j in range(values.shape[0]):
        value = values[j, i]
        if value != UNSEEN:
            found = classes_around(classes, x, y, j)
            if found == 1 or found == 2:
                value = float(found - 1)
            else:
                tolerance_m = surface_tolerance(view, lattice.p_m[i])
                value = window_mean(lattice, values, j, i, tolerance_m)
        smoothed[j, i] = value


@wp.kernel
def probe_ambient(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array(dtype=int, ndim=3),
    hemisphere: wp.array(dtype=wp.vec3),
    radius_m: float,
    open_sky: wp.array(dtype=float, ndim=2),
):
    """One short ray per point: 1 where it meets nothing, less the nearer the obstacle.

    Args:
        hemisphere: Sixteen directions about +Z with cosine-weighted density.
    """
    i = wp.tid()
    value = float(UNSEEN)
    if lattice.body[i] >= 0:
        value = 1.0
        lamps = world.lamps.shape[0]
        tile = tile_index(lattice, i, tile_columns)
        if lists[tile, lamps, 0] != 0:
            n = lattice.normal[i]
            x, y = frame_of(n)
            h = hemisphere[bayer(i % lattice.width, i / lattice.width)]
            way = (x * h[0] + y * h[1] + n * h[2]) * radius_m
            path = path_along(lattice.origin_m[i], way)
            t = free_of_listed(world, lists, tile, lattice.skip[i], path)
            value = t * (2.0 - t)
    open_sky[0, i] = value


@wp.func
def free_path(world: World, path: Path):
    """The part of a path that is free, from 0 to 1."""
    free = float(1.0)
    candidates = wp.bvh_query_ray(world.tree, path.origin, path.way)
    b = int(0)
    while wp.bvh_query_next(candidates, b, free):
        free = freed_by(world, b, path, free)
    return free


@wp.func
def free_of_listed(
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
            free = freed_by(world, b, path, free)
    return free


@wp.func
def freed_by(world: World, b: int, path: Path, free: float):
    """The free part of a path before one body, at most ``free``."""
    if enters_box(world, b, path):
        o = to_mesh_point(world, b, path.origin)
        d = to_mesh_vector(world, b, path.way)
        mesh = world.geometries[world.bodies[b].geometry].mesh
        answer = wp.mesh_query_ray(mesh, o, d, free)
        if answer.result:
            free = answer.t
    return free
