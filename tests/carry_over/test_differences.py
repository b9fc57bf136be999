"""Distances of distributions, and whether chance explains them."""

import numpy as np
import pytest
from scipy.stats import wasserstein_distance

from gen_data.lab.carry_over.differences import Row, compare
from gen_data.lab.carry_over.statistics import Values


def values(drawn: np.ndarray) -> Values:
    """Five values of each unit."""
    return Values(drawn, np.arange(drawn.size) // 5)


def compared(real: dict[str, np.ndarray], ours: dict[str, np.ndarray]) -> dict[str, Row]:
    """Rows of the class ``car`` by quantity."""
    sides = [{("car", name): values(v) for name, v in side.items()} for side in (real, ours)]
    units = [max(v.size for v in side.values()) // 5 for side in (real, ours)]
    rows = compare(sides[0], sides[1], *units)[0]
    return {row.quantity: row for row in rows}


def test_the_distance_is_scipys_over_the_real_deviation() -> None:
    """Of logarithms to base 2 where ratios count; with unequal numbers of values."""
    rng = np.random.default_rng(0)
    real = {"bottom m": rng.normal(1.5, 0.3, 200), "distance m": rng.lognormal(3, 0.5, 200)}
    ours = {"bottom m": rng.normal(1.6, 0.1, 150), "distance m": rng.lognormal(3.5, 0.6, 150)}
    rows = compared(real, ours)
    expected = wasserstein_distance(real["bottom m"], ours["bottom m"]) / real["bottom m"].std()
    assert rows["bottom m"].apart == pytest.approx(expected)
    a, b = np.log2(real["distance m"]), np.log2(ours["distance m"])
    assert rows["distance m"].apart == pytest.approx(wasserstein_distance(a, b) / a.std())
    assert rows["bottom m"].direction == "narrower"
    assert rows["distance m"].direction == "larger"
    np.testing.assert_allclose(
        rows["bottom m"].real, np.quantile(real["bottom m"], [0.1, 0.5, 0.9])
    )
    assert [*rows] == ["distance m", "bottom m"]


def test_equal_sets_differ_in_nothing_and_what_is_not_compared_is_named() -> None:
    """Unoccluded objects on both sides: no difference, and no division by 0."""
    rows = compared({"occlusion": np.zeros(100)}, {"occlusion": np.zeros(100)})
    assert (rows["occlusion"].apart, rows["occlusion"].differs) == (0.0, False)
    rng = np.random.default_rng(1)
    side = {"grey": rng.normal(90, 20, 100), "count": rng.poisson(3, 100).astype(float)}
    assert not any(row.differs for row in compared(side, side).values())
    # Classes with fewer than ten values on a side, and quantities that one side never states.
    few, many = values(np.ones(9)), values(np.ones(100))
    real = {("car", "grey"): few, ("bus", "grey"): many, ("bus", "occlusion"): many}
    assert compare(real, {("car", "grey"): many}, 20, 20) == ((), ("car", "bus"), ("occlusion",))


@pytest.mark.slow
def test_sets_of_one_kind_differ_in_one_of_twenty_comparisons() -> None:
    """Five rows of values that depend on their picture, of 20 and 30 pictures.

    Of 100 comparisons, 5 are expected; more than 10 have a probability of 1 % (binomial).
    """
    rng = np.random.default_rng(2)
    names = ("grey", "bottom m", "centre x", "centre y", "truncation")

    def draw(units: int) -> dict[str, np.ndarray]:
        shared = np.repeat(rng.normal(0, 1, units), 5)
        return {name: shared + rng.standard_t(3, shared.size) for name in names}

    alarms = sum(
        any(row.apart > row.chance for row in compared(draw(20), draw(30)).values())
        for _ in range(100)
    )

    assert 1 <= alarms <= 10
