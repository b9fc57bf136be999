"""COCO export, judged by pycocotools."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from exporters.coco import Coco
from generator.annotations.truth import Thresholds
from generator.core.capture import Channel
from generator.core.errors import ConfigError
from generator.core.se3 import SE3

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


def opened(path: Path) -> COCO:
    """The file as the official reader sees it."""
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(str(path))


def average_precision(truth: COCO, kind: str) -> float:
    """AP at IoU 0.50:0.95 of the ground truth, submitted as predictions."""
    key = "segmentation" if kind == "segm" else "bbox"
    rows = [
        {**{k: a[k] for k in ("image_id", "category_id", key)}, "score": 1 - 1e-4 * i}
        for i, a in enumerate(truth.dataset["annotations"])
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = COCOeval(truth, truth.loadRes(rows), kind)
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return float(evaluation.stats[0])


@pytest.fixture(scope="module")
def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven frames of a street, exported with all defaults."""
    folder = tmp_path_factory.mktemp("coco")
    return world.export(Coco(), world.info(7), world.samples, folder)


@pytest.fixture(scope="module")
def train(dataset: Path) -> COCO:
    """The train split."""
    return opened(dataset / "annotations/instances_train.json")


@pytest.mark.parametrize("kind", ["bbox", "segm"])
@pytest.mark.parametrize("split", ["train", "val"])
def test_ground_truth_as_predictions_scores_one(dataset: Path, split: str, kind: str) -> None:
    """Which an annotation id 0, a wrong area or a mask of the wrong size would prevent."""
    truth = opened(dataset / f"annotations/instances_{split}.json")

    assert average_precision(truth, kind) == pytest.approx(1.0, abs=1e-9)


def test_box_and_area_are_those_of_the_decoded_mask(train: COCO) -> None:
    """Width is xmax - xmin + 1; area counts pixels, not width times height."""
    assert len(train.anns) > 10
    for row in train.anns.values():
        rle = train.annToRLE(row)
        assert row["bbox"] == coco_mask.toBbox(rle).tolist()
        assert row["area"] == coco_mask.area(rle)
        assert row["iscrowd"] == 0


def test_masks_are_the_pixels_of_the_instance_image(train: COCO, dataset: Path) -> None:
    """Every mask is found again in the linked 16-bit id image."""
    for row in train.anns.values():
        image = train.imgs[row["image_id"]]
        with Image.open(dataset / image["files"]["instance"]) as ids:
            expected = np.asarray(ids) == row["instance_id"]
        np.testing.assert_array_equal(train.annToMask(row).astype(bool), expected)


def test_ids_are_positive_and_unique_over_all_splits(dataset: Path) -> None:
    """Category ids are consecutive from 1 in the order of the data set's categories."""
    parts = [json.loads(p.read_text()) for p in sorted((dataset / "annotations").iterdir())]
    for section in ("images", "annotations"):
        ids = [row["id"] for part in parts for row in part[section]]
        assert len(ids) == len(set(ids))
        assert min(ids) >= 1
    for part in parts:
        names = [(c["id"], c["name"]) for c in part["categories"]]
        assert names == [(1, "car"), (2, "crate"), (3, "pedestrian")]


def test_empty_images_stay_and_every_image_on_disk_is_listed(train: COCO, dataset: Path) -> None:
    """Frame 3 shows nothing: a negative example, not a mistake."""
    listed = {image["file_name"]: image for image in train.imgs.values()}

    assert set(listed) == {p.name for p in (dataset / "train").iterdir()}
    assert train.getAnnIds(listed["000000003_color.png"]["id"]) == []
    for name, image in listed.items():
        with Image.open(dataset / "train" / name) as pixels:
            assert (pixels.mode, pixels.size) == ("RGB", (image["width"], image["height"]))


def test_a_split_without_images_has_no_file(dataset: Path) -> None:
    """Readers would take an empty file for an empty data set."""
    names = {p.name for p in (dataset / "annotations").iterdir()}

    assert names == {"instances_train.json", "instances_val.json"}


def test_images_are_links_to_the_shards(dataset: Path) -> None:
    """No image is stored twice."""
    shard = dataset.parent / "shards/000001"

    assert (dataset / "val/000000004_color.png").samefile(shard / "color/rgb/000000004.png")
    assert (dataset / "depth/val/000000004_color.png").samefile(shard / "color/depth/000000004.png")


def test_the_pose_and_box_project_onto_the_image_box(train: COCO) -> None:
    """Corners, through the written K and T_camera_object, enclose whole silhouettes tightly."""
    for row in train.anns.values():
        k = np.array(train.imgs[row["image_id"]]["K"])
        box = row["box3d"]
        half = 0.5 * np.array(box["size_m"])
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)
        pose = SE3(tuple(box["center_m"]), tuple(box["quaternion_wxyz"]))
        image_points = pose.apply(signs * half) @ k.T
        u, v = image_points[:, 0] / image_points[:, 2], image_points[:, 1] / image_points[:, 2]
        left, top, width, _ = row["amodal_bbox"]

        # A pixel belongs to the silhouette if its centre does: within one pixel of the corners.
        slack = np.array([left - u.min(), top - v.min(), u.max() - left - width])
        assert (slack > -1.0).all()
        if row["attributes"]["asset"] == "primitive/box":
            assert (slack < 1.0).all()
        np.testing.assert_allclose(
            np.array(row["T_camera_object"])[:3, 3],
            pose.apply(np.array([0.0, 0.0, -half[2]])),
            atol=1e-8,
        )


def test_cameras_are_written_in_full(train: COCO) -> None:
    """K has pixel centres at i + 0.5: a centred camera has its principal point at W / 2."""
    image = next(iter(train.imgs.values()))

    assert image["K"][0][2] == image["width"] / 2
    # Level, looking along world X: camera Z is world X, camera Y is down.
    np.testing.assert_allclose(
        image["T_world_camera"],
        [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.6], [0, 0, 0, 1]],
        atol=1e-9,
    )


def test_visibility_and_amodal_shapes_agree_with_the_masks(train: COCO) -> None:
    """The visible mask lies in the amodal one; their ratio is 1 - occlusion."""
    truncated = 0
    for row in train.anns.values():
        visible = train.annToMask(row).astype(bool)
        whole = coco_mask.decode(row["amodal_segmentation"]).astype(bool)
        assert not (visible & ~whole).any()
        assert row["occlusion"] == pytest.approx(1 - visible.sum() / whole.sum(), abs=1e-8)
        remains = (1 - row["occlusion"]) * (1 - row["truncation"])
        assert row["visible_fraction"] == pytest.approx(remains, abs=1e-8)
        truncated += row["truncation"] > 0
    assert truncated > 0


def test_boxes_only_and_no_amodal_keys_on_request(world: Any, tmp_path: Path) -> None:
    """Options leave out what they say, and nothing else."""
    exporter = Coco(segmentation="none", amodal=False)

    folder = world.export(exporter, world.info(7), world.samples, tmp_path)

    truth = opened(folder / "annotations/instances_train.json")
    row = next(iter(truth.anns.values()))
    assert row["segmentation"] == []
    assert not {"amodal_bbox", "amodal_segmentation"} & set(row)
    assert average_precision(truth, "bbox") == pytest.approx(1.0, abs=1e-9)


def test_hidden_objects_are_not_listed(world: Any, tmp_path: Path) -> None:
    """COCO has no box for what shows no pixel, even if its truth was asked for."""
    hidden = world.instance(1, "crate", -5.0, 0.0, 0.0)
    shown = world.instance(2, "crate", 8.0, 0.0, 0.0)
    sample = world.sample(
        0, (hidden, shown), [world.camera()], thresholds=Thresholds(include_invisible=True)
    )
    assert len(sample.truth["color"].objects) == 2

    folder = world.export(Coco(), world.info(1), [sample], tmp_path)

    truth = opened(folder / "annotations/instances_train.json")
    assert [row["instance_id"] for row in truth.anns.values()] == [2]


def test_two_cameras_give_two_images_per_sample(world: Any, tmp_path: Path) -> None:
    """A sensor without colour is left out; the ids of the others do not change by it."""
    cameras = [world.camera(name) for name in ("depth_only", "left", "right")]
    names = tuple(camera.name for camera in cameras)
    sample = world.sample(0, world.samples[0].scene.instances, cameras)
    info = world.info(1, names)
    info.media["depth_only"] = (Channel.Z_DEPTH,)

    folder = world.export(Coco(), info, [sample], tmp_path)

    truth = opened(folder / "annotations/instances_train.json")
    found = {image["file_name"]: image["id"] for image in truth.imgs.values()}
    assert found == {"000000000_left.png": 2, "000000000_right.png": 3}


def test_a_data_set_without_colour_images_is_refused(world: Any) -> None:
    """Before anything is rendered."""
    info = world.info(1, media={"color": (Channel.Z_DEPTH,)})

    with pytest.raises(ConfigError, match="no sensor of color writes the rgb channel"):
        Coco().check(info)
