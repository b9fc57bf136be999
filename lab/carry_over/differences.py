"""Differences of two sets of measured values, and which of them chance does not explain.

The distance of two distributions is Wasserstein's of order 1, the area between their cumulative
distributions (Vallender, "Calculation of the Wasserstein distance between probability distributions
on the line", Theory of Probability and Its Applications 18, 1974), divided by the standard
deviation of the real values. Logarithms are compared where ratios count.

Chance: pictures are exchanged between both sides at random, all of one scene together. A row
differs if its distance, in standard deviations of its exchanged distances, exceeds the largest one
of all rows in 95 of 100 exchanges (Westfall and Young, "Resampling-Based Multiple Testing", 1993):
of twenty comparisons of sets of one kind, one names a row, whatever the number of rows.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array
from gen_data.core.streams import Streams
from gen_data.lab.carry_over.statistics import QUANTITIES, Measured, Values

EXCHANGES = 400
CONFIDENCE = 0.95
VALUES_MIN = 10
"""With fewer values on one side, a row is not compared."""
SMALL = 0.2
"""Standard deviations below which no difference is reported: Cohen's "small effect" (Statistical
Power Analysis for the Behavioral Sciences, 1988)."""

LEAST = 1e-3
"""Smaller deviations count as this, where all values are equal."""

Direction = Literal["larger", "smaller", "wider", "narrower"]


@dataclass(frozen=True, slots=True)
class Row:
    """One compared quantity of one class.

    Attributes:
        label: The class, or ``statistics.WHOLE``.
        real, ours: 10, 50 and 90 % quantiles, in the quantity's unit.
        n_real, n_ours: Numbers of values.
        apart: Distance in standard deviations of the real values.
        chance: Distance up to which chance explains it.
        direction: How our values differ, mostly.
    """

    label: str
    quantity: str
    real: tuple[float, float, float]
    ours: tuple[float, float, float]
    n_real: int
    n_ours: int
    apart: float
    chance: float
    direction: Direction

    @property
    def differs(self) -> bool:
        """Whether chance does not explain the distance, and it is not small."""
        return self.apart > max(self.chance, SMALL)


@dataclass(frozen=True, eq=False, slots=True)
class _Pooled:
    """Values of both sides, sorted.

    Attributes:
        units: Numbers of the units [n]; ours follow the real ones.
        gaps: Distances to the next value [n - 1].
        spread: Standard deviation of the real values, at least the quantity's grain.
    """

    units: NDArray[np.intp]
    gaps: Array
    spread: float

    def distance(self, is_real: NDArray[np.bool_]) -> float:
        """Wasserstein distance over the spread, if these units are the real ones; 0 without any."""
        mine = is_real[self.units]
        real = np.cumsum(mine)
        ours = np.arange(1, mine.size + 1) - real
        if not real[-1] or not ours[-1]:
            return 0.0
        apart = np.abs(real / real[-1] - ours / ours[-1])[:-1]
        return float(apart @ self.gaps) / self.spread


def compare(
    real: Measured, ours: Measured, units_real: int, units_ours: int
) -> tuple[tuple[Row, ...], tuple[str, ...], tuple[str, ...]]:
    """Compare all quantities that both sides state.

    Args:
        real: Real values.
        ours: Our values.
        units_real: Number of real units.
        units_ours: Number of our units.

    Returns:
        Rows, the largest difference beyond chance first; classes with too few values; quantities
        that one side alone states.
    """
    every = {**real, **ours}
    one_sided = {name for _, name in real} ^ {name for _, name in ours}
    keys = [key for key in every if _least(real, ours, key) >= VALUES_MIN]
    few = dict.fromkeys(k[0] for k in every if k not in keys and k[1] not in one_sided)
    pooled = [_pool(key[1], real[key], ours[key], units_real) for key in keys]
    is_real = np.arange(units_real + units_ours) < units_real
    apart = np.array([one.distance(is_real) for one in pooled])
    chance = _chance(pooled, is_real)
    rows = [
        _row(key, real[key].values, ours[key].values, float(a), float(c))
        for key, a, c in zip(keys, apart, chance, strict=True)
    ]
    ordered = sorted(rows, key=lambda row: (not row.differs, row.chance - row.apart))
    return tuple(ordered), tuple(few), tuple(sorted(one_sided))


def _least(real: Measured, ours: Measured, key: tuple[str, str]) -> int:
    return min(side[key].values.size if key in side else 0 for side in (real, ours))


def _coordinate(quantity: str, values: Array) -> Array:
    """Values, or their logarithms to base 2; numbers of points may be 0."""
    if not QUANTITIES[quantity].is_log:
        return values
    return np.log2(values + 1.0) if quantity.startswith("points") else np.log2(values)


def _pool(quantity: str, real: Values, ours: Values, units_real: int) -> _Pooled:
    sides = [_coordinate(quantity, side.values) for side in (real, ours)]
    values = np.concatenate(sides)
    order = np.argsort(values, kind="stable")
    units = np.concatenate([real.units, ours.units + units_real])[order]
    spread = max(float(sides[0].std()), QUANTITIES[quantity].grain)
    return _Pooled(units, np.diff(values[order]), spread)


def _chance(pooled: Iterable[_Pooled], is_real: NDArray[np.bool_]) -> Array:
    """Largest distance of each row that chance explains, for all rows together [rows]."""
    rng = Streams(0, 0).rng("carry_over")
    exchanged = [rng.permutation(is_real) for _ in range(EXCHANGES)]
    drawn = np.array([[one.distance(units) for units in exchanged] for one in pooled])
    if not drawn.size:
        return np.zeros(0)
    mean, deviation = drawn.mean(axis=1), np.maximum(drawn.std(axis=1), LEAST)
    largest = ((drawn - mean[:, None]) / deviation[:, None]).max(axis=0)
    return np.asarray(mean + deviation * np.quantile(largest, CONFIDENCE, method="higher"))


def _row(key: tuple[str, str], real: Array, ours: Array, apart: float, chance: float) -> Row:
    label, quantity = key
    a, b = (_coordinate(quantity, side) for side in (real, ours))
    shift, widening = float(b.mean() - a.mean()), float(b.std() - a.std())
    direction: Direction = "larger" if shift > 0.0 else "smaller"
    # A shift alone makes the distance its own size; a wider set of the same mean makes more.
    if abs(widening) > abs(shift):
        direction = "wider" if widening > 0.0 else "narrower"
    return Row(
        label, quantity, _quantiles(real), _quantiles(ours), real.size, ours.size,
        apart, chance, direction,
    )  # fmt: skip


def _quantiles(values: Array) -> tuple[float, float, float]:
    low, middle, high = np.quantile(values, [0.1, 0.5, 0.9])
    return float(low), float(middle), float(high)
