"""Direct illumination by analytic lights, in photometric units.

Sources: Lagarde and de Rousiers, "Moving Frostbite to PBR", SIGGRAPH 2014 course notes (units, and
spheres at the horizon); Baum, Rushmeier and Winget, "Improving radiosity solutions through the use
of analytically determined form-factors", SIGGRAPH 1989 (polygons, after Lambert 1760); Howell, "A
catalog of radiation heat transfer configuration factors", 1982 (disks, from elements parallel and
perpendicular to them); Karis, "Real shading in Unreal Engine 4", 2013, and Drobot, "Physically
based area lights", GPU Pro 5, 2014 (specular reflection by one representative point).
"""

import warp as wp

from gen_data.core.scene import LIGHT_KINDS
from gen_data.renderers.warp.scene.kernels.records import LightRecord, fast_normalize

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

SPOT = wp.constant(LIGHT_KINDS.index("spot"))
SUN = wp.constant(LIGHT_KINDS.index("sun"))
RECTANGLE = wp.constant(LIGHT_KINDS.index("rectangle"))
DISK = wp.constant(LIGHT_KINDS.index("disk"))

# A dipped beam, in slopes relative to its axis: lateral position of the hot spot, lateral and
# downward falloff, half width of the cut-off, slope and height of its rise on the side away from
# oncoming traffic, and share of stray light above it. Chosen to meet the test points of UN R112
# (class B, right-hand traffic) with 9 to 14 kcd at the hot spot.
HOT_SIDE = wp.constant(0.03)
SIDE_WIDTH = wp.constant(0.18)
DOWN_WIDTH = wp.constant(0.045)
CUTOFF_HALF_WIDTH = wp.constant(0.0035)
CUTOFF_RISE = wp.constant(0.268)
CUTOFF_RISE_MAX = wp.constant(0.02)
STRAY = wp.constant(0.015)

# Suns with a larger tangent of their radius, such as windows of a panorama, set gradually; the real
# sun is a point at the horizon.
WIDE_SUN = wp.constant(0.08)
# Distance at which a sun is placed; no scene is larger.
SUN_DISTANCE_M = wp.constant(1.0e3)
# Rectangles beyond this many radii are treated as points with a cosine: error below 0.1 %.
FAR = wp.constant(25.0)
# Polygon of the disk's area, for disks that the horizon clips.
DISK_CORNERS = wp.constant(16)
DISK_REACH = wp.constant(1.0130016)


@wp.func
def is_panel(lamp: LightRecord):
    """Whether a light is a flat, one-sided emitter."""
    return lamp.kind == RECTANGLE or lamp.kind == DISK  # noqa: PLR1714


@wp.struct
class Beam:
    """Unshadowed light of one lamp at a point.

    Attributes:
        direction: Unit, towards the light: to the lamp's centre, for a panel along its vector
            irradiance.
        distance_m: To the centre; SUN_DISTANCE_M for a sun.
        normal_lux: Illuminance of a surface perpendicular to ``direction`` [lx].
        spread: Radius of the lamp over its distance.
    """

    direction: wp.vec3
    distance_m: float
    normal_lux: wp.vec3
    spread: float


@wp.func
def dipped_share(lamp: LightRecord, d: wp.vec3):
    """Intensity of a dipped headlight in a direction, relative to its maximum."""
    right = fast_normalize(wp.cross(lamp.direction, wp.vec3(0.0, 0.0, 1.0)))
    # Slopes diverge at the sides of and behind the lamp: clamped, they end in the stray light.
    ahead = wp.max(wp.dot(d, lamp.direction), 1.0e-3)
    side = wp.dot(d, right) / ahead
    down = -wp.dot(d, wp.cross(right, lamp.direction)) / ahead
    below = down - lamp.cutoff + wp.clamp(CUTOFF_RISE * side, 0.0, CUTOFF_RISE_MAX)
    # Smoothstep over the cut-off, then Lorentzian falloff to the sides and downwards.
    t = wp.clamp(0.5 + 0.5 * below / CUTOFF_HALF_WIDTH, 0.0, 1.0)
    s = (side - HOT_SIDE) / SIDE_WIDTH
    v = wp.max(below, 0.0) / DOWN_WIDTH
    lit = t * t * (3.0 - 2.0 * t) / ((1.0 + s * s) * (1.0 + v * v))
    return wp.max(lit, STRAY)


@wp.func
def beam_from(lamp: LightRecord, p_world: wp.vec3):
    """The unshadowed beam of a lamp at a point."""
    beam = Beam()
    if lamp.kind == SUN:
        beam.direction = -lamp.direction
        beam.distance_m = SUN_DISTANCE_M
        beam.normal_lux = lamp.power
        beam.spread = lamp.radius
        # Parallel light: neither direction nor illuminance depends on the point.
        return beam
    to_lamp = lamp.position_m - p_world
    # The inverse square law ends at the lamp's own surface.
    squared = wp.max(wp.dot(to_lamp, to_lamp), wp.max(lamp.radius * lamp.radius, 1.0e-6))
    inverse = 1.0 / wp.sqrt(squared)
    beam.direction = to_lamp * inverse
    beam.distance_m = squared * inverse
    beam.spread = lamp.radius * inverse
    if is_panel(lamp):
        flow = panel_vector_irradiance(lamp, p_world)
        share = wp.length(flow)
        if share > 0.0:
            beam.direction = flow * (1.0 / share)
        beam.normal_lux = lamp.radiance * share
        return beam
    beam.normal_lux = lamp.power * (inverse * inverse)
    if lamp.kind == SPOT:
        cosine = -wp.dot(beam.direction, lamp.direction)
        span = wp.max(lamp.cos_inner - lamp.cos_outer, 1.0e-4)
        # Smoothstep in the cosine, which gen_data.core.photometry integrates: being
        # symmetric, half of the fading cone counts.
        fade = wp.clamp((cosine - lamp.cos_outer) / span, 0.0, 1.0)
        beam.normal_lux = beam.normal_lux * (fade * fade * (3.0 - 2.0 * fade))
        if lamp.cutoff > 0.0:
            beam.normal_lux = beam.normal_lux * dipped_share(lamp, -beam.direction)
    return beam


@wp.func
def panel_vector_irradiance(lamp: LightRecord, p_world: wp.vec3):
    """Vector irradiance of a panel per unit luminance, towards the light; 0 behind the panel.

    Its component along a normal is the irradiance of any surface that has the whole panel above its
    horizon.
    """
    away = p_world - lamp.position_m
    height = wp.dot(away, lamp.direction)
    flow = wp.vec3(0.0)
    if height > 0.0:
        if lamp.kind == DISK:
            flow = disk_vector_irradiance(lamp, away, height)
        else:
            flow = rectangle_vector_irradiance(lamp, away, height)
    return flow


@wp.func
def disk_vector_irradiance(lamp: LightRecord, away: wp.vec3, height: float):
    """As panel_vector_irradiance, exact; ``away`` points from the centre to the receiver."""
    beside = away - lamp.direction * height
    r2 = lamp.radius * lamp.radius
    s = wp.dot(away, away)
    # Howell's configuration factors of elements parallel and perpendicular to the disk.
    total = s + r2
    root = wp.sqrt(wp.max(total * total - 4.0 * wp.dot(beside, beside) * r2, 1.0e-20))
    # 1 - (s - r2) / root cancels far away: the second form of the same factor keeps its digits.
    level = 0.5 * (1.0 + (r2 - s) / root)
    if s > r2:
        level = 2.0 * height * height * r2 / (root * (root + s - r2))
    upright = 2.0 * height * r2 / (root * (total + root))
    return (lamp.direction * level + beside * upright) * -wp.pi


@wp.func
def rectangle_vector_irradiance(lamp: LightRecord, away: wp.vec3, height: float):
    """As panel_vector_irradiance, exact unless distant; ``away`` points from the centre."""
    s = wp.dot(away, away)
    if s > FAR * FAR * lamp.radius * lamp.radius:
        # Far away a point source with a cosine is accurate enough, and the sum over edges cancels.
        area_m2 = 4.0 * wp.length(lamp.along) * wp.length(lamp.across)
        return away * (-area_m2 * height / (s * s))
    flow = wp.vec3(0.0)
    first = -away - lamp.along - lamp.across
    before = first
    for k in range(1, 5):
        corner = first
        if k < 4:
            corner = panel_corner(lamp, k) - away
        # Lambert's formula: a sum over the polygon's edges.
        flow += edge_vector_irradiance(before, corner)
        before = corner
    return flow


@wp.func
def panel_corner(lamp: LightRecord, k: int):
    """Corner k of a panel relative to its centre, clockwise as seen from its front."""
    u = wp.where((k & 3) >= 2, 1.0, -1.0)
    v = wp.where(((k + 1) & 3) >= 2, 1.0, -1.0)
    if lamp.kind == DISK:
        angle = float(k) * (-2.0 * wp.pi / float(DISK_CORNERS))
        # Corners lie outside the circle such that the polygon has the disk's area.
        u = DISK_REACH * wp.cos(angle)
        v = DISK_REACH * wp.sin(angle)
    return lamp.along * u + lamp.across * v


@wp.func
def edge_vector_irradiance(a: wp.vec3, b: wp.vec3):
    """Contribution of one edge: half the angle it subtends, along the normal of its fan."""
    normal = wp.cross(a, b)
    sine = wp.length(normal)
    # atan2 rather than acos: the cosine of a small angle has no digits left.
    return normal * (0.5 * wp.atan2(sine, wp.dot(a, b)) / wp.max(sine, 1.0e-30))


@wp.func
def relative_illuminance(lamp: LightRecord, beam: Beam, p_world: wp.vec3, n: wp.vec3):
    """Illuminance of a surface with normal n, relative to one perpendicular to the beam.

    The cosine where the whole lamp is above the horizon, and for spheres, spots and all but wide
    suns, which are dark once their centre has set. Otherwise the contribution of the part above the
    horizon; disks are polygons there, accurate to a thousandth of the whole disk.
    """
    cosine = wp.dot(n, beam.direction)
    if not is_panel(lamp):
        if lamp.kind == SUN and lamp.radius > WIDE_SUN and wp.abs(cosine) < lamp.radius:
            # The record holds the tangent of the angular radius; the formula takes the squared
            # sine.
            sine2 = lamp.radius * lamp.radius
            cosine = clipped_sphere_irradiance(cosine, sine2 / (1.0 + sine2))
        return wp.max(cosine, 0.0)
    to_centre = lamp.position_m - p_world
    # Only panels within one radius of the horizon can be clipped: the polygon code is rarely run.
    if wp.dot(n, to_centre) < lamp.radius:
        whole = wp.max(beam.normal_lux) / wp.max(wp.max(lamp.radiance), 1.0e-20)
        if whole > 0.0:
            cosine = clipped_panel_irradiance(lamp, to_centre, n) / whole
    return wp.max(cosine, 0.0)


@wp.func
def above_horizon_fraction(lamp: LightRecord, beam: Beam, n: wp.vec3):
    """Approximate share of a wide lamp above the horizon; 1 for all others."""
    share = float(1.0)
    if is_panel(lamp) or (lamp.kind == SUN and lamp.radius > WIDE_SUN):
        share = wp.clamp(0.5 + 0.5 * wp.dot(n, beam.direction) / beam.spread, 0.0, 1.0)
    return share


@wp.func
def clipped_sphere_irradiance(cosine: float, sine2: float):
    """As ``relative_illuminance``, for a sphere whose centre has the given cosine.

    Args:
        sine2: Squared sine of the sphere's angular radius.
    """
    share = wp.max(cosine, 0.0)
    if cosine * cosine < sine2:
        # Lagarde and de Rousiers 2014: a sphere cut by the horizon.
        sine = wp.sqrt(1.0 - cosine * cosine)
        x = wp.sqrt(1.0 / sine2 - 1.0)
        y = wp.clamp(-x * cosine / sine, -1.0, 1.0)
        part = sine * wp.sqrt(1.0 - y * y)
        lit = (cosine * wp.acos(y) - x * part) * sine2 + wp.atan2(part, x)
        share = lit / (wp.pi * sine2)
    return share


@wp.func
def clipped_panel_irradiance(lamp: LightRecord, to_centre: wp.vec3, n: wp.vec3):
    """Irradiance per unit luminance from the part of a panel above the horizon."""
    corners = wp.where(lamp.kind == DISK, DISK_CORNERS, 4)
    first = to_centre + panel_corner(lamp, 0)
    before = first
    total = float(0.0)
    enters = wp.vec3(0.0)
    leaves = wp.vec3(0.0)
    for k in range(1, corners + 1):
        corner = first
        if k < corners:
            corner = to_centre + panel_corner(lamp, k)
        # Clip each edge at the horizon; a convex polygon crosses it at most twice.
        a = wp.dot(n, before)
        b = wp.dot(n, corner)
        start = before
        end = corner
        if (a < 0.0) != (b < 0.0):
            crossing = before + (corner - before) * (a / (a - b))
            if a < 0.0:
                start = crossing
                enters = crossing
            else:
                end = crossing
                leaves = crossing
        if a >= 0.0 or b >= 0.0:
            total += wp.dot(n, edge_vector_irradiance(start, end))
        before = corner
    # Close the clipped polygon along the horizon, from where it set to where it rose.
    total += wp.dot(n, edge_vector_irradiance(leaves, enters))
    return wp.max(total, 0.0)


@wp.func
def representative_direction(
    lamp: LightRecord, beam: Beam, p_world: wp.vec3, mirrored: wp.vec3, alpha: float
):
    """Direction to the point of a lamp nearest to the mirrored ray (Karis 2013).

    The lamp's centre where a lobe of width ``alpha`` is much wider than the lamp.
    """
    if is_panel(lamp):
        return representative_panel_direction(lamp, p_world, mirrored, alpha)
    # The wider the lobe, the less the exact point matters: it moves to the centre.
    spread = beam.spread - 0.2 * alpha
    if spread <= 0.0:
        return beam.direction
    to_ray = mirrored * wp.dot(beam.direction, mirrored) - beam.direction
    part = wp.min(spread / wp.sqrt(wp.max(wp.dot(to_ray, to_ray), 1.0e-12)), 1.0)
    return fast_normalize(beam.direction + to_ray * part)


@wp.func
def representative_panel_direction(
    lamp: LightRecord, p_world: wp.vec3, mirrored: wp.vec3, alpha: float
):
    """As representative_direction, for panels: the ray's intersection, clamped to the outline."""
    to_centre = lamp.position_m - p_world
    approach = -wp.dot(mirrored, lamp.direction)
    # A ray parallel to the panel meets its plane at infinity: bounded.
    reach = wp.min(-wp.dot(to_centre, lamp.direction) / wp.max(approach, 1.0e-4), 1.0e4)
    level = mirrored + lamp.direction * approach
    beside = level * reach - to_centre - lamp.direction * wp.dot(to_centre, -lamp.direction)
    half = wp.vec2(wp.length(lamp.along), wp.length(lamp.across))
    # As for spheres, wide lobes pull the point towards the centre.
    shy = 0.2 * alpha * wp.length(to_centre)
    u = wp.dot(beside, lamp.along) / half[0]
    v = wp.dot(beside, lamp.across) / half[1]
    limit = wp.vec2(wp.max(half[0] - shy, 0.0), wp.max(half[1] - shy, 0.0))
    if lamp.kind == DISK:
        inward = wp.min(limit[0] / wp.sqrt(wp.max(u * u + v * v, 1.0e-20)), 1.0)
        u = u * inward
        v = v * inward
    else:
        u = wp.clamp(u, -limit[0], limit[0])
        v = wp.clamp(v, -limit[1], limit[1])
    return fast_normalize(to_centre + lamp.along * (u / half[0]) + lamp.across * (v / half[1]))


@wp.func
def lobe_widening(lamp: LightRecord, beam: Beam, alpha: float):
    """Widening of a lobe of width ``alpha`` by a lamp's extent.

    Chosen such that the widened lobe of a mirror is as bright as the lamp. Panels widen it along
    each of their axes by the projected extent.
    """
    wider = 0.5 * beam.spread
    if is_panel(lamp):
        # Half the radius of a disk; 0.5642 = 1 / sqrt(pi) makes it that of the disk of the
        # rectangle's area.
        part = wp.where(lamp.kind == DISK, 0.5, 0.5642) / beam.distance_m
        a = wp.dot(lamp.along, beam.direction)
        b = wp.dot(lamp.across, beam.direction)
        x = part * wp.sqrt(wp.max(wp.dot(lamp.along, lamp.along) - a * a, 0.0))
        y = part * wp.sqrt(wp.max(wp.dot(lamp.across, lamp.across) - b * b, 0.0))
        wider = wp.sqrt(combined_width(alpha, x) * combined_width(alpha, y)) - alpha
    return wider


@wp.func
def combined_width(alpha: float, spread: float):
    """Width of a lobe convolved with a lamp.

    The mean of sum and root of squares: with either alone, panels are a fifth too dim or half too
    bright at roughness 0.3 to 0.6 (against quadrature).
    """
    return 0.5 * (alpha + spread + wp.sqrt(alpha * alpha + spread * spread))
