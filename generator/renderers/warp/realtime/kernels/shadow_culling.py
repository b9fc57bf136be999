"""Shaft culling: which bodies may block the light between a tile of points and a lamp.

Source: Haines and Wallace, "Shaft culling for efficient ray-traced radiosity", 1991.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels.analytic_lights import SUN, SUN_DISTANCE_M
from gen_data.renderers.warp.scene.kernels.box_groups import high_corner, low_corner, next_in_shaft
from gen_data.renderers.warp.scene.kernels.lattice import Lattice
from gen_data.renderers.warp.scene.kernels.material_eval import is_translucent
from gen_data.renderers.warp.scene.kernels.records import (
    World,
    reciprocals,
    to_mesh_point,
    to_mesh_vector,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Lattice points along a tile's edge.
TILE = wp.constant(8)
# Longer lists are not worth their memory: rays then query the hierarchy over all bodies.
LIST_LENGTH = wp.constant(48)
# Lamps with a smaller share of a point's light are neglected: half a step of eight bits at most.
FAINT_SHARE = wp.constant(0.006)


@wp.struct
class Tile:
    """Bounding sphere of a tile's points, and their common plane if they have one."""

    count: int
    centre_m: wp.vec3
    radius_m: float
    flat: int
    normal: wp.vec3
    height_m: float


@wp.func
def tile_bounds(world: World, lattice: Lattice, column: int, row: int):
    """Bounds of one tile."""
    low = wp.vec3(1.0e9)
    high = wp.vec3(-1.0e9)
    tile = Tile()
    tile.flat = 1
    tile.height_m = -1.0e9
    lowest_m = float(1.0e9)
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
                if is_translucent(world, lattice.surface[i]):
                    # Lamps behind it light it as well: both sides may lie in shadow.
                    tile.flat = 0
                # Height along the first point's normal; nothing below it can shade a flat tile.
                tile.height_m = wp.max(tile.height_m, wp.dot(p, tile.normal))
                lowest_m = wp.min(lowest_m, wp.dot(p, tile.normal))
                tile.count += 1
    # Parallel surfaces at different heights may shade each other.
    if tile.height_m - lowest_m > 1.0e-3:
        tile.flat = 0
    tile.centre_m = (low + high) * 0.5
    # Rays start slightly off the surface.
    tile.radius_m = wp.length(high - low) * 0.5 + 2.0e-3
    return tile


@wp.struct
class Shaft:
    """The union of all segments from a tile to a lamp, in a body's mesh frame.

    Attributes:
        start, way: From the tile's centre to the lamp's.
        inverse: Componentwise reciprocals of ``way``.
        radius, end_radius: Radii of a cone frustum around it at the tile and at the lamp.
        normal, height: Plane below which nothing can shade the tile, if ``flat``.
    """

    start: wp.vec3
    way: wp.vec3
    inverse: wp.vec3
    radius: float
    end_radius: float
    flat: int
    normal: wp.vec3
    height: float


@wp.func
def make_shaft(world: World, b: int, tile: Tile, way: wp.vec3, radius_m: float):
    """The shaft from a tile to a sphere at the end of a way, in the frame of body b."""
    shrink = 1.0 / world.bodies[b].scale
    shaft = Shaft()
    shaft.start = to_mesh_point(world, b, tile.centre_m)
    shaft.way = to_mesh_vector(world, b, way)
    shaft.inverse = reciprocals(shaft.way)
    shaft.radius = tile.radius_m * shrink
    shaft.end_radius = radius_m * shrink
    shaft.flat = tile.flat
    shaft.normal = wp.transpose(world.bodies[b].R_world_mesh) @ tile.normal
    height_m = tile.height_m + 1.0e-4 - wp.dot(world.bodies[b].t_world_mesh, tile.normal)
    # Transform the plane once instead of every box.
    shaft.height = height_m * shrink
    return shaft


@wp.func
def is_below(shaft: Shaft, low: wp.vec3, high: wp.vec3):
    """Whether a box lies below the plane of a flat tile, which it then cannot shade."""
    below = bool(False)
    if shaft.flat != 0:
        # The box's highest point above the tile's plane.
        top = wp.dot(shaft.normal, (low + high) * 0.5)
        below = top + wp.dot(wp.abs(shaft.normal), (high - low) * 0.5) <= shaft.height
    return below


@wp.func
def any_box_touches(shaft: Shaft, world: World, g: int):
    """Whether any of a mesh's boxes may intersect a shaft; conservative.

    The single box of a room, of a body with holes or of a long slanted body touches everything; the
    boxes around groups of its faces do not.
    """
    boxes = world.geometries[g].boxes
    found = bool(False)
    k = next_in_shaft(boxes, shaft.start, shaft.inverse, shaft.radius, shaft.end_radius, -1)
    while k >= 0 and not found:
        found = not is_below(shaft, low_corner(boxes, k), high_corner(boxes, k))
        k = next_in_shaft(boxes, shaft.start, shaft.inverse, shaft.radius, shaft.end_radius, k)
    return found


@wp.func
def may_shade(world: World, b: int, tile: Tile, way: wp.vec3, radius_m: float):
    """Whether a body may block light between a tile and a sphere at the end of a way."""
    g = world.bodies[b].geometry
    shaft = make_shaft(world, b, tile, way, radius_m)
    shades = not is_below(shaft, world.geometries[g].low_m, world.geometries[g].high_m)
    if shades:
        shades = any_box_touches(shaft, world, g)
    return shades


@wp.func
def list_shaft(
    world: World, tile: Tile, way: wp.vec3, radius_m: float, lists: wp.array3d[int], i: int, j: int
):
    """List the bodies that may block light between a tile and a sphere at the end of a way."""
    inverse = reciprocals(way)
    # Boxes in the world, eight at a time, exclude most bodies.
    b = next_in_shaft(world.boxes, tile.centre_m, inverse, tile.radius_m, radius_m, -1)
    while b >= 0 and lists[i, j, 0] >= 0:
        if may_shade(world, b, tile, way, radius_m):
            append_occluder(lists, i, j, b)
        b = next_in_shaft(world.boxes, tile.centre_m, inverse, tile.radius_m, radius_m, b)


@wp.func
def append_occluder(lists: wp.array3d[int], tile: int, j: int, b: int):
    """Append a body to a list, or mark the list as overflowing."""
    n = lists[tile, j, 0]
    if n >= 0 and n < LIST_LENGTH:
        lists[tile, j, 1 + n] = b
        lists[tile, j, 0] = n + 1
    else:
        lists[tile, j, 0] = -1


@wp.func
def is_lamp_relevant(lattice: Lattice, shares: wp.array2d[float], j: int, column: int, row: int):
    """Whether lamp j is more than faint at any point of a tile."""
    found = bool(False)
    for y in range(row * TILE, wp.min((row + 1) * TILE, lattice.height)):
        for x in range(column * TILE, wp.min((column + 1) * TILE, lattice.width)):
            i = y * lattice.width + x
            if lattice.body[i] >= 0 and shares[j, i] > FAINT_SHARE:
                found = True
    return found


@wp.kernel
def list_occluders(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    ambient_radius_m: float,
    shares: wp.array2d[float],
    lists: wp.array3d[int],
):
    """Bodies that may shade each tile from each lamp; the last list is for ambient occlusion.

    A list begins with its length, which is -1 on overflow.

    Args:
        ambient_radius_m: Radius of ambient occlusion.
        shares: Share of each lamp in the light of each point [lamp, point]; lamps that are faint
            throughout a tile get an empty list.
    """
    i = wp.tid()
    column = i % tile_columns
    row = i / tile_columns
    tile = tile_bounds(world, lattice, column, row)
    lamps = world.lamps.shape[0]
    for j in range(lamps + 1):
        lists[i, j, 0] = 0
    if tile.count == 0:
        return
    near = tile
    # A shaft of length zero: a sphere that contains every ambient ray of the tile.
    near.radius_m = tile.radius_m + ambient_radius_m
    for j in range(lamps):
        if is_lamp_relevant(lattice, shares, j, column, row):
            lamp = world.lamps[j]
            way = lamp.position_m - tile.centre_m
            radius_m = lamp.radius
            if lamp.kind == SUN:
                way = lamp.direction * -SUN_DISTANCE_M
                radius_m = lamp.radius * SUN_DISTANCE_M
            list_shaft(world, tile, way, radius_m, lists, i, j)
    list_shaft(world, near, wp.vec3(0.0), near.radius_m, lists, i, lamps)
