"""Random draws of one variant: a pure function of the family's name and the seed.

Built on ``Rng.random`` alone, whose stream numpy guarantees; its other distributions may change
between versions (NEP 19).

A draw with a name is a parameter of the family: an asset id may ask for its value
(``desk?width_m=1.6``). The number is drawn in any case, so all other draws stay as they are.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, TypeVar

from gen_data.core.errors import did_you_mean
from gen_data.core.streams import Rng, Streams

T = TypeVar("T")
DrawnValue = float | int | str | tuple[float, ...]
"""Values of draws as in asset ids: ``true``, ``false``, and ``none`` for an empty word."""


@dataclass(frozen=True, slots=True)
class Draw:
    """One named draw of one variant.

    Attributes:
        options: Possible values; ``(low, high)`` of a range, both included.
        is_range: Whether all numbers between the two options are possible too, or all whole ones
            between two whole ones.
        value: The value drawn or asked for.
    """

    options: tuple[DrawnValue, ...]
    is_range: bool
    value: DrawnValue


@dataclass(slots=True)
class Drawing:
    """Named draws of one asset.

    Attributes:
        asked: Values that its id sets.
        drawn: Named draws so far.
        root: First word of the name of the first stream. Streams of other first words belong to
            other assets, which the asset contains or resembles.
    """

    asked: Mapping[str, DrawnValue]
    drawn: dict[str, Draw] = field(default_factory=dict)
    root: str = ""


_LISTED_MAX = 1000
"""Whole numbers of a draw that are listed; of more, the first and the last are stated."""

_DRAWING: ContextVar[Drawing | None] = ContextVar("_DRAWING", default=None)


@contextmanager
def drawing(asked: Mapping[str, DrawnValue]) -> Iterator[dict[str, Draw]]:
    """Record the named draws of one asset; give them the values asked for.

    Draws raise ValueError where such a value is impossible.

    Yields:
        The draws, in their order, by name; complete when the context ends.
    """
    current = Drawing(asked)
    token = _DRAWING.set(current)
    try:
        yield current.drawn
    finally:
        _DRAWING.reset(token)


class VariantRng(Rng):
    """A generator with the draws that families use; the last argument names a draw."""

    seed: int
    drawing: Drawing | None = None

    def between(self, low: float, high: float, name: str = "") -> float:
        """Draw uniformly from [low, high)."""
        value = low + (high - low) * float(self.random())
        return float(self._settle(name, (min(low, high), max(low, high)), value, is_range=True))

    def whole(self, low: float, high: float, name: str = "") -> int:
        """Draw a whole number: the part before the point of a number from [low, high)."""
        value = int(low + (high - low) * float(self.random()))
        options = range(int(low), max(int(low), math.ceil(high) - 1) + 1)
        is_long = len(options) > _LISTED_MAX
        known = (options[0], options[-1]) if is_long else options
        return int(self._settle(name, known, value, is_range=is_long))

    def choose(self, options: Sequence[T], name: str = "") -> T:
        """Draw one of the options, all equally likely."""
        value = options[min(int(self.random() * len(options)), len(options) - 1)]
        return self._settle(name, options, value)

    def turn(self, options: Sequence[T], name: str, number: int | None = None) -> T:
        """The option of the seed, or of another number, in turn; the stream stays as it is."""
        return self._settle(
            name, options, in_turn(options, self.seed if number is None else number)
        )

    def chance(self, probability: float, name: str = "") -> bool:
        """Draw True with the given probability."""
        value = float(self.random()) < probability
        return self._settle(name, (False, True), value)

    def shuffled(self, items: Sequence[T]) -> list[T]:
        """Return the items in random order."""
        keys = [float(self.random()) for _ in items]
        return [items[i] for i in sorted(range(len(items)), key=keys.__getitem__)]

    def _settle(self, name: str, options: Sequence[Any], drawn: T, *, is_range: bool = False) -> T:
        """The value asked for, or the one drawn.

        Raises:
            ValueError: if the value asked for is impossible.
        """
        if not name or self.drawing is None:
            return drawn
        find: Callable[..., Any] = _find_option
        if is_range:
            find = _find_whole if isinstance(drawn, int) else _find_in_range
        asked = self.drawing.asked
        value: Any = find(name, asked[name], options) if name in asked else drawn
        known = tuple(dict.fromkeys(map(_in_ids, options)))
        self.drawing.drawn[name] = Draw(known, is_range, _in_ids(value))
        return value  # type: ignore[no-any-return]


def _in_ids(value: Any) -> Any:
    """A value as in asset ids: words for truth values and for nothing."""
    if value is None or value == "":
        return "none"
    return str(value).lower() if isinstance(value, bool) else value


def _find_in_range(name: str, asked: DrawnValue, ends: Sequence[float]) -> float:
    low, high = ends
    # Users repeat ends as printed, with six digits.
    slack = 1e-6 * max(abs(low), abs(high))
    if isinstance(asked, (float, int)) and low - slack <= asked <= high + slack:
        return float(asked)
    raise ValueError(f"{name} expects a number from {low:.6g} to {high:.6g}")


def _find_whole(name: str, asked: DrawnValue, ends: Sequence[int]) -> int:
    low, high = ends
    if isinstance(asked, (float, int)) and low <= asked <= high and asked == int(asked):
        return int(asked)
    raise ValueError(f"{name} expects a whole number from {low} to {high}")


def _find_option(name: str, asked: DrawnValue, options: Sequence[T]) -> T:
    for option in options:
        if _in_ids(option) == asked:
            return option
    if len(options) > 2 and list(options) == list(range(len(options))):
        raise ValueError(f"{name} expects a whole number from 0 to {len(options) - 1}")
    words = list(dict.fromkeys(str(_in_ids(option)) for option in options))
    raise ValueError(f"{name} is none of {', '.join(words)}{did_you_mean(str(asked), words)}")


def variant_rng(name: str, seed: int) -> VariantRng:
    """The generator of everything that variant ``seed`` of family ``name`` draws."""
    rng = VariantRng(Streams(seed=seed, scene=0).rng(name).bit_generator)
    rng.seed, rng.name = seed, name
    current, root = _DRAWING.get(), name.partition("/")[0]
    if current is not None:
        current.root = current.root or root
        rng.drawing = current if current.root == root else None
    return rng


def in_turn(options: Sequence[T], seed: int) -> T:
    """The option of a seed: consecutive seeds take the options in turn."""
    return options[seed % len(options)]
