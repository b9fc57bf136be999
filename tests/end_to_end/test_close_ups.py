"""Photographs of objects have the size in the image that annotated photographs have."""

import numpy as np
import pytest

from gen_data import Dataset

SMALL = ("views_per_scene=1", "sensors.landscape.size_px=[160,120]",
         "sensors.portrait.size_px=[120,160]")  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "group"), [("closeup.yaml", "clutter"), ("handheld.yaml", "held")]
)
def test_the_longer_side_of_most_boxes_is_a_third_to_nine_tenths_of_the_image(
    config: str, group: str
) -> None:
    """Annotated close-ups of cups, bottles and fruit have a median of 0.51 to 0.69."""
    shares = [
        max(seen.box.width_px, seen.box.height_px) / 160
        for sample in Dataset(config, n=8, overrides=SMALL)
        for camera in sample.cameras.values()
        for seen in camera.objects
        if seen.box is not None and seen.instance.name.startswith(f"{group}/")
    ]
    low, middle, high = np.quantile(shares, (0.25, 0.5, 0.9))

    assert len(shares) > 12
    assert low > 0.3
    assert 0.45 < middle < 0.69
    assert high < 0.95
