"""Shared values: drawn once per scene, referred to anywhere, selecting dependent values."""

import re
import sys
from collections import Counter

import pytest

from gen_data.assemble.config import load_config
from gen_data.config.shared_values import draw_shared, probe_values, refers, resolve_shared
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import ConfigError
from gen_data.core.streams import Streams

SECTION = """
lanes: {switch: road, highway: 3, default: {uniform_integer: [1, 2]}}
road: {choice: {street: 3, highway: 1}}
density: {uniform: [0.1, 0.5]}
wet: {probability: 0.5}
"""


def test_values_follow_their_distributions_and_the_values_they_depend_on() -> None:
    """3 : 1 within four standard errors of a binomial count; lanes obey the road."""
    section = parse_yaml(SECTION, "test")
    draws = [draw_shared(section, Streams(7, scene)) for scene in range(1000)]
    highways = Counter(d["road"] for d in draws)["highway"]
    assert abs(highways - 250) < 4 * (1000 * 0.25 * 0.75) ** 0.5
    assert all(d["lanes"] == 3 for d in draws if d["road"] == "highway")
    assert {d["lanes"] for d in draws if d["road"] == "street"} == {1, 2}
    assert all(0.1 <= d["density"] <= 0.5 for d in draws)
    assert {d["wet"] for d in draws} == {True, False}


@pytest.mark.parametrize(
    ("text", "kind"),
    [("{choice: {1: 2, 2: 1}}", int), ("{choice: [0.5, 1]}", float),
     ("{choice: {a: 1, 2: 1}}", str), ("{choice: [true, false]}", bool),
     ("{probability: 0.5}", bool), ("{uniform_integer: [1, 3]}", int), ("{uniform: [1, 3]}", float),
     ("3", int), ("3.5", float), ("word", str)],
)  # fmt: skip
def test_a_value_is_of_the_kind_it_is_written_as(text: str, kind: type) -> None:
    """Whole numbers stay whole: they count lanes."""
    assert type(draw_shared(parse_yaml(f"x: {text}", "test"), Streams(0, 1))["x"]) is kind


def test_order_of_writing_moves_no_draw_and_no_probe() -> None:
    """Each value has a separate stream."""
    lines = SECTION.strip().splitlines()
    for order in (lines[::-1], [*lines[2:], *lines[:2]]):
        again = parse_yaml("\n".join(order), "test")
        assert draw_shared(again, Streams(7, 3)) == draw_shared(
            parse_yaml(SECTION, "test"), Streams(7, 3)
        )
    # A plan keeps its keys sorted, and must make the same samples again.
    one = parse_yaml("x: {choice: {wet: 3, dry: 1, 10: 2, 9: 1}}", "test")
    other = parse_yaml("x: {choice: {10: 2, 9: 1, dry: 1, wet: 3}}", "test")
    assert [draw_shared(one, Streams(5, k)) for k in range(50)] == [
        draw_shared(other, Streams(5, k)) for k in range(50)
    ]
    # Plans keep documents with sorted keys: the copy must be probed like the original.
    one = """
        road: {choice: {street: 5, avenue: 1, park: 1}}
        age: {choice: {old: 1, new: 1}}
        rails: {switch: road, street: {choice: {tram: 1, none: 40}}, default: {choice: [x, y, z]}}
        """
    other = """
        rails: {switch: road, default: {choice: [x, y, z]}, street: {choice: {none: 40, tram: 1}}}
        age: {choice: {new: 1, old: 1}}
        road: {choice: {park: 1, avenue: 1, street: 5}}
        """
    probes = [list(probe_values(parse_yaml(text, "test"), 3)) for text in (one, other)]
    assert probes[0] == probes[1]


def test_references_and_selections_are_replaced_wherever_they_stand() -> None:
    """In lists, in mappings, inside selections. Keys are read as YAML reads them."""
    text = """
    a: $shared.lanes
    b: [1, {switch: road, highway: [$shared.lanes, 9], default: none}]
    c: {uniform: [0, 1]}
    """
    node = parse_yaml(text, "test")
    assert refers(node)
    plain = resolve_shared(node, {"lanes": 3, "road": "highway"}).plain()
    assert plain == {"a": 3, "b": [1, [3, 9]], "c": {"uniform": [0, 1]}}
    assert resolve_shared(node, {"lanes": 1, "road": "street"}).plain()["b"] == [1, "none"]
    assert not refers(parse_yaml("c: {uniform: [0, 1]}", "test"))
    node = parse_yaml(
        "x: {switch: k, 1: one, 2: two}\ny: {switch: f, true: yes, false: no}", "test"
    )
    assert resolve_shared(node, {"k": 2, "f": True}).plain() == {"x": "two", "y": "yes"}


def test_probes_show_every_outcome_of_choices_within_selections_that_can_occur() -> None:
    """Two roads in a thousand have a track; parks have none, and there is no motorway."""
    section = parse_yaml(
        """
        road: {choice: {street: 500, avenue: 1, park: 1}}
        rails: {switch: bend, 0: {switch: road, avenue: {choice: {none: 1, track: 1}},
                motorway: {choice: {maglev: 1}}, default: none}, default: none}
        bend: {switch: road, street: {choice: [0, 1]}, park: 1, default: {choice: [0, 1]}}
        """,
        "test",
    )
    probes = list(probe_values(section, 0))
    assert {p["rails"] for p in probes} == {"none", "track"}
    assert all(p["road"] == "avenue" and p["bend"] == 0 for p in probes if p["rails"] == "track")


def test_a_misspelt_name_in_a_rare_selection_is_one_clear_error() -> None:
    """Not a traceback, though no scene but one that was searched for evaluates it."""
    text = """
        rails: {switch: width, broad: {switch: rod, a: {choice: [1, 2]}}, default: 0}
        width: {switch: road, avenue: {choice: {narrow: 50, broad: 1}}, default: narrow}
        road: {choice: {street: 500, avenue: 1}}
        """
    with pytest.raises(ConfigError, match="there is no shared value 'rod'; expected one of"):
        list(probe_values(parse_yaml(text, "test"), 0))


@pytest.mark.slow
def test_probes_of_the_street_show_every_outcome_of_a_thousand_scenes() -> None:
    """A category that few scenes have is one of the data set; only seeds have over 20 values."""
    section = load_config("street.yaml").document.entries["shared"]
    probes = list(probe_values(section, 0))
    drawn = [draw_shared(section, Streams(3, scene)) for scene in range(1000)]
    for name in section.entries:
        values = {repr(scene[name]) for scene in drawn}
        assert len(values) > 20 or values <= {repr(probe[name]) for probe in probes}, name


@pytest.mark.parametrize(
    ("text", "fact"),
    [("x: $shared.raod", "test:1:4: x: there is no shared value 'raod'; expected one of road"),
     ("x: {switch: road, bend: 1}", "test:1:4: x: no entry for road = 'street'")],
)  # fmt: skip
def test_a_reference_that_leads_nowhere_is_one_clear_error(text: str, fact: str) -> None:
    """Place, fact, and expected values; values that need one another are refused, too."""
    with pytest.raises(ConfigError, match=f"^{re.escape(fact)}"):
        resolve_shared(parse_yaml(text, "test"), {"road": "street"})
    with pytest.raises(ConfigError, match="need one another"):
        draw_shared(parse_yaml("a: $shared.b\nb: $shared.a", "test"), Streams(0, 0))


def test_a_chain_of_selections_costs_in_proportion_to_its_length() -> None:
    """Calls of functions are counted, of twice as many values."""

    def calls(length: int) -> int:
        links = [f"  v{k}: {{switch: v{k - 1}, a: a, b: b}}" for k in range(1, length)]
        section = parse_yaml("\n".join(["s:", "  v0: {choice: [a, b]}", *links]), "x").entries["s"]
        counted = 0

        def count(frame: object, event: str, argument: object) -> None:
            del frame, argument
            nonlocal counted
            counted += event in ("call", "c_call")

        sys.setprofile(count)
        try:
            drawn = draw_shared(section, Streams(0, 0))
        finally:
            sys.setprofile(None)
        assert (len(drawn), len(set(drawn.values()))) == (length, 1)
        return counted

    # Quadratic cost would be a factor of 4; collections of garbage add some calls.
    assert calls(1600) < 3 * calls(800)
