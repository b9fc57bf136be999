"""Fields that change a statistic: they exist, and are named with the direction of the change."""

import json
from pathlib import Path
from typing import Any

import pytest

from gen_data.assemble.config import parse_config
from gen_data.lab.carry_over.differences import Direction, Row
from gen_data.lab.carry_over.fields import Field, fields_of, remedies
from gen_data.lab.carry_over.statistics import QUANTITIES

SCHEMA = json.loads((Path(__file__).parents[2] / "configs/schema.json").read_text("utf-8"))
CONFIG = """\
template: tabletop
randomizers:
  - {type: objects, name: clutter, count: {uniform_integer: [4, 12]}}
  - {type: camera_pose, name: orbit, %s}
sensors: [{type: rgb_camera, name: color}]
"""


def references(schema: Any) -> list[str]:
    """Names of definitions that a value may have."""
    if isinstance(schema, list):
        return [name for item in schema for name in references(item)]
    if not isinstance(schema, dict):
        return []
    own = [schema["$ref"].rpartition("/")[2]] if "$ref" in schema else []
    return own + [n for key in ("anyOf", "oneOf", "allOf") for n in references(schema.get(key))]


def has_field(definition: str, path: str) -> bool:
    name, _, rest = path.partition(".")
    value = SCHEMA["$defs"][definition]["properties"].get(name)
    if value is None or not rest:
        return value is not None
    return any(
        has_field(inner, rest)
        for inner in references(value)
        if "properties" in SCHEMA["$defs"][inner]
    )


def test_every_quantity_has_fields_and_every_field_is_in_the_schema() -> None:
    """The check above is one."""
    for field in {field for quantity in QUANTITIES for field in fields_of(quantity)}:
        definition = f"{field.kind}.{field.type}" if field.type else "LabelSettings"
        for path in (field.path, field.needs, field.without):
            assert not path or has_field(definition, path), field.name
    assert has_field("sensor.rgb_camera", "image_pipeline.contrast")
    assert not has_field("sensor.rgb_camera", "image_pipeline.contrasts")


def named(
    quantity: str, direction: Direction, camera: str, groups: set[str] = frozenset()
) -> list[str]:  # type: ignore[assignment]
    row = Row("cup", quantity, (0, 0, 0), (1, 1, 1), 99, 99, 1.0, 0.1, direction)
    return remedies(row, parse_config(CONFIG % camera, "x", "x"), groups)


@pytest.mark.parametrize(
    ("quantity", "direction", "camera", "expected"),
    [
        ("long side", "larger", "distance_m: 1", "raise randomizers.orbit.distance_m"),
        ("long side", "smaller", "distance_m: 1", "lower randomizers.orbit.distance_m"),
        ("long side", "wider", "distance_m: 1", "narrow randomizers.orbit.distance_m"),
        ("long side", "larger", "fills: 0.5, aim: clutter", "lower randomizers.orbit.fills"),
        ("count", "smaller", "distance_m: 1", "raise randomizers.clutter.count"),
        ("grey", "smaller", "distance_m: 1",
         "raise sensors.color.image_pipeline.exposure_compensation_ev"),
    ],
)  # fmt: skip
def test_fields_of_the_configuration_are_named_with_a_direction(
    quantity: str, direction: Direction, camera: str, expected: str
) -> None:
    """Of two that exclude each other, the one that is set."""
    found = named(quantity, direction, camera)
    assert found[0] == expected
    assert not any("fills" in text for text in found[1:])


def test_groups_without_the_class_are_left_out_and_without_a_field_plug_ins_named() -> None:
    """Also without a configuration."""
    assert "raise randomizers.clutter.count" in named(
        "count", "smaller", "distance_m: 1", {"clutter"}
    )
    assert not any(
        "clutter" in text for text in named("count", "smaller", "distance_m: 1", {"arm"})
    )
    row = Row("car", "bottom m", (0, 0, 0), (1, 1, 1), 99, 99, 1.0, 0.1, "larger")
    assert remedies(row, None, ())[0] == "set randomizer relief: grade"
    assert Field("labels", "min_box_px").name == "labels: min_box_px"
