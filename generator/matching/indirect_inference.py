"""Parameters by simulation: those with which simulated recordings have the statistics of real ones.

This is indirect inference (Gourieroux, Monfort and Renault, "Indirect inference", Journal of
Applied Econometrics 8, 1993): a statistic need not estimate its parameter, as long as it changes
with it, since simulated recordings pass through the same statistic. There are as many statistics as
parameters; Newton's method solves for equal means, with derivatives by finite differences and the
same scenes and noise for all candidates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import Array

Simulate = Callable[[Array], Array]
"""Statistics [scenes, k] of simulated recordings for parameters [k]."""

ROUNDS_MAX = 6
DERIVATIVES = 2
"""Rounds that compute derivatives; later ones reuse the last."""
CONVERGED = 0.02
"""Change of a parameter, in steps of its axis, at which the search ends."""
TRIMMED = 0.1
"""Share of the recordings left out at either end of a mean."""
RESAMPLES = 400
DETERMINED = 0.5
"""Largest standard error of a determined parameter, in units of its axis's plausible deviation."""
SPREAD_N = 8
"""Smallest number of recordings from which a spread between recordings is estimated."""
SPREAD_CONFIDENCE = 0.975
_QUARTILES_TO_STDDEV = 0.7413
"""Of a normal distribution: its standard deviation over the distance of its quartiles."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Coordinate of one parameter.

    Attributes:
        low, high: Range.
        step: For derivatives.
        stride: Largest change in a round.
        plausible: Standard deviation of the values to expect, before anything is measured. Wide:
            it decides only where recordings hardly determine the parameter.
        enough: Half width of an interval that is narrow enough for most uses.
    """

    low: float
    high: float
    step: float
    stride: float
    plausible: float
    enough: float


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Parameters [k] with which simulated and real means agree.

    Attributes:
        parameters: [k], in the coordinates of their axes.
        gain: Change of the parameters with the statistics, [k, k].
        determined: Whether the recordings determine each parameter, [k].
        simulated: Statistics of the simulation with these parameters, [scenes, k].
    """

    parameters: Array
    gain: Array
    determined: NDArray[np.bool_]
    simulated: Array


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter's mean over recordings and its spread between them.

    Attributes:
        mean: In the coordinate of the axis.
        half_width: Of the 95 % interval of the mean; inf for a single recording.
        spread: Standard deviation between recordings beyond that of the scenes; 0 if it is not
            significant, or unknown.
        n: Number of recordings.
        n_enough: Number of recordings for an interval of ``Axis.enough``; None if the simulated
            scenes are too few for it, however many recordings there are.
        determined: Whether the recordings determine it.
    """

    mean: float
    half_width: float
    spread: float
    n: int
    n_enough: int | None
    determined: bool


def trimmed_mean(values: Array) -> Array:
    """Mean [k] of statistics [n, k] without the extreme tenths; NaN are left out."""
    means = []
    for column in values.T:
        known = np.sort(column[np.isfinite(column)])
        cut = int(TRIMMED * len(known))
        means.append(known[cut : len(known) - cut].mean() if len(known) else np.nan)
    return np.array(means)


def solve(
    real: Array, simulate: Simulate, axes: Sequence[Axis], start: Array, slopes: Array | None = None
) -> Solution:
    """Find the parameters with which the simulation has the means of the real statistics.

    Args:
        real: Statistics of the recordings, [n, k]; NaN = not measurable.
        simulate: Simulation of the same statistics.
        axes: Of the k parameters.
        start: First parameters, [k].
        slopes: Derivatives of the statistics [k, k] where they are known; None = measured.
    """
    low, high = (np.array([getattr(axis, name) for axis in axes]) for name in ("low", "high"))
    stride = np.array([axis.stride for axis in axes])
    step = np.array([axis.step for axis in axes])
    target = trimmed_mean(real)
    at = np.clip(start, low, high)
    found = simulate(at)
    derivatives = slopes
    for number in range(ROUNDS_MAX):
        if slopes is None and number < DERIVATIVES:
            derivatives = _derivatives(simulate, at, found, axes)
        assert derivatives is not None
        gain, determined = _gain(derivatives, real, found, axes)
        change = np.clip(gain @ (target - trimmed_mean(found)), -stride, stride)
        moved = np.clip(at + change, low, high)
        if np.all(np.abs(moved - at) < CONVERGED * step):
            break
        at, found = moved, simulate(moved)
    return Solution(at, gain, determined, found)


def _derivatives(simulate: Simulate, at: Array, found: Array, axes: Sequence[Axis]) -> Array:
    """Change of the mean statistics with each parameter, [k, k]: statistics by parameters."""
    columns = []
    for number, axis in enumerate(axes):
        step = axis.step if at[number] + axis.step <= axis.high else -axis.step
        moved = at.copy()
        moved[number] += step
        columns.append((trimmed_mean(simulate(moved)) - trimmed_mean(found)) / step)
    return np.stack(columns, axis=1)


def _gain(
    derivatives: Array, real: Array, simulated: Array, axes: Sequence[Axis]
) -> tuple[Array, NDArray[np.bool_]]:
    """Regularised inverse of the derivatives, and which parameters are determined.

    The inverse is that of a linear model with normal errors of the means and a normal prior, whose
    centre is the present value.
    """
    plausible = np.array([axis.plausible for axis in axes])
    weight = 1.0 / np.maximum(_variance_of_mean(real) + _variance_of_mean(simulated), 1e-12)
    weighted = derivatives.T * weight
    covariance = np.linalg.inv(weighted @ derivatives + np.diag(plausible**-2.0))
    errors = np.sqrt(np.diag(covariance))
    return covariance @ weighted, errors < DETERMINED * plausible


def _variance_of_mean(values: Array) -> Array:
    """Squared standard errors [k] of the means of statistics [n, k]; those of 2 for n = 1."""
    known = np.isfinite(values).sum(axis=0)
    spread = np.nanvar(values, axis=0) if len(values) > 1 else np.ones(values.shape[1])
    return np.asarray((spread + 1e-8) / np.maximum(known - 1, 1))


def estimate(real: Array, solution: Solution, axes: Sequence[Axis]) -> list[Estimate]:
    """Mean, interval and spread of every parameter, by resampling recordings and scenes.

    Intervals are standard errors by bootstrap (Efron, "Bootstrap methods: another look at the
    jackknife", Annals of Statistics 7, 1979) times Student's quantile for n - 1, and the
    root of n / (n - 1) that corrects the narrowness of bootstrap errors of small samples
    (Hesterberg, "What teachers should know about the bootstrap", The American Statistician 2015).

    The spread is the deviation of estimates of single recordings, from which that of simulated
    recordings, which have one and the same parameter in different scenes, is subtracted in
    quadrature.
    """
    from scipy.stats import t

    rng = np.random.default_rng(0)
    real_errors = _bootstrap_errors(real, solution.gain, rng)
    scene_errors = _bootstrap_errors(solution.simulated, solution.gain, rng)
    estimates = []
    n_of = np.isfinite(real).sum(axis=0)
    spreads = _spreads(real, solution, rng)
    for k, axis in enumerate(axes):
        n = int(n_of[k])
        factor = float(t.ppf(0.975, n - 1)) * math.sqrt(n / (n - 1)) if n > 1 else math.inf
        half = factor * math.hypot(real_errors[k], scene_errors[k]) if n > 1 else math.inf
        room = (axis.enough / 1.96) ** 2 - scene_errors[k] ** 2
        enough = max(2, math.ceil(n * real_errors[k] ** 2 / room)) if room > 0 and n > 1 else None
        estimates.append(
            Estimate(
                float(solution.parameters[k]), half, float(spreads[k]) if n >= SPREAD_N else 0.0,
                n, enough, bool(solution.determined[k]) and n > 0,
            )
        )  # fmt: skip
    return estimates


def _bootstrap_errors(values: Array, gain: Array, rng: np.random.Generator) -> Array:
    """Standard errors [k] of parameters by resampling the statistics [n, k]."""
    drawn = rng.integers(len(values), size=(RESAMPLES, len(values)))
    means = np.array([trimmed_mean(values[rows]) for rows in drawn])
    # A resample may hold nothing that was measurable.
    return np.asarray(np.nanstd(means @ gain.T, axis=0))


def _spreads(real: Array, solution: Solution, rng: np.random.Generator) -> Array:
    """Standard deviations [k] of parameters between recordings; 0 where they are insignificant."""
    own, scenes = real @ solution.gain.T, solution.simulated @ solution.gain.T
    excess = _robust_variance(own) - _robust_variance(scenes)
    again = np.array([
        _robust_variance(own[rng.integers(len(own), size=len(own))])
        - _robust_variance(scenes[rng.integers(len(scenes), size=len(scenes))])
        for _ in range(RESAMPLES)
    ])  # fmt: skip
    significant = (again > 0.0).mean(axis=0) >= SPREAD_CONFIDENCE
    return np.where(significant & np.isfinite(excess), np.sqrt(np.maximum(excess, 0.0)), 0.0)


def _robust_variance(values: Array) -> Array:
    """Variance [k] of the normal distributions with the quartiles of values [n, k]."""
    low, high = np.nanpercentile(values, [25.0, 75.0], axis=0)
    return np.asarray((_QUARTILES_TO_STDDEV * (high - low)) ** 2)


def direct_estimate(values: Array, axis: Axis) -> Estimate:
    """Mean, interval and spread of a parameter that every recording states by itself, [n]."""
    column = values[:, None]
    exact = Solution(
        trimmed_mean(column), np.eye(1), np.ones(1, np.bool_), trimmed_mean(column)[None]
    )
    (found,) = estimate(column, exact, [axis])
    return replace(found, spread=float(values.std()))
