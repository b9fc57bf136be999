"""The two families of people: from the installed pack, and from formulas alone."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from generator.assets.paths import packs_dir
from generator.assets.people.body import FILE, Body, load
from generator.assets.people.build import Figure, built, dressed
from generator.assets.people.person import drawn_person
from generator.assets.people.simple import simple_body
from generator.assets.procedural.family import Solid

_FIGURES = 64
"""Kept in memory: as many as one scene shows, half a megabyte each."""


def pack_file() -> Path:
    """Where the people pack's body is, if it is installed."""
    return packs_dir() / "people" / FILE


def person(seed: int, pose: str, phase: float) -> Solid:
    """A person from the pack. Raises AssetError if the pack cannot be read."""
    return built(drawn_person(seed, pose, phase), _figure(seed, str(pack_file())))


def simple_person(seed: int, pose: str, phase: float) -> Solid:
    """A person from formulas."""
    return built(drawn_person(seed, pose, phase), _figure(seed, ""))


@lru_cache(maxsize=_FIGURES)
def _figure(seed: int, path: str) -> Figure:
    """Whoever walks takes many poses in one figure."""
    return dressed(drawn_person(seed), _body(path) if path else simple_body())


@lru_cache(maxsize=2)
def _body(path: str) -> Body:
    return load(Path(path))
