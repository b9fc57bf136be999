"""Rounding to a decimal grid with the bits of ``round``, in less time.

A scene rounds twenty thousand numbers, and ``round`` goes through decimal text.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_SURE = 0.499
"""Distance from the nearest step of the grid, in steps, up to which the error of a product cannot
choose another one."""
_STEPS_MAX = 2.0**43
"""Counts of steps up to which that error is below a thousandth."""


def round_near(value: float, steps: float, decimals: int) -> float:
    """``round(value, decimals)``, where ``steps`` is ``10.0 ** decimals``, at most 1e8."""
    if value == 0.0:
        return value
    scaled = value * steps
    if -_STEPS_MAX < scaled < _STEPS_MAX:
        whole = round(scaled)
        if whole and -_SURE < scaled - whole < _SURE:
            # Both are exact, and a quotient is the nearest number to the decimal, as by ``round``.
            return whole / steps
    return round(value, decimals)


def round_rows(values: NDArray[Any], decimals: int) -> list[list[float]]:
    """Rows [n, k] of numbers as by ``round``, without negative zeros."""
    scaled = np.asarray(values, np.float64) * 10.0**decimals
    whole = np.rint(scaled)
    rows: list[list[float]] = (whole / 10.0**decimals + 0.0).tolist()
    is_sure = (np.abs(scaled - whole) < _SURE) & (np.abs(scaled) < _STEPS_MAX)
    for i, k in zip(*np.nonzero(~is_sure), strict=True):
        rows[i][k] = round(float(values[i, k]), decimals) + 0.0
    return rows
