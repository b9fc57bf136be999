"""Recovery of a camera's parameters from photographs that were made with known ones."""

import math

import numpy as np
import pytest

from gen_data.config.distributions import Constant
from gen_data.lab.matching.camera_fit import fit_camera, measure_photo
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities import blur, exposure, jpeg_quality, noise
from gen_data.lab.matching.recordings import Photo
from gen_data.lab.matching.results import FittedQuantity, Part
from gen_data.lab.matching.simulation import photograph
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from tests.matching.scenes import exposures

BASE = ImagePipeline.model_validate({"preset": "industrial", "focus": None})
TRUTH = ImagePipeline.model_validate({
    "preset": "industrial",
    "focus": None,
    "exposure_compensation_ev": {"normal": {"mean": -0.7, "stddev": 0.4, "clip": (-2.0, 1.0)}},
    "contrast": 1.375,
    "saturation": 0.75,
    "warmth_ev": 0.3,
    "blur_px": 1.0,
    "image_sensor": {"full_well_e": 3000.0, "read_noise_e": 12.0},
    "jpeg_quality": {"choice": {"92": 3.0, "95": 1.0}},
})  # fmt: skip


def fit_to(truth: ImagePipeline, count: int, base: ImagePipeline, scenes: int) -> Part:
    """A fit of some scenes to photographs of other ones."""
    photos = [
        measure_photo(Photo(f"{k}.png", photograph(one, truth).rgb, (320, 240), None))
        for k, one in enumerate(exposures(range(1000, 1000 + count), truth))
    ]
    return fit_camera(exposures(range(scenes), base), photos, 0)


@pytest.fixture(scope="module")
def fitted() -> Part:
    return fit_to(TRUTH, 30, BASE, 24)


def row(part: Part, name: str) -> FittedQuantity:
    return next(one for one in part.quantities if one.name == name)


@pytest.mark.parametrize(
    ("name", "truth", "tolerance"),
    [("exposure", -0.7, 0.2), ("tone", 1.375, 0.15), ("white balance", 0.3, 0.06),
     ("saturation", 0.75, 0.1), ("blur", 1.0, 0.06), ("noise", 3000.0, 1000.0)],
)  # fmt: skip
@pytest.mark.slow
def test_known_parameters_return(fitted: Part, name: str, truth: float, tolerance: float) -> None:
    """Within a tolerance, and within the stated interval.

    Six intervals of 95 % hold all six truths in 74 of 100 fits; Bonferroni's are 1.35 times
    as wide.
    """
    found = row(fitted, name)
    assert found.mean == pytest.approx(truth, abs=tolerance)
    assert found.low is not None
    assert found.high is not None
    assert abs(truth - 0.5 * (found.low + found.high)) <= 1.35 * 0.5 * (found.high - found.low)
    assert found.is_fitted


@pytest.mark.slow
def test_values_before_a_fit_are_the_ones_of_the_configuration() -> None:
    """No blur was 0.4 px, where the search begins, and no noise the one of a default sensor."""
    none = ImagePipeline.model_validate({"image_sensor": None, "focus": None})
    made = BASE.model_copy(update={"blur_px": Constant(0.25)})
    for pipeline, expected in ((none, (0.0, None, None)), (made, (0.25, 32500.0, 7.0))):
        part = fit_to(pipeline, 2, pipeline, 2)
        rows = tuple(row(part, name).before for name in ("blur", "noise", "read noise"))
        assert rows == expected


@pytest.mark.slow
def test_read_noise_is_recovered() -> None:
    """From sixty pictures, by 32 scenes, within 25 per cent, and within the stated intervals.

    Sets scatter by 20 per cent: contents of pictures look like contrast, and that like noise.
    """
    truth = {"full_well_e": 3000.0, "read_noise_e": 12.0}
    real = ImagePipeline.model_validate(
        {"preset": "industrial", "focus": None, "image_sensor": truth}
    )
    part = fit_to(real, 60, BASE, 32)
    for name, value in (("read noise", 12.0), ("noise", 3000.0)):
        found = row(part, name)
        assert found.is_fitted
        assert found.mean == pytest.approx(value, rel=0.25)
        assert found.low is not None
        assert found.high is not None
        assert found.low < value < found.high
    fields = {one.change.field for one in part.fields}
    assert "image_pipeline.image_sensor.read_noise_e" in fields


@pytest.mark.slow
def test_spread_of_exposures_and_jpeg_quality_are_found_and_pictures_nearer(fitted: Part) -> None:
    """Its deviation of 0.4 stops is told from that of scenes; blur, which has none, is a number."""
    found = row(fitted, "exposure")
    assert found.spread == pytest.approx(0.4, abs=0.12)
    assert found.value["normal"]["stddev"] == pytest.approx(found.spread, rel=1e-3)
    assert row(fitted, "blur").value == pytest.approx(1.0, abs=0.06)
    # Each of the two qualities, as often as it occurred.
    found = row(fitted, "JPEG quality").value["choice"]
    assert set(found) == {"92", "95"}
    assert sum(found.values()) == 30
    # Means of every fitted statistic, in units of the distance before; means have errors.
    for one in fitted.statistics[:6]:
        before, after = (abs(group.mean() - one.real.mean()) for group in (one.before, one.after))
        error = math.hypot(*(g.std() / math.sqrt(len(g)) for g in (one.real, one.after)))
        assert after < 0.5 * before + error, one.name


def test_nothing_is_fitted_without_photographs_and_flat_ones_have_no_more() -> None:
    """The reason is in every row."""
    part = fit_camera(exposures([1], BASE), [], 0)
    assert not part.fields
    assert {one.note for one in part.quantities} == {"no photographs"}
    # A grey card has a level and neither edges nor colours; black and white have no noise.
    grey, black, white = (Picture(np.full((96, 128, 3), v, np.uint8)) for v in (118, 0, 255))
    assert exposure.measure(grey) == pytest.approx(np.log2(0.1812 + 1.0 / 512.0), abs=0.01)
    assert np.isnan(blur.measure(grey))
    assert np.isnan(noise.measure(black))
    assert np.isnan(noise.measure(white))


@pytest.mark.slow
def test_a_camera_without_sensor_gets_none_for_pictures_without_noise() -> None:
    """Nor a demosaicing, which would blur."""
    part = fit_to(ImagePipeline(), 8, ImagePipeline(), 8)
    assert not row(part, "noise").is_fitted
    assert "no noise" in row(part, "noise").note
    assert not any("image_sensor" in one.change.field for one in part.fields)


@pytest.mark.parametrize("quality", [97, 92, 85, 75, 60, 40, 25])
def test_quality_is_read_from_pixels_exactly(quality: int) -> None:
    """Quantised coefficients lie at multiples of the steps of one quality only."""
    (one,) = exposures([5], BASE)
    picture = photograph(one, BASE.model_copy(update={"jpeg_quality": Constant(float(quality))}))
    assert jpeg_quality.pixel_quality(picture) == quality


@pytest.mark.parametrize("electrons", [2000.0, 1e6])
def test_pictures_without_compression_show_none(electrons: float) -> None:
    """With noise and without."""
    (one,) = exposures([5], BASE)
    assert np.isnan(
        jpeg_quality.pixel_quality(photograph(one, noise.NOISE.apply(BASE, np.log2(electrons))))
    )


@pytest.mark.parametrize("quality", [5, 30, 50, 75, 90, 99])
def test_quality_is_read_from_the_tables_of_a_file(quality: int) -> None:
    """As Pillow's libjpeg writes them."""
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.zeros((16, 16, 3), np.uint8)).save(stream, "JPEG", quality=quality)
    with Image.open(io.BytesIO(stream.getvalue())) as image:
        steps = np.array(image.quantization[0])  # type: ignore[attr-defined]
    assert jpeg_quality.table_quality(steps) == quality


@pytest.mark.parametrize("stddev_px", [0.7, 1.0, 1.5, 2.5])
def test_blur_of_a_step_is_its_variance(stddev_px: float) -> None:
    """A blurred edge between two greys; pixels add 1/12, differences of neighbours 1/3."""
    import cv2

    wide = np.zeros((128, 1280), np.float32) + 60.0
    wide[:, 643:] = 180.0
    step = cv2.resize(
        cv2.GaussianBlur(wide, (0, 0), 10.0 * stddev_px), (128, 128), interpolation=cv2.INTER_AREA
    )
    picture = Picture(np.repeat(np.rint(step)[..., None], 3, axis=-1).astype(np.uint8))
    assert blur.measure(picture) == pytest.approx(stddev_px**2 + 1.0 / 12.0 + 1.0 / 3.0, rel=0.1)
