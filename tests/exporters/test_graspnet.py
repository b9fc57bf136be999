"""Arrays of GraspNet and SuctionNet, read as their APIs index them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.sample import Grasp, Sample, Suction
from gen_data.core.se3 import SE3
from gen_data.exporters.graspnet import GraspNet

POSE = SE3.about_z(0.3, (5.0, 1.0, 0.4))


def with_grasps(world: Any) -> Sample:
    """A frame with a grasp and a suction of its first object, and a grasp of a hidden one."""
    first: Sample = world.samples[0]
    seen = first.truth["color"].objects[0].instance.instance_id
    grasps = (Grasp(seen, POSE, 0.05, 0.9), Grasp(999, POSE, 0.04, 0.8))
    suctions = (Suction(seen, (5.0, 1.0, 0.5), (0.0, 0.0, 1.0), 0.7),)
    assert first.frame is not None
    return replace(first, frame=replace(first.frame, grasps=grasps, suctions=suctions))


def assert_rows(folder: Path, sample: Sample) -> None:
    """Columns as graspnetAPI and suctionnetAPI have them, in the camera frame."""
    seen = sample.truth["color"].objects[0].instance.instance_id
    (row,) = np.load(folder / "train/000000000_color_grasps.npy")
    (cup,) = np.load(folder / "train/000000000_color_suctions.npy")
    T_world_camera = sample.truth["color"].camera.T_world_camera.matrix()
    assert (row.dtype, row[:4]) == (np.float32, pytest.approx([0.9, 0.05 + 2 * 0.003, 0.02, 0.015]))
    T_camera_grasp = np.eye(4)
    T_camera_grasp[:3, :3], T_camera_grasp[:3, 3] = row[4:13].reshape(3, 3), row[13:16]
    assert pytest.approx(POSE.matrix(), abs=1e-5) == T_world_camera @ T_camera_grasp
    assert row[16] == seen
    assert cup[0] == pytest.approx(0.7)
    assert T_world_camera[:3, :3] @ cup[1:4] == pytest.approx([0.0, 0.0, 1.0], abs=1e-5)
    assert T_world_camera @ [*cup[4:7], 1.0] == pytest.approx([5.0, 1.0, 0.5, 1.0], abs=1e-5)
    assert cup[7] == seen


def test_rows_are_in_the_camera_frame_of_visible_objects(world: Any, tmp_path: Path) -> None:
    """An image without grasps has empty arrays."""
    graspable = with_grasps(world)
    samples = [graspable, *world.samples[1:]]
    folder = world.export(GraspNet(), world.info(7), samples, tmp_path)
    assert_rows(folder, graspable)
    assert np.load(folder / "train/000000003_color_grasps.npy").shape == (0, 17)
    assert np.load(folder / "train/000000003_color_suctions.npy").shape == (0, 8)
    # Ignored objects have none either.
    folder = world.export(GraspNet(), world.info(1), [world.ignoring(graspable)], tmp_path / "b")
    assert np.load(folder / "train/000000000_color_grasps.npy").shape == (0, 17)
    assert np.load(folder / "train/000000000_color_suctions.npy").shape == (0, 8)
