"""Tables of plug-ins."""

from __future__ import annotations

import pytest

from generator.core.errors import ConfigError
from generator.core.plugins import PluginTable

TABLE = PluginTable("noun", {"fraction": "fractions:Fraction", "decimal": "decimal:Decimal"})


def test_a_plug_in_is_loaded_by_its_name() -> None:
    """The module is imported when first asked for."""
    from fractions import Fraction

    assert TABLE.load("fraction") is Fraction


def test_names_are_sorted() -> None:
    """Whatever the order in the source."""
    assert TABLE.names() == ("decimal", "fraction")
    assert list(TABLE) == ["decimal", "fraction"]
    assert "decimal" in TABLE
    assert "float" not in TABLE


def test_an_unknown_name_is_told_with_all_known_ones() -> None:
    """And the nearest."""
    with pytest.raises(ConfigError) as caught:
        TABLE.load("fractoin")

    assert str(caught.value) == (
        "unknown noun 'fractoin'; expected one of decimal, fraction (did you mean 'fraction'?)"
    )
