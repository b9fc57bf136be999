"""Events against brightness that is known at every instant."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.capture import Channel, Measurements, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import Renderer
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Scene, Weather
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.core.se3 import SE3
from gen_data.sensors.event_camera.event_camera import (
    DARK_CD_M2,
    EventCamera,
    Events,
    apply_refractory_period,
    log_response,
    noise_events,
    stable_order,
)
from tests.sensors.streetcar import BoxRays, rng, straight, world

SIZE_PX = (16, 8)
QUIET = {"leak_hz": 0.0, "shot_noise_hz": 0.0, "refractory_s": 0.0, "size_px": SIZE_PX}


class Film(BoxRays):
    """A renderer whose every pixel has the luminance of a function of time [cd/m^2]."""

    def __init__(self, luminance: Callable[[float], float]) -> None:
        self.luminance = luminance
        self.frames = 0

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        """A grey image; instance 5 from 0.15 s on."""
        self.frames += 1
        shape = (camera.intrinsics.height_px, camera.intrinsics.width_px)
        images = {
            Channel.RADIANCE: np.full((*shape, 3), self.luminance(scene.time_s), np.float32),
            Channel.INSTANCE: np.full(shape, 5 if scene.time_s > 0.15 else 0, np.uint16),
        }
        return SensorReading(camera.name, camera, images, time_s=scene.time_s)


def seen(
    sensor: EventCamera, film: Renderer, step: int, scene: Scene | None = None, seed: int = 0
) -> Measurements:
    mounted = place_sensors(sensor.mount(scene or world()))
    return sensor.capture(scene_at(mounted, 0.1 * step), film, frozenset(), rng(step, seed))


def test_brightness_that_grows_evenly_makes_events_at_an_even_rate() -> None:
    """From 100 to 1000 cd/m^2 in a second: ln 10 / 0.2 = 11.5 events a pixel, all brighter."""
    sensor = EventCamera(rig="ego", threshold_spread=0.0, frames_per_step=4, **QUIET)
    film = Film(lambda t: 100.0 * 10.0**t)
    rows = np.concatenate([seen(sensor, film, k).rows for k in range(11)])

    assert (rows["polarity"] == 1).all()
    assert len(rows) / (SIZE_PX[0] * SIZE_PX[1]) == pytest.approx(math.log(10.0) / 0.2, abs=0.1)
    per_pixel = np.sort(rows["time_s"][(rows["x_px"] == 3) & (rows["y_px"] == 2)])
    # Between frames of 25 ms an exponential is taken to be one.
    assert np.allclose(np.diff(per_pixel), 0.2 / math.log(10.0), atol=1e-5)


def test_no_event_is_lost_or_told_twice_between_steps() -> None:
    """Whether a fade is cut in two steps or in ten: the same count on every pixel."""
    film = Film(lambda t: 90.0 * 0.1**t)

    def counts(step_s: float) -> np.ndarray:
        sensor = EventCamera(rig="ego", frames_per_step=round(step_s / 0.05), **QUIET)
        mounted = place_sensors(sensor.mount(replace(world(), step_s=step_s)))
        total = np.zeros(SIZE_PX[::-1], int)
        for k in range(1, round(1.0 / step_s) + 1):
            then = scene_at(mounted, round(k * step_s, 9))
            rows = sensor.capture(then, film, frozenset(), rng(k)).rows
            assert (rows["polarity"] == -1).all()
            np.add.at(total, (rows["y_px"], rows["x_px"]), 1)
        return total

    assert np.array_equal(counts(0.5), counts(0.1))
    assert counts(0.5).min() >= 8


def test_events_do_not_come_back_from_small_changes() -> None:
    """Up and down by a fifth of the threshold: at most one event where a level lies in between."""
    sensor = EventCamera(rig="ego", frames_per_step=20, **QUIET)
    rows = seen(sensor, Film(lambda t: 50.0 * math.exp(0.04 * math.sin(200.0 * t))), 1).rows
    pixel = rows["y_px"].astype(int) * SIZE_PX[0] + rows["x_px"]

    assert np.bincount(pixel).max() == 1


def test_thresholds_differ_from_pixel_to_pixel_and_stay() -> None:
    """Spread as told; the same pixel has the same one at every step."""
    sensor = EventCamera(
        rig="ego", threshold=0.2, threshold_spread=0.05, **{**QUIET, "size_px": (64, 64)}
    )
    film = Film(lambda t: 20.0 * 50.0 ** min(t, 1.0))
    total = np.zeros((64, 64))
    for k in range(1, 11):
        rows = seen(sensor, film, k).rows
        np.add.at(total, (rows["y_px"], rows["x_px"]), 1)
    thresholds = math.log(50.0) / total

    assert np.median(thresholds) == pytest.approx(0.2, rel=0.05)
    assert np.percentile(thresholds, 84) - np.median(thresholds) == pytest.approx(0.05, rel=0.3)


def test_events_come_in_order_of_time_within_their_step() -> None:
    rows = seen(
        EventCamera(rig="ego", size_px=SIZE_PX, leak_hz=50.0), Film(lambda t: 100.0 * t + 10.0), 3
    ).rows

    assert len(rows) > 100
    assert (np.diff(rows["time_s"]) >= 0.0).all()
    assert rows["time_s"].min() >= 0.2
    assert rows["time_s"].max() <= 0.3
    assert (rows["x_px"] < SIZE_PX[0]).all()
    assert (rows["y_px"] < SIZE_PX[1]).all()


def test_events_know_what_their_pixel_shows() -> None:
    """Instance 5 appears at 0.15 s."""
    sensor = EventCamera(rig="ego", frames_per_step=10, **QUIET)
    rows = seen(sensor, Film(lambda t: 5.0 * 10.0 ** (5.0 * (t - 0.1))), 2).rows

    late = rows["time_s"] > 0.16
    assert (rows["instance_id"][late] == 5).all()
    assert (rows["instance_id"][rows["time_s"] < 0.145] == 0).all()


def test_still_pictures_make_no_events_but_noise() -> None:
    """Leakage of 2 Hz, shot noise of 8 Hz in the dark, a quarter of it in the light (v2e)."""
    assert len(seen(EventCamera(rig="ego", **QUIET), Film(lambda t: 0.5), 4).rows) == 0

    scene = np.full((100, 200), 1e-6)
    scene[:, 100:] = 1e6
    noise = noise_events(scene, 0.0, 1.0, 2.0, 8.0, rng())
    bright = noise.pixel % 200 >= 100
    assert (~bright).sum() / 1e4 == pytest.approx(10.0, rel=0.02)
    # Light is twice the mean: two thirds of the way from dark to bright.
    assert bright.sum() / 1e4 == pytest.approx(2.0 + 8.0 * (1.0 - 0.75 * 2 / 3), rel=0.02)
    assert (noise.polarity[~bright] == -1).mean() == pytest.approx(0.4, abs=0.01)


def test_pixels_rest_after_an_event() -> None:
    """At 0, 3 and 11 ms with 5 ms of rest: the second is lost; the other pixel's are not."""
    times_s = np.array([0.0, 0.001, 0.003, 0.011, 0.012])
    events = Events(times_s, np.array([7, 2, 7, 7, 2]), np.ones(5, int))
    kept = apply_refractory_period(events, 0.005)

    assert kept.time_s.tolist() == [0.0, 0.001, 0.011, 0.012]
    assert apply_refractory_period(events, 0.0).time_s.tolist() == times_s.tolist()


def test_pictures_are_rendered_once_and_none_while_nothing_moves() -> None:
    """Four for three parts of a step; before a parked car one is enough, unless rain falls."""
    film = Film(lambda t: 0.5)

    assert len(seen(EventCamera(rig="ego"), film, 0).rows) == 0
    assert film.frames == 0
    seen(EventCamera(rig="ego", size_px=SIZE_PX, frames_per_step=3), film, 1)

    assert film.frames == 4

    parked = world(ego=straight((0.0, 0.0), (0.0, 0.0)))
    sensor = EventCamera(rig="ego", size_px=SIZE_PX, shot_noise_hz=20.0)
    dry, wet = Film(lambda t: 0.5), Film(lambda t: 0.5)

    assert len(seen(sensor, dry, 2, parked).rows) > 10
    seen(sensor, wet, 2, replace(parked, weather=Weather(rain_mm_h=5.0)))
    assert (dry.frames, wet.frames) == (1, 6)


def test_orders_are_stable_for_any_whole_numbers() -> None:
    """As numpy's own stable sort, also of numbers of more than 16 bits and below 0."""
    draws = rng().integers(-(2**40), 2**40, 500)
    for numbers in (draws, draws >> 38, draws % 70_000, draws[:0], np.zeros(3, int)):
        assert np.array_equal(stable_order(numbers), np.argsort(numbers, kind="stable"))


def test_darkness_hides_contrast() -> None:
    """Far above the dark current only the ratio counts; as bright as it, half of the change."""
    ratio = math.e
    for luminance, expected in ((1e4, 1.0), (1.0, 0.997), (DARK_CD_M2, math.log((1 + ratio) / 2))):
        change = np.diff(log_response(np.array([luminance, ratio * luminance])))[0]
        assert change == pytest.approx(expected, abs=1e-3)


def test_it_may_share_the_place_of_a_camera() -> None:
    """As on a DAVIS, which takes frames and events with the same pixels."""
    pose = SE3((1.0, 2.0, 3.0), (0.5, -0.5, 0.5, -0.5))
    camera = Camera("color", pose, Intrinsics.from_hfov(64, 48, 1.0))
    scene = replace(world(), cameras=(camera,))
    placed = place_sensors(EventCamera().mount(scene))

    place = placed.device("events").T_world_device.translation_m
    assert np.allclose(place, (1.0, 2.0, 3.0))
    forward = placed.device("events").T_world_device.rotation()[:, 0]
    assert np.allclose(forward, pose.rotation()[:, 2], atol=1e-6)


def test_missing_cameras_and_rigs_are_told() -> None:
    with pytest.raises(ConfigError, match="no camera 'color' is listed before it"):
        EventCamera().mount(world())
    with pytest.raises(ConfigError, match="the scene has no rig 'wrist'"):
        EventCamera(rig="wrist").mount(world())
