"""From luminance to the response of a camera."""

from __future__ import annotations

import math
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from generator.core.geometry import Float32
from generator.core.se3 import Array

_CURVE_ENTRIES = 8192
_MIDDLE_GREY = 0.18
# A 30th of a second at f/1.4 and ISO 3200, to snow in the sun: beyond, an automatic exposure stays
# where it is, so that night stays night.
_EV100_RANGE = (1.0, 17.0)
# Luminances of Rec. 709 primaries.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def exposure_of(ev100: float) -> float:
    """Factor on luminance [m^2/cd] after which 1 saturates the sensor.

    Saturation-based speed: L_max = 1.2 * 2^EV100 (ISO 12232; Lagarde and de Rousiers 2014).
    """
    return float(1.0 / (1.2 * 2.0**ev100))


def automatic_ev100(radiance: Float32) -> float:
    """The exposure value that puts the log-average luminance at middle grey.

    Args:
        radiance: Linear RGB [cd/m^2], shape [h, w, 3].

    Source: Reinhard et al., "Photographic tone reproduction for digital images", 2002.
    """
    sparse = radiance[::4, ::4].astype(np.float64)
    luminance = np.einsum("hwc,c->hw", sparse, _LUMINANCE, optimize=False)
    weights = _centre_weights(*luminance.shape)
    brightest = float(luminance.max(initial=0.0))
    if brightest <= 0.0:
        return _EV100_RANGE[0]
    # Black pixels (a missing background) say nothing about the light. A lamp in the picture is no
    # measure of black.
    bright = float(np.quantile(luminance[luminance > 0.0], 0.95))
    seen = luminance > 1e-4 * bright
    logs = np.log2(luminance[seen])
    average = float((logs * weights[seen]).sum() / weights[seen].sum())
    ev100 = average - math.log2(1.2 * _MIDDLE_GREY)
    # On a grid, so that the last bit of a logarithm is never seen.
    return round(min(max(ev100, _EV100_RANGE[0]), _EV100_RANGE[1]) * 256.0) / 256.0


@cache
def tone_curve(tone: Literal["filmic", "srgb"]) -> NDArray[np.uint8]:
    """Bytes of exposed radiance ``v``, indexed by ``v / (1 + v)`` from 0 to 1."""
    index = np.arange(_CURVE_ENTRIES) / (_CURVE_ENTRIES - 1.0)
    value = index / np.maximum(1.0 - index, 1e-6)
    display = filmic(value) if tone == "filmic" else np.clip(value, 0.0, 1.0)
    return np.floor(linear_to_srgb(display) * 255.0 + 0.5).astype(np.uint8)


def filmic(value: Array) -> Array:
    """A photographic curve: a slight toe, straight mid-tones, an exponential shoulder to 1.

    Source: Uchimura, "HDR theory and practice", CEDEC 2017, with contrast 1, linear section
    from 0.22 of length 0.4, black tightness 1.33.
    """
    m, length, black = 0.22, 0.4, 1.33
    l0 = (1.0 - m) * length
    shoulder_start = m + l0
    falloff = 1.0 / (1.0 - shoulder_start)
    toe = m * (value / m) ** black
    shoulder = 1.0 - (1.0 - shoulder_start) * np.exp(-falloff * (value - shoulder_start))
    t = np.clip(value / m, 0.0, 1.0)
    toe_weight = 1.0 - t * t * (3.0 - 2.0 * t)
    lower = toe * toe_weight + value * (1.0 - toe_weight)
    return np.clip(np.where(value < shoulder_start, lower, shoulder), 0.0, 1.0)


def linear_to_srgb(values: Array) -> Array:
    """IEC 61966-2-1, [0, 1] to [0, 1]."""
    bright = 1.055 * np.maximum(values, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(values <= 0.0031308, 12.92 * values, bright)


def _centre_weights(height: int, width: int) -> Array:
    y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
    x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    return 1.0 - 0.5 * np.clip(x[None] ** 2 + y[:, None] ** 2, 0.0, 1.0)
