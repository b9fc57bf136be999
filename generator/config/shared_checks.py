"""Misspelt names and values of shared values, which a ``switch`` would pass over silently."""

import warnings
from collections.abc import Iterator

from gen_data.config.problems import Position, Problem, Problems, format_path
from gen_data.config.shared_values import DEFAULT, REFERENCE, SWITCH, is_reference, read_key
from gen_data.config.yaml_scalars import quote_value
from gen_data.config.yaml_tree import ORIGIN, Node, is_distribution
from gen_data.core.errors import ConfigWarning, did_you_mean, one_of


def check_shared(document: Node, inherited: Node) -> None:
    """Compare shared values with their uses, and with the declarations that they replace.

    Values of names that fill fields are left to these fields, unless a selection has no default.

    Args:
        document: The merged document.
        inherited: Shared values of its template, or else of the document before overrides.

    Raises:
        ConfigError: nothing uses a new name that is an override or resembles a used one; or a value
            is neither an inherited outcome of its name nor a key of a selection by it.

    Warns:
        ConfigWarning: nothing uses a new name; or a value resembles a key that no value selects.
    """
    section, problems = document.entries["shared"], Problems()
    new = [name for name in section.entries if name not in inherited.entries]
    own_files = (ORIGIN, document.position.file)
    new = [name for name in new if section.key_position(name).file in own_files]
    if not new and not any(node.replaced for node in section.entries.values()):
        return
    keys: dict[str, set[str]] = {}
    filled: set[str] = set()
    strict: set[str] = set()
    _find_uses(document, keys, filled, strict)
    used = filled | keys.keys()
    for name in new:
        if name not in used:
            fact = f"nothing uses this shared value; {one_of(name, sorted(used))}"
            place = section.key_position(name)
            is_wrong = place.file == ORIGIN or did_you_mean(name, used)
            _report(place, name, fact, problems if is_wrong else None)
    for name, node in section.entries.items():
        if name in keys and (name not in filled or name in strict):
            _check_values(name, node, keys[name], problems)
    problems.raise_if_any()


def _find_uses(node: Node, keys: dict[str, set[str]], filled: set[str], strict: set[str]) -> None:
    """Collect the keys of selections by name, and the names that stand for a value.

    ``strict`` receives the names with a selection that has no default.
    """
    if SWITCH in node.entries:
        name = str(node.entries[SWITCH].content)
        keys.setdefault(name, set()).update(node.entries.keys() - {SWITCH, DEFAULT})
        if DEFAULT not in node.entries:
            strict.add(name)
    elif is_reference(node):
        filled.add(str(node.content).removeprefix(REFERENCE))
    for child in node.children.values():
        _find_uses(child, keys, filled, strict)


def _check_values(name: str, node: Node, keys: set[str], problems: Problems) -> None:
    inherited = {value for old in node.replaced for value, _ in _texts(old)}
    own = dict(_texts(node))
    known = sorted(inherited | keys)
    for value, place in own.items():
        if value in known:
            continue
        # A single inherited value is a constant that may be meant to have others.
        if len(inherited) > 1:
            _report(
                place, name, f"unknown value {quote_value(value)}; {one_of(value, known)}", problems
            )
        elif guess := did_you_mean(value, sorted(keys - own.keys())):
            _report(place, name, f"no selection has {quote_value(value)}{guess}", None)


def _report(place: Position, name: str, fact: str, problems: Problems | None) -> None:
    """Add a problem; warn without a collection."""
    field = format_path(("shared", name))
    if problems is None:
        warnings.warn(str(Problem(place, field, fact)), ConfigWarning, stacklevel=2)
    else:
        problems.add(place, field, fact)


def _texts(node: Node) -> Iterator[tuple[str, Position]]:
    """Names that an entry can give, constant or drawn, in any branch, with their positions."""
    argument = node.get("choice") or node.get("sequence")
    if argument is not None and is_distribution(node):
        for item in argument.items:
            yield from _texts(item)
        for key in argument.entries:
            if isinstance(read_key(key), str):
                yield key, argument.key_position(key)
    elif SWITCH in node.entries:
        for key, item in node.entries.items():
            if key != SWITCH:
                yield from _texts(item)
    elif isinstance(node.content, str) and not is_reference(node):
        yield node.content, node.position
