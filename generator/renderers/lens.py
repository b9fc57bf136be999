"""What the lens adds: drops on its glass, and the glare of bright lights."""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from generator.core.geometry import Float32
from generator.core.scene import Camera, Weather
from generator.core.se3 import Array
from generator.core.streams import Streams
from generator.renderers.kernels import particles, records
from generator.renderers.precipitation import poisson
from generator.renderers.stock import AssetStock

# Radii of drops over the image's width.
_DROP_RADII = (0.004, 0.022)
_DROPS_MAX = 400
# Shares of glare by halving of the image: a narrow core and a wide veil, after the
# eye's and camera's point spread that falls with the square of the angle.
_GLARE_LEVELS = (2, 4, 6)
GLARE_FACTOR = 2 ** _GLARE_LEVELS[0]


def wet_lens(
    weather: Weather, camera: Camera, view: records.View, radiance: wp.array, stock: AssetStock
) -> None:
    """Drops on the lens, in place; nothing where there are none."""
    drops = lens_drops(weather, camera)
    if not len(drops):
        return
    image = radiance.numpy().reshape(view.height, view.width, 3)
    small = _spread(_halved(image, 3))
    inputs = [
        view.width,
        view.height,
        wp.array(drops, dtype=wp.vec4, device=stock.device),
        wp.array(small, dtype=wp.vec3, device=stock.device),
    ]
    n = view.width * view.height
    wp.launch(particles.refract_in_drops, n, inputs, [radiance], device=stock.device)


def lens_drops(weather: Weather, camera: Camera) -> Array:
    """Drops as (x, y, radius) [px] and a shape's seed, shape [n, 4]; Poisson in number."""
    k = camera.intrinsics
    if weather.lens_drops <= 0.0:
        return np.zeros((0, 4))
    rng = Streams(seed=weather.seed, scene=0).rng(f"lens {camera.name}")
    low, high = (share * k.width_px for share in _DROP_RADII)
    # Radii are log-uniform: the mean of their squares in closed form.
    area = math.pi * 0.9 * (high**2 - low**2) / (2.0 * math.log(high / low))
    share = min(weather.lens_drops, 0.6)
    expected = -math.log(1.0 - share) * k.width_px * k.height_px / area
    n = min(poisson(expected, rng), _DROPS_MAX)
    u = rng.random((4, n))
    radius = low * (high / low) ** u[2]
    return np.stack([u[0] * k.width_px, u[1] * k.height_px, radius, np.floor(1e4 * u[3])], axis=-1)


def add_glare(view: records.View, share: float, radiance: wp.array, stock: AssetStock) -> None:
    """Scatter a share of all light around its source, in place; the total stays as it is."""
    if share <= 0.0:
        return
    image = radiance.numpy().reshape(view.height, view.width, 3)
    veil = wp.array(glare(image), dtype=wp.vec3, device=stock.device)
    inputs = [veil, GLARE_FACTOR, view.width, 1.0 / len(_GLARE_LEVELS), share]
    n = view.width * view.height
    wp.launch(particles.mix_coarse, n, inputs, [radiance], device=stock.device)


def glare(image: Float32) -> Float32:
    """The image as scattered light: the sum of several blurs, each as bright as the image.

    It is coarser than the image by ``GLARE_FACTOR`` in both directions.
    """
    levels, blurs = _GLARE_LEVELS, []
    for level, before in zip(levels, (0, *levels), strict=False):
        image = _halved(image, level - before)
        blurs.append(_spread(_spread(image)))
    # From coarse to fine, so that only the sum is enlarged further.
    total = blurs[-1]
    for k in range(len(levels) - 2, -1, -1):
        rows, columns = blurs[k].shape[:2]
        total = blurs[k] + _enlarged(total, rows, columns, 2 ** (levels[k + 1] - levels[k]))
    return total


def _halved(image: Float32, times: int) -> Float32:
    """Means over squares of ``2 ** times`` pixels; the image is continued by its edges."""
    for _ in range(times):
        image = np.pad(image, ((0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)), "edge")
        rows = image[0::2] + image[1::2]
        image = np.float32(0.25) * (rows[:, 0::2] + rows[:, 1::2])
    return image


def _spread(image: Float32) -> Float32:
    """A [1 2 1] / 4 blur in both directions, continued by the edges."""
    for axis in (0, 1):
        n = image.shape[axis]
        at = np.arange(n)
        before = image.take(np.maximum(at - 1, 0), axis)
        after = image.take(np.minimum(at + 1, n - 1), axis)
        image = np.float32(0.5) * image + np.float32(0.25) * (before + after)
    return image


def _enlarged(image: Float32, height: int, width: int, factor: int) -> Float32:
    """Bilinear, so that pixel centres stay where they were."""
    for axis, size in ((0, height), (1, width)):
        n = image.shape[axis]
        place = np.clip((np.arange(size) + 0.5) / factor - 0.5, 0.0, n - 1.0)
        first = np.minimum(place.astype(np.int64), max(n - 2, 0))
        part = (place - first).astype(np.float32)
        part = part[:, None, None] if axis == 0 else part[None, :, None]
        after = np.minimum(first + 1, n - 1)
        image = image.take(first, axis) * (1 - part) + image.take(after, axis) * part
    return image
