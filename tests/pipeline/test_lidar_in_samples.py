"""Laser scanners in samples of the shipped rig."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.sample import Sample

SMALL = (
    "sensors[0].size_px=[128, 64]",
    "sensors[1].model=VLP-16",
    "sensors[1].ideal=true",
    "sensors[1].motion_distortion=none",
    "sensors[1].divergence=false",
    "sensors[2].size_px=[64, 32]",
)


@pytest.fixture(scope="module")
def samples() -> Iterator[list[Sample]]:
    """Two instants of a street."""
    with PipelineFactory(load_config("kitti_rig.yaml", overrides=SMALL), n=1)() as pipeline:
        yield [pipeline.sample(0), pipeline.sample(1)]


@pytest.mark.slow
def test_the_scanner_is_where_kitti_has_it_at_every_instant(samples: list[Sample]) -> None:
    """0.27 m behind, 0.08 m above and 0.06 m right of the camera; axes as KITTI's calibration.

    R0_rect * Tr_velo_to_cam of 2011_09_26; angles are stated to a tenth of a degree.
    """
    for sample in samples:
        camera = sample.scene.camera("image_02").T_world_camera
        scanner = sample.scene.lidar("velodyne").T_world_lidar
        T_camera_lidar = (camera.inverse() @ scanner).matrix()
        expected = [[2.348e-4, -0.99994, -0.01056], [0.01045, 0.01057, -0.99989],
                    [0.99995, 1.244e-4, 0.01045]]  # fmt: skip
        np.testing.assert_allclose(T_camera_lidar[:3, :3], expected, atol=1e-3)
        np.testing.assert_allclose(T_camera_lidar[:3, 3], [0.06, -0.08, -0.27], atol=1e-5)
    one, two = (s.scene.lidar("velodyne").T_world_lidar.translation_m for s in samples)
    assert one != two


@pytest.mark.slow
def test_every_labelled_point_lies_in_the_box_of_its_instance(samples: list[Sample]) -> None:
    """To two millimetres, without noise, and as far as it moves during half a sweep."""
    checked = 0
    for sample in samples:
        points = sample.capture.clouds["velodyne"].points
        p_world = sample.scene.lidar("velodyne").T_world_lidar.apply(points["position_m"])
        for thing in sample.scene.instances:
            mine = p_world[points["instance_id"] == thing.instance_id]
            local = thing.T_world_instance.inverse().apply(mine)
            slack_m = 2e-3 + 0.06 * math.hypot(*thing.twist.velocity_m_s)
            assert (local > np.asarray(thing.box_min_m) - slack_m).all()
            assert (local < np.asarray(thing.box_max_m) + slack_m).all()
            checked += len(mine)
    assert checked > 1000


@pytest.mark.slow
def test_objects_know_how_many_points_are_on_them(samples: list[Sample]) -> None:
    """By scanner; the same number as in the cloud."""
    counted = 0
    for sample in samples:
        ids = sample.capture.clouds["velodyne"].points["instance_id"]
        for thing in sample.truth["image_02"].objects:
            assert thing.lidar_points == {
                "velodyne": int((ids == thing.instance.instance_id).sum())
            }
            counted += thing.lidar_points["velodyne"]
    assert counted > 0
