"""Radiance to sRGB bytes."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.func
def developed(value: float, curve: wp.array(dtype=wp.uint8)):
    """The byte of one channel of exposed radiance; the curve is indexed by v / (1 + v)."""
    last = float(curve.shape[0] - 1)
    return curve[int(value / (1.0 + value) * last + 0.5)]


@wp.kernel
def put_mixed(
    pixels: wp.array(dtype=int), mixed: wp.array(dtype=wp.vec3), radiance: wp.array(dtype=wp.vec3)
):
    """Put the mixed radiance of listed pixels in its place."""
    row = wp.tid()
    radiance[pixels[row]] = mixed[row]


@wp.kernel
def develop(
    radiance: wp.array(dtype=wp.vec3),
    exposure: float,
    curve: wp.array(dtype=wp.uint8),
    rgb: wp.array(dtype=wp.uint8, ndim=2),
):
    """Expose and apply the tone curve."""
    i = wp.tid()
    c = radiance[i] * exposure
    rgb[i, 0] = developed(c[0], curve)
    rgb[i, 1] = developed(c[1], curve)
    rgb[i, 2] = developed(c[2], curve)
