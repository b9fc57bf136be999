"""JSON Schema of a configuration: what editors complete and check against."""

from __future__ import annotations

from typing import Any

from generator.assemble.spec import DEFAULT_RENDERER, PLUGIN_LISTS, VARYING, GeneralSettings
from generator.assemble.tables import ANNOTATIONS, RENDERERS
from generator.config.schema import json_schema
from generator.config.strict import Strict
from generator.core.plugins import PluginTable

SHARED: list[dict[str, Any]] = [
    {"type": "string", "pattern": r"^\$shared\.", "description": "A shared value."},
    {
        "type": "object",
        "required": ["given"],
        "description": "The entry that a shared value selects.",
    },
]
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def config_schema() -> dict[str, Any]:
    """Schema of a whole configuration, every plug-in of every table included."""
    definitions: dict[str, Any] = {}
    schema = _hoisted(json_schema(GeneralSettings), definitions)
    properties = schema["properties"]
    for key, table in PLUGIN_LISTS.items():
        properties[key] = {
            "type": "array",
            "items": {"oneOf": [_plugin(table, name, definitions) for name in table]},
        }
    properties["render"] = {
        "description": "How images are made.",
        "anyOf": [_plugin(RENDERERS, name, definitions) for name in RENDERERS],
    }
    # A configuration overrides its template's elements by name; a template lists them.
    properties["elements"] = {
        "description": "Overrides by element name, or the whole list of elements.",
        "anyOf": [{"type": "object"}, properties["elements"]],
    }
    properties["shared"] = {
        "type": "object",
        "description": "Values drawn once per scene that elements and randomizers refer to.",
    }
    properties["annotations"] = {
        "type": "array",
        "items": {"oneOf": [{"enum": list(ANNOTATIONS)}, *_parametric(definitions)]},
        "description": "What is computed about every object, image and sample.",
    }
    return {
        "$schema": DRAFT,
        **schema,
        "title": "gen-data configuration",
        "$defs": dict(sorted(definitions.items())),
    }


def _parametric(definitions: dict[str, Any]) -> list[dict[str, str]]:
    """Annotators that have parameters, which may be written as mappings."""
    return [
        _plugin(ANNOTATIONS, name, definitions)
        for name in ANNOTATIONS
        if _model(ANNOTATIONS, name).model_fields.keys() - {ANNOTATIONS.tag}
    ]


def _plugin(table: PluginTable[Any], name: str, definitions: dict[str, Any]) -> dict[str, str]:
    schema = _hoisted(json_schema(_model(table, name)), definitions)
    if table in VARYING.values():
        schema["properties"] = {
            key: part if key in (table.tag, "name") else {"anyOf": [part, *SHARED]}
            for key, part in schema["properties"].items()
        }
    if (table, name) != (RENDERERS, DEFAULT_RENDERER):
        # The tag chooses the plug-in, so it has to be written even where its field has a default.
        schema["required"] = sorted({table.tag, *schema.get("required", ())})
    definitions[f"{table.kind}.{name}"] = schema
    return {"$ref": f"#/$defs/{table.kind}.{name}"}


def _model(table: PluginTable[Any], name: str) -> type[Strict]:
    model: type[Strict] = table.load(name)
    return model


def _hoisted(schema: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema with its own definitions moved to the common ones."""
    definitions.update(schema.pop("$defs", {}))
    return schema
