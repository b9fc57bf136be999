"""What lines a street: buildings, plants, street furniture, traffic lights and signs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from generator.assets.procedural.family import Facts, Family, Lazy, TextureFamily

_F = TypeVar("_F", Family, TextureFamily)


@dataclass(frozen=True)
class _Always:
    """Facts that are the same for every variant."""

    subcategory: str

    def __call__(self, **_: Any) -> Facts:
        return Facts(self.subcategory)


def _family(
    category: str,
    tags: str,
    variants: int,
    build: str,
    name: str = "",
    **parameters: object,
) -> Family:
    """A family whose facts the function ``<build>_facts`` tells; named like its function."""
    path = f"{__name__}.{build}"
    words = tuple(sorted({"scenery", *tags.split()}))
    name = name or build.partition(":")[2]
    facts = Lazy(f"{path}_facts")
    return Family(
        name, category, words, variants, 0.0, False, 1, parameters, Lazy(path), facts=facts
    )


def _building(style: str, variants: int = 16) -> Family:
    name = f"building/{style}"
    return _family("building", "building", variants, "buildings:building", name, style=style)


def _tree(species: str, variants: int = 8) -> Family:
    name = f"tree/{species}"
    return _family("tree", "tree", variants, "trees:tree", name, species=species, leaves=1.0)


def _plain(name: str, category: str, tags: str, variants: int, build: str) -> Family:
    """A family of one kind of thing: its name is its subcategory."""
    path = Lazy(f"{__name__}.{build}")
    words = tuple(sorted({"scenery", *tags.split()}))
    return Family(name, category, words, variants, 0.0, False, 1, {}, path, facts=_Always(name))


def _texture(
    name: str, build: str, tags: str, variants: int, **parameters: object
) -> TextureFamily:
    path = Lazy(f"{__name__}.textures.{build}")
    return TextureFamily(name, tuple(sorted(tags.split())), variants, 1, path, parameters)


def _table(families: Iterable[_F]) -> Mapping[str, _F]:
    return {family.name: family for family in families}


_FURNITURE = "street_furniture"

FAMILIES: Mapping[str, Family] = _table(
    (
        _building("residential"),
        _building("old_town"),
        _building("modern"),
        _building("commercial"),
        _building("house"),
        _plain("garage", "building", "garage", 8, "buildings:garage"),
        _tree("broad"),
        _tree("round"),
        _tree("columnar"),
        _tree("birch"),
        _tree("young"),
        _tree("conifer"),
        _plain("hedge", "hedge", "plant", 8, "shrubs:hedge"),
        _plain("bush", "bush", "plant", 8, "shrubs:bush"),
        _plain("planter", "planter", f"plant {_FURNITURE}", 8, "shrubs:planter"),
        _plain("street_light", "street_light", _FURNITURE, 8, "furniture:street_light"),
        _plain("litter_bin", "bin", _FURNITURE, 8, "furniture:litter_bin"),
        _plain("bench", "bench", _FURNITURE, 8, "furniture:bench"),
        _plain("hydrant", "hydrant", _FURNITURE, 6, "furniture:hydrant"),
        _family("bollard", _FURNITURE, 8, "furniture:bollard"),
        _plain("cone", "cone", f"{_FURNITURE} road_works", 6, "furniture:traffic_cone"),
        _plain("post_box", "post_box", _FURNITURE, 6, "furniture:post_box"),
        replace(_plain("bus_stop", "bus_stop", _FURNITURE, 4, "furniture:bus_stop"), version=2),
        _plain("utility_pole", "utility_pole", _FURNITURE, 4, "furniture:utility_pole"),
        _plain("cabinet", "cabinet", _FURNITURE, 6, "furniture:cabinet"),
        _plain("bike_rack", "bike_rack", _FURNITURE, 6, "furniture:bike_rack"),
        _family("barrier", f"{_FURNITURE} road_works", 9, "barriers:barrier", style="any"),
        _family("fence", _FURNITURE, 12, "barriers:fence", style="any"),
        _family("traffic_light", _FURNITURE, 8, "traffic_lights:traffic_light", mount="any"),
        _plain(
            "pedestrian_signal",
            "traffic_light",
            _FURNITURE,
            4,
            "traffic_lights:pedestrian_signal",
        ),
        _family("traffic_sign", _FURNITURE, 27, "signs:traffic_sign", sign="any"),
    )
)

TEXTURES: Mapping[str, TextureFamily] = _table(
    (
        _texture("roof_tiles", "surfaces:roof_tiles", "roof", 4),
        _texture("ashlar", "surfaces:ashlar", "facade", 4),
        _texture("bark", "surfaces:bark", "plant", 4),
        _texture("foliage", "surfaces:foliage", "plant", 2),
        _texture("shop_sign", "shop_signs:shop_sign", "printed", 12),
        _texture("traffic_sign", "sign_faces:traffic_sign", "printed", 27, sign="any"),
    )
)
