"""COCO export, judged by pycocotools."""

import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from gen_data.annotations.annotate import Thresholds
from gen_data.api.sample import Sample as SampleView
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Weather
from gen_data.core.se3 import SE3
from gen_data.exporters.coco import Coco
from gen_data.targets import detection_target, keypoint_target
from tests.exporters.datasets import made_of
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import opened


def judged(judge: Any, truth: Any, rows: Any, kind: str, sigmas: list[float] | None = None) -> Any:
    """The first score of an evaluation of predictions."""
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = judge(truth, truth.loadRes(rows), kind)
        if sigmas is not None:
            evaluation.params.kpt_oks_sigmas = np.array(sigmas)
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return float(evaluation.stats[0])


def average_precision(truth: COCO, kind: str, path: Path | None = None) -> float:
    """AP at IoU 0.50:0.95 of the ground truth, submitted as predictions.

    With a path, faster-coco-eval reads the file and judges.
    """
    rows = [
        {
            "image_id": a["image_id"],
            "category_id": a["category_id"],
            **({"segmentation": truth.annToRLE(a)} if kind == "segm" else {"bbox": a["bbox"]}),
            "score": 1 - 1e-4 * i,
        }
        for i, a in enumerate(truth.dataset["annotations"])
    ]
    if path is None:
        return judged(COCOeval, truth, rows, kind)
    import faster_coco_eval as faster

    with contextlib.redirect_stdout(io.StringIO()):
        truth = faster.COCO(str(path))
    return judged(faster.COCOeval_faster, truth, rows, kind)


dataset = made_of(Coco())


@pytest.fixture(scope="module")
def train(dataset: Path) -> COCO:
    return opened(dataset / "annotations/instances_train.json")


@pytest.mark.parametrize("kind", ["bbox", "segm"])
@pytest.mark.parametrize("split", ["train", "val"])
def test_ground_truth_as_predictions_scores_one(dataset: Path, split: str, kind: str) -> None:
    """Which an annotation id 0, a wrong area or a mask of the wrong size would prevent."""
    path = dataset / f"annotations/instances_{split}.json"
    assert average_precision(opened(path), kind) == pytest.approx(1.0, abs=1e-9)
    assert average_precision(opened(path), kind, path) == pytest.approx(1.0, abs=1e-9)


def test_boxes_areas_and_visibility_are_those_of_the_decoded_masks(train: COCO) -> None:
    """Width is xmax - xmin + 1; area counts pixels, not width times height."""
    assert len(train.anns) > 10
    for row in train.anns.values():
        rle = train.annToRLE(row)
        assert (row["bbox"], row["area"]) == (coco_mask.toBbox(rle).tolist(), coco_mask.area(rle))
        assert row["iscrowd"] == 0
    # The visible mask lies in the amodal one; their ratio is 1 - occlusion.
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


def test_ids_are_positive_and_unique_over_all_splits_and_boxes_are_floats(dataset: Path) -> None:
    """Category ids are consecutive from 1 in the order of the data set's categories."""
    paths = sorted((dataset / "annotations").glob("instances_*.json"))
    parts = [json.loads(path.read_text()) for path in paths]
    for section in ("images", "annotations"):
        ids = [row["id"] for part in parts for row in part[section]]
        assert len(ids) == len(set(ids))
        assert min(ids) >= 1
    for part in parts:
        names = [(c["id"], c["name"]) for c in part["categories"]]
        assert names == [(1, "car"), (2, "crate"), (3, "pedestrian")]
    # Integers make integer tensors in torchvision's wrapper, whose transforms then cut boxes.
    for path in (dataset / "annotations").glob("*.json"):
        for row in json.loads(path.read_text())["annotations"]:
            for key in ("bbox", "amodal_bbox"):
                assert [type(value) for value in row[key]] == [float] * 4, (path.name, key)


def test_empty_images_stay_and_empty_splits_have_no_file(train: COCO, dataset: Path) -> None:
    """Frame 3 shows nothing: a negative example, not a mistake."""
    listed = {image["file_name"]: image for image in train.imgs.values()}
    assert set(listed) == {p.name for p in (dataset / "train").iterdir()}
    # A view of one instant does not make a sequence.
    assert "sequence_id" not in next(iter(listed.values()))
    assert "track_id" not in next(iter(train.anns.values()))
    assert train.getAnnIds(listed["000000003_color.png"]["id"]) == []
    for name, image in listed.items():
        with Image.open(dataset / "train" / name) as pixels:
            assert (pixels.mode, pixels.size) == ("RGB", (image["width"], image["height"]))
    # Readers would take an empty file for an empty data set.
    names = {p.name for p in (dataset / "annotations").iterdir()}
    stems = ("instances", "car_keypoints", "pedestrian_keypoints")
    assert names == {f"{stem}_{split}.json" for stem in stems for split in ("train", "val")}


def test_the_pose_and_box_project_onto_the_image_box_by_the_written_camera(train: COCO) -> None:
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
    # K has pixel centres at i + 0.5: a centred camera has its principal point at W / 2.
    image = next(iter(train.imgs.values()))
    assert image["K"][0][2] == image["width"] / 2
    # Level, looking along world X: camera Z is world X, camera Y is down.
    np.testing.assert_allclose(
        image["T_world_camera"],
        [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.6], [0, 0, 0, 1]],
        atol=1e-9,
    )


def test_amodal_boxes_are_those_of_the_silhouettes(world: Any, tmp_path: Path, train: COCO) -> None:
    """As pycocotools finds them; masks, areas and the score of the ground truth stay."""
    root = world.export(Coco(bbox="amodal"), world.info(7), world.samples, tmp_path)
    path = root / "annotations/instances_train.json"
    amodal = opened(path)
    assert average_precision(opened(path), "bbox") == pytest.approx(1.0, abs=1e-9)
    # COCOeval exchanges the masks of its data set for run lengths.
    assert average_precision(opened(path), "segm") == pytest.approx(1.0, abs=1e-9)
    grown = 0
    for number, row in amodal.anns.items():
        assert row["bbox"] == coco_mask.toBbox(row["amodal_segmentation"]).tolist()
        before = train.anns[number]
        grown += row["bbox"] != before["bbox"]
        for key in ("segmentation", "area", "amodal_bbox", "truncation"):
            assert row[key] == before[key]
    assert 0 < grown < len(amodal.anns)
    assert Coco(bbox="amodal", amodal=False).needs == {"instance_masks", "boxes2d"}


@pytest.mark.slow
def test_boxes_only_and_no_amodal_keys_on_request(world: Any, tmp_path: Path) -> None:
    exporter = Coco(segmentation="none", amodal=False)
    folder = world.export(exporter, world.info(7), world.samples, tmp_path)
    truth = opened(folder / "annotations/instances_train.json")
    row = next(iter(truth.anns.values()))
    assert row["segmentation"] == []
    assert not {"amodal_bbox", "amodal_segmentation"} & set(row)
    assert average_precision(truth, "bbox") == pytest.approx(1.0, abs=1e-9)


def test_ground_truth_of_runs_scores_one(world: Any, tmp_path: Path) -> None:
    folder = world.export(Coco(segmentation="rle"), world.info(7), world.samples, tmp_path)
    runs = opened(folder / "annotations/instances_train.json")
    assert average_precision(runs, "segm") == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("segmentation", ["rle", "polygon"])
def test_ignored_objects_are_crowds(world: Any, tmp_path: Path, segmentation: Any) -> None:
    """Which COCOeval does not count; their masks are run lengths."""
    sample = world.samples[0]
    first = sample.truth["color"].objects[0]
    exporter = Coco(segmentation=segmentation)
    folder = world.export(exporter, world.info(1), [world.ignoring(sample)], tmp_path)
    opened_truth = opened(folder / "annotations/instances_train.json")
    crowds = [row for row in opened_truth.anns.values() if row["iscrowd"]]
    assert [row["instance_id"] for row in crowds] == [first.instance.instance_id]
    assert opened_truth.annToMask(crowds[0]).sum() == first.visible_px


def test_hidden_objects_are_not_listed(world: Any, tmp_path: Path) -> None:
    """COCO has no box for an object without a visible pixel, even if its truth was asked for."""
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
    media = {"left": (Channel.RGB,), "right": (Channel.RGB,), "depth_only": (Channel.Z_DEPTH,)}
    info = world.info(1, names, media=media)
    folder = world.export(Coco(), info, [sample], tmp_path)
    truth = opened(folder / "annotations/instances_train.json")
    found = {image["file_name"]: image["id"] for image in truth.imgs.values()}
    assert found == {"000000000_left.png": 2, "000000000_right.png": 3}


def object_keypoint_similarity(truth: COCO, sigmas: list[float] | None) -> float:
    """OKS AP of the ground truth, submitted as predictions."""
    rows = [
        {**{k: a[k] for k in ("image_id", "category_id", "keypoints")}, "score": 1 - 1e-4 * i}
        for i, a in enumerate(truth.dataset["annotations"])
        if a["num_keypoints"]
    ]
    return judged(COCOeval, truth, rows, "keypoints", sigmas)


@pytest.mark.parametrize(
    ("name", "sigmas"), [("pedestrian", None), ("car", [0.05] * 8)], ids=["pedestrian", "car"]
)
@pytest.mark.parametrize("split", ["train", "val"])
def test_keypoints_agree(dataset: Path, split: str, name: str, sigmas: list[float] | None) -> None:
    """COCOeval compares one skeleton at a time: each category has its file."""
    truth = opened(dataset / f"annotations/{name}_keypoints_{split}.json")
    assert object_keypoint_similarity(truth, sigmas) == pytest.approx(1.0, abs=1e-9)


def test_a_keypoint_file_has_its_category_with_projected_points(dataset: Path, train: COCO) -> None:
    """Boxes, masks and ids are as in the instances file; points are added."""
    truth = opened(dataset / "annotations/pedestrian_keypoints_train.json")
    (category,) = truth.dataset["categories"]
    assert (category["id"], category["name"]) == (3, "pedestrian")
    assert len(category["keypoints"]) == 17
    assert category["keypoints"][0] == "nose"
    assert category["skeleton"][0] == [16, 14]
    assert truth.imgs == train.imgs
    expected = {k: row for k, row in train.anns.items() if row["category_id"] == 3}
    added = ("keypoints", "num_keypoints", "keypoints_camera_m")
    assert {
        k: {name: value for name, value in row.items() if name not in added}
        for k, row in truth.anns.items()
    } == expected
    # Through the written K; v counts labelled points, and visible ones lie on the mask.
    states = set()
    for row in truth.anns.values():
        k = np.array(truth.imgs[row["image_id"]]["K"])
        mask = np.pad(truth.annToMask(row), 1)
        points = np.array(row["keypoints"], float).reshape(-1, 3)
        assert row["num_keypoints"] == (points[:, 2] > 0).sum()
        for name, (u, v, state) in zip(category["keypoints"], points, strict=True):
            states.add(state)
            x, y, z = k @ row["keypoints_camera_m"][name]
            if state:
                assert (u, v) == pytest.approx((x / z, y / z), abs=1e-3)
            else:
                assert (u, v) == (0, 0)
            if state == 2:
                assert mask[int(v) : int(v) + 3, int(u) : int(u) + 3].any()
    assert states == {0, 1, 2}


def test_points_that_no_object_has_are_zero(dataset: Path) -> None:
    """The cars have four of the eight points of a vehicle: tail lights and rear wheels miss."""
    truth = opened(dataset / "annotations/car_keypoints_train.json")
    (category,) = truth.dataset["categories"]
    for row in truth.anns.values():
        points = np.array(row["keypoints"]).reshape(-1, 3)
        missing = [category["keypoints"].index(n) for n in ("taillight_left", "wheel_rear_right")]
        assert not points[missing].any()
        assert set(row["keypoints_camera_m"]) < set(category["keypoints"])


def test_facts_of_objects_and_images_are_attributes(world: Any, tmp_path: Path) -> None:
    """Subcategory and attributes of the asset; shared draws and weather of the scene."""
    crate = replace(
        world.instance(2, "crate", 8.0, 0.0, 0.0),
        subcategory="wooden",
        attributes=(("lid", "open"), ("name", "lost to the object's own")),
    )
    sample = world.sample(0, (crate,), [world.camera()])
    weather = Weather(rain_mm_h=2.5, wetness=1.0, seed=77)
    scene = replace(sample.scene, shared=(("lanes", 2), ("style", "modern")), weather=weather)
    folder = world.export(Coco(), world.info(1), [replace(sample, scene=scene)], tmp_path)
    truth = opened(folder / "annotations/instances_train.json")
    (row,), (image,) = truth.anns.values(), truth.imgs.values()
    assert row["attributes"] == {
        "name": "crate/2", "asset": "primitive/box", "subcategory": "wooden", "lid": "open",
    }  # fmt: skip
    assert image["attributes"] == {"lanes": 2, "style": "modern"}
    assert image["weather"] == {"rain_mm_h": 2.5, "wetness": 1.0}


def test_coco_knows_sequences_frames_and_tracks(exported: Any) -> None:
    """A track is one object in all images of one sequence, whatever the camera."""
    folder = exported(Coco()) / "annotations"
    tracks: dict[str, set[int]] = {}
    for split, number in (("train", 0), ("val", 1)):
        data = json.loads((folder / f"instances_{split}.json").read_text())
        images = {image["id"]: image for image in data["images"]}
        assert {image["sequence_id"] for image in images.values()} == {number}
        assert sorted((i["frame_id"], i["sensor"]) for i in images.values()) == [
            (k, s) for k in range(4) for s in ("left", "right")
        ]
        for image in images.values():
            assert image["time_s"] == pytest.approx(0.1 * image["frame_id"])
        by_instance: dict[int, set[int]] = {}
        for row in data["annotations"]:
            by_instance.setdefault(row["instance_id"], set()).add(row["track_id"])
        assert {k: len(ids) for k, ids in by_instance.items()} == {1: 1, 2: 1, 4: 1}
        tracks[split] = set().union(*by_instance.values())
    assert not tracks["train"] & tracks["val"]


def test_targets_of_trainers_have_the_image_ids_of_the_file(world: Any, tmp_path: Path) -> None:
    """Torchvision: unique among all images of the data set, whichever cameras read at a step."""
    samples = world.drive({"right": 2})
    folder = world.export(Coco(), drive_info(world), samples, tmp_path)
    documents = [json.loads(path.read_text()) for path in folder.glob("annotations/*.json")]
    listed = {(i["sample"], i["sensor"]): i["id"] for d in documents for i in d["images"]}
    found = {
        (sample.index, camera): int(detection_target(SampleView(sample), camera)[1]["image_id"])
        for sample in samples
        for camera in sample.truth
    }
    assert found == listed
    assert len(set(found.values())) == 12


def test_keypoints_as_numbers_of_pixels_are_half_a_pixel_less(world: Any, tmp_path: Path) -> None:
    """Detectron2 adds 0.5; mirrored as width - 1 - x, they stay with the mirrored image."""
    found = {}
    for kind in ("places", "pixels"):
        exporter = Coco(keypoints=kind)
        folder = world.export(exporter, world.info(7), world.samples, tmp_path / kind)
        document = json.loads((folder / "annotations/pedestrian_keypoints_train.json").read_text())
        found[kind] = np.array([row["keypoints"] for row in document["annotations"]])
        assert ("keypoints" in document["info"]) == (kind == "pixels")
    places, pixels = (found[kind].reshape(-1, 3) for kind in ("places", "pixels"))
    seen = places[:, 2] > 0
    assert 0 < seen.sum() < len(seen)
    np.testing.assert_allclose(pixels[seen, :2] + 0.5, places[seen, :2], atol=1e-9)
    np.testing.assert_allclose((160 - 1 - pixels[seen, 0]) + 0.5, 160 - places[seen, 0], atol=1e-9)
    assert (pixels[~seen] == 0).all()
    assert (pixels[:, 2] == places[:, 2]).all()


def test_targets_of_keypoints_have_one_skeleton(world: Any, tmp_path: Path) -> None:
    """The same points as the file of the category; a model of 17 points gets none of a car's."""
    info = world.info(7)
    folder = world.export(Coco(), info, world.samples, tmp_path)
    document = json.loads((folder / "annotations/pedestrian_keypoints_train.json").read_text())
    sample = SampleView(world.samples[0])
    with pytest.raises(ConfigError, match="different keypoints: car, pedestrian; name one"):
        keypoint_target(sample)
    _, target = keypoint_target(sample, category="pedestrian")
    rows = [a for a in document["annotations"] if a["image_id"] == int(target["image_id"])]
    expected = np.array([row["keypoints"] for row in rows], np.float32).reshape(-1, 17, 3)
    assert len(expected) > 0
    np.testing.assert_allclose(target["keypoints"], expected, atol=1e-3)
    assert target["boxes"][:, :2].tolist() == [row["bbox"][:2] for row in rows]
    assert keypoint_target(sample, category="crate")[1]["keypoints"].shape == (0, 0, 3)
