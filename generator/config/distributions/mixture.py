"""Mixtures of distributions over numbers."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from gen_data.config.distributions import base
from gen_data.config.yaml_scalars import format_number, quote_value

if TYPE_CHECKING:
    from gen_data.core.streams import Rng


@dataclass(frozen=True)
class Mixture(base.Numeric[base.T_co], key="mixture", kinds=("number", "whole number")):
    """One of several distributions over numbers, in proportion to weights.

    Attributes:
        parts: The distributions.
        weights: Relative frequency of each, >= 0; they need not add up to 1.
    """

    parts: tuple[base.Numeric[base.T_co], ...]
    weights: tuple[float, ...]
    _cumulative: tuple[float, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse negative weights, and a mixture of nothing."""
        if len(self.parts) != len(self.weights):
            raise base.Malformed(
                f"mixture has {len(self.parts)} parts, but {len(self.weights)} weights"
            )
        for number, weight in enumerate(self.weights):
            if not weight >= 0:
                fact = f"mixture needs weights >= 0, got {format_number(weight)}"
                raise base.Malformed(fact, (number, 0))
        object.__setattr__(self, "_cumulative", tuple(accumulate(self.weights)))
        if not self.parts or not self._cumulative[-1] > 0:
            raise base.Malformed("mixture needs at least one weight > 0")

    def draw(self, rng: "Rng") -> base.T_co:
        """A value of a part that is drawn first."""
        total = self._cumulative[-1]
        index = bisect_right(self._cumulative, rng.random() * total)
        # A product that rounds up to the total itself belongs to the last part that has weight.
        last = bisect_right(self._cumulative, total * (1 - 2.0**-53))
        return self.parts[min(index, last)].draw(rng)

    def outcomes(self) -> tuple[base.T_co, ...]:
        """Every value that can be drawn, where all parts have few; empty = a continuum."""
        values = [part.outcomes() for part in self._drawn()]
        if not all(values):
            return ()
        return tuple(dict.fromkeys(value for listed in values for value in listed))

    def support(self) -> tuple[float, float]:
        """Smallest and largest value of all parts that have weight."""
        limits = [part.support() for part in self._drawn()]
        return min(low for low, _ in limits), max(high for _, high in limits)

    def _drawn(self) -> list[base.Numeric[base.T_co]]:
        return [p for p, weight in zip(self.parts, self.weights, strict=True) if weight > 0]

    @classmethod
    def from_yaml(cls, argument: Any, kind: base.Kind[Any]) -> "Mixture[Any]":
        """Read a list of pairs: weight and distribution."""
        wanted = "mixture needs a list of pairs [weight, distribution]"
        if not isinstance(argument, (list, tuple)):
            raise base.Malformed(f"{wanted}, got {quote_value(argument)}")
        parts, weights = [], []
        for number, pair in enumerate(argument):
            if not isinstance(pair, (list, tuple)) or len(pair) != 2:
                raise base.Malformed(f"{wanted}, got {quote_value(pair)}", (number,))
            with base.inside(number, 0):
                weights.append(base.read_number(pair[0]))
            with base.inside(number, 1):
                part = base.read_distribution(pair[1], kind)
                if not isinstance(part, base.Numeric):
                    raise base.Malformed(f"expected {kind.expected} or a distribution over numbers")
                parts.append(part)
        return cls(tuple(parts), tuple(weights))

    def to_yaml(self) -> Any:
        """Plain data that reads back as this distribution."""
        pairs = zip(self.weights, self.parts, strict=True)
        return {self.name: [[weight, part.to_yaml()] for weight, part in pairs]}

    @classmethod
    def field_names(cls) -> dict[str, str]:
        """Its argument is a list, which has no keys."""
        return {"parts": "parts", "weights": "weights"}

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """A list of pairs; the reader interprets the distributions in them."""
        part = {"anyOf": [dict(constant), {"type": "object", "minProperties": 1}]}
        pair = [{"type": "number", "minimum": 0}, part]
        return {
            "type": "array",
            "items": {"type": "array", "prefixItems": pair, "minItems": 2, "maxItems": 2},
            "minItems": 1,
            "description": "[[weight, distribution], ...]",
        }
