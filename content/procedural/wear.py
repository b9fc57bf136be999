"""Traces of use, one home for all families: how worn a variant is, and films on its surface.

A film is a share of coverage per pixel (uint8, 255 = all) and one colour. The functions here make
shares; ``lay_films`` lays them over an image. They work on bytes: a variant costs a few
milliseconds, and every processor makes the same.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gen_data.core.asset_types import Float32, UInt8
from gen_data.core.noise import SIZE_PX
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

# Exponent on a uniform draw: half of all variants are worn by less than 0.29, a tenth by more
# than 0.83 (assumed: most household objects are used a little).
_SKEW = 1.8
# Relative increase of roughness of a worn-out surface over a new one (assumed, within a half).
_DULLING = 0.8
COARSE, MEDIUM, FINE = 6, 24, 64
"""Cells of noise per image."""
Size = tuple[int, int]


class Film(NamedTuple):
    """Deposit on a surface: a share per pixel, uint8, and its colour, sRGB in [0, 1]."""

    share: UInt8
    color: Vec3


def draw_wear(name: str, seed: int) -> float:
    """Wear of a variant, from 0 (new) to 1 (well used); a separate stream for each name."""
    return skewed(float(variant_rng(f"{name}/wear", seed).random()))


def skewed(quantile: float) -> float:
    """Wear that a share ``quantile`` of all objects do not exceed."""
    return float(quantile**_SKEW)


def dulled(roughness: float, wear: float) -> float:
    """Roughness of the worn places of a surface; its texture's factor keeps the others."""
    return min(1.0, roughness * (1.0 + _DULLING * wear))


def roughness_factor(dull: UInt8, wear: float) -> UInt8:
    """The roughness map of a texture: 1 where all is dull, as new where nothing is."""
    clean = 1.0 / (1.0 + _DULLING * wear)
    steps = 255.0 * (clean + (1.0 - clean) * np.arange(256) / 255.0)
    return look_up(dull, np.round(steps).astype(np.uint8))


def noise_bytes(cells: int, size_px: Size, rng: VariantRng) -> UInt8:
    """Smooth noise, most of it within 50 to 205 about a mean of 128, that repeats.

    Every image is a part of the same page, shifted at random.
    """
    height, width = size_px
    down, across = (int(share * SIZE_PX) for share in rng.random(2).tolist())
    return _noise_page(cells)[down : down + height, across : across + width]


@lru_cache(maxsize=8)
def _noise_page(cells: int) -> UInt8:
    """Two octaves of random bytes, resized; two repeats down and two across."""
    from PIL.Image import Resampling, blend, fromarray

    rng, octaves = variant_rng("wear/noise", cells), []
    for count in (cells, 2 * cells):
        lattice = np.pad((rng.random((count, count)) * 256.0).astype(np.uint8), 2, mode="wrap")
        box = (2.0, 2.0, 2.0 + count, 2.0 + count)
        octaves.append(fromarray(lattice).resize((SIZE_PX, SIZE_PX), Resampling.BICUBIC, box))
    page = np.tile(np.array(blend(octaves[0], octaves[1], 0.35), dtype=np.uint8), (2, 2))
    page.flags.writeable = False
    return page


def ramp_bytes(noise: UInt8, low: float, high: float, most: float = 1.0) -> UInt8:
    """Bytes below ``low`` as 0, above ``high`` as ``most`` of 255, both in [0, 1] of 255."""
    return look_up(noise, _levels(low, high, most))


def scratches(count: int, length_px: float, size_px: Size, rng: VariantRng, lean: float) -> UInt8:
    """Fine straight strokes of varied strength.

    Args:
        count: Number of strokes.
        length_px: Length of the longest.
        size_px: Height and width of the image.
        rng: Draws their positions.
        lean: Spread of their directions about a drawn one, as a share of a half turn; 1 = any.
    """
    from PIL.Image import new
    from PIL.ImageDraw import Draw

    height, width = size_px
    image = new("L", (width, height))
    pen, main = Draw(image), rng.between(0.0, math.pi)
    for x, y, turn, reach, depth in rng.random((count, 5)).tolist():
        angle, far = main + lean * math.pi * (turn - 0.5), 0.5 * length_px * reach**2
        dx, dy = far * math.cos(angle), far * math.sin(angle)
        ends = [x * width - dx, y * height - dy, x * width + dx, y * height + dy]
        pen.line([round(t) for t in ends], fill=int(60 + 195 * depth))
    return np.asarray(image, dtype=np.uint8)


def dust_share(upward: Float32, amount: float) -> Float32:
    """Share of a surface that dust covers.

    Falling particles land in proportion to the level area below them: the cosine.

    Args:
        upward: Upward component of unit normals, any shape.
        amount: Share on level ground, in [0, 1].
    """
    share: Float32 = np.float32(amount) * np.maximum(upward, np.float32(0.0))
    return share


def to_bytes(share: Float32) -> UInt8:
    """Shares in [0, 1] as bytes."""
    scaled: UInt8 = np.clip(share * np.float32(255.0) + np.float32(0.5), 0.0, 255.0).astype(
        np.uint8
    )
    return scaled


def lay_films(albedo: UInt8, films: Sequence[Film]) -> UInt8:
    """An sRGB image [height, width, 3] under films, the last one on top."""
    import cv2

    image = albedo
    for share, color in films:
        if not share.any():
            continue
        shares = cv2.merge([share] * 3)
        levels = np.stack([_levels(0.0, 1.0, part) for part in color], axis=1)
        kept = cv2.multiply(image, cv2.bitwise_not(shares), scale=1.0 / 255.0)
        image = cv2.add(kept, look_up(shares, levels[None]))
    return np.asarray(image, dtype=np.uint8)


def look_up(image: UInt8, levels: UInt8) -> UInt8:
    """Each byte's entry of a table of 256, or of one table per channel, shape [1, 256, 3]."""
    import cv2

    return np.asarray(cv2.LUT(image, levels), dtype=np.uint8)


def _levels(low: float, high: float, most: float) -> UInt8:
    """A byte for each byte: 0 below ``low``, rising to ``most`` of 255 at ``high``."""
    steps = np.clip((np.arange(256) / 255.0 - low) / (high - low), 0.0, 1.0)
    levels: UInt8 = np.round(255.0 * most * steps).astype(np.uint8)
    return levels
