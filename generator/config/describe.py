"""Descriptions and examples of plug-ins for ``gen-data describe``."""

import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from gen_data.config.distributions import Bounds
from gen_data.config.schema import (
    FieldSchema,
    docstring_summary,
    documented_attributes,
    to_plain_yaml,
)
from gen_data.config.yaml_scalars import to_flow_yaml

TEXT_WIDTH = 80
"""Columns of a terminal, also where the output is piped."""
_EXAMPLES = {"integer": 1, "number": 1, "string": "example", "boolean": True}


class FieldRow(NamedTuple):
    """A field of a plug-in, in words.

    Attributes:
        name: Its key in YAML.
        words: Its type and range.
        default: As YAML, or ``required``.
        text: Its description; empty if there is none.
    """

    name: str
    words: str
    default: str
    text: str


def describe(model: type) -> str:
    """Summary of a plug-in, a table of its fields, and an example in YAML.

    A plug-in without parameters, such as most annotators, has its summary only.
    """
    if not issubclass(model, BaseModel):
        return _wrapped(docstring_summary(model)) + "\n"
    rows = describe_fields(model)
    parts = [_wrapped(docstring_summary(model))]
    if rows:
        parts.append("\n".join(_entries(rows)))
    example = make_example(model)
    if example:
        parts.append(f"Example:\n{textwrap.indent(_block(example), '  ')}")
    return "\n\n".join(part for part in parts if part) + "\n"


def describe_fields(model: type[BaseModel]) -> tuple[FieldRow, ...]:
    """Fields of a model with the descriptions of its docstrings, its own before inherited ones."""
    attributes, schema = documented_attributes(model), FieldSchema.of(model)
    own = sorted(model.model_fields.items(), key=lambda item: item[0] not in model.__annotations__)
    return tuple(
        FieldRow(
            name,
            re.sub(r"^an? ", "", schema.child(name).words()),
            "required" if info.is_required() else to_flow_yaml(plain_default(info)),
            " ".join((info.description or attributes.get(name, "")).split()),
        )
        for name, info in own
    )


def make_example(model: type[BaseModel]) -> dict[str, Any] | None:
    """Valid plain data for a model: its required fields and up to two optional ones.

    Required fields take their first declared example (``Field(examples=[...])``), else a value
    generated from their type. None if the model refuses the result.
    """
    required, optional = _example_fields(FieldSchema.of(model))
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


def _entries(rows: Sequence[FieldRow]) -> Iterator[str]:
    """Name, type and default of each field, and below them its description."""
    for row in rows:
        default = row.default if row.default == "required" else f"default {row.default}"
        facts = row.words if row.words == row.default else f"{row.words}; {default}"
        yield _wrapped(f"{row.name}: {facts}", first="", others="        ")
        if row.text:
            yield _wrapped(row.text, first="    ", others="    ")


def _wrapped(text: str, first: str = "", others: str = "") -> str:
    return textwrap.fill(
        text, TEXT_WIDTH, initial_indent=first, subsequent_indent=others, break_on_hyphens=False
    )


def _example_fields(model: FieldSchema) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values of a model's required fields and tags, and of the first two other fields."""
    required: dict[str, Any] = {}
    optional: dict[str, Any] = {}
    for name, field in model.fields.items():
        default = field.get("default")
        if name in model.schema.get("required", ()) or name == "type":
            examples = field.get("examples", [default] if default is not None else [])
            required[name] = examples[0] if examples else _example_value(model.child(name))
        elif len(optional) < 2 and default not in (None, [], {}, ""):
            optional[name] = default
    return required, optional


def _example_value(schema: FieldSchema) -> Any:
    if "examples" in schema.schema or schema.choices:
        return (schema.schema.get("examples") or schema.choices)[0]
    if schema.branches:
        return _example_value(schema.branches[0])
    if schema.fields:
        required, optional = _example_fields(schema)
        return {**required, **optional}
    if schema.schema.get("type") == "array":
        return [_example_value(schema.child(k)) for k in range(schema.schema.get("minItems", 1))]
    value = _EXAMPLES.get(schema.schema.get("type", ""), {})
    limits = schema.limits
    return _clamp_inside(value, limits) if limits and isinstance(value, (int, float)) else value


def _clamp_inside(value: float, limits: Bounds) -> float:
    if value in limits:
        return value
    if math.isinf(limits.high):
        return limits.low + 1
    return limits.high - 1 if math.isinf(limits.low) else 0.5 * (limits.low + limits.high)


def _block(example: Mapping[str, Any]) -> str:
    """A mapping as YAML, one key per line; long values go on in the next line, as YAML allows."""
    lines = (f"{key}: {to_flow_yaml(value)}" for key, value in example.items())
    return "\n".join(
        textwrap.fill(
            line,
            TEXT_WIDTH - 2,
            subsequent_indent="    ",
            break_on_hyphens=False,
            break_long_words=False,
        )
        for line in lines
    )
