"""Fields of every plug-in of every table: described, strict and frozen."""

import json

import pytest
from pydantic import ValidationError

from gen_data.assemble.plugin_tables import TABLES
from gen_data.config.describe import describe
from gen_data.config.schema import json_schema

MODELS = {f"{kind} {name}": TABLES[kind].load(name) for kind in TABLES for name in TABLES[kind]}
each = pytest.mark.parametrize("named", MODELS)
WORDS = {"type", "name", "stage"}
"""Fields that have the same meaning in all plug-ins of a table."""


@each
def test_it_explains_itself(named: str) -> None:
    """Schema and description exist, every field has a description, and the type is its name."""
    schema = json_schema(MODELS[named])

    silent = {name for name, row in schema["properties"].items() if not row.get("description")}
    assert silent <= WORDS
    assert describe(MODELS[named])
    name = named.partition(" ")[2]
    assert schema["properties"].get("type", {"const": name})["const"] == name


@each
def test_a_misspelt_field_is_refused(named: str) -> None:
    with pytest.raises(ValidationError) as caught:
        MODELS[named].model_validate_json(json.dumps({"no_such_field": 1}))

    faults = {(fault["type"], fault["loc"]) for fault in caught.value.errors()}
    assert ("extra_forbidden", ("no_such_field",)) in faults


@each
def test_values_do_not_change_after_it_is_made(named: str) -> None:
    made = MODELS[named].model_construct()

    with pytest.raises(ValidationError, match="frozen"):
        setattr(made, next(iter(MODELS[named].model_fields)), "other")
