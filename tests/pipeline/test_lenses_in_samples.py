"""A whole sample through a fisheye: labels that agree with each other and with OpenCV."""

from collections.abc import Iterator

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.sample import Sample
from tests import opencv

SMALL = (
    "sensors.color.size_px=[200, 160]",
    "sensors.color.lens={model: kannala_brandt, k1: 0.02, k2: -0.005}",
    "randomizers.lens.hfov_deg={uniform: [90, 110]}",
    "randomizers.lens.lens={k1: {uniform: [0.0, 0.04]}}",
    "exporters=[{type: coco}]",
)


@pytest.fixture(scope="module")
def samples() -> Iterator[list[Sample]]:
    with open_pipeline(load_config("tabletop", overrides=SMALL)) as pipeline:
        yield [pipeline.sample(index) for index in range(2)]


def test_lenses_differ_between_views(samples: list[Sample]) -> None:
    """Each is drawn, and is the one that the labels speak of."""
    first, second = (sample.truth["color"].camera.intrinsics for sample in samples)

    assert first.lens.model == second.lens.model == "kannala_brandt"
    assert first.lens.coefficients != second.lens.coefficients
    assert samples[0].scene.camera("color").intrinsics == first


def test_objects_are_where_opencv_projects_their_boxes(samples: list[Sample]) -> None:
    """Corners of the 3D box surround the amodal silhouette, within two pixels of it."""
    looked_at = 0
    for sample in samples:
        truth = sample.truth["color"]
        k = truth.camera.intrinsics
        for item in truth.objects:
            assert item.box3d_camera is not None
            assert item.box is not None
            corners = item.box3d_camera.corners()
            if corners[:, 2].min() < 0.05:
                continue
            # Edges bow outwards by less than two pixels at this size.
            places = opencv.places(k, corners)
            low, high = places.min(axis=0) - 2.0, places.max(axis=0) + 2.0
            assert low[0] <= item.box.x_min and item.box.x_max <= high[0]
            assert low[1] <= item.box.y_min and item.box.y_max <= high[1]
            looked_at += 1
    assert looked_at >= 6
