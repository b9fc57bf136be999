"""Light that arrives from lamps, in photometric units.

Source: Lagarde and de Rousiers, "Moving Frostbite to PBR", SIGGRAPH 2014 course notes.
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import Lamp, unit

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

SPHERE = wp.constant(0)
SPOT = wp.constant(1)
SUN = wp.constant(2)

# A dipped beam, in slopes against its axis: where it is brightest, how fast it fades sideways and
# downwards, over what height it ends at the cut-off, how steeply and how far that rises on the side
# away from oncoming traffic, and what share of the light strays above it. Chosen to meet the points
# of UN R112 (class B, right-hand traffic) with 9 to 14 kcd at the brightest.
HOT_SIDE = wp.constant(0.03)
SIDE_WIDTH = wp.constant(0.18)
DOWN_WIDTH = wp.constant(0.045)
CUTOFF_HALF_WIDTH = wp.constant(0.0035)
CUTOFF_RISE = wp.constant(0.268)
CUTOFF_RISE_MAX = wp.constant(0.02)
STRAY = wp.constant(0.015)

# Where a sun is taken to be; no scene is larger.
SUN_DISTANCE_M = wp.constant(1.0e3)


@wp.struct
class Beam:
    """What one lamp sends to a point.

    Attributes:
        direction: Unit, towards the lamp's centre.
        distance_m: To the centre; a large number for a sun.
        normal_lux: Illuminance on a surface that faces the lamp.
        spread: Radius of the lamp over its distance.
    """

    direction: wp.vec3
    distance_m: float
    normal_lux: wp.vec3
    spread: float


@wp.func
def dipped_share(lamp: Lamp, d: wp.vec3):
    """Intensity of a dipped headlight in a direction, as a share of that at its brightest."""
    right = unit(wp.cross(lamp.direction, wp.vec3(0.0, 0.0, 1.0)))
    ahead = wp.max(wp.dot(d, lamp.direction), 1.0e-3)
    side = wp.dot(d, right) / ahead
    down = -wp.dot(d, wp.cross(right, lamp.direction)) / ahead
    below = down - lamp.cutoff + wp.clamp(CUTOFF_RISE * side, 0.0, CUTOFF_RISE_MAX)
    t = wp.clamp(0.5 + 0.5 * below / CUTOFF_HALF_WIDTH, 0.0, 1.0)
    s = (side - HOT_SIDE) / SIDE_WIDTH
    v = wp.max(below, 0.0) / DOWN_WIDTH
    lit = t * t * (3.0 - 2.0 * t) / ((1.0 + s * s) * (1.0 + v * v))
    return wp.max(lit, STRAY)


@wp.func
def beam_from(lamp: Lamp, p_world: wp.vec3):
    """The unobstructed beam of a lamp at a point."""
    beam = Beam()
    if lamp.kind == SUN:
        beam.direction = -lamp.direction
        beam.distance_m = SUN_DISTANCE_M
        beam.normal_lux = lamp.power
        beam.spread = lamp.radius
        return beam
    to_lamp = lamp.position_m - p_world
    squared = wp.max(wp.dot(to_lamp, to_lamp), wp.max(lamp.radius * lamp.radius, 1.0e-6))
    inverse = 1.0 / wp.sqrt(squared)
    beam.direction = to_lamp * inverse
    beam.distance_m = squared * inverse
    beam.normal_lux = lamp.power * (inverse * inverse)
    beam.spread = lamp.radius * inverse
    if lamp.kind == SPOT:
        cosine = -wp.dot(beam.direction, lamp.direction)
        span = wp.max(lamp.cos_inner - lamp.cos_outer, 1.0e-4)
        fade = wp.clamp((cosine - lamp.cos_outer) / span, 0.0, 1.0)
        beam.normal_lux = beam.normal_lux * (fade * fade * (3.0 - 2.0 * fade))
        if lamp.cutoff > 0.0:
            beam.normal_lux = beam.normal_lux * dipped_share(lamp, -beam.direction)
    return beam


@wp.func
def towards_mirror(beam: Beam, mirrored: wp.vec3, alpha: float):
    """Direction to the point of the lamp's ball nearest to a mirrored ray.

    Where the lobe of width ``alpha`` is much wider than the ball this is the ball's centre.
    Source: Karis, "Real shading in Unreal Engine 4", 2013.
    """
    spread = beam.spread - 0.2 * alpha
    if spread <= 0.0:
        return beam.direction
    to_ray = mirrored * wp.dot(beam.direction, mirrored) - beam.direction
    part = wp.min(spread / wp.sqrt(wp.max(wp.dot(to_ray, to_ray), 1.0e-12)), 1.0)
    return unit(beam.direction + to_ray * part)
