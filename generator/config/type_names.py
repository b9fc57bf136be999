"""Descriptions of types for error messages and for ``gen-data describe``."""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping
from enum import Enum
from typing import Annotated, Any, Literal

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gen_data.generator.config.distributions.fields import Bounds, FieldOf
from gen_data.generator.config.yaml_scalars import to_flow_yaml

_SIMPLE: dict[Any, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    dict: "a mapping",
    type(None): "nothing",
}


def describe_type(annotation: Any, metadata: tuple[Any, ...] = ()) -> str:
    """Describe the values of a type: ``a number in [0, 1]``, ``a list of texts``."""
    annotation, metadata = unwrap_annotated(annotation, metadata)
    limits = numeric_bounds(metadata)
    suffix = "" if limits is None else f" {limits.within()}"
    marker = next((m for m in metadata if isinstance(m, FieldOf)), None)
    if marker is not None:
        return f"{marker.kind.expected}{suffix} or a distribution"
    return f"{_scalar(annotation) or _collection(annotation) or 'a value'}{suffix}"


def unwrap_annotated(
    annotation: Any, metadata: tuple[Any, ...] = ()
) -> tuple[Any, tuple[Any, ...]]:
    """Separate a type from all of its ``Annotated`` metadata."""
    if typing.get_origin(annotation) is Annotated:
        inner, *more = typing.get_args(annotation)
        return unwrap_annotated(inner, (*more, *metadata))
    extra: list[Any] = []
    for item in metadata:
        extra.extend(item.metadata if isinstance(item, FieldInfo) else [item])
    return annotation, tuple(extra)


def numeric_bounds(metadata: tuple[Any, ...]) -> Bounds | None:
    """Limits on a number: its Bounds, or pydantic's gt, ge, lt and le; None if unlimited."""
    found = [m for m in metadata if isinstance(m, Bounds)]
    if found:
        return found[-1]
    limits = {
        key: getattr(m, key)
        for m in metadata
        for key in ("gt", "ge", "lt", "le")
        if isinstance(getattr(m, key, None), (int, float))
    }
    if not limits:
        return None
    free = Bounds()
    return Bounds(
        limits.get("gt", limits.get("ge", free.low)),
        limits.get("lt", limits.get("le", free.high)),
        open_low="gt" in limits,
        open_high="lt" in limits,
    )


def is_union(annotation: Any) -> bool:
    """Whether it is ``X | Y``, in any spelling."""
    return typing.get_origin(annotation) in (typing.Union, types.UnionType)


def union_branches(annotation: Any) -> tuple[Any, ...]:
    """The alternatives of a union other than None."""
    return tuple(a for a in typing.get_args(annotation) if a is not type(None))


def _scalar(annotation: Any) -> str:
    """Describe a scalar, choice or union; empty for any other type."""
    if annotation in _SIMPLE:
        return _SIMPLE[annotation]
    if typing.get_origin(annotation) is Literal:
        return _alternatives([to_flow_yaml(a) for a in typing.get_args(annotation)])
    if is_union(annotation):
        words = [describe_type(a) for a in typing.get_args(annotation)]
        return _tagged(union_branches(annotation)) or _alternatives(words)
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return _alternatives([to_flow_yaml(member.value) for member in annotation])
    return ""


def _tagged(models: tuple[Any, ...]) -> str:
    """Describe models with a discriminating literal field; empty if they have none."""
    if not all(isinstance(m, type) and issubclass(m, BaseModel) for m in models):
        return ""
    tags = [
        {
            name: typing.get_args(info.annotation)
            for name, info in model.model_fields.items()
            if typing.get_origin(info.annotation) is Literal
        }
        for model in models
    ]
    for name in tags[0]:
        values = [tag.get(name, ()) for tag in tags]
        if len(set(values)) == len(models) and all(len(value) == 1 for value in values):
            return f"a mapping with {name}: {_alternatives([to_flow_yaml(v[0]) for v in values])}"
    return ""


def _collection(annotation: Any) -> str:
    """Describe a list, mapping or model; empty for any other type."""
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is tuple and Ellipsis not in arguments:
        kinds = {describe_type(a) for a in arguments}
        noun = _plural(kinds.pop()) if len(kinds) == 1 else "values"
        return f"a list of {len(arguments)} {noun}"
    if origin in (list, tuple, set, frozenset):
        return f"a list of {_plural(describe_type(arguments[0]))}"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a mapping of names to {_plural(describe_type(arguments[1]))}"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return f"a mapping ({', '.join(annotation.model_fields)})"
    return ""


def _alternatives(words: list[str]) -> str:
    unique = list(dict.fromkeys(words))
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


def _plural(words: str) -> str:
    """``numbers`` for ``a number``; phrases without a simple plural are returned unchanged."""
    for noun in ("whole number", "number", "text", "mapping", "list", "name"):
        if words.startswith(f"a {noun}"):
            return f"{noun}s{words[len(noun) + 2 :]}"
    return words
