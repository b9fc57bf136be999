"""Reports of laser scanners on hits of their rays: light, weather, chance, noise."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core import errors, se3
from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import POINT, LidarHits, LidarRays, SecondaryHits
from gen_data.core.scene import Lidar, Scene, Weather
from gen_data.core.serialization import to_plain
from gen_data.sensors.lidar import lidar_atmosphere, lidar_detection
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from gen_data.sensors.lidar.scan_pattern import lidar_model
from tests.sensors.scanned import MIRRORED, capture, echoes, paths_of, rng, scene_with, with_mirrors

MODEL = lidar_model("VLP-16")


class Wall:
    """A renderer whose every ray meets the same reflectance at the same range."""

    def __init__(self, range_m: float, reflectance: float = 0.5) -> None:
        self.range_m, self.reflectance = range_m, reflectance

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        shape = (len(beams.directions), beams.subrays)
        return echoes(np.full(shape, self.range_m), self.reflectance)


def scan(sensor: LidarSensor, wall: Wall, weather: Weather | None = None, seed: int = 0):  # noqa: ANN201
    points = capture(sensor, wall, weather, seed).points
    assert points.dtype == POINT
    return points


def test_an_ideal_scan_reports_every_hit_where_it_is_through_a_clean_window() -> None:
    """All pulses, exact ranges, labels, one return each, intensity of the manual's scale."""
    points = scan(LidarSensor(model="VLP-16", ideal=True), Wall(30.0))
    ranges_m = np.linalg.norm(points["position_m"].astype(float), axis=1)

    assert len(points) == 1808 * 16
    np.testing.assert_allclose(ranges_m, 30.0, rtol=1e-6)
    np.testing.assert_allclose(points["intensity"], 0.5 * 0.392, rtol=1e-5)
    assert (points["instance_id"] == 7).all() and (points["category_id"] == 2).all()
    assert (points["return_number"] == 1).all() and (points["return_count"] == 1).all()

    sensor = LidarSensor(model="VLP-16", ideal=True)

    assert (len(scan(sensor, Wall(0.4))), len(scan(sensor, Wall(100.5)))) == (0, 0)
    assert len(scan(sensor, Wall(99.5))) == 1808 * 16

    ideal = LidarSensor(model="VLP-16", ideal=True)
    soiled = ideal.model_copy(update={"window": 0.2})

    np.testing.assert_array_equal(scan(soiled, Wall(90.0)), scan(ideal, Wall(90.0)))

    points = scan(LidarSensor(model="HDL-64E", ideal=True), Wall(30.0))
    white = lidar_model("HDL-64E").white_intensity

    np.testing.assert_allclose(points["intensity"], 0.5 * white, rtol=1e-5)
    assert scan(LidarSensor(model="HDL-64E"), Wall(30.0))["intensity"].std() > 0.03


class Mirrors(Wall):
    """A renderer whose first three beams also see a wall in a mirror, the fourth behind glass."""

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        return with_mirrors(super().scan(scene, lidar, beams), beams, np.arange(4), 1.0)


@pytest.mark.parametrize("returns", ["strongest", "last", "dual"])
def test_an_ideal_scan_has_nothing_behind_mirrors(returns: lidar_detection.Kept) -> None:
    """Objects behind glass are there, and stay."""
    seen = Mirrors(30.0, reflectance=0.01)
    real = scan(LidarSensor(model="VLP-16", divergence=False, returns=returns), seen)
    ideal = scan(LidarSensor(model="VLP-16", ideal=True, returns=returns), seen)

    far = np.linalg.norm(ideal["position_m"].astype(float), axis=1) > 40.0
    assert (real["surface"] == MIRRORED).sum() == 3
    assert (ideal["surface"] != MIRRORED).all()
    assert ideal["instance_id"][far].tolist() == [9]


@pytest.mark.parametrize("divergence", [False, True])
@pytest.mark.parametrize("returns", ["last", "dual"])
def test_origins_say_how_light_came_and_from_where(
    returns: lidar_detection.Kept, divergence: bool
) -> None:
    """Mirrored points are where the mirrored instance is, others where they are without noise.

    The points themselves are as without origins.
    """
    plain = LidarSensor(model="VLP-16", divergence=divergence, returns=returns)
    sensor = plain.model_copy(update={"origins": True})
    seen = Mirrors(30.0, reflectance=0.01 if not divergence else 0.5)
    scene = scene_with(sensor)
    pose = se3.SE3.about_z(0.5, (7.0, -3.0, 2.0))
    lidar = replace(scene.lidars[0], T_world_lidar=pose)
    cloud = sensor.capture(replace(scene, lidars=(lidar,)), seen, frozenset(), rng())  # type: ignore[arg-type]
    np.testing.assert_array_equal(cloud.points, scan(plain, seen))

    path, origins = paths_of(cloud), cloud.origins
    mirrored = path == "mirror"
    if not divergence:
        assert (mirrored.sum(), (path == "glass").sum()) == (3, 1)
    shown = np.broadcast_to(pose.apply(np.array([1.0, 2.0, 3.0])), (mirrored.sum(), 3))
    np.testing.assert_allclose(origins["true_position_m"][mirrored], shown, rtol=1e-6)
    away = np.linalg.norm(origins["true_position_m"] - pose.translation_m, axis=1)
    np.testing.assert_allclose(away[path == "direct"], 30.0, rtol=1e-5)
    np.testing.assert_allclose(away[path == "glass"], 50.0, rtol=1e-5)


def test_an_ideal_scan_has_no_mirrored_origins_and_other_scans_have_none_at_all() -> None:
    sensor = LidarSensor(model="VLP-16", ideal=True, origins=True)
    cloud = capture(sensor, Mirrors(30.0))
    assert cloud.origins is not None and set(np.unique(cloud.origins["path"])) <= {0, 1}
    assert cloud.lidar.origins and "origins" in to_plain(cloud.lidar)

    plain = LidarSensor(model="VLP-16", ideal=True)
    cloud = capture(plain, Mirrors(30.0))
    assert cloud.origins is None and "origins" not in to_plain(cloud.lidar)


class Silent(Mirrors):
    """A renderer that is silent about mirrors."""

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        return super().scan(scene, lidar, replace(beams, mirrored=False))


def test_a_renderer_that_does_not_state_what_mirrors_show_is_named() -> None:
    with pytest.raises(errors.SampleError, match="sensor 'lidar': origins: this renderer does not"):
        capture(LidarSensor(model="VLP-16", origins=True), Silent(30.0))


def test_range_noise_is_that_of_the_data_sheet_on_steps_of_the_device() -> None:
    """Standard deviation within 3 %, multiples of 2 mm."""
    points = scan(LidarSensor(model="VLP-16"), Wall(20.0))
    ranges_m = np.linalg.norm(points["position_m"].astype(float), axis=1)

    assert ranges_m.std() == pytest.approx(MODEL.range_noise_m, rel=0.03)
    assert ranges_m.mean() == pytest.approx(20.0, abs=1e-3)
    steps = ranges_m / MODEL.range_step_m
    assert np.abs(steps - np.rint(steps)).max() < 2e-3


def test_equal_streams_make_equal_bytes() -> None:
    """Weather and all; another stream makes others."""
    sensor = LidarSensor(model="VLP-16", returns="dual", divergence=True)
    weather = Weather(fog_extinction_per_m=0.02, rain_mm_h=20.0, snow_mm_h=2.0)
    one, same, other = (scan(sensor, Wall(25.0), weather, seed) for seed in (1, 1, 2))

    assert one.tobytes() == same.tobytes()
    assert one.tobytes() != other.tobytes()


@pytest.mark.parametrize("fog_per_m", [0.01, 0.03])
def test_fog_dims_intensity_by_beer_and_lambert(fog_per_m: float) -> None:
    """Both ways through it: exp(-2 a r)."""
    bright = Wall(20.0, 1.0)
    clear = scan(LidarSensor(model="VLP-16"), bright)
    foggy = scan(LidarSensor(model="VLP-16"), bright, Weather(fog_extinction_per_m=fog_per_m))
    wall = foggy[foggy["instance_id"] == 7]

    ratio = np.median(wall["intensity"]) / np.median(clear["intensity"])
    assert ratio == pytest.approx(math.exp(-2.0 * fog_per_m * 20.0), rel=1e-4)


def test_rain_dims_by_goodin_s_law() -> None:
    """0.01 R^0.6 per metre: 0.0398 at 10 mm/h; nothing without rain."""
    assert lidar_atmosphere.rain_extinction_per_m(10.0) == pytest.approx(0.01 * 10.0**0.6)
    assert lidar_atmosphere.rain_extinction_per_m(0.0) == 0.0
    depth = lidar_atmosphere.optical_depth(
        Weather(rain_mm_h=10.0), MODEL, 1.7, np.zeros((1, 1), np.float32), np.float32([[25.0]])
    )
    assert depth[0, 0] == pytest.approx(0.25 * 10.0**0.6, rel=1e-5)


@pytest.mark.parametrize("up", [-0.4, -1e-6, 0.0, 0.3])
def test_fog_that_thins_with_height_is_integrated_along_the_beam(up: float) -> None:
    """Against a sum over short steps."""
    weather = Weather(fog_extinction_per_m=0.02, fog_height_m=12.0)
    r = (np.arange(200_000) + 0.5) * (40.0 / 200_000)
    expected = (0.02 * np.exp(-(1.7 + up * r) / 12.0)).mean() * 40.0

    depth = lidar_atmosphere.optical_depth(
        weather, MODEL, 1.7, np.float32([[up]]), np.float32([[40.0]])
    )

    assert depth[0, 0] == pytest.approx(expected, rel=1e-4)


def test_dense_fog_answers_itself_a_few_metres_away_and_thicker_fog_more() -> None:
    """Points of air, no instance, near the scanner; none in clear air (Hahner et al. 2021)."""
    peak_m, _ = lidar_atmosphere.fog_peak(0.06)
    points = scan(LidarSensor(model="HDL-64E"), Wall(90.0), Weather(fog_extinction_per_m=0.06))
    air = points[points["surface"] == SURFACES.index("air")]
    ranges_m = np.linalg.norm(air["position_m"].astype(float), axis=1)

    assert 1.0 < peak_m < 8.0
    assert len(air) > 10_000
    assert (air["instance_id"] == 0).all()
    assert np.median(ranges_m) == pytest.approx(peak_m, rel=0.1)
    assert not (scan(LidarSensor(), Wall(90.0))["surface"] == SURFACES.index("air")).any()

    strengths = [lidar_atmosphere.fog_peak(a)[1] for a in (0.005, 0.01, 0.02, 0.06)]

    assert strengths == sorted(strengths)


def test_the_air_has_a_sensitivity_of_its_own() -> None:
    """Neither the loss nearby nor the sensitivity to solid targets changes its returns."""
    model = lidar_model("HDL-64E")
    one, two = (
        lidar_atmosphere.add_atmosphere(
            lidar_detection.make_pulses(echoes(np.full((500, 1), 90.0)), device),
            Weather(fog_extinction_per_m=0.06, rain_mm_h=20.0, snow_mm_h=2.0),
            device,
            1.7,
            rng(),
        )
        for device in (
            model,
            model.model_copy(update={"seen": model.seen_air, "seen_air": None, "near_m": 0.0}),
        )
    )

    assert (one.light[:, 0] < two.light[:, 0]).all()
    assert (one.light[:, 1:] > 0.0).any(axis=0).all()
    np.testing.assert_array_equal(one.light[:, 1:], two.light[:, 1:])
    np.testing.assert_array_equal(one.range_m, two.range_m)


def test_snow_sends_back_more_than_rain() -> None:
    """Flakes are white and large, drops clear and small. A wall outshines the drops before it."""
    air = SURFACES.index("air")
    sensor = LidarSensor(model="HDL-64E")
    pulses = 2083 * 64
    snow = len(scan(sensor, Wall(math.inf), Weather(snow_mm_h=1.0))) / pulses
    rain = len(scan(sensor, Wall(math.inf), Weather(rain_mm_h=3.0))) / pulses
    wall = scan(sensor, Wall(20.0), Weather(rain_mm_h=3.0))

    print(snow, rain)
    assert 0.001 < rain < 0.03
    assert snow > 5.0 * rain
    assert (wall["surface"] == air).mean() < 0.001


def test_a_beam_that_meets_two_things_can_return_both() -> None:
    """Strongest and last; nearest first; rays that end close to each other are one return."""
    near_and_far = np.array([[10.0, 10.1, 10.2, 10.1, 30.0, 30.1, np.inf]])
    pulses = lidar_detection.make_pulses(echoes(near_and_far), MODEL)
    noticed = pulses.light > 0.0

    rows, picks = lidar_detection.select_returns(pulses, noticed, "dual")
    np.testing.assert_allclose(pulses.range_m[rows, picks], [10.0, 30.0])
    assert pulses.reflectance[rows, picks] == pytest.approx([0.5 * 4 / 7, 0.5 * 2 / 7])
    rows, picks = lidar_detection.select_returns(pulses, noticed, "strongest")
    np.testing.assert_allclose(pulses.range_m[rows, picks], [10.0])
    rows, picks = lidar_detection.select_returns(pulses, noticed, "last")
    np.testing.assert_allclose(pulses.range_m[rows, picks], [30.0])


def test_the_detector_notices_by_light() -> None:
    """L^6 / (1 + L^6), within four standard deviations."""
    for light in (0.7, 1.0, 1.3):
        pulses = lidar_detection.make_pulses(echoes(np.full((20_000, 1), 10.0)), MODEL)
        pulses = replace(pulses, light=np.full((20_000, 1), light, np.float32))
        expected = light**6 / (1.0 + light**6)
        spread = math.sqrt(expected * (1 - expected) / 20_000)
        assert lidar_detection.is_detected(pulses, rng()).mean() == pytest.approx(
            expected, abs=4 * spread
        )


def test_a_soiled_window_takes_light_both_ways() -> None:
    """A wall that a clean scanner sees half of the time answers 0.8^2 of that light through 0.8."""
    wall = Wall(MODEL.seen.range_m, MODEL.seen.reflectance)
    clean = scan(LidarSensor(model="VLP-16"), wall)
    soiled = scan(LidarSensor(model="VLP-16", window=0.8), wall)

    pulses, light = 1808 * 16, 0.64
    for points, expected in ((clean, 0.5), (soiled, light**6 / (1.0 + light**6))):
        spread = math.sqrt(expected * (1.0 - expected) / pulses)
        assert len(points) / pulses == pytest.approx(expected, abs=4.0 * spread)
    assert soiled["intensity"].mean() == pytest.approx(0.64 * clean["intensity"].mean(), rel=1e-4)


def test_retro_reflectors_are_told_from_white() -> None:
    """White matte is 100 of 255 on a Velodyne, the brightest sign 255."""
    told = lidar_detection.report_intensity(np.float32([0.0, 0.5, 1.0, 800.0, 1e5]), MODEL)

    np.testing.assert_allclose(told, [0.0, 0.196, 0.392, 1.0, 1.0], atol=1e-6)


def measured(reflectance: list[float], range_m: float, **changes: float) -> np.ndarray:
    """Intensities of an HDL-64E without noise, steps and spread, unless changed."""
    model = lidar_model("HDL-64E")
    exact = {"noise": 0.0, "laser_spread": 0.0, "step": 0.0, "range_exponent": 0.0, **changes}
    assert model.response is not None
    model = model.model_copy(update={"response": model.response.model_copy(update=exact)})
    light = np.asarray(reflectance, np.float32)
    ring = (np.arange(len(light)) % 64).astype(np.uint16)
    return lidar_detection.measure_intensity(
        light, np.full(len(light), range_m, np.float32), ring, model, rng()
    )


def test_a_receiver_focused_at_a_distance_collects_less_nearby() -> None:
    """1 / (range^2 + near^2), and 1 at the sensitivity's own range."""
    model = lidar_model("HDL-64E").model_copy(update={"near_m": 12.0, "seen_far": None})
    r = np.array([2.0, 12.0, 50.0, 120.0], np.float32)
    light = lidar_detection.received_light(np.full(4, model.seen.reflectance, np.float32), r, model)

    expected = [(50.0**2 + 12.0**2) / (v * v + 12.0**2) for v in r.tolist()]
    np.testing.assert_allclose(light, expected, rtol=1e-5)


def test_the_range_of_an_hdl64_follows_the_reflectance_by_an_exponential_loss() -> None:
    """As in its manual: 10 % at 50 m, 80 % at 120 m. It would be 151 m without a loss."""
    model = lidar_model("HDL-64E")
    light = lidar_detection.received_light(np.float32([0.1, 0.8]), np.float32([50.0, 120.0]), model)
    np.testing.assert_allclose(light, 1.0, rtol=1e-5)

    plain = model.model_copy(update={"seen_far": None})
    reach = math.sqrt(0.8 / 0.1 * (50.0**2 + 20.0**2) - 20.0**2)
    assert reach == pytest.approx(151.0, abs=0.1)
    assert lidar_detection.received_light(np.float32([0.8]), np.float32([reach]), plain)[
        0
    ] == pytest.approx(1.0)

    r = np.array([0.0, 50.0, 60.0, 70.0, np.inf], np.float32)
    seen = np.full(5, 0.3, np.float32)

    lossy, full = (lidar_detection.received_light(seen, r, device) for device in (model, plain))

    ratio = lossy[:4] / full[:4]
    assert ratio[1] == pytest.approx(1.0) and ratio[0] > 1.0
    assert ratio[2] / ratio[1] == pytest.approx(ratio[3] / ratio[2], rel=1e-5)
    assert ratio[2] < 1.0 and lossy[4] == 0.0


def test_intensities_are_compressed_and_zero_in_the_dark() -> None:
    """White as stated, 1 for the brightest signs, 0 below the dark level, rising between."""
    told = measured([0.0, 0.01, 0.1, 0.3, 1.0, 800.0], 10.0)
    model = lidar_model("HDL-64E")
    assert model.response is not None
    h, dark, white = model.response.half, model.response.dark, model.white_intensity

    assert told[0] == told[1] == 0.0
    assert told[4] == pytest.approx(white, abs=1e-6) and told[5] == pytest.approx(1.0, abs=1e-6)
    assert (np.diff(told[1:]) > 0.0).all()
    # The reflectance at which a Naka-Rushton curve has the value dark.
    edge = dark * h / ((white + dark) * (1.0 + h) - dark)
    np.testing.assert_allclose(measured([edge], 10.0), 0.0, atol=1e-6)
    assert measured([1.05 * edge], 10.0)[0] > 0.0


def test_range_is_compensated_in_part() -> None:
    """At range sqrt(3) near_m, c is 4^-0.5 times the reflectance: half of it."""
    range_m = lidar_model("HDL-64E").near_m * math.sqrt(3.0)
    far = measured([0.4, 0.2], range_m, range_exponent=0.5)

    assert far.min() > 0.1
    np.testing.assert_allclose(far, measured([0.2, 0.1], 1.0), atol=1e-5)


def test_noise_spread_and_steps_of_intensities() -> None:
    """As stated, within 3 %; multiples of a step."""
    grey = [0.2] * 20_000
    plain = measured(grey, 10.0)
    noisy = measured(grey, 10.0, noise=0.02)
    steps = measured(grey, 10.0, noise=0.02, step=0.01) / 0.01
    gains = lidar_detection.laser_gains(64, 0.1)

    assert np.ptp(plain) == 0.0
    assert noisy.std() == pytest.approx(0.02, rel=0.03)
    assert noisy.mean() == pytest.approx(plain[0], abs=1e-3)
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    assert gains.mean() == pytest.approx(1.0, abs=0.01)
    assert gains.std() == pytest.approx(0.1, rel=0.1)
    assert (lidar_detection.laser_gains(16, 0.0) == 1.0).all()


def test_the_mount_turns_left_and_upwards_and_needs_a_camera_listed_before_it() -> None:
    """Yaw 90 looks along the rig's Y, pitch 90 along its Z."""
    ahead = np.array([[1.0, 0.0, 0.0]])
    left = scene_with(LidarSensor(yaw_deg=90.0)).lidars[0].T_rig_lidar
    up = scene_with(LidarSensor(pitch_deg=90.0, offset_m=(0.1, 0.2, 0.3))).lidars[0].T_rig_lidar

    np.testing.assert_allclose(left.rotate(ahead), [[0.0, 1.0, 0.0]], atol=1e-5)
    np.testing.assert_allclose(up.rotate(ahead), [[0.0, 0.0, 1.0]], atol=1e-5)
    assert up.translation_m == (0.1, 0.2, 0.3)
    assert isinstance(up, se3.SE3)

    with pytest.raises(errors.ConfigError, match=r"camera 'color'.*none"):
        LidarSensor().mount(Scene("t"))


def test_the_strongest_return_is_the_strongest_of_all_that_detours_add() -> None:
    """Rays whose detours are near or far, faint or strong: against merging every one of them."""
    n, draw = 4000, rng(3)
    first = echoes(draw.uniform(5.0, 40.0, (n, 1)))
    first = replace(first, reflectance=draw.uniform(0.0, 0.2, (n, 1)).astype(np.float32))
    ray = np.sort(np.concatenate([np.arange(0, n, 2), np.arange(0, n, 5)]))
    m = len(ray)
    far_m = first.range_m[ray, 0] + np.where(draw.random(m) < 0.4, 0.3, 4.0) * draw.random(m)
    detours = SecondaryHits(
        ray,
        far_m.astype(np.float32),
        (draw.random(m) ** 4).astype(np.float32),
        np.full(m, 9, np.uint16),
        np.full(m, 3, np.uint16),
        np.full(m, 1, np.uint8),
    )
    seen = replace(first, detours=detours)

    strongest = lidar_detection.make_pulses(seen, MODEL, "strongest")
    every = lidar_detection.make_pulses(seen, MODEL, "dual")

    best = every.light.argmax(axis=1)[:, None]
    assert 0.05 < (strongest.instance_id == 9).mean() < 0.5
    for name in ("range_m", "light", "reflectance", "instance_id", "category_id", "surface"):
        expected = np.take_along_axis(getattr(every, name), best, axis=1)
        np.testing.assert_array_equal(getattr(strongest, name), expected)
