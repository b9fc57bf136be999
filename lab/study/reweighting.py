"""Parameters that a detector's misses depend on, and distributions with more missed objects.

The values of a parameter are divided into bins that the declared distribution fills equally. Where
the share of missed objects differs between bins by more than chance, the weight of each bin is
multiplied by its share of misses, relative to the mean. Nothing outside the declared support is
drawn, and inside a bin the shape of the declared distribution stays.

Automatic domain randomisation by failures: OpenAI et al., "Solving Rubik's Cube with a Robot Hand",
2019, widens ranges; this moves weight within them, as importance sampling does.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.config.distributions import (
    Choice,
    Constant,
    Distribution,
    LogUniform,
    Mixture,
    Normal,
    Probability,
    Uniform,
    UniformInteger,
)
from gen_data.core.streams import Streams
from gen_data.lab.study.comparison import adjust
from gen_data.report.drawn_parameters import Drawn

BINS = 6
"""Parts of an interval: more would hold too few objects each."""
PRIOR_OBJECTS = 20.0
"""Objects with the mean share of misses that are added to each bin, against chance."""
LEAST, MOST = 0.25, 4.0
"""Limits of the factor of a bin: everything declared is still drawn."""
PERMUTATIONS_MAX = 9999
"""Enough for a p of 0.0001, to find one of some hundred parameters."""
BEYOND_MAX = 20
"""Permutations beyond the measured spread that end a test (Besag, Clifford, Biometrika 1991)."""
ALPHA = 0.05
"""False alarm rate of all parameters together."""


@dataclass(frozen=True, slots=True)
class Tally:
    """Objects of a sample, and the ones that the detector missed."""

    objects: int
    missed: int


@dataclass(frozen=True)
class Dependence:
    """How misses depend on a parameter.

    Attributes:
        name: As in ``Drawn``.
        declared: Its distribution.
        parts: Distributions of the bins, with their declared probabilities.
        objects, missed: By bin.
        p: p-value of a permutation test, adjusted for the number of parameters.
    """

    name: str
    declared: Distribution[Any]
    parts: tuple[tuple[Distribution[Any], float], ...]
    objects: tuple[int, ...]
    missed: tuple[int, ...]
    p: float

    def factors(self, strength: float) -> tuple[float, ...]:
        """Factor of the weight of each bin.

        Args:
            strength: 0 = none, 1 = in proportion to misses; the exponent of the ratio.
        """
        mean = sum(self.missed) / max(sum(self.objects), 1)
        if mean == 0.0:
            return (1.0,) * len(self.parts)
        ratios = [
            (missed + PRIOR_OBJECTS * mean) / ((objects + PRIOR_OBJECTS) * mean)
            for objects, missed in zip(self.objects, self.missed, strict=True)
        ]
        return tuple(min(max(ratio**strength, LEAST), MOST) for ratio in ratios)

    def reweighted(self, strength: float) -> Distribution[Any]:
        """The declared distribution with the weights of its bins multiplied by their factors."""
        factors = self.factors(strength)
        raw = [p * f for (_, p), f in zip(self.parts, factors, strict=True)]
        weights = [round(weight / sum(raw), 6) for weight in raw]
        if isinstance(self.declared, Probability):
            return Probability(weights[1])
        values = [part.value for part, _ in self.parts if isinstance(part, Constant)]
        if len(values) == len(self.parts):
            return Choice(dict(zip(values, weights, strict=True)))
        parts: Any = tuple(part for part, _ in self.parts)
        return Mixture(parts, tuple(weights))


def find_dependences(draws: Sequence[Drawn], tallies: Mapping[int, Tally]) -> list[Dependence]:
    """Test every parameter whose weights can be changed, in rising order of p.

    Left out are parameters with several distributions (that depend on shared values), and
    parameters over rotations, directions, positions and sequences.

    Args:
        draws: All draws of a data set.
        tallies: By number of the sample; samples without one do not count.
    """
    by_name: dict[str, list[Drawn]] = {}
    for draw in draws:
        by_name.setdefault(draw.name, []).append(draw)
    found: list[tuple[Dependence, float]] = []
    for name, log in sorted(by_name.items()):
        declared = log[0].distribution
        parts = divide(declared)
        if len(parts) < 2 or any(draw.distribution != declared for draw in log):
            continue
        bins = np.array([_find_bin(parts, draw.value) for draw in log])
        counts = np.array(
            [
                [sum(getattr(tallies[k], key) for k in draw.samples if k in tallies)
                 for key in ("objects", "missed")]
                for draw in log
            ]
        )  # fmt: skip
        objects, missed = _sum_by_bin(bins, counts, len(parts))
        dependence = Dependence(
            name, declared, parts, tuple(objects.tolist()), tuple(missed.tolist()), 1.0
        )
        found.append((dependence, _permutation_p(name, bins, counts, len(parts))))
    adjusted = adjust([p for _, p in found])
    tested = [
        Dependence(d.name, d.declared, d.parts, d.objects, d.missed, p)
        for (d, _), p in zip(found, adjusted, strict=True)
    ]
    return sorted(tested, key=lambda dependence: (dependence.p, dependence.name))


def divide(declared: Distribution[Any]) -> tuple[tuple[Distribution[Any], float], ...]:
    """Parts of a distribution and their probabilities; empty if its weights cannot be changed.

    Intervals are divided into bins of equal probability; the parts of a mixture stay as they are.
    """
    if isinstance(declared, Mixture):
        total = sum(declared.weights)
        pairs = zip(declared.parts, declared.weights, strict=True)
        return tuple((part, weight / total) for part, weight in pairs if weight > 0)
    if isinstance(declared, Choice):
        total = sum(declared.weights)
        values = zip(declared.values, declared.weights, strict=True)
        return tuple((Constant(value), weight / total) for value, weight in values if weight > 0)
    if isinstance(declared, Probability):
        if not 0.0 < declared.p < 1.0:
            return ()
        return (Constant(False), 1.0 - declared.p), (Constant(True), declared.p)
    if isinstance(declared, UniformInteger):
        return _divide_integers(declared)
    edges = _edges(declared)
    return tuple((_part(declared, low, high), 1.0 / BINS) for low, high in pairwise(edges))


def _divide_integers(declared: UniformInteger) -> tuple[tuple[Distribution[Any], float], ...]:
    count = declared.high - declared.low + 1
    bounds = [
        declared.low + round(k * count / min(BINS, count)) for k in range(min(BINS, count) + 1)
    ]
    return tuple(
        (Constant(low) if high == low + 1 else UniformInteger(low, high - 1), (high - low) / count)
        for low, high in pairwise(bounds)
    )


def _edges(declared: Distribution[Any]) -> list[float]:
    """Ends of bins of equal probability; fewer than two if there are none."""
    shares = [k / BINS for k in range(BINS + 1)]
    if isinstance(declared, Uniform) and declared.low < declared.high:
        return [_short(declared.low + share * (declared.high - declared.low)) for share in shares]
    if isinstance(declared, LogUniform) and declared.low < declared.high:
        ratio = declared.high / declared.low
        inner = [_short(declared.low * ratio**share) for share in shares[1:-1]]
        return [declared.low, *inner, declared.high]
    if isinstance(declared, Normal) and declared.clip is not None and declared.stddev > 0:
        # Without a clip the outer bins would have no end.
        normal = NormalDist(declared.center, declared.stddev)
        low, high = (normal.cdf(end) for end in declared.clip)
        inner = [_short(normal.inv_cdf(low + share * (high - low))) for share in shares[1:-1]]
        return [declared.clip[0], *inner, declared.clip[1]]
    return []


def _part(declared: Distribution[Any], low: float, high: float) -> Distribution[Any]:
    if isinstance(declared, Normal):
        return Normal(declared.center, declared.stddev, (low, high))
    return type(declared)(low, high)  # type: ignore[call-arg]


def _short(value: float) -> float:
    """Six significant digits: edges of bins are read by people."""
    return float(f"{value:.6g}")


def _find_bin(parts: Sequence[tuple[Distribution[Any], float]], value: Hashable) -> int:
    """Number of the part that holds a value; of two that touch there, the first."""
    for number, (part, _) in enumerate(parts):
        if isinstance(part, Constant):
            if part.value == value:
                return number
        elif part.support()[0] <= value <= part.support()[1]:  # type: ignore[attr-defined]
            return number
    raise AssertionError(f"no part of {parts} holds {value!r}")


def _sum_by_bin(
    bins: NDArray[np.int64], counts: NDArray[np.int64], size: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    objects = np.bincount(bins, counts[:, 0], size)
    missed = np.bincount(bins, counts[:, 1], size)
    return objects.astype(np.int64), missed.astype(np.int64)


def _permutation_p(
    name: str, bins: NDArray[np.int64], counts: NDArray[np.int64], size: int
) -> float:
    """Probability of as large differences between bins if draws and misses were independent.

    Objects of one picture are missed together: whole draws are exchanged, not objects.
    """
    rng = Streams(0, 0).rng(f"adapt/{name}")
    mean = counts[:, 1].sum() / max(counts[:, 0].sum(), 1)

    def spread(order: NDArray[np.int64]) -> float:
        objects, missed = _sum_by_bin(order, counts, size)
        return float(((missed - mean * objects) ** 2 / np.maximum(objects, 1)).sum())

    measured = spread(bins)
    if not measured > 0.0 or math.isnan(measured):
        return 1.0
    beyond = 0
    for count in range(1, PERMUTATIONS_MAX + 1):
        beyond += spread(rng.permutation(bins)) >= measured
        if beyond == BEYOND_MAX:
            return BEYOND_MAX / count
    return (1 + beyond) / (1 + PERMUTATIONS_MAX)
