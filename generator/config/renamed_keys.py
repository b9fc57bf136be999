"""Deprecated words of configuration documents, and their replacements.

Deprecated words are accepted for one release, each with a ``FutureWarning`` that names its place
and the current word. All of them are in the tables below; plug-ins know only the current ones.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from gen_data.generator.config.merging import merge_nodes
from gen_data.generator.config.paths import PLAN
from gen_data.generator.config.problems import Position, Problem, Problems
from gen_data.generator.config.shared_values import SWITCH
from gen_data.generator.config.yaml_tree import Node
from gen_data.generator.core.errors import ConfigError

Words = Mapping[str, str]
"""Current words by deprecated ones."""


@dataclass(frozen=True, slots=True)
class Renames:
    """Renamed words of one plug-in.

    Paths lead from the plug-in to a field, in current words: ``lens.model`` is the field ``model``
    of the field ``lens``; the empty path is the plug-in itself.

    Attributes:
        keys: ``{path: {old: new}}``: renamed fields of the mapping at a path, outer paths first.
        values: ``{path: {old: new}}``: renamed values of the field at a path.
    """

    keys: Mapping[str, Words] = field(default_factory=dict)
    values: Mapping[str, Words] = field(default_factory=dict)


SELECTIONS: Words = {"given": SWITCH, "otherwise": "default"}
"""Renamed keys of selections by shared values."""

TYPES: Mapping[str, Words] = {
    "elements": {"along": "lane_objects"},
    "randomizers": {"along": "lane_objects"},
}
"""Renamed plug-ins, by section."""

RANDOMIZERS: Words = {"every": "stage"}
"""Renamed fields of all randomizers."""

PLUGINS: Mapping[tuple[str, str], Renames] = {
    ("randomizers", "lane_objects"): Renames(
        {
            "": {
                "used": "occupancy",
                "turned": "reversed",
                "scattered": "uniform_area",
                "at_least": "min_count",
                "spare_m": "min_clearance_m",
                "rows": "passes",
            }
        }
    ),
    ("randomizers", "ego_on_lane"): Renames({"": {"spare_m": "min_clearance_m"}}),
    ("randomizers", "camera_on_lane"): Renames({"": {"turned": "reversed"}}),
    ("randomizers", "lighting"): Renames({"": {"keep": "keep_existing", "panel_m": "width_m"}}),
    ("randomizers", "ceiling_lights"): Renames({"": {"keep": "keep_existing"}}),
    ("sensors", "watcher"): Renames({"": {"watches": "events"}}),
    ("sensors", "lidar"): Renames(
        {"": {"motion": "motion_distortion"}},
        {"motion_distortion": {"compensated": "deskewed", "frozen": "none"}},
    ),
    ("sensors", "rgb_camera"): Renames(
        {
            "": {"formation": "image_pipeline"},
            "image_pipeline": {
                "bloom": "glare",
                "photosites": "image_sensor",
                "shutter": "exposure_control",
            },
        },
        {"lens.model": {"published": "calibrated"}},
    ),
}
"""Renamed words of single plug-ins, by section and current type."""

MOVED: Mapping[tuple[str, ...], str] = {
    ("render", key): f"sensors[].image_pipeline.{key}: it is a property of each camera"
    for key in ("tone", "glare", "exposure_compensation_ev")
}
"""Current places of keys that were removed from another one."""

SECTIONS = ("elements", "randomizers", "sensors", "shared")


def replace_old_words(document: Node) -> Node:
    """Replace the deprecated words of a document.

    Plug-ins without a type are left alone: they override inherited ones, and are treated again
    when they have been merged with these. Where a merged document has both the old and the new
    word, the old one is the override.

    Raises:
        ConfigError: a deprecated word and its replacement are in the same file.
    """
    if not isinstance(document.content, Mapping):
        return document
    content = {
        key: _replace_in_section(node, key) if key in SECTIONS else node
        for key, node in document.content.items()
    }
    return replace(document, content=content)


def refuse_moved_keys(document: Node) -> None:
    """Check that a merged document has no key that now belongs elsewhere.

    Raises:
        ConfigError: it has some; each is reported with its current place.
    """
    problems = Problems()
    for (*parents, key), place in MOVED.items():
        node = document.get(*parents)
        if node is not None and node.get(key) is not None:
            problems.add(node.key_position(key), ".".join((*parents, key)), f"has moved to {place}")
    problems.raise_if_any()


def _replace_in_section(node: Node, section: str) -> Node:
    node = _rename_selections(node, section)
    if isinstance(node.content, tuple):
        items = (_rename_plugin(n, section, f"{section}[{k}]") for k, n in enumerate(node.content))
        return replace(node, content=tuple(items))
    if isinstance(node.content, Mapping) and section != "shared":
        entries = {k: _rename_plugin(n, section, f"{section}.{k}") for k, n in node.content.items()}
        return replace(node, content=entries)
    return node


def _rename_selections(node: Node, path: str) -> Node:
    """Rename the keys of all selections in a value."""
    if isinstance(node.content, tuple):
        items = (_rename_selections(n, f"{path}[{k}]") for k, n in enumerate(node.content))
        return replace(node, content=tuple(items))
    if not isinstance(node.content, Mapping):
        return node
    if "given" in node.content:
        node = _rename_keys(node, path, SELECTIONS)
    assert isinstance(node.content, Mapping)
    content = {key: _rename_selections(n, f"{path}.{key}") for key, n in node.content.items()}
    return replace(node, content=content)


def _rename_plugin(item: Node, section: str, path: str) -> Node:
    """Rename the type, the fields and their values."""
    type_words = TYPES.get(section, {})
    item = _at(item, "type", path, partial(_rename_value, words=type_words))
    kind = item.get("type")
    if kind is None or not isinstance(kind.content, str):
        return item
    renames = PLUGINS.get((section, kind.content), Renames())
    if section == "randomizers":
        item = _rename_keys(item, path, RANDOMIZERS)
    for place, words in renames.keys.items():
        item = _at(item, place, path, partial(_rename_keys, words=words))
    for place, words in renames.values.items():
        item = _at(item, place, path, partial(_rename_value, words=words))
    return item


def _at(node: Node, place: str, path: str, change: Callable[[Node, str], Node]) -> Node:
    """Change the node at a dotted place, if there is one; in a selection, that of every entry."""
    if not place:
        return change(node, path)
    if not isinstance(node.content, Mapping):
        return node
    content = dict(node.content)
    if SWITCH in content:
        for key in content.keys() - {SWITCH}:
            content[key] = _at(content[key], place, f"{path}.{key}", change)
    key, _, rest = place.partition(".")
    if key in content:
        content[key] = _at(content[key], rest, f"{path}.{key}", change)
    return replace(node, content=content)


def _rename_keys(node: Node, path: str, words: Words) -> Node:
    """Rename keys of a mapping, in their order; nothing else has keys."""
    if not isinstance(node.content, Mapping):
        return node
    if SWITCH in node.content and words is not SELECTIONS:
        content = {k: _rename_keys(n, f"{path}.{k}", words) for k, n in node.content.items()}
        return replace(node, content=content)
    if not words.keys() & node.content.keys():
        return node
    content = {}
    positions: dict[str, Position] = {}
    for key, value in node.content.items():
        new, place = words.get(key, key), node.key_position(key)
        if new != key:
            if new in node.content and place.file == node.key_position(new).file:
                fact = f"is called '{new}' now, which is given, too; expected one of them"
                raise ConfigError(str(Problem(place, f"{path}.{key}", fact)))
            _warn(place, f"{path}.{key}", key, new)
        content[new] = merge_nodes(content[new], value) if new in content else value
        positions[new] = place
    return replace(node, content=content, key_positions=positions)


def _rename_value(node: Node, path: str, words: Words) -> Node:
    """Rename a word; in a selection, that of every entry."""
    if isinstance(node.content, Mapping) and SWITCH in node.content:
        entries = {
            key: entry if key == SWITCH else _rename_value(entry, f"{path}.{key}", words)
            for key, entry in node.content.items()
        }
        return replace(node, content=entries)
    if not isinstance(node.content, str) or node.content not in words:
        return node
    word = words[node.content]
    _warn(node.position, path, node.content, word)
    return replace(node, content=word, text=word)


def _warn(place: Position, path: str, old: str, new: str) -> None:
    if Path(place.file).name == PLAN:
        return  # The record of a data set, which nobody edits.
    fact = f"'{old}' is called '{new}' now; the old name will be refused by the next release"
    message = str(Problem(Position(place.file, place.line, place.column), path, fact))
    warnings.warn(message, FutureWarning, stacklevel=2)
