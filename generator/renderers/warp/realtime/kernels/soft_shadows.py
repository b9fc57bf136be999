"""Soft shadows and ambient occlusion on the lattice, with as few rays as possible.

1. Tiles list the bodies that may shade them
   (gen_data.generator.renderers.warp.realtime.kernels.shadow_culling): most list none and need no
   ray.
2. Points trace one ray per lamp, every other point only where its neighbours differ. The sixteen
   points of a 4 x 4 block aim at sixteen parts of the lamp (interleaved sampling, Keller and
   Heidrich, 2001).
3. Where a whole neighbourhood agrees, its value is final. In penumbrae, points trace further rays,
   and sixteen neighbours on one surface are averaged, rows first: together they sample all parts of
   the lamp from every position, so that no pattern remains.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.realtime.kernels.lattice import (
    Departure,
    Lattice,
    departure_to,
    points_agree,
)
from gen_data.generator.renderers.warp.realtime.kernels.shadow_culling import FAINT_SHARE, TILE
from gen_data.generator.renderers.warp.scene.kernels.analytic_lights import (
    DISK,
    RECTANGLE,
    SUN,
    SUN_DISTANCE_M,
    beam_from,
)
from gen_data.generator.renderers.warp.scene.kernels.environment_lighting import sky_irradiance
from gen_data.generator.renderers.warp.scene.kernels.material_eval import is_translucent
from gen_data.generator.renderers.warp.scene.kernels.ray_queries import (
    free_path_before,
    free_path_of_listed,
    is_occluded,
    is_occluded_by_listed,
    path_along,
)
from gen_data.generator.renderers.warp.scene.kernels.records import (
    LightRecord,
    View,
    World,
    fast_normalize,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Marks points without a value: off all surfaces, or where a lamp contributes nothing.
UNSEEN = wp.constant(-1.0)
# Shadows of lamps with a smaller share of a point's light are too faint for further rays.
SMOOTHED_SHARE = wp.constant(0.08)
# Leaves of one body hide the sky from one another up to this distance, the less the farther they
# are, since they scatter light themselves [m]. With it, crowns are as bright as path-traced ones.
CROWN_M = wp.constant(18.0)
# Where leaves of one body hide the sky, they send scattered light instead, as much as this share of
# the sky. With it, the darkest twentieth of a crown has two thirds of its path-traced luminance.
CROWN_GLOW = wp.constant(0.2)


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
    if lamp.kind == SUN:
        way = lamp.direction * -SUN_DISTANCE_M
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
    if lamp.kind == RECTANGLE:
        q = square_of_disc(part)
        off = lamp.along * q[0] + lamp.across * q[1]
    elif lamp.kind == DISK:
        off = lamp.along * part[0] + lamp.across * part[1]
    else:
        radius = lamp.radius
        if lamp.kind == SUN:
            radius = lamp.radius * SUN_DISTANCE_M
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
def tile_index(lattice: Lattice, i: int, tile_columns: int):
    """The tile of a lattice point."""
    return ((i / lattice.width) / TILE) * tile_columns + (i % lattice.width) / TILE


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


@wp.kernel
def weigh_lamps(world: World, lattice: Lattice, shares: wp.array2d[float]):
    """Share of each lamp in each point's unshadowed light [lamp, point]; UNSEEN behind surfaces.

    Lamps behind a translucent surface count like those before it.
    """
    i = wp.tid()
    if lattice.body[i] < 0:
        return
    n = lattice.normal[i]
    translucent = is_translucent(world, lattice.surface[i])
    total = wp.max(wp.max(sky_irradiance(world.sky, n)) * wp.pi, 1.0e-9)
    for j in range(world.lamps.shape[0]):
        beam = beam_from(world.lamps[j], lattice.origin_m[i])
        cosine = wp.dot(beam.direction, n)
        if translucent:
            cosine = wp.abs(cosine)
        brightest = wp.max(beam.normal_lux)
        lux = float(UNSEEN)
        if cosine > -beam.spread and brightest > 0.0:
            # Grazing highlights remain bright: the cosine has a floor.
            lux = brightest * wp.max(cosine, 0.2)
            total += lux
        shares[j, i] = lux
    for j in range(world.lamps.shape[0]):
        if shares[j, i] > 0.0:
            shares[j, i] = shares[j, i] / total


@wp.func
def mean_of_neighbours(lattice: Lattice, values: wp.array2d[float], j: int, x: int, y: int):
    """Mean of the known values beside, above and below a point on its material; else UNSEEN."""
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
    parity: int,
    lit: wp.array2d[float],
):
    """One shadow ray per point and lamp: 1, 0, or UNSEEN for lamps without effect.

    Args:
        disc: Forty-eight points of the unit disk; each lattice point uses one of three in a row.
        shares: As computed by weigh_lamps.
        parity: 0 probes the black squares of a checkerboard, 1 then the white ones, which trace a
            ray only where their black neighbours differ.
    """
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    if ((x + y) & 1) != parity:
        return
    tile = tile_index(lattice, i, tile_columns)
    for j in range(world.lamps.shape[0]):
        value = float(UNSEEN)
        if lattice.body[i] >= 0 and shares[j, i] > FAINT_SHARE:
            if parity == 1:
                value = agreed_value(lattice, lit, j, x, y)
                if value == UNSEEN and shares[j, i] < SMOOTHED_SHARE:
                    # Faint lamps: an interpolated shadow is as good as a traced one.
                    value = mean_of_neighbours(lattice, lit, j, x, y)
            if value == UNSEEN:
                value = probe_lamp(world, lattice, lists, tile, i, j, disc[3 * bayer(x, y) + 1])
        lit[j, i] = value


@wp.func
def probe_lamp(
    world: World, lattice: Lattice, lists: wp.array3d[int], tile: int, i: int, j: int, part: wp.vec2
):
    """Visibility of a part of lamp j from point i, 1 or 0, by one ray."""
    value = float(1.0)
    if lists[tile, j, 0] != 0:
        start = departure_to(world, lattice, i, lamp_vector(world.lamps[j], lattice.p_m[i]))
        way = path_to_lamp(world.lamps[j], start.origin_m, start.normal, part)
        path = path_along(start.origin_m, way)
        if is_occluded_by_listed(world, lists, tile, j, start.skip, path):
            value = 0.0
    return value


@wp.kernel
def classify_blocks(lattice: Lattice, values: wp.array2d[float], classes: wp.array3d[int]):
    """Values in each aligned 4 x 4 block, as bits: 1 zeros, 2 ones, 4 others."""
    row, column, j = wp.tid()
    found = int(0)
    for y in range(4 * row, wp.min(4 * row + 4, lattice.height)):
        k = int(y * lattice.width + 4 * column)
        end = y * lattice.width + wp.min(4 * column + 4, lattice.width)
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
def classes_around(classes: wp.array3d[int], x: int, y: int, j: int):
    """Union of the classes of the blocks that a point's window touches."""
    last_row = classes.shape[0] - 1
    last_column = classes.shape[1] - 1
    x0 = wp.max((x - 2) >> 2, 0)
    y0 = wp.max((y - 2) >> 2, 0)
    x1 = wp.min((x + 2) >> 2, last_column)
    y1 = wp.min((y + 2) >> 2, last_row)
    return classes[y0, x0, j] | classes[y0, x1, j] | classes[y1, x0, j] | classes[y1, x1, j]


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
    classes: wp.array3d[int],
    probed: wp.array2d[float],
    lit: wp.array2d[float],
):
    """Trace two more rays where a lamp is visible from part of the neighbourhood only.

    Args:
        disc, shares: As for probe_lamps.
    """
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    tile = tile_index(lattice, i, tile_columns)
    for j in range(world.lamps.shape[0]):
        value = probed[j, i]
        mixed = value != UNSEEN and (classes_around(classes, x, y, j) & 3) == 3
        if mixed and shares[j, i] > SMOOTHED_SHARE:
            if window_bits(lattice, probed, j, i) == 3:
                seen = value
                start = departure_to(world, lattice, i, lamp_vector(world.lamps[j], lattice.p_m[i]))
                for k in range(2):
                    # The two points of the triple that probe_lamps has left out.
                    part = disc[3 * bayer(x, y) + 2 * k]
                    way = path_to_lamp(world.lamps[j], start.origin_m, start.normal, part)
                    path = path_along(start.origin_m, way)
                    if not is_occluded_by_listed(world, lists, tile, j, start.skip, path):
                        seen += 1.0
                value = seen / 3.0
        lit[j, i] = value


@wp.func
def surface_tolerance(view: View, p: wp.vec3):
    """Allowed distance of neighbours from a point's tangent plane: three pixels' width [m]."""
    return 3.0 * view.pixel_rad * wp.length(p - view.eye_m)


@wp.func
def rim_weight(offset: int, half: int):
    """Weight of a window's offset: points at the rims of windows of width 2 ``half`` count half.

    Windows are thus centred and contain every part of a 4 x 4 pattern equally often.
    """
    return wp.where(wp.abs(offset) == half, 0.5, 1.0)


@wp.func
def is_same_surface(lattice: Lattice, i: int, k: int, tolerance_m: float):
    """Whether two lattice points lie on one smooth stretch of surface."""
    same = bool(False)
    if lattice.surface[i] == lattice.surface[k]:
        p = lattice.p_m[i]
        same = (
            points_agree(p, lattice.normal[i], lattice.p_m[k], lattice.normal[k], tolerance_m) > 0.0
        )
    return same


@wp.kernel
def sum_rows(
    view: View,
    lattice: Lattice,
    classes: wp.array3d[int],
    values: wp.array2d[float],
    sums: wp.array2d[wp.vec2],
):
    """Sum and number of the values beside each point on its own surface.

    Skipped where all values agree and neither row above nor below needs the sums.
    """
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    for j in range(values.shape[0]):
        found = classes_around(classes, x, wp.max(y - 2, 0), j)
        found = found | classes_around(classes, x, wp.min(y + 2, lattice.height - 1), j)
        total = wp.vec2(0.0, 0.0)
        if lattice.surface[i] >= 0 and not (found == 1 or found == 2):  # noqa: PLR1714
            tolerance_m = surface_tolerance(view, lattice.p_m[i])
            k = int(i + wp.max(-x, -2))
            end = i + wp.min(lattice.width - 1 - x, 2)
            while k <= end:
                value = values[j, k]
                if value != UNSEEN and is_same_surface(lattice, i, k, tolerance_m):
                    total += wp.vec2(value, 1.0) * rim_weight(k - i, 2)
                k += 1
        sums[j, i] = total


@wp.func
def column_sum(
    lattice: Lattice, sums: wp.array2d[wp.vec2], j: int, i: int, half: int, tolerance_m: float
):
    """Row sums added over the points above and below a point on its own surface."""
    y = i / lattice.width
    total = wp.vec2(0.0, 0.0)
    v = int(wp.max(-y, -half))
    while v <= wp.min(lattice.height - 1 - y, half):
        k = i + v * lattice.width
        if is_same_surface(lattice, i, k, tolerance_m):
            total += sums[j, k] * rim_weight(v, half)
        v += 1
    return total


@wp.kernel
def smooth_lattice(
    view: View,
    lattice: Lattice,
    classes: wp.array3d[int],
    values: wp.array2d[float],
    sums: wp.array2d[wp.vec2],
    smoothed: wp.array2d[float],
):
    """Average differing values over neighbours on one surface."""
    i = wp.tid()
    x = i % lattice.width
    y = i / lattice.width
    for j in range(values.shape[0]):
        value = values[j, i]
        if value != UNSEEN:
            found = classes_around(classes, x, y, j)
            if found == 1 or found == 2:  # noqa: PLR1714
                # Only zeros (1) or only ones (2) around: the mean is exact.
                value = float(found - 1)
            else:
                tolerance_m = surface_tolerance(view, lattice.p_m[i])
                total = column_sum(lattice, sums, j, i, 2, tolerance_m)
                if total[1] < 8.0:
                    # At the end of a surface a window holds part of the pattern only: take a larger
                    # one.
                    total = column_sum(lattice, sums, j, i, 4, tolerance_m)
                if total[1] > 0.0:
                    value = total[0] / total[1]
        smoothed[j, i] = value


@wp.kernel
def probe_ambient(
    world: World,
    lattice: Lattice,
    tile_columns: int,
    lists: wp.array3d[int],
    hemisphere: wp.array[wp.vec3],
    radius_m: float,
    open_sky: wp.array2d[float],
):
    """Ambient occlusion by one short ray per point: 1 if free, less the nearer the obstacle.

    On a translucent surface, half of the points look to the other side, and the body itself hides
    the sky up to CROWN_M: leaves see little of it from inside of a crown.

    Args:
        hemisphere: Sixteen directions about +Z, distributed by the cosine.
    """
    i = wp.tid()
    value = float(UNSEEN)
    if lattice.body[i] >= 0:
        value = 1.0
        lamps = world.lamps.shape[0]
        tile = tile_index(lattice, i, tile_columns)
        if lists[tile, lamps, 0] != 0:
            n = lattice.normal[i]
            x, y = make_frame(n)
            rank = bayer(i % lattice.width, i / lattice.width)
            h = hemisphere[rank]
            way = x * h[0] + y * h[1] + n * h[2]
            start = Departure()
            start.origin_m = lattice.origin_m[i]
            start.skip = lattice.skip[i]
            within = float(1.0)
            if is_translucent(world, lattice.surface[i]):
                way = way * wp.where((rank & 2) != 0, 1.0, -1.0)
                start = departure_to(world, lattice, i, way)
                start.skip = lattice.body[i]
                within = free_path_before(
                    world, lattice.body[i], path_along(start.origin_m, way * CROWN_M), 1.0
                )
            path = path_along(start.origin_m, way * radius_m)
            t = free_path_of_listed(world, lists, tile, start.skip, path)
            # Full occlusion on contact, fading with zero slope at the radius: no visible boundary.
            value = wp.min(t * (2.0 - t), wp.max(within, CROWN_GLOW))
    open_sky[0, i] = value


@wp.kernel
def count_free_paths(
    world: World, points: wp.array[wp.vec3], ways: wp.array[wp.vec3], free: wp.array[int]
):
    """Count the unobstructed paths over all points and directions."""
    i = wp.tid()
    for k in range(ways.shape[0]):
        if not is_occluded(world, path_along(points[i], ways[k])):
            wp.atomic_add(free, 0, 1)
