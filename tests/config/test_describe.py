"""Output of ``gen-data describe`` and ``gen-data schema`` on a plug-in."""

import json
from enum import Enum
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.config.describe import describe, describe_fields, make_example
from gen_data.config.distributions import (
    Bounds,
    Constant,
    Count,
    Direction,
    Flag,
    LogUniform,
    Name,
    Position,
    Positive,
    Rotation,
    Scalar,
    So3,
    Uniform,
)
from gen_data.config.problems import Problems
from gen_data.config.schema import json_schema
from gen_data.config.validation import validate
from gen_data.config.yaml_tree import parse_yaml


class Falloff(str, Enum):
    NONE = "none"
    SQUARE = "square"


class Lighting(Strict):
    """Illuminance and azimuth of every directional light.

    Drawn anew for each view.

    Attributes:
        illuminance_lux: On a surface that faces the light [lux].
        azimuth_deg, tilt: Where the light comes from; a long explanation that does not fit into
            one line of the table and therefore has to be wrapped.
    """

    type: Literal["lighting"] = "lighting"
    name: str = Field(examples=["lamps"], description="Key of its random stream.")
    illuminance_lux: Positive = LogUniform(200.0, 2000.0)
    azimuth_deg: Annotated[Scalar, Bounds(0, 360)] = Uniform(0.0, 360.0)
    tilt: Rotation = So3()
    falloff: Falloff = Falloff.SQUARE
    size_px: tuple[int, int] = (640, 480)
    tags: tuple[str, ...] = ()


DESCRIPTION = """\
Illuminance and azimuth of every directional light.

type: lighting
name: text; required
    Key of its random stream.
illuminance_lux: number > 0 or a distribution; default {log_uniform: [200,
        2000]}
    On a surface that faces the light [lux].
azimuth_deg: number in [0, 360] or a distribution; default {uniform: [0, 360]}
    Where the light comes from; a long explanation that does not fit into one
    line of the table and therefore has to be wrapped.
tilt: rotation [w, x, y, z] or a distribution; default so3
    Where the light comes from; a long explanation that does not fit into one
    line of the table and therefore has to be wrapped.
falloff: none or square; default square
size_px: list of 2 whole numbers; default [640, 480]
tags: list of texts; default []

Example:
  type: lighting
  name: lamps
  illuminance_lux: {log_uniform: [200, 2000]}
  azimuth_deg: {uniform: [0, 360]}
"""


def test_a_description_is_summary_table_and_example_if_there_are_any() -> None:
    """Nothing is shown rather than something wrong."""
    assert describe(Lighting) == DESCRIPTION

    class Picky(Strict):
        word: str = Field(pattern="^sesame$")

    assert make_example(Picky) is None
    assert "Example" not in describe(Picky)

    class Empty(Strict):
        """Nothing to set."""

    assert describe(Empty) == "Nothing to set.\n"


class Demanding(Strict):
    scalar: Scalar
    count: Count
    name: Name
    flag: Flag
    rotation: Rotation
    direction: Direction
    position: Position
    fov_deg: Annotated[Scalar, Bounds(10, 170)]
    below: float = Field(lt=0)
    whole: int
    falloff: Falloff
    style: Literal["matte", "glossy"]
    inner: Lighting
    several: tuple[Lighting, ...]
    pair: tuple[float, str]
    either: int | str
    weights: dict[str, float]


@pytest.mark.parametrize("model", [Lighting, Demanding])
def test_the_example_of_a_description_validates(model: type[Strict]) -> None:
    """Copied from the screen into a file, it works."""
    text = describe(model).partition("Example:\n")[2]
    problems = Problems()
    made = validate(
        parse_yaml(text.replace("\n  ", "\n").removeprefix("  "), "x.yaml"), model, problems
    )
    problems.raise_if_any()
    assert isinstance(made, model)


def validator_of(model: type[Strict]) -> Any:
    jsonschema = pytest.importorskip("jsonschema")
    schema = json_schema(model)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


VALID: list[dict[str, Any]] = [
    {"name": "a"}, {"name": "a", "illuminance_lux": 300},
    {"name": "a", "illuminance_lux": {"uniform": [1, 2]}},
    {"name": "a", "illuminance_lux": {"normal": {"mean": 1, "stddev": 2, "clip": [1, 2]}}},
    {"name": "a", "illuminance_lux": {"choice": {"1": 3, "2": 1}}},
    {"name": "a", "tilt": "about_z"}, {"name": "a", "tilt": {"about_z": [0, 90]}},
    {"name": "a", "tilt": [1, 0, 0, 0]},
]  # fmt: skip
INVALID: list[dict[str, Any]] = [{}, {"name": 3}, {"name": "a", "unknown": 1},
                                 {"name": "a", "illuminance_lux": 0},
                                 {"name": "a", "illuminance_lux": "bright"},
                                 {"name": "a", "illuminance_lux": {"unifrom": [1, 2]}},
                                 {"name": "a", "illuminance_lux": {"uniform": [1, 2, 3]}},
                                 {"name": "a", "illuminance_lux": {"probability": 0.5}},
                                 {"name": "a", "azimuth_deg": 400}, {"name": "a", "tilt": "so4"},
                                 {"name": "a", "falloff": "cubic"}]  # fmt: skip


@pytest.mark.parametrize("document", [*VALID, *INVALID], ids=json.dumps)
def test_the_schema_accepts_what_validation_accepts(document: dict[str, Any]) -> None:
    """Editors must not underline valid text; common mistakes are refused."""
    assert validator_of(Lighting).is_valid(document) == (document in VALID)
    if document in VALID:
        Lighting.model_validate_json(json.dumps(document))


def test_the_schema_tells_meanings_and_shares_distributions_the_same_every_time() -> None:
    """Distributions of a number are listed once, however many fields use them."""
    schema = json_schema(Lighting)
    assert schema["description"] == "Illuminance and azimuth of every directional light."
    lux = schema["properties"]["illuminance_lux"]
    assert lux["description"] == "On a surface that faces the light [lux]."
    assert lux["default"] == {"log_uniform": [200.0, 2000.0]}
    assert lux["anyOf"][1] == {"$ref": "#/$defs/distribution_of_number"}
    assert json.dumps(schema).count("Every ratio is equally likely") == 1
    # They are compared with files in the repository.
    assert describe(Lighting) == describe(Lighting)
    assert json.dumps(json_schema(Lighting)) == json.dumps(json_schema(Lighting))


def test_a_default_may_be_any_value_and_models_are_told_by_their_field() -> None:
    """Constants are shown as the plain value they stand for. Rather than by all their fields."""

    class Defaults(Strict):
        """Two defaults."""

        a: Scalar = Constant(0.5)
        b: Position = Constant((0.0, 0.0, 1.0))

    rows = describe(Defaults).split("\n")
    assert rows[2].endswith("; default 0.5")
    assert rows[3].endswith("; default [0, 0, 1]")

    class Disc(Strict):
        shape: Literal["disc"]
        radius_m: float = 1.0

    class Square(Strict):
        shape: Literal["square"]
        side_m: float = 1.0

    class Outline(Strict):
        outline: Annotated[Disc | Square, Field(discriminator="shape")]

    assert "mapping with shape: disc or square" in describe(Outline)


def test_fields_are_described_by_the_docstring_below_them() -> None:
    """Or by the section of attributes, which goes first; inherited fields come last."""

    class Format(Strict):
        cameras: tuple[str, ...] = ()
        """All of them if
        empty."""

    class Own(Format):
        """Its own.

        Attributes:
            other: From the section.
        """

        boxes: bool = True
        """Whether it has boxes."""
        other: int = 0
        """Overruled."""

    rows = [(row.name, row.text) for row in describe_fields(Own)]
    assert rows == [
        ("boxes", "Whether it has boxes."),
        ("other", "From the section."),
        ("cameras", "All of them if empty."),
    ]
