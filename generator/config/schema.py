"""JSON Schema of models, for completion and checks in editors."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from gen_data.generator.config.describe import (
    docstring_summary,
    documented_attributes,
    to_plain_yaml,
)
from gen_data.generator.config.distributions.fields import DISTRIBUTION_TITLE

SHARED_VALUE = "shared_value"
"""Name of the definition for references to shared values."""

_SHARED_VALUE = {
    "description": "A shared value, or the entry that one selects.",
    "anyOf": [
        {"type": "string", "pattern": r"^\$shared\."},
        {"type": "object", "required": ["switch"]},
    ],
}


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema (2020-12) of a model's YAML, with descriptions from docstrings.

    Distributions of one kind share one definition in ``$defs``.
    """
    definitions: dict[str, Any] = {}
    schema: dict[str, Any] = _hoist_distributions(
        model.model_json_schema(schema_generator=_Generator), definitions
    )
    schema["description"] = docstring_summary(model)
    attributes = documented_attributes(model)
    for name, entry in schema.get("properties", {}).items():
        if name in attributes:
            entry.setdefault("description", attributes[name])
    if definitions:
        schema["$defs"] = dict(sorted({**schema.get("$defs", {}), **definitions}.items()))
    return schema


def with_shared_values(schema: dict[str, Any], constant: Collection[str] = ()) -> dict[str, Any]:
    """Allow references to shared values in the schema of a plug-in.

    Args:
        schema: Of a model, definitions included.
        constant: Names of fields that must not depend on shared values.
    """
    wrapped: dict[str, Any] = _allow_shared(schema)
    for name in constant:
        if name in schema.get("properties", {}):
            wrapped["properties"][name] = schema["properties"][name]
    wrapped["$defs"] = {**wrapped.get("$defs", {}), SHARED_VALUE: _SHARED_VALUE}
    return wrapped


def _allow_shared(schema: Any) -> Any:
    """Allow references to shared values everywhere below a schema."""
    if not isinstance(schema, dict):
        return schema
    wrapped = dict(schema)
    for key, part in schema.items():
        if key == "$defs":
            wrapped[key] = {name: _allow_shared(entry) for name, entry in part.items()}
        elif key == "properties":
            wrapped[key] = {name: _or_shared(entry) for name, entry in part.items()}
        elif key in ("items", "additionalProperties"):
            wrapped[key] = _or_shared(part)
        elif key == "prefixItems":
            wrapped[key] = [_or_shared(item) for item in part]
        elif key in ("anyOf", "oneOf"):
            wrapped[key] = [_allow_shared(option) for option in part]
    return wrapped


def _or_shared(schema: Any) -> Any:
    if not isinstance(schema, dict) or "const" in schema:
        return schema
    return {"anyOf": [_allow_shared(schema), {"$ref": f"#/$defs/{SHARED_VALUE}"}]}


class _Generator(GenerateJsonSchema):
    """Generator that writes defaults as plain YAML data."""

    def encode_default(self, dft: Any) -> Any:
        return to_plain_yaml(dft)


def _hoist_distributions(part: Any, definitions: dict[str, Any]) -> Any:
    """Move the distributions in a part of a schema to the definitions."""
    if isinstance(part, list):
        return [_hoist_distributions(item, definitions) for item in part]
    if not isinstance(part, dict):
        return part
    title = part.get("title")
    if isinstance(title, str) and title.startswith(DISTRIBUTION_TITLE):
        name = title.replace(" ", "_")
        definitions[name] = part
        return {"$ref": f"#/$defs/{name}"}
    return {key: _hoist_distributions(value, definitions) for key, value in part.items()}
