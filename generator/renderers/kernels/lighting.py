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
RECTANGLE = wp.constant(3)
DISK = wp.constant(4)

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
