"""Lens effects on linear images, float32 [h, w, 3] of any unit.

Flare consists of ghosts by reflections between the surfaces of a lens; by veiling glare, the lens
scatters a share of all light around its source. Image pyramids use only sums and products, which
all processors round alike: results do not depend on the machine.
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import intrinsics, se3
from gen_data.core.asset_types import Float32

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

    Layers of similar radius are blurred and composited from far to near: sharp foreground does not
    bleed into blurred background. After Kraus and Strengert, "Depth-of-field rendering by
    pyramidal image processing", Eurographics 2007.
    """
    signed = _signed_levels(radius_px)
    if not signed.any():
        return image
    # Colour and, last, cover.
    opaque: Float32 = cv2.merge([*cv2.split(image), np.ones(image.shape[:2], np.float32)])
    out = np.zeros_like(opaque)
    for layer in range(len(_BLUR_LEVELS) - 1, -len(_BLUR_LEVELS), -1):
        own = signed == layer
        if own.any():
            radius = _BLUR_LEVELS[abs(layer)]
            place = _surroundings(own, math.ceil(radius))
            mask = own[place].view(np.uint8)
            if radius == 0.0:
                cv2.copyTo(opaque[place], mask, out[place])
            else:
                _lay_over(out[place], _blurred_layer(opaque[place], mask, radius))
    red, green, blue, weight = cv2.split(out)
    weight = np.maximum(weight, np.float32(1e-4))
    blurred: Float32 = cv2.merge([red / weight, green / weight, blue / weight])
    return blurred


def _signed_levels(radius_px: Float32) -> NDArray[np.int8]:
    """Index of the nearest radius of ``_BLUR_LEVELS``, negative for negative radii."""
    levels = np.asarray(_BLUR_LEVELS, np.float32)
    size, level = np.abs(radius_px), np.zeros(radius_px.shape, np.int8)
    for limit in 0.5 * (levels[1:] + levels[:-1]):
        level += size > limit
    np.negative(level, out=level, where=radius_px < 0.0)
    return level


def _surroundings(mask: NDArray[np.bool_], reach_px: int) -> tuple[slice, slice]:
    """Rows and columns of the rectangle around the set pixels of a mask, grown on all sides."""
    spans = []
    for axis in (1, 0):
        used = np.flatnonzero(mask.any(axis=axis))
        spans.append(slice(max(int(used[0]) - reach_px, 0), int(used[-1]) + 1 + reach_px))
    return spans[0], spans[1]


def _blurred_layer(opaque: Float32, mask: NDArray[np.uint8], radius_px: float) -> Float32:
    """The pixels of a mask, blurred: colour times cover, and cover in [0, 1], [h, w, 4]."""
    layer = cv2.copyTo(opaque, mask)
    layer = cv2.filter2D(layer, -1, _disc(radius_px), borderType=cv2.BORDER_REPLICATE)
    np.clip(layer[..., 3], 0.0, 1.0, out=layer[..., 3])
    return np.asarray(layer, np.float32)


def _lay_over(below: Float32, layer: Float32) -> None:
    """Composite a layer [h, w, 4] over the image below it, in place."""
    clear = np.float32(1.0) - layer[..., 3]
    # Merged first, as in scale_pixels.
    below *= cv2.merge([clear, clear, clear, clear])
    below += layer


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
    return scale_pixels(image, gain.astype(np.float32, copy=False))


def scale_pixels(image: Float32, gain: Float32) -> Float32:
    """Multiply all channels of an image [h, w, 3] by one factor per pixel [h, w]."""
    # Merged first: numpy broadcasts over a last axis of three in a third of this speed.
    scaled: Float32 = cv2.merge([gain, gain, gain])
    scaled *= image
    return scaled


def scale_channels(image: Float32, gains: Float32) -> Float32:
    """Multiply each channel of an image [h, w, 3] by one factor, of [3]."""
    # As rows: numpy broadcasts over a last axis of three in a third of this speed.
    rows = image.reshape(len(image), -1) * np.tile(gains, image.shape[1])
    return np.asarray(rows.reshape(image.shape), np.float32)


def natural_falloff(camera: intrinsics.Intrinsics, pupil_power: float) -> Float32:
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


def _fisheye_gain(cosine: se3.Array, coefficients: Sequence[float]) -> se3.Array:
    """``sin(theta) / (r r')`` for Kannala and Brandt's ``r = theta + k1 theta^3 + ...``."""
    theta = np.arccos(np.clip(cosine, -1.0, 1.0))
    square = theta * theta
    ratio, slope, power = np.ones_like(theta), np.ones_like(theta), square
    for k, coefficient in enumerate(coefficients, start=1):
        ratio = ratio + coefficient * power
        slope = slope + (2 * k + 1) * coefficient * power
        power = power * square
    # sin(theta) / (r r') with r = theta * ratio; numpy's sinc(x) is sin(pi x) / (pi x).
    return np.asarray(np.sinc(theta / np.pi) / (ratio * slope))


def apply_blur(image: Float32, stddev_px: float) -> Float32:
    """Spread the light of a point over a Gaussian, as lenses and filters before the sensor do."""
    return np.asarray(cv2.GaussianBlur(image, (0, 0), stddev_px), np.float32)


def apply_chromatic_aberration(image: Float32, corner_px: float) -> Float32:
    """Scale red up and blue down by ``corner_px`` at the corners: lateral chromatic aberration."""
    height, width = image.shape[:2]
    share = corner_px / (0.5 * math.hypot(width, height))
    red, green, blue = cv2.split(image)
    red, blue = (
        cv2.warpAffine(
            channel,
            _scale_about_middle(scale, width, height),
            (width, height),
            borderMode=cv2.BORDER_REPLICATE,
        )
        for channel, scale in ((red, 1.0 + share), (blue, 1.0 - share))
    )
    return np.asarray(cv2.merge([red, green, blue]), np.float32)


def _scale_about_middle(scale: float, width: int, height: int) -> se3.Array:
    """Affine map of pixel indices, [2, 3]."""
    x, y = ((1.0 - scale) * 0.5 * (size - 1) for size in (width, height))
    return np.array([[scale, 0.0, x], [0.0, scale, y]])


def _disc(radius_px: float) -> Float32:
    """Uniform disc kernel that sums to 1, with an anti-aliased rim."""
    reach = math.ceil(radius_px)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float32)
    disc = np.clip(radius_px + 0.5 - np.hypot(x, y), 0.0, 1.0)
    return np.asarray(disc / disc.sum(), np.float32)


def smear(image: Float32, length_px: float, angle_rad: float) -> Float32:
    """Average an image over a straight path, as of a camera that turns during the exposure.

    Light beyond white keeps its energy: bright edges grow as they do in photographs.
    """
    count = max(2, math.ceil(2.0 * length_px))
    way = (np.arange(count) + 0.5) / count - 0.5
    step_x, step_y = length_px * math.cos(angle_rad), length_px * math.sin(angle_rad)
    reach = math.ceil(0.5 * length_px) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    for x, y in zip(reach + step_x * way, reach + step_y * way, strict=True):
        i, j = int(y), int(x)
        kernel[i, j] += (1.0 - y + i) * (1.0 - x + j)
        kernel[i, j + 1] += (1.0 - y + i) * (x - j)
        kernel[i + 1, j] += (y - i) * (1.0 - x + j)
        kernel[i + 1, j + 1] += (y - i) * (x - j)
    kernel /= kernel.sum()
    return np.asarray(cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REPLICATE), np.float32)


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
        ghost *= np.float32(share * place * place)
        out += scale_channels(ghost, np.asarray(tint, np.float32))
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


def halve(image: Float32, times: int) -> Float32:
    """Average squares of ``2 ** times`` pixels; edges are replicated."""
    for _ in range(times):
        rows = _sum_pairs(image, np.zeros(((len(image) + 1) // 2, *image.shape[1:]), np.float32))
        image = np.zeros((len(rows), (rows.shape[1] + 1) // 2, image.shape[2]), np.float32)
        # Channel by channel: numpy is slow on loops over three neighbours.
        for channel in range(image.shape[2]):
            _sum_pairs(rows[..., channel].T, image[..., channel].T)
        image *= np.float32(0.25)
    return image


def _sum_pairs(image: Float32, out: Float32) -> Float32:
    """Sums of pairs of rows, in ``out``; an odd last row counts twice."""
    pairs = len(image) // 2
    np.add(image[0 : 2 * pairs : 2], image[1::2], out=out[:pairs])
    if len(image) % 2:
        np.add(image[-1], image[-1], out=out[-1])
    return out


def blur(image: Float32) -> Float32:
    """Convolve with [1 2 1] / 4 in both directions; edges are replicated."""
    for axis in (0, 1):
        n = image.shape[axis]
        at = np.arange(n)
        before = image.take(np.maximum(at - 1, 0), axis)
        after = image.take(np.minimum(at + 1, n - 1), axis)
        image = np.float32(0.5) * image + np.float32(0.25) * (before + after)
    return image


def enlarge(image: Float32, height: int, width: int, factor: int) -> Float32:
    """Enlarge an image bilinearly, aligned by pixel centres, to [height, width, 3]."""
    for axis, size in ((0, height), (1, width)):
        first, after, part = bilinear(size, factor, image.shape[axis])
        part = part[:, None, None] if axis == 0 else part[None, :, None]
        image = image.take(first, axis) * (1 - part) + image.take(after, axis) * part
    return image


def bilinear(
    size: int, factor: int, coarse: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float32]:
    """Indices and weights of bilinear interpolation in a coarser image, along one axis.

    For ``size`` pixels, ``factor`` per pixel of the ``coarse`` ones: index of the coarse pixel
    before, of the one after, and weight of the latter; [size] each.
    """
    place = np.clip((np.arange(size) + 0.5) / factor - 0.5, 0.0, coarse - 1.0)
    first = np.minimum(place.astype(np.int64), max(coarse - 2, 0))
    after = np.minimum(first + 1, coarse - 1)
    return first, after, (place - first).astype(np.float32)


# Scales of the blurs, in halvings of the image: a narrow core and a wide skirt approximate the
# point spread of eyes and cameras, which falls with the square of the angle.
_LEVELS = (2, 4, 6)
FACTOR = 2 ** _LEVELS[0]
_ROWS_AT_ONCE = 32


def add_glare(image: Float32, share: float) -> Float32:
    """Scatter a share of a linear image's light, float32 [h, w, 3]; the total is preserved.

    A share of 0.02 suits a clean lens, 0.1 a dirty one. Source of the sum of blurs: Spencer et al.,
    "Physically-based glare effects for digital images", SIGGRAPH 1995.
    """
    height, width = image.shape[:2]
    coarse = scatter(image) * np.float32(share / len(_LEVELS))
    veil = _widen(coarse, width)
    first, after, part = bilinear(height, FACTOR, len(veil))
    out: Float32 = np.empty_like(image)
    # In bands that fit into the processor's cache.
    for top in range(0, height, _ROWS_AT_ONCE):
        rows = slice(top, top + _ROWS_AT_ONCE)
        weight = part[rows, None, None]
        shown = np.multiply(image[rows], np.float32(1.0 - share), out=out[rows])
        band = veil.take(first[rows], axis=0)
        band *= 1 - weight
        shown += band
        band = veil.take(after[rows], axis=0)
        band *= weight
        shown += band
    return out


def scatter(image: Float32) -> Float32:
    """Sum of blurs of an image, each of its brightness, at ``1 / FACTOR`` of its resolution."""
    blurs = []
    for level, before in zip(_LEVELS, (0, *_LEVELS), strict=False):
        image = halve(image, level - before)
        blurs.append(blur(blur(image)))
    # From coarse to fine: only the running sum is enlarged.
    total = blurs[-1]
    for k in range(len(_LEVELS) - 2, -1, -1):
        height, width = blurs[k].shape[:2]
        total = blurs[k] + enlarge(total, height, width, 2 ** (_LEVELS[k + 1] - _LEVELS[k]))
    return total


def _widen(image: Float32, width: int) -> Float32:
    """Enlarge the columns of an image by ``FACTOR`` to ``width``."""
    first, after, part = bilinear(width, FACTOR, image.shape[1])
    shape = len(image), width, 3
    # As rows, as in scale_channels.
    left, right = (image.take(at, 1).reshape(len(image), -1) for at in (first, after))
    weight = np.repeat(part, 3)
    return np.asarray(left * (1 - weight) + right * weight, np.float32).reshape(shape)
