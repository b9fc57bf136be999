"""Distributions over a few given values: numbers, names, flags or positions."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from collections.abc import Sequence as Items
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from pydantic import Field

from gen_data.config.distributions import base
from gen_data.config.yaml_scalars import format_number, quote_value, to_flow_yaml

if TYPE_CHECKING:
    from gen_data.core.streams import Rng

EVERY_KIND = ("number", "whole number", "name", "flag", "rotation", "direction", "position")


class Listed(base.Numeric[base.T_co], kinds=EVERY_KIND):
    """A distribution over few values, which are numbers where it has a mean and a range."""

    def support(self) -> tuple[float, float]:
        """Smallest and largest value that can be drawn."""
        numbers = [_as_number(value) for value in self.outcomes()]
        return min(numbers), max(numbers)


@dataclass(frozen=True)
class Constant(Listed[base.T_co], key="constant"):
    """Always the same value. A plain value in YAML means this."""

    value: base.T_co

    def draw(self, rng: Rng) -> base.T_co:  # noqa: ARG002
        """The value; uses no random number."""
        return self.value

    def outcomes(self) -> tuple[base.T_co, ...]:
        """The value alone."""
        return (self.value,)

    @classmethod
    def from_yaml(cls, argument: Any, kind: base.Kind[Any]) -> Constant[Any]:
        """Read a value of the field."""
        return cls(kind.read(argument))

    def to_yaml(self) -> Any:
        """The value itself: constants need no name."""
        return base.to_plain(self.value)

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """One value."""
        return dict(constant)


@dataclass(frozen=True, init=False, repr=False)
class Choice(Listed[base.T_co], key="choice"):
    """One of the given values, equally likely or in proportion to weights.

    Attributes:
        values: All values, those without weight included.
        weights: Relative frequency of each value, >= 0; they need not add up to 1.
    """

    values: tuple[base.T_co, ...]
    weights: tuple[float, ...]
    _cumulative: tuple[float, ...] = field(compare=False)

    def __init__(self, values: Items[base.T_co] | Mapping[base.T_co, float]) -> None:
        """Accept a sequence (equal weights) or ``{value: weight}``, whose order means nothing."""
        weighted = isinstance(values, Mapping)
        if isinstance(values, Mapping):
            # Documents that are kept have their keys sorted: draws must not depend on it.
            values = dict(sorted(values.items(), key=lambda item: quote_value(item[0])))
        weights = values.values() if isinstance(values, Mapping) else [1.0] * len(values)
        object.__setattr__(self, "values", _freeze(values))
        object.__setattr__(self, "weights", tuple(base.read_number(w) for w in weights))
        object.__setattr__(self, "_cumulative", tuple(accumulate(self.weights)))
        if not self.values:
            raise base.Malformed("choice needs at least one value")
        for value, weight in zip(self.values, self.weights, strict=True):
            if weight < 0:
                raise base.Malformed(
                    f"choice needs weights >= 0, got {format_number(weight)} for "
                    f"{quote_value(value)}",
                    (str(value),) if weighted else (),
                )
        if not self._cumulative[-1] > 0:
            raise base.Malformed("choice needs at least one weight > 0")

    def draw(self, rng: Rng) -> base.T_co:
        """One value."""
        total = self._cumulative[-1]
        index = bisect_right(self._cumulative, rng.random() * total)
        # A product that rounds up to the total itself belongs to the last value that has weight.
        return self.values[min(index, bisect_right(self._cumulative, total * (1 - 2.0**-53)))]

    def outcomes(self) -> tuple[base.T_co, ...]:
        """The values that have weight."""
        return tuple(v for v, w in zip(self.values, self.weights, strict=True) if w > 0)

    @classmethod
    def from_yaml(cls, argument: Any, kind: base.Kind[Any]) -> Choice[Any]:
        """Read a list of values, or ``{value: weight}``."""
        if not isinstance(argument, Mapping):
            return cls(_read_items(argument, cls.name, kind))
        weighted: dict[Any, float] = {}
        for key, weight in argument.items():
            with base.inside(key):
                weighted[kind.read_key(key)] = base.read_number(weight)
        return cls(weighted)

    def argument(self) -> Any:
        """A list of values; a mapping where weights differ."""
        if len(set(self.weights)) == 1:
            return base.to_plain(self.values)
        return {
            v if isinstance(v, str) else to_flow_yaml(v): w
            for v, w in zip(self.values, self.weights, strict=True)
        }

    def to_yaml(self) -> Any:
        """Plain data that reads back as this distribution."""
        return {self.name: self.argument()}

    def __repr__(self) -> str:
        """As it is constructed."""
        if len(set(self.weights)) == 1:
            return f"Choice({self.values!r})"
        return f"Choice({dict(zip(self.values, self.weights, strict=True))!r})"

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """A list of values, or a mapping of weights."""
        return {
            "anyOf": [
                {"type": "array", "items": dict(constant), "minItems": 1},
                {
                    "type": "object",
                    "additionalProperties": {"type": "number", "minimum": 0},
                    "minProperties": 1,
                    "description": "{value: weight}",
                },
            ]
        }


@dataclass(frozen=True)
class Sequence(Listed[base.T_co], key="sequence"):
    """The given values in turn, by the number of the scene or sample; uses no random number."""

    values: tuple[base.T_co, ...]

    def __post_init__(self) -> None:
        """Refuse an empty list."""
        object.__setattr__(self, "values", _freeze(self.values))
        if not self.values:
            raise base.Malformed("sequence needs at least one value")

    def draw(self, rng: Rng) -> base.T_co:
        """The value of this scene's or sample's turn."""
        return self.values[rng.index % len(self.values)]

    def outcomes(self) -> tuple[base.T_co, ...]:
        """All values."""
        return self.values

    @classmethod
    def from_yaml(cls, argument: Any, kind: base.Kind[Any]) -> Sequence[Any]:
        """Read a list of values."""
        return cls(tuple(_read_items(argument, cls.name, kind)))

    def to_yaml(self) -> Any:
        """Plain data that reads back as this distribution."""
        return {self.name: base.to_plain(self.values)}

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """A list of values."""
        return {"type": "array", "items": dict(constant), "minItems": 1}


@base.parameters
class Probability(Listed[bool], key="probability", kinds=("flag",)):
    """True with the given probability, else false."""

    p: float = Field(json_schema_extra={"minimum": 0, "maximum": 1})

    def __post_init__(self) -> None:
        """Refuse numbers that are not a probability."""
        if not 0 <= self.p <= 1:
            raise base.Malformed(
                f"probability needs a number in [0, 1], got {format_number(self.p)}"
            )

    def draw(self, rng: Rng) -> bool:
        """One value."""
        return rng.random() < self.p

    def outcomes(self) -> tuple[bool, ...]:
        """The values that can be drawn."""
        return tuple(v for v, share in ((False, 1 - self.p), (True, self.p)) if share > 0)


def _read_items(argument: Any, name: str, kind: base.Kind[Any]) -> list[Any]:
    if not isinstance(argument, (list, tuple)):
        raise base.Malformed(f"{name} needs a list of values, got {quote_value(argument)}")
    items = []
    for number, item in enumerate(argument):
        with base.inside(number):
            items.append(kind.read(item))
    return items


def _freeze(values: Any) -> tuple[Any, ...]:
    return tuple(tuple(value) if isinstance(value, list) else value for value in values)


def _as_number(value: object) -> float:
    if not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} is not a number: it has no mean and no range")
    return value
