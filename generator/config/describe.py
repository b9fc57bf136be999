"""Descriptions and examples of plug-ins for ``gen-data describe``."""

from __future__ import annotations

import inspect
import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from gen_data.generator.config.distributions import Distribution
from gen_data.generator.config.distributions.fields import Bounds, FieldOf
from gen_data.generator.config.type_names import (
    describe_type,
    is_union,
    numeric_bounds,
    union_branches,
    unwrap_annotated,
)
from gen_data.generator.config.yaml_scalars import to_flow_yaml

_TEXT_WIDTH = 100
_EXAMPLES: dict[Any, Any] = {int: 1, float: 1, str: "example", bool: True}
_HEADINGS = ("field", "type", "default")


def describe(model: type) -> str:
    """Summary of a plug-in, a table of its fields, and an example in YAML.

    A plug-in without parameters, such as most annotators, has its summary only.
    """
    if not issubclass(model, BaseModel):
        return docstring_summary(model) + "\n"
    attributes = documented_attributes(model)
    rows = [
        (name, _type_words(info), _default_words(info), _meaning(info, attributes.get(name, "")))
        for name, info in model.model_fields.items()
    ]
    parts = [docstring_summary(model)]
    if rows:
        parts.append("\n".join(_table(rows)))
    example = make_example(model)
    if example:
        parts.append(f"Example:\n{textwrap.indent(_block(example), '  ')}")
    return "\n\n".join(part for part in parts if part) + "\n"


def make_example(model: type[BaseModel]) -> dict[str, Any] | None:
    """Valid plain data for a model: its required fields and up to two optional ones.

    Required fields take their first declared example (``Field(examples=[...])``), else a value
    generated from their type. None if the model refuses the result.
    """
    required: dict[str, Any] = {}
    optional: dict[str, Any] = {}
    for name, info in model.model_fields.items():
        if info.is_required() or name == "type":
            required[name] = _sample_value(info)
        elif len(optional) < 2 and plain_default(info) not in (None, [], {}, ""):
            optional[name] = plain_default(info)
    for example in ({**required, **optional}, required):
        try:
            model.model_validate_json(json.dumps(example))
        except ValidationError:
            continue
        return example
    return None


def plain_default(info: FieldInfo) -> Any:
    """Default of a field as plain data."""
    return to_plain_yaml(info.get_default(call_default_factory=True, validated_data={}))


def to_plain_yaml(value: Any) -> Any:
    """Convert a value of a model to the plain data of its YAML."""
    if isinstance(value, Distribution):
        return value.to_yaml()
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): to_plain_yaml(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain_yaml(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(to_plain_yaml(item) for item in value)
    return value


def docstring_summary(model: type) -> str:
    """First paragraph of a class's docstring, on one line."""
    documented = inspect.cleandoc(model.__doc__ or "")
    return documented.partition("\n\n")[0].replace("\n", " ")


def documented_attributes(model: type[BaseModel]) -> dict[str, str]:
    """``{field: text}`` of the Attributes sections of a class and its bases."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if issubclass(base, BaseModel) and base is not BaseModel and base.__doc__:
            found |= dict(_attributes_section(inspect.cleandoc(base.__doc__)))
    return found


def _type_words(info: FieldInfo) -> str:
    words = describe_type(info.annotation, tuple(info.metadata))
    return re.sub(r"^an? ", "", words)


def _default_words(info: FieldInfo) -> str:
    return "required" if info.is_required() else to_flow_yaml(plain_default(info))


def _meaning(info: FieldInfo, documented: str) -> str:
    return " ".join((info.description or documented).split())


def _attributes_section(docstring: str) -> Iterator[tuple[str, str]]:
    _, heading, section = docstring.partition("Attributes:\n")
    if not heading:
        return
    section = re.split(r"\n(?=\S)", section)[0]
    for entry in re.split(r"\n(?=\S)", textwrap.dedent(section).strip("\n")):
        names, _, text = entry.partition(":")
        # "width_px, height_px: Size" documents two fields at once.
        for name in names.split(","):
            yield name.strip(), " ".join(text.split())


def _table(rows: list[tuple[str, str, str, str]]) -> Iterator[str]:
    widths = [max(len(row[i]) for row in (*rows, _HEADINGS)) for i in range(3)]
    yield "  ".join(h.ljust(width) for h, width in zip(_HEADINGS, widths, strict=True)).rstrip()
    yield "  ".join("-" * width for width in widths)
    for row in rows:
        yield "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=False)).rstrip()
        if row[3]:
            yield textwrap.fill(
                row[3], _TEXT_WIDTH, initial_indent="    ", subsequent_indent="    "
            )


def _sample_value(info: FieldInfo) -> Any:
    if info.examples:
        return to_plain_yaml(info.examples[0])
    if not info.is_required():
        return plain_default(info)
    return _example_value(info.annotation, tuple(info.metadata))


def _example_value(annotation: Any, metadata: tuple[Any, ...] = ()) -> Any:
    """Generate a value of a type."""
    annotation, metadata = unwrap_annotated(annotation, metadata)
    marker = next((m for m in metadata if isinstance(m, FieldOf)), None)
    value = marker.kind.example if marker is not None else _EXAMPLES.get(annotation)
    limits = numeric_bounds(metadata)
    if limits is not None and isinstance(value, (int, float)):
        return _clamp_inside(value, limits)
    return _example_collection(annotation) if value is None else value


def _clamp_inside(value: float, limits: Bounds) -> float:
    if value in limits:
        return value
    if math.isinf(limits.high):
        return limits.low + 1
    return limits.high - 1 if math.isinf(limits.low) else 0.5 * (limits.low + limits.high)


def _example_collection(annotation: Any) -> Any:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if is_union(annotation):
        return _example_value(union_branches(annotation)[0])
    if origin is tuple and Ellipsis not in arguments:
        return [_example_value(argument) for argument in arguments]
    if origin in (list, tuple):
        return [_example_value(arguments[0])]
    if origin is Literal:
        return arguments[0]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return make_example(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return next(iter(annotation)).value
    return {}


def _block(example: Mapping[str, Any]) -> str:
    """A mapping as YAML, one key per line."""
    return "\n".join(f"{key}: {to_flow_yaml(value)}" for key, value in example.items())
