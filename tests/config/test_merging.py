"""Parts of a document that merge with overrides, and parts that are replaced."""

from typing import Any

import pytest

from gen_data.config.merging import merge_named, merge_nodes
from gen_data.config.yaml_tree import parse_yaml

MERGED: dict[str, tuple[str, str, Any]] = {
    "mappings key by key at every depth, lists and scalars as a whole": (
        "{a: {x: 1, y: [1, 2]}, b: 1, c: {z: 1}}", "{a: {y: [3], w: 4}, b: {v: 5}, d: 6}",
        {"a": {"x": 1, "y": [3], "w": 4}, "b": {"v": 5}, "c": {"z": 1}, "d": 6}),
    "a distribution is replaced by another as a whole": (
        "{r: {uniform: [0, 1]}, s: {uniform: [0, 1]}, t: 1}",
        "{r: {normal: {mean: 0, stddev: 1}}, t: {choice: [1, 2]}}",
        {"r": {"normal": {"mean": 0, "stddev": 1}}, "s": {"uniform": [0, 1]},
         "t": {"choice": [1, 2]}}),
    "a share of the image takes the place of the distance": (
        "{distance_m: 1, jitter_m: 0, roll_deg: 3}", "{fills: 0.4}",
        {"roll_deg": 3, "fills": 0.4}),
    "a distance takes the place of the share of the image": (
        "{fills: 0.5, off_center: 0, roll_deg: 3}", "{distance_m: 2}",
        {"roll_deg": 3, "distance_m": 2}),
    "who names ids does not want the inherited tags": (
        "assets: {tags: [tree], prefer: [pack]}", "assets: {ids: [oak]}",
        {"assets": {"ids": ["oak"], "prefer": ["pack"]}}),
    "nor ids who names tags": (
        "assets: {ids: [oak]}", "assets: {tags: [tree]}", {"assets": {"tags": ["tree"]}}),
    "exclusions join": (
        "assets: {any_of: [car, van]}", "assets: {exclude: [van]}",
        {"assets": {"any_of": ["car", "van"], "exclude": ["van"]}}),
    "tags replace an asset": (
        "assets: {asset: car, lane: a}", "assets: {tags: [van]}",
        {"assets": {"tags": ["van"], "lane": "a"}}),
    "tags and ids may be given together": (
        "assets: {tags: [car]}", "assets: {tags: [van], ids: [bus]}",
        {"assets": {"tags": ["van"], "ids": ["bus"]}}),
    "another type inherits nothing": (
        "it: {type: a, x: 1}", "it: {type: b, y: 2}", {"it": {"type": "b", "y": 2}}),
    "the same type inherits": (
        "it: {type: a, x: 1}", "it: {type: a, y: 2}", {"it": {"type": "a", "x": 1, "y": 2}}),
    "coefficients of one lens mean nothing to another": (
        "it: {model: pinhole, x: 1}", "it: {model: fisheye}", {"it": {"model": "fisheye"}}),
    "a sensor of another model keeps its mount": (
        "it: {type: lidar, model: VLP-16, rig: ego}", "it: {model: HDL-64E}",
        {"it": {"type": "lidar", "model": "HDL-64E", "rig": "ego"}}),
    "entries of selections by different shared values have nothing in common": (
        "x: {switch: style, old: 1, new: 2}", "x: {switch: traffic, light: 3, default: 4}",
        {"x": {"switch": "traffic", "light": 3, "default": 4}}),
}  # fmt: skip
"""Base, override, and the result."""


@pytest.mark.parametrize(("base", "override", "merged"), MERGED.values(), ids=list(MERGED))
def test_documents_merge(base: str, override: str, merged: dict[str, object]) -> None:
    """The arguments stay as they are."""
    below, above = parse_yaml(base, "base.yaml"), parse_yaml(override, "over.yaml")
    assert merge_nodes(below, above).plain() == merged
    assert below.plain() == parse_yaml(base, "base.yaml").plain()
    assert above.plain() == parse_yaml(override, "over.yaml").plain()


def test_merged_values_keep_the_place_they_came_from() -> None:
    """Messages point into the file in which the value stands."""
    merged = merge_nodes(
        parse_yaml("a: {x: 1, y: 2}", "base.yaml"), parse_yaml("a: {y: 3}", "over.yaml")
    )
    x, y, a = merged.get("a", "x"), merged.get("a", "y"), merged.get("a")
    assert x is not None and y is not None and a is not None
    assert (str(x.position), str(y.position)) == ("base.yaml:1:8", "over.yaml:1:8")
    assert (a.key_position("x").file, a.key_position("y").file) == ("base.yaml", "over.yaml")


TWO = "l: [{type: t, name: a, x: 1}, {type: t, name: b}]"
A, B = {"type": "t", "name": "a", "x": 1}, {"type": "t", "name": "b"}
C, D = {"name": "c"}, {"name": "d"}


@pytest.mark.parametrize(
    ("base", "override", "merged"),
    [(TWO, "l: [{name: b, y: 2}, {name: a, x: 3}]", [A | {"x": 3}, B | {"y": 2}]),
     (TWO, "l: [{name: c}, {name: b}, {name: d}]", [A, C, B, D]),
     (TWO, "l: [{type: u, name: a}]", [{"type": "u", "name": "a"}, B]),
     (TWO, "l: [{name: c}, {name: c}, {name: d}]", [A, B, C, C, D]),
     ("l: [{type: coco}, poses, {type: lanes, far_m: 80}]",
      "l: [lanes, {type: coco, x: 1}, poses]", [{"type": "coco", "x": 1}, "poses", "lanes"])],
    ids=["items of one name keep their place", "new ones come last or before the one that follows",
         "one of another type inherits the place and no field",
         "a new one listed twice stays twice, to be refused with its place",
         "items without a name are told apart by their type"],
)  # fmt: skip
def test_items_of_lists_merge_by_name(base: str, override: str, merged: list[object]) -> None:
    """Randomizers run in the order of the list."""
    below, above = parse_yaml(base, "base").get("l"), parse_yaml(override, "over").get("l")
    assert below is not None and above is not None
    assert merge_named(below, above).plain() == merged
