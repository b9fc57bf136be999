"""Maps from above and lanes on disk."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.motion import Twist
from gen_data.core.sample import BorderTruth, MaskPx, MotionTruth, Sample
from gen_data.exporters.birdseye import Birdseye
from gen_data.exporters.coco import Coco
from gen_data.exporters.lane_lines import columns_at
from tests.exporters.label_readers import json_lines

BORDER = BorderTruth(
    "main/forward0:left", "road", ((80.5, 110.5), (80.5, 90.5), (60.5, 70.5)), (True, True, False)
)


@pytest.fixture
def sample(world: Any) -> Sample:
    """The world's first frame, with lanes and free space in its image and a motion."""
    first = world.samples[0]
    truth = first.truth["color"]
    twist = Twist((3.0, 4.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.5))
    moving = tuple(replace(t, motion=MotionTruth(twist, twist)) for t in truth.objects)
    free = MaskPx(10, 100, np.ones((15, 100), bool))
    truth = replace(truth, objects=moving, borders=(BORDER,), free_space=free)
    return replace(first, truth={"color": truth})


def test_layers_are_images_and_frames_tell_what_is_on_them(world: Any, tmp_path: Path) -> None:
    """One per sample and layer: the right half of the map is drivable."""
    folder = world.export(Birdseye(), world.info(7), world.samples, tmp_path)
    image = cv2.imread(str(folder / "drivable/000000004.png"), cv2.IMREAD_UNCHANGED)
    assert len(list((folder / "drivable").iterdir())) == 7
    assert image.shape == (80, 80)
    assert (image[:, :40] == 0).all()
    assert (image[:, 40:] == 255).all()
    # In order; borders near the map only, boxes by instance.
    frames = json_lines(folder / "frames.jsonl")
    assert [frame["index"] for frame in frames] == list(range(7))
    first = frames[0]
    assert (first["px_m"], first["size_px"]) == (0.5, 80)
    assert first["T_world_map"] == np.eye(4).tolist()
    assert first["borders"] == []  # its points are 90 m away, farther than 1.2 times 20 m
    boxes = {box["instance_id"]: box for box in first["boxes3d"]["ego"]}
    assert sorted(boxes) == [1, 2, 3, 4, 7]
    assert boxes[1]["category"] == "car"
    assert boxes[1]["center_m"] == pytest.approx([14.0, 3.0, 0.75], abs=1e-4)
    assert boxes[1]["size_m"] == pytest.approx([4.0, 1.8, 1.5])
    assert frames[3]["boxes3d"]["ego"] == []


def test_lanes_are_columns_at_tusimples_rows(world: Any, sample: Sample, tmp_path: Path) -> None:
    """Rows every ten pixels; pixel centres at whole numbers, so half a pixel less than ours."""
    folder = world.export(Birdseye(), world.info(1), [sample], tmp_path)
    (row,) = json_lines(folder / "lanes/color.jsonl")
    assert row["h_samples"] == list(range(0, 120, 10))
    assert row["lanes"] == [[-2] * 7 + [60.0, 70.0, 80.0, 80.0, 80.0]]
    assert row["borders"][0]["visible"] == [1, 1, 0]
    assert row["raw_file"] == "color/rgb/000000000.png"
    assert columns_at(np.array([(5.0, 12.0), (6.0, 18.0)]), [0, 10, 20]) == [-2, -2, -2]


def test_coco_tells_motion_lanes_and_free_space(world: Any, sample: Sample, tmp_path: Path) -> None:
    """As further keys, and only where they were annotated."""
    folder = world.export(Coco(), world.info(2), [sample, world.samples[1]], tmp_path)
    coco = json.loads((folder / "annotations/instances_train.json").read_text("utf-8"))
    image, other = coco["images"]
    motion = coco["annotations"][0]["motion"]
    assert image["lane_borders"][0]["points_px"] == [[80.5, 110.5], [80.5, 90.5], [60.5, 70.5]]
    assert image["free_space"]["size"] == [120, 160]
    assert {"lane_borders", "free_space"}.isdisjoint(other)
    assert motion["world"]["velocity_m_s"] == [3.0, 4.0, 0.0]
    assert motion["camera"]["angular_velocity_rad_s"] == [0.0, 0.0, 0.5]
    assert motion["speed_m_s"] == 5.0
    assert "ego" not in motion
