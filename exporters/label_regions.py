"""Areas and boxes of all labels of an image, in one pass over its horizontal runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.boxes import BoxPx


@dataclass(frozen=True, slots=True)
class Region:
    """All pixels of one label.

    Attributes:
        area_px: Their number.
        box: Tight box around them.
    """

    area_px: int
    box: BoxPx


def find_regions(labels: NDArray[Any]) -> dict[int, Region]:
    """Regions of an image of whole numbers from 0, [h, w], by label, ascending."""
    width = labels.shape[1]
    flat = labels.ravel()
    borders = flat[1:] != flat[:-1]
    borders[width - 1 :: width] = True
    first = np.concatenate([[0], np.flatnonzero(borders) + 1])
    length = np.diff(first, append=flat.size)
    row, column = np.divmod(first, width)
    order = np.argsort(flat[first], kind="stable")
    label = flat[first][order].astype(np.int64)
    starts = np.flatnonzero(np.diff(label, prepend=-1))
    sides = [
        np.minimum.reduceat(column[order], starts),
        np.minimum.reduceat(row[order], starts),
        np.maximum.reduceat((column + length)[order], starts),
        np.maximum.reduceat(row[order] + 1, starts),
    ]
    areas = np.add.reduceat(length[order], starts)
    boxes = np.stack(sides, axis=1)
    found = zip(label[starts].tolist(), areas.tolist(), boxes.tolist(), strict=True)
    return {number: Region(area_px, BoxPx(*box)) for number, area_px, box in found}
