"""Loading of configurations and templates, and their merging into one document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from types import ModuleType

from gen_data import configs, scene_templates
from gen_data.generator.assemble.inheritance import (
    LISTS,
    load_extended,
    mapping_of,
    override_elements,
)
from gen_data.generator.config.merging import merge_nodes
from gen_data.generator.config.paths import find_path
from gen_data.generator.config.problems import Position, Problems
from gen_data.generator.config.renamed_keys import refuse_moved_keys, replace_old_words
from gen_data.generator.config.yaml_tree import Node, load_yaml, with_override
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.sensors.lidar.datasheets import load_sheets

SECTIONS = ("render", "physics", "labels", "splits", "assets", "shared")
"""Optional mappings of a configuration; a resolved document has them all."""

TEMPLATE_KEYS = ("shared", "defaults", "elements")
"""Keys of a template."""


def resolve_document(
    document: Node, *, seed: int | None, overrides: Sequence[str], without: Sequence[str]
) -> Node:
    """Merge a configuration with its template and the overrides of the command line.

    In the result, ``elements`` is a list, ``template`` is only a name, and all sections exist.

    Raises:
        ConfigError: the document, its template or an override is invalid.
    """
    document = replace_old_words(document)
    content = dict(mapping_of(document))
    template = _load_template(document)
    content["elements"] = _merge_elements(document, template)
    _inherit_shared(content, template)
    for key in SECTIONS:
        content.setdefault(key, _default_node({}))
    for key in LISTS:
        content.setdefault(key, _default_node(()))
    if seed is not None:
        content["seed"] = _default_node(seed)
    resolved = Node(document.position, content, document.key_positions)
    for text in overrides:
        path, separator, value = text.partition("=")
        if not separator:
            raise ConfigError(f"--set {text}: expected KEY=VALUE")
        resolved = with_override(resolved, path.strip(), value.strip())
    resolved = replace_old_words(resolved)
    refuse_moved_keys(resolved)
    return _without_randomizers(_with_datasheets(resolved), without)


def _with_datasheets(document: Node) -> Node:
    """Replace references to datasheets in sensors by their contents."""
    content, sensors = dict(mapping_of(document)), document.get("sensors")
    if sensors is not None and isinstance(sensors.content, tuple):
        listed = tuple(load_sheets(sensor) for sensor in sensors.content)
        content["sensors"] = Node(sensors.position, listed, sensors.key_positions)
    return Node(document.position, content, document.key_positions)


def load_config_document(name: str) -> Node:
    """Load a configuration by path or shipped name, with everything that it extends.

    Raises:
        ConfigError: a file is missing or invalid, or extends itself.
    """
    shipped = _shipped_files(configs)
    return load_extended(find_path(name, None, "", "configuration", shipped=shipped), shipped)


def _shipped_files(package: ModuleType) -> list[Path]:
    """YAML files of a package."""
    return sorted(Path(str(files(package))).glob("*.yaml"))


def _load_template(document: Node) -> Node | None:
    """Load the template; None if the configuration lists its elements itself."""
    given = document.get("elements")
    template = document.get("template")
    if given is not None and isinstance(given.content, tuple):
        return None
    if template is None or not isinstance(template.content, str):
        problems = Problems()
        where = document.position if template is None else template.position
        problems.add(where, "template", "expected the name of a template, or a list of elements")
        problems.raise_if_any()
        raise AssertionError("unreachable")
    shipped = _shipped_files(scene_templates)
    path = find_path(template.content, template.position, "template", "template", shipped=shipped)
    loaded = replace_old_words(load_yaml(path))
    problems = Problems()
    for key in mapping_of(loaded):
        if key not in TEMPLATE_KEYS:
            fact = f"unknown key; a template has {', '.join(TEMPLATE_KEYS)}"
            problems.add(loaded.key_position(key), key, fact + did_you_mean(key, TEMPLATE_KEYS))
    problems.raise_if_any()
    return loaded


def _inherit_shared(content: dict[str, Node], template: Node | None) -> None:
    """Merge the shared values of a template with those of the configuration, which win.

    The template's come first, so that the configuration's may depend on them.
    """
    own, inherited = content.get("shared"), template.get("shared") if template else None
    if inherited is None or (own is not None and not isinstance(own.content, Mapping)):
        return
    entries = {**mapping_of(inherited), **(mapping_of(own) if own else {})}
    positions = {**inherited.key_positions, **(own.key_positions if own else {})}
    content["shared"] = Node((own or inherited).position, entries, positions)


def _merge_elements(document: Node, template: Node | None) -> Node:
    """Merge the template's elements with the configuration's overrides and new elements."""
    given = document.get("elements")
    if template is None:
        assert given is not None
        return given
    elements = template.get("elements")
    if elements is None or not isinstance(elements.content, tuple):
        raise ConfigError(f"{template.position.file}: a template needs a list of elements")
    elements = _with_defaults(elements, template.get("defaults"))
    if given is None:
        return elements
    return override_elements(elements, given)


def _with_defaults(elements: Node, defaults: Node | None) -> Node:
    """Apply a template's defaults to its elements of each type."""
    if defaults is None:
        return elements
    assert isinstance(elements.content, tuple)
    by_type, problems = mapping_of(defaults), Problems()
    types = {str(_scalar(item, "type")) for item in elements.content}
    for kind in by_type:
        if kind not in types:
            fact = f"no element is of this type; expected one of {', '.join(sorted(types))}"
            fact += did_you_mean(kind, types)
            problems.add(defaults.key_position(kind), f"defaults.{kind}", fact)
    problems.raise_if_any()
    merged = tuple(
        merge_nodes(by_type[kind], item)
        if (kind := str(_scalar(item, "type"))) in by_type
        else item
        for item in elements.content
    )
    return Node(elements.position, merged)


def _without_randomizers(document: Node, names: Sequence[str]) -> Node:
    listed = document.get("randomizers")
    if not names or listed is None or not isinstance(listed.content, tuple):
        return document
    known = [str(_scalar(node, "name") or _scalar(node, "type")) for node in listed.content]
    for name in names:
        if name not in known:
            raise ConfigError(
                f"--without {name}: there is no such randomizer; expected one of "
                f"{', '.join(known)}{did_you_mean(name, known)}"
            )
    kept = tuple(n for n, name in zip(listed.content, known, strict=True) if name not in names)
    content = {**mapping_of(document), "randomizers": Node(listed.position, kept)}
    return Node(document.position, content, document.key_positions)


def _scalar(node: Node, key: str) -> object:
    found = node.get(key)
    return None if found is None else found.content


def _default_node(content: dict[str, Node] | tuple[Node, ...] | int) -> Node:
    """Node of a value that is in no file."""
    return Node(Position("(default)", 1, 1), content)
