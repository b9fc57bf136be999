"""Tables of all kinds of plug-ins."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import gen_data.annotations
from gen_data import exporters, randomizers, renderers, scene_templates, sensors
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.plugins import PluginTable, package_of, third_party

ELEMENTS = scene_templates.TABLE
RANDOMIZERS = randomizers.TABLE
SENSORS = sensors.TABLE
ANNOTATIONS = gen_data.annotations.TABLE
EXPORTERS = exporters.TABLE
RENDERERS = renderers.TABLE

TABLES: Mapping[str, PluginTable[Any]] = {
    table.kind: table
    for table in (ELEMENTS, RANDOMIZERS, SENSORS, ANNOTATIONS, EXPORTERS, RENDERERS)
}
"""All tables by kind, for ``gen-data describe`` and the JSON Schema."""

LISTS: Mapping[str, PluginTable[Any]] = {
    "elements": ELEMENTS,
    "randomizers": RANDOMIZERS,
    "sensors": SENSORS,
    "annotations": ANNOTATIONS,
    "exporters": EXPORTERS,
}
"""Tables by the key of a configuration that lists their plug-ins."""

CONTENT_KINDS = ("asset_family", "question", "room_place", "room_type")
"""Kinds of plug-ins that other plug-ins find by name or tag."""

P = TypeVar("P")


def default_plugin(table: PluginTable[P], name: str) -> P:
    """Make a plug-in with defaults.

    Raises:
        ConfigError: the name is unknown, or its class is not a plug-in of this kind.
    """
    return table.load(name)()


def find_other_list(name: str, table: PluginTable[Any]) -> str:
    """Which other list a plug-in belongs to, as the end of a message; empty if to none."""
    keys = [key for key, other in LISTS.items() if other is not table and name in other]
    return f"; '{name}' is one of the '{keys[0]}'" if keys else ""


def third_party_packages(plugins: Iterable[object]) -> dict[str, str]:
    """``{name: version}`` of the third-party packages of plug-ins.

    Packages with content are always included: asset families take part in every selection by tags.
    """
    classes = {f"{type(p).__module__}:{type(p).__qualname__}" for p in plugins}
    found = [e for kind in TABLES for e in third_party(kind).values() if e.value in classes]
    entries = (*found, *(e for kind in CONTENT_KINDS for e in third_party(kind).values()))
    packages = sorted({package_of(entry) for entry in entries})
    return {name: version for name, _, version in (p.partition(" ") for p in packages)}


def find_plugin(name: str) -> tuple[str, type]:
    """Kind and class of a plug-in, by name or, for ambiguous names, by ``kind/name``.

    Raises:
        ConfigError: the name is unknown or ambiguous.
    """
    kind, _, short = name.rpartition("/")
    hits = [k for k, t in TABLES.items() if short in t and kind in ("", k)]
    if len(hits) == 1:
        return hits[0], TABLES[hits[0]].load(short)
    if hits:
        raise ConfigError(
            f"'{name}' is a name of several: " + ", ".join(f"{k}/{short}" for k in hits)
        )
    known = [n for t in TABLES.values() for n in t]
    raise ConfigError(
        f"unknown plug-in '{name}'{did_you_mean(short, known)}; see gen-data describe"
    )
