"""Random draws of one variant: a pure function of the family's name and the seed.

Built on ``Rng.random`` alone, whose stream numpy guarantees; its other distributions may change
between versions (NEP 19).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from gen_data.core.streams import Rng, Streams

T = TypeVar("T")


class VariantRng(Rng):
    """A generator with the draws that families use."""

    def between(self, low: float, high: float) -> float:
        """Draw uniformly from [low, high)."""
        return low + (high - low) * float(self.random())

    def choose(self, options: Sequence[T]) -> T:
        """Draw one of the options, all equally likely."""
        return options[min(int(self.random() * len(options)), len(options) - 1)]

    def chance(self, probability: float) -> bool:
        """Draw True with the given probability."""
        return float(self.random()) < probability

    def shuffled(self, items: Sequence[T]) -> list[T]:
        """Return the items in random order."""
        keys = [float(self.random()) for _ in items]
        return [items[i] for i in sorted(range(len(items)), key=keys.__getitem__)]


def variant_rng(name: str, seed: int) -> VariantRng:
    """The generator of everything that variant ``seed`` of family ``name`` draws."""
    return VariantRng(Streams(seed=seed, scene=0).rng(name).bit_generator)


def in_turn(options: Sequence[T], seed: int) -> T:
    """The option of a seed: consecutive seeds take the options in turn."""
    return options[seed % len(options)]
