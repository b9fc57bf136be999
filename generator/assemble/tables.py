"""Every plug-in table of the project, by kind."""

from __future__ import annotations

import exporters
import randomizers
import scene_templates
from generator import renderers, sensors
from generator.annotations import TABLE as ANNOTATIONS
from generator.core.errors import ConfigError, did_you_mean
from generator.core.plugins import PluginTable

TABLES: dict[str, PluginTable] = {
    "element": scene_templates.TABLE,
    "randomizer": randomizers.TABLE,
    "sensor": sensors.TABLE,
    "annotation": ANNOTATIONS,
    "exporter": exporters.TABLE,
    "renderer": renderers.TABLE,
}


def find_plugin(name: str) -> tuple[str, type]:
    """Kind and class of a plug-in by its name, or by ``kind/name`` where a name is used twice.

    Raises:
        ConfigError: unknown, or more than one kind has it.
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
