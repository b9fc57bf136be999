"""Colours of label images."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

UInt8 = NDArray[np.uint8]


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
