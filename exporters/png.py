"""Fast PNG encoding with the same bytes on every machine.

NumPy filters the rows and libdeflate compresses them; its output depends only on its version and
the level, never on the processor. Source: W3C, "Portable Network Graphics (PNG)
Specification (Third Edition)", 2025, sections 5 (chunks) and 9 (filters).
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Any

import deflate
import numpy as np
from numpy.typing import NDArray

UInt8 = NDArray[np.uint8]

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_GREY, _RGB, _PALETTE = 0, 2, 3


class RowFilter(IntEnum):
    """Predictor subtracted from each byte before compression; numbered as in PNG."""

    SUB = 1
    """The corresponding byte of the pixel to the left."""
    UP = 2
    """The byte above."""


def encode_png(pixels: NDArray[Any], row_filter: RowFilter, level: int) -> bytes:
    """Encode a grey or RGB image of 8 or 16 bits as a PNG file.

    Args:
        pixels: uint8 or uint16, shape [h, w] or [h, w, 3].
        row_filter: Filter of every row.
        level: libdeflate's compression level, 1 (fastest) to 12.

    Raises:
        ValueError: the pixels have another type or shape.
    """
    if pixels.dtype not in (np.uint8, np.uint16) or pixels.shape[2:] not in ((), (3,)):
        raise ValueError(f"cannot write {pixels.dtype} pixels of shape {pixels.shape} as PNG")
    height, width = pixels.shape[:2]
    data = deflate.zlib_compress(_filter_rows(pixels, row_filter), level)
    color = _RGB if pixels.ndim == 3 else _GREY
    return assemble_png(height, width, data, 8 * pixels.dtype.itemsize, color)


def assemble_png(
    height_px: int, width_px: int, data: bytes | bytearray, bit_depth: int = 8, color: int = _GREY
) -> bytes:
    """Put compressed rows into a PNG file; by default of an 8-bit grey image."""
    header = struct.pack(">IIBBBBB", width_px, height_px, bit_depth, color, 0, 0, 0)
    return b"".join(
        [SIGNATURE, *_chunk(b"IHDR", header), *_chunk(b"IDAT", data), *_chunk(b"IEND", b"")]
    )


def _filter_rows(pixels: NDArray[Any], row_filter: RowFilter) -> UInt8:
    """Filter the big-endian bytes of each row, and prepend the number of the filter."""
    big_endian = pixels.astype(pixels.dtype.newbyteorder(">"), copy=False)
    rows = np.ascontiguousarray(big_endian).reshape(pixels.shape[0], -1).view(np.uint8)
    filtered = np.zeros((rows.shape[0], 1 + rows.shape[1]), np.uint8)
    filtered[:, 0] = row_filter
    if row_filter is RowFilter.UP:
        filtered[0, 1:] = rows[0]
        np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    else:
        step = pixels.dtype.itemsize * (3 if pixels.ndim == 3 else 1)
        filtered[:, 1 : 1 + step] = rows[:, :step]
        np.subtract(rows[:, step:], rows[:, :-step], out=filtered[:, 1 + step :])
    return filtered


def _chunk(kind: bytes, data: bytes | bytearray) -> list[bytes | bytearray]:
    check = deflate.crc32(data, deflate.crc32(kind))
    return [struct.pack(">I", len(data)), kind, data, struct.pack(">I", check)]


def encode_palette_png(pixels: UInt8, colors: UInt8, level: int) -> bytes:
    """Encode an image of indices with the colours that viewers show.

    Args:
        pixels: Indices of colours, uint8 [h, w].
        colors: RGB, uint8 [n, 3], n at most 256.
        level: libdeflate's compression level, 1 (fastest) to 12.
    """
    height, width = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, _PALETTE, 0, 0, 0)
    chunks = [
        *_chunk(b"IHDR", header),
        *_chunk(b"PLTE", colors.tobytes()),
        *_chunk(b"IDAT", deflate.zlib_compress(_filter_rows(pixels, RowFilter.UP), level)),
        *_chunk(b"IEND", b""),
    ]
    return b"".join([SIGNATURE, *chunks])
