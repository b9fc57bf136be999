"""Label maps: which objects an export has, and under which names."""

import json
from collections import Counter
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import ValidationError

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.errors import ConfigError, ConfigWarning
from gen_data.core.scene import Scene
from gen_data.core.serialization import canonical_json
from gen_data.exporters.coco import Coco
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.label_map import AppliedLabelMap, LabelMap, MappedExporter, public_classes

CITYSCAPES_THINGS = ["person", "rider", "car", "truck", "bus", "train", "motorcycle", "bicycle"]
"""Classes with instances, in the order of their ids: Cordts et al., CVPR 2016, table 1."""


def truths(world: Any, label_map: LabelMap, *, renames: bool = True) -> list[Any]:
    applied = AppliedLabelMap(label_map, world.info(7), renames)
    mapped = [applied.map_sample(sample) for sample in world.samples]
    return [thing for s in mapped for image in s.truth.values() for thing in image.objects]


def categories(world: Any) -> Counter[str]:
    return Counter(t.instance.category for t in truths(world, LabelMap()))


def parse(text: str) -> LabelMap:
    return LabelMap.model_validate_json(text)


def test_classes_are_of_one_or_several_categories(world: Any) -> None:
    """With the ids of their order; everything else is left out."""
    first, second, *_ = sorted(categories(world))
    label_map = parse(json.dumps({"classes": {"b": second, "a": [first]}}))
    applied = AppliedLabelMap(label_map, world.info(7))
    things = truths(world, label_map)
    assert applied.info.categories == ("b", "a")
    assert {(t.instance.category, t.instance.category_id) for t in things} == {("b", 1), ("a", 2)}
    assert len(things) == categories(world)[first] + categories(world)[second]
    # And a class without categories takes the category of its name.
    merged = parse(json.dumps({"classes": {"all": [first, second]}}))
    own = parse(json.dumps({"classes": {first: None}}))
    counts = categories(world)
    assert len(truths(world, merged)) == counts[first] + counts[second]
    assert len(truths(world, own)) == counts[first]


def test_the_order_of_classes_is_part_of_a_configuration_and_survives_sorted_keys(
    tmp_path: Path,
) -> None:
    """Plans have sorted keys; class ids follow the order."""
    text = "extends: tabletop.yaml\nlabels: {map: {classes: {cup: , bottle: [bottle, jar]}}}\n"
    (tmp_path / "map.yaml").write_text(text)
    config = load_config(str(tmp_path / "map.yaml"))
    kept = canonical_json(config.resolved)
    (tmp_path / "kept.yaml").write_text(kept)
    again = load_config(str(tmp_path / "kept.yaml"))
    assert canonical_json(again.resolved) == kept
    for one in (config, again):
        classes = one.general.labels.map.classes_of
        assert [*classes.items()] == [("cup", ("cup",)), ("bottle", ("bottle", "jar"))]
    turned = text.replace("cup: , bottle: [bottle, jar]", "bottle: [bottle, jar], cup: ")
    (tmp_path / "map.yaml").write_text(turned)
    assert canonical_json(load_config(str(tmp_path / "map.yaml")).resolved) != kept


@pytest.mark.parametrize(
    ("classes", "message"),
    [([{"cup": None}, {"cup": []}], "a class is listed twice"),
     ([{"cup": None, "mug": None}], "one class"), (["cup"], "one class")],
)  # fmt: skip
def test_listed_classes_are_of_one_name_each(classes: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        parse(json.dumps({"classes": classes}))


def test_other_and_ignored_categories_and_those_below_limits_can_stay_ignored(world: Any) -> None:
    """An object that misses one of them is dropped, or ignored."""
    first, second, *_ = sorted(categories(world))
    others = parse(json.dumps({"classes": {first: None}, "others": "ignore"}))
    ignored = parse(json.dumps({"ignore": [second]}))
    for label_map in (others, ignored):
        things = truths(world, label_map)
        assert len(things) == categories(world).total()
        is_ignored = {t.instance.category for t in things if t.ignored}
        assert second in is_ignored
        assert first not in is_ignored
    every = truths(world, LabelMap())
    for limits, missed in (
        ({"min_box_px": 12}, [min(t.box.width_px, t.box.height_px) < 12 for t in every if t.box]),
        ({"min_visible_fraction": 0.6}, [t.visible_fraction < 0.6 for t in every if t.box]),
        ({"max_truncation": 0.05}, [t.truncation > 0.05 for t in every if t.box]),
    ):
        assert any(missed), limits
        dropped = [t for t in truths(world, LabelMap(**limits)) if t.box]
        ignored = [t for t in truths(world, LabelMap(**limits, below="ignore")) if t.box]
        assert len(dropped) == missed.count(False)
        assert [t.ignored for t in ignored] == missed


def test_subcategories_go_before_their_category(world: Any) -> None:
    """Halves of apples are left out, ignored or a class; whole ones follow the category."""
    image = max((i for s in world.samples for i in s.truth.values()), key=lambda i: len(i.objects))
    kinds = ("half", "round", "half", "")
    objects = tuple(
        replace(thing, instance=replace(thing.instance, category="apple", subcategory=kind))
        for thing, kind in zip(image.objects, kinds, strict=False)
    )
    info = replace(world.info(7), categories=("apple",))

    def mapped(label_map: LabelMap) -> list[Any]:
        return [
            *AppliedLabelMap(label_map, info).map_image(replace(image, objects=objects)).objects
        ]

    classes = {"classes": {"whole": "apple", "cut": "apple/half"}}
    assert len(objects) == 4
    assert [t.instance.subcategory for t in mapped(LabelMap(drop=("apple/half",)))] == ["round", ""]
    assert [t.ignored for t in mapped(LabelMap(ignore=("apple/half",)))] == [1, 0, 1, 0]
    assert [t.instance.category for t in mapped(parse(json.dumps(classes)))] == [
        "cut", "whole", "cut", "whole",
    ]  # fmt: skip
    assert [t.instance.category_id for t in mapped(parse(json.dumps(classes)))] == [2, 1, 2, 1]
    only = mapped(parse('{"classes": {"cut": ["apple/half"]}}'))
    assert [t.instance.subcategory for t in only] == ["half", "half"]
    scene = Scene("test", instances=tuple(thing.instance for thing in objects))
    kept = AppliedLabelMap(LabelMap(drop=("apple/half",)), info).map_scene(scene).instances
    assert [i.annotated for i in kept] == [False, True, False, True]


TWICE = "'mug' belongs to the classes 'a' and 'b'"
PRINTABLE = "expected a name of 1 to 60 printable characters"


@pytest.mark.parametrize(
    ("fields", "message"),
    [({"classes": {"cut": ["apple/half"]}, "drop": ["apple/half"]},
      "'apple/half' is dropped and belongs to the class"),
     ({"classes": {"a": "mug", "b": ["mug"]}}, TWICE),
     ({"classes": {"a": "mug"}, "ignore": ["mug"]}, "'mug' is ignored and belongs to the class"),
     *(({"classes": {name: ["mug"]}}, PRINTABLE) for name in ["", " ", "a\nb", "\0", "x" * 61])],
)  # fmt: skip
def test_two_fates_and_names_that_do_not_print_are_refused(fields: Any, message: str) -> None:
    """Formats write names of classes into lines of text."""
    with pytest.raises(ValidationError, match=message):
        parse(json.dumps(fields))


def test_kitti_keeps_names_and_ignored_ones_are_dont_cares(world: Any, tmp_path: Path) -> None:
    """Types follow the categories, objects of other categories have no row."""
    first, *_ = sorted(categories(world))
    label_map = parse(json.dumps({"classes": {"thing": [first]}}))
    info = world.info(7, lidars=("top",))
    plain = world.export(Kitti(), info, world.samples, tmp_path / "a")
    folder = world.export(MappedExporter(Kitti(), label_map), info, world.samples, tmp_path / "b")

    def rows(folder: Path) -> Counter[str]:
        texts = (p.read_text() for p in folder.glob("training/label_2/*.txt"))
        return Counter(line.split()[0] for text in texts for line in text.splitlines())

    del rows(plain)["DontCare"]
    assert set(rows(folder)) - {"DontCare"} < set(rows(plain))
    assert "thing" not in rows(folder)
    ignore_all = LabelMap(ignore=tuple(categories(world)))
    folder = world.export(
        MappedExporter(Kitti(), ignore_all), info, world.samples, tmp_path / "mapped"
    )
    lines = "".join(p.read_text() for p in folder.glob("training/label_2/*.txt")).splitlines()
    assert lines
    assert all(line.startswith("DontCare -1 -1 -10 ") for line in lines)


def test_images_of_category_ids_are_left_out_if_classes_differ(world: Any, tmp_path: Path) -> None:
    """Their pixels hold the ids of the data set."""
    first, *_ = sorted(categories(world))
    label_map = parse(json.dumps({"classes": {first: None}}))
    exporter = MappedExporter(Coco(), label_map)
    folder = world.export(exporter, world.info(7), world.samples, tmp_path)
    data = json.loads((folder / "annotations/instances_train.json").read_text())
    assert [c["name"] for c in data["categories"]] == [first]
    assert all("category" not in image["files"] for image in data["images"])
    assert not (folder / "category").exists()


def test_public_lists_have_the_published_classes_and_others_may_be_empty() -> None:
    """COCO's number and ends; Cityscapes' order; nuScenes' ten."""
    coco = list(public_classes("coco80"))
    assert (len(coco), coco[0], coco[-1]) == (80, "person", "toothbrush")
    assert coco[39:47] == [
        "bottle", "wine glass", "cup", "fork", "knife", "spoon", "bowl", "banana",
    ]  # fmt: skip
    assert list(public_classes("cityscapes")) == CITYSCAPES_THINGS
    assert (len(public_classes("nuscenes")), len(public_classes("kitti"))) == (10, 8)
    nyu, ade = list(public_classes("nyu40")), list(public_classes("ade20k"))
    assert (len(nyu), nyu[0], nyu[21], nyu[-1]) == (40, "wall", "ceiling", "otherprop")
    assert (len(ade), ade[0], ade[5], ade[-1]) == (150, "wall", "ceiling", "flag")
    # A map may serve several data sets.
    with pytest.raises(ConfigError) as caught:
        parse('{"classes": {"bottel": null, "mugg": null, "mug": null}}').check(["bottle", "mug"])
    assert [line.split(":")[0] for line in str(caught.value).splitlines()] == [
        "labels.map.classes.bottel",
        "labels.map.classes.mugg",
    ]
    label_map = parse('{"classes": {"bottle": [], "mug": null}}')
    label_map.check(["mug"])
    assert list(label_map.classes_of) == ["bottle", "mug"]


@pytest.mark.parametrize("name", ["nyu40", "ade20k"])
def test_every_category_of_rooms_has_a_class_or_is_listed_without_one(name: Any) -> None:
    """No pixel of a room loses its class unseen."""
    text = files("gen_data.exporters").joinpath("label_maps.yaml").read_text("utf-8")
    without = yaml.safe_load(text)["without_class"][name]
    mapped = {c for own in LabelMap(classes=name).classes_of.values() for c in own}
    rooms = PipelineFactory(load_config("indoor_rgbd.yaml"), n=1).categories
    assert set(rooms) - mapped == set(without)
    assert {"wall", "floor", "ceiling", "window", "door"} <= mapped & set(rooms)


def test_categories_that_the_data_set_lacks_are_named(world: Any) -> None:
    """One of several: a warning with the nearest name. All of them: an error."""
    first, *_ = sorted(categories(world))
    known = world.info(7).categories
    with pytest.warns(ConfigWarning, match=f"no category '{first}x' .did you mean '{first}'"):
        parse(json.dumps({"classes": {"a": [first, first + "x"]}})).check(known)
    with pytest.raises(ConfigError, match="no object of the data set can be 'unheard'; expected"):
        parse('{"classes": {"a": ["unheard"]}}').check(known)


@pytest.mark.parametrize(
    ("classes", "fault"),
    [({"bottel": None, "mug": None}, "bottel: no object .* 'bottel' .did you mean 'bottle'"),
     ({"Mug": None, "bottle": None}, "Mug: no object .* 'Mug' .did you mean 'mug'"),
     ({"cup": ["MUG", "Botle"]}, "cup: no object .* 'MUG', 'Botle' .did you mean 'mug'"),
     ({"qqq": None, "mug": None}, r"qqq: .* 'qqq'; expected some of bottle, mug; or \[\] for")],
)  # fmt: skip
def test_a_class_that_no_object_can_have_is_refused(classes: Any, fault: str) -> None:
    """Misspelt, in other letters, or unknown; also if other classes have objects."""
    with pytest.raises(ConfigError, match=f"labels.map.classes.{fault}"):
        parse(json.dumps({"classes": classes})).check(["bottle", "mug"])
