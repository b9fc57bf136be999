"""Weights move towards what is missed, only where misses depend on a parameter."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

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
from gen_data.lab.study.reweighting import Dependence, Tally, divide, find_dependences
from gen_data.report.drawn_parameters import Drawn

DECLARED: list[Distribution[Any]] = [
    Uniform(-2.0, 10.0), LogUniform(0.5, 800.0), Normal(3.0, 2.0, clip=(0.0, 9.0)),
    UniformInteger(3, 22), UniformInteger(0, 2), Choice({"day": 9.0, "night": 1.0}),
    Probability(0.2), Mixture((Uniform(0.0, 1.0), Uniform(1.0, 5.0)), (3.0, 1.0)),
]  # fmt: skip


def draw(distribution: Distribution[Any], count: int, seed: int = 0) -> list[Any]:
    rng = Streams(seed, 0).rng("test")
    return [distribution.draw(rng) for _ in range(count)]


@pytest.mark.parametrize("declared", DECLARED, ids=str)
def test_parts_and_probabilities_are_the_declared_distribution(declared: Distribution[Any]) -> None:
    """Two-sample tests, at one false alarm in 100,000 each."""
    parts = divide(declared)
    unchanged = Dependence("x", declared, parts, (100,) * len(parts), (30,) * len(parts), 1.0)
    first, second = draw(declared, 20_000), draw(unchanged.reweighted(1.0), 20_000, 1)
    if isinstance(first[0], (str, bool, int)):
        values = sorted(set(first) | set(second))
        table = [[list(drawn).count(v) for v in values] for drawn in (first, second)]
        assert stats.chi2_contingency(table).pvalue > 1e-5
    else:
        assert stats.ks_2samp(first, second).pvalue > 1e-5


@pytest.mark.parametrize("declared", DECLARED, ids=str)
def test_the_support_stays_and_what_is_missed_is_drawn_oftener(declared: Distribution[Any]) -> None:
    """Nine of ten objects of the last part are missed, one of ten of the others."""
    parts = divide(declared)
    missed = (100,) * (len(parts) - 1) + (900,)
    changed = Dependence("x", declared, parts, (1000,) * len(parts), missed, 0.0).reweighted(1.0)
    last = parts[-1][0]

    def share(distribution: Distribution[Any]) -> float:
        drawn = draw(distribution, 4000)
        low, high = last.support() if not isinstance(last, Constant) else (None, None)
        inside = [v == last.value if low is None else low <= v <= high for v in drawn]
        return float(np.mean(inside))

    assert share(changed) > 1.3 * share(declared)
    if isinstance(declared, Choice):
        assert set(draw(changed, 4000)) <= set(declared.values)
    else:
        low, high = declared.support()
        assert all(low <= value <= high for value in draw(changed, 4000))


@pytest.mark.parametrize(
    "declared", [Constant(1.0), Normal(0.0, 1.0), Uniform(2.0, 2.0), Probability(1.0)], ids=str
)
def test_what_has_no_parts_is_left_alone(declared: Distribution[Any]) -> None:
    """Constants, and normals whose tails have no end."""
    assert len(divide(declared)) < 2


def simulate(seed: int, miss_by_value: float) -> tuple[list[Drawn], dict[int, Tally]]:
    """300 scenes with an exposure that may matter and a colour that does not."""
    rng = np.random.default_rng(seed)
    exposure, hue = Uniform(0.0, 1.0), Choice(("red", "green", "blue"))
    draws, tallies = [], {}
    for number in range(300):
        value = float(rng.uniform())
        samples = range(number, number + 1)
        draws.append(Drawn("light.exposure", exposure, value, samples))
        draws.append(Drawn("paint.hue", hue, str(rng.choice(hue.values)), samples))
        objects = int(rng.integers(1, 12))
        # Objects of a picture are missed together: their number varies more than a binomial's.
        chance = np.clip(rng.beta(2.0, 5.0) + miss_by_value * (value - 0.5), 0.0, 1.0)
        tallies[number] = Tally(objects, int(rng.binomial(objects, chance)))
    return draws, tallies


def test_the_parameter_that_misses_depend_on_is_found() -> None:
    """Its weights rise with its value; the other one is not significant."""
    draws, tallies = simulate(0, 0.5)
    first, second = find_dependences(draws, tallies)
    assert (first.name, second.name) == ("light.exposure", "paint.hue")
    assert first.p < 0.001
    assert second.p > 0.05
    factors = first.factors(1.0)
    assert max(factors[:2]) < 1.0 < min(factors[-2:])
    assert factors[-1] > 2.0 * factors[0]


@pytest.mark.slow
def test_false_alarms_are_as_rare_as_stated() -> None:
    """In 60 experiments without any dependence: at most 5 % of them, at four deviations."""
    alarms = sum(
        any(d.p < 0.05 for d in find_dependences(*simulate(seed, 0.0))) for seed in range(60)
    )
    assert alarms <= 3 + 4.0 * np.sqrt(60 * 0.05 * 0.95)
