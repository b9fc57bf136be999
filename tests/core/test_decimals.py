"""Rounding to decimals, against ``round``."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gen_data.core.decimals import round_near, round_rows

DECIMALS = (2, 3, 6, 8)


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(-0.0)
@example(-4e-9)
@example(2.5e-6)
@example(0.1234565)
@example(8796093.0222085)
@settings(max_examples=1000, deadline=None, derandomize=True)
def test_numbers_are_rounded_to_the_bits_of_round(value: float) -> None:
    for decimals in DECIMALS:
        expected = round(value, decimals)
        got = round_near(value, 10.0**decimals, decimals)
        assert (got, math.copysign(1.0, got)) == (expected, math.copysign(1.0, expected))


@pytest.mark.parametrize("decimals", DECIMALS)
def test_rows_are_rounded_to_the_bits_of_round(decimals: int) -> None:
    """Every other number is in the middle between two decimals, or next to it."""
    middles = (np.arange(-3000, 3000) + 0.5) / 10**decimals
    near = np.nextafter(middles, np.where(np.arange(6000) % 3, np.inf, -np.inf))
    others = np.random.default_rng(decimals).normal(0.0, 100.0, 6000)
    values = np.stack([middles, near, others], axis=1)

    got = round_rows(values, decimals)

    assert got == [[round(x, decimals) + 0.0 for x in row] for row in values.tolist()]
    assert not np.signbit(np.array(got)[np.array(got) == 0.0]).any()
