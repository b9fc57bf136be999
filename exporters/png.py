"""Fast PNG encoding with the same bytes on every machine.

NumPy filters the rows and libdeflate compresses them; its output depends only on its version and
the level, never on the processor. Source: W3C, "Portable Network Graphics (PNG)
Specification (Third Edition)", 2025, sections 5 (chunks) and 9 (filters).
"""

import struct
from collections.abc import Sequence
from enum import IntEnum
from itertools import pairwise
from typing import Any

import deflate
import numpy as np
from numpy.typing import NDArray

UInt8 = NDArray[np.uint8]

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, RGB, _PALETTE = 0, 2, 3
"""Colour types of PNG."""
Chunk = Sequence[bytes | bytearray]


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
    color = RGB if pixels.ndim == 3 else GREY
    return assemble_png(height, width, data, 8 * pixels.dtype.itemsize, color)


def assemble_png(
    height_px: int, width_px: int, data: bytes | bytearray, bit_depth: int = 8, color: int = GREY
) -> bytes:
    """Put compressed rows into a PNG file; by default of an 8-bit grey image."""
    return _assemble(width_px, height_px, bit_depth, color, data)


def assemble_palette_png(
    height_px: int, width_px: int, data: bytes | bytearray, colors: UInt8
) -> bytes:
    """Put compressed rows of indices into a PNG file with the colours [n, 3] that viewers show."""
    return _assemble(width_px, height_px, 8, _PALETTE, data, _chunk(b"PLTE", colors.tobytes()))


def _assemble(
    width: int, height: int, bit_depth: int, color: int, data: bytes | bytearray, extra: Chunk = ()
) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bit_depth, color, 0, 0, 0)
    chunks = [*_chunk(b"IHDR", header), *extra, *_chunk(b"IDAT", data), *_chunk(b"IEND", b"")]
    return b"".join([SIGNATURE, *chunks])


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


def decode_png(data: bytes, is_bgr: bool = False) -> NDArray[Any] | None:
    """Decode a file of ``encode_png``, several times as fast as general decoders.

    Args:
        data: Bytes of the file.
        is_bgr: Return colours in OpenCV's order.

    Returns:
        Pixels, uint8 or uint16, shape [h, w] or [h, w, 3]; None for a PNG of other writers, and
        for a damaged one, whose error a general decoder reports.
    """
    if len(data) < _PIXELS_START + 16 or data[:8] != SIGNATURE or data[37:41] != b"IDAT":
        return None
    width, height, bit_depth, color, *others = struct.unpack_from(">IIBBBBB", data, 16)
    end = _PIXELS_START + int.from_bytes(data[33:37], "big")
    ends_as_ours = len(data) == end + 16 and data[end + 8 : end + 12] == b"IEND"
    is_known = bit_depth in (8, 16) and color in (GREY, RGB) and others == [0, 0, 0]
    checks = deflate.crc32(data[12:29]) == int.from_bytes(data[29:33], "big")
    if not (is_known and ends_as_ours and checks) or height * width == 0:
        return None
    packed = memoryview(data)[_PIXELS_START:end]
    if deflate.crc32(data[37:end]) != int.from_bytes(data[end : end + 4], "big"):
        return None
    step = bit_depth // 8 * (3 if color == RGB else 1)
    try:
        rows = deflate.zlib_decompress(packed, height * (1 + width * step))
    except deflate.DeflateError:
        return None
    if len(rows) != height * (1 + width * step):
        return None
    return _unfilter(np.frombuffer(rows, np.uint8).reshape(height, -1), step, bit_depth, is_bgr)


_PIXELS_START = 41
"""Position of the compressed rows: after the signature, IHDR, and the length and kind of IDAT."""


def _unfilter(rows: UInt8, step: int, bit_depth: int, is_bgr: bool) -> NDArray[Any] | None:
    """Undo the filter of rows with ``step`` bytes per pixel; None if it is not the same for all."""
    kind = int(rows[0, 0])
    if kind not in tuple(RowFilter) or (rows[:, 0] != kind).any():
        return None
    height, width = rows.shape[0], (rows.shape[1] - 1) // step
    depth = bit_depth // 8
    filtered = rows[:, 1:].reshape(height, width, step // depth, depth)
    values: UInt8 = np.zeros(filtered.shape, np.uint8)
    ordered = values[:, :, ::-1] if is_bgr else values
    if kind == RowFilter.UP:
        ordered[:] = filtered
        _sum_lines(values.reshape(height, -1))
    else:
        np.add.accumulate(filtered, axis=1, out=ordered)
    shape = (height, width) if step == depth else (height, width, 3)
    if depth == 2:
        return values.view(">u2").reshape(shape).astype(np.uint16)
    return values.reshape(shape)


def _sum_lines(lines: UInt8) -> UInt8:
    """Add to each line the one before it, in place; several times as fast as ``accumulate``."""
    for before, line in pairwise(lines):
        np.add(before, line, out=line)
    return lines
