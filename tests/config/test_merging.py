"""Which parts of a document merge with what is laid over them, and which are replaced."""

import pytest

from gen_data.config.merging import merge_named, merge_nodes
from gen_data.config.yaml_tree import parse_yaml


def test_merging_lays_mappings_over_each_other() -> None:
    """Key by key, at every depth; lists and scalars are replaced as a whole."""
    base = parse_yaml("{a: {x: 1, y: [1, 2]}, b: 1, c: {z: 1}}", "base.yaml")
    override = parse_yaml("{a: {y: [3], w: 4}, b: {v: 5}, d: 6}", "over.yaml")

    merged = merge_nodes(base, override)

    assert merged.plain() == {"a": {"x": 1, "y": [3], "w": 4}, "b": {"v": 5}, "c": {"z": 1}, "d": 6}


def test_merged_values_keep_the_place_they_came_from() -> None:
    """Messages point into the file in which the value stands."""
    merged = merge_nodes(
        parse_yaml("a: {x: 1, y: 2}", "base.yaml"), parse_yaml("a: {y: 3}", "over.yaml")
    )
    x, y, a = merged.get("a", "x"), merged.get("a", "y"), merged.get("a")

    assert x is not None
    assert y is not None
    assert a is not None
    assert (str(x.position), str(y.position)) == ("base.yaml:1:8", "over.yaml:1:8")
    assert (a.key_position("x").file, a.key_position("y").file) == ("base.yaml", "over.yaml")


def test_merging_replaces_a_distribution_by_another_as_a_whole() -> None:
    """Two distributions must not end up in one mapping."""
    base = parse_yaml("{r: {uniform: [0, 1]}, s: {uniform: [0, 1]}, t: 1}", "base.yaml")
    override = parse_yaml("{r: {normal: {mean: 0, stddev: 1}}, t: {choice: [1, 2]}}", "over.yaml")

    assert merge_nodes(base, override).plain() == {
        "r": {"normal": {"mean": 0, "stddev": 1}},
        "s": {"uniform": [0, 1]},
        "t": {"choice": [1, 2]},
    }


def test_share_of_the_image_and_distance_take_each_others_place() -> None:
    """A camera has one of both; everything else is inherited."""
    near = parse_yaml("{distance_m: 1, jitter_m: 0, roll_deg: 3}", "base.yaml")
    close = parse_yaml("{fills: 0.5, off_center: 0, roll_deg: 3}", "close.yaml")

    framed = merge_nodes(near, parse_yaml("{fills: 0.4}", "over.yaml"))
    placed = merge_nodes(close, parse_yaml("{distance_m: 2}", "over.yaml"))

    assert framed.plain() == {"roll_deg": 3, "fills": 0.4}
    assert placed.plain() == {"roll_deg": 3, "distance_m": 2}


def test_merging_leaves_its_arguments_alone() -> None:
    base, override = parse_yaml("a: {x: 1}", "b.yaml"), parse_yaml("a: {y: 2}", "o.yaml")

    merge_nodes(base, override)

    assert base.plain() == {"a": {"x": 1}}
    assert override.plain() == {"a": {"y": 2}}


@pytest.mark.parametrize(
    ("base", "override", "merged"),
    [
        ("{tags: [tree], prefer: [pack]}", "{ids: [oak]}", {"ids": ["oak"], "prefer": ["pack"]}),
        ("{ids: [oak]}", "{tags: [tree]}", {"tags": ["tree"]}),
        (
            "{any_of: [car, van]}",
            "{exclude: [van]}",
            {"any_of": ["car", "van"], "exclude": ["van"]},
        ),
        ("{asset: car, lane: a}", "{tags: [van]}", {"tags": ["van"], "lane": "a"}),
        ("{tags: [car]}", "{tags: [van], ids: [bus]}", {"tags": ["van"], "ids": ["bus"]}),
    ],
)
def test_assets_are_chosen_one_way(base: str, override: str, merged: dict[str, object]) -> None:
    """Tags and ids are alternatives: who names ids does not want the inherited tags besides."""
    result = merge_nodes(
        parse_yaml(f"assets: {base}", "base"), parse_yaml(f"assets: {override}", "over")
    )

    assert result.plain() == {"assets": merged}


@pytest.mark.parametrize(
    ("base", "override", "merged"),
    [
        ("{type: a, x: 1}", "{type: b, y: 2}", {"type": "b", "y": 2}),
        ("{type: a, x: 1}", "{type: a, y: 2}", {"type": "a", "x": 1, "y": 2}),
        ("{model: pinhole, x: 1}", "{model: fisheye}", {"model": "fisheye"}),
        (
            "{type: lidar, model: VLP-16, rig: ego}",
            "{model: HDL-64E}",
            {"type": "lidar", "model": "HDL-64E", "rig": "ego"},
        ),
    ],
)
def test_another_kind_inherits_nothing(base: str, override: str, merged: dict[str, object]) -> None:
    """The coefficients of one lens mean nothing to another; a sensor keeps its mount."""
    result = merge_nodes(parse_yaml(f"it: {base}", "base"), parse_yaml(f"it: {override}", "over"))

    assert result.plain() == {"it": merged}


def test_a_selection_is_replaced_as_a_whole() -> None:
    """Entries of two selections by different shared values have nothing in common."""
    base = parse_yaml("x: {switch: style, old: 1, new: 2}", "base")
    override = parse_yaml("x: {switch: traffic, light: 3, default: 4}", "over")

    assert merge_nodes(base, override).plain() == override.plain()


def listed(text: str) -> list[object]:
    """Plain items of a list merged with ``[{type: t, name: a, x: 1}, {type: t, name: b}]``."""
    base = parse_yaml("l: [{type: t, name: a, x: 1}, {type: t, name: b}]", "base").get("l")
    override = parse_yaml(f"l: {text}", "over").get("l")
    assert base is not None
    assert override is not None
    plain: list[object] = merge_named(base, override).plain()
    return plain


def test_items_of_one_name_merge_and_keep_their_place() -> None:
    """Only the fields that are given change."""
    assert listed("[{name: b, y: 2}, {name: a, x: 3}]") == [
        {"type": "t", "name": "a", "x": 3},
        {"type": "t", "name": "b", "y": 2},
    ]


def test_new_items_come_last_or_before_the_inherited_one_that_follows_them() -> None:
    """The order in which randomizers run is that of the list."""
    names = [item["name"] for item in listed("[{name: c}, {name: b}, {name: d}]")]  # type: ignore[index]

    assert names == ["a", "c", "b", "d"]


def test_items_without_a_name_are_told_apart_by_their_type() -> None:
    """Exporters have no names; an annotation may be its type alone."""
    base = parse_yaml("l: [{type: coco}, poses, {type: lanes, far_m: 80}]", "base").get("l")
    override = parse_yaml("l: [lanes, {type: coco, x: 1}, poses]", "over").get("l")
    assert base is not None
    assert override is not None

    assert merge_named(base, override).plain() == [{"type": "coco", "x": 1}, "poses", "lanes"]


def test_an_item_of_another_type_takes_the_place_of_one_of_its_name() -> None:
    """It inherits the place, and no field."""
    assert listed("[{type: u, name: a}]")[0] == {"type": "u", "name": "a"}


def test_a_new_item_that_is_listed_twice_is_kept_twice() -> None:
    """So that it is refused with its place, as in a list that inherits nothing."""
    names = [item["name"] for item in listed("[{name: c}, {name: c}, {name: d}]")]  # type: ignore[index]

    assert names == ["a", "b", "c", "c", "d"]
