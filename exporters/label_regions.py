"""Areas and boxes of all labels of an image, and their parts, from its horizontal runs."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import BoxPx


@dataclass(frozen=True, slots=True)
class Region:
    """All pixels of one label.

    Attributes:
        area_px: Their number.
        box: Tight box around them.
    """

    area_px: int
    box: BoxPx


@dataclass(frozen=True, eq=False, slots=True)
class _Runs:
    """Horizontal runs of equal pixels, row by row: ``flat`` indices, lengths and labels, [n]."""

    first: NDArray[np.intp]
    length: NDArray[np.intp]
    label: NDArray[np.int64]


def find_regions(labels: NDArray[Any]) -> dict[int, Region]:
    """Regions of an image of whole numbers from 0, [h, w], by label, ascending."""
    runs = _find_runs(labels)
    order = np.argsort(runs.label, kind="stable")
    label = runs.label[order]
    starts = np.flatnonzero(np.diff(label, prepend=-1))
    areas = np.add.reduceat(runs.length[order], starts)
    boxes = _boxes(runs, order, starts, labels.shape[1])
    found = zip(label[starts].tolist(), areas.tolist(), boxes.tolist(), strict=True)
    return {number: Region(area_px, BoxPx(*box)) for number, area_px, box in found}


def find_parts(labels: NDArray[Any]) -> tuple[NDArray[np.int32], list[tuple[int, BoxPx]]]:
    """Parts of the regions of an image: pixels of one label that have common edges.

    Args:
        labels: Whole numbers from 0, [h, w].

    Returns:
        The number of the part of each pixel, from 0, [h, w]; and label and tight box of each part,
        in the order of labels, then of first pixels.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    runs, count = _find_runs(labels), labels.shape[1]
    begins = np.zeros(labels.shape, np.bool_)
    begins.ravel()[runs.first] = True
    # A run and the one below it meet first where one of them begins.
    meets = np.flatnonzero((labels[1:] == labels[:-1]) & (begins[1:] | begins[:-1]))
    run_of = np.repeat(np.arange(len(runs.first)), runs.length)
    above, below = run_of[meets], run_of[meets + count]
    size = (len(runs.first), len(runs.first))
    graph = coo_array((np.ones(len(meets), np.bool_), (above, below)), shape=size)
    _, part_of_run = connected_components(graph, directed=False)
    order = np.argsort(part_of_run, kind="stable")
    starts = np.flatnonzero(np.diff(part_of_run[order], prepend=-1))
    first = order[starts]
    ranks = np.lexsort((first, runs.label[first]))
    boxes = _boxes(runs, order, starts, count)[ranks].tolist()
    number = np.zeros(len(ranks), np.int32)
    number[ranks] = np.arange(len(ranks))
    parts = np.repeat(number[part_of_run], runs.length).reshape(labels.shape)
    found = zip(runs.label[first][ranks].tolist(), boxes, strict=True)
    return parts, [(label, BoxPx(*box)) for label, box in found]


def _find_runs(labels: NDArray[Any]) -> _Runs:
    width = labels.shape[1]
    flat = labels.ravel()
    borders = flat[1:] != flat[:-1]
    borders[width - 1 :: width] = True
    first = np.concatenate([[0], np.flatnonzero(borders) + 1])
    return _Runs(first, np.diff(first, append=flat.size), flat[first].astype(np.int64))


def _boxes(
    runs: _Runs, order: NDArray[np.intp], starts: NDArray[np.intp], width: int
) -> NDArray[np.intp]:
    """Boxes of groups of runs, which ``order`` joins and which begin at ``starts``, [n, 4]."""
    row, column = np.divmod(runs.first[order], width)
    sides = [
        np.minimum.reduceat(column, starts),
        np.minimum.reduceat(row, starts),
        np.maximum.reduceat(column + runs.length[order], starts),
        np.maximum.reduceat(row + 1, starts),
    ]
    return np.stack(sides, axis=1)
