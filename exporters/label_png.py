"""PNG files of label images: few values in large areas, written at the cost of their borders.

A row is filtered by the one above, which leaves zeros except where the image changes downwards. The
compressed stream is made from these pixels alone, whatever the number of channels: literals, and
copies of the pixel or the zero before. Codes are Huffman's, from the counts of the image. Sources:
Deutsch, RFC 1951, 1996, sections 3.2.2 (codes by their lengths), 3.2.5 (lengths) and 3.2.7 (dynamic
codes), and RFC 1950; Huffman, "A method for the construction of minimum-redundancy codes", 1952.
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.sample import ObjectTruth
from gen_data.exporters.png import GREY, RGB, RowFilter, assemble_palette_png, assemble_png

UInt8 = NDArray[np.uint8]
UInt16 = NDArray[np.uint16]
Int64 = NDArray[np.int64]

ZLIB_HEADER = b"\x78\x01"
ADLER_BASE = 65_521

END, _FIRST_LENGTH, _SYMBOLS = 256, 257, 286
LONGEST, SHORTEST = 258, 3
_LENGTH_EXTRA_BITS = (0,) * 8 + (1,) * 4 + (2,) * 4 + (3,) * 4 + (4,) * 4 + (5,) * 4
"""Extra bits of the length codes 257 to 284."""
_CODE_BITS_MAX = 15
_NODE_BITS, _NODE_MASK = 10, 1023
"""Bits of the numbers of nodes in Huffman's tree, of which there are fewer than 1024."""

_COPY_PIXEL, COPY_ZERO, TOKENS = 512, 1024, 1536
"""Tokens: literals below 256, the end, copies of k bytes from a pixel before (512 + k), and from a
byte before (1024 + k)."""


def encode_label_png(
    labels: NDArray[Any], values: NDArray[Any], colors: UInt8 | None = None
) -> bytes:
    """Encode an image whose pixels have the values of their labels.

    Args:
        labels: Whole numbers below n, [h, w].
        values: Value of each label: uint8 or uint16 [n] for a grey image, uint8 [n, 3] for RGB.
        colors: RGB of each value, uint8 [up to 256, 3], for an image of indices with a palette.
    """
    height, width = labels.shape
    big_endian = np.ascontiguousarray(values, values.dtype.newbyteorder(">"))
    table = big_endian.reshape(len(values), -1).view(np.uint8)
    data = _compress(_find_runs(labels, table), height, 1 + width * table.shape[1])
    if colors is not None:
        return assemble_palette_png(height, width, data, colors)
    color = GREY if values.ndim == 1 else RGB
    return assemble_png(height, width, data, 8 * values.dtype.itemsize, color)


def number_masks(things: Sequence[ObjectTruth], height_px: int, width_px: int) -> UInt16:
    """Image of the numbers of objects in a list, from 1, at their visible masks; 0 = none.

    Objects must have masks; later ones lie on earlier ones. Returns uint16 [h, w].
    """
    numbers = np.zeros((height_px, width_px), np.uint16)
    for number, thing in enumerate(things, 1):
        assert thing.mask is not None, "the annotation instance_masks is needed"
        x, y, pixels = thing.mask.x_px, thing.mask.y_px, thing.mask.pixels
        crop = numbers[y : y + pixels.shape[0], x : x + pixels.shape[1]]
        np.copyto(crop, np.uint16(number), where=pixels)
    return numbers


@dataclass(frozen=True, eq=False, slots=True)
class _Runs:
    """Runs of equal filtered pixels that are not zero, in the order of the stream.

    Attributes:
        begin: Position of the first byte, [n].
        pixels: Number of pixels, [n].
        literals: Bytes of one pixel, [n, step].
    """

    begin: Int64
    pixels: Int64
    literals: UInt8


def _find_runs(labels: NDArray[Any], values: UInt8) -> _Runs:
    """Filter an image [h, w] whose labels have the bytes ``values`` [n, step]."""
    width, step = labels.shape[1], values.shape[1]
    changed = np.flatnonzero(labels[1:] != labels[:-1]) + width
    place = np.concatenate([np.arange(width), changed])
    flat = labels.ravel()
    literals = values[flat[place]]
    literals[width:] -= values[flat[changed - width]]
    # Column by column: NumPy is slow along short axes.
    shown = np.flatnonzero(np.logical_or.reduce([column > 0 for column in literals.T]))
    place, literals = place[shown], literals[shown]
    row, column = np.divmod(place, width)
    differs = (place[1:] != place[:-1] + 1) | (column[1:] == 0)
    for values_of_byte in literals.T:
        differs |= values_of_byte[1:] != values_of_byte[:-1]
    first = np.flatnonzero(np.concatenate([[True], differs])[: len(place)])
    pixels = np.diff(first, append=len(place))
    begin = row[first] * (1 + width * step) + 1 + column[first] * step
    return _Runs(begin, pixels, literals[first])


def _compress(runs: _Runs, rows: int, stride: int) -> bytes:
    """The zlib stream of filtered rows, each with the number of its filter."""
    step, size = runs.literals.shape[1], rows * stride
    heads = np.arange(rows, dtype=np.int64) * stride
    begin = np.concatenate([heads, runs.begin])
    order = np.argsort(begin, kind="stable")
    begin, is_head = begin[order], order < rows
    copied = np.concatenate([np.zeros(rows, np.int64), step * (runs.pixels - 1)])[order]
    literals = np.zeros((len(order), step), np.int64)
    literals[is_head, 0] = RowFilter.UP
    literals[~is_head] = runs.literals
    end = begin + np.where(is_head, 1, step) + copied
    zeros = np.append(begin[1:], size) - end
    tokens = _tokens(literals, is_head, copied, zeros)
    check = _adler32(runs, heads, size)
    return ZLIB_HEADER + _pack(tokens, step) + check.to_bytes(4, "big")


def _tokens(
    literals: Int64, is_head: NDArray[np.bool_], copied: Int64, zeros: Int64
) -> NDArray[np.int64]:
    """Tokens of the stream: per pixel or head its literals, copies of it, and zeros."""
    count, step = literals.shape
    # Copies have at least three bytes; the rest is repeated literally.
    copies, rest = np.divmod(copied, LONGEST)
    gap_copies, gap_rest = np.divmod(np.maximum(zeros - 1, 0), LONGEST)
    short, gap_short = rest < SHORTEST, gap_rest < SHORTEST
    kinds = np.zeros((count, 2 * step + 5), np.int64)
    times = np.zeros_like(kinds)
    kinds[:, :step] = kinds[:, step : 2 * step] = literals
    times[:, 0], times[:, 1:step] = 1, ~is_head[:, None]
    times[:, step : 2 * step] = (short * rest // step)[:, None]
    near = COPY_ZERO if step == 1 else _COPY_PIXEL
    kinds[:, -5], times[:, -5] = near + LONGEST, copies
    kinds[:, -4], times[:, -4] = near + rest, ~short
    kinds[:, -3], times[:, -3] = 0, (zeros > 0) + gap_short * gap_rest
    kinds[:, -2], times[:, -2] = COPY_ZERO + LONGEST, gap_copies
    kinds[:, -1], times[:, -1] = COPY_ZERO + gap_rest, ~gap_short
    return np.append(np.repeat(kinds.ravel(), times.ravel()), END)


def _adler32(runs: _Runs, heads: Int64, size: int) -> int:
    """Adler-32 of the filtered rows, from the bytes that are not zero."""
    step = runs.literals.shape[1]
    literals, pixels = runs.literals.astype(np.int64), runs.pixels
    low = 1 + RowFilter.UP * len(heads) + int((literals.sum(axis=1) * pixels).sum())
    high = size + RowFilter.UP * int((size - heads).sum())
    # A byte counts as often as there are bytes from it to the end.
    for k in range(step):
        often = pixels * (size - runs.begin - k) - step * (pixels * (pixels - 1) // 2)
        high += int((often % ADLER_BASE * literals[:, k]).sum())
    return (high % ADLER_BASE) << 16 | low % ADLER_BASE


def _pack(tokens: Int64, step: int) -> bytes:
    """One block of deflate with the dynamic codes of its tokens."""
    symbol, extra, extra_bits = token_table()
    counts = np.bincount(symbol[tokens], minlength=_SYMBOLS)
    lengths = _code_lengths(counts.tolist())
    codes = canonical_codes(lengths)
    # A distance is one bit: 0 = the byte before, 1 = the pixel before.
    kind = np.arange(TOKENS)
    is_copy = kind >= _COPY_PIXEL
    distance = is_copy & (kind < COPY_ZERO)
    bits = lengths[symbol]
    value = codes[symbol] | extra << bits | distance << (bits + extra_bits)
    size = bits + extra_bits + is_copy
    head_values, head_sizes = _header(lengths, step)
    return join_bits(
        np.concatenate([head_values, value[tokens]]), np.concatenate([head_sizes, size[tokens]])
    )


def _header(lengths: Int64, step: int) -> tuple[Int64, Int64]:
    """Values and sizes in bits of the fields before the tokens of a final, dynamic block."""
    fields = [(1, 1), (2, 2), (_SYMBOLS - 257, 5), (step - 1, 5), (19 - 4, 4)]
    # The lengths of codes, 0 to 15, have codes of four bits; repetitions (16 to 18) are unused.
    fields += [(0, 3)] * 3 + [(4, 3)] * 16
    values, sizes = np.array(fields).T
    distances = [1] if step == 1 else [1, *[0] * (step - 2), 1]
    both = _reversed_bits()[np.concatenate([lengths, distances]) << (_CODE_BITS_MAX - 4)]
    return np.concatenate([values, both]), np.concatenate([sizes, np.full(len(both), 4)])


def join_bits(values: Int64, sizes: Int64) -> bytes:
    """Join fields of at most 32 bits, the lowest bit first."""
    end = np.cumsum(sizes)
    word, shift = np.divmod(end - sizes, 32)
    first = np.flatnonzero(np.diff(word, prepend=-1))
    # The fields of a word do not overlap: their sum is their union.
    sums = np.add.reduceat(values.astype(np.uint64) << shift.astype(np.uint64), first)
    words = np.zeros(int(word[-1]) + 2, np.uint64)
    words[word[first]] = sums & np.uint64(0xFFFFFFFF)
    words[word[first] + 1] |= sums >> np.uint64(32)
    return words.astype("<u4").tobytes()[: -(-int(end[-1]) // 8)]


@cache
def token_table() -> tuple[Int64, Int64, Int64]:
    """Symbol, extra bits and their number, of every token."""
    symbol, extra, extra_bits = (np.zeros(TOKENS, np.int64) for _ in range(3))
    symbol[: END + 1] = np.arange(END + 1)
    length = SHORTEST
    spans = [*enumerate(_LENGTH_EXTRA_BITS, _FIRST_LENGTH), (_SYMBOLS - 1, 0)]
    for code, bits in spans:
        # The longest copy has a separate code.
        length = LONGEST if code == _SYMBOLS - 1 else length
        for base in (_COPY_PIXEL, COPY_ZERO):
            covered = slice(base + length, base + length + (1 << bits))
            symbol[covered], extra_bits[covered] = code, bits
            extra[covered] = np.arange(1 << bits)
        length += 1 << bits
    return symbol, extra, extra_bits


def _code_lengths(counts: Sequence[int]) -> Int64:
    """Lengths of Huffman's codes, at most 15; 0 for symbols that do not occur.

    At least two symbols must occur.
    """
    symbols = [symbol for symbol, count in enumerate(counts) if count]
    lengths = np.zeros(len(counts), np.int64)
    while max(depths := _leaf_depths([counts[symbol] for symbol in symbols])) > _CODE_BITS_MAX:
        # Counts that differ less have shorter codes.
        counts = [-(-count // 2) for count in counts]
    lengths[symbols] = depths
    return lengths


def _leaf_depths(counts: Sequence[int]) -> list[int]:
    """Depths of the leaves of Huffman's tree; equal counts join in the order of their making."""
    total = 2 * len(counts) - 1
    # One number orders nodes by count, then by number.
    heap = [count << _NODE_BITS | node for node, count in enumerate(counts)]
    heapq.heapify(heap)
    parents = [0] * total
    for node in range(len(counts), total):
        one = heapq.heappop(heap)
        other = heap[0]
        parents[one & _NODE_MASK] = parents[other & _NODE_MASK] = node
        merged = (one >> _NODE_BITS) + (other >> _NODE_BITS)
        heapq.heapreplace(heap, merged << _NODE_BITS | node)
    depths = [0] * total
    for node in range(total - 2, -1, -1):
        depths[node] = depths[parents[node]] + 1
    return depths[: len(counts)]


def canonical_codes(lengths: Int64) -> Int64:
    """Codes by symbol, with the first bit lowest; 0 for symbols without one."""
    codes = np.zeros_like(lengths)
    order = np.argsort(lengths, kind="stable")
    order = order[lengths[order] > 0]
    # A code of k bits takes 2^-k of the range; the next one begins where it ends.
    shares = 1 << (_CODE_BITS_MAX - lengths[order])
    codes[order] = _reversed_bits()[np.cumsum(shares) - shares]
    return codes


@cache
def _reversed_bits() -> Int64:
    """Numbers of 15 bits with their bits in reverse order, by number."""
    numbers = np.arange(1 << _CODE_BITS_MAX)
    return sum(
        ((numbers >> k & 1) << (_CODE_BITS_MAX - 1 - k) for k in range(_CODE_BITS_MAX)),
        start=np.zeros_like(numbers),
    )
