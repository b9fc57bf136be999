"""Families of assets by name, and the facts that they declare.

``content`` lists the packages of families; third-party packages add families through the
entry-point group ``gen_data.asset_family``.
"""

import importlib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from gen_data.assets.content import content
from gen_data.assets.family import EnvironmentFamily, Family, Lazy, TextureFamily, Worn
from gen_data.core import errors, plugins

AnyFamily = Family | TextureFamily | EnvironmentFamily
KIND = "asset_family"
_PREFIXES = {"object": "", "texture": "texture/", "environment": "environment/"}
_REQUIRED: Any = object()


def kind_of(family: AnyFamily) -> Any:
    """Kind of a family's assets: ``object``, ``texture`` or ``environment``."""
    if isinstance(family, Family):
        return "object"
    return "texture" if isinstance(family, TextureFamily) else "environment"


@cache
def own_families() -> Mapping[str, AnyFamily]:
    """Families of this program by the first part of their assets' ids, in the tables' order."""
    return {
        _PREFIXES[kind_of(family)] + name: family
        for table in _tables()
        for name, family in table.items()
    }


def _tables() -> Iterator[Mapping[str, AnyFamily]]:
    for name in content().FAMILIES:
        module = importlib.import_module(name)
        for table in ("FAMILIES", "TEXTURES", "ENVIRONMENTS"):
            yield getattr(module, table, {})


@cache
def third_party_families() -> Mapping[str, tuple[AnyFamily, str]]:
    """Family and package of every entry point, by the first part of its assets' ids.

    Raises:
        ConfigError: one of them cannot be imported, or is not a family.
    """
    found = {}
    for name, entry in sorted(plugins.third_party(KIND).items()):
        family = plugins.loaded(entry.value, f"{KIND} '{name}'")
        if not isinstance(family, (Family, TextureFamily, EnvironmentFamily)):
            raise errors.ConfigError(
                f"{KIND} '{name}': {entry.value} is not a Family, TextureFamily or "
                "EnvironmentFamily; see gen_data.assets.family"
            )
        found[_PREFIXES[kind_of(family)] + name] = (family, plugins.package_of(entry))
    return found


def known_families() -> Mapping[str, AnyFamily]:
    """Built-in and third-party families, by the first part of ids."""
    return {**{n: family for n, (family, _) in third_party_families().items()}, **own_families()}


def family_summary(family: AnyFamily) -> str:
    """One line on a family: the one of its row, or the first of its function's docstring."""
    if isinstance(family, Family) and family.about:
        return family.about
    build: Any = family.build
    while isinstance(build, (Worn, Lazy)):
        build = build.build if isinstance(build, Worn) else build.value
    return (getattr(build, "__doc__", None) or "").strip().partition("\n")[0]


def declared(asset_id: str, fact: str, default: Any = _REQUIRED) -> Any:
    """A fact that the family of an asset declares for those who place or change its assets.

    Args:
        asset_id: Id of an asset, or name of a family.
        fact: Key of ``declares`` in the family's row.
        default: Value for assets of files, and for families that do not declare the fact.

    Raises:
        AssetError: there is neither the fact nor a default.
    """
    name = asset_id.partition("?")[0]
    family = own_families().get(name) or third_party_families().get(name, (None, ""))[0]
    value = default if family is None else family.declares.get(fact, default)
    if value is _REQUIRED:
        raise errors.AssetError(f"family '{name}': declares no fact '{fact}'")
    return value.value if isinstance(value, Lazy) else value
