"""Views through windows: sky, roofs or trees, and the ground, as emitted light."""

import numpy as np

from gen_data.content.procedural.textures.texture_images import quantize
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import fbm, smoothstep
from gen_data.core.variant_rng import VariantRng

_PX = 1024
_HORIZON = 0.36
"""Height of the horizon, as a share of the image's height from below."""


def outdoor_view(rng: VariantRng) -> TextureData:
    """A panorama half as wide as the full circle: gardens, houses or a town under a sky."""
    y = ((np.arange(_PX) + 0.5) / _PX).astype(np.float32)[::-1, None]
    image = _sky(y, rng)
    for depth in range(3):
        _treeline(image, y, rng, depth)
        if rng.chance(0.75):
            _houses(image, y, rng, depth)
    _ground(image, y, rng)
    lit = np.clip(image, 0.0, 1.0)
    return TextureData(np.zeros((_PX, _PX, 3), np.uint8), emission=quantize(lit))


def _sky(y: Float32, rng: VariantRng) -> Float32:
    up = np.clip((y - _HORIZON) / (1.0 - _HORIZON), 0.0, 1.0)[..., None]
    blue = np.array([0.45, 0.66, 0.93], np.float32)
    pale = np.array([0.86, 0.92, 0.97], np.float32)
    clouds = smoothstep(-0.1, 0.5, fbm((3, 6), 5, rng, size_px=_PX) + rng.between(-0.25, 0.4))
    sky = pale * (1.0 - up) + blue * up
    made: Float32 = (sky + (0.97 - sky) * 0.85 * clouds[..., None]).astype(np.float32)
    return made


def _treeline(image: Float32, y: Float32, rng: VariantRng, depth: int) -> None:
    rough = fbm((1, 8 * (depth + 1)), 6, rng, size_px=_PX)[:1]
    top = _HORIZON + 0.05 + 0.05 * depth * rng.between(0.3, 1.0) + 0.07 * rough
    leaf = fbm((24, 24), 4, rng, size_px=_PX)[..., None]
    near = 0.55 - 0.13 * depth
    green = np.array([near * 0.75, near, near * 0.5], np.float32) * rng.between(0.7, 1.1)
    cover = smoothstep(-0.006, 0.006, top - y)[..., None]
    image[:] = image * (1.0 - cover) + cover * green * (1.0 + 0.45 * leaf)


def _houses(image: Float32, y: Float32, rng: VariantRng, depth: int) -> None:
    x = ((np.arange(_PX) + 0.5) / _PX).astype(np.float32)[None, :]
    for _ in range(int(rng.between(1, 4))):
        middle, half = rng.between(0.1, 0.9), rng.between(0.04, 0.09)
        eaves = _HORIZON + rng.between(0.08, 0.16) + 0.05 * depth
        options = [(0.86, 0.83, 0.76), (0.72, 0.46, 0.36), (0.9, 0.89, 0.86), (0.78, 0.7, 0.56)]
        wall = np.array(rng.choose(options), np.float32)
        roof = np.array(rng.choose([(0.48, 0.24, 0.18), (0.32, 0.32, 0.34), (0.4, 0.3, 0.26)]))
        beside = np.abs(x - middle)
        inside = (beside < half) & (y < eaves)
        image[inside] = wall * rng.between(0.75, 1.0)
        gable = eaves + 0.1 * (1.0 - beside / (half + 0.01))
        image[(beside < half + 0.01) & (y >= eaves) & (y < gable)] = roof
        for column in range(3):
            for row in range(2):
                u = middle + half * (column - 1) * 0.62
                v = eaves - 0.035 - 0.055 * row
                pane = (np.abs(x - u) < 0.11 * half) & (np.abs(y - v) < 0.014)
                image[pane] = (0.22, 0.26, 0.3)


def _ground(image: Float32, y: Float32, rng: VariantRng) -> None:
    lawn = np.array([0.42, 0.52, 0.28], np.float32) * rng.between(0.75, 1.1)
    paved = np.array([0.55, 0.54, 0.51], np.float32)
    base = lawn if rng.chance(0.65) else paved
    grain = fbm((48, 12), 4, rng, size_px=_PX)[..., None]
    below = (y < _HORIZON)[..., None]
    image[:] = np.where(below, base * (1.0 + 0.18 * grain), image)
