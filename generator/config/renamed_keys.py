"""Deprecated words of configuration documents, and their replacements.

Deprecated words are accepted for one release, each with a ``FutureWarning`` that names its place
and the current word. All of them are in ``renamed_keys.yaml``; plug-ins know only the current ones.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from gen_data.config import data_files, merging, paths
from gen_data.config.problems import FieldPath, Position, Problem, Problems, format_path, refuse
from gen_data.config.shared_values import SWITCH
from gen_data.config.yaml_tree import Node
from gen_data.core.bounded_cache import ObjectCache

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


_TABLES = data_files.load_data(__package__, "renamed_keys")
SELECTIONS: Words = _TABLES["selections"]
TYPES: Mapping[str, Words] = _TABLES["types"]
RANDOMIZERS: Words = _TABLES["randomizers"]
MOVED: Mapping[str, Words] = _TABLES["moved"]
PLUGINS: Mapping[tuple[str, str], Renames] = {
    (section, kind): Renames(**renames)
    for section, plugins in _TABLES["plugins"].items()
    for kind, renames in plugins.items()
}
SECTIONS = ("elements", "randomizers", "sensors", "shared")


def replace_old_words(document: Node) -> Node:
    """Replace the deprecated words of a document.

    Plug-ins without a type are left alone: they override inherited ones, and are treated again
    when they have been merged with these. Where a merged document has both the old and the new
    word, the old one is the override.

    Raises:
        ConfigError: a deprecated word and its replacement are in the same file.
    """
    return document.with_children(
        lambda key, node: _replace_in_section(node, str(key)) if key in SECTIONS else node
    )


def refuse_moved_keys(document: Node) -> None:
    """Check that a merged document has no key that now belongs elsewhere.

    Raises:
        ConfigError: it has some; each is reported with its current place.
    """
    problems = Problems()
    for section, places in MOVED.items():
        node = document.get(section)
        for key, place in places.items():
            if node is not None and node.get(key) is not None:
                problems.add(node.key_position(key), f"{section}.{key}", f"has moved to {place}")
    problems.raise_if_any()


_CURRENT: ObjectCache[set[str]] = ObjectCache(1024)
"""Sections in which the latest items have no deprecated word: inherited ones are met again."""


def _replace_in_section(node: Node, section: str) -> Node:
    if "given" in node.entries:
        node = _rename_keys(node, (section,), SELECTIONS)
    return node.with_children(lambda part, item: _replace_in_item(item, section, part))


def _replace_in_item(item: Node, section: str, part: str | int) -> Node:
    current = _CURRENT.get(item, set)
    if section in current:
        return item
    renamed = _rename_selections(item, (section, part))
    if section != "shared":
        renamed = _rename_plugin(renamed, section, (section, part))
    if renamed is item:
        current.add(section)
    return renamed


def _rename_selections(node: Node, path: FieldPath) -> Node:
    if "given" in node.entries:
        node = _rename_keys(node, path, SELECTIONS)
    return node.with_children(lambda part, child: _rename_selections(child, (*path, part)))


def _rename_plugin(item: Node, section: str, path: FieldPath) -> Node:
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


def _at(node: Node, place: str, path: FieldPath, change: Callable[[Node, FieldPath], Node]) -> Node:
    """Change the node at a dotted place, if there is one; in a selection, in every entry."""
    if not place:
        return change(node, path)
    key, _, rest = place.partition(".")

    def change_child(part: str | int, child: Node) -> Node:
        if SWITCH in node.entries and part != SWITCH:
            child = _at(child, place, (*path, part), change)
        return _at(child, rest, (*path, part), change) if part == key else child

    return node.with_children(change_child)


def _rename_keys(node: Node, path: FieldPath, words: Words) -> Node:
    """Rename keys of a mapping, in their order; nothing else has keys."""
    if SWITCH in node.entries and words is not SELECTIONS:
        return node.with_children(lambda part, child: _rename_keys(child, (*path, part), words))
    if not words.keys() & node.entries.keys():
        return node
    content: dict[str, Node] = {}
    positions: dict[str, Position] = {}
    for key, value in node.entries.items():
        new, place = words.get(key, key), node.key_position(key)
        if new != key:
            if new in node.entries and place.file == node.key_position(new).file:
                fact = f"is called '{new}' now, which is given, too; expected one of them"
                refuse(place, (*path, key), fact)
            _warn(place, (*path, key), key, new)
        content[new] = merging.merge_nodes(content[new], value) if new in content else value
        positions[new] = place
    return replace(node, content=content, key_positions=positions)


def _rename_value(node: Node, path: FieldPath, words: Words) -> Node:
    """Rename a word; in a selection, in every entry."""
    if SWITCH in node.entries:
        return node.with_children(
            lambda key, entry: entry if key == SWITCH else _rename_value(entry, (*path, key), words)
        )
    if not isinstance(node.content, str) or node.content not in words:
        return node
    word = words[node.content]
    _warn(node.position, path, node.content, word)
    return replace(node, content=word, text=word)


def _warn(place: Position, path: FieldPath, old: str, new: str) -> None:
    if Path(place.file).name == paths.PLAN:
        return  # The record of a data set, which nobody edits.
    fact = f"'{old}' is called '{new}' now; the old name will be refused by the next release"
    message = str(Problem(replace(place, source=""), format_path(path), fact))
    warnings.warn(message, FutureWarning, stacklevel=2)
