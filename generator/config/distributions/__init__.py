"""A number is a constant; a one-key mapping is a distribution.

``roughness: 0.5`` or ``roughness: {uniform: [0.1, 0.9]}``. In Python the same types are frozen
values: ``Uniform(0.1, 0.9).draw(rng)``. Models declare fields as ``Scalar``, ``Count``, ``Name``,
``Flag``, ``Chance``, ``Rotation``, ``Direction`` or ``Position``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import TypeAdapter
from pydantic_core import core_schema

from gen_data.config.distributions.base import (
    DISTRIBUTIONS,
    Distribution,
    Kind,
    Malformed,
    Numeric,
    Vector,
    distribution,
    distribution_names,
    read_distribution,
    read_number,
    reader,
)
from gen_data.config.distributions.discrete import Choice, Constant, Probability, Sequence
from gen_data.config.distributions.mixture import Mixture
from gen_data.config.distributions.numeric import LogUniform, Normal, Uniform, UniformInteger
from gen_data.config.distributions.space import (
    AboutZ,
    Box,
    Cap,
    EulerDeg,
    QuaternionWxyz,
    Shell,
    So3,
    Sphere,
    UnitQuaternion,
    UnitVector,
)
from gen_data.config.yaml_scalars import format_number, quote_value
from gen_data.core.errors import did_you_mean
from gen_data.core.se3 import Quaternion, Vec3

__all__ = [
    "CHANCE", "DIRECTION", "DISTRIBUTIONS", "DISTRIBUTION_TITLE", "FLAG", "MEANT", "NAME", "NUMBER",
    "POSITION", "ROTATION", "WHOLE_NUMBER", "AboutZ", "Bounds", "Box", "Cap", "Chance", "Choice",
    "Constant", "Count", "Direction", "Distribution", "EulerDeg", "FieldOf", "Flag", "LogUniform",
    "Malformed", "Mixture", "Name", "NonNegative", "Normal", "Numeric", "OneOf", "Position",
    "Positive", "Probability", "QuaternionWxyz", "Rotation", "Scalar", "Sequence", "Shell", "So3",
    "Sphere", "Uniform", "UniformInteger", "UnitInterval", "distribution_schema",
]  # fmt: skip

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler


DISTRIBUTION_TITLE = "distribution of "
"""Prefix of the titles of distributions in JSON Schema."""

MEANT = {"yes": "true", "on": "true", "no": "false", "off": "false"}
"""Booleans of YAML 1.1 that YAML 1.2 reads as text."""


@dataclass(frozen=True)
class FieldOf:
    """Marks a field that holds a distribution over one kind of value."""

    kind: Kind[Any]

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Read plain data or a distribution; write plain data."""
        del source, handler
        return core_schema.no_info_plain_validator_function(
            self._read,
            serialization=core_schema.plain_serializer_function_ser_schema(lambda v: v.to_yaml()),
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """A constant, or any one-key mapping of a distribution that fits."""
        del schema, handler
        return distribution_schema(self.kind)

    def _read(self, value: Any) -> Distribution[Any]:
        return read_distribution(value, self.kind)


@dataclass(frozen=True)
class Bounds:
    """Every value that can be drawn must lie between two numbers.

    ``Annotated[Scalar, Bounds(1, 170)]``; also fits plain ``int`` and ``float`` fields.

    Attributes:
        open_low, open_high: The end itself is excluded.
    """

    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    open_high: bool = False

    def __contains__(self, value: float) -> bool:
        """Whether the number lies within."""
        above = self.low < value if self.open_low else self.low <= value
        below = value < self.high if self.open_high else value <= self.high
        return above and below

    def __str__(self) -> str:
        """Interval notation, or a comparison where one end is free: ``(1, 170)``, ``>= 0``."""
        if math.isinf(self.high):
            return f"{'>' if self.open_low else '>='} {format_number(self.low)}"
        if math.isinf(self.low):
            return f"{'<' if self.open_high else '<='} {format_number(self.high)}"
        left, right = "(" if self.open_low else "[", ")" if self.open_high else "]"
        return f"{left}{format_number(self.low)}, {format_number(self.high)}{right}"

    def check(self, value: Any) -> Any:
        """The value itself. Raises Malformed unless all it can be lies within."""
        if not isinstance(value, Numeric):
            low = high = value
        else:
            low, high = value.support()
        if low in self and high in self:
            return value
        if low == high:
            raise Malformed(f"{format_number(low)} is not {self.within()}")
        outside = low if low not in self else high
        if math.isinf(outside):
            raise Malformed(
                f"{value.name} has no limits, but every value must be {self.within()}; add a clip"
            )
        raise Malformed(
            f"{value.name} can give {format_number(outside)}, but every value must be "
            f"{self.within()}"
        )

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Check after reading."""
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The same schema, with the limits on its constant."""
        inner = handler(schema)
        target = next((o for o in inner.get("anyOf", ()) if "type" in o), inner)
        if not math.isinf(self.low):
            target["exclusiveMinimum" if self.open_low else "minimum"] = self.low
        if not math.isinf(self.high):
            target["exclusiveMaximum" if self.open_high else "maximum"] = self.high
        return inner

    def within(self) -> str:
        """The limits as part of a sentence: ``in (1, 170)``, ``>= 0``."""
        return str(self) if math.isinf(self.low) or math.isinf(self.high) else f"in {self}"


@dataclass(frozen=True)
class OneOf:
    """Every name that can be drawn must be one of a few: ``Annotated[Name, OneOf(("a", "b"))]``."""

    names: tuple[str, ...]

    def check(self, value: Distribution[str]) -> Distribution[str]:
        """The distribution itself. Raises Malformed unless all it can give is known."""
        for name in value.outcomes():
            if name not in self.names:
                raise Malformed(
                    f"there is no {quote_value(name)}; expected one of {', '.join(self.names)}"
                    f"{did_you_mean(name, self.names)}"
                )
        return value

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Check after reading."""
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The same schema, with the names of its constant."""
        inner = handler(schema)
        inner["anyOf"][0]["enum"] = list(self.names)
        return inner


def distribution_schema(kind: Kind[Any]) -> dict[str, Any]:
    """JSON Schema of a field that holds a distribution over ``kind``."""
    names = distribution_names(kind.name)
    options: list[dict[str, Any]] = []
    bare = [name for name in names if distribution(name).bare]
    if bare:
        options.append({"enum": bare, "description": "a distribution without argument"})
    for name in names:
        found = distribution(name)
        options.append(
            {
                "type": "object",
                "description": (found.__doc__ or name).partition("\n")[0],
                "properties": {name: found.schema(kind.schema)},
                "required": [name],
                "additionalProperties": False,
            }
        )
    distributions = {"title": f"{DISTRIBUTION_TITLE}{kind.name}", "anyOf": options}
    return {"anyOf": [{**kind.schema, "description": kind.expected}, distributions]}


def _plain(
    expected: str, types: tuple[type, ...], hint: Callable[[Any], str]
) -> Callable[[Any], Any]:
    """A reader of plain values of some types; ``hint`` names alternatives."""

    def read_plain(value: Any) -> Any:
        if type(value) not in types:
            raise Malformed(f"expected {expected}, got {quote_value(value)}{hint(value)}")
        return read_number(value) if float in types else value

    return read_plain


def _range_hint(name: str) -> Callable[[Any], str]:
    def hint(value: Any) -> str:
        is_range = isinstance(value, (list, tuple)) and len(value) == 2
        return f" (did you mean {{{name}: {quote_value(value)}}}?)" if is_range else ""

    return hint


def _quote_hint(value: Any) -> str:
    return "; put it in quotes" if isinstance(value, (bool, int, float)) else ""


def _flag_hint(value: Any) -> str:
    meant = MEANT.get(str(value).lower())
    return f" (did you mean {meant}?)" if meant else ""


def _spatial(name: str, expected: str, annotation: Any) -> Kind[Any]:
    """A kind whose constants are lists of numbers."""
    schema = TypeAdapter(annotation).json_schema()
    return Kind(name, expected, reader(annotation), schema)


_read_scalar = _plain("a number or a distribution", (int, float), _range_hint("uniform"))
_read_count = _plain("a whole number or a distribution", (int,), _range_hint("uniform_integer"))
_read_name = _plain("a name or a distribution", (str,), _quote_hint)
_read_flag = _plain("true, false or {probability: p}", (bool,), _flag_hint)
_read_chance = _plain("a probability in [0, 1], true or false", (bool,), _flag_hint)

NUMBER = Kind("number", "a number", _read_scalar, {"type": "number"})
WHOLE_NUMBER = Kind("whole number", "a whole number", _read_count, {"type": "integer"})
NAME = Kind("name", "a name", _read_name, {"type": "string"})
FLAG = Kind("flag", "true or false", _read_flag, {"type": "boolean"})
CHANCE = replace(
    FLAG,
    expected="a probability in [0, 1], true or false",
    read=_read_chance,
    schema={"anyOf": [{"type": "number", "minimum": 0, "maximum": 1}, FLAG.schema]},
    of_number="probability",
)
ROTATION = _spatial("rotation", "a rotation [w, x, y, z]", UnitQuaternion)
DIRECTION = _spatial("direction", "a direction [x, y, z]", UnitVector)
POSITION = _spatial("position", "a position [x, y, z]", Vector)

Scalar = Annotated[Numeric[float], FieldOf(NUMBER)]
"""A number, or a distribution over numbers."""
Count = Annotated[Numeric[int], FieldOf(WHOLE_NUMBER), Bounds(low=0)]
"""A whole number >= 0, or a distribution over such."""
Name = Annotated[Distribution[str], FieldOf(NAME)]
"""A name, or a distribution over names."""
Flag = Annotated[Numeric[bool], FieldOf(FLAG)]
"""True, false, or a distribution over both."""
Chance = Annotated[Numeric[bool], FieldOf(CHANCE)]
"""A Flag whose plain number is the probability of true."""
Rotation = Annotated[Distribution[Quaternion], FieldOf(ROTATION)]
"""A unit quaternion (scalar first), or a distribution over rotations."""
Direction = Annotated[Distribution[Vec3], FieldOf(DIRECTION)]
"""A unit vector, or a distribution over directions."""
Position = Annotated[Distribution[Vec3], FieldOf(POSITION)]
"""A position [m], or a distribution over positions."""

UnitInterval = Annotated[Scalar, Bounds(0, 1)]
"""A Scalar that stays in [0, 1]."""
NonNegative = Annotated[Scalar, Bounds(low=0)]
"""A Scalar that stays >= 0."""
Positive = Annotated[Scalar, Bounds(low=0, open_low=True)]
"""A Scalar that stays > 0."""
