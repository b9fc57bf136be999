"""Claims: scenes follow from the declared parameters, which follow their declared distributions.

The first claim ties the drawn values to the data set: scenes that are drawn again from its plan
must be the stored ones. The second judges these values. Tests are Kolmogorov and Smirnov's on
uniform scores; Holm's procedure bounds the probability that a correct data set fails any of them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from gen_data.core.errors import GenDataError, is_refused
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked
from gen_data.lab.certificate.uniform_scores import uniform_scores
from gen_data.report.drawn_parameters import Parameter

CERTAINTY = 0.99
"""Probability with which the stated deviation is found."""

CONSTANT_DEVIATION = 0.5
"""A parameter that always has the same value deviates by at least this from any distribution."""


@dataclass(frozen=True)
class Comparison:
    """One comparison of drawn values with their distribution.

    Attributes:
        name: Name of the parameter, with the number of the degree of freedom where it has several.
        n: Number of values.
        deviation: Largest difference of the cumulative shares, in [0, 1].
        p_value: Probability of such a deviation, or of a larger one, if the values follow it.
    """

    name: str
    n: int
    deviation: float
    p_value: float


def check_draws(examined: Examined) -> Iterator[Finding]:
    """Draw scenes again and compare them with the stored ones, number by number."""
    if examined.changes or not examined.scope.scenes:
        yield not_checked("", examined.changes or "no scene was drawn again")
        return
    try:
        replay = examined.replay
    except GenDataError as error:
        if is_refused(error):
            raise
        yield not_checked("", f"scenes cannot be drawn on this machine: {error}")
        return
    contradictions = Contradictions()
    for difference in replay.differences:
        contradictions.add(difference)
    rejected = sum(replay.rejections.values())
    yield contradictions.judge("", {"scenes": replay.scenes, "rejected layouts": rejected})


def check_parameters(examined: Examined) -> Iterator[Finding]:
    """Test the drawn values of every parameter."""
    (draws,) = check_draws(examined)
    if draws.figures.get("contradictions") != 0:
        yield not_checked("", draws.reason or "the drawn values differ from the data set")
        return
    parameters = examined.replay.parameters
    alpha = examined.scope.alpha
    contradictions = Contradictions()
    tests: list[Comparison] = []
    for name in sorted(parameters):
        made, impossible = _test_parameter(examined, parameters[name])
        tests += made
        if impossible:
            contradictions.add(f"{name}: {impossible} cannot be drawn from its distribution")
    able = [test for test in tests if can_refuse_constant(test.n, alpha / len(tests))]
    if not able and not contradictions.count:
        yield not_checked(
            "",
            f"{examined.replay.scenes} scenes give too few values; expected more samples, or more "
            "--scenes",
        )
        return
    for test in refused(able, alpha):
        contradictions.add(
            f"{test.name}: {test.n} values deviate by {test.deviation:.3f} from the declared "
            f"distribution (p = {test.p_value:.1e})"
        )
    fewest = min((test.n for test in able), default=0)
    yield contradictions.judge(
        "",
        {
            "tests": len(able),
            "tests with too few values": len(tests) - len(able),
            "false-alarm rate of all tests": alpha,
            "fewest values": fewest,
            "deviation found with 99 %": round(found_deviation(fewest, alpha / len(able)), 3)
            if able
            else 1.0,
        },
    )


def refused(tests: Sequence[Comparison], alpha: float) -> Iterator[Comparison]:
    """Tests that refuse, the most significant first.

    Holm, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of
    Statistics 6, 1979: the probability that any correct parameter is refused is at most ``alpha``,
    whatever the dependence between the tests.
    """
    ordered = sorted(tests, key=lambda test: (test.p_value, test.name))
    for place, test in enumerate(ordered):
        if test.p_value > alpha / (len(ordered) - place):
            return
        yield test


def compare_with_uniform(name: str, scores: Sequence[float]) -> Comparison:
    """Test numbers for being uniform in [0, 1]: the exact two-sided test for any ``n``.

    Kolmogorov 1933; p-values by Simard and L'Ecuyer, "Computing the two-sided Kolmogorov-Smirnov
    distribution", Journal of Statistical Software 39, 2011, as in SciPy.
    """
    from scipy import stats

    result = stats.kstest(scores, "uniform", method="exact")
    return Comparison(name, len(scores), float(result.statistic), float(result.pvalue))


def can_refuse_constant(n: int, level: float) -> bool:
    """Whether ``n`` values suffice to refuse, at a level, a parameter that never varies."""
    from scipy import stats

    return bool(stats.kstwo.sf(CONSTANT_DEVIATION, n) <= level)


def found_deviation(n: int, level: float) -> float:
    """Deviation of the true distribution that ``n`` values reveal with 99 %, at a level.

    By the inequality of Dvoretzky, Kiefer and Wolfowitz with Massart's constant (Annals of
    Probability 18, 1990), applied twice: a sufficient deviation; at most 1.
    """
    margins = (math.log(2.0 / level), math.log(2.0 / (1.0 - CERTAINTY)))
    return min(1.0, sum(math.sqrt(margin / (2.0 * n)) for margin in margins))


def _test_parameter(examined: Examined, parameter: Parameter) -> tuple[list[Comparison], str]:
    """Tests of all degrees of freedom, and a value that cannot be drawn, in words."""
    rng = examined.rng(f"parameters/{parameter.name}")
    columns: dict[int, list[float]] = {}
    for distribution, value in parameter.firsts:
        scores = uniform_scores(distribution, value, rng)
        if scores is None:
            return [], repr(value)
        for place, score in enumerate(scores):
            columns.setdefault(place, []).append(score)
    return [compare_with_uniform(n, scores) for n, scores in _named(parameter.name, columns)], ""


def _named(name: str, columns: Mapping[int, list[float]]) -> Iterator[tuple[str, list[float]]]:
    for place, scores in columns.items():
        yield (f"{name}[{place}]" if len(columns) > 1 else name), scores
