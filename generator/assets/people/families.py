"""The two families of people: from the installed pack, and from formulas alone."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from gen_data.generator.assets.paths import packs_dir
from gen_data.generator.assets.people.analytic_body import simple_body
from gen_data.generator.assets.people.body import FILE, BodyTemplate, load
from gen_data.generator.assets.people.person import draw_person
from gen_data.generator.assets.people.person_mesh import Figure, build_person, dress_person
from gen_data.generator.assets.procedural.family import Solid

_FIGURES = 64
"""Kept in memory: as many as one scene shows, half a megabyte each."""


def pack_file() -> Path:
    """Path of the people pack's body; the file exists only if the pack is installed."""
    return packs_dir() / "people" / FILE


def person(seed: int, pose: str, phase: float) -> Solid:
    """A person from the pack. Raises AssetError if the pack cannot be read."""
    return build_person(draw_person(seed, pose, phase), _figure(seed, str(pack_file())))


def simple_person(seed: int, pose: str, phase: float) -> Solid:
    """A person from formulas."""
    return build_person(draw_person(seed, pose, phase), _figure(seed, ""))


@lru_cache(maxsize=_FIGURES)
def _figure(seed: int, path: str) -> Figure:
    """Figure of a seed; someone who walks takes many poses in the same figure."""
    return dress_person(draw_person(seed), _body(path) if path else simple_body())


@lru_cache(maxsize=2)
def _body(path: str) -> BodyTemplate:
    return load(Path(path))
