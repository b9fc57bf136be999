"""COCO run-length encoding of masks, computed from their tight crops.

The encoding lists the lengths of the column-major runs of the whole image, starting with zeros, in
pycocotools' compressed text form. The cost is proportional to the mask's crop, not to the image.
"""

from typing import TypedDict

import numpy as np
from pycocotools import mask as coco_mask

from gen_data.core.sample import MaskPx


class Rle(TypedDict):
    """A mask in COCO's JSON; ``size`` is [height, width]."""

    size: list[int]
    counts: str


def run_lengths(mask: MaskPx, height_px: int, width_px: int) -> list[int]:
    """Compute the lengths of the column-major runs of an image-sized mask, zeros first.

    The crop must lie inside the image.
    """
    height, width = mask.pixels.shape
    # A zero above each column keeps runs from crossing into the next column.
    columns = np.zeros((width + 1, height + 1), dtype=bool)
    columns[:width, 1:] = mask.pixels.T
    flat = columns.ravel()
    column, row = np.divmod(np.flatnonzero(flat[1:] != flat[:-1]), height + 1)
    borders = (column + mask.x_px) * height_px + row + mask.y_px
    if height == height_px:
        # Join a run that ends at the bottom with one that starts at the top of the next column.
        meets = np.flatnonzero(borders[1:-1:2] == borders[2::2])
        borders = np.delete(borders, np.concatenate([2 * meets + 1, 2 * meets + 2]))
    ends = np.concatenate([[0], borders, [height_px * width_px]])
    lengths = ends[1:] - ends[:-1]
    # A mask that includes the last pixel has no closing run of zeros.
    counts: list[int] = lengths.tolist()
    return counts if counts[-1] or len(counts) == 1 else counts[:-1]


def encode_rle(mask: MaskPx, height_px: int, width_px: int) -> Rle:
    """Encode a mask in an image of the given size in COCO's compressed form."""
    size = [height_px, width_px]
    counts = run_lengths(mask, height_px, width_px)
    rle = coco_mask.frPyObjects({"size": size, "counts": counts}, height_px, width_px)
    return {"size": size, "counts": rle["counts"].decode("ascii")}
