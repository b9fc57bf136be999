"""From raw numbers to a photograph."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from generator.core.geometry import Float32
from generator.sensors.formation.photosites import Pattern

Demosaic = Literal["bilinear", "edge_aware"]
Tone = Literal["srgb", "filmic", "log", "linear"]

# OpenCV names a pattern after the second row's second and third photosites.
_BAYER = {"rggb": "BG", "bggr": "RG", "grbg": "GB", "gbrg": "GR"}
_DEPTH = 65_535.0


def demosaiced(raw: Float32, pattern: Pattern, method: Demosaic, white: float) -> Float32:
    """Three colours at every photosite, float32 [h, w, 3].

    Args:
        raw: Linear values [h, w].
        pattern: Filters of the photosites.
        method: Of interpolation.
        white: Largest value that is kept.
    """
    if pattern == "mono":
        return np.asarray(np.repeat(raw[..., None], 3, axis=-1), np.float32)
    suffix = "_EA" if method == "edge_aware" else ""
    code = getattr(cv2, f"COLOR_Bayer{_BAYER[pattern]}2RGB{suffix}")
    steps = np.rint(np.clip(raw / white, 0.0, 1.0) * _DEPTH).astype(np.uint16)
    return np.asarray(cv2.cvtColor(steps, code) * np.float32(white / _DEPTH), np.float32)


def grey_world_gains(image: Float32) -> Float32:
    """Factors on red, green and blue that make the mean of an image grey, float32 [3].

    Clipped pixels say nothing. Buchsbaum, "A spatial processor model for object colour
    perception", 1980.
    """
    seen = image.reshape(-1, 3)[::7]
    seen = seen[(seen.max(axis=1) < 0.95) & (seen.min(axis=1) > 0.0)]
    if len(seen) < 16:
        return np.ones(3, np.float32)
    means = seen.mean(axis=0, dtype=np.float64)
    return np.asarray(np.clip(means[1] / means, 0.3, 3.0), np.float32)


def toned(image: Float32, tone: Tone, white: float) -> Float32:
    """Display values [0, 1] of linear ones.

    Args:
        image: Linear; 1 is white for all but ``log``.
        tone: Curve.
        white: What ``log`` maps to 1: the range of sensors of several exposures.
    """
    if tone == "linear":
        return np.clip(image, 0.0, 1.0)
    if tone == "log":
        # The whole range of the sensor, evenly in stops where it is bright.
        image = np.log1p(8.0 * np.maximum(image, 0.0)) / np.float32(np.log1p(8.0 * white))
    elif tone == "filmic":
        image = _shoulder(image)
    values = np.clip(image, 0.0, 1.0)
    bright = 1.055 * np.maximum(values, 0.0031308) ** np.float32(1.0 / 2.4) - 0.055
    return np.asarray(np.where(values <= 0.0031308, 12.92 * values, bright), np.float32)


def _shoulder(value: Float32) -> Float32:
    """Straight to 0.5, then an exponential shoulder towards 1."""
    over = np.maximum(value - 0.5, 0.0)
    return np.where(value < 0.5, value, 1.0 - 0.5 * np.exp(-2.0 * over)).astype(np.float32)


def sharpened(image: Float32, amount: float, radius_px: float) -> Float32:
    """Unsharp masking of display values."""
    blurred = cv2.GaussianBlur(image, (0, 0), radius_px)
    return np.asarray(np.clip(image + amount * (image - blurred), 0.0, 1.0), np.float32)


def to_bytes(image: Float32) -> NDArray[np.uint8]:
    """Display values [0, 1] as bytes."""
    return np.asarray(np.floor(np.clip(image, 0.0, 1.0) * 255.0 + 0.5), np.uint8)


def through_jpeg(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """The image as it comes back out of a JPEG file."""
    ok, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok, "the JPEG encoder takes any RGB image"
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None, "what was encoded can be decoded"
    return np.ascontiguousarray(decoded[..., ::-1], np.uint8)
