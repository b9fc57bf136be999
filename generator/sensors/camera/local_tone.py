"""Local tone mapping: exposure fusion of a bright and a dark version of one photograph.

Phones show rooms and the view from their windows in one picture: pixels are taken from the version
in which they are well exposed, scale by scale, which keeps local contrast (Mertens,
Kautz and Van Reeth, "Exposure fusion", 2007; with synthetic exposures of a merged burst: Hasinoff
et al., "Burst photography for high dynamic range and low-light imaging on mobile cameras", SIGGRAPH
Asia 2016, section 6). Curves are read from tables, and pyramids use only sums and products, which
all processors round alike.
"""

import math
from functools import lru_cache

import cv2
import numpy as np

from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import luminance
from gen_data.sensors.camera.isp import Tone, display_values, tone_to_display

_LONG = 1.3
"""Gain of the bright version: rooms are shown brighter than a single exposure may (assumed)."""
_CURVE: Tone = "knee"
_FULL = 0.8
"""Level up to which the bright version counts alone."""
_PALE = 0.15
"""Share of the largest value from which colours become pale: one channel after the other saturates
there, and processors hide the resulting change of hue (assumed)."""
_LEVELS = 4
_STEPS = 4095


def fuse_exposures(image: Float32, scale: float, white: float, contrast: float) -> Float32:
    """Display values [0, 1], float32 [h, w, 3], of linear ones times ``scale``.

    Args:
        image: Linear sRGB, float32 [h, w, 3], of which 1 over ``scale`` saturates one exposure.
        scale: Factor on the image.
        white: The largest value times ``scale``; the dark version has a gain of its inverse root.
        contrast: As for ``isp.display_values``.
    """
    level = np.maximum(np.asarray(luminance(image), np.float32), np.float32(1e-6))
    gains = (_LONG, 1.0 / math.sqrt(white))
    bright, dark = (tone_to_display(level, scale * g, _CURVE, contrast=contrast) for g in gains)
    fused = dark + _blend_scales(bright - dark, _well_exposed(level * np.float32(scale), white))
    shown = np.take(_values_of(contrast), _to_steps(np.clip(fused, 0.0, 1.0)))
    # Noise of nearly black pixels is not enhanced.
    gain = np.minimum(shown / (level * np.float32(scale)), np.float32(2.0 * _LONG))
    pale = np.clip(level * np.float32(scale / (_PALE * white)) - np.float32(1.0), 0.0, 1.0)
    # Merged first, as in optics.scale_pixels.
    grey = cv2.merge([level, level, level])
    image = image + (grey - image) * cv2.merge([pale, pale, pale])
    image *= cv2.merge([gain, gain, gain])
    return tone_to_display(image, scale, _CURVE, contrast=contrast)


def _blend_scales(values: Float32, weights: Float32) -> Float32:
    """Values times weights, both [h, w], where each scale of values takes weights as smooth."""
    details = []
    for _ in range(_LEVELS):
        if min(values.shape) < 4:
            break
        coarse = cv2.pyrDown(values)
        detail = values - cv2.pyrUp(coarse, dstsize=values.shape[::-1])
        details.append(detail * weights)
        values, weights = coarse, cv2.pyrDown(weights)
    total: Float32 = values * weights
    for detail in reversed(details):
        total = cv2.pyrUp(total, dstsize=detail.shape[::-1]) + detail
    return total


def _to_steps(display: Float32) -> np.ndarray[tuple[int, ...], np.dtype[np.int16]]:
    return np.asarray(display * np.float32(_STEPS) + np.float32(0.5), np.int16)


def _well_exposed(level: Float32, white: float) -> Float32:
    """Share of the bright version for levels of which 1 saturates one exposure.

    The dark version takes over between there and its own saturation: no sooner, to keep a lit wall
    brighter than one in shade.
    """
    last = 0.8 * math.sqrt(white)
    over = np.clip((level - np.float32(_FULL)) * np.float32(1.0 / (last - _FULL)), 0.0, 1.0)
    return np.asarray(1.0 - over * over * (3.0 - 2.0 * over), np.float32)


@lru_cache(maxsize=16)
def _values_of(contrast: float) -> Float32:
    """Linear value that the curve shows as each step of the display; the largest is finite."""
    values = np.geomspace(1e-5, 16.0, 8192)
    display = display_values(values, _CURVE, contrast=contrast)
    return np.asarray(np.interp(np.arange(_STEPS + 1) / _STEPS, display, values), np.float32)
