"""Abstract patterns for domain randomization."""

import math

import numpy as np

from gen_data.content.procedural.textures.texture_images import mix_colors, ramp, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, rows_and_columns, smoothstep, uniform, worley
from gen_data.core.variant_rng import VariantRng


def checker(rng: VariantRng) -> TextureData:
    """Two-coloured squares; any scale."""
    count = 2 * rng.choose((1, 2, 3, 4, 6, 8))
    y, x = rows_and_columns()
    odd = (np.floor(y * count) + np.floor(x * count)) % 2
    first, second = _contrast(rng)
    return texture(mix_colors(np.broadcast_to(first, (SIZE_PX, SIZE_PX, 3)), second, odd))


def stripes(rng: VariantRng) -> TextureData:
    """Straight stripes of two to four colours, upright, level or diagonal; any scale."""
    y, x = rows_and_columns()
    down, across = rng.choose(((0, 1), (1, 0), (1, 1), (-1, 1)))
    position = rng.choose((2, 3, 4, 6, 9)) * (down * y + across * x)
    position = position - np.floor(position)
    colors = [_vivid(rng) for _ in range(rng.choose((2, 2, 3, 4)))]
    edges = np.cumsum(0.3 + uniform(len(colors), rng))
    band = np.searchsorted(edges[:-1] / edges[-1], position, side="right")
    return texture(np.stack(colors)[band])


def perlin_noise(rng: VariantRng) -> TextureData:
    """Colourful clouds; any scale."""
    cells = rng.choose((2, 3, 5, 8, 12))
    field = fbm((cells, cells), rng.choose((1, 3, 6)), rng)
    field = 0.5 + 0.5 * np.clip(field / (2.2 * field.std()), -1, 1)
    count = rng.choose((2, 3, 4))
    return texture(ramp([(i / (count - 1), _vivid(rng)) for i in range(count)], field))


def voronoi_noise(rng: VariantRng) -> TextureData:
    """Cells of random colours, some with borders; any scale."""
    cells = rng.choose((4, 6, 9, 14, 22))
    points = worley((cells, cells), rng)
    palette = np.stack([_vivid(rng) for _ in range(rng.choose((3, 5, 8)))])
    which = (uniform(points.count, rng) * len(palette)).astype(np.int64)
    albedo = points.of_each(palette[which].astype(np.float64))
    shade = rng.choose((0.0, 0.4)) * points.nearest
    border = rng.choose((0.0, 0.0, 1.0)) * smoothstep(0.1, 0.03, points.second - points.nearest)
    return texture(mix_colors(albedo * (1 - shade)[..., None], _vivid(rng), border))


def _vivid(rng: VariantRng) -> Float32:
    """A colour that is even over hue, from grey to saturated and from dark to light."""
    hue = 6.0 * float(rng.random())
    saturation, value = rng.between(0.1, 1.0), rng.between(0.12, 0.97)
    channels = [
        value * (1 - saturation * min(max(abs(math.remainder(hue - shift, 6.0)) - 1.0, 0.0), 1.0))
        for shift in (0.0, 2.0, 4.0)
    ]
    return np.array(channels, dtype=np.float32)


def _contrast(rng: VariantRng) -> tuple[Float32, Float32]:
    """Two colours whose brightness differs."""
    first = _vivid(rng)
    second = _vivid(rng)
    if abs(float(first.mean() - second.mean())) < 0.25:
        dark, light = np.float32(0.15), np.float32(0.9)
        second = second * dark if float(first.mean()) > 0.5 else 1 - (1 - second) * (1 - light)
    return first, second.astype(np.float32)
