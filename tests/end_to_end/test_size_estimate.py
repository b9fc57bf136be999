"""Estimated against written bytes: a disk that is too small is refused before the first sample."""

from pathlib import Path

import pytest

import gen_data
from gen_data.assemble.config import load_config
from gen_data.assemble.size_estimate import FILE_BYTES, estimate_point_bytes
from gen_data.core.capture import POINT


def test_every_ray_and_every_selected_pixel_counts_as_a_point() -> None:
    """A VLP-16 fires 16 lasers every 55.296 us (its manual), 100 ms a turn; every eighth pixel."""
    estimate = estimate_point_bytes(load_config("indoor_lidar.yaml"))

    assert estimate == FILE_BYTES + POINT.itemsize * 16 * round(0.1 / 55.296e-6)
    estimate = estimate_point_bytes(load_config("tabletop.yaml"))

    assert estimate == FILE_BYTES + POINT.itemsize * 80 * 60


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "size_px"),
    [
        ("tabletop.yaml", "[320, 240]"),  # its scanner reads the depth of the camera
        ("robot_vacuum.yaml", "[64, 48]"),
        ("carla_table.yaml", "[64, 48]"),
    ],
)
def test_scans_take_at_least_half_of_what_is_estimated(
    config: str, size_px: str, tmp_path: Path
) -> None:
    """Rays into the sky return nothing: of `carla`, a third."""
    overrides = ["exporters=[]", "annotations=[]", f"sensors[0].size_px={size_px}"]
    gen_data.generate(config, 1, out=tmp_path / "data", overrides=overrides, workers=0)

    written = sum(p.stat().st_size for p in (tmp_path / "data/shards").rglob("*/points/*.npy"))
    estimate = estimate_point_bytes(load_config(config, overrides=overrides))
    assert 1.0 <= estimate / written <= 2.0
