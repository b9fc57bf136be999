"""SemanticKITTI: sequences, poses and classes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.scene_time import scene_at
from gen_data.exporters.semantickitti import SemanticKitti
from tests.exporters.drives import calibration, drive_info, stems


def poses(folder: Path) -> list[Any]:
    """Matrices [4, 4] of ``poses.txt``."""
    rows = [line.split() for line in (folder / "poses.txt").read_text().splitlines()]
    return [np.vstack([np.array(r, float).reshape(3, 4), [0, 0, 0, 1]]) for r in rows]


def test_semantic_sequences_have_poses_of_the_drive_and_points_that_stay_in_the_world(
    exported: Any, world: Any, samples: Any
) -> None:
    """Tr^-1 pose Tr moves the scanner along the circle; times are a step apart."""
    folder = exported(SemanticKitti())
    assert stems(folder / "sequences") == ["00", "01"]
    assert (folder / "split.yaml").read_text() == "split:\n  train: [0]\n  valid: [1]\n  test: []\n"
    sequence = folder / "sequences/01"
    Tr = np.vstack([calibration(sequence / "calib.txt")["Tr"].reshape(3, 4), [0, 0, 0, 1]])
    for k, pose in enumerate(poses(sequence)):
        moved = np.linalg.inv(Tr) @ pose @ Tr
        np.testing.assert_allclose(moved, world.ego_pose(0.1 * k).matrix(), atol=3e-6)
    times = [float(t) for t in (sequence / "times.txt").read_text().split()]
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert (sequence / "scans.txt").read_text().split() == ["4", "5", "6", "7"]
    # The crate's points, moved by the poses, stay within its box in all scans.
    sequence = folder / "sequences/00"
    Tr = np.vstack([calibration(sequence / "calib.txt")["Tr"].reshape(3, 4), [0, 0, 0, 1]])
    seen = 0
    for k, pose in enumerate(poses(sequence)):
        points = np.fromfile(sequence / f"velodyne/{k:06d}.bin", "<f4").reshape(-1, 4)
        mine = points[samples[k].capture.clouds["top"].points["instance_id"] == 4]
        local = (np.linalg.inv(Tr) @ pose @ Tr) @ np.column_stack(
            [mine[:, :3], np.ones(len(mine))]
        ).T
        centre = np.array([14.0, 4.0, 0.45 - 1.73])
        assert np.linalg.norm(local[:3].T - centre, axis=1).max(initial=0.0) < 1.0
        seen += len(mine)
    assert seen > 10


def test_poses_are_those_of_the_sweeps_which_may_be_later_than_their_steps(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """A method that joins scans moves points by Tr^-1 pose Tr of the instant when they were hit."""
    late_s = [0.0, 0.02, 0.05, 0.01]
    drive = []
    for sample in samples:
        scene = scene_at(sample.scene, sample.scene.time_s + late_s[sample.step_index])
        cloud = sample.capture.clouds["top"]
        cloud = replace(cloud, lidar=scene.lidar("top"), time_s=scene.time_s)
        capture = replace(sample.capture, clouds={"top": cloud})
        drive.append(replace(sample, capture=capture, instants={"top": scene}))
    folder = world.export(SemanticKitti(), drive_info(world), drive, tmp_path) / "sequences/00"
    Tr = np.vstack([calibration(folder / "calib.txt")["Tr"].reshape(3, 4), [0, 0, 0, 1]])
    for k, pose in enumerate(poses(folder)):
        moved = np.linalg.inv(Tr) @ pose @ Tr
        # The trajectory has knots of the circle every 0.1 s.
        expected = world.ego_pose(0.1 * k + late_s[k]).matrix()
        np.testing.assert_allclose(moved, expected, atol=3e-3)


def test_semantic_classes_of_things_that_move(exported: Any) -> None:
    """Moving car 252, moving person 254, with the instance ids of the scene in every scan."""
    for path in sorted((exported(SemanticKitti()) / "sequences/00/labels").iterdir()):
        labels = np.fromfile(path, "<u4")
        assert {(int(v) & 0xFFFF, int(v) >> 16) for v in labels} == {
            (252, 1), (254, 2), (99, 0), (40, 0)
        }  # fmt: skip
