"""Completions and help at a position in a configuration, from its JSON Schema.

The text is usually invalid while the user types: a mark replaces the word at the cursor, and if the
whole text with the mark is not YAML, the text up to the cursor is completed with its closing
brackets.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from gen_data.config.distributions import DISTRIBUTIONS
from gen_data.config.merging import node_name
from gen_data.config.problems import FieldPath
from gen_data.config.schema import SHARED_VALUE, FieldSchema
from gen_data.config.yaml_scalars import abbreviate, to_flow_yaml
from gen_data.config.yaml_tree import Node, parse_yaml
from gen_data.core.errors import GenDataError

MARK = "cursor__mark"
_WORD = re.compile(r"[\w./$-]*")
_OPENING, _CLOSING = "[{", "]}"


@dataclass(frozen=True, slots=True)
class Proposal:
    """A word that fits at the cursor.

    Attributes:
        label: The word.
        insert: Text to insert.
        kind: ``property`` or ``enum``, for its icon.
        detail: Type and range.
        info: Description.
    """

    label: str
    insert: str
    kind: str
    detail: str = ""
    info: str = ""


@cache
def root_schema() -> FieldSchema:
    """Schema of configurations without shared values, which fit everywhere; takes a second."""
    from gen_data.assemble.config_schema import INHERITED, config_schema

    def simplify(part: Any) -> Any:
        if isinstance(part, list):
            return [simplify(one) for one in part if one is not INHERITED and one != _SHARED]
        if not isinstance(part, dict):
            return part
        plain = {key: simplify(value) for key, value in part.items()}
        options = plain.get("anyOf", ())
        return options[0] if len(options) == 1 and len(part["anyOf"]) > 1 else plain

    schema = simplify(config_schema())
    return FieldSchema(schema, schema["$defs"])


_SHARED = {"$ref": f"#/$defs/{SHARED_VALUE}"}


def complete(text: str, offset: int, inherited: Node | None = None) -> tuple[int, list[Proposal]]:
    """Words that fit at an offset in a text.

    Args:
        text: Text of the editor.
        offset: Position of the cursor [characters].
        inherited: The latest resolved document, for the types of inherited items.

    Returns:
        Offset at which the word at the cursor begins, and the proposals.
    """
    start = len(text[:offset]) - len(_last_word(text[:offset]))
    found = _find_mark(text, start, offset)
    if found is None:
        return start, []
    tree, path, is_key = found
    places = _below(tree, path, inherited)
    if not is_key:
        return start, list(_values(places))
    taken = {str(key) for key in (tree.get(*path) or tree).entries} - {MARK}
    is_new_item = not taken and bool(path) and isinstance(path[-1], int)
    return start, list(_values(places) if is_new_item else _keys(places, taken))


def explain(text: str, offset: int, inherited: Node | None = None) -> tuple[str, str]:
    """Name of the field at an offset, and its type, default and description; empty if unknown."""
    word = _WORD.match(text, len(text[:offset]) - len(_last_word(text[:offset])))
    if word is None or not word[0] or not re.match(r"\s*:", text[word.end() :]):
        return "", ""
    name = word[0]
    found = _find_mark(text, word.start(), word.end(), as_key=True)
    if found is None:
        return "", ""
    tree, path, _ = found
    for option in _below(tree, path, inherited):
        if name in option.fields:
            return name, describe_field(option, name)
    return "", ""


def describe_field(model: FieldSchema, name: str) -> str:
    """Type, default and description of a field of a model, one a line."""
    field = model.child(name)
    lines = [field.words()]
    if field.schema.get("default") is not None:
        lines.append(f"default {to_flow_yaml(field.schema['default'])}")
    return "\n".join([*lines, *filter(None, [field.schema.get("description")])])


def item_schema(section: str, kind: str) -> FieldSchema | None:
    """Schema of the plug-ins of a type in a section; None if there is none."""
    items = _children([root_schema().child(section)], 0)
    return next((item for item in items if item.tags.get("type") == kind), None)


def _last_word(before: str) -> str:
    return re.search(r"[\w./$-]*$", before)[0]  # type: ignore[index]


def _find_mark(
    text: str, start: int, end: int, *, as_key: bool | None = None
) -> tuple[Node, FieldPath, bool] | None:
    """Tree of the text with a mark in place of the word, and the path of its parent or value.

    Returns:
        Tree, path and whether the mark is a key; None if nothing near the cursor is YAML.
    """
    word = _WORD.match(text, start)
    behind = text[max(end, word.end() if word else end) :]
    before = text[:start]
    if as_key is not None:
        behind = re.sub(r"^\s*:", "", behind)
    line_behind = re.split(r"[\r\n]", behind)[0]
    for is_key in (True, False) if as_key is None else (as_key,):
        mark = f"{MARK}: 0" if is_key and as_key is None else f"{MARK}:" if is_key else MARK
        for rest in (behind, line_behind + _closing(before + line_behind), _closing(before)):
            try:
                tree = parse_yaml(f"{before}{mark}{rest}", "text")
            except GenDataError:
                continue
            path = _path_of_mark(tree, (), is_key)
            if path is not None:
                return tree, path, is_key
    return None


def _path_of_mark(node: Node, path: FieldPath, is_key: bool) -> FieldPath | None:
    if is_key and MARK in node.entries:
        return path
    if not is_key and node.text == MARK:
        return path
    found = (_path_of_mark(child, (*path, part), is_key) for part, child in node.children.items())
    return next((place for place in found if place is not None), None)


def _closing(before: str) -> str:
    """Closing brackets for those left open in a text, judged up to its last plain line."""
    open_: list[str] = []
    quote = ""
    for number, char in enumerate(before):
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"" and (number == 0 or before[number - 1] in " \t\n[{,:"):
            quote = char
        elif char == "#" and (number == 0 or before[number - 1] in " \t\r\n"):
            quote = "\n"
        elif char in _OPENING:
            open_.append(_CLOSING[_OPENING.index(char)])
        elif char in _CLOSING and open_:
            open_.pop()
    return "".join(reversed(open_))


def _below(tree: Node, path: FieldPath, inherited: Node | None) -> list[FieldSchema]:
    """Alternatives of the value at a path, except the ones excluded by types in the tree."""
    places, node, above = list(_options(root_schema())), tree, ""
    for part in path:
        child = node.get(part) or node
        # Overrides of a template's elements by name have the form of list items.
        is_item = isinstance(part, int) or above == "elements"
        places = _children(places, 0 if is_item else part)
        kind = _kind(child, str(part), above, inherited) if is_item else child.get("type")
        chosen = [p for p in places if kind and p.tags.get("type") == kind.content]
        node, places, above = child, chosen or places, str(part) if node is tree else ""
    tags = node.entries.items()
    return [
        p for p in places if all(p.tags.get(k, v.content) == v.content for k, v in tags)
    ] or places


def _children(places: Iterable[FieldSchema], part: str | int) -> list[FieldSchema]:
    """Alternatives of a field, or of a list item, under any of the given alternatives."""
    options = [option for place in places for option in _options(place)]
    return [c for o in options if _has(o, part) for c in _options(o.child(part))]


def _has(option: FieldSchema, part: str | int) -> bool:
    if isinstance(part, int):
        return "items" in option.schema or "prefixItems" in option.schema
    return part in option.fields or isinstance(option.schema.get("additionalProperties"), Mapping)


def _kind(node: Node, key: str, section: str, inherited: Node | None) -> Node | None:
    """Type of an item, stated by itself or by the inherited item with the same name."""
    own, name = node.get("type"), key if section == "elements" else node_name(node)
    items = inherited.entries[section].items if inherited and section in inherited.entries else ()
    named = [item.get("type") for item in items if node_name(item) in (name, key)]
    return own or next(iter(named), None)


def _options(place: FieldSchema) -> Iterator[FieldSchema]:
    """Alternatives of a schema, at any depth; itself if it has none."""
    if not place.branches:
        yield place
    for branch in place.branches:
        yield from _options(branch)


def _keys(places: Iterable[FieldSchema], taken: set[str]) -> Iterator[Proposal]:
    seen = set(taken)
    for option in places:
        for name in option.fields:
            if name not in seen:
                seen.add(name)
                field = option.child(name)
                info = field.schema.get("description") or option.schema.get("description", "")
                yield Proposal(name, f"{name}: ", "property", abbreviate(field.words()), info)


def _values(places: Iterable[FieldSchema]) -> Iterator[Proposal]:
    seen: set[str] = set()
    for option in places:
        info = option.schema.get("description", "")
        words = [(to_flow_yaml(value), "") for value in option.choices]
        if option.schema.get("type") == "boolean":
            words = [("true", ""), ("false", "")]
        kind = option.tags.get("type")
        words += [(str(kind), f"{{type: {kind}, ")] if kind else []
        words += [(name, f"{{{name}: ") for name in option.fields if name in DISTRIBUTIONS]
        for label, insert in words:
            if label not in seen:
                seen.add(label)
                yield Proposal(label, insert or label, "enum", "", info)
