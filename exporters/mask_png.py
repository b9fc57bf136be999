"""PNG files of binary masks: 8-bit grey, 255 inside and 0 outside.

A mask is a few long runs of equal bytes, which general compressors still read byte by byte. Here
each run becomes a literal and copies of it, so that the cost is that of the runs. Sources: Deutsch,
RFC 1951, 1996, sections 3.2.5 (lengths) and 3.2.6 (fixed Huffman codes), and RFC 1950.
"""

from __future__ import annotations

import zlib
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.exporters.png import assemble_png
from gen_data.generator.core.sample import MaskPx

INSIDE = 255

_LONGEST = 258
"""Longest copy of RFC 1951."""
_SHORTEST = 3
_TOKEN_BITS = 20
"""No token has more bits: a length code of 8, extra bits of 5, a distance code of 5."""

_LENGTH_EXTRA_BITS = (0,) * 8 + (1,) * 4 + (2,) * 4 + (3,) * 4 + (4,) * 4 + (5,) * 4
"""Extra bits of the length codes 257 to 284."""

_ZLIB_HEADER = b"\x78\x01"

Bits = str
"""Bits in the order of the stream."""


def encode_mask(mask: MaskPx | None, height_px: int, width_px: int) -> bytes:
    """Encode a mask, which must lie inside the image, as a PNG file; None is an empty mask."""
    # Each row begins with the number of its filter: 0, which continues a run of zeros.
    rows: NDArray[np.uint8] = np.zeros((height_px, 1 + width_px), np.uint8)
    borders = np.zeros(0, np.int64)
    if mask is not None and mask.pixels.size:
        height, width = mask.pixels.shape
        left, lines = 1 + mask.x_px, rows[mask.y_px : mask.y_px + height]
        np.multiply(mask.pixels, INSIDE, out=lines[:, left : left + width], dtype=np.uint8)
        # The row after the last one may be part of the run of zeros that a border ends.
        flat = rows[mask.y_px : mask.y_px + height + 1].ravel()
        borders = np.flatnonzero(flat[1:] != flat[:-1]) + 1 + mask.y_px * (1 + width_px)
    ends = np.append(borders, rows.size)
    lengths = np.diff(ends, prepend=0)
    data = _ZLIB_HEADER + _deflate_runs(lengths) + zlib.adler32(rows.data).to_bytes(4, "big")
    return assemble_png(height_px, width_px, data)


def _deflate_runs(lengths: NDArray[np.int64]) -> bytes:
    """Deflate alternate runs of 0 and 255, zeros first, as one block of fixed Huffman codes."""
    table, sizes = _tokens()
    copies, rest = np.divmod(lengths - 1, _LONGEST)
    inside = np.arange(len(lengths)) % 2
    first = np.cumsum(copies + 2) - (copies + 2)
    # Per run: the literal, copies of the greatest length, and one token for the rest.
    rows = np.full(int((copies + 2).sum()), _COPY)
    rows[first] = _LITERAL + inside
    rows[first + 1 + copies] = _REST + inside * _LONGEST + rest
    present = np.arange(_TOKEN_BITS) < sizes[rows, None]
    bits = np.concatenate([[1, 1, 0], table[rows][present], np.zeros(7, np.uint8)])
    return np.packbits(bits.astype(np.uint8), bitorder="little").tobytes()


_COPY, _LITERAL, _REST = 0, 1, 3
"""Rows of the tokens: the longest copy; two literals; the rest of a run, by value and length."""


@cache
def _tokens() -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Bits of every token [n, 20], and their number [n]."""
    tokens = [_copy(_LONGEST), _literal(0), _literal(INSIDE)]
    for value in (0, INSIDE):
        tokens += [_literal(value) * k for k in range(_SHORTEST)]
        tokens += [_copy(k) for k in range(_SHORTEST, _LONGEST)]
    table: NDArray[np.uint8] = np.zeros((len(tokens), _TOKEN_BITS), np.uint8)
    for row, token in zip(table, tokens, strict=True):
        row[: len(token)] = [int(bit) for bit in token]
    return table, np.array([len(token) for token in tokens])


def _literal(value: int) -> Bits:
    """Fixed code of a byte."""
    return f"{0x30 + value:08b}" if value < 144 else f"{0x190 + value - 144:09b}"


def _copy(length: int) -> Bits:
    """Fixed codes of a copy from one byte before: length, its extra bits, and the distance."""
    if length == _LONGEST:
        return _length_code(285) + "00000"
    base = _SHORTEST
    for code, extra in enumerate(_LENGTH_EXTRA_BITS, 257):
        if length < base + (1 << extra):
            # Extra bits come with the lowest bit first, codes with the highest.
            low_first = f"{length - base:0{extra}b}"[::-1] if extra else ""
            return _length_code(code) + low_first + "00000"
        base += 1 << extra
    raise ValueError(f"a copy has 3 to 258 bytes, not {length}")


def _length_code(code: int) -> Bits:
    return f"{code - 256:07b}" if code < 280 else f"{0xC0 + code - 280:08b}"
