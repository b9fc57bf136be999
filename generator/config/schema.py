"""JSON Schema of models: what editors complete and check against."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from generator.config.describe import documented_attributes, plain_of, summary_of
from generator.config.distributions.fields import DISTRIBUTION_TITLE


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema (2020-12) of what YAML may hold, with the docstrings' words in it.

    What a distribution may be is the same for all fields of a kind: it stands once, in ``$defs``.
    """
    definitions: dict[str, Any] = {}
    schema: dict[str, Any] = _shared(
        model.model_json_schema(schema_generator=_Generator), definitions
    )
    schema["description"] = summary_of(model)
    attributes = documented_attributes(model)
    for name, entry in schema.get("properties", {}).items():
        if name in attributes:
            entry.setdefault("description", attributes[name])
    if definitions:
        schema["$defs"] = dict(sorted({**schema.get("$defs", {}), **definitions}.items()))
    return schema


class _Generator(GenerateJsonSchema):
    """Writes defaults as YAML has them."""

    def encode_default(self, dft: Any) -> Any:
        return plain_of(dft)


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
