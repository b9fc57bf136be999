"""CVAT export: runs and states of shapes; ``test_labels.py`` reads them."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.core.sample import MaskPx
from gen_data.exporters.cvat import Cvat, row_runs


def assert_states(folder: Path, samples: list[Any]) -> None:
    """Shapes are occluded if more than a twentieth of their object is hidden; labels are listed."""
    root = ET.parse(folder / "train/annotations.xml").getroot()
    truth = [t for s in samples if s.split == "train" for t in s.truth["color"].objects if t.box]
    states = [shape.get("occluded") for image in root.iter("image") for shape in image]
    assert [node.findtext("name") for node in root.iter("label")] == ["car", "crate", "pedestrian"]
    assert states == [str(int(thing.occlusion > 0.05)) for thing in truth]
    assert set(states) == {"0", "1"}


def test_shapes_of_hidden_objects_are_occluded(world: Any, tmp_path: Path) -> None:
    folder = world.export(Cvat(shapes="box"), world.info(7), world.samples, tmp_path)
    assert_states(folder, world.samples)


def test_runs_begin_with_zeros() -> None:
    """A crop that begins inside the mask has an empty first run."""
    assert row_runs(MaskPx(0, 0, np.array([[1, 1], [0, 1]], bool))) == [0, 2, 1, 1]
    assert row_runs(MaskPx(0, 0, np.array([[0, 1], [1, 0]], bool))) == [1, 2, 1]
