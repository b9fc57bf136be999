"""First overlap of moving boxes."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.boxes import rectangles_overlap
from gen_data.generator.core.se3 import Array


def first_overlap(
    moving: Array, half_m: Array, standing: Array, standing_half_m: Array
) -> tuple[int, int, int] | None:
    """Find the first overlap of two boxes, at least one of them moving; None = no overlap.

    Args:
        moving: Centres and directions of n boxes [t, n, 4]: x, y, cosine, sine.
        half_m: Their half extents [n, 2].
        standing: Centres and directions of m static boxes [m, 4].
        standing_half_m: Their half extents [m, 2].

    Returns:
        Index of the instant, number of the moving box, and number of the other one: below n a
        moving box, from n on a static one.
    """
    others = np.concatenate([half_m, standing_half_m])
    reach = np.sqrt(others[:, 0] * others[:, 0] + others[:, 1] * others[:, 1])
    still = np.broadcast_to(standing, (len(moving), *standing.shape))
    every = np.concatenate([moving, still], axis=1)
    found: tuple[int, int, int] | None = None
    for i, j in _near_pairs(moving, every, reach):
        d = every[:, j, :2] - moving[:, i, :2]
        near = np.flatnonzero(
            d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1] < (reach[i] + reach[j]) * (reach[i] + reach[j])
        )
        hit = rectangles_overlap(moving[near, i], half_m[i], every[near, j], others[j])
        if hit.any():
            first = int(near[int(np.argmax(hit))])
            if found is None or first < found[0]:
                found = (first, i, j)
    return found


def _near_pairs(moving: Array, every: Array, reach_m: Array) -> list[tuple[int, int]]:
    """Pairs with a moving box whose paths come close, by the bounding boxes of the paths."""
    n = moving.shape[1]
    low = every[..., :2].min(axis=0) - reach_m[:, None]
    high = every[..., :2].max(axis=0) + reach_m[:, None]
    apart = (low[:n, None] > high[None]) | (high[:n, None] < low[None])
    near = ~apart.any(axis=2)
    rows, columns = np.nonzero(near)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if j > i or j >= n]
