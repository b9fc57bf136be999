"""Which cases of a test the default run has, and which only CI (``pytest -m slow``)."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest

exhaustive = pytest.mark.exhaustive
slow = pytest.mark.slow
"""Takes more than about half a second of processor time, or repeats a quick test for more cases."""


def cases(values: Iterable[Any], quick: Collection[Any]) -> list[Any]:
    """Parameters of a test: all but the quick ones are slow."""
    return [value if value in quick else _slow(value) for value in values]


def sampled(values: Iterable[Any], step: int) -> list[Any]:
    """Parameters of a test: the first of every ``step`` is quick, the others are slow."""
    return [_slow(value) if i % step else value for i, value in enumerate(values)]


first_and_all = pytest.mark.parametrize(
    "how_many", ["first", pytest.param("all", marks=slow)], ids=str
)
"""A test of few members of each kind, and a slow one of all."""


def seeds(quick: int, count: int) -> pytest.MarkDecorator:
    """A test of the first seeds, a slow one of as many others, and an exhaustive one of the rest.

    As its argument ``seeds``.
    """
    named = [
        pytest.param(range(quick), id="first"),
        pytest.param(range(quick, 2 * quick), id="others", marks=slow),
        pytest.param(range(2 * quick, count), id="rest", marks=exhaustive),
    ]
    return pytest.mark.parametrize("seeds", named)


def _slow(value: Any) -> Any:
    return pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=slow)
