"""COCO panoptic export, held against the instances of ``coco`` and the definition of PQ."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.exporters.coco_panoptic import CocoPanoptic
from gen_data.exporters.label_map import LabelMap, MappedExporter
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import pixels, segments_of


def scenery(world: Any, category: str = "tree") -> Any:
    """A tree and a hood, neither annotated, behind and next to an annotated crate."""
    tree = replace(world.instance(5, "crate", 12.0, 1.0, 0.2), annotated=False)
    hood = replace(world.instance(6, "car", 9.0, -3.0, 0.0), annotated=False)
    things = (
        world.instance(1, "crate", 8.0, 1.6, 0.4), world.instance(2, "pedestrian", 9.0, -2.0, 1.0),
        replace(tree, category=category, category_id=0), replace(hood, category_id=0),
    )  # fmt: skip
    return world.sample(7, things, [world.camera()])


def with_scenery(world: Any) -> tuple[Any, list[Any]]:
    """The street and a frame with scenery; the depth of 16-bit images reaches the sky."""
    return world.info(8, depth_scale_m=1 / 256), [*world.samples, scenery(world)]


dataset = made_of(CocoPanoptic(), with_scenery)


def read(folder: Path, split: str = "train") -> Any:
    return json.loads((folder / f"annotations/panoptic_{split}.json").read_text())


def problems(folder: Path) -> list[str]:
    truth, found = read(folder), []
    isthing = {c["id"]: c["isthing"] for c in truth["categories"]}
    if [a["image_id"] for a in truth["annotations"]] != [i["id"] for i in truth["images"]]:
        found.append("images and annotations differ")
    for annotation in truth["annotations"]:
        path = folder / "annotations/panoptic_train" / annotation["file_name"]
        if not path.exists():
            found.append("no id image")
            continue
        ids = segments_of(path)
        listed = {s["id"]: s for s in annotation["segments_info"]}
        if {0, *listed} != {0, *np.unique(ids).tolist()} or 0 in listed:
            found.append("ids differ")
        stuff = [s["category_id"] for s in listed.values() if not isthing[s["category_id"]]]
        if len(stuff) != len(set(stuff)):
            found.append("stuff in two segments")
        for number, segment in listed.items():
            mask = ids == number
            y, x = np.nonzero(mask)
            if segment["area"] != mask.sum():
                found.append("area")
            elif segment["bbox"] != [x.min(), y.min(), np.ptp(x) + 1, np.ptp(y) + 1]:
                found.append("box")
    return found


def panoptic_quality(folder: Path, predicted: Callable[[NDArray[Any]], NDArray[Any]]) -> float:
    """PQ of changed id images (Kirillov et al. 2019, equation 1): mean over categories.

    Segments match if they have the category and an IoU above 0.5; void counts for neither.
    """
    truth = read(folder)
    scores: dict[int, list[float]] = {}
    for annotation in truth["annotations"]:
        ids = segments_of(folder / "annotations/panoptic_train" / annotation["file_name"])
        guess = np.where(ids > 0, predicted(ids), 0)
        for segment in annotation["segments_info"]:
            number, row = segment["id"], scores.setdefault(segment["category_id"], [0, 0])
            union = ((ids == number) | (guess == number)).sum()
            overlap = ((ids == number) & (guess == number)).sum() / union
            row[0] += overlap if overlap > 0.5 else 0
            row[1] += 1 if overlap > 0.5 else 0.5 + 0.5 * bool((guess == number).any())
    return float(np.mean([iou / count for iou, count in scores.values()]))


def test_it_scores_one_with_scenery_as_stuff_and_unannotated_cars_as_void(dataset: Path) -> None:
    """The ground truth as prediction has PQ 1; shifted by some pixels it has not."""
    assert problems(dataset) == []
    assert panoptic_quality(dataset, lambda ids: ids) == 1.0
    assert panoptic_quality(dataset, lambda ids: np.roll(ids, 4, axis=1)) < 0.9
    # Names of stuff that occurs come last; a hood is neither instance nor background.
    truth = read(dataset)
    names = {c["id"]: (c["name"], c["isthing"]) for c in truth["categories"]}
    assert list(names.values()) == [
        ("car", 1), ("crate", 1), ("pedestrian", 1), ("sky", 0), ("tree", 0),
    ]  # fmt: skip
    assert list(names)[:3] == [1, 2, 3]
    numbers = {name: number for number, (name, _) in names.items()}
    (annotation,) = (a for a in truth["annotations"] if a["file_name"] == "000000007_color.png")
    shown = [names[s["category_id"]][0] for s in annotation["segments_info"]]
    assert shown == ["crate", "pedestrian", "sky", "tree"]
    ids = segments_of(dataset / "annotations/panoptic_train/000000007_color.png")
    instances = pixels(dataset.parent / "shards/000002/color/instance/000000007.png")
    assert (instances == 6).any()
    assert (ids[instances == 6] == 0).all()
    (tree,) = (s for s in annotation["segments_info"] if s["category_id"] == numbers["tree"])
    np.testing.assert_array_equal(ids == tree["id"], instances == 5)
    # The level camera has it in its upper half, behind everything.
    for annotation in truth["annotations"]:
        (sky,) = (s for s in annotation["segments_info"] if s["category_id"] == numbers["sky"])
        _, top, _, height = sky["bbox"]
        assert (top, height) == (0, 60)


def test_stuff_has_the_same_ids_in_a_training_and_a_test_set_with_other_scenery(
    world: Any, tmp_path: Path
) -> None:
    """Panopticapi and detectron2 match categories by id; own assets take no other's number."""
    found = []
    for k, kinds in enumerate((("tree",), ("bench", "tree"), ("my own", "aaa", "bin"))):
        samples = [replace(scenery(world, kind), index=i) for i, kind in enumerate(kinds)]
        info = world.info(len(samples), depth_scale_m=1 / 256)
        folder = world.export(CocoPanoptic(), info, samples, tmp_path / str(k))
        found.append({c["name"]: c["id"] for c in read(folder)["categories"]})
        assert len(set(found[k].values())) == len(found[k])
    first, second, third = found
    assert first.items() < second.items()
    assert {n: first[n] for n in ("car", "sky")} == {n: third[n] for n in ("car", "sky")}
    # In the order of names, then own assets.
    assert second["bench"] < third["bin"] < second["sky"] < second["tree"] < third["aaa"]
    assert third["my own"] == third["aaa"] + 1


@pytest.mark.parametrize("fate", ["", "drop", "ignore"])
def test_ignored_and_dropped_objects_are_void(world: Any, tmp_path: Path, fate: Any) -> None:
    """Evaluation leaves out predictions there; also if a map has no class for them."""
    sample, exporter = world.samples[0], CocoPanoptic()
    first, *others = sample.truth["color"].objects
    assert first.instance.category == "car"
    if fate:
        classes = {"crate": None, "pedestrian": None}
        exporter = MappedExporter(exporter, LabelMap(classes=classes, others=fate))
    else:
        sample = world.ignoring(sample)
    folder = world.export(exporter, world.info(1), [sample], tmp_path)
    (annotation,) = read(folder)["annotations"]
    assert len(annotation["segments_info"]) == len(others)
    ids = segments_of(folder / "annotations/panoptic_train" / annotation["file_name"])
    mask = first.mask
    crop = ids[mask.y_px : first.box.y_max, mask.x_px : first.box.x_max]
    assert (crop[mask.pixels] == 0).all()
