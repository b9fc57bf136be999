"""Procedural assets: everything here is made by a formula from a seed or from a size.

Three tables. A new generator is one function and one line; it is imported when first built.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from generator.assets.procedural.family import (
    EnvironmentFamily,
    Family,
    Lazy,
    Solid,
    TextureFamily,
)

__all__ = [
    "ENVIRONMENTS",
    "FAMILIES",
    "TEXTURES",
    "EnvironmentFamily",
    "Family",
    "Solid",
    "TextureFamily",
]

_F = TypeVar("_F", Family, TextureFamily, EnvironmentFamily)


def _household(
    name: str, category: str, kinds: str, variants: int, mass_kg: float, *, stackable: bool, build: str
) -> Family:
    tags = tuple(sorted({"household", *kinds.split()}))
    return Family(name, category, tags, variants, mass_kg, stackable, 1, {}, Lazy(build))


def _part(name: str, mass_kg: float, variants: int = 12, *, stackable: bool = False) -> Family:
    build = Lazy(f"parts:{name}")
    return Family(name, name, ("part",), variants, mass_kg, stackable, 1, {}, build)


def _static(name: str, build: str, **parameters: object) -> Family:
    return Family(name, name, ("furniture",), 0, 0.0, False, 1, parameters, Lazy(build))


def _texture(name: str, build: str, tags: str = "surface", variants: int = 16) -> TextureFamily:
    return TextureFamily(name, tuple(sorted(tags.split())), variants, 1, Lazy(build))


def _environment(name: str, tags: str, variants: int = 8) -> EnvironmentFamily:
    build = Lazy(f"environments:{name}")
    return EnvironmentFamily(name, tuple(sorted(tags.split())), variants, 1, build)


def _table(families: Iterable[_F]) -> Mapping[str, _F]:
    return {family.name: family for family in families}


FAMILIES: Mapping[str, Family] = _table((
    _household("mug", "mug", "tableware container", 32, 0.34, stackable=False, build="tableware:mug"),
    _household("cup", "cup", "tableware container", 24, 0.06, stackable=False, build="tableware:cup"),
    _household("bowl", "bowl", "tableware container", 24, 0.4, stackable=False, build="tableware:bowl"),
    _household("plate", "plate", "tableware", 24, 0.5, stackable=False, build="tableware:plate"),
    _household("bottle", "bottle", "container printed", 36, 0.7, stackable=False, build="containers:bottle"),
    _household("can", "can", "container printed", 32, 0.36, stackable=True, build="containers:can"),
    _household("carton", "carton", "container printed", 32, 0.35, stackable=True, build="containers:carton"),
    _household("milk_carton", "carton", "container printed", 16, 0.8, stackable=False,
               build="containers:milk_carton"),
    _household("jar", "jar", "container printed", 20, 0.45, stackable=True, build="containers:jar"),
    _static("table", "furniture:table", size_m=(1.2, 0.8, 0.74), style="legs"),
    _static("shelf", "furniture:shelf", size_m=(0.9, 0.32, 1.6), levels=4, style="bookcase"),
    _static("bin", "furniture:bin_", size_m=(0.6, 0.4, 0.22), color="blue"),
    _static("box", "furniture:box_", size_m=(0.2, 0.2, 0.2), color="grey"),
    _static("pedestal", "furniture:pedestal", size_m=(0.3, 0.3, 0.7)),
    _static("gantry", "furniture:gantry", size_m=(1.6, 1.0, 1.8)),
    _static("plane", "furniture:plane", size_m=(4.0, 4.0)),
    _static("backdrop", "furniture:backdrop", size_m=(3.0, 3.0, 2.2), radius_m=0.6, color="white"),
    _static("room", "furniture:room", size_m=(5.0, 4.0, 2.8), door=1, window=1),
))

TEXTURES: Mapping[str, TextureFamily] = _table(())

ENVIRONMENTS: Mapping[str, EnvironmentFamily] = _table(())
