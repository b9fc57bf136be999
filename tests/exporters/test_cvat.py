"""CVAT export, held against ``coco``."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pycocotools import mask as coco_mask

from gen_data.core.sample import MaskPx
from gen_data.exporters.coco import Coco
from gen_data.exporters.cvat import Cvat, row_runs
from tests.exporters.coco_masks import drawn_mask

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

SHAPES = ("mask", "polygon", "box")


@pytest.fixture(scope="module")
def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The seven frames with each shape, and their COCO export."""
    folder = tmp_path_factory.mktemp("cvat")
    for shapes in SHAPES:
        world.export(Cvat(shapes=shapes), world.info(7), world.samples, folder / shapes)
    world.export(Coco(), world.info(7), world.samples, folder / "coco")
    return folder


def drawn(elements: list[ET.Element], height: int, width: int) -> NDArray[np.bool_]:
    """Mask of the shapes of one object."""
    mask = np.zeros((height, width), bool)
    for element in elements:
        facts = element.attrib
        if element.tag == "mask":
            lengths = [int(value) for value in facts["rle"].split(",")]
            values = np.arange(len(lengths)) % 2 == 1
            w, h, x, y = (int(facts[name]) for name in ("width", "height", "left", "top"))
            mask[y : y + h, x : x + w] |= np.repeat(values, lengths).reshape(h, w)
        elif element.tag == "polygon":
            points = [float(v) for pair in facts["points"].split(";") for v in pair.split(",")]
            mask |= coco_mask.decode(coco_mask.frPyObjects([points], height, width)[0]).astype(bool)
        else:
            x0, y0, x1, y1 = (int(facts[name]) for name in ("xtl", "ytl", "xbr", "ybr"))
            mask[y0:y1, x0:x1] = True
    return mask


def problems(root: Path, dataset: Path, shapes: str) -> list[str]:
    """Differences from COCO's train split."""
    found = []
    coco = json.loads((dataset / "coco/dataset/annotations/instances_train.json").read_text())
    names = {c["id"]: c["name"] for c in coco["categories"]}
    tree = ET.parse(root / "train/annotations.xml").getroot()
    if [n.findtext("name") for n in tree.iter("label")] != list(names.values()):
        found.append("labels")
    images = list(tree.iter("image"))
    if [node.get("id") for node in images] != [str(k) for k in range(len(coco["images"]))]:
        found.append("numbers")
    if {node.get("name") for node in images} != {p.name for p in (root / "train/images").iterdir()}:
        found.append("files")
    for node, image in zip(images, coco["images"], strict=False):
        expected = [a for a in coco["annotations"] if a["image_id"] == image["id"]]
        groups: dict[str, list[ET.Element]] = {}
        for element in node:
            groups.setdefault(element.get("group_id", ""), []).append(element)
        if list(groups) != [str(a["instance_id"]) for a in expected]:
            found.append("objects")
            continue
        for row, elements in zip(expected, groups.values(), strict=True):
            if {e.get("label") for e in elements} != {names[row["category_id"]]}:
                found.append("class")
            if {e.get("occluded") for e in elements} != {str(int(row["occlusion"] > 0.05))}:
                found.append("occluded")
            mask = drawn_mask(row, coco)
            if shapes == "box":
                x, y, w, h = map(int, row["bbox"])
                mask[y : y + h, x : x + w] = True
            if not np.array_equal(drawn(elements, *mask.shape), mask):
                found.append("shape")
    return found


@pytest.mark.parametrize("shapes", SHAPES)
def test_shapes_and_labels_are_those_of_coco(dataset: Path, shapes: str) -> None:
    """Every pixel, also of objects in several parts; images are numbered from 0."""
    assert problems(dataset / shapes / "dataset", dataset, shapes) == []


def test_runs_begin_with_zeros() -> None:
    """A crop that begins inside the mask has an empty first run."""
    assert row_runs(MaskPx(0, 0, np.array([[1, 1], [0, 1]], bool))) == [0, 2, 1, 1]
    assert row_runs(MaskPx(0, 0, np.array([[0, 1], [1, 0]], bool))) == [1, 2, 1]
