"""Draws inside a variant: a pure function of the family's name and the seed.

Built on ``Rng.random`` alone, whose stream numpy guarantees; its other distributions may change
between versions (NEP 19).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from gen_data.generator.core.streams import Rng, Streams

T = TypeVar("T")


def variant_rng(name: str, seed: int) -> Rng:
    """The generator of everything that variant ``seed`` of family ``name`` draws."""
    return Streams(seed=seed, scene=0).rng(name)


def uniform_between(low: float, high: float, rng: Rng) -> float:
    """Uniform in [low, high)."""
    return low + (high - low) * float(rng.random())


def choose(options: Sequence[T], rng: Rng) -> T:
    """One of the options, all equally likely."""
    return options[min(int(rng.random() * len(options)), len(options) - 1)]


def is_drawn(probability: float, rng: Rng) -> bool:
    """True with the given probability."""
    return float(rng.random()) < probability


def shuffle(items: Sequence[T], rng: Rng) -> list[T]:
    """The items in random order."""
    keys = [float(rng.random()) for _ in items]
    return [items[i] for i in sorted(range(len(items)), key=keys.__getitem__)]
