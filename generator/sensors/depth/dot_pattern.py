"""Pattern of a dot projector: fixed to the projector, and the same for all devices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.asset_types import Float32

UInt32 = NDArray[np.uint32]


class Dots(Strict):
    """One dot at a random position in each cell of a grid.

    Attributes:
        pitch_mrad: Pitch of the grid in the middle of the field.
        dot_mrad: Standard deviation of a dot's profile.
    """

    pitch_mrad: float = Field(20.0, gt=0.1, le=500)
    dot_mrad: float = Field(2.0, gt=0.05, le=100)

    def at(self, x: Float32, y: Float32) -> Float32:
        """Intensity of the pattern over its mean, float32 of the shape of ``x``.

        ``x`` and ``y`` are tangents of directions from the projector, to the right and downwards.
        """
        pitch, sigma = 1e-3 * self.pitch_mrad, 1e-3 * self.dot_mrad
        u, v = x / np.float32(pitch), y / np.float32(pitch)
        column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
        falloff = np.float32(0.5 * (pitch / sigma) ** 2)
        total = np.zeros(u.shape, np.float32)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                du, dv = _dot_offset(column + right, row + down)
                away2 = (u - (column + right) - du) ** 2 + (v - (row + down) - dv) ** 2
                total += np.exp(-falloff * away2.astype(np.float32))
        return np.asarray(total * np.float32(falloff / np.pi), np.float32)


def _dot_offset(column: NDArray[np.int64], row: NDArray[np.int64]) -> tuple[Float32, Float32]:
    """Position of the dot in its cell, [0, 1) each."""
    cell: UInt32 = (column & 0xFFFF).astype(np.uint32) | (
        (row & 0xFFFF).astype(np.uint32) << np.uint32(16)
    )
    bits = _hash(cell)
    return _to_unit(bits & np.uint32(0xFFFF)), _to_unit(bits >> np.uint32(16))


def _hash(x: UInt32) -> UInt32:
    """A hash of 32 bits: ``lowbias32`` of Wellons, "Prospecting for hash functions", 2018."""
    x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
    x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
    mixed: UInt32 = x ^ (x >> np.uint32(16))
    return mixed


def _to_unit(bits: NDArray[Any]) -> Float32:
    return np.asarray(bits.astype(np.float32) / np.float32(65536.0), np.float32)
