"""Light that arrives from lamps, in photometric units.

Source: Lagarde and de Rousiers, "Moving Frostbite to PBR", SIGGRAPH 2014 course notes.
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import Lamp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

SPHERE = wp.constant(0)
SPOT = wp.constant(1)
SUN = wp.constant(2)


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
        beam.distance_m = 1.0e4
        beam.normal_lux = lamp.power
        beam.spread = lamp.radius
        return beam
    to_lamp = lamp.position_m - p_world
    squared = wp.max(wp.dot(to_lamp, to_lamp), 1.0e-6)
    distance = wp.sqrt(squared)
    beam.direction = to_lamp / distance
    beam.distance_m = distance
    beam.normal_lux = lamp.power / wp.max(squared, lamp.radius * lamp.radius)
    beam.spread = lamp.radius / distance
    if lamp.kind == SPOT:
        cosine = -wp.dot(beam.direction, lamp.direction)
        span = wp.max(lamp.cos_inner - lamp.cos_outer, 1.0e-4)
        fade = wp.clamp((cosine - lamp.cos_outer) / span, 0.0, 1.0)
        beam.normal_lux = beam.normal_lux * (fade * fade * (3.0 - 2.0 * fade))
    return beam


@wp.func
def towards_mirror(beam: Beam, mirrored: wp.vec3):
    """Direction to the point of the lamp's ball nearest to a mirrored ray.

    Source: Karis, "Real shading in Unreal Engine 4", 2013.
    """
    along = wp.dot(beam.direction, mirrored)
    to_ray = mirrored * along - beam.direction
    length = wp.length(to_ray)
    part = wp.min(beam.spread / wp.max(length, 1.0e-6), 1.0)
    return wp.normalize(beam.direction + to_ray * part)
