"""Colours of label images, recordings and previews; ids have the same colour in all of them."""

import colorsys
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_data

UInt8 = NDArray[np.uint8]
Rgb = tuple[int, int, int]
GOLDEN_RATIO_CONJUGATE = 0.618033988749895
"""Step around the hue circle that keeps the hues of successive ids far apart."""
UNLABELLED: Rgb = (120, 120, 120)
SURFACE_COLORS: Mapping[str, Sequence[int]] = load_data(__package__, "surface_colors")
"""SRGB colours of objects and ground without a category, by surface."""


def id_color(number: int) -> Rgb:
    """SRGB colour of an id; black for 0."""
    if number == 0:
        return (0, 0, 0)
    hue = (number * GOLDEN_RATIO_CONJUGATE) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.62 + 0.3 * (number % 2), 0.98)
    return (round(255 * red), round(255 * green), round(255 * blue))


def color_ids(ids: NDArray[np.integer]) -> UInt8:
    """Colour an id image [h, w], uint8 [h, w, 3]."""
    table = np.array([id_color(i) for i in range(int(ids.max(initial=0)) + 1)], np.uint8)
    colored: UInt8 = table[ids]
    return colored


def color_positions(position_m: NDArray[np.floating]) -> UInt8:
    """Convert positions [h, w, 3] to red, green and blue, uint8 [h, w, 3]; black = NaN."""
    seen = np.isfinite(position_m).all(axis=-1)
    colors = np.zeros(position_m.shape, np.uint8)
    if seen.any():
        low, high = np.quantile(position_m[seen], [0.01, 0.99], axis=0)
        share = (position_m[seen] - low) / np.maximum(high - low, 1e-6)
        colors[seen] = np.clip(40 + 215 * share, 40, 255).astype(np.uint8)
    return colors


@cache
def voc_palette() -> UInt8:
    """The colours of Pascal VOC's label images, RGB, uint8 [256, 3], read-only; 0 is black.

    The bits of an index, three at a time from the lowest, are the bits of red, green and blue from
    the highest (VOCdevkit, ``VOClabelcolormap.m``).
    """
    numbers = np.arange(256)
    bits = [(numbers >> (3 * k + c) & 1) << (7 - k) for c in range(3) for k in range(8)]
    channels = [np.sum(bits[8 * c : 8 * c + 8], axis=0) for c in range(3)]
    palette = np.stack(channels, axis=1).astype(np.uint8)
    palette.setflags(write=False)
    return palette
