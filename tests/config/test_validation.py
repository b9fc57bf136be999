"""From a document to models: the messages, literally."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, model_validator

from gen_data.config.base_model import Strict
from gen_data.config.distributions import (
    Bounds,
    Constant,
    Count,
    Flag,
    Name,
    Positive,
    Scalar,
    Uniform,
    UnitInterval,
)
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_tree import parse_yaml, with_override
from gen_data.core.errors import ConfigError


class Mode(str, Enum):
    FAST = "fast"
    GOOD = "good"


class Camera(Strict):
    fov_deg: float = Field(gt=1, lt=170)
    size_px: tuple[int, int] = (640, 480)
    mode: Mode = Mode.FAST


class Coco(Strict):
    type: Literal["coco"]
    crowd: int = 1


class Kitti(Strict):
    type: Literal["kitti"]
    index: int = 1


class Config(Strict):
    camera: Camera | None = None
    style: Literal["matte", "glossy"] = "matte"
    n: int = Field(default=1, ge=1)
    share: float = Field(default=0.5, ge=0, le=1)
    name: str = Field(default="x", min_length=1)
    code: str = Field(default="a", pattern="^[a-z]+$")
    names: tuple[str, ...] = ()
    few: tuple[int, ...] = Field(default=(1,), min_length=1, max_length=2)
    weights: dict[str, float] = Field(default_factory=dict)
    on: bool = True
    size: float | str | tuple[float, ...] = 1.0
    nested: int | Camera = 3
    exporters: tuple[Annotated[Coco | Kitti, Field(discriminator="type")], ...] = ()
    roughness: UnitInterval = Uniform(0.1, 0.9)
    angle: Annotated[Scalar, Bounds(1, 170, open_low=True, open_high=True)] = Uniform(10, 20)
    lux: Positive = Uniform(1, 2)
    count: Count = Constant(1)
    finish: Name = Constant("a")
    wet: Flag = Constant(False)
    maybe: Scalar | None = None

    @model_validator(mode="after")
    def _not_both(self) -> Config:
        if self.n == 13:
            raise ValueError("13 is an unlucky number; expected another")
        return self


def told(text: str) -> str:
    problems = Problems()
    assert validate(parse_yaml(text, "x.yaml"), Config, problems) is None
    with pytest.raises(ConfigError) as caught:
        problems.raise_if_any()
    return str(caught.value)


def test_a_valid_document_becomes_a_frozen_model() -> None:
    """Lists become tuples, whole numbers become floats, strings become enums."""
    problems = Problems()
    text = (
        "{camera: {fov_deg: 60, size_px: [1, 2], mode: good}, names: [a, b], share: 1, wet: true}"
    )
    config = validate(parse_yaml(text, "x.yaml"), Config, problems)
    problems.raise_if_any()
    assert config is not None
    assert config.camera == Camera(fov_deg=60.0, size_px=(1, 2), mode=Mode.GOOD)
    assert config.names == ("a", "b")
    assert isinstance(config.share, float)


NUMERIC = "constant, choice, sequence, uniform, log_uniform, normal, uniform_integer, mixture"
FIELDS = ", ".join(Config.model_fields)

MESSAGES = [
    ("stile: matte", f"1:1: stile: unknown key 'stile'; expected one of {FIELDS} "
                     "(did you mean 'style'?)"),
    ("camera: {fov_dg: 3, fov_deg: 3}",
     "1:10: camera.fov_dg: unknown key 'fov_dg'; expected one of fov_deg, size_px, mode "
     "(did you mean 'fov_deg'?)"),
    ("camera: {}", "1:9: camera.fov_deg: missing key 'fov_deg'; expected a number in (1, 170)"),
    ("camera: {fov_deg: 400}", "1:19: camera.fov_deg: 400 is not in (1, 170)"),
    ("camera: {fov_deg: abc}", "1:19: camera.fov_deg: expected a number in (1, 170), got 'abc'"),
    ("camera: {fov_deg: true}", "1:19: camera.fov_deg: expected a number in (1, 170), got true"),
    ("camera: {fov_deg: '60'}", "1:19: camera.fov_deg: expected a number in (1, 170), got '60'"),
    ("camera: {fov_deg: 3, size_px: [1]}",
     "1:31: camera.size_px: expected a list of 2 whole numbers, got 1 item"),
    ("camera: {fov_deg: 3, size_px: [1, 2, 3]}",
     "1:31: camera.size_px: expected a list of 2 whole numbers, got 3 items"),
    ("camera: {fov_deg: 3, size_px: [1, 2.5]}",
     "1:35: camera.size_px[1]: expected a whole number, got 2.5"),
    ("camera: {fov_deg: 3, mode: fats}",
     "1:28: camera.mode: unknown value 'fats'; expected one of fast, good (did you mean 'fast'?)"),
    ("camera: 3", "1:9: camera: expected a mapping (fov_deg, size_px, mode), got 3"),
    ("style: mate",
     "1:8: style: unknown value 'mate'; expected one of matte, glossy (did you mean 'matte'?)"),
    ("n: 0", "1:4: n: 0 is not >= 1"), ("n: 13", "1:1: 13 is an unlucky number; expected another"),
    ("n:", "1:3: n: expected a whole number >= 1, got nothing"),
    ("share: 1.5", "1:8: share: 1.5 is not in [0, 1]"),
    ("name: ''", "1:7: name: must not be empty"),
    ("name: 3", "1:7: name: expected a text, got 3; put it in quotes"),
    ("code: A1", "1:7: code: 'A1' does not match the pattern ^[a-z]+$"),
    ("names: a", "1:8: names: expected a list of texts, got 'a'"),
    ("names: [a, [b]]", "1:12: names[1]: expected a text, got [b]"),
    ("few: []", "1:6: few: must not be empty"),
    ("few: [1, 2, 3]", "1:6: few: expected at most 2 items, got 3 items"),
    ("weights: {a: b}", "1:14: weights.a: expected a number, got 'b'"),
    ("weights: 1", "1:10: weights: expected a mapping of names to numbers, got 1"),
    ("on: yes", "1:5: on: expected true or false, got 'yes' (did you mean true?)"),
    ("size: {a: 1}", "1:7: size: expected a number, a text or a list of numbers, got {a: 1}"),
    ("size: [1, b]", "1:11: size[1]: expected a number, got 'b'"),
    ("nested: abc",
     "1:9: nested: expected a whole number or a mapping (fov_deg, size_px, mode), got 'abc'"),
    ("nested: {fov_deg: 0}", "1:19: nested.fov_deg: 0 is not in (1, 170)"),
    ("exporters: [{type: cooco}]",
     "1:20: exporters[0].type: unknown value 'cooco'; expected one of coco, kitti "
     "(did you mean 'coco'?)"),
    ("exporters: [{crowd: 1}]",
     "1:13: exporters[0]: missing key 'type'; expected one of coco, kitti"),
    ("exporters: [{type: coco, crowd: x}]",
     "1:33: exporters[0].crowd: expected a whole number, got 'x'"),
    ("exporters: [{type: coco, index: 1}]",
     "1:26: exporters[0].index: unknown key 'index'; expected one of type, crowd"),
    ("roughness: {unifrom: [0, 1]}",
     f"1:13: roughness: unknown distribution 'unifrom'; expected one of {NUMERIC} "
     "(did you mean 'uniform'?)"),
    ("roughness: {probability: 1}",
     f"1:13: roughness: distribution 'probability' does not give a number; "
     f"expected one of {NUMERIC}"),
    ("roughness: {uniform: [1.2, 0.4]}",
     "1:22: roughness: uniform needs low <= high, got [1.2, 0.4]"),
    ("roughness: {uniform: [0, x]}", "1:26: roughness: expected a number, got 'x'"),
    ("roughness: {uniform: 1}", "1:22: roughness: uniform needs two numbers [low, high], got 1"),
    ("roughness: {uniform: [0, 1], normal: 1}",
     f"1:12: roughness: a distribution is a mapping with one key, got 2 keys; "
     f"expected one of {NUMERIC}"),
    ("roughness: {}",
     f"1:12: roughness: a distribution is a mapping with one key, got 0 keys; "
     f"expected one of {NUMERIC}"),
    ("roughness: 1.5", "1:12: roughness: 1.5 is not in [0, 1]"),
    ("roughness: {uniform: [0, 1.5]}",
     "1:12: roughness: uniform can give 1.5, but every value must be in [0, 1]"),
    ("roughness: {normal: {mean: 0, stddev: 1}}",
     "1:12: roughness: normal has no limits, but every value must be in [0, 1]; add a clip"),
    ("roughness: {normal: {mean: 0}}", "1:21: roughness: normal needs 'stddev'"),
    ("roughness: {normal: {mean: 0, sddev: 1}}",
     "1:31: roughness: unknown key 'sddev' of normal; expected mean, stddev, clip "
     "(did you mean 'stddev'?)"),
    ("roughness: {normal: {mean: 0, stddev: -1}}",
     "1:21: roughness: normal needs stddev >= 0, got -1"),
    ("roughness: {normal: {mean: 0, stddev: 0.1, clip: [5, 6]}}",
     "1:21: roughness: normal with mean 0 and stddev 0.1 never falls into clip [5, 6]"),
    ("roughness: {normal: {mean: 0, stddev: 0.1, clip: [2, 1]}}",
     "1:21: roughness: normal clip needs low <= high, got [2, 1]"),
    ("roughness: {choice: []}", "1:21: roughness: choice needs at least one value"),
    ("roughness: {choice: {0.1: 1, 0.2: -1}}",
     "1:35: roughness: choice needs weights >= 0, got -1 for 0.2"),
    ("roughness: {choice: {0.1: 0}}", "1:21: roughness: choice needs at least one weight > 0"),
    ("roughness: {choice: [0.1, b]}",
     "1:27: roughness: expected a number or a distribution, got 'b'"),
    ("roughness: {sequence: 1}", "1:23: roughness: sequence needs a list of values, got 1"),
    ("roughness: [0, 1]",
     "1:12: roughness: expected a number or a distribution, got [0, 1] "
     "(did you mean {uniform: [0, 1]}?)"),
    ("roughness: abc", "1:12: roughness: expected a number or a distribution, got 'abc'"),
    ("roughness: uniform", "1:12: roughness: 'uniform' needs an argument; write {uniform: ...}"),
    ("angle: 170", "1:8: angle: 170 is not in (1, 170)"), ("lux: 0", "1:6: lux: 0 is not > 0"),
    ("lux: {log_uniform: [0, 1]}", "1:20: lux: log_uniform needs low > 0 and high > 0, got [0, 1]"),
    ("lux: {log_uniform: [2, 1]}", "1:20: lux: log_uniform needs low <= high, got [2, 1]"),
    ("count: -1", "1:8: count: -1 is not >= 0"),
    ("count: 1.5", "1:8: count: expected a whole number or a distribution, got 1.5"),
    ("count: [1, 3]",
     "1:8: count: expected a whole number or a distribution, got [1, 3] "
     "(did you mean {uniform_integer: [1, 3]}?)"),
    ("count: {uniform: [1, 3]}",
     "1:9: count: distribution 'uniform' does not give a whole number; expected one of "
     "constant, choice, sequence, uniform_integer, mixture (did you mean 'uniform_integer'?)"),
    ("count: {uniform_integer: [3, 1]}",
     "1:26: count: uniform_integer needs low <= high, got [3, 1]"),
    ("count: {uniform_integer: [-1, 1]}",
     "1:8: count: uniform_integer can give -1, but every value must be >= 0"),
    ("finish: 3", "1:9: finish: expected a name or a distribution, got 3; put it in quotes"),
    ("wet: no",
     "1:6: wet: expected true, false or {probability: p}, got 'no' (did you mean false?)"),
    ("wet: {probability: 2}", "1:20: wet: probability needs a number in [0, 1], got 2"),
    ("maybe: x", "1:8: maybe: expected a number or a distribution, got 'x'"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), MESSAGES, ids=[text for text, _ in MESSAGES])
def test_every_mistake_is_told_in_plain_words(text: str, message: str) -> None:
    """Place, field, fact, expectation; then the line with a caret under the column."""
    column = int(message.split(":")[1])
    assert told(text) == f"x.yaml:{message}\n      1 | {text}\n        | {' ' * (column - 1)}^"


def test_all_mistakes_are_told_at_once_and_those_of_the_command_line_there() -> None:
    """In the order of the file. The rest of the tree still points into its file."""
    text = "n: 0\ncamera: {fov_deg: 400, x: 1}\nwet: 1\nroughness: {uniform: [1, 0]}\n"
    places = [line.split(": ")[:2] for line in told(text).split("\n") if line.startswith("x.yaml")]
    assert places == [
        ["x.yaml:1:4", "n"],
        ["x.yaml:2:19", "camera.fov_deg"],
        ["x.yaml:2:24", "camera.x"],
        ["x.yaml:3:6", "wet"],
        ["x.yaml:4:22", "roughness"],
    ]
    document = with_override(parse_yaml("camera: {fov_deg: 60}", "x.yaml"), "camera.fov_deg", "400")
    problems = Problems()
    validate(document, Config, problems)
    assert [str(problem) for problem in problems.sorted()] == [
        "--set:1:16: camera.fov_deg: 400 is not in (1, 170)\n"
        "      1 | camera.fov_deg=400\n"
        "        |                ^"
    ]


def test_fields_are_named_from_the_root_of_the_document_also_if_they_are_no_mapping() -> None:
    document = parse_yaml("randomizers:\n  - {fov_deg: 0}\n", "x.yaml")
    node, problems = document.get("randomizers", 0), Problems()
    assert node is not None
    assert validate(node, Camera, problems, "randomizers[0]") is None
    assert str(problems.sorted()[0]).startswith(
        "x.yaml:2:15: randomizers[0].fov_deg: 0 is not in (1, 170)"
    )
    document, problems = parse_yaml("a: [1]", "x.yaml"), Problems()
    node = document.get("a", 0)
    assert node is not None
    assert validate(node, Camera, problems, "a[0]") is None
    assert str(problems.sorted()[0]).startswith(
        "x.yaml:1:5: a[0]: expected a mapping (fov_deg, size_px, mode), got 1"
    )


@pytest.mark.parametrize(
    ("path", "message"),
    [("camerra.fov_deg", "--set:1:1: camerra: unknown key 'camerra'; "),
     ("camera.fov", "--set:1:8: camera.fov: unknown key 'fov'; ")],
)  # fmt: skip
def test_a_misspelt_override_is_an_unknown_key(path: str, message: str) -> None:
    document, problems = parse_yaml("camera: {fov_deg: 60}", "x.yaml"), Problems()
    validate(with_override(document, path, "3"), Config, problems)
    assert str(problems.sorted()[0]).startswith(message)
    assert "did you mean" in str(problems.sorted()[0])


YAML_LIKE = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 500) | st.floats(-2, 2) | st.sampled_from("abx"),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["uniform", "normal", "choice", "mean", "stddev", "type", "fov_deg"]),
            inner,
            max_size=2,
        )
    ),
    max_leaves=6,
)


@settings(max_examples=400, deadline=None, derandomize=True)
@given(st.dictionaries(st.sampled_from([*Config.model_fields, "zzz"]), YAML_LIKE, max_size=4))
def test_any_document_gives_a_model_or_problems(plain: dict[str, Any]) -> None:
    """Every field with every shape of value: no other exception, always a place and a field."""
    from gen_data.config.yaml_scalars import to_flow_yaml

    text, problems = to_flow_yaml(plain), Problems()
    made = validate(parse_yaml(text, "x.yaml"), Config, problems)
    assert (made is None) == bool(len(problems))
    for problem in problems.sorted():
        assert problem.position.file == "x.yaml"
        assert problem.fact
        assert "Input should" not in problem.fact
        assert problem.field or "unlucky" in problem.fact


class Parts(Strict):
    width: int = 1
    lens: Mapping[str, int] = {}

    @model_validator(mode="after")
    def _fits(self) -> Parts:
        if self.width > 9:
            raise ValueError(f"width: {self.width} is too wide; expected at most 9")
        if self.width == 9:
            raise ValueError("width and lens exclude each other")
        if self.width == 8:
            raise ValueError("lens.a: expected none")
        if self.width == 7:
            raise ValueError("neither fits")
        return self


@pytest.mark.parametrize(("text", "wanted"), [
    ("{width: 12}", "x.yaml:1:9: p.width: 12 is too wide; expected at most 9"),
    ("{width: 9}", "x.yaml:1:9: p.width: width and lens exclude each other"),
    ("{width: 8, lens: {a: 1}}", "x.yaml:1:22: p.lens.a: expected none"),
    ("{width: 8}", "x.yaml:1:1: p: lens.a: expected none"),
    ("{width: 7}", "x.yaml:1:1: p: neither fits"),
])  # fmt: skip
def test_a_fault_that_begins_with_a_field_is_placed_at_this_field(text: str, wanted: str) -> None:
    """A check of several fields reports one of them; a field with its default has no place."""
    problems = Problems()
    validate(parse_yaml(text, "x.yaml"), Parts, problems, "p")
    assert [str(one).splitlines()[0] for one in problems.sorted()] == [wanted]
