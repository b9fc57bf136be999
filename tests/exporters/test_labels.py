"""Readers of labelled images find the objects of the samples in every format."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.se3 import SE3
from gen_data.exporters import TABLE
from tests.exporters.label_readers import READERS, Found
from tests.tiers import sampled


def divided(world: Any) -> Any:
    """A car in two parts behind a pedestrian, seen by a tilted camera."""
    level = world.camera()
    pose = level.T_world_camera @ SE3.about_z(0.4)
    things = (world.instance(1, "car", 14.0, 0.0, 1.57),
              world.instance(2, "pedestrian", 8.0, 0.0, 0.0),
              world.instance(3, "crate", 9.0, 2.0, 0.0),
              world.instance(4, "crate", 10.0, -3.0, 0.5))  # fmt: skip
    return world.sample(7, things, [replace(level, T_world_camera=pose)])


def truth_of(sample: Any, camera: str = "color") -> list[Found]:
    """Visible objects of an image; masks are parts of the image of instances."""
    ids = sample.capture.readings[camera].channels[Channel.INSTANCE]
    return [
        Found(
            thing.instance.category,
            (thing.box.x_min, thing.box.y_min, thing.box.x_max, thing.box.y_max),
            ids == thing.instance.instance_id,
            thing.instance.instance_id,
        )
        for thing in sample.truth[camera].objects
        if thing.box is not None
    ]


def assert_objects(kind: str, folder: Path, samples: list[Any]) -> None:
    """Splits, images, and categories, boxes, masks and numbers of their objects, in order."""
    images = {stem: (split, rows) for split, stem, rows in READERS[kind](folder)}
    assert set(images) == {f"{s.index:09d}_color" for s in samples}
    for sample in samples:
        split, rows = images[f"{sample.index:09d}_color"]
        truth = truth_of(sample)
        assert split == sample.split
        assert [row.category for row in rows] == [thing.category for thing in truth]
        for row, thing in zip(rows, truth, strict=True):
            assert row.box in (None, thing.box)
            assert row.number in (None, thing.number)
            if row.mask is not None:
                np.testing.assert_array_equal(row.mask, thing.mask)


@pytest.mark.parametrize(
    ("kind", "options"),
    sampled(
        [*((kind, {}) for kind in READERS if kind not in ("tfrecord", "yolo")),
         ("coco", {"segmentation": "rle"}),
         *((kind, {"shapes": s}) for kind in ("cvat", "label_studio") for s in ("box", "polygon")),
         ("label_studio", {"shapes": "mask"}), ("huggingface", {"rows_per_file": 2}),
         ("tfrecord", {"rows_per_file": 2, "masks": "png"}), ("webdataset", {"samples_per_tar": 2}),
         ("yolo", {"tasks": ("detect",)})],
        3,
    ),
)  # fmt: skip
def test_objects_are_found(kind: str, options: dict[str, Any], world: Any, tmp_path: Path) -> None:
    """In seven frames, of which one is empty, and one with an object in two parts."""
    exporter = TABLE.load(kind)(type=kind, **options)
    samples = [*world.samples, divided(world)]
    folder = world.export(exporter, world.info(8, lidars=("top",)), samples, tmp_path)
    assert_objects(kind, folder, samples)
