"""Frozen dataclasses <-> plain JSON values, by their type hints.

Canonical JSON: sorted keys, shortest round-trip floats, no NaN, UTF-8 (in the spirit of RFC 8785).
A binary mask becomes ``{"size": [height, width], "runs": [...]}``: lengths of its row-major runs,
beginning with the unset pixels. Any other array becomes ``{"dtype": "<u2", "shape": [...], "zlib":
"..."}`` in base64; 8 values of a bool array share a byte, the first one in its highest bit.
"""

import base64
import dataclasses
import json
import math
import operator
import types
import typing
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from functools import cache, partial
from typing import Any, TypeVar

import deflate
import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
SPARSE = "sparse"
"""Metadata of fields that are left out while empty: data of scenes without them stay the same."""


def to_plain(value: Any) -> Any:
    """Dictionaries, lists, strings, numbers, booleans and None of a value."""
    kind = type(value)
    if kind in _ATOMS:
        return value
    # Most values are atoms: they are tested here first, which saves half of all calls.
    if kind is tuple or kind is list:
        return [item if type(item) in _ATOMS else to_plain(item) for item in value]
    fields_of = _fields_of(kind)  # type: ignore[arg-type]
    if fields_of is not None or isinstance(value, Mapping):
        pairs = value.items() if fields_of is None else fields_of(value)
        return {str(k): item if type(item) in _ATOMS else to_plain(item) for k, item in pairs}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, (set, frozenset)):
        return sorted(to_plain(item) for item in value)
    if isinstance(value, np.ndarray) and value.dtype == bool and value.ndim == 2:
        return {"size": list(value.shape), "runs": _encode_runs(value)}
    if isinstance(value, np.ndarray):
        return _encode_array(value)
    return value


def from_plain(kind: type[T], plain: Any) -> T:
    """The inverse of ``to_plain`` for a dataclass (or any annotation made of them).

    A value that already is an instance of the dataclass it stands for is kept as it is.

    Raises:
        TypeError, KeyError: if the value does not fit the type.
    """
    build: Callable[[Any], T] = _builder(typing.cast(Any, kind))
    return build(plain)


def fields_from_plain(kind: type, plain: Mapping[str, Any]) -> dict[str, Any]:
    """Values of some fields of a dataclass by name: a part of ``from_plain``.

    Raises:
        TypeError, KeyError: if a value does not fit the type of its field.
    """
    builders = _field_builders(kind)
    return {
        name: item if (build := builders[name]) is _itself else build(item)
        for name, item in plain.items()
    }


def canonical_json(value: Any) -> str:
    """One line of canonical JSON."""
    return _ENCODER.encode(to_plain(value))


# Plain values are trees: looking for circles would take a tenth of the time.
_ENCODER = json.JSONEncoder(
    sort_keys=True,
    separators=(",", ":"),
    allow_nan=False,
    ensure_ascii=False,
    check_circular=False,
)


def find_not_finite(plain: Any, place: str = "") -> str:
    """Path of the first number in plain JSON values that is NaN or infinite; empty if none is."""
    if isinstance(plain, float):
        return "" if math.isfinite(plain) else place
    items: Iterable[tuple[str, Any]] = ()
    if isinstance(plain, Mapping):
        items = ((f"{place}.{key}" if place else str(key), v) for key, v in plain.items())
    elif isinstance(plain, (list, tuple)):
        items = ((f"{place}[{i}]", v) for i, v in enumerate(plain))
    return next(filter(None, (find_not_finite(v, inner) for inner, v in items)), "")


_ATOMS = frozenset({str, int, float, bool, type(None)})


@cache
def _fields_of(kind: type) -> Callable[[Any], Iterable[tuple[str, Any]]] | None:
    """Function that lists names and values of a dataclass's fields; None for any other type."""
    if not dataclasses.is_dataclass(kind):
        return None
    names = tuple(field.name for field in dataclasses.fields(kind))
    sparse = {field.name for field in dataclasses.fields(kind) if field.metadata.get(SPARSE)}
    if sparse:
        return lambda value: [
            (name, item) for name in names if (item := getattr(value, name)) or name not in sparse
        ]
    if len(names) < 2:
        return lambda value: [(name, getattr(value, name)) for name in names]
    values_of = operator.attrgetter(*names)
    return lambda value: zip(names, values_of(value), strict=True)


@cache
def _builder(kind: Any) -> Callable[[Any], Any]:
    """Function that builds values of an annotation from plain ones; compiled once."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    # ``NDArray`` is an alias type (PEP 695) from NumPy 2.5 on: its value is one step away.
    origin = typing.get_origin(getattr(origin, "__value__", kind))
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _dataclass_builder(kind)
    if origin in (typing.Union, types.UnionType):
        build = _builder(next(a for a in arguments if a is not type(None)))
        return lambda plain: None if plain is None else build(plain)
    if origin is tuple:
        return _tuple_builder(arguments)
    if origin is typing.Literal:
        return partial(_one_of, arguments)
    if origin is Mapping and arguments[0] in (str, int):
        return _mapping_builder(*arguments)
    if origin is np.ndarray:
        return _decode_array
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind
    return float if kind is float else _itself


def _dataclass_builder(kind: type) -> Callable[[Any], Any]:
    def build(plain: Any) -> Any:
        if isinstance(plain, kind):
            return plain
        # As fields_from_plain: records of streets hold a thousand such values.
        builders = _field_builders(kind)
        return kind(
            **{
                name: item if (build := builders[name]) is _itself else build(item)
                for name, item in plain.items()
            }
        )

    return build


@cache
def _field_builders(kind: type) -> dict[str, Callable[[Any], Any]]:
    # Types may refer to themselves: fields are looked at when the first value comes.
    return {name: _builder(hint) for name, hint in typing.get_type_hints(kind).items()}


def _tuple_builder(arguments: tuple[Any, ...]) -> Callable[[Any], Any]:
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        build = _builder(arguments[0])
        return tuple if build is _itself else lambda plain: tuple(map(build, plain))
    builders = [_builder(argument) for argument in arguments]
    if set(builders) == {float}:
        return partial(_floats, len(builders))
    return lambda plain: tuple(b(item) for b, item in zip(builders, plain, strict=True))


def _floats(count: int, plain: Sequence[float]) -> tuple[float, ...]:
    """Vectors are the most frequent values: they are worth a faster loop."""
    if len(plain) != count:
        raise ValueError(f"{plain!r} has not {count} numbers")
    return tuple(map(float, plain))


def _mapping_builder(key: Any, value: Any) -> Callable[[Any], Any]:
    build = _builder(value)
    # JSON has no other keys than strings.
    return lambda plain: {key(name): build(item) for name, item in plain.items()}


def _encode_runs(mask: NDArray[np.bool_]) -> list[int]:
    """Lengths of the row-major runs of equal pixels; the first one is of unset pixels."""
    flat = mask.ravel()
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    ends = np.concatenate([[0], changes, [flat.size]])
    runs: list[int] = np.diff(ends).tolist()
    return [0, *runs] if flat.size and flat[0] else runs


def _encode_array(array: NDArray[Any]) -> dict[str, Any]:
    raw = np.packbits(array) if array.dtype == bool else array
    little = raw.astype(raw.dtype.newbyteorder("<"), copy=False)
    # zlib's output depends on its build, libdeflate's on its release, which data sets state.
    packed = deflate.zlib_compress(little.tobytes(), 6)
    return {
        "dtype": "bool" if array.dtype == bool else little.dtype.str,
        "shape": list(array.shape),
        "zlib": base64.b64encode(packed).decode("ascii"),
    }


def _decode_array(plain: Mapping[str, Any]) -> NDArray[Any]:
    """An array as ``to_plain`` writes it; masks are bool [height, width]."""
    if "runs" in plain:
        runs = plain["runs"]
        values = np.arange(len(runs)) % 2 == 1
        return np.asarray(np.repeat(values, runs).reshape(plain["size"]))
    data = zlib.decompress(base64.b64decode(plain["zlib"]))
    if plain["dtype"] != "bool":
        return np.asarray(np.frombuffer(data, plain["dtype"]).reshape(plain["shape"]))
    bits = np.unpackbits(np.frombuffer(data, np.uint8), count=math.prod(plain["shape"]))
    return np.asarray(bits.reshape(plain["shape"]).astype(np.bool_))


def _one_of(allowed: tuple[Any, ...], plain: Any) -> Any:
    if plain not in allowed:
        raise TypeError(f"{plain!r} is not one of {allowed}")
    return plain


def _itself(plain: Any) -> Any:
    return plain
