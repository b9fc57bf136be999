"""Behaviour common to all formats of sequences: missing readings and bad input."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.sample import Sample
from gen_data.core.scene import Camera
from gen_data.core.se3 import look_at
from gen_data.exporters.argoverse2 import Argoverse2
from gen_data.exporters.coco import Coco
from gen_data.exporters.control_clips import ControlClips
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.kitti_raw import KittiRaw
from gen_data.exporters.kitti_tracking import KittiTracking
from gen_data.exporters.motchallenge import MotChallenge
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.semantickitti import SemanticKitti
from tests.exporters.drives import DRIVE, drive_info, stems


@pytest.mark.slow
def test_sensors_that_miss_a_step_have_no_files(world: Any, slow: Any, tmp_path: Path) -> None:
    """In raw drives: the numbers of the frames stay, times are of the files."""
    exporter = KittiRaw(image_03="right")
    drive = world.export(exporter, drive_info(world), slow, tmp_path) / DRIVE.format(1)
    assert stems(drive / "image_02/data") == [f"{k:010d}" for k in range(4)]
    for sensor in ("image_03", "velodyne_points"):
        assert stems(drive / sensor / "data") == ["0000000000", "0000000002"]
        lines = (drive / sensor / "timestamps.txt").read_text().splitlines()
        assert [line.split(":")[-1] for line in lines] == ["00.000000000", "00.200000000"]


@pytest.mark.slow
def test_frames_are_numbered_by_the_formats_camera(world: Any, slow: Any, tmp_path: Path) -> None:
    """A camera at half the rate has half the frames, without gaps, at half the frame rate."""
    info = drive_info(world)
    mot = world.export(MotChallenge(camera="right"), info, slow, tmp_path / "m")
    tracking = world.export(KittiTracking(camera="right"), info, slow, tmp_path / "t")
    text = (mot / "street-train/street-0000/seqinfo.ini").read_text()
    assert "frameRate=5\nseqLength=2\n" in text
    rows = (tracking / "training/label_02/0001.txt").read_text().splitlines()
    assert {row.split()[0] for row in rows} == {"0", "1"}
    assert stems(tracking / "training/velodyne/0001") == ["000000", "000001"]


def test_a_sequence_ends_at_a_gap(world: Any, tmp_path: Path) -> None:
    """Trackers take frames of one sequence as neighbours; the rest has the last number."""
    info, kept = drive_info(world), [s for s in world.drive() if s.index not in {1, 7}]
    mot = world.export(MotChallenge(), info, kept, tmp_path / "m")
    tracking = world.export(KittiTracking(), info, kept, tmp_path / "t") / "training"
    clips = world.export(ControlClips(near_m=5.0, far_m=60.0), info, kept, tmp_path / "c")
    lengths = {p.name: len(stems(p / "img1")) for p in mot.glob("street-*/street-*")}
    assert lengths == {"street-0000": 1, "street-0001": 3, "street-0002": 2}
    assert (mot / "seqmaps/street-train.txt").read_text() == "name\nstreet-0000\nstreet-0002\n"
    assert (mot / "street-train/street-0002/seqinfo.ini").read_text().count("seqLength=2") == 1
    assert (tracking / "evaluate_tracking.seqmap.training").read_text() == (
        "0000 empty 000000 000001\n0001 empty 000000 000003\n0002 empty 000000 000002\n"
    )
    assert stems(tracking / "image_02/0002") == ["000000", "000001"]
    assert stems(tracking / "label_02") == ["0000", "0001", "0002"]
    facts = {p.parent.name: json.loads(p.read_text()) for p in clips.glob("*/*/clip.json")}
    samples = {name: row["samples"] for name, row in facts.items()}
    assert samples == {"000000": [0], "000001": [4, 5, 6], "000002": [2, 3]}


@pytest.mark.parametrize("exporter", [MotChallenge(), ControlClips(near_m=5.0, far_m=60.0)])
def test_every_second_frame_is_half_the_rate(exporter: Any, world: Any, tmp_path: Path) -> None:
    """A selection at even distances has no gap."""
    kept = [sample for sample in world.drive() if sample.index % 2]
    folder = world.export(exporter, drive_info(world), kept, tmp_path)
    texts = [p.read_text() for name in ("seqinfo.ini", "clip.json") for p in folder.rglob(name)]
    assert len(texts) == 2
    assert all(re.search(r"frameRate=5\n|\"rate_hz\": ?5\b", text) for text in texts)


@pytest.mark.parametrize(
    "exporter", [Coco(), Kitti(camera="right"), SemanticKitti(), PointClouds(), Kitti()]
)
def test_formats_may_lack_readings(exporter: Any, world: Any, slow: Any, tmp_path: Path) -> None:
    """There are files of the steps that were read, and no others."""
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


def with_a_camera_on_a_mast(sample: Sample) -> Sample:
    """The sample with the right camera 3 m above the start of the drive; it sorts first."""

    def moved(camera: Camera) -> Camera:
        if camera.name != "right":
            return camera
        return replace(camera, name="above", rig="", T_world_camera=MAST)

    def renamed(values: Mapping[str, Any]) -> dict[str, Any]:
        return {name.replace("right", "above"): value for name, value in values.items()}

    scene = replace(sample.scene, cameras=tuple(map(moved, sample.scene.cameras)))
    readings = {
        name: replace(reading, camera=moved(reading.camera), sensor=name)
        for name, reading in renamed(sample.capture.readings).items()
    }
    truth = {n: replace(t, camera=moved(t.camera)) for n, t in renamed(sample.truth).items()}
    capture = replace(sample.capture, readings=readings)
    cameras = ("above", "left")
    return replace(sample, scene=scene, capture=capture, truth=truth, cameras=cameras)


MAST = look_at((0.0, 0.0, 3.0), (10.0, 0.0, 1.0))
OFF_THE_RIG = {
    "argoverse2": Argoverse2(),
    "kitti_raw": KittiRaw(image_02="above"),
    "kitti_tracking": KittiTracking(camera="above"),
    "semantickitti": SemanticKitti(camera="above"),
}


@pytest.mark.parametrize("name", OFF_THE_RIG)
def test_a_camera_that_the_scanner_drives_away_from_is_refused(
    name: str, world: Any, tmp_path: Path
) -> None:
    """One calibration cannot hold for all frames: readers would take points to the first one's."""
    info = world.info(8, ("above", "left"), ("top",), steps_per_scene=4)
    samples = [with_a_camera_on_a_mast(sample) for sample in world.drive()]
    with pytest.raises(ConfigError, match=r"different carriers.*one calibration for a sequence"):
        world.export(OFF_THE_RIG[name], info, samples, tmp_path)


def test_the_poses_of_a_drive_are_those_of_a_camera_on_the_scanners_rig(
    world: Any, tmp_path: Path
) -> None:
    """Without a choice, the first camera by name that drives along; the mast's stands still."""
    info = world.info(8, ("above", "left"), ("top",), steps_per_scene=4)
    samples = [with_a_camera_on_a_mast(sample) for sample in world.drive()]
    folders = [
        world.export(exporter, info, samples, tmp_path / str(k))
        for k, exporter in enumerate((SemanticKitti(), SemanticKitti(camera="left")))
    ]
    for name in ("poses.txt", "calib.txt"):
        chosen, named = ((f / "sequences/00" / name).read_text() for f in folders)
        assert chosen == named
    lines = (folders[0] / "sequences/00/poses.txt").read_text().splitlines()
    ways_m = [float(line.split()[11]) for line in lines]
    assert ways_m == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=0.01)
