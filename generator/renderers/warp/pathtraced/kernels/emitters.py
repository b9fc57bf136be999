"""Light sources of the path tracer: sampling, and intersection with rays.

Sources: Veach, "Robust Monte Carlo methods for light transport simulation", 1997 (multiple
importance sampling, power heuristic); Karlik et al., "MIS compensation: optimizing sampling
techniques in multiple importance sampling", SIGGRAPH Asia 2019 (environments); Shirley, Wang and
Zimmerman, "Monte Carlo techniques for direct lighting calculations", ACM TOG 15(1), 1996 (spheres
by solid angle, panels by area).
"""

import warp as wp

from gen_data.renderers.warp.realtime.kernels.soft_shadows import make_frame
from gen_data.renderers.warp.scene.kernels.analytic_lights import DISK, SPOT, SUN, is_panel
from gen_data.renderers.warp.scene.kernels.brdf import luminance
from gen_data.renderers.warp.scene.kernels.environment_lighting import blend_texels, sky_irradiance
from gen_data.renderers.warp.scene.kernels.records import (
    EnvironmentRecord,
    LightRecord,
    World,
    max_of_two,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Larger than any scene.
AT_INFINITY = wp.constant(1.0e6)
# Floor of the estimated irradiance, as a share of the mean: spherical harmonics are blurred and may
# underestimate it.
SKY_FLOOR = wp.constant(0.1)
# Number of the environment among the light sources; lamps count from 0.
SKY = wp.constant(-1)


@wp.struct
class SkyTable:
    """Tables for importance sampling of an environment.

    Attributes:
        part: Share of the environment's light that is sampled; the rest is left to BSDF sampling.
        rows: Cumulative share of light above each row's upper edge, [rows + 1].
        columns: Cumulative share of each row's light left of each column's edge, [rows, columns +
            1].
    """

    part: float
    rows: wp.array[float]
    columns: wp.array2d[float]


@wp.struct
class LightSample:
    """A light source in one direction from a point.

    Attributes:
        direction: Unit direction to it.
        distance_m: Distance to it [m]; negative for none.
        radiance: Radiance towards the point [cd/m^2].
        density: Density with which this source samples the direction [1/sr].
    """

    direction: wp.vec3
    distance_m: float
    radiance: wp.vec3
    density: float


@wp.func
def spot_fade(lamp: LightRecord, away: wp.vec3):
    """Falloff of a spot in a unit direction away from it; 1 for a sphere."""
    fade = float(1.0)
    if lamp.kind == SPOT:
        # A spot without falloff has no span: it ends within a ten-thousandth of the cosine.
        span = wp.max(lamp.cos_inner - lamp.cos_outer, 1.0e-4)
        t = wp.clamp((wp.dot(away, lamp.direction) - lamp.cos_outer) / span, 0.0, 1.0)
        fade = t * t * (3.0 - 2.0 * t)
    return fade


@wp.func
def ball_radius(lamp: LightRecord):
    """Radius of a lamp [m]; points become small spheres."""
    # A solid angle of zero cannot be sampled.
    return max_of_two(lamp.radius, 1.0e-3)


@wp.func
def cone_width(squared: float):
    """One minus the cosine of a cone's half angle, from its squared sine."""
    # 1 - sqrt(1 - s) cancels for small s; this form does not.
    return squared / (1.0 + wp.sqrt(1.0 - squared))


@wp.func
def ball_sine(lamp: LightRecord, distance_squared: float):
    """Squared sine of a lamp's angular radius."""
    squared = lamp.radius * lamp.radius / (1.0 + lamp.radius * lamp.radius)
    if lamp.kind != SUN:
        r = ball_radius(lamp)
        squared = r * r / distance_squared
    return squared


@wp.func
def lamp_weight(lamp: LightRecord, p: wp.vec3, n: wp.vec3):
    """Approximate illuminance of a surface by a lamp [lx]; 0 only where there is none."""
    weight = float(0.0)
    if lamp.kind == SUN:
        weight = luminance(lamp.power) * wp.clamp(lamp.radius - wp.dot(n, lamp.direction), 0.0, 1.0)
    else:
        to_lamp = lamp.position_m - p
        squared = max_of_two(wp.dot(to_lamp, to_lamp), lamp.radius * lamp.radius)
        squared = max_of_two(squared, 1.0e-6)
        inverse = 1.0 / wp.sqrt(squared)
        above = (wp.dot(n, to_lamp) + lamp.radius) * inverse
        if above > 0.0:
            # A floor where there is light: sources that are sampled too rarely cause fireflies.
            weight = luminance(lamp.power) * (wp.min(above, 1.0) + 0.02) * (inverse * inverse)
            if is_panel(lamp):
                # Panels emit by the cosine; a floor keeps grazing directions sampled.
                front = -wp.dot(to_lamp, lamp.direction) * inverse
                weight = wp.where(front > 0.0, weight * (front + 0.05), 0.0)
            else:
                weight *= spot_fade(lamp, to_lamp * -inverse)
    return weight


@wp.func
def sky_weight(sky: EnvironmentRecord, table: SkyTable, n: wp.vec3):
    """Approximate illuminance of a surface by the sampled part of the environment [lx]."""
    weight = float(0.0)
    if table.part * sky.luminance > 0.0:
        mean = luminance(sky.irradiance[0]) * sky.luminance
        weight = wp.pi * table.part * (luminance(sky_irradiance(sky, n)) + SKY_FLOOR * mean)
    return weight


@wp.func
def lamp_weight_at(lamp: LightRecord, p: wp.vec3, n: wp.vec3, sheet: int):
    """As ``lamp_weight``; for a sheet (1) the sum over both of its sides."""
    weight = lamp_weight(lamp, p, n)
    if sheet != 0:
        weight += lamp_weight(lamp, p, -n)
    return weight


@wp.func
def sky_weight_at(sky: EnvironmentRecord, table: SkyTable, n: wp.vec3, sheet: int):
    """As ``sky_weight``; for a sheet (1) the sum over both of its sides."""
    weight = sky_weight(sky, table, n)
    if sheet != 0:
        weight += sky_weight(sky, table, -n)
    return weight


@wp.func
def sample_cone(axis: wp.vec3, sine_squared: float, u: wp.vec2):
    """A direction sampled uniformly from a cone, and one minus its cosine to the axis."""
    # Uniform in solid angle is uniform in the cosine (Shirley, Wang and Zimmerman 1996).
    low = u[0] * cone_width(sine_squared)
    x, y = make_frame(axis)
    r = wp.sqrt(wp.max(low * (2.0 - low), 0.0))
    angle = 2.0 * wp.pi * u[1]
    d = x * (r * wp.cos(angle)) + y * (r * wp.sin(angle)) + axis * (1.0 - low)
    return d, low


@wp.func
def draw_ball(lamp: LightRecord, p: wp.vec3, u: wp.vec2):
    """Sample a point of a sphere, a spot or the sun."""
    g = LightSample()
    g.distance_m = -1.0
    axis = -lamp.direction
    squared = float(1.0)
    if lamp.kind != SUN:
        to_lamp = lamp.position_m - p
        squared = wp.dot(to_lamp, to_lamp)
        # At the centre of a lamp any axis will do.
        axis = to_lamp * (1.0 / wp.sqrt(wp.max(squared, 1.0e-12)))
    sine = ball_sine(lamp, squared)
    # Inside a sphere it fills all directions and is left to BSDF sampling.
    if sine < 1.0:
        direction, low = sample_cone(axis, sine, u)
        g.direction = direction
        g.density = 1.0 / (2.0 * wp.pi * cone_width(sine))
        g.radiance = ball_radiance(lamp, axis)
        g.distance_m = AT_INFINITY
        if lamp.kind != SUN:
            c = 1.0 - low
            r = ball_radius(lamp)
            beside = squared * low * (2.0 - low)
            # Nearer intersection of the sampled direction with the sphere.
            g.distance_m = wp.sqrt(squared) * c - wp.sqrt(wp.max(r * r - beside, 0.0))
    return g


@wp.func
def ball_radiance(lamp: LightRecord, axis: wp.vec3):
    """Radiance of a sphere seen along an axis; of the sun, over its disk."""
    area = wp.pi * lamp.radius * lamp.radius / (1.0 + lamp.radius * lamp.radius)
    if lamp.kind != SUN:
        r = ball_radius(lamp)
        area = wp.pi * r * r
    return lamp.power * (spot_fade(lamp, -axis) / area)


@wp.func
def panel_area(lamp: LightRecord):
    """Area of a rectangle or disk [m^2]."""
    per_square = wp.where(lamp.kind == DISK, wp.pi, 4.0)
    return per_square * wp.length(lamp.along) * wp.length(lamp.across)


@wp.func
def draw_panel(lamp: LightRecord, p: wp.vec3, u: wp.vec2):
    """Sample a point of a rectangle or disk, uniformly over its area."""
    x = 2.0 * u[0] - 1.0
    y = 2.0 * u[1] - 1.0
    if lamp.kind == DISK:
        r = wp.sqrt(u[0])
        angle = 2.0 * wp.pi * u[1]
        x = r * wp.cos(angle)
        y = r * wp.sin(angle)
    way = lamp.position_m + lamp.along * x + lamp.across * y - p
    squared = wp.max(wp.dot(way, way), 1.0e-12)
    g = LightSample()
    g.direction = way * (1.0 / wp.sqrt(squared))
    # Panels are one-sided.
    front = -wp.dot(g.direction, lamp.direction)
    g.distance_m = -1.0
    if front > 1.0e-6:
        g.distance_m = wp.sqrt(squared)
        # From density per area to density per solid angle.
        g.density = squared / (front * panel_area(lamp))
        g.radiance = lamp.radiance
    return g


@wp.func
def intersect_lamp(lamp: LightRecord, p: wp.vec3, d: wp.vec3):
    """Intersection of a ray with a lamp."""
    g = LightSample()
    g.direction = d
    g.distance_m = -1.0
    if lamp.kind == SUN:
        sine = ball_sine(lamp, 1.0)
        # By the chord: the cosine of a twentieth of a degree has no digits left.
        chord = d + lamp.direction
        if wp.dot(chord, chord) < 2.0 * cone_width(sine):
            g.distance_m = AT_INFINITY
            g.density = 1.0 / (2.0 * wp.pi * cone_width(sine))
            g.radiance = ball_radiance(lamp, -lamp.direction)
    elif is_panel(lamp):
        front = -wp.dot(d, lamp.direction)
        if front > 1.0e-6:
            t = wp.dot(p - lamp.position_m, lamp.direction) / front
            at = p + d * t - lamp.position_m
            x = wp.dot(at, lamp.along) / wp.dot(lamp.along, lamp.along)
            y = wp.dot(at, lamp.across) / wp.dot(lamp.across, lamp.across)
            inside = wp.abs(x) < 1.0 and wp.abs(y) < 1.0
            if lamp.kind == DISK:
                inside = x * x + y * y < 1.0
            if inside and t > 0.0:
                g.distance_m = t
                g.density = t * t / (front * panel_area(lamp))
                g.radiance = lamp.radiance
    else:
        to_lamp = lamp.position_m - p
        ahead = wp.dot(to_lamp, d)
        off = to_lamp - d * ahead
        r = ball_radius(lamp)
        beside = wp.dot(off, off)
        squared = wp.dot(to_lamp, to_lamp)
        if ahead > 0.0 and beside < r * r and squared > r * r:
            g.distance_m = ahead - wp.sqrt(r * r - beside)
            g.density = 1.0 / (2.0 * wp.pi * cone_width(r * r / squared))
            g.radiance = ball_radiance(lamp, to_lamp * (1.0 / wp.sqrt(squared)))
    return g


@wp.func
def find_interval(shares: wp.array[float], last: int, u: float):
    """The largest k < last with ``shares[k] <= u``; binary search."""
    low = int(0)
    high = last
    while high - low > 1:
        middle = (low + high) / 2
        if shares[middle] <= u:
            low = middle
        else:
            high = middle
    return low


@wp.func
def sky_place(sky: EnvironmentRecord, d: wp.vec3):
    """Position of a unit direction in the sky's image, [0, 1) along rows and columns; its sine."""
    x = sky.cos_yaw * d[0] + sky.sin_yaw * d[1]
    y = sky.cos_yaw * d[1] - sky.sin_yaw * d[0]
    z = wp.clamp(d[2], -1.0, 1.0)
    right = 0.5 - wp.atan2(y, x) * (0.5 / wp.pi)
    return wp.vec3(right, wp.acos(z) / wp.pi, wp.sqrt(1.0 - z * z))


@wp.func
def sky_light(sky: EnvironmentRecord, place: wp.vec3):
    """Radiance of the image at a position, bilinear."""
    x = place[0] * float(sky.image.shape[1]) - 0.5
    y = place[1] * float(sky.image.shape[0]) - 0.5
    return blend_texels(sky.image, x, y) * sky.luminance


@wp.func
def draw_sky(sky: EnvironmentRecord, table: SkyTable, u: wp.vec2):
    """Sample a direction of the environment by the image's luminance."""
    height = table.rows.shape[0] - 1
    width = table.columns.shape[1] - 1
    row = find_interval(table.rows, height, u[1])
    edges = table.columns[row]
    column = find_interval(edges, width, u[0])
    tall = table.rows[row + 1] - table.rows[row]
    wide = edges[column + 1] - edges[column]
    # Uniform within the texel, by the remainder of the number.
    x = (float(column) + wp.min((u[0] - edges[column]) / wide, 1.0)) / float(width)
    y = (float(row) + wp.min((u[1] - table.rows[row]) / tall, 1.0)) / float(height)
    azimuth = wp.pi * (1.0 - 2.0 * x)
    polar = wp.pi * y
    sine = wp.sin(polar)
    e = wp.vec3(sine * wp.cos(azimuth), sine * wp.sin(azimuth), wp.cos(polar))
    g = LightSample()
    g.direction = wp.vec3(
        sky.cos_yaw * e[0] - sky.sin_yaw * e[1], sky.cos_yaw * e[1] + sky.sin_yaw * e[0], e[2]
    )
    g.distance_m = AT_INFINITY
    g.radiance = sky_light(sky, wp.vec3(x, y, sine))
    # Change of variables: a texel covers 2 pi^2 sin(polar) / cells of solid angle.
    cells = float(width) * float(height)
    g.density = tall * wide * cells / (2.0 * wp.pi * wp.pi * wp.max(sine, 1.0e-6))
    return g


@wp.func
def sky_density(table: SkyTable, place: wp.vec3):
    """The density with which ``draw_sky`` samples the direction at a position [1/sr]."""
    height = table.rows.shape[0] - 1
    width = table.columns.shape[1] - 1
    # Rounding at the image's last edge would leave the table.
    column = wp.clamp(int(place[0] * float(width)), 0, width - 1)
    row = wp.clamp(int(place[1] * float(height)), 0, height - 1)
    share = table.rows[row + 1] - table.rows[row]
    share *= table.columns[row, column + 1] - table.columns[row, column]
    cells = float(width) * float(height)
    return share * cells / (2.0 * wp.pi * wp.pi * wp.max(place[2], 1.0e-6))


@wp.struct
class SourceChoice:
    """The light source that a vertex samples.

    Attributes:
        source: Number of a lamp, or SKY.
        part: Probability of that choice; 0 without any light.
        total: Sum of all weights [lx].
    """

    source: int
    part: float
    total: float


@wp.func
def choose_source(world: World, table: SkyTable, p: wp.vec3, n: wp.vec3, sheet: int, u: float):
    """Sample one source, approximately in proportion to its unshadowed light."""
    c = SourceChoice()
    c.source = SKY
    weight = sky_weight_at(world.sky, table, n, sheet)
    c.total = weight
    # Weighted reservoir sampling: one pass, without a table of weights.
    rest = u
    for j in range(world.lamps.shape[0]):
        w = lamp_weight_at(world.lamps[j], p, n, sheet)
        if w > 0.0:
            c.total += w
            part = w / c.total
            # Rescaled, the number is uniform again and decides between the remaining sources.
            if rest < part:
                c.source = j
                weight = w
                rest = rest / part
            else:
                rest = (rest - part) / (1.0 - part)
    if c.total > 0.0:
        c.part = weight / c.total
    return c


@wp.func
def power_heuristic(a: float, b: float):
    """Power heuristic: MIS weight of a technique with density a against one with density b."""
    return a * a / wp.max(a * a + b * b, 1.0e-30)
