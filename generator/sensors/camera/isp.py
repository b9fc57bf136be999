"""Image signal processor: demosaicing, white balance, saturation, sharpening and JPEG."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.sensors.camera.image_sensor import Pattern

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
    suffix = "_EA" if method == "edge_aware" else ""
    code = getattr(cv2, f"COLOR_Bayer{_BAYER[pattern]}2RGB{suffix}")
    steps = np.rint(np.clip(raw / white, 0.0, 1.0) * _DEPTH).astype(np.uint16)
    return np.asarray(cv2.cvtColor(steps, code) * np.float32(white / _DEPTH), np.float32)


def grey_world_gains(image: Float32) -> Float32:
    """Factors on red, green and blue that make the mean of an image grey, float32 [3].

    Clipped pixels, at 1, are left out; 1 if hardly any other is left. Source: Buchsbaum, "A spatial
    processor model for object colour perception", 1980.
    """
    seen = image.reshape(-1, 3)[::7]
    seen = seen[(seen.max(axis=1) < 0.95) & (seen.min(axis=1) > 0.0)]
    if len(seen) < 16:
        return np.ones(3, np.float32)
    means = seen.mean(axis=0, dtype=np.float64)
    return np.asarray(np.clip(means[1] / means, 0.3, 3.0), np.float32)


def white_balance_gains(image: Float32, share: float, warmth_ev: float) -> Float32:
    """Factors on red, green and blue relative to green, float32 [3]; 1 saturates the image.

    ``share`` of the illuminant's colour is corrected by the grey-world assumption; the error
    ``warmth_ev`` is red over blue, in stops.
    """
    gains = np.ones(3, np.float32)
    if share > 0.0:
        gains = grey_world_gains(image) ** np.float32(share)
    error = np.array([2.0 ** (0.5 * warmth_ev), 1.0, 2.0 ** (-0.5 * warmth_ev)], np.float32)
    return np.asarray(gains * error, np.float32)


def scale_saturation(image: Float32, factor: float) -> Float32:
    """Scale the difference of colours from grey of the same luminance."""
    grey = luminance(image)[..., None]
    colors: Float32 = grey + np.float32(factor) * (image - grey)
    return colors


def sharpen(display: Float32, amount: float, radius_px: float) -> Float32:
    """Sharpen display values in [0, 1] by unsharp masking."""
    blurred = cv2.GaussianBlur(display, (0, 0), radius_px)
    return np.asarray(np.clip(display + amount * (display - blurred), 0.0, 1.0), np.float32)


def compress_jpeg(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Encode and decode an sRGB image as JPEG, uint8 [h, w, 3]; libjpeg's quality, 1 to 100."""
    ok, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok, "the JPEG encoder takes any RGB image"
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None, "encoded bytes can be decoded"
    return np.ascontiguousarray(decoded[..., ::-1], np.uint8)
