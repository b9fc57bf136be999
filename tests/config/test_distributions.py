"""Distributions as values: construction, equality, support, YAML form."""

import json
import math
import pickle
from collections.abc import Callable
from contextlib import nullcontext
from typing import Annotated, Any

import pytest

from gen_data.config.base_model import Strict
from gen_data.config.distributions import (
    DISTRIBUTIONS,
    NUMBER,
    AboutZ,
    Bounds,
    Box,
    Cap,
    Choice,
    Constant,
    Count,
    Direction,
    Distribution,
    EulerDeg,
    Flag,
    LogUniform,
    Malformed,
    Mixture,
    Name,
    Normal,
    Numeric,
    OneOf,
    Position,
    Probability,
    QuaternionWxyz,
    Rotation,
    Scalar,
    Sequence,
    Shell,
    So3,
    Sphere,
    Uniform,
    UniformInteger,
)
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import ConfigError
from gen_data.core.streams import Rng, Streams


def rng_of(index: int) -> Rng:
    return Streams(seed=3, scene=index, index=index).rng("test")


class Fields(Strict):
    scalar: Scalar = Constant(0.0)
    count: Count = Constant(0)
    name: Name = Constant("a")
    flag: Flag = Constant(False)
    rotation: Rotation = So3()
    direction: Direction = Sphere()
    position: Position = Constant((0.0, 0.0, 0.0))


YAML_FORMS: list[tuple[str, str, Distribution[Any]]] = [
    ("scalar", "0.5", Constant(0.5)), ("scalar", "2", Constant(2.0)),
    ("scalar", "{constant: 0.5}", Constant(0.5)),
    ("scalar", "{uniform: [0.1, 0.9]}", Uniform(0.1, 0.9)),
    ("scalar", "{log_uniform: [200, 2000]}", LogUniform(200, 2000)),
    ("scalar", "{mixture: [[1, {uniform: [0, 1]}], [3, 5]]}",
     Mixture((Uniform(0, 1), Constant(5.0)), (1.0, 3.0))),
    ("count", "{mixture: [[1, {uniform_integer: [0, 3]}]]}",
     Mixture((UniformInteger(0, 3),), (1.0,))),
    ("scalar", "{normal: {mean: 1, stddev: 2}}", Normal(1, 2)),
    ("scalar", "{normal: {mean: 1, stddev: 2, clip: [0, 3]}}", Normal(1, 2, clip=(0, 3))),
    ("scalar", "{uniform_integer: [3, 12]}", UniformInteger(3, 12)),
    ("scalar", "{choice: [1, 2.5]}", Choice((1.0, 2.5))),
    ("scalar", "{choice: {1: 3, 2.5: 1}}", Choice({1.0: 3, 2.5: 1})),
    ("scalar", "{sequence: [1, 2]}", Sequence((1.0, 2.0))), ("count", "3", Constant(3)),
    ("count", "{uniform_integer: [3, 12]}", UniformInteger(3, 12)),
    ("count", "{choice: {1: 3, 2: 1}}", Choice({1: 3, 2: 1})), ("name", "mug", Constant("mug")),
    ("name", "so3", Constant("so3")), ("name", "uniform", Constant("uniform")),
    ("name", "{choice: {a: 3, b: 1}}", Choice({"a": 3, "b": 1})),
    ("name", "{choice: {1: 3, true: 1}}", Choice({"1": 3, "true": 1})),
    ("name", "{sequence: [a, b]}", Sequence(("a", "b"))), ("flag", "true", Constant(True)),
    ("flag", "{probability: 0.3}", Probability(0.3)),
    ("flag", "{choice: {true: 1, false: 2}}", Choice({True: 1, False: 2})),
    ("flag", "{sequence: [true, false]}", Sequence((True, False))),
    ("rotation", "[2, 0, 0, 0]", Constant((1.0, 0.0, 0.0, 0.0))),
    ("rotation", "{quaternion_wxyz: [0, 0, 0, 3]}", QuaternionWxyz((0, 0, 0, 1))),
    ("rotation", "{euler_deg: [0, 0, 90]}", EulerDeg((0, 0, 90))), ("rotation", "so3", So3()),
    ("rotation", "{so3: }", So3()), ("rotation", "about_z", AboutZ()),
    ("rotation", "{about_z: [-45, 45]}", AboutZ((-45, 45))),
    ("rotation", "{choice: [[1, 0, 0, 0], [0, 1, 0, 0]]}", Choice(((1, 0, 0, 0), (0, 1, 0, 0)))),
    ("direction", "[0, 0, -2]", Constant((0.0, 0.0, -1.0))), ("direction", "sphere", Sphere()),
    ("direction", "{cap: {axis: [0, 0, 2], half_angle_deg: 30}}", Cap((0, 0, 1), 30)),
    ("position", "[1, 2, 3]", Constant((1.0, 2.0, 3.0))),
    ("position", "{box: [[0, 0, 0], [1, 2, 3]]}", Box((0, 0, 0), (1, 2, 3))),
    ("position", "{shell: {center_m: [0, 0, 1], radius_m: [1, 2]}}", Shell((0, 0, 1), (1, 2))),
    ("position", "{shell: {center_m: [0, 0, 1], radius_m: [1, 2], elevation_deg: [10, 80]}}",
     Shell((0, 0, 1), (1, 2), (10, 80))),
    ("position", "{sequence: [[0, 0, 0], [0, 0, 1]]}", Sequence(((0, 0, 0), (0, 0, 1)))),
]  # fmt: skip


def read(field: str, text: str) -> Distribution[Any]:
    problems = Problems()
    fields = validate(parse_yaml(f"{field}: {text}", "x.yaml"), Fields, problems)
    problems.raise_if_any()
    found: Distribution[Any] = getattr(fields, field)
    return found


@pytest.mark.parametrize(("field", "text", "expected"), YAML_FORMS)
def test_each_form_is_a_distribution(field: str, text: str, expected: Distribution[Any]) -> None:
    """A plain value is a constant, a one-key mapping is a distribution.

    A resolved configuration is a configuration; distributions go to worker processes as values;
    numbers lie between both ends, and listed values are those listed.
    """
    assert read(field, text) == expected
    assert type(read(field, text)) is type(expected)
    assert read(field, to_flow_yaml(expected.to_yaml())) == expected
    travelled = pickle.loads(pickle.dumps(expected))
    assert (travelled, hash(travelled)) == (expected, hash(expected))
    assert travelled.draw(rng_of(1)) == expected.draw(rng_of(1))
    rng = rng_of(2)
    drawn = [expected.draw(rng) for _ in range(200)]
    if expected.outcomes():
        assert set(drawn) <= set(expected.outcomes())
    if isinstance(expected, Numeric) and not isinstance(drawn[0], (str, tuple)):
        low, high = expected.support()
        assert all(low <= value <= high for value in drawn)


def test_every_distribution_is_covered_here_and_written_as_yaml_has_it() -> None:
    """JSON of a model is a configuration that makes the same model."""
    covered = {type(distribution).name for _, _, distribution in YAML_FORMS}
    assert covered == set(DISTRIBUTIONS)
    for name in DISTRIBUTIONS:
        assert DISTRIBUTIONS.load(name).name == name
        assert DISTRIBUTIONS.load(name).__doc__
    fields = Fields(scalar=Normal(1, 2, clip=(0, 3)), rotation=AboutZ((0, 90)), flag=Probability(1))
    assert Fields.model_validate_json(fields.model_dump_json()) == fields
    assert json.loads(fields.model_dump_json())["scalar"] == {
        "normal": {"mean": 1.0, "stddev": 2.0, "clip": [0.0, 3.0]}
    }
    assert json.loads(fields.model_dump_json())["count"] == 0


ZERO_WIDTH: list[tuple[Distribution[Any], Any]] = [
    (Uniform(0.1, 0.1), 0.1), (LogUniform(0.1, 0.1), 0.1), (Normal(0.1, 0.0), 0.1),
    (Normal(0.5, 2.0, clip=(0.1, 0.1)), 0.1), (UniformInteger(3, 3), 3), (Choice((0.1,)), 0.1),
    (Mixture((Constant(0.1), Uniform(0, 1)), (1.0, 0.0)), 0.1), (Sequence((0.1,)), 0.1),
    (Probability(1), True), (Probability(0), False), (Cap((0, 0, 1), 0), (0.0, 0.0, 1.0)),
    (Box((1, 2, 3), (1, 2, 3)), (1.0, 2.0, 3.0)), (AboutZ((0, 0)), (1.0, 0.0, 0.0, 0.0)),
]  # fmt: skip


@pytest.mark.parametrize(("distribution", "value"), ZERO_WIDTH)
def test_a_range_of_no_width_is_constant(distribution: Distribution[Any], value: object) -> None:
    """Bit for bit: a range can be narrowed to nothing."""
    rng = rng_of(0)
    assert {distribution.draw(rng) for _ in range(20)} == {value}


SUPPORTS: list[tuple[Numeric[Any], tuple[float, float]]] = [
    (Constant(3.5), (3.5, 3.5)), (Uniform(1, 4), (1, 4)), (LogUniform(1, 4), (1, 4)),
    (Mixture((Uniform(1, 4), Constant(7.0), Constant(99.0)), (1, 1, 0)), (1, 7)),
    (Normal(0, 1), (-math.inf, math.inf)), (Normal(0, 1, clip=(-1, 2)), (-1, 2)),
    (Normal(0, 0), (0, 0)), (UniformInteger(3, 12), (3, 12)), (Choice({1.0: 1, 9.0: 0}), (1, 1)),
    (Sequence((4.0, 2.0)), (2, 4)), (Probability(0.5), (0, 1)), (Probability(1), (1, 1)),
]  # fmt: skip


@pytest.mark.parametrize(("distribution", "support"), SUPPORTS)
def test_supports_are_as_stated(distribution: Numeric[Any], support: tuple[float, float]) -> None:
    """Values without weight do not count."""
    assert distribution.support() == support


def test_outcomes_reprs_and_sequences_tell_what_can_be_drawn() -> None:
    """Names can be checked before a run; names have no range."""
    assert Choice({"a": 1, "b": 0}).outcomes() == ("a",)
    assert Sequence(("a", "b")).outcomes() == ("a", "b")
    assert Constant("a").outcomes() == ("a",)
    assert Probability(0.5).outcomes() == (False, True)
    assert Uniform(0, 1).outcomes() == ()
    with pytest.raises(TypeError, match="'a' is not a number"):
        Choice(("a", "b")).support()
    assert repr(Uniform(0.1, 0.9)) == "Uniform(low=0.1, high=0.9)"
    assert repr(Choice({"a": 3, "b": 1})) == "Choice({'a': 3.0, 'b': 1.0})"
    assert repr(Choice(("a", "b"))) == "Choice(('a', 'b'))"
    assert Choice(("a", "b")) == Choice({"a": 1, "b": 1})
    # Any sample can be made alone, in any order.
    sequence = Sequence(("a", "b", "c"))
    assert [sequence.draw(rng_of(i)) for i in (0, 1, 2, 3, 7)] == ["a", "b", "c", "a", "b"]
    assert [sequence.draw(rng_of(i)) for i in (7, 3)] == ["b", "a"]


WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: Uniform(math.nan, 1), "expected a finite number, got nan"),
    (lambda: Uniform(-1.7e308, 1.7e308), "uniform needs a finite range, got [-1.7e+308, 1.7e+308]"),
    (lambda: LogUniform(-2, -1), "log_uniform needs low > 0 and high > 0, got [-2, -1]"),
    (lambda: Mixture((), ()), "mixture needs at least one weight > 0"),
    (lambda: Mixture((Constant(1.0),), (1.0, 2.0)), "mixture has 1 parts, but 2 weights"),
    (lambda: Normal(0, 1, (50, 60)),
     "normal with mean 0 and stddev 1 never falls into clip [50, 60]"),
    (lambda: Normal(0, 1, (37, 38)),
     "normal with mean 0 and stddev 1 never falls into clip [37, 38]"),
    (lambda: Normal(0, 0, (1, 2)), "normal with mean 0 and stddev 0 never falls into clip [1, 2]"),
    (lambda: UniformInteger(2, 1), "uniform_integer needs low <= high, got [2, 1]"),
    (lambda: UniformInteger(0.5, 1), "expected a whole number, got 0.5"),  # type: ignore[arg-type]
    (lambda: Choice({"a": -1}), "choice needs weights >= 0, got -1 for 'a'"),
    (lambda: Sequence(()), "sequence needs at least one value"),
    (lambda: Probability(1.5), "probability needs a number in [0, 1], got 1.5"),
    (lambda: AboutZ((90, -90)), "about_z needs low <= high, got [90, -90]"),
    (lambda: Cap((0, 0, 0), 10), "a direction must not be zero"),
    (lambda: Box((0, 1, 0), (1, 0, 1)), "box along y needs low <= high, got [1, 0]"),
    (lambda: Shell((0, 0, 0), (-1, 1)), "shell needs radius_m >= 0, got -1"),
    (lambda: Shell((0, 0, 0), (1, 2), (0, 91)),
     "shell needs elevation_deg within [-90, 90], got [0, 91]"),
    (lambda: QuaternionWxyz((0, 0, 0, 0)), "a quaternion must not be zero"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message for _, message in WRONG])
def test_impossible_parameters_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(Malformed) as caught:
        make()
    assert str(caught.value) == message


SPATIAL_MESSAGES = [
    ("rotation: so4", "unknown distribution 'so4'; expected one of constant, choice, sequence, "
     "quaternion_wxyz, euler_deg, so3, about_z (did you mean 'so3'?)"),
    ("rotation: [1, 0, 0]", "expected a quaternion [w, x, y, z], got [1, 0, 0]"),
    ("rotation: {so3: 1}", "so3 takes no argument, got 1; write so3 alone"),
    ("rotation: {euler_deg: 90}", "expected three angles [roll, pitch, yaw] in degrees, got 90"),
    ("direction: {cap: {axis: [0, 0, 1]}}", "cap needs 'half_angle_deg'"),
    ("direction: {cap: {axis: [0, 1], half_angle_deg: 3}}",
     "expected a direction [x, y, z], got [0, 1]"),
    ("position: 3", "expected three numbers [x, y, z], got 3"),
    ("position: [0, 0, a]", "expected a number, got 'a'"),
    ("position: {box: [0, 0, 0]}", "box needs two corners [low, high], got [0, 0, 0]"),
    ("position: {shell: {center_m: [0, 0, 0], radius: [1, 2]}}",
     "unknown key 'radius' of shell; expected center_m, radius_m, elevation_deg "
     "(did you mean 'radius_m'?)"),
    ("position: {choice: {a: 1}}", "weights by value need a number or a name, got 'a'; use a list"),
]  # fmt: skip


FAULTS = [
    ("scalar: {normal: {self: 1}}", "1:19",
     "unknown key 'self' of normal; expected mean, stddev, clip"),
    ("scalar: {normal: {mean: true, stddev: 1}}", "1:25", "expected a number, got true"),
    ("scalar: {normal: {mean: 0, stddev: 1, clip: }}", "1:45",
     "clip needs two numbers [low, high], got nothing"),
    ("scalar: {normal: {mean: 0, stddev: 1, clip: [0, x]}}", "1:49", "expected a number, got 'x'"),
    ("scalar: {mixture: 1}", "1:19", "mixture needs a list of pairs [weight, distribution], got 1"),
    ("scalar: {mixture: [[1, {uniform: [2, 1]}]]}", "1:34",
     "uniform needs low <= high, got [2, 1]"),
    ("scalar: {mixture: [[-1, 2]]}", "1:21", "mixture needs weights >= 0, got -1"),
    ("scalar: {normal: 1}", "1:18", "normal needs a mapping with mean, stddev, clip, got 1"),
    ("count: {uniform_integer: [1, 2.5]}", "1:30", "expected a whole number, got 2.5"),
    ("count: {uniform_integer: [1]}", "1:26",
     "uniform_integer needs two whole numbers [low, high], got [1]"),
    ("rotation: {about_z: [0, 1, 2]}", "1:21",
     "about_z needs two numbers [low, high], got [0, 1, 2]"),
    ("rotation: {euler_deg: [0, 1, a]}", "1:30", "expected a number, got 'a'"),
    ("direction: {cap: {axis: [0, 0, 1], half_angle_deg: 181}}", "1:52",
     "cap needs half_angle_deg in [0, 180], got 181"),
    ("position: {box: [[0, 0, 0], [1, a, 1]]}", "1:33", "expected a number, got 'a'"),
    ("position: {shell: {center_m: [0, 0, 0], radius_m: [2, 1]}}", "1:51",
     "shell radius_m needs low <= high, got [2, 1]"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "place", "fact"),
    [*FAULTS, *((text, "", fact) for text, fact in SPATIAL_MESSAGES)],
    ids=[row[0] for row in (*FAULTS, *SPATIAL_MESSAGES)],
)
def test_faults_in_a_distribution_are_told_with_place(text: str, place: str, fact: str) -> None:
    """The column of the part that is wrong, at any depth."""
    problems = Problems()
    validate(parse_yaml(text, "x.yaml"), Fields, problems)
    (problem,) = problems.sorted()
    assert problem.fact == fact
    assert not place or str(problem.position) == f"x.yaml:{place}"


def test_a_distribution_of_a_plugin_needs_fields_and_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its YAML form, messages and JSON Schema follow from its fields."""
    from gen_data.config.distributions import base

    @base.parameters
    class Triangular(Numeric[float], key="triangular", kinds=("number",)):
        peak: float
        reach: float = 1.0

        def draw(self, rng: Rng) -> float:
            return self.peak + self.reach * (rng.random() - rng.random())

        def support(self) -> tuple[float, float]:
            return self.peak - self.reach, self.peak + self.reach

    monkeypatch.setattr(base, "distribution_names", lambda kind: ("triangular",))
    monkeypatch.setattr(base, "distribution", lambda name: Triangular)
    kind = NUMBER

    assert base.read_distribution({"triangular": {"peak": 2}}, kind) == Triangular(2.0)
    assert Triangular(2.0).to_yaml() == {"triangular": {"peak": 2.0, "reach": 1.0}}
    assert Triangular.schema({})["required"] == ["peak"]
    with pytest.raises(Malformed, match="triangular needs 'peak'"):
        base.read_distribution({"triangular": {"reach": 2}}, kind)


@pytest.mark.parametrize(
    ("bounds", "text"),
    [(Bounds(1, 170), "in [1, 170]"),
     (Bounds(1, 170, open_low=True, open_high=True), "in (1, 170)"), (Bounds(low=0), ">= 0"),
     (Bounds(low=0, open_low=True), "> 0"), (Bounds(high=1), "<= 1"),
     (Bounds(high=1, open_high=True), "< 1")],
)  # fmt: skip
def test_bounds_read_like_mathematics(bounds: Bounds, text: str) -> None:
    assert bounds.within() == text
    if math.isfinite(bounds.low):
        assert (bounds.low in bounds) == ("[" in text or ">=" in text)
    if math.isfinite(bounds.high):
        assert (bounds.high in bounds) == ("]" in text or "<=" in text)


def test_bounds_can_be_set_on_any_field_type() -> None:
    """On distributions by their support, on plain numbers by value."""

    class Limited(Strict):
        a: Annotated[Scalar, Bounds(0, 1)] = Constant(0.5)
        b: Annotated[float, Bounds(0, 1)] = 0.5
        c: Annotated[Scalar, Bounds(2, 3)] = Constant(2)

    problems = Problems()
    validate(parse_yaml("{a: {uniform: [0, 2]}, b: 2, c: 1}", "x.yaml"), Limited, problems)

    assert [f"{problem.field}: {problem.fact}" for problem in problems.sorted()] == [
        "a: uniform can give 2, but every value must be in [0, 1]",
        "b: 2 is not in [0, 1]",
        "c: 1 is not in [2, 3]",
    ]


class Sides(Strict):
    side: Annotated[Name, OneOf(("left", "right"))] = Constant("left")


@pytest.mark.parametrize(
    ("text", "valid"),
    [("right", True), ("{choice: {left: 1, lfet: 0}}", True), ("{sequence: [right]}", True),
     ("lfet", False), ("{choice: [right, lfet]}", False), ("{sequence: [lfet]}", False)],
)  # fmt: skip
def test_names_outside_a_closed_set_are_refused_with_the_nearest(text: str, valid: bool) -> None:
    """Wherever they stand; a name without weight is never drawn, and so not checked."""
    problems = Problems()
    validate(parse_yaml(f"side: {text}", "test"), Sides, problems)
    assert bool(len(problems)) != valid
    fact = "side: there is no 'lfet'; expected one of left, right"
    with nullcontext() if valid else pytest.raises(ConfigError, match=fact):
        problems.raise_if_any()
    constant, _ = Sides.model_json_schema()["properties"]["side"]["anyOf"]
    assert constant["enum"] == ["left", "right"]
