"""Assets that the rules of rooms may draw: own families, and furniture of installed packs."""

from collections.abc import Iterable, Mapping

from gen_data.assets.families import declared
from gen_data.core.asset_types import Asset
from gen_data.core.bounded_cache import ObjectCache
from gen_data.core.interfaces import AssetIndex
from gen_data.rooms.rules import APARTMENT, find_room_type

IN_APARTMENTS = ("bathroom", "bedroom", "kitchen", "living_room")
_by_family: ObjectCache[Mapping[str, tuple[str, ...]]] = ObjectCache(2)


def families_of(kind: str, field: str) -> frozenset[str]:
    """Families of everything that may be in a room of a type.

    Raises:
        ConfigError: there is no such type; the text begins with ``field``.
    """
    kinds = IN_APARTMENTS if kind == APARTMENT else (kind,)
    return frozenset(f for k in kinds for f in find_room_type(k, field).families)


def find_options(assets: AssetIndex, families: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Sorted ids of the assets of each family."""
    everything = assets.find(())
    known = _by_family.get(everything, lambda: _group(everything))
    return {family: known[family] for family in sorted(families)}


def _group(everything: tuple[Asset, ...]) -> Mapping[str, tuple[str, ...]]:
    own: dict[str, list[str]] = {}
    category: dict[str, str] = {}
    packed: dict[str, list[str]] = {}
    for asset in everything:
        if "procedural" in asset.tags:
            family = asset.asset_id.partition("?")[0]
            own.setdefault(family, []).append(asset.asset_id)
            category[family] = asset.category
        elif "furniture" in asset.tags:
            packed.setdefault(asset.category, []).append(asset.asset_id)
    return {
        family: tuple(
            sorted(
                (
                    *ids,
                    *(
                        packed.get(category[family], ())
                        if declared(family, "also_from_packs", False)
                        else ()
                    ),
                )
            )
        )
        for family, ids in own.items()
    }
