"""Label Studio export, held against ``coco`` and Label Studio's own SDK."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from pycocotools import mask as coco_mask

from gen_data.core.sample import MaskPx
from gen_data.exporters.coco import Coco
from gen_data.exporters.label_studio import LOCAL_FILES, LabelStudio, brush_rle
from tests.exporters.coco_masks import drawn_mask

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

SHAPES = ("mask", "polygon", "box")


@pytest.fixture(scope="module")
def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The seven frames with each shape, and their COCO export."""
    folder = tmp_path_factory.mktemp("label_studio")
    for shapes in SHAPES:
        world.export(LabelStudio(shapes=shapes), world.info(7), world.samples, folder / shapes)
    world.export(Coco(), world.info(7), world.samples, folder / "coco")
    return folder


def unpack(rle: list[int]) -> NDArray[np.uint8]:
    """Values of rle-pack: 32 bits of their number, 5 of their size, four sizes of run lengths."""
    bits = "".join(f"{byte:08b}" for byte in rle)
    place = 0

    def read(count: int) -> int:
        nonlocal place
        place += count
        return int(bits[place - count : place], 2)

    number, word, sizes = read(32), read(5) + 1, [read(4) + 1 for _ in range(4)]
    parts: list[NDArray[np.uint8]] = []
    while sum(map(len, parts)) < number:
        is_run = read(1)
        length = read(sizes[read(2)]) + 1
        values = [read(word)] * length if is_run else [read(word) for _ in range(length)]
        parts.append(np.array(values, np.uint8))
    return np.concatenate(parts)


def drawn(regions: list[dict[str, Any]]) -> NDArray[np.bool_]:
    """Mask of the shapes of one object."""
    width, height = regions[0]["original_width"], regions[0]["original_height"]
    mask = np.zeros((height, width), bool)
    for region in regions:
        value = region["value"]
        if region["type"] == "brushlabels":
            mask |= unpack(value["rle"]).reshape(height, width, 4)[..., 3] == 255
        elif region["type"] == "polygonlabels":
            points = np.array(value["points"]) * (width / 100, height / 100)
            encoded = coco_mask.frPyObjects([points.ravel().tolist()], height, width)
            mask |= coco_mask.decode(encoded[0]).astype(bool)
        else:
            x, w = (round(value[name] * width / 100) for name in ("x", "width"))
            y, h = (round(value[name] * height / 100) for name in ("y", "height"))
            mask[y : y + h, x : x + w] = True
    return mask


def problems(root: Path, dataset: Path, shapes: str) -> list[str]:
    """Differences from COCO's train split."""
    found = []
    folder = dataset / "coco/dataset/annotations"
    coco = json.loads((folder / "instances_train.json").read_text())
    points = {
        row["id"]: row["keypoints"]
        for path in folder.glob("*_keypoints_train.json")
        for row in json.loads(path.read_text())["annotations"]
    }
    names = {c["id"]: c["name"] for c in coco["categories"]}
    controls = list(ET.parse(root / "label_config.xml").getroot())
    listed = {c.get("name"): [label.get("value") for label in c] for c in controls}
    if list(listed.values())[1] != list(names.values()):
        found.append("labels")
    tasks = json.loads((root / "train/tasks.json").read_text())
    files = [unquote(t["data"]["image"]).removeprefix(f"{LOCAL_FILES}label_studio/") for t in tasks]
    if files != sorted(str(p.relative_to(root)) for p in (root / "train/images").iterdir()):
        found.append("files")
    if [task["id"] for task in tasks] != [image["id"] for image in coco["images"]]:
        found.append("ids")
    for task, image in zip(tasks, coco["images"], strict=True):
        expected = [a for a in coco["annotations"] if a["image_id"] == image["id"]]
        objects: dict[str, list[dict[str, Any]]] = {}
        for region in task["annotations"][0]["result"]:
            objects.setdefault(region.get("parentID", region["id"]), []).append(region)
            if not set(region["value"][region["type"]]) <= set(listed[region["from_name"]]):
                found.append("class")
        if list(objects) != [str(a["instance_id"]) for a in expected]:
            found.append("objects")
            continue
        for row, regions in zip(expected, objects.values(), strict=True):
            row["keypoints"] = points.get(row["id"], [])
            found += _object_problems(row, regions, names[row["category_id"]], shapes, coco)
    return found


def _object_problems(
    row: dict[str, Any], regions: list[dict[str, Any]], name: str, shapes: str, coco: dict[str, Any]
) -> list[str]:
    found = []
    outlines = [r for r in regions if r["type"] != "keypointlabels"]
    if {label for r in outlines for label in r["value"][r["type"]]} != {name}:
        found.append("class")
    if len(outlines) != 1:
        found.append("parts")
    mask = drawn_mask(row, coco)
    if shapes == "box":
        x, y, w, h = map(int, row["bbox"])
        mask[y : y + h, x : x + w] = True
    if not np.array_equal(drawn(outlines), mask):
        found.append("shape")
    points = [r for r in regions if r["type"] == "keypointlabels"]
    seen = [point for point in zip(*[iter(row["keypoints"])] * 3, strict=True) if point[2]]
    if len(points) != len(seen):
        found.append("keypoints")
    for region, (x_px, y_px, _) in zip(points, seen, strict=False):
        place = (region["value"]["x"] * region["original_width"] / 100,
                 region["value"]["y"] * region["original_height"] / 100)  # fmt: skip
        if not np.allclose(place, (x_px, y_px), atol=0.01):
            found.append("keypoints")
    return found


@pytest.mark.parametrize("shapes", SHAPES)
def test_shapes_and_labels_are_those_of_coco(dataset: Path, shapes: str) -> None:
    """Every pixel, also of objects in several parts."""
    assert problems(dataset / shapes / "dataset", dataset, shapes) == []


@given(
    crop=hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=8)),
    above=st.integers(0, 60),
    left=st.integers(0, 9),
    below=st.integers(0, 60),
    right=st.integers(0, 9),
)
@settings(max_examples=50, deadline=None)
def test_any_mask_comes_back(
    crop: np.ndarray, above: int, left: int, below: int, right: int
) -> None:
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
