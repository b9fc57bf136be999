"""COCO run-length encoding of masks, straight from their tight crops.

Column-major runs of the whole image, beginning with the zeros, as lengths; then pycocotools'
compressed text form. Cost grows with the mask's outline, not with the image.
"""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from pycocotools import mask as coco_mask

from gen_data.generator.core.sample import MaskPx


class Rle(TypedDict):
    """A mask as COCO's JSON has it: ``size`` is [height, width]."""

    size: list[int]
    counts: str


def run_lengths(mask: MaskPx, height_px: int, width_px: int) -> list[int]:
    """Lengths of the column-major runs of an image-sized mask, the first one of zeros.

    The crop must lie inside the image.
    """
    height, width = mask.pixels.shape
    # Each column gets a zero above it, so that no run passes from one column into the next.
    columns = np.zeros((width + 1, height + 1), dtype=bool)
    columns[:width, 1:] = mask.pixels.T
    flat = columns.ravel()
    column, row = np.divmod(np.flatnonzero(flat[1:] != flat[:-1]), height + 1)
    borders = (column + mask.x_px) * height_px + row + mask.y_px
    if height == height_px:
        # A run that ends where the next column's begins is one run.
        meets = np.flatnonzero(borders[1:-1:2] == borders[2::2])
        borders = np.delete(borders, np.concatenate([2 * meets + 1, 2 * meets + 2]))
    ends = np.concatenate([[0], borders, [height_px * width_px]])
    lengths = ends[1:] - ends[:-1]
    # A mask that ends in the last pixel has no closing run of zeros.
    counts: list[int] = lengths.tolist()
    return counts if counts[-1] or len(counts) == 1 else counts[:-1]


def encode_rle(mask: MaskPx, height_px: int, width_px: int) -> Rle:
    """The mask in an image of the given size, in COCO's compressed form."""
    size = [height_px, width_px]
    counts = run_lengths(mask, height_px, width_px)
    rle = coco_mask.frPyObjects({"size": size, "counts": counts}, height_px, width_px)
    return {"size": size, "counts": rle["counts"].decode("ascii")}
