"""Formats state the poses of sensors as wrong calibrations have them; labels are true.

The oracle is a data set whose sensors truly are where the wrong calibration states them to be, with
the same images and annotations: calibrations are equal to its ones, everything else to the clean
data set.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.capture import Capture, Channel
from gen_data.core.errors import ConfigError
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.exporters import TABLE
from tests.exporters.drives import drive_info
from tests.exporters.test_exporter_contract import files, given
from tests.exporters.test_mcap import messages
from tests.tiers import sampled

HALF_RAD = math.radians(1.0)
ERROR = SE3((0.03, -0.05, 0.02), (math.cos(HALF_RAD), 0.0, math.sin(HALF_RAD), 0.0))
"""2 degrees about the second axis, and centimetres."""
Change = Callable[[Any], Any]


def misstated(sensor: Any) -> Any:
    return replace(sensor, T_sensor_reported=ERROR)


def moved(sensor: Any) -> Any:
    """The sensor where the calibration states it to be."""
    names = [name for name in dir(sensor) if name.startswith(("T_rig_", "T_world_"))]
    decimals = {True: 9, False: 6}
    poses = {n: (getattr(sensor, n) @ ERROR).rounded(decimals["rig" in n]) for n in names}
    assert len(poses) == 2
    return replace(sensor, **poses)


def changed(sample: Sample, change: Change) -> Sample:
    """The sample with other cameras, laser scanners and devices; images and labels are the same."""

    def scene(s: Scene) -> Scene:
        kinds = {k: tuple(map(change, getattr(s, k))) for k in ("cameras", "lidars", "devices")}
        return replace(s, **kinds)  # type: ignore[arg-type]

    def each(readings: Any, field: str) -> Any:
        return {n: replace(r, **{field: change(getattr(r, field))}) for n, r in readings.items()}

    capture = sample.capture
    read = each(capture.readings, "camera"), each(capture.clouds, "lidar")
    return replace(
        sample,
        scene=scene(sample.scene),
        instants={n: scene(s) for n, s in sample.instants.items()},
        capture=Capture(*read, each(capture.tables, "device")),
        truth=each(sample.truth, "camera"),
    )


@dataclass(frozen=True)
class Stated:
    """A format with poses of sensors.

    Attributes:
        within: Patterns of the files that depend on them.
        take: Takes the poses out of a JSON document that also has labels, and returns them; None =
            no labels of these files depend on poses of sensors.
        own: Whether the data set is from the exporter contract rather than a drive.
        fields: Fields of the exporter.
    """

    within: tuple[str, ...] = ("*",)
    take: Callable[[Any], Any] | None = None
    own: bool = False
    fields: tuple[tuple[str, Any], ...] = ()


def of_captures(frame: Any) -> Any:
    return [[capture.pop(key) for key in ("position", "rotation")] for capture in frame["captures"]]


CALIBRATION = (("geometry", ("calibration",)),)
STATED = {
    "argoverse2": Stated(("*egovehicle_SE3_sensor.feather", "*sensors/lidar/*"), own=True),
    "bop": Stated(("*scene_camera.json",), own=True),
    "calibration": Stated(),
    "cityscapes": Stated(("camera/*",)),
    "coco": Stated(("*.json",)),
    "hdf5": Stated(),
    "huggingface": Stated(("*.parquet",)),
    "kitti": Stated(("*calib/*",)),
    "kitti_raw": Stated(("*/calib_*.txt",)),
    "kitti_tracking": Stated(("*calib/*",)),
    "lerobot": Stated(own=True, fields=CALIBRATION),
    "nuscenes": Stated(("*calibrated_sensor.json", "*sample_data.json")),
    "openlane": Stated(("*.json",), lambda frame: frame.pop("extrinsic")),
    "pointclouds": Stated(("*poses.jsonl",), lambda line: line.pop("T_world_lidar")),
    "rlds": Stated(own=True, fields=CALIBRATION),
    "scannet": Stated(("*pose/*",)),
    "semantickitti": Stated(("*calib.txt",)),
    "solo": Stated(("*.frame_data.json",), of_captures),
    "tables": Stated(("*poses.jsonl",), own=True),
    "tapvid": Stated(("*.npz",), own=True),
    "tfrecord": Stated(own=True),
    "webdataset": Stated(("*.tar",)),
}
REFUSED = {"kitti_stereo": "rectified pairs"}
SEPARATE = {"mcap": "test_transforms_of_mcap_lead_to_the_stated_poses"}


def exports(name: str, world: Any, folder: Path) -> tuple[Path, Path, Path]:
    """Data sets with true calibrations, with wrong ones, and with sensors truly moved."""
    how = STATED.get(name, Stated(own=name not in SEPARATE))
    exporter = TABLE.load(name)(**dict(how.fields))
    info, samples = given(exporter, world) if how.own else (drive_info(world), world.drive())
    kinds: tuple[Change, ...] = (lambda sensor: sensor, misstated, moved)
    made = [
        world.export(exporter, info, [changed(s, kind) for s in samples], folder / str(k))
        for k, kind in enumerate(kinds)
    ]
    return made[0], made[1], made[2]


def parts(name: str, folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Contents that calibrations determine, and all others, by file."""
    poses: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for file, data in files(folder).items():
        if not any(fnmatchcase(file, pattern) for pattern in STATED[name].within):
            others[file] = data
        elif (take := STATED[name].take) is None:
            poses[file] = data
        else:
            documents = [json.loads(text) for text in data.decode().splitlines()]
            poses[file] = [take(document) for document in documents]
            others[file] = documents
    return poses, others


@pytest.mark.parametrize("name", sampled(STATED, 3))
def test_stated_poses_are_those_of_the_calibration_and_nothing_else_differs(
    name: str, world: Any, tmp_path: Path
) -> None:
    clean, wrong, there = (parts(name, folder) for folder in exports(name, world, tmp_path))
    assert wrong[0] == there[0]
    assert wrong[0] != clean[0]
    assert wrong[1] == clean[1]


@pytest.mark.parametrize(
    "name", sampled([n for n in TABLE.names() if n not in STATED | REFUSED | SEPARATE], 6)
)
def test_formats_without_poses_of_sensors_do_not_depend_on_calibrations(
    name: str, world: Any, tmp_path: Path
) -> None:
    clean, wrong, _ = exports(name, world, tmp_path)
    assert files(wrong) == files(clean)


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("kitti_stereo", {}),
        ("kitti_raw", {"image_02": "left", "image_03": "right"}),
        ("kitti_tracking", {"camera": "left", "right_camera": "right"}),
        ("cityscapes", {"camera": "left", "right": "right"}),
    ],
)
def test_formats_of_rectified_images_refuse_wrong_calibrations_of_pairs(
    name: str, fields: dict[str, str], world: Any
) -> None:
    info, _ = world.pairs()
    lidar = drive_info(world).sensor("top")
    left, right = (replace(s, channels=(*s.channels, Channel.INSTANCE)) for s in info.sensors[:2])
    wrong = replace(right, faults=("extrinsics",))
    TABLE.load(name)(**fields).check(replace(info, sensors=(left, right, lidar)))
    with pytest.raises(ConfigError, match=r"'right': faults\.extrinsics: .*rectified.*nuscenes"):
        TABLE.load(name)(**fields).check(replace(info, sensors=(left, wrong, lidar)))


def test_transforms_of_mcap_lead_to_the_stated_poses(world: Any, tmp_path: Path) -> None:
    """From rigs to sensors; rigs are where they are, and all other messages are the same."""
    clean, wrong, there = (
        [m for path in sorted(folder.rglob("*.mcap")) for m in messages(path)]
        for folder in exports("mcap", world, tmp_path)
    )
    assert len(wrong) == len(there) == len(clean)
    stated = 0
    for before, after, oracle in zip(clean, wrong, there, strict=True):
        if before[0] == "/tf" and before[3].parent_frame_id == "rig/ego":
            assert str(after) == str(oracle)
            stated += 1
        else:
            assert str(after) == str(before)
    assert stated == 3 * 8
