"""PNG files of binary masks: 8-bit grey, 255 inside and 0 outside.

A mask is a few long runs of equal bytes, which general compressors still read byte by byte. Here
each run becomes a literal and copies of it: the cost grows with the runs. Sources: Deutsch,
RFC 1951, 1996, sections 3.2.5 (lengths) and 3.2.6 (fixed Huffman codes), and RFC 1950.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.sample import MaskPx
from gen_data.exporters.png import assemble_png

INSIDE = 255

_LONGEST = 258
"""Longest copy of RFC 1951."""
_SHORTEST = 3
_TOKEN_BITS = 20
"""No token has more bits: a length code of 8, extra bits of 5, a distance code of 5."""

_LENGTH_EXTRA_BITS = (0,) * 8 + (1,) * 4 + (2,) * 4 + (3,) * 4 + (4,) * 4 + (5,) * 4
"""Extra bits of the length codes 257 to 284."""

_ADLER_MODULUS = 65521

_ZLIB_HEADER = b"\x78\x01"

Bits = str
"""Bits in the order of the stream."""


def encode_mask(mask: MaskPx | None, height_px: int, width_px: int) -> bytes:
    """Encode a mask, which must lie inside the image, as a PNG file; None is an empty mask."""
    # Each row begins with the number of its filter: 0, which continues a run of zeros.
    stride = 1 + width_px
    size = height_px * stride
    borders, checksum = np.zeros(0, np.int64), adler32_of_runs(np.zeros(0, np.int64), size)
    if mask is not None and mask.pixels.any():
        height, width = mask.pixels.shape
        lines: NDArray[np.bool_] = np.zeros((height + 1, stride), np.bool_)
        lines[:height, 1 + mask.x_px : 1 + mask.x_px + width] = mask.pixels
        # The row below the mask has the zero that ends a run in the last column.
        flat = lines.ravel()
        borders = np.flatnonzero(flat[1:] != flat[:-1]) + 1 + mask.y_px * stride
        checksum = adler32_of_runs(borders, size)
    lengths = np.diff(np.append(borders, size), prepend=0)
    lengths = lengths[: len(lengths) - (lengths[-1] == 0)]
    data = _ZLIB_HEADER + _deflate_runs(lengths) + checksum.to_bytes(4, "big")
    return assemble_png(height_px, width_px, data)


def adler32_of_runs(borders: NDArray[np.int64], size: int) -> int:
    """Adler-32 checksum of ``size`` bytes that alternate between 0 and 255 at the borders.

    Source: RFC 1950, section 8.2: sums of the bytes, and of all partial sums, modulo 65521. A byte
    with ``k`` bytes from it to the end is in ``k`` partial sums.

    Args:
        borders: Indices at which the byte changes, ascending; the first run is of zeros.
        size: Number of bytes; a last border at ``size`` ends a run of 255.
    """
    first, last = borders[0::2], borders[1::2]
    counts = last - first
    # Sum of size - i over the bytes i of each run of 255.
    partial = counts * (2 * size - first - last + 1) // 2
    low = (1 + INSIDE * int(counts.sum())) % _ADLER_MODULUS
    high = (size + INSIDE * int(partial.sum())) % _ADLER_MODULUS
    return high << 16 | low


def _deflate_runs(lengths: NDArray[np.int64]) -> bytes:
    """Deflate alternate runs of 0 and 255, zeros first, as one block of fixed Huffman codes."""
    inside = np.arange(len(lengths)) % 2
    # Above and below the mask are long runs of zeros, between its rows short ones.
    parts = [_HEADER, _long_run(int(lengths[0]), 0), _short_runs(lengths[1:-1], inside[1:-1])]
    if len(lengths) > 1:
        parts.append(_long_run(int(lengths[-1]), int(inside[-1])))
    bits = np.concatenate([*parts, np.zeros(7, np.uint8)])
    return np.packbits(bits, bitorder="little").tobytes()


_HEADER = np.array([1, 1, 0], np.uint8)
"""Bits of the last block, of fixed codes."""


def _long_run(length: int, inside: int) -> NDArray[np.uint8]:
    """Bits of one run: a literal, copies of the greatest length, and the rest."""
    table, sizes = _tokens()
    copies, rest = divmod(length - 1, _LONGEST)
    ends = [_LITERAL + inside, _REST + inside * _LONGEST + rest]
    literal, remainder = (table[row, : sizes[row]] for row in ends)
    copy = table[_COPY, : sizes[_COPY]]
    return np.concatenate([literal, np.tile(copy, copies), remainder])


def _short_runs(lengths: NDArray[np.int64], inside: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Bits of several runs, of 255 where ``inside`` is 1."""
    table, sizes = _tokens()
    copies, rest = np.divmod(lengths - 1, _LONGEST)
    first = np.cumsum(copies + 2) - (copies + 2)
    rows = np.full(int((copies + 2).sum()), _COPY)
    rows[first] = _LITERAL + inside
    rows[first + 1 + copies] = _REST + inside * _LONGEST + rest
    present = np.arange(_TOKEN_BITS) < sizes[rows, None]
    bits: NDArray[np.uint8] = table[rows][present]
    return bits


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
