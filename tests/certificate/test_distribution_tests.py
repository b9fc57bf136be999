"""Statistics of the claim on distributions: uniform scores, false-alarm rates, power.

Seeds are fixed, so each test passes or fails for good. ALPHA is the rate at which correct code
would have been refused by one test, had the seed been chosen at random.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from gen_data.config.distributions import (
    AboutZ,
    Box,
    Cap,
    Choice,
    Constant,
    Distribution,
    LogUniform,
    Mixture,
    Normal,
    Probability,
    Sequence,
    Shell,
    So3,
    Sphere,
    Uniform,
    UniformInteger,
)
from gen_data.core.streams import Rng, Streams
from gen_data.lab.certificate.finding import Finding, Status
from gen_data.lab.certificate.parameters import (
    Comparison,
    can_refuse_constant,
    check_parameters,
    compare_with_uniform,
    found_deviation,
    refused,
)
from gen_data.lab.certificate.uniform_scores import uniform_scores
from gen_data.report.drawn_parameters import Parameter
from tests.tiers import sampled

ALPHA = 1e-4
DRAWS = 5_000

DISTRIBUTIONS: list[tuple[Distribution[Any], int]] = [
    (Uniform(-2, 5), 1), (LogUniform(0.01, 100), 1), (Normal(3, 2), 1),
    (Normal(0.5, 0.2, clip=(0, 1)), 1), (Normal(0, 1, clip=(2, 9)), 1), (UniformInteger(3, 12), 1),
    (Choice(("a", "b", "c")), 1), (Choice({"matte": 3, "glossy": 1, "never": 0}), 1),
    (Probability(0.3), 1), (Mixture((Uniform(0, 2), Uniform(1, 5), Constant(1.5)), (1, 2, 1)), 1),
    (Mixture((UniformInteger(0, 3), Constant(9.0)), (3, 1)), 1),
    (Mixture((LogUniform(1, 9), Normal(4, 1, clip=(2, 8))), (1, 1)), 1), (So3(), 3), (AboutZ(), 1),
    (AboutZ((-30.0, 100.0)), 1), (Sphere(), 2), (Cap((1.0, 2.0, -0.5), 40.0), 2),
    (Cap((0.0, 0.0, 1.0), 180.0), 2), (Box((0.0, -1.0, 2.0), (1.0, 1.0, 2.0)), 2),
    (Shell((1.0, 2.0, 3.0), (0.5, 2.0), (-10.0, 60.0)), 3), (Shell((1.0, 2.0, 3.0), (2.0, 2.0)), 2),
]  # fmt: skip
"""With their degrees of freedom."""


def stream(name: str) -> Rng:
    return Streams(seed=20_261_123, scene=0).rng(name)


def scores_of(distribution: Distribution[Any], n: int = DRAWS) -> np.ndarray:
    """Scores of drawn values, [n, degrees of freedom]."""
    rng = stream(repr(distribution))
    made = [uniform_scores(distribution, distribution.draw(rng), rng) for _ in range(n)]
    return np.array(made)


@pytest.mark.parametrize(
    ("distribution", "freedom"), sampled(DISTRIBUTIONS, 4), ids=lambda v: repr(v)[:50]
)
def test_scores_of_drawn_values_are_uniform_and_independent(
    distribution: Distribution[Any], freedom: int
) -> None:
    """Kolmogorov-Smirnov per degree of freedom; no rank correlation between two of them."""
    scores = scores_of(distribution)
    assert scores.shape == (DRAWS, freedom)
    for column in scores.T:
        assert stats.kstest(column, "uniform").pvalue > ALPHA
    for k in range(freedom):
        for j in range(k):
            assert stats.spearmanr(scores[:, k], scores[:, j]).pvalue > ALPHA


IMPOSSIBLE: list[tuple[Distribution[Any], Any]] = [
    *((Uniform(0, 1), 1.001), (Uniform(2, 2), 2.1), (LogUniform(1, 2), 0.9)),
    *((Normal(0, 1, clip=(-1, 1)), 1.5), (UniformInteger(1, 3), 4), (UniformInteger(1, 3), 1.5)),
    *((Choice({"a": 1, "b": 0}), "b"), (Choice(("a", "b")), "c"), (Probability(0.0), True)),
    *((AboutZ((0.0, 90.0)), (0.0, 0.0, 0.0, 1.0)), (AboutZ(), (0.6, 0.8, 0.0, 0.0))),
    (Cap((0.0, 0.0, 1.0), 30.0), (1.0, 0.0, 0.0)),
    (Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), (0.5, 0.5, 1.5)),
    (Shell((0.0, 0.0, 0.0), (1.0, 2.0)), (0.0, 0.0, 0.5)),
]
FIXED: list[tuple[Distribution[Any], Any]] = [
    *((Constant(3.0), 3.0), (Sequence((1, 2)), 2), (Uniform(2, 2), 2.0), (Probability(1.0), True)),
    *((UniformInteger(4, 4), 4), (Choice(("only",)), "only"), (Normal(1.0, 0.0), 1.0)),
]


@pytest.mark.parametrize(
    ("distribution", "value", "scores"),
    [*((*row, None) for row in IMPOSSIBLE), *((*row, ()) for row in FIXED)],
    ids=lambda v: repr(v)[:50],
)
def test_values_that_cannot_be_drawn_and_fixed_ones_have_no_scores(
    distribution: Distribution[Any], value: Any, scores: tuple[float, ...] | None
) -> None:
    """None fails the claim, whatever the number of values; of no randomness, nothing is tested."""
    assert uniform_scores(distribution, value, stream("impossible")) == scores


@pytest.mark.slow
def test_p_values_of_true_parameters_are_uniform_and_families_fail_at_the_rate() -> None:
    """Of 2,000 tests of 40 values each: their rate of refusals is the level, for any level."""
    rng = np.random.default_rng(5)
    p_values = [compare_with_uniform("x", rng.random(40)).p_value for _ in range(2_000)]
    assert stats.kstest(p_values, "uniform").pvalue > ALPHA
    # 30 independent uniform p-values each: Holm refuses 1 - (1 - alpha / 30)^30 of the families.
    # The expected rate at alpha = 0.05 is 0.0488; the number in 20,000 families is binomial.
    alpha, tests, families = 0.05, 30, 20_000
    p_values = np.random.default_rng(6).random((families, tests))
    alarms = sum(
        any(refused([Comparison(str(k), 40, 0.1, p) for k, p in enumerate(row)], alpha))
        for row in p_values
    )
    expected = 1.0 - (1.0 - alpha / tests) ** tests
    assert stats.binomtest(alarms, families, expected).pvalue > ALPHA
    assert expected <= alpha


def test_holm_names_what_bonferroni_would_not() -> None:
    """The smallest p-value is compared with alpha / 4, the next one with alpha / 3, and so on."""
    p_values = {"d": 0.5, "a": 0.01, "c": 0.04, "b": 0.03}
    family = [Comparison(name, 9, 0.5, p) for name, p in p_values.items()]
    # 0.01 <= 0.1 / 4, 0.03 <= 0.1 / 3, 0.04 <= 0.1 / 2, 0.5 > 0.1; Bonferroni refuses a only.
    assert [test.name for test in refused(family, 0.1)] == ["a", "b", "c"]
    assert list(refused([], 0.1)) == []


def test_a_stated_deviation_is_found_as_often_as_stated_and_a_constant_of_30() -> None:
    """Values of which a share is 0: at least 99 % of 400 samples of 200 values are refused."""
    n, level = 200, 1e-3 / 40
    share = found_deviation(n, level)
    rng = np.random.default_rng(7)
    found = 0
    for _ in range(400):
        values = np.where(rng.random(n) < share, 0.0, rng.random(n))
        found += compare_with_uniform("x", values).p_value <= level
    assert 0.2 < share < 0.4
    # A rate of 0.99 gives fewer than 388 with probability 1e-4.
    assert found >= 388
    # The largest deviation of a constant is at least 1/2; 2 exp(-2 n / 4) bounds its p-value.
    assert not can_refuse_constant(10, level)
    assert can_refuse_constant(30, level)
    assert compare_with_uniform("x", [0.5] * 30).p_value <= level


def examined(*parameters: Parameter, scenes: int = 100) -> Any:
    """A stand-in for a data set whose scenes gave these values."""
    replay = SimpleNamespace(
        parameters={p.name: p for p in parameters}, scenes=scenes, differences=[], rejections={}
    )
    scope = SimpleNamespace(alpha=1e-3, scenes=scenes)
    return SimpleNamespace(changes="", replay=replay, scope=scope, rng=stream)


def drawn(name: str, distribution: Distribution[Any], values: Any) -> Parameter:
    return Parameter(name, firsts=[(distribution, value) for value in values])


def check(*parameters: Parameter) -> Finding:
    (finding,) = check_parameters(examined(*parameters))
    return finding


def test_a_parameter_that_never_varies_is_named_and_values_judged_by_their_own() -> None:
    """Among others that are drawn as declared."""
    rng = stream("good")
    good = [drawn(f"good{k}", Uniform(0, 1), rng.random(60)) for k in range(20)]
    finding = check(*good, drawn("orbit.distance_m", Uniform(0.9, 1.5), [1.3] * 60))
    assert finding.status is Status.FAILED
    assert finding.evidence[0].startswith("orbit.distance_m: 60 values deviate by 0.667")
    assert len(finding.evidence) == 1
    assert check(*good).status is Status.PASSED
    # As of a parameter that depends on a shared value: each value by its own distribution.
    rng = stream("switch")
    wide, narrow = Uniform(0, 10), Uniform(4, 5)
    mixed = [(d, d.draw(rng)) for d in (wide, narrow) * 30]
    wrong = [(wide, narrow.draw(rng)) for _ in range(60)]
    assert check(Parameter("gap_m", firsts=mixed)).status is Status.PASSED
    assert check(Parameter("gap_m", firsts=wrong)).status is Status.FAILED


def test_one_value_outside_its_distribution_suffices_and_few_others_are_no_success() -> None:
    """The finding says what would help."""
    outside = check(drawn("count", UniformInteger(1, 3), [1, 4]))
    few = check(drawn("orbit.distance_m", Uniform(0.9, 1.5), [1.0, 1.4]))
    assert (outside.status, few.status) == (Status.FAILED, Status.NOT_CHECKED)
    assert "count: 4 cannot be drawn" in outside.evidence[0]
    assert "more samples" in few.reason
