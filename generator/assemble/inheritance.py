"""Configurations that extend others, and elements that override a template's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from gen_data.generator.config.merging import merge_named, merge_nodes, node_name, with_entry
from gen_data.generator.config.paths import find_path
from gen_data.generator.config.problems import Position, Problem, Problems
from gen_data.generator.config.renamed_keys import replace_old_words
from gen_data.generator.config.yaml_scalars import quote_value
from gen_data.generator.config.yaml_tree import Node, load_yaml
from gen_data.generator.core.errors import ConfigError, did_you_mean

LISTS = ("randomizers", "sensors", "annotations", "exporters")
"""Lists of plug-ins of a configuration, besides its elements."""

NAMED = (*LISTS, "elements", "shared")
"""Sections whose entries have names, by which ``without`` leaves them out."""

ALL = "all"
"""Keyword for all inherited items of a section, in place of a list of names."""

EXTENDS_MAX = 8
"""Longest chain of configurations that extend one another."""


def load_extended(path: Path, shipped: Sequence[Path], extending: tuple[Path, ...] = ()) -> Node:
    """Load a configuration and merge it into the one that it extends.

    Args:
        path: Of the file.
        shipped: Configurations of the package.
        extending: Files on the way to this one, each of which extends the next.

    Raises:
        ConfigError: a file is missing or invalid, or extends itself.
    """
    document = replace_old_words(load_yaml(path))
    base = document.get("extends")
    if base is None:
        return document
    chain = (*extending, path)
    if not isinstance(base.content, str):
        raise ConfigError(str(Problem(base.position, "extends", "expected a configuration")))
    found = find_path(base.content, base.position, "extends", "configuration", shipped=shipped)
    if found.resolve() in [file.resolve() for file in chain]:
        fact = f"extends itself: {' -> '.join(str(file) for file in (*chain, found))}"
        raise ConfigError(str(Problem(base.position, "extends", fact)))
    if len(chain) > EXTENDS_MAX:
        fact = f"more than {EXTENDS_MAX} configurations extend one another"
        raise ConfigError(str(Problem(base.position, "extends", fact)))
    merged = _merge_into_base(load_extended(found, shipped, chain), document)
    # Again, because overrides without a type have got one now.
    return replace_old_words(merged)


def _merge_into_base(base: Node, document: Node) -> Node:
    """Merge a configuration into the one that it extends."""
    content = dict(mapping_of(_without(base, document.get("without"))))
    for key, node in mapping_of(document).items():
        if key in ("extends", "without"):
            continue
        inherited = content.get(key)
        if inherited is None:
            content[key] = node
        elif key in (*LISTS, "elements"):
            content[key] = _merge_items(inherited, node)
        else:
            content[key] = merge_nodes(inherited, node)
    positions = {**base.key_positions, **document.key_positions}
    return Node(document.position, content, positions)


def _merge_items(base: Node, override: Node) -> Node:
    """Merge plug-ins into inherited ones; a mapping overrides elements by name."""
    if isinstance(base.content, tuple) and isinstance(override.content, Mapping):
        return override_elements(base, override)
    if isinstance(base.content, tuple):
        return merge_named(base, override)
    return merge_nodes(base, override)


def _without(base: Node, dropped: Node | None) -> Node:
    """Drop the inherited items that ``without`` names by section."""
    if dropped is None:
        return base
    content, problems = dict(mapping_of(base)), Problems()
    for key, names in mapping_of(dropped).items():
        field = f"without.{key}"
        if key not in NAMED:
            fact = f"unknown key; expected one of {', '.join(NAMED)}"
            problems.add(dropped.key_position(key), field, fact)
        elif names.content == ALL:
            content.pop(key, None)
        elif not isinstance(names.content, tuple):
            problems.add(names.position, field, f"expected a list of names, or {ALL}")
        else:
            content[key] = _drop_items(content.get(key), names.content, field, problems)
    problems.raise_if_any()
    return Node(base.position, content, base.key_positions)


def _drop_items(
    section: Node | None, names: tuple[Node, ...], field: str, problems: Problems
) -> Node:
    """Drop named items from a list or mapping of plug-ins."""
    inherited = section.content if section is not None else ()
    kept: dict[str, Node] = {}
    if isinstance(inherited, Mapping):
        kept = dict(inherited)
    elif isinstance(inherited, tuple):
        kept = {node_name(item): item for item in inherited}
    for name in names:
        if str(name.content) not in kept:
            fact = f"nothing inherited is named {quote_value(name.content)}; expected one of "
            fact += ", ".join(kept) + did_you_mean(str(name.content), kept)
            problems.add(name.position, field, fact)
        kept.pop(str(name.content), None)
    where = section.position if section is not None else Position("(default)", 1, 1)
    return Node(where, kept if isinstance(inherited, Mapping) else tuple(kept.values()))


def override_elements(elements: Node, overrides: Node) -> Node:
    """Merge overrides by name into a list of elements; an override with a type may be new.

    Raises:
        ConfigError: an override without a type names no element.
    """
    assert isinstance(elements.content, tuple)
    by_name = {node_name(node): node for node in elements.content}
    problems = Problems()
    if not isinstance(overrides.content, Mapping):
        problems.add(overrides.position, "elements", "expected overrides by element name")
    else:
        for name, given in overrides.content.items():
            name_node = Node(overrides.key_position(name), name, text=name)
            node = given if given.get("name") else with_entry(given, "name", name_node)
            if name not in by_name and node.get("type") is not None:
                # New elements come after those of the template.
                by_name[name] = node
            elif name not in by_name:
                fact = f"the template has no element '{name}'; expected one of "
                fact += ", ".join(by_name) + did_you_mean(name, by_name)
                problems.add(overrides.key_position(name), f"elements.{name}", fact)
            else:
                by_name[name] = merge_nodes(by_name[name], node)
    problems.raise_if_any()
    return Node(elements.position, tuple(by_name.values()))


def mapping_of(node: Node) -> Mapping[str, Node]:
    """The entries of a mapping.

    Raises:
        ConfigError: the node is not a mapping.
    """
    if not isinstance(node.content, Mapping):
        raise ConfigError(f"{node.position}: expected a mapping of settings")
    return node.content
