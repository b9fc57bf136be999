"""The base of all models."""

import math
from typing import Any

import pytest
from pydantic import ValidationError

from gen_data.config.base_model import Strict


class Values(Strict):
    number: float = 0.5
    whole: int = 1
    text: str = "x"
    flag: bool = True


@pytest.mark.parametrize(
    "wrong",
    [{"number": "1.5"}, {"number": True}, {"number": math.nan}, {"number": math.inf},
     {"whole": 1.0}, {"whole": "1"}, {"whole": True}, {"text": 1}, {"flag": 1}, {"flag": "true"},
     {"unknown": 1}],
)  # fmt: skip
def test_nothing_is_coerced_or_ignored(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Values(**wrong)


def test_models_are_frozen_whole_numbers_may_be_fractions_and_defaults_are_checked() -> None:
    """The only widening that loses nothing. A default is checked like any other value."""
    assert Values(number=2).number == 2.0
    values = Values()
    with pytest.raises(ValidationError):
        values.number = 1.0  # type: ignore[misc]
    assert values == Values()
    assert hash(values) == hash(Values())

    class Wrong(Strict):
        number: float = "no"  # type: ignore[assignment]

    with pytest.raises(ValidationError):
        Wrong()
