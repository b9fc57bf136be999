"""Ignored objects without a class: readers compare them with detections class by class."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters import TABLE
from gen_data.exporters.label_map import LabelMap, MappedExporter
from gen_data.exporters.voc import YEAR
from tests.exporters.label_readers import opened, parquet, records, tar_samples, voc_objects
from tests.exporters.test_coco import average_precision

Row = tuple[str, bool]
"""Class of an object, and whether it is ignored."""


def in_coco(folder: Path) -> list[Row]:
    """In the file whose ground truth still scores 1: nobody else ignores the region."""
    truth = opened(folder / "annotations/instances_train.json")
    assert len(truth.anns) == len(truth.dataset["annotations"])
    assert average_precision(truth, "bbox") == pytest.approx(1.0, abs=1e-9)
    rows = truth.anns.values()
    assert {row["instance_id"] for row in rows if row["iscrowd"]} == {1}
    return [(truth.cats[row["category_id"]]["name"], bool(row["iscrowd"])) for row in rows]


def in_parquet(folder: Path) -> list[Row]:
    (row,) = parquet(folder / "data/train-00000-of-00001.parquet").to_pylist()
    objects = row["objects"]
    assert len(set(objects["id"])) == len(objects["id"])
    names = [("box", "walker")[k] for k in objects["category"]]
    return list(zip(names, objects["iscrowd"], strict=True))


def in_records(folder: Path) -> list[Row]:
    (record,) = records(folder / "train-00000-of-00001.tfrecord")
    labels, texts, crowds = (
        record[f"image/object/{key}"][1] for key in ("class/label", "class/text", "is_crowd")
    )
    assert texts == [(b"box", b"walker")[k - 1] for k in labels]
    return [(text.decode(), bool(crowd)) for text, crowd in zip(texts, crowds, strict=True)]


def in_voc(folder: Path) -> list[Row]:
    """Difficult objects; lists of images have 0 for one that shows no other of the class."""
    rows = voc_objects(folder / YEAR / "Annotations/000000000_color.xml")
    text = (folder / YEAR / "ImageSets/Main/walker_train.txt").read_text()
    assert text == "000000000_color  0\n"
    return [(row["name"], row["difficult"] == "1") for row in rows]


def in_tar(folder: Path) -> list[Row]:
    (sample,) = tar_samples(folder / "train")
    rows = sample["json"]["cameras"]["color"]["annotations"]
    assert len({row["id"] for row in rows}) == len(rows)
    assert [row["category_id"] for row in rows if row["iscrowd"]] == [1, 2]
    return [(row["category"], bool(row["iscrowd"])) for row in rows]


READERS: dict[str, Callable[[Path], list[Row]]] = {
    "coco": in_coco,
    "huggingface": in_parquet,
    "tfrecord": in_records,
    "voc": in_voc,
    "webdataset": in_tar,
}


@pytest.mark.parametrize("kind", READERS)
def test_it_is_ignored_in_every_class(kind: str, world: Any, tmp_path: Path) -> None:
    """A car in a data set of boxes and walkers, near a crate, which is a box."""
    classes = {"box": ("crate",), "walker": ("pedestrian",)}
    exporter = MappedExporter(TABLE.load(kind)(), LabelMap(classes=classes, others="ignore"))
    things = (world.instance(1, "car", 9.0, 2.5, 0.0), world.instance(2, "crate", 8.0, -1.0, 0.0))
    sample = world.sample(0, things, [world.camera()])
    folder = world.export(exporter, world.info(1), [sample], tmp_path)
    assert sorted(READERS[kind](folder)) == [("box", False), ("box", True), ("walker", True)]
