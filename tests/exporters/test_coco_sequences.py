"""Sequences in COCO's files: ids of sequences, frames and tracks."""

import json
from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters.coco import Coco


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


def test_coco_of_single_images_has_no_tracks(world: Any, tmp_path: Path) -> None:
    """A view of one instant is no sequence."""
    folder = world.export(Coco(), world.info(7), world.samples, tmp_path)
    data = json.loads((folder / "annotations/instances_train.json").read_text())

    assert "sequence_id" not in data["images"][0]
    assert "track_id" not in data["annotations"][0]
