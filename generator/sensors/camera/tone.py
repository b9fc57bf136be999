"""Tone curves: display values from linear ones, of which 1 saturates.

=========  ==============================================================================
filmic     slight toe, straight mid-tones, exponential shoulder to 1: Uchimura, "HDR
           theory and practice", CEDEC 2017
knee       straight to a half, above it an exponential shoulder to 1: the knee by which
           cameras compress highlights
log        logarithm of the whole range of a sensor of several exposures: the mu-law of
           Kalantari and Ramamoorthi, "Deep high dynamic range imaging of dynamic scenes",
           2017
srgb       clipped at 1
linear     clipped at 1 and written without sRGB's transfer function
=========  ==============================================================================

All but ``linear`` are followed by the transfer function of sRGB (IEC 61966-2-1).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.colorimetry import srgb_encode
from gen_data.generator.core.se3 import Array

Tone = Literal["filmic", "knee", "log", "srgb", "linear"]
Real = TypeVar("Real", bound=np.floating[Any])

_LOG_SLOPE = 8.0
"""Slope of ``log`` at black, before it is scaled to reach 1 at white."""
_MANTISSA_BITS = 10
_DROPPED_BITS = 23 - _MANTISSA_BITS
_ROWS_AT_ONCE = 32


def filmic(value: NDArray[Real]) -> NDArray[Real]:
    """Uchimura's curve with contrast 1, linear from 0.22 of length 0.4, black tightness 1.33."""
    m, length, black = 0.22, 0.4, 1.33
    shoulder_start = m + (1.0 - m) * length
    falloff = 1.0 / (1.0 - shoulder_start)
    toe = m * (value / m) ** black
    shoulder = 1.0 - (1.0 - shoulder_start) * np.exp(-falloff * (value - shoulder_start))
    t = np.clip(value / m, 0.0, 1.0)
    toe_weight = 1.0 - t * t * (3.0 - 2.0 * t)
    lower = toe * toe_weight + value * (1.0 - toe_weight)
    curve: NDArray[Real] = np.where(value < shoulder_start, lower, shoulder)
    clipped: NDArray[Real] = np.clip(curve, 0.0, 1.0)
    return clipped


def knee(value: NDArray[Real]) -> NDArray[Real]:
    """Straight to 0.5, then ``1 - 0.5 exp(-2 (value - 0.5))``, which has the same slope there."""
    over = np.maximum(value - 0.5, 0.0)
    return np.where(value < 0.5, value, 1.0 - 0.5 * np.exp(-2.0 * over))


def log(value: NDArray[Real], white: float) -> NDArray[Real]:
    """``ln(1 + mu x) / ln(1 + mu)`` of ``x = value / white`` with ``mu = 8 white``."""
    curve: NDArray[Real] = np.log1p(_LOG_SLOPE * value) / math.log1p(_LOG_SLOPE * white)
    return curve


def display_values(value: NDArray[Real], tone: Tone, white: float = 1.0) -> NDArray[Real]:
    """Display values [0, 1] of linear ones, of the same shape and type.

    1 saturates for all curves but ``log``, which maps ``white`` to 1.
    """
    value = np.maximum(value, 0.0)
    if tone == "filmic":
        value = filmic(value)
    elif tone == "knee":
        value = knee(value)
    elif tone == "log":
        value = log(value, white)
    value = np.clip(value, 0.0, 1.0)
    return value if tone == "linear" else srgb_encode(value)


def to_bytes(display: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Quantise display values [0, 1] to bytes."""
    return np.asarray(np.floor(np.clip(display, 0.0, 1.0) * 255.0 + 0.5), np.uint8)


def tone_to_bytes(
    image: Float32, scale: float, tone: Tone, white: float = 1.0
) -> NDArray[np.uint8]:
    """Bytes of linear values times ``scale``, uint8 of the same shape [h, w, 3], by a lookup table.

    Equals ``to_bytes(display_values(...))`` of values rounded to ten bits of mantissa: an error of
    at most a tenth of a byte before rounding.
    """
    table, factor = _byte_table(tone, white), np.float32(scale)
    out = np.zeros(image.shape, np.uint8)
    # In bands that fit into the processor's cache.
    for top in range(0, len(image), _ROWS_AT_ONCE):
        rows = slice(top, top + _ROWS_AT_ONCE)
        # Sign, exponent and leading bits of the mantissa are the index: negative values clip to 0.
        index = (image[rows] * factor).view(np.int32) >> _DROPPED_BITS
        np.take(table, index, out=out[rows], mode="clip")
    return out


@lru_cache(maxsize=8)
def _byte_table(tone: Tone, white: float) -> NDArray[np.uint8]:
    """Bytes of all positive float32, indexed by their leading bits."""
    infinity = int(np.float32(np.inf).view(np.int32)) >> _DROPPED_BITS
    middle = (np.arange(infinity, dtype=np.int32) << _DROPPED_BITS) + (1 << (_DROPPED_BITS - 1))
    values: Array = middle.view(np.float32).astype(np.float64)
    return np.append(to_bytes(display_values(values, tone, white)), np.uint8(255))
