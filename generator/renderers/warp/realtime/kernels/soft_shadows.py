"""Soft shadows and ambient occlusion on the lattice, with as few rays as possible.

1. Tiles list the bodies that may shade them
   (gen_data.renderers.warp.realtime.kernels.shadow_culling): most list none and need no
   ray.
2. Points trace one ray per lamp, every other point only where its neighbours differ. The sixteen
   points of a 4 x 4 block aim at sixteen parts of the lamp (interleaved sampling, Keller and
   Heidrich, 2001).
3. Where a whole neighbourhood agrees, its value is final. In penumbrae, points trace further rays,
   and sixteen neighbours on one surface are averaged, rows first: together they sample all parts of
   the lamp from every position, and no pattern remains.
"""

import warp as wp

from gen_data.renderers.warp.native_code import LANES, native
from gen_data.renderers.warp.realtime.kernels.shadow_culling import FAINT_SHARE, TILE
from gen_data.renderers.warp.scene.kernels import ambient_light, analytic_lights, ray_queries
from gen_data.renderers.warp.scene.kernels.lattice import (
    Departure,
    Lattice,
    departure_to,
    sheet_side,
)
from gen_data.renderers.warp.scene.kernels.material_eval import is_translucent
from gen_data.renderers.warp.scene.kernels.records import LightRecord, View, World, fast_normalize

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Edge of the aligned blocks of lattice points. Kernels on blocks have up to a thread per point: the
# last number of a thread and ``run`` tell its points. On the CPU one thread takes a whole block.
BLOCK = wp.constant(4)
# Points in a row that smoothing takes or skips together, on all devices.
GROUP = wp.constant(LANES)
# Marks points without a value: off all surfaces, or where a lamp contributes nothing.
UNSEEN = wp.constant(-1.0)
# Shadows of lamps with a smaller share of a point's light are too faint for further rays.
SMOOTHED_SHARE = wp.constant(0.08)
# Neighbours within three pixels' width of a point's tangent plane are on its surface.
SAME_SURFACE_PX = wp.constant(3.0)
# Surfaces of fewer points across are strips.
STRIP_POINTS = wp.constant(3)
# Leaves of one body hide the sky from one another up to this distance, the less the farther they
# are, since they scatter light themselves [m]. With it, crowns are as bright as path-traced ones.
CROWN_M = wp.constant(18.0)
# Where leaves of one body hide the sky, they send scattered light instead, as much as this share of
# the sky. More of it makes a crown before the sun a quarter brighter than path-traced ones.
CROWN_GLOW = wp.constant(0.17)


@wp.func
def bayer(x: int, y: int):
    """Rank 0..15 within a 4 x 4 block such that near neighbours differ much (Bayer 1973)."""
    q = x ^ y
    return (q & 1) * 8 + (y & 1) * 4 + ((q >> 1) & 1) * 2 + ((y >> 1) & 1)


@wp.func
def make_frame(z: wp.vec3):
    """Two unit vectors that complete a right-handed frame with z.

    Source: Duff et al., "Building an orthonormal basis, revisited", JCGT 2017.
    """
    # The sign keeps the denominator between 1 and 2: no direction is singular.
    sign = wp.where(z[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z[2])
    b = z[0] * z[1] * a
    x = wp.vec3(1.0 + sign * z[0] * z[0] * a, sign * b, -sign * z[0])
    y = wp.vec3(b, sign + z[1] * z[1] * a, -z[1])
    return x, y


@wp.func
def lamp_vector(lamp: LightRecord, p_world: wp.vec3):
    """Displacement from a point to the centre of a lamp."""
    way = lamp.position_m - p_world
    if lamp.kind == analytic_lights.SUN:
        way = lamp.direction * -analytic_lights.SUN_DISTANCE_M
    return way


@wp.func
def path_to_lamp(lamp: LightRecord, origin: wp.vec3, n: wp.vec3, part: wp.vec2):
    """Displacement from a point to a part of a lamp; mirrored if below the horizon.

    Args:
        n: Normal of the horizon.
        part: Point of the unit disk, which parametrises the lamp's outline.
    """
    to_lamp = lamp_vector(lamp, origin)
    off = wp.vec3(0.0)
    if lamp.kind == analytic_lights.RECTANGLE:
        q = square_of_disc(part)
        off = lamp.along * q[0] + lamp.across * q[1]
    elif lamp.kind == analytic_lights.DISK:
        off = lamp.along * part[0] + lamp.across * part[1]
    else:
        radius = lamp.radius
        if lamp.kind == analytic_lights.SUN:
            radius = lamp.radius * analytic_lights.SUN_DISTANCE_M
        x, y = make_frame(fast_normalize(to_lamp))
        off = (x * part[0] + y * part[1]) * radius
    # Parts below the horizon contribute nothing: the ray samples the opposite part instead.
    if wp.dot(to_lamp + off, n) < 0.0:
        off = -off
    return to_lamp + off


@wp.func
def square_of_disc(part: wp.vec2):
    """Area-preserving map from the unit disk to the square [-1, 1] x [-1, 1].

    Source: the inverse of Shirley and Chiu, "A low distortion map between disk and square", Journal
    of Graphics Tools 2, 1997.
    """
    radius = wp.length(part)
    long = radius
    if wp.abs(part[0]) >= wp.abs(part[1]):
        short = wp.atan2(part[1], wp.abs(part[0])) * (4.0 / wp.pi) * radius
        return wp.vec2(wp.where(part[0] < 0.0, -long, long), short)
    short = wp.atan2(part[0], wp.abs(part[1])) * (4.0 / wp.pi) * radius
    return wp.vec2(short, wp.where(part[1] < 0.0, -long, long))


@wp.func
def block_tile(row: int, column: int, tile_columns: int):
    """The tile that contains a block."""
    return BLOCK * row / TILE * tile_columns + BLOCK * column / TILE


@wp.func
def block_point(lattice: Lattice, row: int, column: int, k: int):
    """Lattice point k of a block, row by row; -1 off the lattice."""
    x = BLOCK * column + k % BLOCK
    y = BLOCK * row + k / BLOCK
    return wp.where(x < lattice.width and y < lattice.height, y * lattice.width + x, -1)


@wp.func
def agreed_value(lattice: Lattice, values: wp.array2d[float], j: int, x: int, y: int):
    """Common value of a point's four neighbours; UNSEEN if they differ.

    All four must exist and share its material.
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


@wp.func
def lamp_weight(lamp: LightRecord, origin: wp.vec3, n: wp.vec3, side: wp.vec3):
    """Unshadowed illuminance by a lamp, for its share of the light [lx]; UNSEEN behind surfaces.

    Args:
        side: Direction away from a translucent surface, lamps behind which count like those before
            it; 0 for opaque surfaces.
    """
    beam = analytic_lights.beam_from(lamp, origin)
    cosine = wp.dot(beam.direction, n)
    if wp.dot(side, side) > 0.0:
        cosine = wp.abs(cosine)
    brightest = wp.max(beam.normal_lux)
    lux = float(UNSEEN)
    if cosine > -beam.spread and brightest > 0.0:
        # Grazing highlights remain bright: the cosine has a floor.
        lux = brightest * wp.max(cosine, 0.2)
    return lux


@wp.kernel
def weigh_lamps(world: World, lattice: Lattice, shares: wp.array2d[float], matters: wp.array[int]):
    """Share of each lamp in each point's unshadowed light [lamp, point]; UNSEEN behind surfaces.

    Lamps behind a translucent surface count like those before it.

    Args:
        matters: Set to 1 for lamps that are more than faint anywhere.
    """
    i = wp.tid()
    if lattice.body[i] < 0:
        return
    n = lattice.normal[i]
    side = sheet_side(world, lattice, i)
    p = lattice.p_m[i]
    total = wp.max(wp.max(ambient_light.ambient_irradiance(world, p, n)) * wp.pi, 1.0e-9)
    indoors = ambient_light.is_indoors(world, p)
    for j in range(world.lamps.shape[0]):
        shares[j, i] = lamp_weight(world.lamps[j], lattice.origin_m[i], n, side)
        # A sun that is nearly always behind walls hides no lamp.
        if not indoors or world.lamps[j].kind != analytic_lights.SUN:
            total += wp.max(shares[j, i], 0.0)
    for j in range(world.lamps.shape[0]):
        if shares[j, i] > 0.0:
            shares[j, i] = shares[j, i] / total
            if shares[j, i] > FAINT_SHARE:
                matters[j] = 1


@wp.func
def mean_of_neighbours(lattice: Lattice, values: wp.array2d[float], j: int, x: int, y: int):
    """Mean of the known values of a point's four neighbours on its material; else UNSEEN."""
    i = y * lattice.width + x
    total = float(0.0)
    found = float(0.0)
    if x > 0 and y > 0 and x < lattice.width - 1 and y < lattice.height - 1:
        for k in range(4):
            q = i + wp.where(k < 2, 1, lattice.width) * wp.where((k & 1) == 0, 1, -1)
            if lattice.surface[q] == lattice.surface[i] and values[j, q] != UNSEEN:
                total += values[j, q]
                found += 1.0
    return wp.where(found > 0.0, total / wp.max(found, 1.0), UNSEEN)


@wp.kernel
def probe_lamps(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array3d[int],
    disc: wp.array[wp.vec2],
    shares: wp.array2d[float],
    run: int,
    parity: int,
    lit: wp.array2d[float],
):
    """One shadow ray per point and lamp: 1, 0, or UNSEEN for lamps without effect.

    Args:
        disc: Forty-eight points of the unit disk; each lattice point uses one of three in a row.
        shares: As computed by weigh_lamps.
        run: Points per thread.
        parity: 0 probes the black squares of a checkerboard, 1 then the white ones, which trace a
            ray only where their black neighbours differ.
    """
    row, column, j, part = wp.tid()
    tile = block_tile(row, column, tile_columns)
    shaded = lists[tile, j, 0] != 0
    # Where nothing can shade, the first pass writes both colours.
    if not shaded and parity == 1:
        return
    likely = int(ray_queries.NOBODY)
    k = int(part * run)
    while k < (part + 1) * run:
        i = block_point(lattice, row, column, k)
        if i >= 0 and (not shaded or ((k ^ (k / BLOCK)) & 1) == parity):
            value = float(UNSEEN)
            if lattice.body[i] >= 0 and shares[j, i] > FAINT_SHARE:
                value = 1.0
                if shaded:
                    x = i % lattice.width
                    y = i / lattice.width
                    value = float(UNSEEN)
                    if parity == 1:
                        value = agreed_value(lattice, lit, j, x, y)
                        if value == UNSEEN and shares[j, i] < SMOOTHED_SHARE:
                            # Faint lamps: an interpolated shadow is as good as a traced one.
                            value = mean_of_neighbours(lattice, lit, j, x, y)
                    if value == UNSEEN:
                        start = departure_to(
                            world, lattice, i, lamp_vector(world.lamps[j], lattice.p_m[i])
                        )
                        at = disc[3 * bayer(k % BLOCK, k / BLOCK) + 1]
                        way = path_to_lamp(world.lamps[j], start.origin_m, start.normal, at)
                        path = ray_queries.path_along(start.origin_m, way)
                        blocker = ray_queries.listed_blocker(
                            world, lists, tile, j, start.skip, likely, path
                        )
                        value = wp.where(blocker == ray_queries.NOBODY, 1.0, 0.0)
                        # The next path is close by.
                        likely = wp.where(blocker == ray_queries.NOBODY, likely, blocker)
            lit[j, i] = value
        k += 1


@wp.kernel
def classify_blocks(lattice: Lattice, values: wp.array2d[float], classes: wp.array3d[int]):
    """Values in each block, as bits: 1 zeros, 2 ones, 4 others."""
    row, column, j = wp.tid()
    found = int(0)
    for y in range(BLOCK * row, wp.min(BLOCK * row + BLOCK, lattice.height)):
        k = int(y * lattice.width + BLOCK * column)
        end = y * lattice.width + wp.min(BLOCK * column + BLOCK, lattice.width)
        # A while loop: Warp's range loops cost more than this body.
        while k < end:
            value = values[j, k]
            if value == 0.0:
                found = found | 1
            elif value == 1.0:
                found = found | 2
            elif value != UNSEEN:
                found = found | 4
            k += 1
    classes[row, column, j] = found


@wp.func
def classes_near(classes: wp.array3d[int], first_x: int, last_x: int, y: int, j: int):
    """Union of the classes of the blocks of points in a row, and of the blocks around them."""
    found = int(0)
    row = wp.max(y / BLOCK - 1, 0)
    while row <= wp.min(y / BLOCK + 1, classes.shape[0] - 1):
        column = wp.max(first_x / BLOCK - 1, 0)
        while column <= wp.min(last_x / BLOCK + 1, classes.shape[1] - 1):
            found = found | classes[row, column, j]
            column += 1
        row += 1
    return found


@wp.func
def classes_near_group(classes: wp.array3d[int], x: int, y: int, j: int):
    """The same for all points of the group that a point belongs to.

    Skipped sums are missing in the windows around, so all devices must skip the same.
    """
    first = x / GROUP * GROUP
    return classes_near(classes, first, first + GROUP - 1, y, j)


@wp.func
def window_bits(lattice: Lattice, values: wp.array2d[float], j: int, i: int):
    """Values of the points of the same material in the window around a point, as bits."""
    x = i % lattice.width
    y = i / lattice.width
    own = lattice.surface[i]
    found = int(0)
    for v in range(wp.max(y - 2, 0), wp.min(y + 3, lattice.height)):
        k = int(v * lattice.width + wp.max(x - 2, 0))
        end = v * lattice.width + wp.min(x + 3, lattice.width)
        while k < end:
            if lattice.surface[k] == own:
                value = values[j, k]
                found = found | wp.where(value == 1.0, 2, wp.where(value == 0.0, 1, 0))
            k += 1
    return found


@wp.kernel
def refine_lamps(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array3d[int],
    disc: wp.array[wp.vec2],
    shares: wp.array2d[float],
    run: int,
    classes: wp.array3d[int],
    probed: wp.array2d[float],
    lit: wp.array2d[float],
):
    """Trace two more rays where a lamp is visible from part of the neighbourhood only.

    Args:
        disc, shares, run: As for probe_lamps.
    """
    row, column, j, part = wp.tid()
    tile = block_tile(row, column, tile_columns)
    x = BLOCK * column
    mixed = (classes_near(classes, x, x, BLOCK * row, j) & 3) == 3
    likely = int(ray_queries.NOBODY)
    k = int(part * run)
    while k < (part + 1) * run:
        i = block_point(lattice, row, column, k)
        if i >= 0:
            value = probed[j, i]
            if mixed and value != UNSEEN and shares[j, i] > SMOOTHED_SHARE:
                if window_bits(lattice, probed, j, i) == 3:
                    seen = value
                    start = departure_to(
                        world, lattice, i, lamp_vector(world.lamps[j], lattice.p_m[i])
                    )
                    rank = bayer(k % BLOCK, k / BLOCK)
                    for more in range(2):
                        # The two points of the triple that probe_lamps has left out.
                        at = disc[3 * rank + 2 * more]
                        way = path_to_lamp(world.lamps[j], start.origin_m, start.normal, at)
                        path = ray_queries.path_along(start.origin_m, way)
                        blocker = ray_queries.listed_blocker(
                            world, lists, tile, j, start.skip, likely, path
                        )
                        if blocker == ray_queries.NOBODY:
                            seen += 1.0
                        else:
                            likely = blocker
                    value = seen / 3.0
            lit[j, i] = value
        k += 1


@wp.func
def surface_tolerance(view: View, p: wp.vec3):
    """Allowed distance of neighbours from a point's tangent plane [m]."""
    return SAME_SURFACE_PX * view.pixel_rad * wp.length(p - view.eye_m)


@wp.func
def is_uniform(classes: int):
    """Whether all values are zeros, or all are ones."""
    return classes == 1 or classes == 2  # noqa: PLR1714


@wp.func_native(native("realtime/kernels/sum_row.h", UNSEEN=UNSEEN))
def sum_row(
    lattice: Lattice,
    eye_m: wp.vec3,
    tolerance: float,
    values: wp.array2d[wp.float32],
    x: int,
    y: int,
    j: int,
    sums: wp.array3d[wp.float32],
):
    """Sum and number of the values next to points on their own surface, for neighbours in a row.

    Args:
        tolerance: Allowed distance from a point's tangent plane as a share of its eye distance.
        x, y: The first of eight points; of one on CUDA.
        sums: [light, sum or number, point].
    """
    ...


@wp.func_native(native("realtime/kernels/smooth_column.h", UNSEEN=UNSEEN))
def smooth_column(
    lattice: Lattice,
    eye_m: wp.vec3,
    tolerance: float,
    enough: float,
    values: wp.array2d[wp.float32],
    x: int,
    y: int,
    j: int,
    sums: wp.array3d[wp.float32],
    smoothed: wp.array2d[wp.float32],
):
    """Mean of row sums above and below points on their own surface; arguments as for sum_row.

    Args:
        enough: Number of points below which the window is higher.
    """
    ...


@wp.kernel
def sum_rows(
    view: View,
    lattice: Lattice,
    lanes: int,
    classes: wp.array3d[int],
    values: wp.array2d[float],
    sums: wp.array3d[float],
):
    """Sum and number of the values next to each point on its own surface.

    Skipped where all values around agree, which need no sums.

    Args:
        lanes: Points per thread: 8 on the CPU, 1 on CUDA.
    """
    y, group, j = wp.tid()
    x = group * lanes
    if is_uniform(classes_near_group(classes, x, y, j)):
        for k in range(wp.min(lanes, lattice.width - x)):
            sums[j, 0, y * lattice.width + x + k] = 0.0
            sums[j, 1, y * lattice.width + x + k] = 0.0
    else:
        sum_row(lattice, view.eye_m, SAME_SURFACE_PX * view.pixel_rad, values, x, y, j, sums)


@wp.kernel
def smooth_lattice(
    view: View,
    lattice: Lattice,
    lanes: int,
    classes: wp.array3d[int],
    values: wp.array2d[float],
    enough: float,
    sums: wp.array3d[float],
    smoothed: wp.array2d[float],
):
    """Average differing values over neighbours on one surface; ``enough`` as of smooth_column."""
    y, group, j = wp.tid()
    x = group * lanes
    if is_uniform(classes_near_group(classes, x, y, j)):
        # With only zeros or only ones around, the mean is the value itself.
        for k in range(wp.min(lanes, lattice.width - x)):
            i = y * lattice.width + x + k
            smoothed[j, i] = values[j, i]
    else:
        tolerance = SAME_SURFACE_PX * view.pixel_rad
        smooth_column(lattice, view.eye_m, tolerance, enough, values, x, y, j, sums, smoothed)


@wp.func
def run_length(lattice: Lattice, i: int, at: int, size: int, step: int):
    """Number of points, up to five, around a point in its row or column that continue its surface.

    Args:
        at, size: The point's place in its row or column, and the length of that.
        step: Index distance of neighbours.
    """
    found = int(0)
    for way in range(-2, 3):
        if at + way >= 0 and at + way < size:
            q = i + way * step
            if lattice.surface[q] == lattice.surface[i]:
                if wp.dot(lattice.normal[q], lattice.normal[i]) > 0.9:
                    found += 1
    return found


@wp.func
def strip_width(lattice: Lattice, i: int):
    """Width of a point's surface in points, along its row or its column; at most 5."""
    x = i % lattice.width
    y = i / lattice.width
    along = run_length(lattice, i, x, lattice.width, 1)
    return wp.min(along, run_length(lattice, i, y, lattice.height, lattice.width))


@wp.func
def open_path(
    world: World,
    lattice: Lattice,
    lists: wp.array3d[int],
    tile: int,
    i: int,
    h: wp.vec3,
    other_side: bool,
    radius_m: float,
):
    """1 if a short ray from a point is free, less the nearer the obstacle.

    Args:
        h: Its direction about the normal as +Z.
        other_side: Whether the ray leaves a translucent surface on its other side.
    """
    n = lattice.normal[i]
    x, y = make_frame(n)
    way = x * h[0] + y * h[1] + n * h[2]
    start = Departure()
    start.origin_m = lattice.origin_m[i]
    start.skip = lattice.skip[i]
    within = float(1.0)
    if is_translucent(world, lattice.surface[i]):
        way = way * wp.where(other_side, -1.0, 1.0)
        start = departure_to(world, lattice, i, way)
        start.skip = lattice.body[i]
        within = ray_queries.free_path_before(
            world, lattice.body[i], ray_queries.path_along(start.origin_m, way * CROWN_M), 1.0
        )
    path = ray_queries.path_along(start.origin_m, way * radius_m)
    t = ray_queries.free_path_of_listed(world, lists, tile, start.skip, path)
    # Full occlusion on contact, fading with zero slope at the radius: no visible boundary.
    return wp.min(t * (2.0 - t), wp.max(within, CROWN_GLOW))


@wp.kernel
def probe_ambient(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array3d[int],
    hemisphere: wp.array[wp.vec3],
    radius_m: float,
    run: int,
    open_sky: wp.array2d[float],
):
    """Ambient occlusion by one short ray per point, by all rays on strips.

    A strip holds a part of the pattern of rays only: from point to point it would be dark or
    bright. On a translucent surface, half of the points look to the other side, and the body itself
    hides the sky up to CROWN_M: leaves see little of it from inside of a crown.

    Args:
        hemisphere: Sixteen directions about +Z, distributed by the cosine.
        run: As for probe_lamps.
    """
    row, column, _, part = wp.tid()
    tile = block_tile(row, column, tile_columns)
    shaded = lists[tile, world.lamps.shape[0], 0] != 0
    k = int(part * run)
    while k < (part + 1) * run:
        i = block_point(lattice, row, column, k)
        if i >= 0:
            value = float(UNSEEN)
            if lattice.body[i] >= 0:
                value = 1.0
                if shaded:
                    first = bayer(k % BLOCK, k / BLOCK)
                    rays = int(1)
                    if not is_translucent(world, lattice.surface[i]):
                        if strip_width(lattice, i) < STRIP_POINTS:
                            rays = 16
                    total = float(0.0)
                    cast = float(0.0)
                    for m in range(rays):
                        # Where the first four, a quarter of the pattern apart, are free, so is the
                        # rest.
                        if m < 4 or total < cast:
                            rank = (first + 4 * m + m / 4) % 16
                            total += open_path(
                                world, lattice, lists, tile, i, hemisphere[rank], (rank & 2) == 0,
                                radius_m,
                            )  # fmt: skip
                            cast += 1.0
                    value = total / cast
            open_sky[0, i] = value
        k += 1


@wp.kernel
def restore_strips(
    world: World, lattice: Lattice, probed: wp.array2d[float], smoothed: wp.array2d[float]
):
    """Undo the smoothing of values of ``probe_ambient`` where they are means of all rays already.

    Strips a point wide have points in some columns only, each at another height. They get the mean
    of their body's points around them that lie on no such strip, as pixels between points do.
    Leaves keep their values: they are expected to differ.
    """
    i = wp.tid()
    if probed[0, i] == UNSEEN or is_translucent(world, lattice.surface[i]):
        return
    width = strip_width(lattice, i)
    if width < STRIP_POINTS:
        value = probed[0, i]
        if width == 1:
            x = i % lattice.width
            y = i / lattice.width
            total = float(0.0)
            found = float(0.0)
            for v in range(wp.max(y - 1, 0), wp.min(y + 2, lattice.height)):
                for u in range(wp.max(x - 1, 0), wp.min(x + 2, lattice.width)):
                    q = v * lattice.width + u
                    if lattice.body[q] == lattice.body[i]:
                        beside = strip_width(lattice, q)
                        if beside > 1:
                            # This kernel changes the other array on strips.
                            wide = beside >= STRIP_POINTS
                            total += wp.where(wide, smoothed[0, q], probed[0, q])
                            found += 1.0
            if found > 0.0:
                value = total / found
        smoothed[0, i] = value


@wp.kernel
def count_free_paths(
    world: World, points: wp.array[wp.vec3], ways: wp.array[wp.vec3], free: wp.array[int]
):
    """Count the unobstructed paths over all points and directions."""
    i = wp.tid()
    for k in range(ways.shape[0]):
        if not ray_queries.is_occluded(world, ray_queries.path_along(points[i], ways[k])):
            wp.atomic_add(free, 0, 1)
