"""``--set path=value``."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.config.yaml_tree import Node, parse_yaml, with_override
from gen_data.core.errors import ConfigError
from tests.config.messages import told

TEXT = """\
seed: 7
physics:
camera: {fov_deg: 60}
randomizers:
  - {name: clutter, count: 3}
  - {name: finish, roughness: {uniform: [0, 1]}}
  - {type: lamps}
"""


@pytest.fixture
def document() -> Node:
    return parse_yaml(TEXT, "t.yaml")


@pytest.mark.parametrize(
    ("path", "value", "reached", "expected"),
    [
        ("seed", "0", ("seed",), 0), ("camera.fov_deg", "1e1", ("camera", "fov_deg"), 10.0),
        ("camera.name", "front", ("camera", "name"), "front"),
        ("randomizers[0].count", "5", ("randomizers", 0, "count"), 5),
        ("randomizers.1.name", "x", ("randomizers", 1, "name"), "x"),
        ("randomizers.clutter.count", "5", ("randomizers", 0, "count"), 5),
        ("randomizers.finish.roughness", "{normal: {mean: 0, stddev: 1}}",
         ("randomizers", 1, "roughness"), {"normal": {"mean": 0, "stddev": 1}}),
        ("randomizers.finish.roughness.uniform[1]", "2", ("randomizers", 1, "roughness"),
         {"uniform": [0, 2]}),
        ("physics.settle_s", "4", ("physics",), {"settle_s": 4}),
        ("render.samples", "16", ("render",), {"samples": 16}),
        ("randomizers", "[]", ("randomizers",), []), ("camera", "", ("camera",), None),
        ("name", "a=b", ("name",), "a=b"),
    ],
)  # fmt: skip
def test_an_override_exchanges_one_value(
    document: Node, path: str, value: str, reached: tuple[str | int, ...], expected: object
) -> None:
    """By keys, by index, by name; anything else stays."""
    changed = with_override(document, path, value)
    node = changed.get(*reached)
    assert node is not None
    assert node.plain() == expected
    assert document.plain() == parse_yaml(TEXT, "t.yaml").plain()
    untouched = {k: v for k, v in document.plain().items() if k != reached[0]}
    assert {k: v for k, v in changed.plain().items() if k != reached[0]} == untouched


def test_an_overridden_value_knows_that_it_came_from_the_command_line(document: Node) -> None:
    """The column counts in ``path=value``."""
    changed = with_override(document, "camera.fov_deg", "400")
    camera = changed.get("camera")
    assert camera is not None
    assert camera.content["fov_deg"].position.source == "camera.fov_deg=400"  # type: ignore[index,call-overload]
    assert str(camera.content["fov_deg"].position) == "--set:1:16"  # type: ignore[index,call-overload]
    assert str(camera.key_position("fov_deg")) == "--set:1:8"
    assert camera.position.file == "t.yaml"


@pytest.mark.parametrize(
    ("path", "value", "column", "fact"),
    [
        ("randomizers.cluter.count", "5", 13, "randomizers: no item is named 'cluter'; expected "
         "clutter, finish (did you mean 'clutter'?)"),
        ("randomizers[3].count", "5", 12, "randomizers: has 3 items, no [3]"),
        ("seed.x", "1", 6, "seed: is 7, so it has no 'x'"),
        ("a..b", "1", 2, "'a..b' is not a path; expected the form a.b[0].c"),
        ("", "1", 1, "an empty path"),
        ("camera.fov_deg", "[1, 2", 16, "camera.fov_deg[2]: not valid YAML: the list that began "
         "with '[' goes on; expected ',' and another value, or ']'"),
        ("camera.fov_deg", "!!float 1", 16,
         "camera.fov_deg: tag tag:yaml.org,2002:float is not allowed"),
        ("camera.fov_deg", ".nan", 16, "camera.fov_deg: .nan is not a finite number"),
    ],
)  # fmt: skip
def test_overrides_to_nowhere_say_so(
    document: Node, path: str, value: str, column: int, fact: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        with_override(document, path, value)
    assert str(caught.value) == told("--set", f"{path}={value}", (1, column, fact))


@pytest.mark.parametrize(
    ("path", "fact"),
    [("a.x", r"no item is named 'x'; expected an index such as \[0\]"),
     ("a." * 1000 + "a", "a path of more than 32 parts")],
    ids=["a list without names", "nesting without end, refused before any tree is built"],
)  # fmt: skip
def test_paths_that_cannot_be_followed_are_refused(path: str, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        with_override(parse_yaml("a: [1, 2]", "t.yaml"), path, "1")


@settings(max_examples=400, deadline=None, derandomize=True)
@given(st.text("ab.[]0123=seed\n\x00 ", max_size=20), st.text("a1[]{}:,&*! \n'\"", max_size=20))
def test_any_override_gives_a_tree_or_an_error(path: str, value: str) -> None:
    """Text from a shell may be anything."""
    try:
        outcome = type(with_override(parse_yaml(TEXT, "t.yaml"), path, value).plain()).__name__
    except ConfigError as error:
        outcome = str(error)
    assert outcome.startswith(("dict", "--set:"))
