"""Image signal processor: demosaicing, white balance, saturation, sharpening, tone curve and JPEG.

Tone curves give display values from linear ones, of which 1 saturates:

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

All but ``linear`` are followed by the transfer function of sRGB (IEC 61966-2-1). Contrast comes
before the curve: a power of the value over middle grey, which it keeps (the slope, or gamma, of a
film; the contrast of ACES looks has the same pivot). Pictures of cameras are more contrasty than
their scenes, with powers of 1.1 to 1.6 (Poynton, "Digital Video and HD", 2012, chapter 11).
"""

import math
from functools import cache, lru_cache
from typing import Any, Literal, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import (
    MIDDLE_GREY,
    REC709_FROM_XYZ,
    REC709_LUMINANCE,
    srgb_encode,
    temperature_to_chromaticity,
)
from gen_data.core.se3 import Array
from gen_data.sensors.camera.demosaicing import demosaic_along_edges
from gen_data.sensors.camera.image_sensor import Pattern

Demosaic = Literal["bilinear", "edge_aware"]

# OpenCV names a pattern after the second and third pixels of the second row.
_BAYER = {"rggb": "BG", "bggr": "RG", "grbg": "GB", "gbrg": "GR"}
_DEPTH = 65_535.0


def demosaic(raw: Float32, pattern: Pattern, method: Demosaic, white: float) -> Float32:
    """Interpolate three colours at every pixel of linear values [h, w]: float32 [h, w, 3].

    Values above ``white`` are clipped.
    """
    if pattern == "mono":
        return np.asarray(np.repeat(raw[..., None], 3, axis=-1), np.float32)
    if method == "edge_aware":
        return demosaic_along_edges(np.minimum(raw, np.float32(white)), pattern)
    code = getattr(cv2, f"COLOR_Bayer{_BAYER[pattern]}2RGB")
    steps = np.rint(np.clip(raw / white, 0.0, 1.0) * _DEPTH).astype(np.uint16)
    return np.asarray(cv2.cvtColor(steps, code) * np.float32(white / _DEPTH), np.float32)


def estimate_illuminant(image: Float32, norm: float) -> Array:
    """Colour of the light in an image, linear [3], of any luminance.

    It is the Minkowski norm of each channel: 1 is the mean (grey world; Buchsbaum, "A spatial
    processor model for object colour perception", 1980), infinity the largest value (white patch);
    6 estimated best (Finlayson and Trezzi, "Shades of gray and colour constancy", 2004). Pixels
    with a channel at 0 or from 0.95 are left out; the light is white if fewer than 16 remain.
    """
    # Channel by channel: numpy is slow on reductions over three neighbours.
    seen = np.ascontiguousarray(image.reshape(-1, 3)[::7].T)
    red, green, blue = seen
    dark_enough = np.maximum(np.maximum(red, green), blue) < 0.95
    counted = np.flatnonzero(dark_enough & (np.minimum(np.minimum(red, green), blue) > 0.0))
    if len(counted) < 16:
        return np.ones(3)
    light = seen.take(counted, axis=1).astype(np.float64)
    if norm == 1.0:
        return np.asarray(light.mean(axis=1))
    return np.asarray(_power(light, norm).mean(axis=1) ** (1.0 / norm))


def _power(base: Array, exponent: float) -> Array:
    """Positive numbers to a power; by products, which take a tenth of the time, if it is even."""
    if exponent % 2.0 or exponent > 16.0:
        return np.asarray(base**exponent)
    power = square = base * base
    for _ in range(round(exponent) // 2 - 1):
        power = power * square
    return power


COLDEST_K, HOTTEST_K = 2000.0, 10_000.0
"""Range of colour temperatures that cameras balance: candlelight to shade under a blue sky."""


def move_to_lamps(illuminant: Array, tint_ev: float) -> Array:
    """The light, linear sRGB [3], moved to where it differs from a black body by a tint at most.

    The difference is the distance in stops of red over green and of blue over green. Cameras seek
    lights along the black bodies, which are the colours of daylight and lamps (Hordley, "Scene
    illuminant estimation: past, present, and future", 2006).
    """
    light = np.maximum(illuminant, 1e-3)
    here = np.log2(light[[0, 2]] / light[1])
    bodies = _black_bodies_ev()
    away = here - bodies
    nearest = int((away * away).sum(axis=1).argmin())
    distance_ev = math.sqrt(float((away[nearest] * away[nearest]).sum()))
    kept = min(1.0, tint_ev / max(distance_ev, 1e-9))
    red, blue = 2.0 ** (bodies[nearest] + kept * away[nearest])
    return np.array([red, 1.0, blue])


@cache
def _black_bodies_ev() -> Array:
    """Logarithms of red over green and of blue over green of black bodies, base 2, [n, 2]."""
    points = []
    for mired in np.linspace(1e6 / HOTTEST_K, 1e6 / COLDEST_K, 256):
        x, y = temperature_to_chromaticity(1e6 / float(mired))
        red, green, blue = (REC709_FROM_XYZ * (x / y, 1.0, (1.0 - x - y) / y)).sum(axis=1)
        points.append((math.log2(red / green), math.log2(max(blue, 1e-3) / green)))
    return np.array(points)


def white_balance_gains(illuminant: Array, share: float, warmth_ev: float) -> Float32:
    """Factors on red, green and blue relative to green, float32 [3].

    ``share`` of the illuminant's colour, linear [3], is corrected; the error ``warmth_ev`` is red
    over blue, in stops.
    """
    gains = np.ones(3, np.float32)
    if share > 0.0:
        gains = np.asarray(np.clip(illuminant[1] / illuminant, 0.3, 3.0), np.float32)
        gains = gains ** np.float32(share)
    error = np.array([2.0 ** (0.5 * warmth_ev), 1.0, 2.0 ** (-0.5 * warmth_ev)], np.float32)
    return np.asarray(gains * error, np.float32)


def scale_saturation(image: Float32, factor: float) -> Float32:
    """Scale the difference of colours from grey of the same luminance."""
    return transform_colors(image, factor * np.eye(3) + (1.0 - factor) * REC709_LUMINANCE)


def transform_colors(image: Float32, matrix: Array) -> Float32:
    """Multiply all colours of an image [h, w, 3] by a matrix [3, 3]."""
    return np.asarray(cv2.transform(image, matrix), np.float32)


def sharpen_to_bytes(display: Float32, amount: float, radius_px: float) -> NDArray[np.uint8]:
    """Sharpen display values in [0, 1] by unsharp masking, and quantise them to bytes."""
    blurred = cv2.GaussianBlur(display, (0, 0), radius_px)
    out = np.zeros(display.shape, np.uint8)
    # In bands that fit into the processor's cache.
    for top in range(0, len(display), _ROWS_AT_ONCE):
        rows = slice(top, top + _ROWS_AT_ONCE)
        band = display[rows] - blurred[rows]
        band *= np.float32(amount)
        band += display[rows]
        out[rows] = to_bytes(band)
    return out


def compress_jpeg(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Encode and decode an sRGB image as JPEG, uint8 [h, w, 3]; libjpeg's quality, 1 to 100."""
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    ok, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok, "the JPEG encoder takes any RGB image"
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None, "encoded bytes can be decoded"
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), np.uint8)


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
    return np.asarray(np.clip(curve, 0.0, 1.0))


def knee(value: NDArray[Real]) -> NDArray[Real]:
    """Straight to 0.5, then ``1 - 0.5 exp(-2 (value - 0.5))``, which has the same slope there."""
    over = np.maximum(value - 0.5, 0.0)
    return np.where(value < 0.5, value, 1.0 - 0.5 * np.exp(-2.0 * over))


def log(value: NDArray[Real], white: float) -> NDArray[Real]:
    """``ln(1 + mu x) / ln(1 + mu)`` of ``x = value / white`` with ``mu = 8 white``."""
    return np.asarray(np.log1p(_LOG_SLOPE * value) / math.log1p(_LOG_SLOPE * white))


def display_values(
    value: NDArray[Real], tone: Tone, white: float = 1.0, contrast: float = 1.0
) -> NDArray[Real]:
    """Display values [0, 1] of linear ones, of the same shape and type.

    1 saturates for all curves but ``log``, which maps ``white`` to 1. ``contrast`` is a power.
    """
    value = np.maximum(value, 0.0)
    if contrast != 1.0:
        value = np.asarray(MIDDLE_GREY * (value / MIDDLE_GREY) ** contrast, value.dtype)
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
    scaled = np.clip(display, 0.0, 1.0)
    scaled *= 255.0
    scaled += 0.5
    return np.asarray(scaled, np.uint8)


def tone_to_bytes(
    image: Float32, scale: float, tone: Tone, white: float = 1.0, contrast: float = 1.0
) -> NDArray[np.uint8]:
    """Bytes of linear values times ``scale``, uint8 of the same shape [h, w, 3], by a lookup table.

    Equals ``to_bytes(display_values(...))`` of values rounded to ten bits of mantissa: an error of
    at most a tenth of a byte before rounding.
    """
    return _look_up(_byte_table(tone, white, contrast), image, scale)


def tone_to_display(
    image: Float32, scale: float, tone: Tone, white: float = 1.0, contrast: float = 1.0
) -> Float32:
    """Display values of linear values times ``scale``, rounded as by ``tone_to_bytes``."""
    return _look_up(_display_table(tone, white, contrast), image, scale)


def _look_up(table: NDArray[Any], image: Float32, scale: float) -> NDArray[Any]:
    """Entries of a table for all positive float32, for an image times ``scale``."""
    factor = np.float32(scale)
    out = np.zeros(image.shape, table.dtype)
    # In bands that fit into the processor's cache.
    for top in range(0, len(image), _ROWS_AT_ONCE):
        rows = slice(top, top + _ROWS_AT_ONCE)
        # Sign, exponent and leading bits of the mantissa are the index: negative values clip to 0.
        index = (image[rows] * factor).view(np.int32) >> _DROPPED_BITS
        np.take(table, index, out=out[rows], mode="clip")
    return out


@lru_cache(maxsize=12)
def _byte_table(tone: Tone, white: float, contrast: float) -> NDArray[np.uint8]:
    """Bytes of all positive float32, indexed by their leading bits."""
    return np.append(to_bytes(_displayed(tone, white, contrast)), np.uint8(255))


@lru_cache(maxsize=4)
def _display_table(tone: Tone, white: float, contrast: float) -> Float32:
    """Display values of all positive float32, indexed by their leading bits."""
    return np.append(_displayed(tone, white, contrast), 1.0).astype(np.float32)


def _displayed(tone: Tone, white: float, contrast: float) -> Array:
    infinity = int(np.float32(np.inf).view(np.int32)) >> _DROPPED_BITS
    middle = (np.arange(infinity, dtype=np.int32) << _DROPPED_BITS) + (1 << (_DROPPED_BITS - 1))
    values: Array = middle.view(np.float32).astype(np.float64)
    return display_values(values, tone, white, contrast)
