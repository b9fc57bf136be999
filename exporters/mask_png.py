"""PNG files of binary masks: 8-bit grey, 255 inside and 0 outside.

A mask is a few long runs of equal bytes, which general compressors still read byte by byte. Here
each run becomes a literal and copies of it: the cost grows with the runs. Sources: Deutsch,
RFC 1951, 1996, sections 3.2.5 (lengths) and 3.2.6 (fixed Huffman codes), and RFC 1950.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.sample import MaskPx
from gen_data.exporters import label_png
from gen_data.exporters.png import assemble_png

INSIDE = 255

Int64 = NDArray[np.int64]


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
    data = label_png.ZLIB_HEADER + _deflate_runs(lengths) + checksum.to_bytes(4, "big")
    return assemble_png(height_px, width_px, data)


def adler32_of_runs(borders: Int64, size: int) -> int:
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
    low = (1 + INSIDE * int(counts.sum())) % label_png.ADLER_BASE
    high = (size + INSIDE * int(partial.sum())) % label_png.ADLER_BASE
    return high << 16 | low


def _deflate_runs(lengths: Int64) -> bytes:
    """Deflate alternate runs of 0 and 255, zeros first, as one block of fixed Huffman codes."""
    inside = INSIDE * (np.arange(len(lengths)) % 2)
    copies, rest = np.divmod(lengths - 1, label_png.LONGEST)
    short = rest < label_png.SHORTEST
    longest = np.full_like(rest, label_png.COPY_ZERO + label_png.LONGEST)
    kinds = np.stack([inside, longest, label_png.COPY_ZERO + rest, inside], axis=1)
    times = np.stack([np.ones_like(rest), copies, ~short, short * rest], axis=1)
    tokens = np.append(np.repeat(kinds.ravel(), times.ravel()), label_png.END)
    values, sizes = _fixed_codes()
    # The bits before the tokens: the last block, of fixed codes.
    return label_png.join_bits(np.append(3, values[tokens]), np.append(3, sizes[tokens]))


@cache
def _fixed_codes() -> tuple[Int64, Int64]:
    """Bits of every token, lowest first, and their number, where copies are from a byte before."""
    symbol, extra, extra_bits = label_png.token_table()
    lengths = np.repeat([8, 9, 7, 8], [144, 112, 24, 8])
    bits = lengths[symbol]
    # Distances have five bits; the distance of the byte before is 0.
    distance_bits = 5 * (np.arange(label_png.TOKENS) >= label_png.COPY_ZERO)
    values = label_png.canonical_codes(lengths)[symbol] | extra << bits
    return values, bits + extra_bits + distance_bits
