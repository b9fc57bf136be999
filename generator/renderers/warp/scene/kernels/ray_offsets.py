"""How far from a surface rays start, so that they do not meet it again.

A point on a surface is known to half a unit in the last place of its largest coordinate, 6e-8 of
it in single precision, and a hit's distance no better. Rays that leave it therefore start beside
it: by a constant, for what is near the world's origin, and by a share of the coordinates. Too much
loses contact shadows and thin panes. Source: Waechter and Binder, "A fast and robust method for
avoiding self-intersection", Ray Tracing Gems, 2019, of which these are the plain form.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# The least offset of any ray of light: a fiftieth of a millimetre, below the rounding of meshes.
OFFSET_M = wp.constant(2.0e-5)
# Sixteen times that rounding: what a transform and a cross product may add up to.
OFFSET_SHARE = wp.constant(1.0e-6)
# Along a ray it must be more: it leaves a surface that it meets aslant by a part of it only.
PASSED_M = wp.constant(3.0e-5)
PASSED_SHARE = wp.constant(2.0e-6)
# Half a millimetre per metre from the eye: less than half a pixel, and at a few metres above the
# markings and covers that float millimetres over a road, beneath whose rims a camera looks.
OFFSET_PER_DISTANCE = wp.constant(5.0e-4)
# Laser ranges are measured over hundreds of metres from the scanner, in its frame; what lies
# within two millimetres behind a pane or before a mirror is not told from it.
LASER_OFFSET_M = wp.constant(2.0e-3)
# Rain and snow come from above whatever lies this near: grass, kerbs, markings that float.
SHELTER_OFFSET_M = wp.constant(0.02)


@wp.func
def offset_origin(p: wp.vec3, n: wp.vec3):
    """A ray's origin off a surface, on the side of a normal."""
    size = wp.abs(p[0]) + wp.abs(p[1]) + wp.abs(p[2])
    return p + n * (OFFSET_M + OFFSET_SHARE * size)


@wp.func
def passed_origin(p: wp.vec3, d: wp.vec3, eye_m: wp.vec3):
    """Where a ray goes on behind a surface that it has met."""
    return p + d * (PASSED_M + PASSED_SHARE * (wp.length(p - eye_m) + wp.length(p)))
