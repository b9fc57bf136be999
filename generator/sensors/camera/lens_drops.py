"""Water drops on the lens, each with a small, inverted, blurred image of the scene."""

import math

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, scene, streams
from gen_data.core.se3 import Array
from gen_data.sensors.camera.optics import blur, halve

_RADII = (0.004, 0.022)
"""Smallest and largest radius of drops over the image's width."""
_COUNT_MAX = 400
_REACH = 1.4
"""Largest extent of a drop's irregular outline over its radius."""
_HALVINGS = 3


def lens_drops(weather: scene.Weather, camera: scene.Camera) -> Array:
    """Drops as (x, y, radius) [px] and seed of the shape, [n, 4]; their number is Poisson."""
    k = camera.intrinsics
    if weather.lens_drops <= 0.0:
        return np.zeros((0, 4))
    rng = streams.Streams(seed=weather.seed, scene=0).rng(f"lens {camera.name}")
    low, high = (share * k.width_px for share in _RADII)
    # Expected area of a drop: radii are log-uniform, so the mean square has a closed form.
    area = math.pi * 0.9 * (high**2 - low**2) / (2.0 * math.log(high / low))
    share = min(weather.lens_drops, 0.6)
    expected = -math.log(1.0 - share) * k.width_px * k.height_px / area
    n = min(int(rng.poisson(expected)), _COUNT_MAX)
    u = rng.random((4, n))
    radius = low * (high / low) ** u[2]
    return np.stack([u[0] * k.width_px, u[1] * k.height_px, radius, np.floor(1e4 * u[3])], axis=-1)


def refract_in_drops(image: asset_types.Float32, drops: Array) -> asset_types.Float32:
    """Draw drops over a linear image in order, float32 [h, w, 3]; drops as of ``lens_drops``."""
    height, width = image.shape[:2]
    small = blur(halve(image, _HALVINGS))
    out: asset_types.Float32 = image.copy()
    for x_px, y_px, radius_px, seed in drops:
        rows = _span(y_px, radius_px, height)
        columns = _span(x_px, radius_px, width)
        x = ((columns + 0.5 - x_px) / radius_px)[None, :]
        y = ((rows + 0.5 - y_px) / radius_px)[:, None]
        # Irregular outlines, elongated vertically because drops hang (0.8).
        wobble = 1.0 + 0.22 * _value_noise(1.3 * x + 7.0, 1.3 * y + 7.0, int(seed))
        off = np.sqrt(x * x + 0.8 * y * y) * wobble
        cover = _smoothstep(1.0, 0.78, off)
        # A drop acts as a wide-angle lens of about 90 degrees, stronger towards its rim.
        bend = 0.30 + 0.12 * off * off
        u = 0.5 + 0.5 * (x_px / width - 0.5) - bend * x
        v = 0.5 + 0.5 * (y_px / height - 0.5) - bend * y
        rim = 1.0 - 0.55 * _smoothstep(0.55, 1.0, off)
        inside = _bilinear_at(small, u, v) * rim[..., None]
        place = np.ix_(rows, columns)
        out[place] += (cover[..., None] * (inside - out[place])).astype(np.float32)
    return out


def _span(center_px: float, radius_px: float, size: int) -> NDArray[np.int64]:
    """Rows or columns of the image that a drop may cover."""
    first = math.floor(center_px - _REACH * radius_px)
    end = math.ceil(center_px + _REACH * radius_px)
    return np.arange(max(first, 0), min(end, size))


def _bilinear_at(image: asset_types.Float32, u: Array, v: Array) -> Array:
    """Bilinear samples of an image at coordinates in [0, 1] x [0, 1], [..., 3]."""
    height, width = image.shape[:2]
    x, y = np.clip(u, 0.0, 1.0) * (width - 1), np.clip(v, 0.0, 1.0) * (height - 1)
    i = np.clip(y.astype(np.int64), 0, max(height - 2, 0))
    j = np.clip(x.astype(np.int64), 0, max(width - 2, 0))
    below, right = np.minimum(i + 1, height - 1), np.minimum(j + 1, width - 1)
    fu, fv = (x - j)[..., None], (y - i)[..., None]
    top = image[i, j] * (1.0 - fu) + image[i, right] * fu
    bottom = image[below, j] * (1.0 - fu) + image[below, right] * fu
    return np.asarray(top * (1.0 - fv) + bottom * fv)


def _smoothstep(low: float, high: float, x: Array) -> Array:
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _value_noise(x: Array, y: Array, seed: int) -> Array:
    """Smooth noise with one lump per unit, in [-1, 1]; shapes are broadcast."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = _smoothstep(0.0, 1.0, x - i), _smoothstep(0.0, 1.0, y - j)
    low = _hash(i, j, seed) * (1.0 - u) + _hash(i + 1, j, seed) * u
    high = _hash(i, j + 1, seed) * (1.0 - u) + _hash(i + 1, j + 1, seed) * u
    return np.asarray(2.0 * (low * (1.0 - v) + high * v) - 1.0)


def _hash(x: NDArray[np.int64], y: NDArray[np.int64], seed: int) -> Array:
    """A hash in [0, 1) of lattice coordinates.

    Source: Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 2020 (pcg).
    """
    key = x.astype(np.uint32) * np.uint32(1664525) + y.astype(np.uint32) * np.uint32(1013904223)
    state = (key + np.uint32(seed)) * np.uint32(747796405) + np.uint32(1442695041)
    word = ((state >> ((state >> np.uint32(28)) + np.uint32(4))) ^ state) * np.uint32(277803737)
    word = (word >> np.uint32(22)) ^ word
    return np.asarray((word >> np.uint32(8)) / 16777216.0)
