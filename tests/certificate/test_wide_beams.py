"""Points of laser beams of several rays."""

from pathlib import Path

import pytest

import gen_data
from gen_data.lab.certificate.finding import Status
from tests.wheels import needs_open3d

SMALL = ("steps_per_scene=2", "shard_size=2", "sensors.image_02.size_px=[64, 32]",
         "sensors.image_03.size_px=[64, 32]", "exporters=[{type: coco}]",
         "annotations=[boxes2d, boxes3d]")  # fmt: skip


@pytest.mark.slow
@needs_open3d
@pytest.mark.parametrize("divergence", ["edges", "true"])
def test_each_point_is_on_a_ray_of_its_beam(divergence: str, tmp_path: Path) -> None:
    """Of a drive with KITTI's rig; no point contradicts."""
    given = (*SMALL, f"sensors.velodyne.divergence={divergence}")
    gen_data.generate("kitti_rig.yaml", 2, out=tmp_path / "out", workers=0, seed=5, overrides=given)
    certificate = gen_data.certify(tmp_path / "out", samples=2, rays=2000, scenes=0)

    (found,) = (f for claim, f in certificate.findings() if claim.name == "laser points")
    assert found.status is Status.PASSED
    assert int(found.figures["points"]) > 200
    assert found.figures["contradictions"] == 0
