"""Indirect inference on models whose answer is known."""

from dataclasses import replace
from zlib import crc32

import numpy as np
import pytest
from scipy.stats import norm

from gen_data.core.se3 import Array
from gen_data.lab.matching import indirect_inference as inference
from gen_data.lab.matching.indirect_inference import Axis, estimate, solve, trimmed_mean

AXIS = Axis(-10.0, 10.0, step=0.5, plausible=3.0, enough=0.1)
AXES = (AXIS, AXIS)
AXES_OF_TWO_SIZES = (AXIS, replace(AXIS, low=0.0, high=2000.0, plausible=30.0))
SLOPES = np.array([[2.0, 0.5], [-1.0, 1.5]])
"""Statistics of a linear model by parameters."""


def recordings(seed: int, n: int, mean: Array, spread: Array) -> Array:
    """Statistics [n, 2] of recordings with normal parameters in scenes of deviation 0.3."""
    rng = np.random.default_rng(seed)
    parameters = mean + spread * rng.standard_normal((n, 2))
    return np.asarray(parameters @ SLOPES.T + 0.3 * rng.standard_normal((n, 2)))


def model(seed: int, scenes: int = 40):  # type: ignore[no-untyped-def]  # noqa: ANN201
    """A simulation with the same scenes for all candidates."""
    noise = 0.3 * np.random.default_rng(seed).standard_normal((scenes, 2))
    return lambda parameters, count: (noise + parameters @ SLOPES.T)[:count]


@pytest.mark.slow
def test_parameters_of_a_linear_model_are_found_within_their_intervals() -> None:
    """True parameters lie in 95 % intervals as often as that says: 0.90 to 0.99 of 150 sets."""
    truth = np.array([1.5, -2.0])
    inside = []
    for seed in range(150):
        real = recordings(seed, 40, truth, np.zeros(2))
        found = estimate(real, solve(real, model(1000 + seed), AXES, np.zeros(2)), AXES)
        inside += [abs(one.mean - t) <= one.half_width for one, t in zip(found, truth, strict=True)]
    assert 0.90 <= np.mean(inside) <= 0.99


def test_curved_statistics_are_solved_also_with_parameters_of_large_numbers() -> None:
    """The fourth power of the parameter, from a start where its slope is a tenth of the last."""
    scenes = np.random.default_rng(3).standard_normal((40, 1))
    real = 2.0**4 + np.random.default_rng(4).standard_normal((40, 1))
    solution = solve(real, lambda p, n: (p**4 + scenes)[:n], (AXIS,), np.array([1.0]))
    assert solution.parameters[0] == pytest.approx(2.0, abs=0.02)
    # Two parameters of a curved model, the second about 1000: both are found.
    scenes = np.random.default_rng(20).standard_normal((40, 2))
    real = np.array([2.0**4, 1000.0]) + np.random.default_rng(21).standard_normal((40, 2))

    def simulate(parameters: Array, count: int) -> Array:
        return np.asarray(np.array([parameters[0] ** 4, parameters[1]]) + scenes)[:count]

    solution = solve(real, simulate, AXES_OF_TWO_SIZES, np.array([1.0, 990.0]))
    assert solution.parameters[0] == pytest.approx(2.0, abs=0.02)
    assert solution.parameters[1] == pytest.approx(1000.0, abs=1.0)


def test_late_parameters_do_not_lead_the_search_into_a_valley() -> None:
    """Contrast, photons and readout, as noise levels tell them: errors of one hide in the others.

    Sums of variances are curved in the logarithms of their parts, and simulated noise is drawn anew
    with every change. Without an order, the search ends far from the contrast of the recordings.
    """
    truth, start = np.array([0.0, 11.55, 3.58]), np.array([0.0, 15.0, 2.8])
    axes = [Axis(-2.0, 2.0, step=0.2, plausible=0.6, enough=0.1),
            Axis(5.0, 20.0, step=1.0, plausible=4.0, enough=0.1, late=True),
            Axis(-2.0, 8.0, step=0.5, plausible=2.0, enough=0.1, late=True)]  # fmt: skip

    def simulate(parameters: Array, count: int, seed: int = 0) -> Array:
        contrast, well, read = parameters
        photons, readout = 2.0**-well, 4.0 ** (read - well)
        bright, dark = (np.log2(level * photons + readout) for level in (0.2, 0.02))
        means = np.array([2.5 * contrast, bright + 2.0 * contrast, dark - 0.5 * contrast])
        scenes = np.random.default_rng(seed).standard_normal((32, 3)) * (0.6, 0.0, 0.0)
        drawn = np.random.default_rng(crc32(parameters.tobytes())).standard_normal((32, 3))
        return np.asarray(means + scenes + drawn * (0.0, 0.08, 0.2))[:count]

    real = np.concatenate([simulate(truth, 32, seed) for seed in (1, 2)])
    contrast = (trimmed_mean(real) - trimmed_mean(simulate(truth, 32)))[0] / 2.5
    in_turn = solve(real, simulate, axes, start).parameters
    at_once = solve(real, simulate, [replace(axis, late=False) for axis in axes], start).parameters

    assert in_turn[0] == pytest.approx(contrast, abs=0.01)
    assert abs(at_once[0] - contrast) > 0.02


def test_spread_of_recordings_makes_the_interval_which_few_widen() -> None:
    """The first parameter has deviation 0.5, the second none."""
    real = recordings(5, 200, np.array([1.0, 1.0]), np.array([0.5, 0.0]))
    first, second = estimate(real, solve(real, model(6, 200), AXES, np.zeros(2)), AXES)
    assert first.spread == pytest.approx(0.5, abs=0.08)
    assert second.spread == 0.0
    # Student's quantile for a single degree of freedom is 6.5 times the normal one.
    truth = np.array([1.0, 1.0])
    widths = []
    for n in (2, 5, 20, 80):
        real = recordings(9, n, truth, np.full(2, 0.5))
        widths.append(estimate(real, solve(real, model(10), AXES, np.zeros(2)), AXES)[0].half_width)
    alone = recordings(9, 1, truth, np.zeros(2))
    (single, _) = estimate(alone, solve(alone, model(10), AXES, np.zeros(2)), AXES)
    assert widths == sorted(widths, reverse=True)
    assert single.half_width == np.inf
    assert single.n_enough is None
    # A set of the number that a small one asks for has about the half width of its axis.
    axis = replace(AXIS, enough=0.05)
    few = np.random.default_rng(11).standard_normal(30)
    asked = inference.direct_estimate(few, axis).n_enough
    assert asked is not None
    many = inference.direct_estimate(np.random.default_rng(12).standard_normal(asked), axis)
    assert many.half_width == pytest.approx(axis.enough, rel=0.35)
    # One of ten is left out at either end.
    values = np.array(
        [[1.0], [2.0], [3.0], [np.nan], [2.0], [2.0], [1e9], [-1e9], [3.0], [1.0], [2.0]]
    )
    assert trimmed_mean(values)[0] == pytest.approx(2.0)


def test_spread_shifts_the_mean_of_a_curved_statistic_but_not_the_fit() -> None:
    """exp(p) of a normal p has the mean exp(mu + sigma^2 / 2), here 0.18 above exp(mu) in p."""
    quantiles = (np.arange(2000) + 0.5) / 2000
    real = np.exp(norm(1.0, 0.6).ppf(quantiles))[:, None]
    scenes = 0.1 * np.random.default_rng(15).standard_normal((400, 1))
    start = np.zeros(1)

    def simulate(parameters: Array, count: int) -> Array:
        return np.asarray(np.exp(parameters) + scenes[:count])

    constant = solve(real, simulate, (AXIS,), start).parameters[0]
    (found,) = inference.estimate_with_spread(real, simulate, (AXIS,), start)

    assert constant > 1.06
    assert found.mean == pytest.approx(1.0, abs=0.03)


def test_a_parameter_without_effect_is_not_determined_and_keeps_its_value() -> None:
    """The others are fitted with its first value."""
    noise = 0.3 * np.random.default_rng(7).standard_normal((40, 2))
    real = 0.3 * np.random.default_rng(8).standard_normal((40, 2)) + (3.0, 0.0)

    def simulate(positions: object, parameters: Array, count: int) -> Array:
        full = np.zeros(2)
        full[list(positions)] = parameters  # type: ignore[call-overload]
        return (noise + full * (1.0, 0.0))[:count][:, list(positions)]  # type: ignore[call-overload]

    found = inference.fit(real, simulate, AXES, np.zeros(2), [0, 1])

    assert found[0].determined
    assert found[0].mean == pytest.approx(3.0, abs=0.3)
    assert not found[1].determined
