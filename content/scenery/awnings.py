"""Cloth: roofs over shop windows and stalls that sag between their bars, hangings with folds."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import grid

_THICK_M = 0.004
"""Between the two sides of the cloth, its seams included; assumed."""
_SAG = 0.035
"""Depth of the sag, as a share of the way between the bars; assumed."""
_WAVE_M, _SCALLOP_M = 0.012, 0.03
"""Depth of a valance's folds and height of its scallops; assumed."""
_FOLD_M, _FOLD_SHARE = 0.16, 0.05
"""Distance between folds of a hanging, and their depth as a share of its height; assumed."""
_ROWS, _COLUMNS = 4, 7


def awning_cloth(
    front_m: tuple[float, float],
    back_m: tuple[float, float],
    edges_m: Sequence[float],
    slots: Sequence[int],
    valance_m: float,
) -> list[Patch]:
    """Cloth from a bar in front to one at the back, with a scalloped valance below the front bar.

    Args:
        front_m: (x, z) of the bar in front; x grows to the front.
        back_m: (x, z) of the bar at the back.
        edges_m: y of the stripes' edges, ascending.
        slots: Material of each stripe.
        valance_m: Height of the valance, scallops included.
    """
    parts: list[Patch] = []
    t = np.linspace(0.0, 1.0, _ROWS)
    (x0, z0), (x1, z1) = front_m, back_m
    x, z = x0 + (x1 - x0) * t, z0 + (z1 - z0) * t - 4.0 * _SAG * abs(x1 - x0) * t * (1.0 - t)
    for (a, b), slot in zip(pairwise(edges_m), slots, strict=True):
        roof = np.array([[(x[k], y, z[k]) for y in (a, b)] for k in range(_ROWS)])
        s = np.linspace(0.0, 1.0, _COLUMNS)
        arch = 4.0 * s * (1.0 - s)
        # A fold bulges where the scallop hangs lowest; the cloth is sewn straight above.
        low = np.stack([x0 + _WAVE_M * (arch - 0.5), a + (b - a) * s,
                        z0 - valance_m + _SCALLOP_M * (1.0 - arch)], axis=1)  # fmt: skip
        top = np.stack([np.full(_COLUMNS, x0), low[:, 1], np.full(_COLUMNS, z0)], axis=1)
        parts += _both_sides(grid(roof, slot=slot), z=-_THICK_M)
        parts += _both_sides(grid(np.stack([low, top]), slot=slot), x=-_THICK_M)
    return parts


def hanging_cloth(
    x: float, y_m: tuple[float, float], z_m: tuple[float, float], slot: int
) -> list[Patch]:
    """Cloth that hangs from a straight upper edge and faces +X; its folds deepen downwards."""
    (y0, y1), (z0, z1) = y_m, z_m
    folds = max(2, round((y1 - y0) / _FOLD_M))
    y = np.linspace(y0, y1, 6 * folds + 1)
    phase = 2.0 * math.pi * folds * (y - y0) / (y1 - y0)
    # A slower wave makes neighbouring folds differ.
    depth = 0.5 * (z1 - z0) * _FOLD_SHARE * (np.sin(phase) + 0.5 * np.sin(0.43 * phase))
    rows = [
        np.stack([x + depth * (1.0 - t) ** 0.5, y, np.full(len(y), z0 + (z1 - z0) * t)], axis=1)
        for t in (0.0, 0.35, 0.75, 1.0)
    ]
    return list(_both_sides(grid(np.stack(rows), slot=slot), x=-_THICK_M))


def _both_sides(outer: Patch, x: float = 0.0, z: float = 0.0) -> tuple[Patch, Patch]:
    """A sheet and its other side, moved away from the first by the cloth's thickness."""
    return outer, outer.flipped().moved(x, 0.0, z)
