"""Ray queries through the two-level hierarchy: bodies above, each mesh's triangles below.

Offsets of ray origins avoid self-intersection. A point on a surface is known to half a unit in the
last place of its largest coordinate, a relative error of 6e-8 in single precision, and the distance
of a hit no better. Rays therefore start off the surface: by a constant, for points near the world's
origin, and by a share of the coordinates. Too large an offset loses contact shadows and thin panes.
Source: Waechter and Binder, "A fast and robust method for avoiding self-intersection", Ray Tracing
Gems, 2019, here in its plain form.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import alpha_test, bvh_traverse, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Smallest offset of light rays: a fiftieth of a millimetre, below the rounding of meshes.
OFFSET_M = wp.constant(2.0e-5)
# Sixteen times the relative error: the accumulated error of a transform and a cross product.
OFFSET_SHARE = wp.constant(1.0e-6)
# Offsets along a ray are larger: at oblique incidence only a part of them leaves the surface.
PASSED_M = wp.constant(3.0e-5)
PASSED_SHARE = wp.constant(2.0e-6)
# Half a millimetre per metre from the eye: less than half a pixel, and from a few metres on more
# than the height at which markings and covers float over a road, beneath whose rims a camera looks.
OFFSET_PER_DISTANCE = wp.constant(5.0e-4)
# Laser ranges are measured over hundreds of metres in the scanner's frame; surfaces within two
# millimetres behind a pane or in front of a mirror merge with it.
LASER_OFFSET_M = wp.constant(2.0e-3)
# Obstacles closer than this shelter nothing: grass, kerbs, floating markings.
SHELTER_OFFSET_M = wp.constant(0.02)


@wp.func
def offset_origin(p: wp.vec3, n: wp.vec3):
    """Origin of a ray off a surface, on the side of the normal."""
    size = wp.abs(p[0]) + wp.abs(p[1]) + wp.abs(p[2])
    return p + n * (OFFSET_M + OFFSET_SHARE * size)


@wp.func
def passed_origin(p: wp.vec3, d: wp.vec3, eye_m: wp.vec3):
    """Origin of a ray that continues behind a surface."""
    return p + d * (PASSED_M + PASSED_SHARE * (wp.length(p - eye_m) + wp.length(p)))


FARTHEST = wp.constant(1.0e6)
# Only obstacles lower than this above a surface shelter it from rain and snow.
SHELTER_M = wp.constant(2.5)
# No body.
NOBODY = wp.constant(-1)
# Shadow rays pass both holes and clear faces.
LIGHT = wp.constant(records.HOLES | records.CLEAR)


@wp.struct
class RayHit:
    """Intersection of a ray with a surface.

    Attributes:
        at: (body, face); (-1, -1) for a miss.
        t: Parameter along the ray; for a miss, how far it was traced.
        weight: Barycentric weights of the face's second and third corner.
    """

    at: wp.vec2i
    t: float
    weight: wp.vec2


@wp.func
def closest_hit(world: records.World, o: wp.vec3, d: wp.vec3, reach: float, through: int):
    """The first surface that a ray does not pass.

    Args:
        reach: Largest parameter along the ray.
        through: Surfaces that the ray may pass: HOLES, CLEAR or both.
    """
    found = bvh_traverse.first_in_scene(
        world.tree, world.bodies, world.geometries, o, d, reach, through
    )
    met = RayHit()
    met.at = wp.vec2i(int(found[4]), int(found[3]))
    met.t = float(found[0])
    met.weight = wp.vec2(float(found[2]), 1.0 - float(found[1]) - float(found[2]))
    # Bodies with cut-outs are few: the main traversal skips them, and they are tested after it, up
    # to its hit.
    if (world.cutout_flags & through) != 0:
        met = closest_cutout_hit(world, o, d, through, met)
    return met


@wp.func(**alpha_test.OUT_OF_LINE)
def closest_cutout_hit(world: records.World, o: wp.vec3, d: wp.vec3, through: int, before: RayHit):
    """The nearer of a hit and the first opaque point of bodies with cut-outs."""
    met = before
    candidates = wp.bvh_query_ray(world.cutout_hierarchy, o, d)
    k = int(0)
    while wp.bvh_query_next(candidates, k, met.t):
        b = world.cutouts[k]
        if (world.bodies[b].cutouts & through) != 0:
            origin = records.to_mesh_point(world, b, o)
            direction = records.to_mesh_vector(world, b, d)
            strike = alpha_test.first_opaque_hit(world, b, origin, direction, met.t, through)
            if strike.face >= 0:
                met.t = strike.t
                met.at = wp.vec2i(b, strike.face)
                met.weight = wp.vec2(strike.v, 1.0 - strike.u - strike.v)
    return met


@wp.kernel
def trace_pixels(view: records.View, world: records.World, t_min: float, hits: wp.array[wp.vec2i]):
    """Nearest (body, face) through every pixel centre."""
    i = wp.tid()
    d = records.pixel_ray(view, i)
    hit = wp.vec2i(-1, -1)
    if records.is_in_view(view, i):
        hit = closest_hit(world, view.eye_m + d * t_min, d, FARTHEST, records.HOLES).at
    hits[i] = hit


@wp.kernel
def trace_samples(
    view: records.View,
    world: records.World,
    pixels: wp.array[int],
    offsets: wp.array[wp.vec2],
    t_min: float,
    hits: wp.array2d[wp.vec2i],
):
    """Nearest (body, face) at sample positions within listed pixels, [0, 1)."""
    row, s = wp.tid()
    i = pixels[row]
    hit = wp.vec2i(-1, -1)
    if records.is_in_view(view, i):
        x_px = float(i % view.width) + offsets[s][0]
        y_px = float(i / view.width) + offsets[s][1]
        d = view.R_world_camera @ records.pixel_direction(view, x_px, y_px)
        hit = closest_hit(world, view.eye_m + d * t_min, d, FARTHEST, records.HOLES).at
    hits[row, s] = hit


@wp.struct
class Path:
    """A straight segment in the world, at parameters from 0 to 1."""

    origin: wp.vec3
    way: wp.vec3
    inverse: wp.vec3


@wp.func
def path_along(origin: wp.vec3, way: wp.vec3):
    """A path with the reciprocals that box tests need."""
    path = Path()
    path.origin = origin
    path.way = way
    path.inverse = records.reciprocals(way)
    return path


@wp.func
def enters_box(world: records.World, b: int, path: Path):
    """Whether a path may enter a body's box; a cheap test before any query of its mesh."""
    low = world.bodies[b].low_m - path.origin
    enters, leaves = records.slab_interval(low, world.bodies[b].high_m - path.origin, path.inverse)
    # The slab test: the path is inside all three pairs of planes at once.
    return records.max_of_two(enters, 0.0) <= records.min_of_two(leaves, 1.0)


@wp.func
def is_cut_by(world: records.World, b: int, path: Path, through: int):
    """Whether a body intersects a path that passes ``through``: HOLES, CLEAR or both."""
    hit = enters_box(world, b, path)
    if hit:
        o = records.to_mesh_point(world, b, path.origin)
        d = records.to_mesh_vector(world, b, path.way)
        hit = alpha_test.is_mesh_intersected(world, b, o, d, 1.0, through)
    return hit


@wp.func
def is_blocked_by(world: records.World, b: int, path: Path):
    """Whether a body blocks light along a path."""
    return is_cut_by(world, b, path, LIGHT)


@wp.func
def is_occluded(world: records.World, path: Path):
    """Whether anything blocks light along a path."""
    return is_intersected(world, path, LIGHT)


@wp.func
def is_intersected(world: records.World, path: Path, through: int):
    """Whether anything intersects a path that passes ``through``."""
    return blocker_of(world, path, through) != NOBODY


@wp.func
def blocker_of(world: records.World, path: Path, through: int):
    """A body that intersects a path that passes ``through``; NOBODY if there is none."""
    b = bvh_traverse.any_in_scene(
        world.tree,
        world.bodies,
        world.geometries,
        path.origin,
        path.way,
        1.0,
        through,
    )
    if b == NOBODY and (world.cutout_flags & through) != 0:
        b = blocker_with_cutouts(world, path, through)
    return b


@wp.func(**alpha_test.OUT_OF_LINE)
def blocker_with_cutouts(world: records.World, path: Path, through: int):
    """As ``blocker_of``, among bodies with cut-outs."""
    blocker = int(NOBODY)
    passed = through & records.MOVES
    candidates = wp.bvh_query_ray(world.cutout_hierarchy, path.origin, path.way)
    k = int(0)
    while wp.bvh_query_next(candidates, k, 1.0):
        b = world.cutouts[k]
        flags = world.bodies[b].cutouts
        if (flags & through) != 0 and (flags & passed) == 0:
            if is_cut_by(world, b, path, through):
                blocker = b
                break
    return blocker


@wp.func
def listed_blocker(
    world: records.World,
    lists: wp.array3d[int],
    tile: int,
    j: int,
    skip: int,
    likely: int,
    path: Path,
):
    """A body but ``skip`` that blocks the path from a point of a tile to lamp j, or NOBODY.

    Args:
        likely: The body to test first, such as one that has blocked a neighbouring path; or NOBODY.
    """
    blocker = int(NOBODY)
    count = lists[tile, j, 0]
    k = int(-1)
    while k < wp.max(count, 0) and blocker == NOBODY:
        b = int(likely)
        if k >= 0:
            b = lists[tile, j, 1 + k]
        again = k >= 0 and b == likely
        if b >= 0 and b != skip and not again:
            if is_blocked_by(world, b, path):
                blocker = b
        k += 1
    if blocker == NOBODY and count < 0:
        # The list was too long to keep: query the whole scene.
        blocker = blocker_of(world, path, LIGHT)
    return blocker


@wp.func
def free_path(world: records.World, path: Path):
    """Length of the unobstructed part of a path, from 0 to 1."""
    return closest_hit(world, path.origin, path.way, 1.0, LIGHT).t


@wp.func
def free_path_of_listed(
    world: records.World, lists: wp.array3d[int], tile: int, skip: int, path: Path
):
    """Unobstructed part of a path from a point of a tile, ignoring the body ``skip``."""
    # The last list belongs to ambient occlusion.
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
def free_path_before(world: records.World, b: int, path: Path, free: float):
    """Unobstructed part of a path in front of one body, at most ``free``."""
    if enters_box(world, b, path):
        o = records.to_mesh_point(world, b, path.origin)
        d = records.to_mesh_vector(world, b, path.way)
        strike = alpha_test.closest_solid_hit(world, b, o, d, free, LIGHT)
        if strike.face >= 0:
            free = strike.t
    return free


@wp.func
def precipitation_exposure(world: records.World, body: int, origin: wp.vec3):
    """Exposure of a point on a body to precipitation: 1 or 0, by one upward ray.

    Moving bodies shelter moving surfaces, such as seats below a roof, but never the ground: it was
    in the rain before they came.
    """
    # The ray is tilted by a smooth function of position: edges of shelter become irregular, without
    # a random number.
    x = origin[0] * 5.0
    y = origin[1] * 5.0
    east = 0.15 * wp.sin(1.7 * x + 2.3 * wp.sin(1.3 * y))
    north = 0.15 * wp.sin(1.9 * y + 2.1 * wp.sin(1.1 * x))
    through = records.HOLES
    if (world.bodies[body].cutouts & records.MOVES) == 0:
        through = records.HOLES | records.MOVES
    free = float(1.0)
    if is_intersected(world, path_along(origin, wp.vec3(east, north, 1.0) * SHELTER_M), through):
        free = 0.0
    return free
