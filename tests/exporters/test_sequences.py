"""Behaviour common to all formats of sequences: missing readings and bad input."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters.coco import Coco
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.kitti_raw import KittiRaw
from gen_data.exporters.kitti_tracking import KittiTracking
from gen_data.exporters.motchallenge import MotChallenge
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.semantickitti import SemanticKitti
from tests.exporters.drives import DRIVE, drive_info, stems


def test_sensors_that_miss_a_step_have_no_files_there(
    world: Any, slow: Any, tmp_path: Path
) -> None:
    """In raw drives: the numbers of the frames stay, times are those of the files."""
    exporter = KittiRaw(image_03="right")
    drive = world.export(exporter, drive_info(world), slow, tmp_path) / DRIVE.format(1)

    assert stems(drive / "image_02/data") == [f"{k:010d}" for k in range(4)]
    for sensor in ("image_03", "velodyne_points"):
        assert stems(drive / sensor / "data") == ["0000000000", "0000000002"]
        lines = (drive / sensor / "timestamps.txt").read_text().splitlines()
        assert [line.split(":")[-1] for line in lines] == ["00.000000000", "00.200000000"]


def test_frames_are_numbered_by_the_camera_that_a_format_is_about(
    world: Any, slow: Any, tmp_path: Path
) -> None:
    """A camera at half the rate has half the frames, without gaps, at half the frame rate."""
    info = drive_info(world)
    mot = world.export(MotChallenge(camera="right"), info, slow, tmp_path / "m")
    tracking = world.export(KittiTracking(camera="right"), info, slow, tmp_path / "t")

    text = (mot / "street-train/street-0000/seqinfo.ini").read_text()
    assert "frameRate=5\nseqLength=2\n" in text
    rows = (tracking / "training/label_02/0001.txt").read_text().splitlines()
    assert {row.split()[0] for row in rows} == {"0", "1"}
    assert stems(tracking / "training/velodyne/0001") == ["000000", "000001"]


@pytest.mark.parametrize(
    "exporter", [Coco(), Kitti(camera="right"), SemanticKitti(), PointClouds(), Kitti()]
)
def test_every_format_can_do_without_some_readings(
    exporter: Any, world: Any, slow: Any, tmp_path: Path
) -> None:
    """Files are those of the steps that were read, and no others."""
    folder = world.export(exporter, drive_info(world), slow, tmp_path)
    even = ["000000", "000002", "000004", "000006"]

    if exporter.type == "coco":
        files = sorted(p.name for p in (folder / "train").iterdir())
        assert [name for name in files if "right" in name] == [
            "000000000_right.png", "000000002_right.png"
        ]  # fmt: skip
        assert len(files) == 6
    elif exporter.type == "semantickitti":
        assert (folder / "sequences/01/scans.txt").read_text().split() == ["4", "6"]
    elif exporter.type == "pointclouds":
        assert stems(folder / "top") == [*(f"000{name}" for name in even), "poses"]
    elif exporter.camera:
        assert stems(folder / "training/label_2") == stems(folder / "training/velodyne") == even
    else:
        assert len(stems(folder / "training/label_2")) == 8
        assert stems(folder / "training/velodyne") == even
