"""Lens effects on linear images, float32 [h, w, 3] of any unit.

Flare consists of ghosts by reflections between the surfaces of a lens.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.se3 import Array

_BLUR_LEVELS = (0.0, 1.0, 1.6, 2.5, 4.0, 6.3, 10.0, 16.0)
"""Radii of the layers that a defocused image is composed of [px]."""


def blur_radius_px(
    z_m: NDArray[np.floating], focus_m: float, focal_m: float, f_number: float, pitch_m: float
) -> Float32:
    """Signed radius of the circle of confusion of a thin lens [px]; negative before the focus.

    ``c = (f^2 / N) |z - s| / (z (s - f))``; see Potmesil and Chakravarty, "A lens and aperture
    camera model for synthetic image generation", SIGGRAPH 1981. ``z`` may be infinite.
    """
    inverse = np.where(np.isfinite(z_m), 1.0 / np.maximum(z_m, 1e-3), 0.0)
    diameter_m = focal_m * focal_m / f_number / (focus_m - focal_m) * (1.0 - focus_m * inverse)
    return np.asarray(0.5 * diameter_m / pitch_m, np.float32)


def defocus(image: Float32, radius_px: Float32) -> Float32:
    """Blur every point of an image over its circle of confusion.

    Layers of similar radius are blurred and composited from far to near, so that sharp foreground
    does not bleed into blurred background. After Kraus and Strengert, "Depth-of-field rendering by
    pyramidal image processing", Eurographics 2007.
    """
    levels = np.asarray(_BLUR_LEVELS, np.float32)
    level = np.searchsorted(0.5 * (levels[1:] + levels[:-1]), np.abs(radius_px))
    signed = np.where(radius_px < 0.0, -level, level)
    out = np.zeros_like(image)
    weight = np.zeros(image.shape[:2], np.float32)
    for layer in sorted(np.unique(signed).tolist(), reverse=True):
        alpha = (signed == layer).astype(np.float32)
        kernel = _disc(float(levels[abs(layer)]))
        color = cv2.filter2D(image * alpha[..., None], -1, kernel, borderType=cv2.BORDER_REPLICATE)
        cover = cv2.filter2D(alpha, -1, kernel, borderType=cv2.BORDER_REPLICATE)
        cover = np.clip(cover, 0.0, 1.0)
        out = color + out * (1.0 - cover)[..., None]
        weight = cover + weight * (1.0 - cover)
    return np.asarray(out / np.maximum(weight, 1e-4)[..., None], np.float32)


def apply_vignetting(image: Float32, corner_loss: float) -> Float32:
    """Darken an image towards its corners by mechanical vignetting.

    The loss grows with the square of the distance (Goldman, "Vignette and exposure calibration and
    compensation", 2010) to a share of ``corner_loss`` at the corners.
    """
    height, width = image.shape[:2]
    x = np.arange(width, dtype=np.float32) + np.float32(0.5 - 0.5 * width)
    y = np.arange(height, dtype=np.float32) + np.float32(0.5 - 0.5 * height)
    r2 = x[None, :] ** 2 + y[:, None] ** 2
    gain = 1.0 - corner_loss * r2 / (0.25 * (width * width + height * height))
    return np.asarray(image * gain[..., None].astype(np.float32), np.float32)


def natural_falloff(camera: Intrinsics, pupil_power: float) -> Float32:
    """Relative illumination of every pixel, float32 [h, w]: 1 on the axis, 0 outside the field.

    Rectilinear lenses follow the fourth power of the cosine of the ray's angle to the axis: one
    power for the foreshortened pupil, three for the stretched image. A fisheye compresses its edge,
    r(theta), which brightens it: the pupil's power of the cosine times ``sin(theta) / (r r')``,
    2 / pi at 90 degrees for r = theta. Panoramas, stitched from many images, are uniform.

    Args:
        camera: Intrinsics with the lens.
        pupil_power: Power of the cosine for a fisheye's pupil: 1 is flat, 0 turns to the light, as
            in most designs (Kumler and Bauer, "Fish-eye lens designs and their relative
            performance", 2000).
    """
    model = camera.lens.model
    if model == "equirectangular":
        return np.ones((camera.height_px, camera.width_px), np.float32)
    if model == "pinhole":
        x = (np.arange(camera.width_px) + 0.5 - camera.cx_px) / camera.fx_px
        y = (np.arange(camera.height_px) + 0.5 - camera.cy_px) / camera.fy_px
        cos2 = 1.0 / (1.0 + x[None, :] ** 2 + y[:, None] ** 2)
        return np.asarray(cos2 * cos2, np.float32)
    cosine = camera.pixel_rays()[..., 2]
    if model == "brown_conrady":
        falloff = np.maximum(cosine, 0.0) ** 4
    else:
        falloff = _fisheye_gain(cosine, camera.lens.coefficients)
        falloff = falloff * np.maximum(cosine, 0.0) ** pupil_power if pupil_power > 0 else falloff
    return np.asarray(np.nan_to_num(falloff, nan=0.0), np.float32)


def _fisheye_gain(cosine: Array, coefficients: Sequence[float]) -> Array:
    """``sin(theta) / (r r')`` for Kannala and Brandt's ``r = theta + k1 theta^3 + ...``."""
    theta = np.arccos(np.clip(cosine, -1.0, 1.0))
    square = theta * theta
    ratio, slope, power = np.ones_like(theta), np.ones_like(theta), square
    for k, coefficient in enumerate(coefficients, start=1):
        ratio = ratio + coefficient * power
        slope = slope + (2 * k + 1) * coefficient * power
        power = power * square
    # sin(theta) / (r r') with r = theta * ratio; numpy's sinc(x) is sin(pi x) / (pi x).
    gain: Array = np.sinc(theta / np.pi) / (ratio * slope)
    return gain


def apply_chromatic_aberration(image: Float32, corner_px: float) -> Float32:
    """Scale red up and blue down by ``corner_px`` at the corners: lateral chromatic aberration."""
    height, width = image.shape[:2]
    share = corner_px / (0.5 * math.hypot(width, height))
    out = image.copy()
    for channel, scale in ((0, 1.0 + share), (2, 1.0 - share)):
        shift = _scale_about_middle(scale, width, height)
        out[..., channel] = cv2.warpAffine(
            image[..., channel], shift, (width, height), borderMode=cv2.BORDER_REPLICATE
        )
    return np.asarray(out, np.float32)


def _scale_about_middle(scale: float, width: int, height: int) -> Array:
    """Affine map of pixel indices, [2, 3]."""
    x, y = ((1.0 - scale) * 0.5 * (size - 1) for size in (width, height))
    return np.array([[scale, 0.0, x], [0.0, scale, y]])


def _disc(radius_px: float) -> Float32:
    """Uniform disc kernel that sums to 1, with an anti-aliased rim."""
    reach = math.ceil(radius_px)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float32)
    disc = np.clip(radius_px + 0.5 - np.hypot(x, y), 0.0, 1.0)
    return np.asarray(disc / disc.sum(), np.float32)


_GHOSTS = (
    (-0.35, 0.02, (0.5, 1.0, 0.6)),
    (-0.8, 0.05, (1.0, 0.5, 0.5)),
    (0.5, 0.03, (0.5, 0.6, 1.0)),
)
"""Ghosts: position of the spot scaled about the image's centre, radius over width, tint."""


def add_flare(image: Float32, share: float, white: float) -> Float32:
    """Add ghosts of light far beyond white, on a line through the centre of the image.

    ``share`` of the light beyond ``white``, which saturates the sensor, returns as ghosts.
    """
    beyond = np.maximum(image - 4.0 * white, 0.0)
    if not beyond.any():
        return image
    height, width = image.shape[:2]
    out = image.copy()
    for place, radius, tint in _GHOSTS:
        shift = _scale_about_middle(place, width, height)
        # Shrinking averages the light of the pixels that it merges.
        ghost = cv2.warpAffine(beyond, shift, (width, height), flags=cv2.INTER_AREA)
        ghost = _gaussian(ghost, radius * width)
        out += share * place * place * ghost * np.asarray(tint, np.float32)
    return np.asarray(out, np.float32)


def _gaussian(image: Float32, sigma_px: float) -> Float32:
    """Blur an image by a wide Gaussian at reduced resolution, which suffices for smooth images."""
    halvings = max(0, int(math.log2(max(sigma_px, 1.0) / 2.0)))
    small = image
    for _ in range(halvings):
        small = cv2.resize(small, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), sigma_px / 2**halvings, borderType=cv2.BORDER_REPLICATE)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_LINEAR), np.float32)
