"""Loading of configurations and templates, and their merging into one document.

A configuration extends others, and overrides elements of its template.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from types import ModuleType

from gen_data import configs, scene_templates
from gen_data.config.merging import merge_named, merge_nodes, node_name, with_entry
from gen_data.config.paths import find_path
from gen_data.config.problems import Position, Problems, format_path, refuse
from gen_data.config.renamed_keys import refuse_moved_keys, replace_old_words
from gen_data.config.shared_checks import check_shared
from gen_data.config.yaml_scalars import quote_value
from gen_data.config.yaml_tree import Node, load_yaml, parse_yaml, with_override
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.scene_time import wrist_name
from gen_data.pipeline.splits import SHARES
from gen_data.randomizers.arm_task_table import load_tasks
from gen_data.sensors.calibration.load_calibrations import load_calibrations
from gen_data.sensors.lidar.datasheets import load_sheets

LISTS = ("randomizers", "sensors", "annotations", "exporters")
"""Lists of plug-ins of a configuration, besides its elements."""

OUTPUTS = ("annotations", "exporters")
"""Lists of computed and written data; unlike plug-ins with names, a new one replaces another."""

NAMED = (*LISTS, "elements", "shared")
"""Sections whose entries have names, by which ``without`` leaves them out."""

ALL = "all"
"""Keyword for all inherited items of a section, in place of a list of names."""

EXTENDS_MAX = 8
"""Longest chain of configurations that extend one another."""

SECTIONS = ("render", "physics", "labels", "splits", "assets", "dataset", "shared")
"""Optional mappings of a configuration; a resolved document has them all."""

NOWHERE = Position("(default)", 1, 1)
"""Position of values that are in no file."""

NOTHING = Node(NOWHERE, {})

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
    content = dict(_mapping_of(document))
    template = _load_template(document)
    content["elements"] = _merge_elements(document, template)
    _inherit_shared(content, template)
    for key in (*SECTIONS, *LISTS):
        content.setdefault(key, Node(NOWHERE, () if key in LISTS else {}))
    if seed is not None:
        content["seed"] = Node(NOWHERE, seed)
    resolved = Node(document.position, content, document.key_positions)
    before = resolved.entries["shared"]
    for text in overrides:
        path, separator, value = text.partition("=")
        if not separator:
            raise ConfigError(f"--set {text}: expected KEY=VALUE")
        resolved = with_override(resolved, path.strip(), value.strip())
    resolved = replace_old_words(resolved)
    refuse_moved_keys(resolved)
    shared = _with_replaced(before, resolved.entries["shared"])
    resolved = replace(resolved, content={**resolved.entries, "shared": shared})
    check_shared(resolved, (template.get("shared") or NOTHING) if template else before)
    return _without_randomizers(_with_files(resolved), without)


def _with_files(document: Node) -> Node:
    """Replace names of sheets and calibrations in sensors, of tasks in randomizers, by content.

    The name of an exporter becomes a mapping: whole documents are compared.
    """
    sensors, randomizers = document.entries["sensors"], document.entries["randomizers"]
    exporters = document.entries["exporters"]
    if isinstance(exporters.content, tuple):
        exporters = exporters.with_children(_with_type)
    if isinstance(sensors.content, tuple):
        wrists = _wrists_of(document.entries["elements"])
        sensors = sensors.with_children(partial(_with_sensor_files, wrists))
    if isinstance(randomizers.content, tuple):
        randomizers = randomizers.with_children(lambda _, randomizer: load_tasks(randomizer))
    changed = {"sensors": sensors, "randomizers": randomizers, "exporters": exporters}
    content = {**document.entries, **changed}
    return replace(document, content=content)


def _with_type(_number: str | int, item: Node) -> Node:
    """A mapping with the type that a text names."""
    return Node(item.position, {"type": item}) if isinstance(item.content, str) else item


def _wrists_of(elements: Node) -> frozenset[str]:
    """Names of the rigs on the hands of the robots among elements."""
    robots = (item for item in elements.items if _kind_of(item) == "robot")
    return frozenset(wrist_name(node_name(robot)) for robot in robots)


def _with_sensor_files(wrists: frozenset[str], number: str | int, sensor: Node) -> Node:
    field = f"sensors[{number}]"
    return load_calibrations(load_sheets(sensor, field), field, wrists)


def load_config_document(name: str) -> Node:
    """Load a configuration by path or shipped name, with everything that it extends.

    Raises:
        ConfigError: a file is missing or invalid, or extends itself.
    """
    shipped = _shipped_files(configs)
    also = "the folder of a data set"
    path = find_path(name, None, "", "configuration", shipped=shipped, also=also)
    return _complete(load_yaml(path), (path,))


def shipped_text(name: str) -> str:
    """Text of a shipped configuration; empty if there is none of that name."""
    found = (path for path in _shipped_files(configs) if name in (path.name, path.stem))
    return next((path.read_text("utf-8") for path in found), "")


def parse_config_document(text: str, file: str) -> Node:
    """Parse the text of a configuration, and load everything that it extends.

    Raises:
        ConfigError: the text, or a file that it extends, is invalid; messages call it ``file``.
    """
    return _complete(parse_yaml(text, file), ())


def _complete(document: Node, chain: tuple[Path, ...]) -> Node:
    """Merge a document into everything that it extends; each file of ``chain`` extends the next."""
    document = replace_old_words(document)
    base = document.get("extends")
    if base is None:
        return document
    shipped = _shipped_files(configs)
    if not isinstance(base.content, str):
        refuse(base.position, "extends", "expected a configuration")
    found = find_path(base.content, base.position, "extends", "configuration", shipped=shipped)
    if found.resolve() in [file.resolve() for file in chain]:
        fact = f"extends itself: {' -> '.join(str(file) for file in (*chain, found))}"
        refuse(base.position, "extends", fact)
    if len(chain) > EXTENDS_MAX:
        fact = f"more than {EXTENDS_MAX} configurations extend one another"
        refuse(base.position, "extends", fact)
    merged = _merge_into_base(_complete(load_yaml(found), (*chain, found)), document)
    # Again, because overrides without a type have got one now.
    return replace_old_words(merged)


def _merge_into_base(base: Node, document: Node) -> Node:
    _check_outputs(document)
    content = dict(_mapping_of(_without(base, document.get("without"))))
    for key, node in _mapping_of(document).items():
        if key in ("extends", "without"):
            continue
        inherited = content.get(key)
        if inherited is None:
            content[key] = node
        elif key in (*LISTS, "elements") and key not in OUTPUTS:
            content[key] = _merge_items(inherited, node)
        else:
            merged = merge_nodes(_without_shares(key, inherited, node), node)
            content[key] = _with_replaced(inherited, merged) if key == "shared" else merged
    positions = {**base.key_positions, **document.key_positions}
    return Node(document.position, content, positions)


def _without_shares(section: str, base: Node, override: Node) -> Node:
    """Drop inherited shares of splits where new ones are given: together they are one value."""
    if section != "splits" or override.entries.keys().isdisjoint(SHARES):
        return base
    kept = {key: node for key, node in base.entries.items() if key not in SHARES}
    return replace(base, content=kept)


def _check_outputs(document: Node) -> None:
    """Refuse names to leave out of an inherited list that the document replaces."""
    problems = Problems()
    for key in OUTPUTS:
        names = document.get("without", key)
        if document.get(key) is not None and names is not None and names.content != ALL:
            fact = f"the list '{key}' replaces all inherited ones; expected one of the two"
            problems.add(names.position, f"without.{key}", fact)
    problems.raise_if_any()


def _merge_items(base: Node, override: Node) -> Node:
    """Merge plug-ins into inherited ones; a mapping overrides elements by name."""
    if isinstance(base.content, tuple) and isinstance(override.content, Mapping):
        return _override_elements(base, override)
    if isinstance(base.content, tuple):
        return merge_named(base, override)
    return merge_nodes(base, override)


def _without(base: Node, dropped: Node | None) -> Node:
    """Drop the inherited items that ``without`` names by section."""
    if dropped is None:
        return base
    content, problems = dict(_mapping_of(base)), Problems()
    for key, names in _mapping_of(dropped).items():
        field = format_path(("without", key))
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
    section = section or Node(NOWHERE, ())
    kept = {**section.entries, **{node_name(item): item for item in section.items}}
    for name in names:
        if str(name.content) not in kept:
            fact = f"nothing inherited is named {quote_value(name.plain())}; expected one of "
            fact += ", ".join(kept) or "none: nothing of this section is inherited"
            problems.add(name.position, field, fact + did_you_mean(str(name.content), kept))
        kept.pop(str(name.content), None)
    is_mapping = isinstance(section.content, Mapping)
    return Node(section.position, kept if is_mapping else tuple(kept.values()))


def _override_elements(elements: Node, overrides: Node) -> Node:
    """Merge overrides by name into a list of elements; an override with a type may be new."""
    by_name = {node_name(node): node for node in elements.items}
    problems = Problems()
    if not isinstance(overrides.content, Mapping):
        problems.add(overrides.position, "elements", "expected overrides by element name")
    for name, given in overrides.entries.items():
        name_node = Node(overrides.key_position(name), name, text=name)
        node = given if given.get("name") else with_entry(given, "name", name_node)
        if name in by_name:
            by_name[name] = merge_nodes(by_name[name], node)
        elif node.get("type") is not None:
            # New elements come after the template's.
            by_name[name] = node
        else:
            fact = f"the template has no element {quote_value(name)}; expected one of "
            fact += ", ".join(by_name) + did_you_mean(name, by_name)
            problems.add(overrides.key_position(name), ("elements", name), fact)
    problems.raise_if_any()
    return Node(elements.position, tuple(by_name.values()))


def _mapping_of(node: Node) -> Mapping[str, Node]:
    """The entries of a mapping; ConfigError for anything else."""
    if not isinstance(node.content, Mapping):
        raise ConfigError(f"{node.position}: expected a mapping of settings")
    return node.content


def _shipped_files(package: ModuleType) -> list[Path]:
    return sorted(Path(str(files(package))).glob("*.yaml"))


def _load_template(document: Node) -> Node | None:
    """Load the template; None if the configuration lists its elements itself."""
    given = document.get("elements")
    template = document.get("template")
    if given is not None and isinstance(given.content, tuple):
        return None
    if template is None or not isinstance(template.content, str):
        fact = "expected the name of a template, or its file"
        is_list = template is not None and isinstance(template.content, tuple)
        fact += "; a list of elements has the key 'elements'" if is_list else ", or 'elements'"
        refuse((template or document).position, "template", fact)
    shipped = _shipped_files(scene_templates)
    path = find_path(template.content, template.position, "template", "template", shipped=shipped)
    loaded = replace_old_words(load_yaml(path))
    problems = Problems()
    for key in _mapping_of(loaded):
        if key not in TEMPLATE_KEYS:
            fact = f"unknown key; a template has {', '.join(TEMPLATE_KEYS)}"
            fact += did_you_mean(key, TEMPLATE_KEYS)
            problems.add(loaded.key_position(key), (key,), fact)
    problems.raise_if_any()
    return loaded


def _inherit_shared(content: dict[str, Node], template: Node | None) -> None:
    """Merge the shared values of a template with the configuration's, which win.

    The template's come first: the configuration's may depend on them.
    """
    own, inherited = content.get("shared"), template.get("shared") if template else None
    if inherited is None or (own is not None and not isinstance(own.content, Mapping)):
        return
    entries = {**_mapping_of(inherited), **(_mapping_of(own) if own else {})}
    positions = {**inherited.key_positions, **(own.key_positions if own else {})}
    merged = Node((own or inherited).position, entries, positions)
    content["shared"] = _with_replaced(inherited, merged)


def _with_replaced(inherited: Node, shared: Node) -> Node:
    """Shared values, each with the inherited declarations that it replaces."""

    def note(name: str | int, node: Node) -> Node:
        old = inherited.get(name)
        if old is None or old is node:
            return node
        return replace(node, replaced=(*node.replaced, old, *old.replaced))

    return shared.with_children(note)


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
    return _override_elements(elements, given)


def _with_defaults(elements: Node, defaults: Node | None) -> Node:
    if defaults is None:
        return elements
    by_type, problems = _mapping_of(defaults), Problems()
    types = {_kind_of(item) for item in elements.items}
    for kind in by_type:
        if kind not in types:
            fact = f"no element is of this type; expected one of {', '.join(sorted(types))}"
            fact += did_you_mean(kind, types)
            problems.add(defaults.key_position(kind), ("defaults", kind), fact)
    problems.raise_if_any()
    merged = (
        merge_nodes(by_type[_kind_of(item)], item) if _kind_of(item) in by_type else item
        for item in elements.items
    )
    return Node(elements.position, tuple(merged))


def _kind_of(item: Node) -> str:
    kind = item.get("type")
    return str(kind.content if kind else None)


def _without_randomizers(document: Node, names: Sequence[str]) -> Node:
    listed = document.entries["randomizers"]
    if not names or not isinstance(listed.content, tuple):
        return document
    known = [str((node.get("name") or node.get("type") or node).content) for node in listed.items]
    for name in names:
        if name not in known:
            raise ConfigError(
                f"--without {name}: there is no such randomizer; expected one of "
                f"{', '.join(known)}{did_you_mean(name, known)}"
            )
    kept = tuple(n for n, name in zip(listed.items, known, strict=True) if name not in names)
    content = {**document.entries, "randomizers": Node(listed.position, kept)}
    return replace(document, content=content)
