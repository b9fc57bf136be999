"""Frozen dataclasses <-> plain JSON values, by their type hints.

Canonical JSON: sorted keys, shortest round-trip floats, no NaN, UTF-8 (in the spirit of RFC 8785).
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import Any, TypeVar

T = TypeVar("T")


def to_plain(value: Any) -> Any:
    """Dictionaries, lists, strings, numbers, booleans and None of a value."""
    kind = type(value)
    if kind in _ATOMS:
        return value
    if kind is tuple or kind is list:
        return [to_plain(item) for item in value]
    names = _field_names(kind)  # type: ignore[arg-type]
    if names is not None:
        return {name: to_plain(getattr(value, name)) for name in names}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, (set, frozenset)):
        return sorted(to_plain(item) for item in value)
    return value


def from_plain(kind: type[T], plain: Any) -> T:
    """The inverse of ``to_plain`` for a dataclass (or any annotation made of them).

    Raises:
        TypeError, KeyError: if the value does not fit the type.
    """
    return typing.cast(T, _build(kind, plain))


def canonical_json(value: Any) -> str:
    """One line of canonical JSON."""
    return json.dumps(
        to_plain(value), sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )


_ATOMS = frozenset({str, int, float, bool, type(None)})


@cache
def _field_names(kind: type) -> tuple[str, ...] | None:
    """Names of a dataclass's fields; None for any other type."""
    if not dataclasses.is_dataclass(kind):
        return None
    return tuple(field.name for field in dataclasses.fields(kind))


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _build(kind: Any, plain: Any) -> Any:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = _hints(kind)
        return kind(**{name: _build(hints[name], item) for name, item in plain.items()})
    if origin in (typing.Union, types.UnionType):
        if plain is None:
            return None
        return _build(next(a for a in arguments if a is not type(None)), plain)
    if origin is tuple:
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return tuple(_build(arguments[0], item) for item in plain)
        return tuple(_build(a, item) for a, item in zip(arguments, plain, strict=True))
    if origin is typing.Literal:
        if plain not in arguments:
            raise TypeError(f"{plain!r} is not one of {arguments}")
        return plain
    if kind is float:
        return float(plain)
    return plain
