"""A layer of clouds over a curved earth, seen from below.

The layer is a square that repeats. Pixels near the horizon average over many kilometres, so the
layer is kept as a mip chain, each level half as fine as the one before.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core import noise, streams
from gen_data.core.asset_types import Float32
from gen_data.core.variant_rng import variant_rng

Array = NDArray[np.float64]

_TILE_PX = 512
_TILE_M = 12_000.0
_HEIGHT_M = 1_400.0
_EARTH_RADIUS_M = 6.371e6
_HAZE_M = 28_000.0
"""Way through the air after which clouds have lost all but 1/e of their contrast."""
_HEAPING = 0.14
"""Clouds are as high as they are wide: low in the sky they look less flat than a layer would."""
_OCTAVES = 7
_STRIP_ROWS = 8


def cloud_layer(
    d: Array, cloudiness: float, sun_altitude_rad: float, seed: int
) -> tuple[Float32, Float32]:
    """Cloud cover and cloud brightness in each direction.

    Args:
        d: Unit directions of the upper hemisphere [rows, columns, 3], one elevation per row.
        cloudiness: Share of the sky under clouds.
        sun_altitude_rad: Altitude of a sun in the direction of +X.
        seed: Seed of the clouds.

    Returns:
        Cover in [0, 1], 0 below the horizon; brightness relative to a white cloud's in
        full light, 0 where there is none. Shape [rows, columns].
    """
    levels = _layer(cloudiness, sun_altitude_rad, seed)
    up = d[:, 0, 2]
    way_m = _way_to_layer(np.maximum(up, 0.0))
    seen = np.zeros((*d.shape[:2], 2), np.float32)
    level_of_row = _mip_levels(up, len(levels), 2 * d.shape[0])
    for k, level in enumerate(levels):
        near = np.clip(1.0 - np.abs(level_of_row - k), 0.0, 1.0)
        shown = np.flatnonzero((near > 0.0) & (up > 0.0))
        # Strip by strip: intermediate arrays stay in the processor's caches.
        for first in range(0, len(shown), _STRIP_ROWS):
            rows = shown[first : first + _STRIP_ROWS]
            flat_m = _HEIGHT_M / (up[rows, None, None] + _HEAPING)
            place = d[rows, :, :2] * (flat_m / _TILE_M)
            sample = _sample(level, place)
            sample *= near[rows, None, None].astype(np.float32)
            seen[rows] += sample
    clear = np.exp(-way_m / _HAZE_M)[:, None].astype(np.float32)
    brightness = seen[..., 1] / np.maximum(seen[..., 0], np.float32(1e-6))
    return seen[..., 0] * clear, brightness


# A sky is looked at twice: for its mean, and for its image.
@lru_cache(maxsize=2)
def _layer(cloudiness: float, sun_altitude_rad: float, seed: int) -> tuple[Float32, ...]:
    """The layer and its mip chain; read-only."""
    cover, light = _seen_from_below(cloudiness, sun_altitude_rad, variant_rng("sky", seed))
    return tuple(_mip_chain(np.stack([cover, cover * light], axis=-1)))


def _seen_from_below(
    cloudiness: float, sun_altitude_rad: float, rng: streams.Rng
) -> tuple[Float32, Float32]:
    """Cover and brightness of the layer: thin rims shine, thick middles are dark below."""
    field = _heaps(rng)
    rank = int((1.0 - min(cloudiness, 1.0)) * (field.size - 1))
    threshold = float(np.partition(field, rank, axis=None)[rank])
    depth = np.maximum(field - np.float32(threshold), np.float32(0.0))
    cover = noise.smoothstep(0.0, 0.16, depth)
    # The way of the light through the layer, towards the sun: a lower one passes more cloud.
    reach_px = min(3.0 / max(math.tan(max(sun_altitude_rad, 0.0)), 0.15), 14.0)
    passed = sum(
        (np.roll(depth, -round(reach_px * k / 2.0), axis=1) for k in range(1, 5)),
        start=np.zeros_like(depth),
    )
    sunlit = np.exp(np.float32(-1.6) * passed)
    base = np.exp(np.float32(-2.4) * depth)
    light: Float32 = np.float32(0.26) + np.float32(0.34) * base + np.float32(0.40) * sunlit
    return cover, light


def _heaps(rng: streams.Rng) -> Float32:
    """Density of clouds: large masses with billows on them, in about [-1, 1]."""
    masses = noise.fbm((3, 3), _OCTAVES, rng, 0.52, _TILE_PX, noise.quick_perlin)
    billows = np.zeros_like(masses)
    for k, cells in enumerate((12, 24, 48)):
        bumps = 1.0 - 2.0 * np.abs(noise.quick_perlin((cells, cells), rng, _TILE_PX))
        billows += np.float32(0.5**k) * bumps
    heaps: Float32 = masses + np.float32(0.22) * billows
    return heaps


def _way_to_layer(up: Array) -> Array:
    """Distance to the layer [m] along directions with that sine of elevation."""
    level = _EARTH_RADIUS_M * up
    return np.sqrt(level * level + 2.0 * _EARTH_RADIUS_M * _HEIGHT_M + _HEIGHT_M**2) - level


def _mip_levels(up: Array, levels: int, rows: int) -> Array:
    """Mip level of the layer for each row of the image."""
    flat_m = _HEIGHT_M / (np.maximum(up, 0.0) + _HEAPING)
    footprint_m = flat_m * (math.pi / rows) / (np.maximum(up, 0.0) + _HEAPING)
    return np.clip(np.log2(footprint_m / (_TILE_M / _TILE_PX)), 0.0, levels - 1.0)


def _mip_chain(layer: Float32) -> list[Float32]:
    levels = [layer]
    while levels[-1].shape[0] > 1:
        # Corner by corner: reducing over two short axes takes ten times as long.
        a, b, c, d = (levels[-1][row::2, column::2] for row in (0, 1) for column in (0, 1))
        levels.append((a + b + c + d) * np.float32(0.25))
    return levels


def _sample(layer: Float32, place: Array) -> Float32:
    """The repeating layer at places in units of its length, bilinear; its size is a power of 2."""
    size = layer.shape[0]
    position = place * size - 0.5
    floor = np.floor(position)
    part = (position - floor).astype(np.float32)
    first = floor.astype(np.int32)
    # For powers of 2, the bits under a mask are the remainder, which takes ten times as long.
    x0, x1, y0, y1 = ((first[..., k] + step) & (size - 1) for k in (0, 1) for step in (0, 1))
    cells = layer.reshape(size * size, -1)
    a, b, c, d = (cells.take(y * size + x, axis=0) for y in (y0, y1) for x in (x0, x1))
    # Repeated, since numpy is slow on broadcasts to two neighbours.
    fx, fy = (np.repeat(part[..., k : k + 1], cells.shape[1], axis=-1) for k in (0, 1))
    return _interpolate(_interpolate(a, b, fx), _interpolate(c, d, fx), fy)


def _interpolate(first: Float32, second: Float32, share: Float32) -> Float32:
    """``first + (second - first) * share``, in the memory of ``second``."""
    second -= first
    second *= share
    second += first
    return second
