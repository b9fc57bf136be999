"""Formats whose images are rectified refuse cameras that are not."""

from __future__ import annotations

from typing import Any

import pytest

from gen_data.exporters import TABLE
from gen_data.generator.core.errors import ConfigError


@pytest.mark.parametrize("kind", ["kitti", "kitti_raw", "kitti_tracking", "semantickitti"])
def test_no_form_of_kitti_takes_a_fisheye(world: Any, kind: str) -> None:
    """Their calibrations have a matrix and no distortion; a pinhole is taken."""
    exporter = TABLE.load(kind).model_validate({"type": kind})

    exporter.check(world.info(4, lidars=("top",), lenses={"color": "pinhole"}))
    with pytest.raises(ConfigError, match=f"'{kind}': camera 'color' has a lens.*pinhole"):
        exporter.check(world.info(4, lidars=("top",), lenses={"color": "kannala_brandt"}))


@pytest.mark.parametrize("kind", ["coco", "motchallenge"])
def test_formats_of_image_boxes_take_any_lens(world: Any, kind: str) -> None:
    """Boxes and masks are where the lens puts them."""
    exporter = TABLE.load(kind).model_validate({"type": kind})

    assert exporter.check(world.info(4, lenses={"color": "kannala_brandt"})) is None
