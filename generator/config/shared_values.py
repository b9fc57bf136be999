"""Values that are drawn once per scene, and references to them.

A configuration may have a section ``shared`` of named values. Each is drawn once per scene from its
own stream, so that their order has no effect. Elsewhere, ``$shared.NAME`` stands for such a value,
and a mapping with the key ``switch`` for the entry that the value selects::

    shared:
      road: {choice: {street: 3, highway: 1}}
      lanes: {switch: road, highway: 3, default: {uniform_integer: [1, 2]}}
    elements:
      - {type: road, name: main, lanes: $shared.lanes}

Global choices condition local ones, and these condition objects: structured domain randomisation
(Prakash et al., ICRA 2019). The functions here rewrite documents, which are validated afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from gen_data.generator.config.distributions.base import Kind, Malformed, read_distribution
from gen_data.generator.config.distributions.fields import FLAG, NAME, NUMBER, WHOLE_NUMBER
from gen_data.generator.config.problems import Position, Problem
from gen_data.generator.config.yaml_scalars import quote_value, resolve_scalar
from gen_data.generator.config.yaml_tree import Node, is_distribution
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.scene import SharedValue
from gen_data.generator.core.streams import Streams

REFERENCE = "$shared."
SWITCH = "switch"
DEFAULT = "default"
_PROBED_SCENES = 8

Shared = Mapping[str, SharedValue]


def refers(node: Node) -> bool:
    """Whether a value depends on shared values."""
    if isinstance(node.content, tuple):
        return any(refers(item) for item in node.content)
    if isinstance(node.content, Mapping) and SWITCH not in node.content:
        return any(refers(item) for item in node.content.values())
    return is_reference(node)


def varying_place(item: Node, path: str) -> Position | None:
    """Position of a shared value that the value at a dotted path depends on; None if constant.

    A selection along the path also makes the value vary.
    """
    node: Node | None = item
    for part in path.split("."):
        if node is None or is_reference(node):
            break
        node = node.get(part)
    return node.position if node is not None and refers(node) else None


def is_reference(node: Node) -> bool:
    """Whether a value is a reference to a shared value or a selection by one."""
    if isinstance(node.content, Mapping):
        return SWITCH in node.content
    return isinstance(node.content, str) and node.content.startswith(REFERENCE)


def resolve_shared(node: Node, shared: Shared, field: str = "") -> Node:
    """Replace every reference and every ``switch`` of a document by its value.

    Raises:
        ConfigError: a name is unknown, or a ``switch`` has no entry for its value.
    """
    content = node.content
    if isinstance(content, tuple):
        items = tuple(
            resolve_shared(item, shared, f"{field}[{k}]") for k, item in enumerate(content)
        )
        return replace(node, content=items)
    if isinstance(content, Mapping):
        if SWITCH in content:
            key, chosen = _select_entry(node, shared, field)
            return resolve_shared(chosen, shared, f"{field}.{key}")
        items_by_key = {
            key: resolve_shared(item, shared, f"{field}.{key}" if field else key)
            for key, item in content.items()
        }
        return replace(node, content=items_by_key)
    if isinstance(content, str) and content.startswith(REFERENCE):
        value = _look_up(content.removeprefix(REFERENCE), shared, node.position, field)
        return replace(node, content=value, text=str(value))
    return node


def draw_shared(section: Node, streams: Streams) -> dict[str, SharedValue]:
    """Draw a value for every name, each from its own stream.

    Raises:
        ConfigError: an entry is neither a value nor a distribution.
    """
    return _evaluate(section, streams, {})


def probe_values(section: Node, seed: int) -> Iterator[dict[str, SharedValue]]:
    """Values that cover a configuration, for checks before a run.

    Yields the values of the first scenes, then each outcome of each choice by itself.
    """
    for scene in range(_PROBED_SCENES):
        yield _evaluate(section, Streams(seed, scene, index=scene), {})
    first = Streams(seed, 0)
    for name, node in _entries(section).items():
        for outcome in _outcomes(node):
            yield _evaluate(section, first, {name: outcome})


def _evaluate(section: Node, streams: Streams, fixed: Shared) -> dict[str, SharedValue]:
    """Evaluate all values in the order of their dependencies; ``fixed`` ones are not drawn."""
    entries = _entries(section)
    shared: dict[str, SharedValue] = {}
    waiting = dict(entries)
    while waiting:
        ready = [n for n, node in waiting.items() if not _names_in(node) & waiting.keys()]
        if not ready:
            name, node = next(iter(waiting.items()))
            fact = f"depends on itself: {', '.join(sorted(waiting))} need one another"
            raise ConfigError(str(Problem(node.position, f"shared.{name}", fact)))
        for name in ready:
            node = waiting.pop(name)
            shared[name] = fixed[name] if name in fixed else _draw(name, node, shared, streams)
    return shared


def _draw(name: str, node: Node, shared: Shared, streams: Streams) -> SharedValue:
    field = f"shared.{name}"
    entry = resolve_shared(node, shared, field)
    try:
        distribution = read_distribution(entry.plain(), _infer_kind(entry))
    except Malformed as error:
        raise ConfigError(str(Problem(entry.position, field, error.fact))) from None
    value: SharedValue = distribution.draw(streams.rng(field))
    return value if isinstance(value, (str, int)) else float(value)


def _names_in(node: Node) -> set[str]:
    """Names of the shared values that a node depends on."""
    if isinstance(node.content, tuple):
        return {name for item in node.content for name in _names_in(item)}
    if isinstance(node.content, Mapping):
        name = node.content.get(SWITCH)
        names = {name for item in node.content.values() for name in _names_in(item)}
        return names if name is None else names | {str(name.content)}
    text = str(node.content)
    return {text.removeprefix(REFERENCE)} if text.startswith(REFERENCE) else set()


def _entries(section: Node) -> Mapping[str, Node]:
    if not isinstance(section.content, Mapping):
        fact = "expected a mapping of names to values or distributions"
        raise ConfigError(str(Problem(section.position, "shared", fact)))
    return section.content


def _infer_kind(node: Node) -> Kind[Any]:
    """Infer the kind of a value from its notation."""
    outcomes = _outcomes(node)
    if not outcomes and isinstance(node.content, (str, int, float)):
        outcomes = (node.content,)
    if any(isinstance(value, str) for value in outcomes):
        return NAME
    if isinstance(node.content, Mapping):
        if "probability" in node.content:
            return FLAG
        if "uniform_integer" in node.content:
            return WHOLE_NUMBER
    if outcomes and all(isinstance(value, bool) for value in outcomes):
        return FLAG
    if outcomes and all(isinstance(value, int) for value in outcomes):
        return WHOLE_NUMBER
    return NUMBER


def _outcomes(node: Node) -> tuple[SharedValue, ...]:
    """All values of a choice or sequence; empty for any other node."""
    if not is_distribution(node):
        return ()
    assert isinstance(node.content, Mapping)
    argument = node.content.get("choice") or node.content.get("sequence")
    if argument is None:
        return ()
    if isinstance(argument.content, Mapping):
        return tuple(_scalar(key) for key in argument.content)
    items = argument.content if isinstance(argument.content, tuple) else ()
    return tuple(i.content for i in items if isinstance(i.content, (str, int, float)))


def _select_entry(node: Node, shared: Shared, field: str) -> tuple[str, Node]:
    """Key and value of the entry that a ``switch`` selects."""
    assert isinstance(node.content, Mapping)
    name = node.content[SWITCH].content
    value = _look_up(str(name), shared, node.content[SWITCH].position, f"{field}.{SWITCH}")
    for key, item in node.content.items():
        if key not in (SWITCH, DEFAULT) and _scalar(key) == value:
            return key, item
    if DEFAULT in node.content:
        return DEFAULT, node.content[DEFAULT]
    fact = f"no entry for {name} = {quote_value(value)}; expected one, or '{DEFAULT}'"
    raise ConfigError(str(Problem(node.position, field, fact)))


def _scalar(key: str) -> SharedValue:
    """Parse a key as a scalar."""
    try:
        value = resolve_scalar(key)
    except ValueError:
        return key
    return key if value is None else value


def _look_up(name: str, shared: Shared, position: Position, field: str) -> SharedValue:
    if name not in shared:
        fact = f"there is no shared value '{name}'; expected one of {', '.join(shared) or 'none'}"
        raise ConfigError(str(Problem(position, field, fact + did_you_mean(name, shared))))
    return shared[name]
