"""Which rows of a table are equal."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.triangle_soup import Int64


def first_occurrences(keys: Int64) -> tuple[Int64, Int64]:
    """Numbers of the distinct rows of ``keys`` [n, k] in order of first occurrence.

    Returns:
        The number of each row [n], and the first row of each number.
    """
    order = np.lexsort(keys.T[::-1])
    ordered = keys[order]
    starts = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    group = np.cumsum(starts) - 1
    # lexsort is stable: the first row of a group is its first occurrence.
    first = order[starts]
    rank_order = np.argsort(first, kind="stable")
    rank = np.zeros(len(first), dtype=np.int64)
    rank[rank_order] = np.arange(len(first))
    numbers = np.zeros(len(keys), dtype=np.int64)
    numbers[order] = rank[group]
    return numbers, first[rank_order]
