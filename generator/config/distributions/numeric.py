"""Distributions over intervals of numbers."""

import math
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, WithJsonSchema

from gen_data.config.distributions import base
from gen_data.config.yaml_scalars import format_number

if TYPE_CHECKING:
    from gen_data.core.streams import Rng

_STANDARD = NormalDist()
_LEAST_PROBABILITY = 1e-280
"""Of a clip range: a smaller one could be rounded to nothing while drawing."""
_PAIR = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_Above0 = Annotated[float, WithJsonSchema({"type": "number", "exclusiveMinimum": 0})]


class Interval(base.Numeric[base.T_co], needs="two numbers [low, high]"):
    """A distribution between two numbers."""

    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse a reversed range."""
        base.require_order(self.name, self.low, self.high)

    def support(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.low, self.high


@base.parameters
class Uniform(Interval[float], key="uniform", kinds=("number",)):
    """Every number between low and high is equally likely."""

    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse a reversed range, and one whose width overflows."""
        super().__post_init__()
        if math.isinf(self.high - self.low):
            raise base.Malformed(f"uniform needs a finite range, got {self.argument()}")

    def draw(self, rng: "Rng") -> float:
        """One value."""
        return min(self.low + (self.high - self.low) * rng.random(), self.high)


@base.parameters
class LogUniform(
    Interval[float],
    key="log_uniform",
    kinds=("number",),
    needs="two numbers [low, high], both above 0",
):
    """Every ratio is equally likely: 1 to 2 as often as 10 to 20. For scales and intensities."""

    low: _Above0
    high: _Above0

    def __post_init__(self) -> None:
        """Refuse a reversed range and one that touches zero."""
        if not self.low > 0 or not self.high > 0:
            raise base.Malformed(
                f"log_uniform needs low > 0 and high > 0, "
                f"got [{format_number(self.low)}, {format_number(self.high)}]"
            )
        super().__post_init__()

    def draw(self, rng: "Rng") -> float:
        """One value."""
        u = rng.random()
        if self.low == self.high:
            return self.low
        log_low = math.log(self.low)
        value = base.round_significant(math.exp(log_low + (math.log(self.high) - log_low) * u))
        return min(max(value, self.low), self.high)


@base.parameters
class Normal(base.Numeric[float], key="normal", kinds=("number",)):
    """Gaussian; with ``clip`` it is truncated: values outside are not drawn, none pile up.

    Drawn by inverting the cumulative distribution: each value costs exactly one random
    number. Inverse: Wichura, "Algorithm AS 241", Applied Statistics 37(3), 1988.

    Attributes:
        center: Where the density peaks; the mean, unless a clip range lies off-centre.
        clip: ``(low, high)``, or None.
    """

    center: float = Field(alias="mean")
    stddev: float = Field(json_schema_extra={"minimum": 0})
    clip: Annotated[
        tuple[float, float] | None,
        base.sized(2, "clip needs two numbers [low, high]"),
        WithJsonSchema({**_PAIR, "description": "[low, high]: truncated to it"}),
    ] = None

    def __post_init__(self) -> None:
        """Refuse a negative deviation, and a clip range that holds no probability."""
        if self.stddev < 0:
            raise base.Malformed(f"normal needs stddev >= 0, got {format_number(self.stddev)}")
        if self.clip is not None:
            self._refuse_empty(*self.clip)

    def _refuse_empty(self, low: float, high: float) -> None:
        base.require_order("normal clip", low, high)
        if low < high and self.stddev > 0:
            below, above, _ = self._tail()
            empty = not above - below > _LEAST_PROBABILITY
        else:
            empty = self.stddev == 0 and not low <= self.center <= high
        if empty:
            raise base.Malformed(
                f"normal with mean {format_number(self.center)} and stddev "
                f"{format_number(self.stddev)} never "
                f"falls into clip [{format_number(low)}, {format_number(high)}]"
            )

    def draw(self, rng: "Rng") -> float:
        """One value."""
        # The middle of one of 2^53 equal cells: never 0, whose inverse would be -inf.
        u = rng.random() + 2.0**-54
        low, high = self.support()
        if self.stddev == 0 or low == high:
            return min(max(self.center, low), high)
        below, above, sign = self._tail()
        z = sign * _STANDARD.inv_cdf(min(below + (above - below) * u, 1 - 2.0**-53))
        return min(max(base.round_significant(self.center + self.stddev * z), low), high)

    def support(self) -> tuple[float, float]:
        """The clip range; without one, all numbers."""
        if self.clip is not None:
            return self.clip
        return (self.center, self.center) if self.stddev == 0 else (-math.inf, math.inf)

    def _tail(self) -> tuple[float, float, int]:
        """Cumulative probability at both ends, measured in the tail where it keeps its digits.

        The last value is -1 where the axis had to be mirrored for that.
        """
        if self.clip is None:
            return 0.0, 1.0, 1
        a, b = ((v - self.center) / self.stddev for v in self.clip)
        if a > 0:
            return _cumulative(-b), _cumulative(-a), -1
        return _cumulative(a), _cumulative(b), 1


@base.parameters
class UniformInteger(
    Interval[int],
    key="uniform_integer",
    kinds=("number", "whole number"),
    needs="two whole numbers [low, high]",
):
    """Every whole number from low to high, both included, is equally likely."""

    low: int
    high: int

    def draw(self, rng: "Rng") -> int:
        """One value."""
        return int(rng.integers(self.low, self.high, endpoint=True))


def _cumulative(z: float) -> float:
    """Standard normal cumulative distribution, with all its digits in the lower tail."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))
