"""Label Studio export, held against the samples and Label Studio's own SDK."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gen_data.core.sample import MaskPx
from gen_data.exporters.label_studio import LabelStudio, brush_rle
from tests.exporters.label_readers import unpack

SHAPES = ("mask", "polygon", "box")


@pytest.fixture(scope="module")
def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("label_studio")
    for shapes in SHAPES:
        world.export(LabelStudio(shapes=shapes), world.info(7), world.samples, folder / shapes)
    return folder


def test_keypoints_are_regions_of_their_object(world: Any, dataset: Path) -> None:
    """Points that are labelled, as shares of the image; tasks have the ids of images."""
    tasks = json.loads((dataset / "box/dataset/train/tasks.json").read_text())
    samples = [sample for sample in world.samples if sample.split == "train"]
    assert [task["id"] for task in tasks] == [sample.image_id("color") for sample in samples]
    for task, sample in zip(tasks, samples, strict=True):
        regions = task["annotations"][0]["result"]
        found = [
            (r["parentID"], r["value"]["x"] * 1.6, r["value"]["y"] * 1.2)
            for r in regions
            if r["type"] == "keypointlabels"
        ]
        expected = [
            (str(thing.instance.instance_id), *point.image_px)
            for thing in sample.truth["color"].objects
            for point in thing.keypoints or ()
            if point.visibility
        ]
        assert [number for number, *_ in found] == [number for number, *_ in expected]
        np.testing.assert_allclose(
            [place for _, *place in found], [place for _, *place in expected], atol=0.01
        )


@given(
    crop=hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=8)),
    above=st.integers(0, 60),
    left=st.integers(0, 9),
    below=st.integers(0, 60),
    right=st.integers(0, 9),
)
@settings(max_examples=50, deadline=None)
def test_masks_come_back(crop: np.ndarray, above: int, left: int, below: int, right: int) -> None:
    """Also at the image's edges, where runs of different rows meet."""
    expected = np.pad(crop, [(above, below), (left, right)])
    values = unpack(brush_rle(MaskPx(left, above, crop), *expected.shape))
    assert np.array_equal(values.reshape(*expected.shape, 4) == 255, np.stack([expected] * 4, -1))


def test_long_runs_are_divided() -> None:
    """A run has 16 bits for its length; a pixel counts four times."""
    values = unpack(brush_rle(MaskPx(0, 0, np.ones((300, 100), bool)), 300, 100))
    assert len(values) == 120_000
    assert (values == 255).all()


def test_predictions_and_other_addresses(world: Any, tmp_path: Path) -> None:
    """For annotators that correct, and for images on a server."""
    exporter = LabelStudio(kind="predictions", url_prefix="https://example.org/")
    root = world.export(exporter, world.info(7), world.samples, tmp_path)
    task = json.loads((root / "train/tasks.json").read_text())[0]
    assert task["data"]["image"].startswith("https://example.org/label_studio/train/images/0")
    assert task["predictions"][0]["model_version"] == "gen-data"
    assert "annotations" not in task


@pytest.mark.slow
@pytest.mark.parametrize("shapes", SHAPES)
def test_the_sdk_accepts_interface_and_tasks(dataset: Path, shapes: str) -> None:
    """Its validation of configuration, tasks and regions, and its decoder of masks."""
    from label_studio_sdk.converter.brush import decode_rle
    from label_studio_sdk.label_interface import LabelInterface

    root = dataset / shapes / "dataset"
    interface = LabelInterface((root / "label_config.xml").read_text())
    interface.validate()
    tasks = json.loads((root / "train/tasks.json").read_text())
    annotations = [task["annotations"][0] for task in tasks]
    regions = [region for annotation in annotations for region in annotation["result"]]
    assert len(tasks) == 5
    assert all(interface.validate_task({"data": task["data"]}) for task in tasks)
    assert all(map(interface.validate_annotation, annotations))
    assert all(map(interface.validate_region, regions))
    assert not interface.validate_region({**regions[0], "to_name": "picture"})
    for region in regions[:3]:
        if region["type"] == "brushlabels":
            assert np.array_equal(
                decode_rle(region["value"]["rle"]), unpack(region["value"]["rle"])
            )
