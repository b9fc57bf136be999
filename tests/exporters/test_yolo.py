"""YOLO export, held against the samples; the slow test reads it with Ultralytics."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from PIL import Image

from gen_data.exporters.yolo import Yolo, inner_rectangle
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import drawn
from tests.exporters.test_labels import divided, truth_of

TASKS = ("detect", "segment", "pose", "obb")


def with_parts(world: Any) -> tuple[Any, list[Any]]:
    return world.info(8), [*world.samples, divided(world)]


@pytest.fixture(scope="module")
def samples(world: Any) -> list[Any]:
    return with_parts(world)[1]


dataset = made_of(Yolo(tasks=TASKS), with_parts)


def rows_of(task_folder: Path, split: str, stem: str) -> list[list[float]]:
    text = (task_folder / f"labels/{split}/{stem}.txt").read_text()
    return [[float(value) for value in line.split()] for line in text.splitlines()]


def objects_of(samples: list[Any], folder: Path) -> Iterator[tuple[list[float], Any]]:
    for sample in (s for s in samples if s.split == "train"):
        rows = rows_of(folder, "train", f"{sample.index:09d}_color")
        yield from zip(rows, truth_of(sample), strict=True)


def test_segments_are_outlines_of_the_mask(dataset: Path, samples: list[Any], world: Any) -> None:
    """Drawn by pycocotools and OpenCV, every polygon gives the mask back, also of two parts."""
    parts = 0
    for (number, *outline), thing in objects_of(samples, dataset / "segment"):
        assert world.categories[int(number)] == thing.category
        mask = thing.mask
        h, w = mask.shape
        points = np.array(outline).reshape(-1, 2) * [w, h]
        filled = cv2.fillPoly(np.zeros((h, w), np.uint8), [points.astype(np.int32)], 1)
        count, *_ = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
        parts = max(parts, count - 1)
        # A line between parts may round to further pixels.
        for picture in (drawn([points.ravel().tolist()], h, w), filled.astype(bool)):
            assert (picture != mask).sum() <= (0 if count == 2 else 60)
        np.testing.assert_allclose(np.abs(points - np.rint(points)), 0.02, atol=1e-4)
    assert parts >= 2


def test_rotated_boxes_enclose_their_masks(dataset: Path, samples: list[Any]) -> None:
    """Rectangles inside the image, never larger than the upright box, mostly smaller."""
    smaller = 0
    for row, thing in objects_of(samples, dataset / "obb"):
        h, w = thing.mask.shape
        corners = np.array(row[1:]).reshape(4, 2) * [w, h]
        assert (corners >= 0).all()
        assert (corners <= [w, h]).all()
        sides = np.roll(corners, -1, axis=0) - corners
        assert np.abs((sides * np.roll(sides, 1, axis=0)).sum(axis=1)).max() < 0.05
        y, x = np.nonzero(thing.mask)
        ends = np.concatenate([np.stack([x + dx, y + dy], 1) for dx in (0, 1) for dy in (0, 1)])
        for corner, side in zip(corners, sides, strict=True):
            offsets = (ends - corner) @ np.array([-side[1], side[0]]) / np.hypot(*side)
            assert offsets.min() > -0.01
        area = np.hypot(*sides[0]) * np.hypot(*sides[1])
        left, top, right, bottom = thing.box
        assert area <= (right - left) * (bottom - top) + 0.1
        smaller += area < 0.95 * (right - left) * (bottom - top)
    assert smaller > 3


def test_the_smallest_rectangle_is_opencvs_or_upright_if_it_leaves_the_image() -> None:
    """Far from the borders of the image nothing else is allowed."""
    points = np.array([[40, 40], [80, 60], [70, 80], [30, 60], [55, 60]])
    corners = inner_rectangle(points, 200, 200)
    _, size, _ = cv2.minAreaRect(points.astype(np.float32))
    sides = sorted(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)[:2])
    assert sides == pytest.approx(sorted(size), abs=1e-3)
    # A triangle in the corner of the image: upright, as the diagonal one reaches outside.
    points = np.array([[0, 0], [30, 0], [0, 30]])
    corners = inner_rectangle(points, 100, 100)
    assert sorted(map(tuple, corners.tolist())) == [(0, 0), (0, 30), (30, 0), (30, 30)]


def test_pose_has_the_people_with_their_keypoints(dataset: Path, samples: list[Any]) -> None:
    """One class; points that are not in the image are 0."""
    folder = dataset / "pose"
    data = yaml.safe_load((folder / "data.yaml").read_text())
    assert (data["names"], data["kpt_shape"]) == ({0: "pedestrian"}, [17, 3])
    assert data["flip_idx"] == [0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15]
    count = 0
    for sample in (s for s in samples if s.split == "train"):
        rows = rows_of(folder, "train", f"{sample.index:09d}_color")
        things = sample.truth["color"].objects
        people = [t for t in things if t.instance.category == "pedestrian" and t.box]
        for row, thing in zip(rows, people, strict=True):
            points = np.array(row[5:]).reshape(-1, 3) * [160, 120, 1]
            want = [
                (*p.image_px, p.visibility) if p.visibility else [0] * 3 for p in thing.keypoints
            ]
            np.testing.assert_allclose(points, want, atol=2e-3)
            count += 1
    assert count >= 5


def test_pose_of_another_category(world: Any, tmp_path: Path) -> None:
    """Named in the configuration; a category without keypoints has no folder."""
    for name, written in (("car", True), ("crate", False)):
        exporter = Yolo(tasks=("pose",), pose_category=name)
        folder = world.export(exporter, world.info(7), world.samples, tmp_path / name)
        assert (folder / "pose/data.yaml").exists() is written
    data = yaml.safe_load((tmp_path / "car/dataset/pose/data.yaml").read_text())
    assert (data["names"], data["flip_idx"]) == ({0: "car"}, [1, 0, 3, 2, 5, 4, 7, 6])


@pytest.mark.parametrize(
    ("names", "flipped"),
    [(("wheelLeft", "wheelRight", "lamp.L", "lamp.R"), [1, 0, 3, 2]),
     (("Left wheel", "Right wheel", "LEFT", "RIGHT"), [1, 0, 3, 2]),
     (("left-1", "right-1", "L1", "R1"), [1, 0, 2, 3]),
     (("bright", "blight", "l_rear", "left"), [0, 1, 2, 3])],
)  # fmt: skip
def test_left_and_right_of_own_keypoints_change_places_in_mirrored_images(
    names: Any, flipped: Any, world: Any, tmp_path: Path
) -> None:
    """However their names join words; a point without another side stays."""

    def renamed(things: Any) -> Any:
        return tuple(
            replace(
                thing,
                keypoints=tuple(
                    replace(point, name=name)
                    for point, name in zip(thing.keypoints, names, strict=True)
                ),
            )
            for thing in things
            if thing.instance.category == "car"
        )

    sample = world.with_objects(world.samples[0], renamed)
    folder = world.export(Yolo(tasks=("pose",)), world.info(1), [sample], tmp_path)
    data = yaml.safe_load((folder / "pose/data.yaml").read_text())
    assert (data["kpt_names"], data["flip_idx"]) == ({0: [*names]}, flipped)


def test_a_missing_split_is_said_in_the_file(world: Any, tmp_path: Path) -> None:
    folder = world.export(Yolo(tasks=("detect",)), world.info(2), world.samples[:2], tmp_path)
    text = (folder / "detect/data.yaml").read_text()
    assert "val: images/train  # the data set has no split val\n" in text
    assert "test:" not in text


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("task", TASKS)
def test_ultralytics_reads_it_without_repairs(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, task: str
) -> None:
    """No image or label is corrupt, missing or changed, and damaged ones are."""
    monkeypatch.setenv("YOLO_CONFIG_DIR", str(tmp_path))
    monkeypatch.setenv("YOLO_OFFLINE", "true")
    from ultralytics.data import utils

    monkeypatch.setattr(utils, "check_font", lambda font: None)  # no download

    folder = tmp_path / "copy"
    shutil.copytree(dataset / task, folder)
    data = utils.check_det_dataset(str(folder / "data.yaml"), autodownload=False)
    assert data["nc"] == (1 if task == "pose" else 3)

    images = sorted(str(path) for path in (folder / "images/train").iterdir())
    pose, shape = task == "pose", data.get("kpt_shape", (0, 0))

    def verify() -> list[Any]:
        pairs = zip(images, utils.img2label_paths(images), strict=True)
        return [
            utils.verify_image_label((image, label, "", pose, data["nc"], *shape, False))
            for image, label in pairs
        ]

    for image, result in zip(images, verify(), strict=True):
        with Image.open(image) as picture:
            assert result[2] == picture.size[::-1]
        missing, found, empty, corrupt, message = result[5:]
        assert (missing, found, corrupt, message) == (0, 1, 0, "")
        assert empty == (len(result[1]) == 0)

    label = Path(utils.img2label_paths(images)[0])
    for damaged in (label.read_text().replace("0.", "3."), label.read_text() * 2):
        label.write_text(damaged)
        assert any(result[9] for result in verify())
