"""Tables of plug-ins."""

from typing import Literal, Protocol

import pytest
from pydantic import BaseModel

from gen_data.core.errors import ConfigError
from gen_data.core.plugins import PluginTable

TABLE = PluginTable("noun", {"fraction": "fractions:Fraction", "decimal": "decimal:Decimal"})


def test_a_plug_in_is_loaded_by_its_name_and_an_unknown_name_told_with_all() -> None:
    from fractions import Fraction

    assert TABLE.load("fraction") is Fraction

    assert TABLE.names() == ("decimal", "fraction")
    assert list(TABLE) == ["decimal", "fraction"]
    assert "decimal" in TABLE
    assert "float" not in TABLE

    with pytest.raises(ConfigError) as caught:
        TABLE.load("fractoin")

    assert str(caught.value) == (
        "unknown noun 'fractoin'; expected one of decimal, fraction (did you mean 'fraction'?)"
    )


class Complete(BaseModel):
    """A class with every member, and its name in the table."""

    type: Literal["complete"] = "complete"
    size: int = 0

    def area(self) -> int:
        return self.size**2


class Lacking(BaseModel):
    type: Literal["lacking"] = "lacking"
    size: int = 0


class Misnamed(Complete):
    """Its field has another name than the table."""


class Plain:
    type = "plain"
    size = 0

    def area(self) -> int:
        return 0


class Square(Protocol):
    @property
    def size(self) -> int: ...

    def area(self) -> int: ...


SQUARES = PluginTable[Square](
    "square",
    {name.lower(): f"{__name__}:{name}" for name in ("Complete", "Lacking", "Misnamed", "Plain")}
    | {"gone": "no_such_module:Class", "absent": f"{__name__}:NoSuchClass"},
    (Square,),
)


def test_a_complete_plug_in_is_loaded() -> None:
    """Every member of the Protocol, and the field ``type``."""
    assert SQUARES.load("complete") is Complete


@pytest.mark.parametrize(("name", "fault"), [
    ("lacking", r"square 'lacking': .*:Lacking lacks area; see .*interfaces.Square"),
    ("misnamed", r'Misnamed needs a field `type: Literal\["misnamed"\] = "misnamed"`'),
    ("plain", "Plain cannot be read from YAML: derive it from .*Strict"),
    ("gone", "square 'gone': no_such_module:Class cannot be imported: No module named"),
    ("absent", "square 'absent': .*:NoSuchClass cannot be imported: .*NoSuchClass"),
])  # fmt: skip
def test_a_class_that_is_no_plug_in_is_refused_with_the_reason(name: str, fault: str) -> None:
    """When it is loaded, not when the missing member is used."""
    with pytest.raises(ConfigError, match=fault):
        SQUARES.load(name)
