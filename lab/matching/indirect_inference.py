"""Parameters by simulation: simulated recordings with them have the statistics of real ones.

This is indirect inference (Gourieroux, Monfort and Renault, "Indirect inference", Journal of
Applied Econometrics 8, 1993): a statistic need not estimate its parameter, as long as it changes
with it, since simulated recordings pass through the same statistic. There are as many statistics as
parameters; the search for equal means is a bounded trust-region one, with the same scenes and noise
for all candidates, and derivatives by finite differences.

The configuration's own values are a prior, whose wide deviations matter only where the recordings
determine a parameter poorly.

The excess of the variation of real statistics over simulated ones, whose parameters are constant,
is the spread of the parameters between recordings. Statistics are not linear functions of
parameters, and spread
shifts their means: parameters are estimated again from simulated recordings with this spread.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array
from gen_data.core.streams import Streams

Simulate = Callable[[Array, int], Array]
"""Statistics [scenes, k] for parameters [k], or for parameters of each scene [scenes, k], of so
many of the simulated scenes, at most."""
EVERY = 1 << 30
"""All scenes."""

CANDIDATES_MAX = 20
CONVERGED = 5e-3
"""Relative change of the parameters, in plausible deviations from their first values, and of the
remaining distance, at which the search ends."""
DERIVATIVE_SCENES = 12
"""Scenes for derivatives: differences within a scene scatter less than scenes do."""
TRIMMED = 0.1
"""Share of the recordings left out at either end of a mean."""
RESAMPLES = 400
DETERMINED = 0.5
"""Largest standard error of a determined parameter, in units of its axis's plausible deviation."""
SPREAD_N = 8
"""Smallest number of recordings from which a spread between recordings is estimated."""
SPREAD_ERRORS = 2.0
"""Standard errors above which an excess of variance is significant."""
_ROUNDING = 1e-8
"""Variance of a mean of equal values, to keep its weight finite."""
WINSORISED = 0.05
"""Share of the values that are moved to the next one at either end before a variance."""
_WINSORISED_VARIANCE = 0.8313
"""Of a standard normal distribution whose extreme twentieths are moved to their limits."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Coordinate of one parameter.

    Attributes:
        low, high: Range.
        step: For derivatives.
        plausible: Standard deviation of the values to expect around the configuration's own.
        enough: Half width of an interval that is narrow enough for most uses.
        varies: Whether the parameter may differ from recording to recording.
        grid: Simulations round the parameter to multiples of this; 0 = they do not.
        late: Whether the search begins with the parameters that are not late, on whose statistics
            this one has little effect.
    """

    low: float
    high: float
    step: float
    plausible: float
    enough: float
    varies: bool = True
    grid: float = 0.0
    late: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Parameters [k] with which simulated and real means agree.

    Attributes:
        parameters: [k], in the coordinates of their axes.
        slopes: Derivatives, statistics by parameters, [k, k].
        gain: Change of the parameters with the statistics, [k, k].
        determined: Whether the recordings determine each parameter, [k].
        simulated: Statistics of the simulation with these parameters, [scenes, k].
    """

    parameters: Array
    slopes: Array
    gain: Array
    determined: NDArray[np.bool_]
    simulated: Array


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter's mean over recordings and its spread between them.

    Attributes:
        mean: In the coordinate of the axis.
        half_width: Half width of the 95 % interval of the mean; inf for a single recording.
        spread: Standard deviation between recordings beyond the scenes' deviation; 0 if it is not
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
    """Mean [..., k] of statistics [..., n, k] without the extreme tenths; NaN are left out."""
    ordered, count = _ordered(values)
    cut = (TRIMMED * count).astype(int)
    rank = np.arange(ordered.shape[-2])[:, None]
    kept = (rank >= cut[..., None, :]) & (rank < (count - cut)[..., None, :])
    total = np.where(kept, ordered, 0.0).sum(axis=-2)
    number = count - 2 * cut
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def _ordered(values: Array) -> tuple[Array, NDArray[np.int64]]:
    """Values [..., n, k] sorted, missing ones last, and the number [..., k] of the others."""
    known = np.where(np.isfinite(values), values, np.nan)
    return np.sort(known, axis=-2), np.isfinite(values).sum(axis=-2)


def _limited(values: Array, share: float) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Values [..., n, k] with this share at either end moved to the next value that remains.

    Also the number [..., k] of values, and of moved values at each end.
    """
    ordered, count = _ordered(values)
    cut = (share * count).astype(int)
    ends = (cut, np.maximum(count - 1 - cut, 0))
    low, high = (np.take_along_axis(ordered, end[..., None, :], axis=-2) for end in ends)
    return np.clip(ordered, low, high), count, cut


def fit(
    real: Array,
    simulate: Callable[[Sequence[int], Array, int], Array],
    axes: Sequence[Axis],
    start: Array,
    used: Sequence[int],
) -> dict[int, Estimate]:
    """Estimate some of the parameters, by their positions among all.

    Undetermined parameters are estimated once, and keep their first values while the others
    are estimated again: the fit must agree with a configuration that keeps them.

    Args:
        real: Statistics of the recordings, [n, all]; NaN = not measurable.
        simulate: Simulation of the statistics at some positions, as ``Simulate``.
        axes: Axes of all parameters.
        start: First values of all parameters.
        used: Positions to estimate.
    """

    def estimate_some(positions: Sequence[int]) -> dict[int, Estimate]:
        own, columns = [axes[k] for k in positions], list(positions)
        estimates = estimate_with_spread(
            real[:, columns], partial(simulate, columns), own, start[columns]
        )
        return dict(zip(positions, estimates, strict=True))

    found = estimate_some(used) if used else {}
    determined = [k for k, one in found.items() if one.determined]
    if 0 < len(determined) < len(found):
        found |= estimate_some(determined)
    return found


def estimate_with_spread(
    real: Array, simulate: Simulate, axes: Sequence[Axis], start: Array
) -> list[Estimate]:
    """Estimate parameters, and again with their spread in the simulation if there is any.

    The spread is taken from the first estimate, relative to a simulation with constant parameters.
    """
    solution = solve(real, simulate, axes, start)
    found = estimate(real, solution, axes)
    spreads = np.array([one.spread for one in found])
    if not spreads.any():
        return found
    deviations = spreads * _normal_deviates(*solution.simulated.shape)
    low, high = _bounds(axes)

    def simulate_spread(at: Array, count: int) -> Array:
        return simulate(np.clip(at + deviations, low, high)[:count], count)

    again = solve(real, simulate_spread, axes, start, first=solution.parameters)
    return [
        replace(one, spread=before.spread)
        for one, before in zip(estimate(real, again, axes), found, strict=True)
    ]


def _normal_deviates(scenes: int, k: int) -> Array:
    """Normal deviates [scenes, k]: the middle quantiles of equal strata, in random order."""
    from scipy.stats import norm

    rng = Streams(seed=0, scene=0).rng("match/spread")
    quantiles = norm.ppf((np.arange(scenes) + 0.5) / scenes)
    return np.stack([rng.permutation(quantiles) for _ in range(k)], axis=1)


def _bounds(axes: Sequence[Axis]) -> tuple[Array, Array]:
    """Lowest and highest parameters, each [k]."""
    return np.array([axis.low for axis in axes]), np.array([axis.high for axis in axes])


def solve(
    real: Array,
    simulate: Simulate,
    axes: Sequence[Axis],
    start: Array,
    slopes: Array | None = None,
    first: Array | None = None,
) -> Solution:
    """Find the parameters with which the simulation has the means of the real statistics.

    Args:
        real: Statistics of the recordings, [n, k]; NaN = not measurable.
        simulate: Simulation of the same statistics.
        axes: Axes of the k parameters.
        start: Parameters of the configuration [k], the mean of the prior.
        slopes: Derivatives of the statistics [k, k] where they are known; None = measured.
        first: Parameters [k] at which the search begins; None = ``_search_in_turn``.
    """
    from scipy.optimize import least_squares

    low, high = _bounds(axes)
    plausible = np.array([axis.plausible for axis in axes])
    start = np.clip(start, low, high)

    def locate(place: Array) -> Array:
        """Parameters at a place of the search, which is 1 for the configuration's values."""
        return np.asarray(np.clip(start + plausible * (place - 1.0), low, high))

    def place(at: Array) -> Array:
        return np.asarray(1.0 + (at - start) / plausible)

    begin = _search_in_turn(real, simulate, axes, start) if first is None else first
    begin = np.clip(begin, low, high)
    target, known = trimmed_mean(real), dict[bytes, Array]()

    def found(at: Array) -> Array:
        if at.tobytes() not in known:
            known[at.tobytes()] = simulate(at, EVERY)
        return known[at.tobytes()]

    error = np.sqrt(_variance_of_mean(real) + _variance_of_mean(found(begin)))

    def residuals(place: Array) -> Array:
        gap = np.nan_to_num(trimmed_mean(found(locate(place))) - target)
        return np.concatenate([gap / error, place - 1.0])

    def derivatives(at: Array) -> Array:
        return _derivatives(simulate, at, found(at), axes) if slopes is None else slopes

    def jacobian(place: Array) -> Array:
        steep = derivatives(locate(place)) * plausible / error[:, None]
        return np.vstack([steep, np.eye(len(axes))])

    # In plausible deviations: no parameter's unit decides when the search has converged;
    # from 1 and not 0, as the first trust region has the size of the first place.
    search = least_squares(
        residuals, place(begin), jacobian, (place(low), place(high)),
        xtol=CONVERGED, ftol=CONVERGED, gtol=None, max_nfev=CANDIDATES_MAX,
    )  # fmt: skip
    at = locate(search.x)
    last = search.jac[: len(axes)] * error[:, None] / plausible
    gain, determined = _gain(last, real, found(at), axes)
    return Solution(at, last, gain, determined, found(at))


def _search_in_turn(real: Array, simulate: Simulate, axes: Sequence[Axis], start: Array) -> Array:
    """Parameters [k] near the solution: the late ones are found when the others have been.

    Together, they would follow a narrow curved valley, in which the scatter of statistics ends the
    search anywhere: late parameters make up for errors of early ones.
    """
    late = [number for number, axis in enumerate(axes) if axis.late]
    early = [number for number, axis in enumerate(axes) if not axis.late]
    begin = np.array(start)
    if not late or not early:
        return begin
    for part in (early, late):

        def simulate_part(at: Array, count: int, part: Sequence[int] = part) -> Array:
            moved = begin.copy()
            moved[part] = at
            return np.asarray(simulate(moved, count)[:, part])

        own = [axes[number] for number in part]
        begin[part] = solve(real[:, part], simulate_part, own, start[part]).parameters
    return begin


def _derivatives(simulate: Simulate, at: Array, found: Array, axes: Sequence[Axis]) -> Array:
    """Change of the mean statistics with each parameter, [k, k]: statistics by parameters."""
    columns = []
    here = trimmed_mean(found[:DERIVATIVE_SCENES])
    for number, axis in enumerate(axes):
        step = axis.step if at[number] + axis.step <= axis.high else -axis.step
        moved = at.copy()
        moved[number] += step
        there = trimmed_mean(simulate(moved, DERIVATIVE_SCENES))
        columns.append(np.nan_to_num((there - here) / step))
    return np.stack(columns, axis=1)


def _gain(
    derivatives: Array, real: Array, simulated: Array, axes: Sequence[Axis]
) -> tuple[Array, NDArray[np.bool_]]:
    """Regularised inverse of the derivatives, and which parameters are determined.

    It is the inverse of a linear model with normal errors of the means and a normal prior.
    """
    plausible = np.array([axis.plausible for axis in axes])
    weight = 1.0 / (_variance_of_mean(real) + _variance_of_mean(simulated))
    weighted = derivatives.T * weight
    covariance = np.linalg.inv(weighted @ derivatives + np.diag(plausible**-2.0))
    errors = np.sqrt(np.diag(covariance))
    return covariance @ weighted, errors < DETERMINED * plausible


def _variance_of_mean(values: Array) -> Array:
    """Squared standard errors [k] of the trimmed means of statistics [n, k].

    By Winsorised variances (Tukey and McLaughlin, "Less vulnerable confidence and significance
    procedures for location based on a single sample", Sankhya A 25, 1963); 1 for n = 1.
    """
    limited, count, cut = _limited(values, TRIMMED)
    if len(values) < 2:
        return np.ones(values.shape[1])
    n = np.maximum(count, 2)
    squares = _squared_deviations(limited, count)
    return np.asarray(squares / (n - 1) / (n * (1.0 - 2.0 * cut / n) ** 2) + _ROUNDING)


def estimate(real: Array, solution: Solution, axes: Sequence[Axis]) -> list[Estimate]:
    """Mean, interval and spread of every parameter, by resampling recordings and scenes.

    Intervals are standard errors by bootstrap (Efron, "Bootstrap methods: another look at the
    jackknife", Annals of Statistics 7, 1979) times Student's quantile for n - 1, and the
    root of n / (n - 1) that corrects the narrowness of bootstrap errors of small samples
    (Hesterberg, The American Statistician 69, 2015).

    See ``_spreads`` for the spread.
    """
    rng = Streams(seed=0, scene=0).rng("match/bootstrap")
    real_errors = _bootstrap_errors(real, solution.gain, rng)
    scene_errors = _bootstrap_errors(solution.simulated, solution.gain, rng)
    spreads = _spreads(real, solution, axes, rng)
    numbers = np.isfinite(real).sum(axis=0)
    return [
        _estimate(
            float(solution.parameters[k]),
            (float(real_errors[k]), float(scene_errors[k])),
            float(spreads[k]),
            (int(numbers[k]), len(solution.simulated)),
            axis,
            bool(solution.determined[k]),
        )
        for k, axis in enumerate(axes)
    ]


def direct_estimate(values: Array, axis: Axis) -> Estimate:
    """Mean, interval and spread of a parameter that every recording states by itself, [n]."""
    rng = Streams(seed=0, scene=0).rng("match/bootstrap")
    (error,) = _bootstrap_errors(values[:, None], np.eye(1), rng)
    (mean,) = trimmed_mean(values[:, None])
    errors = float(error), 0.0
    return _estimate(float(mean), errors, float(values.std()), (len(values), EVERY), axis, True)


def _estimate(
    mean: float,
    errors: tuple[float, float],
    spread: float,
    numbers: tuple[int, int],
    axis: Axis,
    determined: bool,
) -> Estimate:
    """Estimate with an interval from the standard errors by recordings and by scenes, so many."""
    from scipy.stats import t

    n, scenes = numbers
    if n < 2:
        return Estimate(mean, math.inf, 0.0, n, None, determined and n > 0)
    widths = (error * math.sqrt(m / (m - 1)) for error, m in zip(errors, numbers, strict=True))
    half = float(t.ppf(0.975, min(n, scenes) - 1)) * math.hypot(*widths)
    room = (axis.enough / 1.96) ** 2 - errors[1] ** 2
    enough = max(2, math.ceil(n * errors[0] ** 2 / room)) if room > 0.0 else None
    return Estimate(mean, half, spread if n >= SPREAD_N else 0.0, n, enough, determined)


def _bootstrap_errors(values: Array, gain: Array, rng: np.random.Generator) -> Array:
    """Standard errors [k] of parameters by resampling the statistics [n, k]."""
    drawn = rng.integers(len(values), size=(RESAMPLES, len(values)))
    # A resample may hold nothing that was measurable.
    return np.asarray(np.nanstd(trimmed_mean(values[drawn]) @ gain.T, axis=0))


def _spreads(
    real: Array, solution: Solution, axes: Sequence[Axis], rng: np.random.Generator
) -> Array:
    """Standard deviations [k] of parameters between recordings; 0 where they are insignificant.

    A parameter of variance v adds v times its squared slope to the variances of all statistics.
    The most significant excess is attributed to the statistic's own parameter, its effect on the
    others is subtracted, and so on: several parameters could explain one excess.
    """
    scenes = solution.simulated

    def resampled(values: Array) -> Array:
        return _robust_variance(values[rng.integers(len(values), size=(RESAMPLES, len(values)))])

    drawn = resampled(real) - resampled(scenes)
    errors = np.maximum(np.nanstd(drawn, axis=0), 1e-12)
    excess = _robust_variance(real) - _robust_variance(scenes)
    effects = solution.slopes**2
    left = {k for k, axis in enumerate(axes) if axis.varies and solution.determined[k]}
    spreads = np.zeros(len(axes))
    while left:
        k = max(left, key=lambda number: float(excess[number] / errors[number]))
        if not excess[k] > SPREAD_ERRORS * errors[k] or effects[k, k] <= 0.0:
            break
        variance = excess[k] / effects[k, k]
        spreads[k] = math.sqrt(variance)
        excess = excess - variance * effects[:, k]
        left.remove(k)
    return spreads


def _robust_variance(values: Array) -> Array:
    """Variance [..., k] of statistics [..., n, k], from Winsorised ones."""
    limited, count, _ = _limited(values, WINSORISED)
    squares = _squared_deviations(limited, count)
    return np.where(count > 0, squares / np.maximum(count, 1), np.nan) / _WINSORISED_VARIANCE


def _squared_deviations(values: Array, count: NDArray[np.int64]) -> Array:
    """Sums [..., k] of squared deviations of ``count`` values from their mean; NaN are left out."""
    known = np.isfinite(values)
    mean = np.where(known, values, 0.0).sum(axis=-2) / np.maximum(count, 1)
    return np.asarray(np.where(known, (values - mean[..., None, :]) ** 2, 0.0).sum(axis=-2))
