"""d' of objects: against closed formulas and against observers of simulated photographs."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.detectability import Detectability
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, ExpectedSignal, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, ObjectTruth
from gen_data.core.scene import Camera, Instance, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.exporters.label_map import AppliedLabelMap, LabelMap
from gen_data.sensors.camera.image_pipeline import ImagePipeline, develop, take_shot
from gen_data.sensors.camera.image_sensor import FILTERS, ImageSensor, expected_exposure, expose

W, H = 48, 40
CAMERA = Camera("color", SE3(), Intrinsics(W, H, 40.0, 40.0, W / 2, H / 2))
BALL = Instance(3, "ball", "ball", 1, "ball")
BOX = BoxPx(19, 13, 29, 25)
INSIDE = np.s_[BOX.y_min : BOX.y_max, BOX.x_min : BOX.x_max]
N = 10 * 12


def with_ball(behind: Any, value: Any) -> NDArray[np.float32]:
    """An image [h, w, c] of a background and a rectangle before it."""
    image = np.empty((H, W, np.size(value)), np.float32)
    image[:] = behind
    image[INSIDE] = value
    return image


def index(mean: NDArray[np.float32], stddev: NDArray[np.float32]) -> float:
    """The index of the rectangle."""
    ids = with_ball(0, 3)[..., 0].astype(np.uint16)
    signal = ExpectedSignal(mean, stddev)
    reading = SensorReading("color", CAMERA, {Channel.INSTANCE: ids}, signal=signal)
    truth = ObjectTruth(BALL, visible_px=N, box=BOX)
    found = Detectability().annotate(Scene("test"), reading, truth).detectability
    assert found is not None
    return found


def test_it_is_contrast_over_noise_times_the_root_of_the_number_of_values() -> None:
    """For even objects before even backgrounds; colours add up, variances are averaged."""
    noise = with_ball(0.02, 0.02)
    assert index(with_ball(0.30, 0.36), noise) == pytest.approx(3.0 * math.sqrt(N), abs=2e-3)
    assert index(with_ball(0.30, 0.24), noise) == pytest.approx(3.0 * math.sqrt(N), abs=2e-3)
    assert index(with_ball(0.30, 0.30), noise) == pytest.approx(0.0, abs=2e-3)
    uneven = with_ball(0.01, 0.03)
    expected = math.sqrt(N * 0.04**2 / (0.5 * (0.01**2 + 0.03**2)))
    assert index(with_ball(0.5, 0.54), uneven) == pytest.approx(expected, rel=1e-4)
    colors = with_ball((0.3, 0.3, 0.3), (0.3, 0.34, 0.38))
    expected = math.sqrt(N * (0.04**2 + 0.08**2)) / 0.02
    assert index(colors, with_ball((0.02,) * 3, (0.02,) * 3)) == pytest.approx(expected, rel=1e-4)


def test_clutter_around_an_object_counts_as_noise() -> None:
    """A background of values of variance v, each as likely as the other."""
    columns = np.where(np.arange(W) // 2 % 2, 0.4, 0.2).astype(np.float32)[None, :, None]
    mean = with_ball(columns, 0.6)
    expected = math.sqrt(N * 0.3**2 / (0.5 * (2 * 0.02**2 + 0.1**2)))
    # The ring has not the same number of both.
    assert index(mean, with_ball(0.02, 0.02)) == pytest.approx(expected, rel=0.03)


def test_filters_of_a_mosaic_are_compared_with_their_own_kind() -> None:
    """A colour filter array before grey does not count as contrast."""
    pattern = np.tile(np.array([[0.2, 0.5], [0.5, 0.1]], np.float32), (H // 2, W // 2))[..., None]
    noise = with_ball(0.02, 0.02)
    assert index(pattern.copy(), noise) == pytest.approx(0.0, abs=2e-3)
    pattern[INSIDE] += np.float32(0.06)
    assert index(pattern, noise) == pytest.approx(3.0 * math.sqrt(N), abs=2e-3)


def test_hidden_objects_have_none_of_it_and_images_without_a_photograph_no_number() -> None:
    ids = {Channel.INSTANCE: np.zeros((H, W), np.uint16)}
    hidden = ObjectTruth(BALL, visible_px=0, box=None)
    flat = with_ball(0.5, 0.5)
    reading = SensorReading("color", CAMERA, ids, signal=ExpectedSignal(flat, flat))
    annotate = Detectability().annotate
    assert annotate(Scene("test"), reading, hidden).detectability == 0.0
    bare = annotate(Scene("test"), replace(reading, signal=None), hidden)
    assert bare.detectability is None


SENSORS = {
    "plain": ImageSensor(full_well_e=800.0),
    "uneven": ImageSensor(full_well_e=4000.0, prnu=0.05, dsnu_e=20.0, bits=8),
    "mono, warm": ImageSensor.model_validate_json(
        '{"pattern": "mono", "full_well_e": 2000, "dark_current_e_s": 3000, "read_noise_e": 12}'
    ),
    "two exposures": ImageSensor(full_well_e=1000.0, exposures=2, exposure_ratio=4.0),
}


@pytest.mark.parametrize("name", SENSORS)
def test_mean_and_noise_are_those_of_many_exposures(name: str) -> None:
    """Of many pixels, each of which has its own place in the fixed pattern."""
    sensor, gain, time_s = SENSORS[name], 1.6, 0.02
    reach = sensor.exposure_ratio ** (sensor.exposures - 1)
    for level in (0.05, 0.2, 0.6 * reach):
        light = np.full((256, 256), level, np.float32)
        taken = expose(light, gain, time_s, sensor, Streams(seed=2, scene=0).rng("noise"))
        mean, stddev = expected_exposure(light[:1, :1], gain, time_s, sensor)
        # Standard deviations of 65,536 numbers have an error of 0.3 percent.
        assert taken.std() == pytest.approx(float(stddev[0, 0]), rel=0.015)
        assert taken.mean() == pytest.approx(float(mean[0, 0]), abs=5 * float(stddev[0, 0]) / 256)


def test_observers_of_simulated_photographs_find_an_object_as_well() -> None:
    """The matched filter on raw photographs with and without the object, 3,000 of each.

    Its d' is the difference of its means over the root of the mean of its variances.
    """
    sensor = ImageSensor(full_well_e=300.0, prnu=0.0, dsnu_e=0.0)
    gray, ball = np.full((H, W, 3), 0.05, np.float32), np.array((0.058, 0.055, 0.05), np.float32)
    scene = gray.copy()
    scene[INSIDE] = ball
    kinds = np.array(FILTERS[sensor.pattern]).reshape(2, 2)
    filters = np.tile(kinds, (H // 2, W // 2))[..., None]
    with_it, without = (
        np.take_along_axis(image, filters, axis=-1)[..., 0][INSIDE] for image in (scene, gray)
    )
    noise = Streams(seed=4, scene=0).rng("noise")
    weights = (with_it - without).astype(np.float64)
    scores = [
        [float((expose(light, 1.0, 0.01, sensor, noise) * weights).sum()) for _ in range(3000)]
        for light in (with_it, without)
    ]
    seen, empty = (np.array(values) for values in scores)
    observed = (seen.mean() - empty.mean()) / math.sqrt(0.5 * (seen.var() + empty.var()))

    mosaic = np.take_along_axis(scene, filters, axis=-1)[..., 0]
    mean, stddev = expected_exposure(mosaic, 1.0, 0.01, sensor)

    assert observed > 1.0
    # The error of a d' of 3,000 trials: sqrt((2 + d'^2 / 4) / 3000).
    assert index(mean[..., None], stddev[..., None]) == pytest.approx(observed, abs=0.08)


def developed(with_signal: bool, **given: Any) -> Any:
    """A photograph of a light square on grey [cd/m^2]."""
    radiance = with_ball((20.0, 20.0, 20.0), (23.0, 22.0, 20.0))
    rng = Streams(seed=1, scene=0).rng("noise")
    pipeline = ImagePipeline.model_validate(given)
    shot = take_shot(radiance, None, CAMERA, Weather(), pipeline, rng)
    return develop(shot, with_signal=with_signal)


def test_asking_for_it_changes_no_byte_of_the_photograph() -> None:
    noisy = {"image_sensor": ImageSensor(), "white_balance": 0.9, "blur_px": 0.6}
    for given in ({}, noisy):
        assert (developed(True, **given).rgb == developed(False, **given).rgb).all()
        assert developed(False, **given).signal is None


def test_light_and_sharpness_help_and_an_ideal_camera_is_best() -> None:
    def found(**given: Any) -> float:
        signal = developed(True, **given).signal
        return index(signal.mean, signal.stddev)

    sensor = {"image_sensor": ImageSensor(full_well_e=2000.0), "exposure_compensation_ev": -2.0}
    plain = found(**sensor)
    assert found(**{**sensor, "exposure_compensation_ev": -6.0}) < 0.5 * plain
    assert found(**sensor, blur_px=3.0) < 0.8 * plain
    assert found() > plain
    # A thousand times the photons and no read noise: about the root of it.
    large = ImageSensor.model_validate_json(
        '{"full_well_e": 2000000, "read_noise_e": 0, "prnu": 0, "bits": 16}'
    )
    assert 20.0 * plain < found(**{**sensor, "image_sensor": large}) < 60.0 * plain


def test_it_is_a_limit_of_label_maps() -> None:
    things = tuple(
        ObjectTruth(replace(BALL, instance_id=k), N, BOX, detectability=value)
        for k, value in enumerate((4.0, 12.5, None), 1)
    )
    label_map = LabelMap(min_detectability=5.0)
    info: Any = None
    kept = AppliedLabelMap(label_map, info).map_image(ImageTruth(CAMERA, things)).objects
    assert [thing.detectability for thing in kept] == [12.5, None]
    assert label_map.needs == {"detectability"}
