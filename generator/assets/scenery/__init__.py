"""What lines a street: buildings, plants, street furniture, traffic lights and signs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from generator.assets.procedural.family import Family, Lazy, TextureFamily

_F = TypeVar("_F", Family, TextureFamily)


def _family(
    name: str, category: str, tags: str, variants: int, build: str, **parameters: object
) -> Family:
    module, _, function = build.partition(":")
    path = f"{__name__}.{module}:{function}"
    words = tuple(sorted({"scenery", *tags.split()}))
    facts = Lazy(f"{path}_facts")
    return Family(
        name, category, words, variants, 0.0, False, 1, parameters, Lazy(path), facts=facts
    )


def _building(style: str, variants: int = 16) -> Family:
    return _family(
        f"building/{style}", "building", "building", variants, "buildings:building", style=style
    )


def _tree(species: str, variants: int = 8) -> Family:
    name = f"tree/{species}"
    return _family(name, "tree", "tree", variants, "trees:tree", species=species, leaves=1.0)


def _texture(
    name: str, build: str, tags: str, variants: int, **parameters: object
) -> TextureFamily:
    path = Lazy(f"{__name__}.textures.{build}")
    return TextureFamily(name, tuple(sorted(tags.split())), variants, 1, path, parameters)


def _table(families: Iterable[_F]) -> Mapping[str, _F]:
    return {family.name: family for family in families}


FAMILIES: Mapping[str, Family] = _table(
    (
        _building("residential"),
        _building("old_town"),
        _building("modern"),
        _building("commercial"),
        _building("house"),
        _family("garage", "building", "building", 8, "buildings:garage"),
        _tree("broad"),
        _tree("round"),
        _tree("columnar"),
        _tree("birch"),
        _tree("young"),
        _tree("conifer"),
    )
)

TEXTURES: Mapping[str, TextureFamily] = _table(
    (
        _texture("roof_tiles", "surfaces:roof_tiles", "roof", 4),
        _texture("ashlar", "surfaces:ashlar", "stone wall", 4),
        _texture("bark", "surfaces:bark", "plant", 4),
        _texture("foliage", "surfaces:foliage", "plant", 2),
        _texture("shop_sign", "shop_signs:shop_sign", "printed", 12),
    )
)
