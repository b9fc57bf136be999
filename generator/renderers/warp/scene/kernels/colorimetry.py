"""Luminance on the device, with the weights of ``gen_data.generator.core.colorimetry``."""

from __future__ import annotations

import warp as wp

from gen_data.generator.core.colorimetry import REC709_LUMINANCE

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

WEIGHTS = wp.constant(wp.vec3(*(float(weight) for weight in REC709_LUMINANCE)))


@wp.func
def luminance(rgb: wp.vec3):
    """Luminance of linear RGB (Rec. 709)."""
    return WEIGHTS[0] * rgb[0] + WEIGHTS[1] * rgb[1] + WEIGHTS[2] * rgb[2]
