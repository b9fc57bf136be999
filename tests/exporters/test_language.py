"""Vision-language labels as their readers see them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.sample import Relation, Sample
from gen_data.exporters.coco import Coco
from gen_data.exporters.label_map import AppliedLabelMap, LabelMap
from gen_data.exporters.language import LanguageJsonl
from tests.exporters.label_readers import json_lines


@pytest.fixture
def samples(world: Any) -> list[Sample]:
    first, *others = world.samples
    a, b, *_ = (t.instance.instance_id for t in first.truth["color"].objects)
    related = (Relation(a, "left_of", b), Relation(b, "near", a))
    truth = {"color": replace(first.truth["color"], relations=related)}
    return [replace(first, truth=truth), *others]


def test_lines_refer_to_their_objects_and_are_every_utterance_in_order(
    world: Any, samples: list[Sample], tmp_path: Path
) -> None:
    """Ids are unique, and every file is there. After a caption of the whole scene."""
    folder = world.export(LanguageJsonl(), world.info(7), samples, tmp_path)
    rows = json_lines(folder / "train.jsonl")
    images = {image["image_id"]: image for image in json_lines(folder / "train_images.jsonl")}
    assert len({row["id"] for row in rows}) == len(rows)
    assert {row["kind"] for row in rows} >= {"scene_caption", "caption", "counting", "distance"}
    for row in rows:
        image = images[row["image_id"]]
        known = {thing["object_id"] for thing in image["objects"]}
        (sample,) = (s for s in samples if s.image_id("color") == image["image_id"])
        for thing in image["objects"]:
            assert thing["annotation_id"] == sample.annotation_id("color", thing["object_id"])
        assert set(row["object_ids"]) <= known
        assert row["file_name"] == image["file_name"]
        assert (folder / row["file_name"]).exists()
    assert_said(folder, samples)


def assert_said(folder: Path, samples: list[Sample]) -> None:
    """The lines are the utterances of the annotation in order, after a caption of each scene."""
    train = [s for s in samples if s.split == "train"]
    said = [u for s in train for u in s.truth["color"].utterances or ()]
    rows = [row for row in json_lines(folder / "train.jsonl") if row["kind"] != "scene_caption"]
    assert [(r["kind"], r["text"], r["answer"], tuple(r["object_ids"])) for r in rows] == [
        (u.kind, u.text, u.answer, u.instances) for u in said
    ]
    assert said


def test_relations_have_both_directions(world: Any, samples: list[Sample], tmp_path: Path) -> None:
    """Left has right as its inverse, and near itself."""
    folder = world.export(LanguageJsonl(), world.info(7), samples, tmp_path / "language")
    coco = world.export(Coco(), world.info(7), samples, tmp_path / "coco")
    first = json_lines(folder / "train_images.jsonl")[0]
    truth = json.loads((coco / "annotations/instances_train.json").read_text("utf-8"))
    image = next(i for i in truth["images"] if i["sample"] == 0)
    a, b, *_ = (t.instance.instance_id for t in samples[0].truth["color"].objects)
    expected = {(a, "left_of", b), (b, "right_of", a), (a, "near", b), (b, "near", a)}
    assert {(r["subject_id"], r["predicate"], r["object_id"]) for r in first["relationships"]} == (
        expected
    )
    assert {tuple(triple) for triple in image["relationships"]} == expected
    assert "relationships" not in json_lines(folder / "train_images.jsonl")[1]


def test_label_maps_drop_relations_and_text_too(world: Any, samples: list[Sample]) -> None:
    """Texts that are left name only objects that are left, and are the same as before."""
    first = samples[0].truth["color"]
    dropped = first.objects[0].instance.category
    kept = {t.instance.category for t in first.objects} - {dropped}
    mapping = LabelMap(classes={name: (name,) for name in kept}, others="drop")
    mapped = AppliedLabelMap(mapping, world.info(7)).map_image(first)
    gone = {t.instance.instance_id for t in first.objects if t.instance.category == dropped}
    assert gone
    assert mapped.relations == ()
    assert mapped.utterances == tuple(
        u for u in first.utterances or () if not gone & set(u.instances)
    )
    assert 0 < len(mapped.utterances or ()) < len(first.utterances or ())
