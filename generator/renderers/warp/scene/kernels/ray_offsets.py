"""Offsets of ray origins from surfaces, which avoid self-intersection.

A point on a surface is known to half a unit in the last place of its largest coordinate, a relative
error of 6e-8 in single precision, and the distance of a hit no better. Rays therefore start beside
the surface: by a constant, for points near the world's origin, and by a share of the coordinates.
Too large an offset loses contact shadows and thin panes. Source: Waechter and Binder, "A fast and
robust method for avoiding self-intersection", Ray Tracing Gems, 2019, here in its plain form.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

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
