"""Ignored objects without a class: readers compare them with detections class by class."""

from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters import TABLE
from gen_data.exporters.label_map import LabelMap, MappedExporter
from gen_data.exporters.voc import YEAR
from tests.exporters.label_readers import READERS, opened, tar_samples
from tests.exporters.test_coco import average_precision
from tests.exporters.test_exporter_contract import EVERY_CLASS

OPTIONS = {"tfrecord": {"masks": "png"}}


@pytest.fixture(params=sorted(EVERY_CLASS))
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def folder(kind: str, world: Any, tmp_path: Path) -> Any:
    """A car in a data set of boxes and walkers, near a crate, which is a box."""
    classes = {"box": ("crate",), "walker": ("pedestrian",)}
    own = TABLE.load(kind)(**OPTIONS.get(kind, {}))
    exporter = MappedExporter(own, LabelMap(classes=classes, others="ignore"))
    things = (world.instance(1, "car", 9.0, 2.5, 0.0), world.instance(2, "crate", 8.0, -1.0, 0.0))
    sample = world.sample(0, things, [world.camera()])
    return world.export(exporter, world.info(1), [sample], tmp_path)


def test_it_is_ignored_in_every_class(kind: str, folder: Path) -> None:
    """Nobody else ignores the region: the ground truth still scores 1.

    Pascal's lists of images have 0 for an image that shows no other object of the class.
    """
    ((_, _, found),) = READERS[kind](folder)
    assert sorted((one.category, one.ignored) for one in found) == [
        ("box", False), ("box", True), ("walker", True),
    ]  # fmt: skip
    assert {one.number for one in found if one.ignored} in ({1}, {None})
    if kind == "coco":
        truth = opened(folder / "annotations/instances_train.json")
        assert average_precision(truth, "bbox") == pytest.approx(1.0, abs=1e-9)
    elif kind == "voc":
        text = (folder / YEAR / "ImageSets/Main/walker_train.txt").read_text()
        assert text == "000000000_color  0\n"
    elif kind == "webdataset":
        rows = tar_samples(folder / "train")[0]["json"]["cameras"]["color"]["annotations"]
        assert [row["category_id"] for row in rows if row["iscrowd"]] == [1, 2]
