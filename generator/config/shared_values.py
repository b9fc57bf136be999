"""Values that are drawn once per scene, and references to them.

A configuration may have a section ``shared`` of named values. Each is drawn once per scene from its
own stream, and their order has no effect. Elsewhere, ``$shared.NAME`` stands for such a value,
and a mapping with the key ``switch`` for the entry that the value selects::

    shared:
      road: {choice: {street: 3, highway: 1}}
      lanes: {switch: road, highway: 3, default: {uniform_integer: [1, 2]}}
    elements:
      - {type: road, name: main, lanes: $shared.lanes}

Global choices condition local ones, and these condition objects: structured domain randomisation
(Prakash et al., ICRA 2019). The functions here rewrite documents, which are validated afterwards.
"""

from collections.abc import Container, Iterator, Mapping
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

from gen_data.config.distributions import FLAG, NAME, NUMBER, WHOLE_NUMBER, Distribution, base
from gen_data.config.problems import FieldPath, Position, refuse
from gen_data.config.yaml_scalars import abbreviate, quote_value, resolve_scalar
from gen_data.config.yaml_tree import Node, is_distribution
from gen_data.core import errors
from gen_data.core.bounded_cache import CountCache, ObjectCache
from gen_data.core.scene import SharedValue
from gen_data.core.streams import Streams

REFERENCE = "$shared."
SWITCH = "switch"
DEFAULT = "default"
_PROBED_SCENES = 8
_SEARCHED_SCENES = 400
"""Scenes drawn for an outcome of a choice within selections."""

Shared = Mapping[str, SharedValue]

_ORDERS: ObjectCache[tuple[str, ...]] = ObjectCache(4)
"""Orders in which the values of the latest sections are drawn, for every scene."""

_Entry = tuple[list[str], CountCache[Distribution[Any]]]
_ENTRIES: ObjectCache[_Entry] = ObjectCache(512)
"""Names that the latest entries depend on, and their distributions by the values of these names.

Scenes draw from a few distributions each; reading one takes ten times as long as a draw.
"""


def refers(node: Node) -> bool:
    """Whether a value depends on shared values."""
    return is_reference(node) or any(refers(child) for child in node.children.values())


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
    text = node.content if isinstance(node.content, str) else ""
    return SWITCH in node.entries or text.startswith(REFERENCE)


def resolve_shared(node: Node, shared: Shared, *path: str | int) -> Node:
    """Replace every reference and every ``switch`` of the document at a path by its value.

    Raises:
        ConfigError: a name is unknown, or a ``switch`` has no entry for its value.
    """
    if SWITCH in node.entries:
        key, chosen = _select_entry(node, shared, path)
        return resolve_shared(chosen, shared, *path, key)
    if is_reference(node):
        value = _look_up(str(node.content).removeprefix(REFERENCE), shared, node.position, path)
        return replace(node, content=value, text=str(value))
    return node.with_children(lambda part, child: resolve_shared(child, shared, *path, part))


def draw_shared(section: Node, streams: Streams) -> dict[str, SharedValue]:
    """Draw a value for every name, each from its own stream.

    Raises:
        ConfigError: an entry is neither a value nor a distribution.
    """
    return _evaluate(section, streams, {})


def read_shared(section: Node, shared: Shared) -> dict[str, Distribution[Any]]:
    """Distributions by name that drew the shared values of a scene.

    Raises:
        ConfigError: an entry is neither a value nor a distribution.
    """
    return {name: _read_entry(name, node, shared) for name, node in section.entries.items()}


def probe_values(section: Node, seed: int) -> Iterator[dict[str, SharedValue]]:
    """Values that cover a configuration, for checks before a run.

    Yields the values of the first scenes, then each outcome of each choice by itself, then scenes
    with those outcomes of choices within selections that none had: a forced one might contradict
    the values that it depends on. Outcomes that one scene in some hundreds has may be missing.

    The order of keys means nothing: kept documents have theirs sorted, and give the same plan.
    """
    entries = sorted(section.entries.items())
    seen: set[tuple[str, str]] = set()

    def record(shared: dict[str, SharedValue]) -> dict[str, SharedValue]:
        seen.update((name, repr(value)) for name, value in shared.items())
        return shared

    for scene in range(_PROBED_SCENES):
        yield record(_evaluate(section, Streams(seed, scene, index=scene), {}))
    first = Streams(seed, 0)
    for name, node in entries:
        for outcome in _outcomes(node):
            yield record(_evaluate(section, first, {name: outcome}))
    for name, node in entries:
        for outcome, selected in _selected_outcomes(node, {}):
            if (name, repr(outcome)) in seen:
                continue
            # Values that depend on no others can be given without a contradiction.
            # Unknown names are refused where a scene evaluates them.
            known = {n: v for n, v in selected.items() if n in section.entries}
            own = {n: v for n, v in known.items() if not names_in(section.entries[n])}
            if any(v not in _possible(section.entries[n]) for n, v in own.items()):
                continue
            needed = _ancestors(section, name)
            for scene in range(_SEARCHED_SCENES):
                streams = Streams(seed, scene, index=scene)
                if _evaluate(section, streams, own, needed)[name] == outcome:
                    yield record(_evaluate(section, streams, own))
                    break


def _possible(node: Node) -> tuple[SharedValue, ...]:
    constant = (node.content,) if isinstance(node.content, (str, int, float)) else ()
    return _outcomes(node) or constant


def _selected_outcomes(
    node: Node, selected: Shared
) -> Iterator[tuple[SharedValue, dict[str, SharedValue]]]:
    """Outcomes of the choices within selections, and the values that select each."""
    if SWITCH not in node.entries:
        if selected:
            yield from ((outcome, dict(selected)) for outcome in _outcomes(node))
        return
    name = str(node.entries[SWITCH].content)
    for key, item in sorted(node.entries.items()):
        if key != SWITCH:
            value = {} if key == DEFAULT else {name: read_key(key)}
            yield from _selected_outcomes(item, {**selected, **value})


def _ancestors(section: Node, name: str) -> frozenset[str]:
    """The name of a value and of all values that it depends on, directly or through others."""
    found: set[str] = set()
    ahead = {name}
    while ahead:
        found |= ahead
        ahead = {n for known in ahead for n in names_in(section.entries[known])}
        ahead = (ahead & section.entries.keys()) - found
    return frozenset(found)


def _evaluate(
    section: Node, streams: Streams, fixed: Shared, names: Container[str] | None = None
) -> dict[str, SharedValue]:
    """Evaluate all values in the order of their dependencies; ``fixed`` ones are not drawn.

    Args:
        section: Section ``shared``.
        streams: Streams of the scene.
        fixed: Given values.
        names: The only values to evaluate, with all that they depend on; None = all. As each is
            drawn from its own stream, they are the same.
    """
    if not isinstance(section.content, Mapping):
        fact = "expected a mapping of names to values or distributions"
        refuse(section.position, "shared", fact)
    shared: dict[str, SharedValue] = {}
    for name in _ORDERS.get(section, lambda: _order(section)):
        if names is not None and name not in names:
            continue
        given = name in fixed
        shared[name] = fixed[name] if given else _draw(name, section.entries[name], shared, streams)
    return shared


def _order(section: Node) -> tuple[str, ...]:
    """Names of all values, each after the values that it depends on.

    Raises:
        ConfigError: values depend on one another.
    """
    known = section.entries
    sorter = TopologicalSorter(
        {name: names_in(node) & known.keys() for name, node in known.items()}
    )
    try:
        return tuple(sorter.static_order())
    except CycleError as cycle:
        names = set(cycle.args[1])
        first = next(name for name in known if name in names)
        fact = f"depends on itself: {', '.join(sorted(names))} need one another"
        refuse(known[first].position, f"shared.{first}", fact)


def _draw(name: str, node: Node, shared: Shared, streams: Streams) -> SharedValue:
    distribution = _read_entry(name, node, shared)
    value: SharedValue = distribution.draw(streams.rng(f"shared.{name}"))
    return value if isinstance(value, (str, int)) else float(value)


def _read_entry(name: str, node: Node, shared: Shared) -> Distribution[Any]:
    def read() -> Distribution[Any]:
        entry = resolve_shared(node, shared, "shared", name)
        try:
            return base.read_distribution(entry.plain(), _infer_kind(entry))
        except base.Malformed as error:
            refuse(entry.position, f"shared.{name}", error.fact)

    names, known = _ENTRIES.get(node, lambda: (sorted(names_in(node)), CountCache(32)))
    # As text: 1, 1.0 and true are equal, but not the same value.
    return known.get(repr([shared.get(name) for name in names]), read)


def names_in(node: Node) -> set[str]:
    """Names of the shared values that a node depends on."""
    names = {name for child in node.children.values() for name in names_in(child)}
    if SWITCH in node.entries:
        names.add(str(node.entries[SWITCH].content))
    elif is_reference(node):
        names.add(str(node.content).removeprefix(REFERENCE))
    return names


def _infer_kind(node: Node) -> base.Kind[Any]:
    outcomes = _outcomes(node)
    if not outcomes and isinstance(node.content, (str, int, float)):
        outcomes = (node.content,)
    if any(isinstance(value, str) for value in outcomes):
        return NAME
    if "probability" in node.entries:
        return FLAG
    if "uniform_integer" in node.entries:
        return WHOLE_NUMBER
    for kind, python_type in ((FLAG, bool), (WHOLE_NUMBER, int)):
        if outcomes and all(isinstance(value, python_type) for value in outcomes):
            return kind
    return NUMBER


def _outcomes(node: Node) -> tuple[SharedValue, ...]:
    """All values of a choice or sequence; empty for any other node."""
    argument = node.get("choice") or node.get("sequence")
    if argument is None or not is_distribution(node):
        return ()
    values = (item.content for item in argument.items)
    listed = tuple(value for value in values if isinstance(value, (str, int, float)))
    return listed or tuple(read_key(key) for key in sorted(argument.entries))


def _select_entry(node: Node, shared: Shared, path: FieldPath) -> tuple[str, Node]:
    """Key and value of the entry that a ``switch`` selects."""
    name = node.entries[SWITCH]
    value = _look_up(str(name.content), shared, name.position, (*path, SWITCH))
    for key, item in node.entries.items():
        if key not in (SWITCH, DEFAULT) and read_key(key) == value:
            return key, item
    if DEFAULT not in node.entries:
        known = [key for key in node.entries if key != SWITCH]
        fact = f"no entry for {name.content} = {quote_value(value)}; expected one, or '{DEFAULT}'; "
        fact += f"shared.{name.content} may be {errors.list_names(known)}"
        refuse(node.position, path, fact + errors.did_you_mean(str(value), known))
    return DEFAULT, node.entries[DEFAULT]


def read_key(key: str) -> SharedValue:
    """The value that a key of a choice or selection stands for."""
    try:
        value = resolve_scalar(key)
    except ValueError:
        return key
    return key if value is None else value


def _look_up(name: str, shared: Shared, position: Position, path: FieldPath) -> SharedValue:
    if name not in shared:
        known = ", ".join(shared) or "none"
        fact = f"there is no shared value '{abbreviate(name)}'; expected one of {known}"
        refuse(position, path, fact + errors.did_you_mean(name, shared))
    return shared[name]
