"""Goodness of fit of every distribution over numbers, names and flags.

Seeds are fixed, so each test passes or fails for good. ALPHA is the rate at which a correct sampler
would have been refused by one test, had the seed been chosen at random.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

from gen_data.config.distributions import (
    Choice,
    Constant,
    Distribution,
    LogUniform,
    Normal,
    Probability,
    Sequence,
    Uniform,
    UniformInteger,
)
from gen_data.core.streams import Rng, Streams

ALPHA = 1e-4
DRAWS = 20_000


def stream(name: str) -> Rng:
    return Streams(seed=20_240_229, scene=0).rng(name)


def drawn(distribution: Distribution[Any], n: int = DRAWS) -> list[Any]:
    rng = stream(repr(distribution))
    return [distribution.draw(rng) for _ in range(n)]


CONTINUOUS: list[tuple[Distribution[float], Callable[[Any], Any]]] = [
    (Uniform(-2, 5), stats.uniform(-2, 7).cdf),
    (LogUniform(0.01, 100), stats.loguniform(0.01, 100).cdf),
    (LogUniform(200, 2000), stats.loguniform(200, 2000).cdf),
    (Normal(3, 2), stats.norm(3, 2).cdf),
    (Normal(0.5, 0.2, clip=(0, 1)), stats.truncnorm(-2.5, 2.5, 0.5, 0.2).cdf),
    (Normal(0, 1, clip=(0.5, 3)), stats.truncnorm(0.5, 3).cdf),
    (Normal(0, 1, clip=(-3, -2)), stats.truncnorm(-3, -2).cdf),
    (Normal(0, 1, clip=(6, 9)), stats.truncnorm(6, 9).cdf),
    (Normal(0, 1, clip=(-30, -20)), stats.truncnorm(-30, -20).cdf),
    (Normal(0, 1e6, clip=(0, 1)), stats.uniform(0, 1).cdf),
]


@pytest.mark.parametrize(("distribution", "cdf"), CONTINUOUS, ids=lambda v: repr(v)[:50])
def test_continuous_distributions_have_their_cumulative_distribution(
    distribution: Distribution[float], cdf: Callable[[Any], Any]
) -> None:
    """Kolmogorov-Smirnov against scipy, false-alarm rate 1e-4 each."""
    assert stats.kstest(drawn(distribution), cdf).pvalue > ALPHA


# The first four agree with scipy's inverse distributions at the raw bits of Philox.
GOLDEN: list[Any] = [
    0.8512820341025465, 578.333549348, 0.45948381005, 0.578597482361, 7,
    "matte", 2.0, "b", True, 0.9820637945546551,
]  # fmt: skip

DISCRETE: list[tuple[Distribution[Any], dict[Any, float]]] = [
    (UniformInteger(3, 12), dict.fromkeys(range(3, 13), 0.1)),
    (UniformInteger(-1, 1), {-1: 1 / 3, 0: 1 / 3, 1: 1 / 3}),
    (Choice(("a", "b", "c", "d")), dict.fromkeys("abcd", 0.25)),
    (Choice({"matte": 3, "glossy": 1}), {"matte": 0.75, "glossy": 0.25}),
    (Choice({1.0: 0.1, 2.0: 0.2, 3.0: 0.7}), {1.0: 0.1, 2.0: 0.2, 3.0: 0.7}),
    (Probability(0.3), {True: 0.3, False: 0.7}),
    (Probability(0.001), {True: 0.001, False: 0.999}),
]


@pytest.mark.parametrize(("distribution", "shares"), DISCRETE, ids=lambda v: repr(v)[:50])
def test_discrete_distributions_have_their_frequencies(
    distribution: Distribution[Any], shares: dict[Any, float]
) -> None:
    """Chi-square over all values, false-alarm rate 1e-4 each; no other value is ever drawn."""
    values = drawn(distribution)
    counts = [values.count(value) for value in shares]

    assert sum(counts) == DRAWS
    assert stats.chisquare(counts, [share * DRAWS for share in shares.values()]).pvalue > ALPHA


def test_values_without_weight_are_never_drawn() -> None:
    """Also at the very ends of the unit interval."""

    class Ends:
        def __init__(self, value: float) -> None:
            self.value = value

        def random(self) -> float:
            return self.value

    choice = Choice({"never": 0, "a": 1, "nor this": 0, "b": 3, "last": 0})

    assert choice.draw(Ends(0.0)) == "a"  # type: ignore[arg-type]
    assert choice.draw(Ends(np.nextafter(0.25, 0))) == "a"  # type: ignore[arg-type]
    assert choice.draw(Ends(0.25)) == "b"  # type: ignore[arg-type]
    assert choice.draw(Ends(1 - 2**-53)) == "b"  # type: ignore[arg-type]
    assert Choice({"a": 1e-300, "b": 0}).draw(Ends(1 - 2**-53)) == "a"  # type: ignore[arg-type]


def test_a_normal_is_finite_at_the_ends_of_the_unit_interval() -> None:
    """The smallest and largest random number give the far tails, not infinity."""

    class Ends:
        def __init__(self, value: float) -> None:
            self.value = value

        def random(self) -> float:
            return self.value

    assert -9 < Normal(0, 1).draw(Ends(0.0)) < -8  # type: ignore[arg-type]
    assert 8 < Normal(0, 1).draw(Ends(1 - 2**-53)) < 9  # type: ignore[arg-type]
    assert Normal(0, 1, (-2, 1)).draw(Ends(0.0)) == -2  # type: ignore[arg-type]
    assert Normal(0, 1, (-2, 1)).draw(Ends(1 - 2**-53)) == 1  # type: ignore[arg-type]


@pytest.mark.parametrize("distribution", [
    Uniform(0, 1), LogUniform(1, 9), Normal(0, 1, clip=(-1, 1)), Choice({"a": 1, "b": 2}),
])  # fmt: skip
def test_each_value_costs_exactly_one_random_number(distribution: Distribution[Any]) -> None:
    """So that a difference in the last bit never shifts the draws that follow."""
    rng, reference = stream("cost"), stream("cost")

    for _ in range(100):
        distribution.draw(rng)
        reference.random()

    assert rng.random() == reference.random()


@pytest.mark.parametrize("distribution", [Constant(1.0), Sequence((1.0, 2.0))])
def test_constants_and_sequences_cost_no_random_number(distribution: Distribution[Any]) -> None:
    rng, reference = stream("cost"), stream("cost")

    distribution.draw(rng)

    assert rng.random() == reference.random()


def test_drawn_values_are_pinned() -> None:
    """Ten numbers; if they change, every data set changes, and that is a breaking release."""
    rng = Streams(seed=7, scene=3, view=1, attempt=2, index=16).rng("randomizer/golden")

    values = [
        Uniform(0.6, 1.2).draw(rng), LogUniform(200, 2000).draw(rng), Normal(0.5, 0.1).draw(rng),
        Normal(0.5, 0.1, clip=(0, 0.6)).draw(rng), UniformInteger(3, 12).draw(rng),
        Choice({"matte": 3, "glossy": 1}).draw(rng), Choice((1.0, 2.0, 3.0)).draw(rng),
        Sequence(("a", "b", "c")).draw(rng), Probability(0.3).draw(rng), Uniform(-1, 1).draw(rng),
    ]  # fmt: skip

    assert values == GOLDEN
