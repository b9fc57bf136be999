"""Colours of ids in segmentation images."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

COLOR_STEP = 0x9E3779
"""Odd: multiples by different ids are different modulo 2^24; about 0.618 of it."""

_IDS = 65_536


def id_color(number: int) -> tuple[int, int, int]:
    """RGB colour of an id; different for all ids from 0 (black) to 2^24 - 1."""
    value = number * COLOR_STEP % (1 << 24)
    return (value >> 16, value >> 8 & 255, value & 255)


@cache
def id_colors() -> NDArray[np.uint8]:
    """Colours of all ids of 16 bits, RGB, uint8 [65536, 3]."""
    values = np.arange(_IDS, dtype=np.uint32) * np.uint32(COLOR_STEP)
    return np.stack([values >> 16, values >> 8, values], axis=1).astype(np.uint8)
