"""JSON Schema of configurations, for completion and checks in editors."""

from typing import Any

from gen_data.assemble import config, documents
from gen_data.assemble.plugin_tables import ANNOTATIONS, RENDERERS
from gen_data.config.schema import json_schema, with_shared_values
from gen_data.core.plugins import PluginTable

INHERITED = {
    "type": "object",
    "description": "Changes to the inherited item of this name.",
    "required": ["name"],
    "properties": {"type": False},
}
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def config_schema() -> dict[str, Any]:
    """Schema of a configuration, with the plug-ins of all tables."""
    definitions: dict[str, Any] = {}
    schema = _hoist_definitions(json_schema(config.GeneralSettings), definitions)
    properties = schema["properties"]
    for key, table in config.PLUGIN_LISTS.items():
        properties[key] = {
            "type": "array",
            "items": {"oneOf": [INHERITED, *(_plugin(table, n, definitions) for n in table)]},
        }
    names_of_exporters = {"enum": list(config.PLUGIN_LISTS["exporters"])}
    properties["exporters"]["items"]["oneOf"].insert(1, names_of_exporters)
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
    properties["extends"] = {
        "type": "string",
        "description": "Configuration to inherit from: a path or a shipped name.",
    }
    names = {"anyOf": [{"const": documents.ALL}, {"type": "array", "items": {"type": "string"}}]}
    properties["without"] = {
        "type": "object",
        "description": "Names of items that are not inherited, by section.",
        "properties": dict.fromkeys(documents.NAMED, names),
        "additionalProperties": False,
    }
    # Annotators with parameters may be written as mappings.
    annotators: dict[str, Any] = {name: ANNOTATIONS.load(name) for name in ANNOTATIONS}
    parametric = [
        _plugin(ANNOTATIONS, name, definitions)
        for name, annotator in annotators.items()
        if annotator.model_fields.keys() - {ANNOTATIONS.tag}
    ]
    properties["annotations"] = {
        "type": "array",
        "items": {"oneOf": [{"enum": list(ANNOTATIONS)}, *parametric]},
        "description": "Labels to compute for every object, image and sample.",
    }
    return {
        "$schema": DRAFT,
        **schema,
        "title": "gen-data configuration",
        "$defs": dict(sorted(definitions.items())),
    }


def _plugin(table: PluginTable[Any], name: str, definitions: dict[str, Any]) -> dict[str, str]:
    schema = json_schema(table.load(name))
    varying = next((key for key, known in config.VARYING.items() if known is table), None)
    if varying is not None:
        schema = with_shared_values(schema, config.CONSTANT[varying])
    schema = _hoist_definitions(schema, definitions)
    if (table, name) != (RENDERERS, config.DEFAULT_RENDERER):
        # The tag selects the plug-in, so it is required although its field has a default.
        schema["required"] = sorted({table.tag, *schema.get("required", ())})
    definitions[f"{table.kind}.{name}"] = schema
    return {"$ref": f"#/$defs/{table.kind}.{name}"}


def _hoist_definitions(schema: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    definitions.update(schema.pop("$defs", {}))
    return schema
