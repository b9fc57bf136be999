"""JSON Schema of models: what editors complete and check against."""

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
"""Name of the definition of what stands for a shared value."""

_SHARED_VALUE = {
    "description": "A shared value, or the entry that one selects.",
    "anyOf": [
        {"type": "string", "pattern": r"^\$shared\."},
        {"type": "object", "required": ["switch"]},
    ],
}


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema (2020-12) of what YAML may hold, with the docstrings' words in it.

    What a distribution may be is the same for all fields of a kind: it stands once, in ``$defs``.
    """
    definitions: dict[str, Any] = {}
    schema: dict[str, Any] = _shared(
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
    """The schema of a plug-in in which a shared value may stand wherever a value may.

    Args:
        schema: Of a model, definitions included.
        constant: Names of fields that must not depend on shared values.
    """
    wrapped: dict[str, Any] = _wrapped(schema)
    for name in constant:
        if name in schema.get("properties", {}):
            wrapped["properties"][name] = schema["properties"][name]
    wrapped["$defs"] = {**wrapped.get("$defs", {}), SHARED_VALUE: _SHARED_VALUE}
    return wrapped


def _wrapped(schema: Any) -> Any:
    """A schema in which every value below it may be a shared one."""
    if not isinstance(schema, dict):
        return schema
    wrapped = dict(schema)
    for key, part in schema.items():
        if key == "$defs":
            wrapped[key] = {name: _wrapped(entry) for name, entry in part.items()}
        elif key == "properties":
            wrapped[key] = {name: _or_shared(entry) for name, entry in part.items()}
        elif key in ("items", "additionalProperties"):
            wrapped[key] = _or_shared(part)
        elif key == "prefixItems":
            wrapped[key] = [_or_shared(item) for item in part]
        elif key in ("anyOf", "oneOf"):
            wrapped[key] = [_wrapped(option) for option in part]
    return wrapped


def _or_shared(schema: Any) -> Any:
    if not isinstance(schema, dict) or "const" in schema:
        return schema
    return {"anyOf": [_wrapped(schema), {"$ref": f"#/$defs/{SHARED_VALUE}"}]}


class _Generator(GenerateJsonSchema):
    """Writes defaults as YAML has them."""

    def encode_default(self, dft: Any) -> Any:
        return to_plain_yaml(dft)


def _shared(part: Any, definitions: dict[str, Any]) -> Any:
    """A part of a schema with its distributions moved to the definitions."""
    if isinstance(part, list):
        return [_shared(item, definitions) for item in part]
    if not isinstance(part, dict):
        return part
    title = part.get("title")
    if isinstance(title, str) and title.startswith(DISTRIBUTION_TITLE):
        name = title.replace(" ", "_")
        definitions[name] = part
        return {"$ref": f"#/$defs/{name}"}
    return {key: _shared(value, definitions) for key, value in part.items()}
