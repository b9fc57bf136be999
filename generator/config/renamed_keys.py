"""Words of earlier releases in a document, exchanged for those of today.

Old words are read for one release, each with a ``FutureWarning`` that names its place and the new
word. All of them are in the tables below; nothing else in the project knows them.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from gen_data.generator.config.paths import PLAN
from gen_data.generator.config.problems import Position, Problem
from gen_data.generator.config.yaml_tree import Node
from gen_data.generator.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Renames:
    """New words of one kind of plug-in.

    Attributes:
        keys: New names of fields by their old ones.
        values: ``{field: {old: new}}``, by the new names of fields; ``lens.model`` is the field
            ``model`` of the field ``lens``.
    """

    keys: Mapping[str, str]
    values: Mapping[str, Mapping[str, str]] | None = None


EVERYWHERE = {"given": "switch", "otherwise": "default"}
"""Keys of selections by shared values."""

TYPES: Mapping[str, Mapping[str, str]] = {
    "elements": {"along": "lane_objects"},
    "randomizers": {"along": "lane_objects"},
}
"""New names of plug-ins, by section."""

RANDOMIZERS = {"every": "stage"}
"""New names of fields that all randomizers have."""

PLUGINS: Mapping[tuple[str, str], Renames] = {
    ("randomizers", "lane_objects"): Renames(
        {
            "used": "occupancy",
            "turned": "reversed",
            "scattered": "uniform_area",
            "at_least": "min_count",
            "spare_m": "min_clearance_m",
            "rows": "passes",
        }
    ),
    ("randomizers", "ego_on_lane"): Renames({"spare_m": "min_clearance_m"}),
    ("randomizers", "camera_on_lane"): Renames({"turned": "reversed"}),
    ("randomizers", "lighting"): Renames({"keep": "keep_existing", "panel_m": "width_m"}),
    ("randomizers", "ceiling_lights"): Renames({"keep": "keep_existing"}),
    ("sensors", "watcher"): Renames({"watches": "events"}),
    ("sensors", "lidar"): Renames(
        {"motion": "motion_distortion"},
        {"motion_distortion": {"compensated": "deskewed", "frozen": "none"}},
    ),
    ("sensors", "rgb_camera"): Renames({}, {"lens.model": {"published": "calibrated"}}),
}
"""New words of single plug-ins, by section and new type."""

SECTIONS = ("elements", "randomizers", "sensors", "shared")


def replace_old_words(document: Node) -> Node:
    """The document in the words of this release.

    Raises:
        ConfigError: an old word and its new one are given side by side.
    """
    if not isinstance(document.content, Mapping):
        return document
    content = {
        key: _section(node, key) if key in SECTIONS else node
        for key, node in document.content.items()
    }
    return replace(document, content=content)


def _section(node: Node, key: str) -> Node:
    node = _selections(node, key)
    if isinstance(node.content, tuple):
        items = (_plugin(item, key, f"{key}[{k}]") for k, item in enumerate(node.content))
        return replace(node, content=tuple(items))
    if isinstance(node.content, Mapping) and key != "shared":
        entries = {name: _plugin(n, key, f"{key}.{name}") for name, n in node.content.items()}
        return replace(node, content=entries)
    return node


def _selections(node: Node, field: str) -> Node:
    """A value with the keys of all selections in it renamed."""
    if isinstance(node.content, tuple):
        items = (_selections(item, f"{field}[{k}]") for k, item in enumerate(node.content))
        return replace(node, content=tuple(items))
    if not isinstance(node.content, Mapping):
        return node
    if "given" in node.content:
        node = _renamed_keys(node, EVERYWHERE, field)
    assert isinstance(node.content, Mapping)
    content = {key: _selections(n, f"{field}.{key}") for key, n in node.content.items()}
    return replace(node, content=content)


def _plugin(item: Node, section: str, field: str) -> Node:
    """A plug-in with its type, its fields and their values renamed."""
    kind = item.get("type")
    if kind is None or not isinstance(kind.content, str):
        return item
    item = _renamed_value(item, ("type",), TYPES.get(section, {}), field)
    kind = item.get("type")
    renames = PLUGINS.get((section, str(kind.content if kind else "")), Renames({}))
    common = RANDOMIZERS if section == "randomizers" else {}
    item = _renamed_keys(item, {**common, **renames.keys}, field)
    for path, values in (renames.values or {}).items():
        item = _renamed_value(item, tuple(path.split(".")), values, field)
    return item


def _renamed_keys(node: Node, names: Mapping[str, str], field: str) -> Node:
    """A mapping with other keys, in their old order."""
    assert isinstance(node.content, Mapping)
    if not names.keys() & node.content.keys():
        return node
    content: dict[str, Node] = {}
    positions: dict[str, Position] = {}
    for key, value in node.content.items():
        new, place = names.get(key, key), node.key_position(key)
        if new != key:
            if new in node.content and place.file == node.key_position(new).file:
                fact = f"is called '{new}' now, which is given, too; expected one of them"
                raise ConfigError(str(Problem(place, f"{field}.{key}", fact)))
            _warn(place, f"{field}.{key}", key, new)
        content[new], positions[new] = value, place
    return replace(node, content=content, key_positions=positions)


def _renamed_value(node: Node, path: tuple[str, ...], words: Mapping[str, str], field: str) -> Node:
    """A mapping with another word at the end of a path, if it stands there."""
    child = node.get(path[0])
    if child is None or not isinstance(node.content, Mapping):
        return node
    field = f"{field}.{path[0]}"
    if len(path) > 1:
        new = _renamed_value(child, path[1:], words, field)
    elif isinstance(child.content, str) and child.content in words:
        word = words[child.content]
        _warn(child.position, field, child.content, word)
        new = replace(child, content=word, text=word)
    else:
        return node
    return replace(node, content={**node.content, path[0]: new})


def _warn(place: Position, field: str, old: str, new: str) -> None:
    if Path(place.file).name == PLAN:
        return  # A data set's own record: nobody is meant to edit it.
    fact = f"'{old}' is called '{new}' now; the old name will be refused by the next release"
    message = str(Problem(Position(place.file, place.line, place.column), field, fact))
    warnings.warn(message, FutureWarning, stacklevel=2)
