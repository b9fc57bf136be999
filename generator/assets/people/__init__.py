"""Posed, clothed people with keypoints.

``person`` is made from the people pack and is offered where that is installed; ``simple_person``
needs no file.
"""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.paths import packs_dir
from generator.assets.procedural.family import Family, Lazy

_PACKAGE = "generator.assets.people"
_VARIANTS = 256


def _people(name: str, *tags: str) -> Family:
    return Family(
        name=name,
        category="person",
        tags=tuple(sorted({"pedestrian", "person", *tags})),
        variants=_VARIANTS,
        mass_kg=70.0,
        stackable=False,
        version=1,
        parameters={"pose": "", "phase": -1.0},
        build=Lazy(f"{_PACKAGE}.families:{name}"),
        facts=Lazy(f"{_PACKAGE}.person:facts"),
        # Making one is as quick as reading it.
        stored=False,
    )


def _families() -> Mapping[str, Family]:
    families = {"simple_person": _people("simple_person")}
    if (packs_dir() / "people" / "body.npz").is_file():
        families["person"] = _people("person", "pack")
    return families


FAMILIES: Mapping[str, Family] = _families()
