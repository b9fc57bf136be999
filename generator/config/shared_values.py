"""Values that several draws have in common, and what depends on them.

A configuration may have a section ``shared`` of named values, drawn once per scene, each from a
stream of its own, so that their order means nothing. Elsewhere ``$shared.NAME`` stands for such a
value, and a mapping with the key ``switch`` for the one of its entries that the value selects::

    shared:
      road: {choice: {street: 3, highway: 1}}
      lanes: {switch: road, highway: 3, default: {uniform_integer: [1, 2]}}
    elements:
      - {type: road, name: main, lanes: $shared.lanes}

Global choices condition local ones, and these the objects: structured domain randomisation
(Prakash et al., ICRA 2019). Everything here rewrites documents; what comes out is validated like
any other.
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
    """Whether a value depends on shared ones."""
    if isinstance(node.content, tuple):
        return any(refers(item) for item in node.content)
    if isinstance(node.content, Mapping) and SWITCH not in node.content:
        return any(refers(item) for item in node.content.values())
    return is_reference(node)


def varying_place(item: Node, path: str) -> Position | None:
    """Where the value at a dotted path depends on shared values; None if it is constant.

    A selection on the way there makes the value vary, too.
    """
    node: Node | None = item
    for part in path.split("."):
        if node is None or is_reference(node):
            break
        node = node.get(part)
    return node.position if node is not None and refers(node) else None


def is_reference(node: Node) -> bool:
    """Whether a value stands for a shared one, or is selected by one."""
    if isinstance(node.content, Mapping):
        return SWITCH in node.content
    return isinstance(node.content, str) and node.content.startswith(REFERENCE)


def resolve_shared(node: Node, shared: Shared, field: str = "") -> Node:
    """The document with every reference and every ``switch`` replaced by what it stands for.

    Raises:
        ConfigError: a name is unknown, or no entry fits its value.
    """
    content = node.content
    if isinstance(content, tuple):
        items = tuple(
            resolve_shared(item, shared, f"{field}[{k}]") for k, item in enumerate(content)
        )
        return replace(node, content=items)
    if isinstance(content, Mapping):
        if SWITCH in content:
            key, chosen = _selected(node, shared, field)
            return resolve_shared(chosen, shared, f"{field}.{key}")
        items_by_key = {
            key: resolve_shared(item, shared, f"{field}.{key}" if field else key)
            for key, item in content.items()
        }
        return replace(node, content=items_by_key)
    if isinstance(content, str) and content.startswith(REFERENCE):
        value = _value(content.removeprefix(REFERENCE), shared, node.position, field)
        return replace(node, content=value, text=str(value))
    return node


def draw_shared(section: Node, streams: Streams) -> dict[str, SharedValue]:
    """A value for every name, each from a stream of its own.

    Raises:
        ConfigError: an entry is no value and no distribution.
    """
    return _evaluated(section, streams, {})


def probe_values(section: Node, seed: int) -> Iterator[dict[str, SharedValue]]:
    """Values that between them show what a configuration can be: to check it before it runs.

    The first scenes' own values, and every single outcome of every choice.
    """
    for scene in range(_PROBED_SCENES):
        yield _evaluated(section, Streams(seed, scene, index=scene), {})
    first = Streams(seed, 0)
    for name, node in _entries(section).items():
        for outcome in _outcomes(node):
            yield _evaluated(section, first, {name: outcome})


def _evaluated(section: Node, streams: Streams, fixed: Shared) -> dict[str, SharedValue]:
    """Every value, after those it depends on; ``fixed`` ones are taken as they are."""
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
            shared[name] = fixed[name] if name in fixed else _drawn(name, node, shared, streams)
    return shared


def _drawn(name: str, node: Node, shared: Shared, streams: Streams) -> SharedValue:
    field = f"shared.{name}"
    entry = resolve_shared(node, shared, field)
    try:
        distribution = read_distribution(entry.plain(), _kind_of(entry))
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


def _kind_of(node: Node) -> Kind[Any]:
    """What a value is, from how it is written."""
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
    """Every value of a choice or sequence; none for anything else."""
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


def _selected(node: Node, shared: Shared, field: str) -> tuple[str, Node]:
    """The entry of a ``switch`` that the value of its name selects."""
    assert isinstance(node.content, Mapping)
    name = node.content[SWITCH].content
    value = _value(str(name), shared, node.content[SWITCH].position, f"{field}.{SWITCH}")
    for key, item in node.content.items():
        if key not in (SWITCH, DEFAULT) and _scalar(key) == value:
            return key, item
    if DEFAULT in node.content:
        return DEFAULT, node.content[DEFAULT]
    fact = f"no entry for {name} = {quote_value(value)}; expected one, or '{DEFAULT}'"
    raise ConfigError(str(Problem(node.position, field, fact)))


def _scalar(key: str) -> SharedValue:
    """A key as the value it spells."""
    try:
        value = resolve_scalar(key)
    except ValueError:
        return key
    return key if value is None else value


def _value(name: str, shared: Shared, position: Position, field: str) -> SharedValue:
    if name not in shared:
        fact = f"there is no shared value '{name}'; expected one of {', '.join(shared) or 'none'}"
        raise ConfigError(str(Problem(position, field, fact + did_you_mean(name, shared))))
    return shared[name]
