"""Stages of the image pipeline, against physics and standards."""

import math
from typing import Any

import cv2
import numpy as np
import pytest
from scipy import ndimage, stats

from gen_data.config.distributions import Constant
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera import isp, optics
from gen_data.sensors.camera.exposure import ExposureControl, exposure_settings
from gen_data.sensors.camera.image_pipeline import PRESETS, ImagePipeline
from gen_data.sensors.camera.image_sensor import ImageSensor, Pattern, expose, mosaic
from gen_data.sensors.camera.isp import to_bytes
from gen_data.sensors.device_presets import preset_names
from tests.sensors.camera.photographs import WHITE_CD_M2, made, photo, rng

FAR = np.full((48, 64), np.inf)
PATTERNS: tuple[Pattern, ...] = ("rggb", "bggr", "grbg", "gbrg")


def flat(*color: float, shape: tuple[int, int] = (48, 64)) -> Any:
    return np.full((*shape, 3), color, np.float32)


def photograph(radiance: Any, pipeline: ImagePipeline, stream: Rng | None = None) -> Any:
    """Bytes of a photograph of far surfaces at EV 8 in fair weather."""
    return photo(radiance, pipeline, depth_m=FAR, stream=stream).rgb


@pytest.mark.parametrize("level", [0.02, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_variance_is_that_of_photons_and_reading(level: float, gain: float) -> None:
    """Photon transfer (EMVA 1288): variance = mean / well + (read / well)^2 + step^2 / 12."""
    sites = ImageSensor(
        full_well_e=10_000.0, read_noise_e=Constant(5.0), dark_current_e_s=Constant(0.0), prnu=0.0,
        dsnu_e=0.0, bits=14,
    )  # fmt: skip
    light = np.full((400, 500), level, np.float32)
    raw = expose(light, gain, 0.01, sites, rng())
    well_e = 10_000.0 / gain
    expected = level / well_e + (5.0 / well_e) ** 2 + (1.0 / (2**14 - 1)) ** 2 / 12.0
    n = light.size
    assert float(raw.mean()) == pytest.approx(level, abs=5.0 * math.sqrt(expected / n))
    assert float(raw.var()) == pytest.approx(expected, rel=6.0 * math.sqrt(2.0 / n))


@pytest.mark.parametrize("mean_e", [0.5, 20.0, 63.0, 65.0, 400.0])
def test_electrons_are_poisson(mean_e: float) -> None:
    """Largest distance of distribution functions from Poisson's: 1 % of steps beyond chance."""
    sensor = ImageSensor(
        pattern="mono", full_well_e=1000.0, read_noise_e=Constant(0.0),
        dark_current_e_s=Constant(0.0), prnu=0.0, dsnu_e=0.0, bits=16,
    )  # fmt: skip
    light = np.full((200, 200), mean_e / 1000.0, np.float32)
    electrons = np.rint(expose(light, 1.0, 0.01, sensor, rng()) * 1000.0).ravel()

    values = np.arange(int(mean_e + 6.0 * math.sqrt(mean_e)) + 2)
    measured = np.searchsorted(np.sort(electrons), values, side="right") / electrons.size
    assert np.abs(measured - stats.poisson.cdf(values, mean_e)).max() < 0.01 + 1.63 / 200.0


def test_a_lens_spreads_a_point_over_a_gaussian() -> None:
    """All light arrives, with the variance of the point spread function along both axes."""
    point = np.zeros((41, 41, 3), np.float32)
    point[20, 20] = 100.0
    seen = optics.apply_blur(point, 1.5)[..., 1]

    places = np.arange(41.0) - 20.0
    assert seen.sum() == pytest.approx(100.0, rel=1e-4)
    for axis in (0, 1):
        assert (seen.sum(axis=axis) * places**2).sum() / 100.0 == pytest.approx(2.25, rel=0.02)


def test_settings_hold_for_a_sequence_and_noise_does_not() -> None:
    """Two steps of one sequence: the same contrast, balance and exposure; other photons."""
    radiance = flat(90.0, 60.0, 30.0)
    drawn = {"uniform": [0.5, 2.0]}
    settings = {"contrast": drawn, "warmth_ev": drawn, "exposure_error_ev": drawn}
    steps = [Streams(seed=3, scene=1, step=step).rng("camera") for step in (0, 1)]
    other = Streams(seed=3, scene=2).rng("camera")

    first, second = (photograph(radiance, made(**settings), step) for step in steps)
    assert (first == second).all()
    assert (first != photograph(radiance, made(**settings), other)).any()
    noisy = made(**settings, image_sensor={"pattern": "mono", "full_well_e": 100.0})
    first, second = (photograph(radiance, noisy, step) for step in steps)
    assert (first != second).any()


def test_dark_current_adds_noise_and_no_light() -> None:
    """Its mean is taken off by the black level; its variance is its number of electrons."""
    sites = ImageSensor(
        full_well_e=10_000.0, read_noise_e=Constant(20.0), dark_current_e_s=Constant(900.0),
        prnu=0.0, dsnu_e=0.0, bits=16,
    )  # fmt: skip
    raw = expose(np.full((300, 300), 0.2, np.float32), 1.0, 1.0, sites, rng())
    assert float(raw.mean()) == pytest.approx(0.2, abs=1e-4)
    assert float(raw.var()) == pytest.approx((2000 + 900 + 400) / 1e8, rel=0.03)


def test_a_full_well_reads_white_and_numbers_are_whole_steps() -> None:
    """Light beyond saturation stays at 1; eight bits are multiples of 1 / 255."""
    sites = ImageSensor(prnu=0.0, dsnu_e=0.0)
    raw = expose(np.full((20, 20), 3.0, np.float32), 1.0, 0.01, sites, rng())
    assert (raw == 1.0).all()

    sites = ImageSensor(bits=8)
    raw = expose(np.full((30, 30), 0.4, np.float32), 1.0, 0.01, sites, rng())
    np.testing.assert_allclose(raw * 255.0, np.rint(raw * 255.0), atol=1e-4)


def test_several_exposures_read_light_far_beyond_white() -> None:
    """Three at 16:1 tell 100 times white from 200 times, each within a few per cent."""
    sites = ImageSensor(
        exposures=3, exposure_ratio=16.0, full_well_e=24_500.0, prnu=0.0, dsnu_e=0.0
    )
    for light in (0.1, 2.0, 100.0, 200.0):
        raw = expose(np.full((50, 50), light, np.float32), 1.0, 0.01, sites, rng())
        assert float(raw.mean()) == pytest.approx(light, rel=0.01)
        assert float(raw.std()) < 0.05 * light


def test_hot_pixels_stay_where_they_are() -> None:
    """The same photosites in every picture of a device; others in another device."""

    def hot(seed: int, name: str) -> Any:
        sites = ImageSensor(
            hot_pixels=0.01, dark_current_e_s=Constant(100.0), device_seed=seed, prnu=0.0
        )
        return expose(np.zeros((100, 100), np.float32), 1.0, 0.03, sites, rng(name)) > 0.03

    first, again, other = hot(1, "a"), hot(1, "b"), hot(2, "a")
    assert 50 <= first.sum() <= 150
    assert (first == again).mean() > 0.999
    assert (first & other).sum() < 20


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("method", ["bilinear", "edge_aware"])
def test_demosaicing_gives_flat_colours_back(pattern: Pattern, method: Any) -> None:
    """Each filter's colour is found again in its own channel."""
    image = isp.demosaic(mosaic(flat(0.8, 0.4, 0.1), pattern), pattern, method, 1.0)
    np.testing.assert_allclose(image[4:-4, 4:-4], flat(0.8, 0.4, 0.1)[4:-4, 4:-4], atol=2e-4)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_demosaicing_gives_even_gradients_back(pattern: Pattern) -> None:
    """Colours that change evenly, each at its own rate, have no second derivative."""
    y, x = np.mgrid[0:40, 0:48] / 48.0
    ramp = np.stack([0.2 + 0.4 * x, 0.3 + 0.4 * x, 0.1 + 0.4 * x], axis=-1).astype(np.float32)
    ramp[..., 2] += 0.2 * y
    image = isp.demosaic(mosaic(ramp, pattern), pattern, "edge_aware", 1.0)
    np.testing.assert_allclose(image[6:-6, 6:-6], ramp[6:-6, 6:-6], atol=0.01)


@pytest.mark.parametrize("angle_deg", [8.0, 25.0, 50.0, 80.0, 110.0, 150.0])
def test_thin_white_lines_stay_white_behind_a_bayer_pattern(angle_deg: float) -> None:
    """Half a pixel wide, through a lens of 0.5 px: no colour beyond a tenth of full scale."""
    finer, turn = 8, math.radians(angle_deg)
    y, x = (np.mgrid[0:512, 0:512] - 255.5) / finer
    line = np.abs(x * math.sin(turn) - y * math.cos(turn)) < 0.25
    covered = line.reshape(64, finer, 64, finer).mean(axis=(1, 3))
    grey = (0.15 + 1.05 * covered)[..., None] * np.ones(3)
    scene = optics.apply_blur(grey.astype(np.float32), 0.5)
    image = isp.demosaic(mosaic(scene, "rggb"), "rggb", "edge_aware", 1.0)
    assert np.ptp(image, axis=-1).max() < 0.1
    assert np.abs(image.mean(axis=-1) - scene[..., 0]).max() < 0.25


def eye(lens: Lens, focal_px: float, width_px: int = 401) -> Intrinsics:
    """A camera whose axis meets the middle of pixel (50, 200)."""
    return Intrinsics(width_px, 101, focal_px, focal_px, 200.5, 50.5, lens)


def test_light_falls_off_with_the_fourth_power_of_the_cosine() -> None:
    """At a pixel 30 degrees off the axis: cos(30 deg)^4 = 9/16; the axis may be anywhere."""
    focal_px = 150.0 / math.tan(math.radians(30.0))
    for width_px in (401, 380):
        light = optics.natural_falloff(eye(Lens(), focal_px, width_px), 0.0)
        assert light[50, 200] == pytest.approx(1.0)
        assert light[50, 350] == pytest.approx(9.0 / 16.0, rel=1e-4)


def test_bent_images_are_as_bright_as_their_own_rays_say() -> None:
    """OpenCV's point for 30 degrees through a barrel: the same 9/16, farther in."""
    k = (-0.2, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    K = np.array([[300.0, 0, 200.0], [0, 300.0, 50.0], [0, 0, 1]])
    ahead = np.array([[[math.tan(math.radians(30.0)), 0.0, 1.0]]])
    ((x, y),) = cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), K, np.array(k))[0][0]
    light = optics.natural_falloff(eye(Lens("brown_conrady", k), 300.0), 0.0)

    assert x < 200.0 + 300.0 * math.tan(math.radians(30.0)) - 5.0
    assert np.interp(x, np.arange(401), light[round(y)]) == pytest.approx(9.0 / 16.0, rel=1e-4)


def test_fisheyes_fall_off_by_how_their_edge_is_squeezed() -> None:
    """Solid angle per area, by differences of OpenCV's fisheye; 2 / pi at 90 degrees if even."""
    even = optics.natural_falloff(eye(Lens("kannala_brandt", (0.0,) * 4), 360.0 / math.pi), 0.0)
    assert even[50, 380] == pytest.approx(2.0 / math.pi, rel=1e-3)

    k = (0.05, -0.01, 0.002, 0.0)
    degrees = np.array([20.0, 45.0, 70.0, 85.0])

    def radius(theta: np.ndarray) -> np.ndarray:
        ahead = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], -1)[None]
        # OpenCV divides by z; a direction is enough.
        return cv2.fisheye.projectPoints(
            ahead, np.zeros(3), np.zeros(3), np.eye(3), np.array(k)
        )[0][0, :, 0]  # fmt: skip

    theta, small = np.radians(degrees), 1e-4
    r = radius(theta)
    area = (radius(theta + small) ** 2 - radius(theta - small) ** 2) / 2.0
    solid = np.cos(theta - small) - np.cos(theta + small)
    focal_px = 110.0
    for power in (0.0, 1.0):
        light = optics.natural_falloff(eye(Lens("kannala_brandt", k), focal_px), power)
        seen = np.interp(200.0 + focal_px * r, np.arange(401), light[50])
        np.testing.assert_allclose(seen, solid / area * np.cos(theta) ** power, rtol=2e-3)


def test_what_a_lens_does_not_show_has_no_light_and_panoramas_are_even() -> None:
    """A fisheye of 100 degrees in a wide image: dark beyond; nothing is NaN."""
    lens = Lens("kannala_brandt", (0.0,) * 4, half_field_rad=math.radians(50.0))
    light = optics.natural_falloff(eye(lens, 110.0), 0.0)
    assert (light[50, [0, 400]] == 0.0).all()
    assert light[50, 200] == pytest.approx(1.0)
    panorama = Intrinsics(64, 32, 64 / math.tau, 64 / math.tau, 32.0, 16.0, Lens("equirectangular"))
    assert (optics.natural_falloff(panorama, 0.0) == 1.0).all()


def test_corners_lose_the_share_that_was_asked_for() -> None:
    """Half the light at the very corner."""
    dark = optics.apply_vignetting(flat(1.0, 1.0, 1.0), 0.5)
    assert dark[0, 0, 1] == pytest.approx(0.5, abs=0.03)
    assert dark[24, 32, 1] == pytest.approx(1.0, abs=0.001)


def test_red_is_larger_and_blue_smaller_by_the_asked_pixels_at_the_corner() -> None:
    """A dot near the corner: the centroids of its colours move apart."""
    image = np.zeros((200, 200, 3), np.float32)
    image[180:183, 180:183] = 1.0
    apart = optics.apply_chromatic_aberration(image, 4.0)
    y, x = np.mgrid[0:200, 0:200]
    radius = [
        math.hypot(*(float((g * apart[..., c]).sum() / apart[..., c].sum()) - 99.5 for g in (x, y)))
        for c in range(3)
    ]
    share = radius[1] / math.hypot(100.0, 100.0)
    assert radius[0] - radius[1] == pytest.approx(4.0 * share, abs=0.1)
    assert radius[1] - radius[2] == pytest.approx(4.0 * share, abs=0.1)


def test_the_circle_of_confusion_is_that_of_a_thin_lens() -> None:
    """50 mm at f/2 focused at 2 m, a point at 4 m: 50^2 / 2 * 2000 / (4000 * 1950) = 0.3205 mm."""
    z = np.array([[2.0, 4.0, np.inf, 1.0]])
    radius = optics.blur_radius_px(z, 2.0, 0.05, 2.0, 1e-5)
    np.testing.assert_allclose(radius[0, 0], 0.0, atol=1e-5)
    np.testing.assert_allclose(radius[0, 1], 0.5 * 0.3205e-3 / 1e-5, rtol=1e-3)
    np.testing.assert_allclose(radius[0, 2], 2.0 * radius[0, 1], rtol=1e-5)
    assert radius[0, 3] < 0.0


def test_what_is_in_focus_stays_and_what_is_not_spreads_without_bleeding() -> None:
    """A line behind the focus is spread over its circle; black beyond a sharp white half stays."""
    image = np.zeros((60, 60, 3), np.float32)
    image[:, 30] = 1.0
    sharp = optics.defocus(image, np.zeros((60, 60), np.float32))
    soft = optics.defocus(image, np.full((60, 60), 6.0, np.float32))
    np.testing.assert_allclose(sharp, image, atol=1e-6)
    assert soft[30, 24, 0] > 0.01
    assert soft[30, 20, 0] == pytest.approx(0.0, abs=1e-6)
    assert float(soft[30].sum()) == pytest.approx(3.0, rel=1e-3)

    image = np.zeros((40, 40, 3), np.float32)
    image[:, :20] = 1.0
    radius = np.zeros((40, 40), np.float32)
    radius[:, 20:] = 10.0
    soft = optics.defocus(image, radius)
    assert soft[20, 10, 0] == pytest.approx(1.0)
    assert soft[20, 25, 0] < 0.05


def test_layers_out_of_focus_are_those_of_whole_images_laid_over_one_another() -> None:
    """Each is blurred alone, far ones first, also at the borders; by SciPy's direct correlation."""
    rng = Rng(np.random.PCG64(5))
    image = rng.random((30, 44, 3)).astype(np.float32)
    radius = np.zeros((30, 44), np.float32)
    radius[:12, :9], radius[8:25, 30:41], radius[20:, 5:12] = 2.5, 1.6, -1.0
    total, weight = np.zeros(image.shape), np.zeros(radius.shape)
    y, x = np.mgrid[-3:4, -3:4]
    for blur in (2.5, 1.6, 0.0, -1.0):
        alpha = (radius == np.float32(blur)).astype(float)
        disc = np.clip(abs(blur) + 0.5 - np.hypot(x, y), 0.0, 1.0)
        spread = [
            ndimage.correlate(alpha * plane, disc / disc.sum(), mode="nearest")
            for plane in (*np.moveaxis(image, 2, 0), np.ones(radius.shape))
        ]
        total = np.stack(spread[:3], axis=2) + total * (1.0 - spread[3])[..., None]
        weight = spread[3] + weight * (1.0 - spread[3])
    np.testing.assert_allclose(
        optics.defocus(image, radius), total / weight[..., None], rtol=1e-4, atol=1e-6
    )


def test_exposure_is_reached_by_time_before_gain() -> None:
    """EV100 10 at f/2 and ISO 100: 2^2 / 2^10 s. In the dark the longest time, then gain."""
    control = ExposureControl(f_number=2.0, time_s=(1e-4, 0.04), iso=(100.0, 1600.0))
    bright = exposure_settings(10.0, control)
    assert (bright.time_s, bright.gain) == (pytest.approx(4.0 / 1024.0), 1.0)
    dim = exposure_settings(4.0, control)
    assert (dim.time_s, dim.gain) == (0.04, pytest.approx(4.0 / 16.0 / 0.04))
    assert dim.ev100 == pytest.approx(4.0)
    dark = exposure_settings(-6.0, control)
    assert dark.gain == 16.0
    assert dark.ev100 > -6.0


def test_grey_stays_grey_through_matrix_and_mosaic() -> None:
    """Noise-free photosites and a strong colour matrix: three equal channels."""
    pipeline = made(
        image_sensor={"full_well_e": 1e7, "read_noise_e": 0, "prnu": 0, "dsnu_e": 0, "bits": 16},
        color_matrix=[[1.7, -0.55, -0.15], [-0.25, 1.45, -0.2], [0, -0.5, 1.5]],
        exposure_control={"time_s": [1e-6, 10.0]},
        tone="linear",
    )
    photo = photograph(flat(0.5, 0.5, 0.5) * WHITE_CD_M2, pipeline)
    assert np.abs(photo.astype(int) - 128).max() <= 1


@pytest.mark.parametrize("warmth_ev", [-0.6, 0.6])
def test_what_saturates_the_sensor_stays_white_in_any_balance(warmth_ev: float) -> None:
    """Half of the image is far beyond white: all of its channels read 255."""
    scene = flat(200.0, 200.0, 200.0)
    scene[:24] = 50.0 * WHITE_CD_M2
    matrix = [[1.6, -0.45, -0.15], [-0.2, 1.4, -0.2], [0.0, -0.45, 1.45]]
    made_up = made(image_sensor={}, warmth_ev=warmth_ev, color_matrix=matrix, tone="linear")
    image = photograph(scene, made_up)
    assert (image[:20] == 255).all()
    assert np.ptp(image[30:].reshape(-1, 3).mean(axis=0)) > 20


def test_white_balance_takes_out_the_light_of_a_lamp() -> None:
    """Orange light on grey surfaces: grey again with a full share, orange without."""
    random = Streams(seed=1, scene=0).rng("patches").random((48, 64, 1))
    scene = random * np.array([0.8, 0.5, 0.2]) * WHITE_CD_M2
    grey = photograph(scene, made(white_balance=1, tone="srgb"))
    plain = photograph(scene, made(tone="srgb"))
    balanced = grey.reshape(-1, 3).mean(axis=0)
    assert np.ptp(balanced) < 6.0
    assert np.ptp(plain.reshape(-1, 3).mean(axis=0)) > 60.0


@pytest.mark.parametrize(("norm", "tolerance"), [(1, 0.4), (6, 0.06), (50, 0.03)])
def test_white_surface_corrects_a_scene_by_larger_norms(norm: float, tolerance: float) -> None:
    """A red wall with a white patch under a warm lamp: grey world takes the wall for light."""
    lamp = np.array([0.8, 0.6, 0.4], np.float32)
    image = np.broadcast_to(np.array([0.5, 0.2, 0.1], np.float32) * lamp, (48, 64, 3)).copy()
    image[:, :16] = lamp
    gains = isp.white_balance_gains(isp.estimate_illuminant(image, norm), 1.0, 0.0)

    # By hand: a quarter of the image is the lamp's colour; the norm of both parts.
    wall = np.array([0.5, 0.2, 0.1], np.float64)
    parts = lamp * (0.25 + 0.75 * wall**norm) ** (1.0 / norm)
    assert gains == pytest.approx(parts[1] / parts, rel=5e-3)
    assert np.abs(gains * lamp / lamp[1] - 1.0).max() < tolerance


def test_light_of_a_lamp_is_kept_and_that_of_a_colored_wall_is_not() -> None:
    """A black body of 2856 K (CIE's illuminant A) stays; a green one moves to a tint of 0.2."""
    # Linear sRGB of x = 0.44757, y = 0.40745 by the matrix that IEC 61966-2-1 prints.
    x, y = 0.44757, 0.40745
    matrix = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415],
                       [0.0557, -0.2040, 1.0570]])  # fmt: skip
    warm = matrix @ np.array([x / y, 1.0, (1.0 - x - y) / y])

    assert isp.move_to_lamps(warm, 0.0) == pytest.approx(warm / warm[1], rel=0.03)
    assert isp.move_to_lamps(warm * 7.0, 8.0) == pytest.approx(warm / warm[1])
    for color in ((0.3, 1.0, 0.3), (1.0, 0.3, 1.0)):
        neutral, tinted = (isp.move_to_lamps(np.array(color), ev) for ev in (0.0, 0.2))
        moved_ev = np.log2(tinted[[0, 2]] / neutral[[0, 2]])
        assert np.hypot(*moved_ev) == pytest.approx(0.2)
        assert np.sign(moved_ev.sum()) == (-1.0 if color[1] == 1.0 else 1.0)


def test_white_balance_of_a_colored_camera_seeks_lamps_in_srgb() -> None:
    """A magenta picture keeps its colour with a tint of 0, and loses it without a limit."""
    random = Streams(seed=1, scene=0).rng("patches").random((48, 64, 1))
    scene = random * np.array([0.7, 0.25, 0.7]) * WHITE_CD_M2
    matrix = [[1.6, -0.5, -0.1], [-0.2, 1.4, -0.2], [0, -0.5, 1.5]]
    given = {"white_balance": 1, "white_balance_norm": 6, "tone": "srgb", "color_matrix": matrix}
    free, bound = (
        photograph(scene, made(**given, **limit)).reshape(-1, 3).mean(axis=0)
        for limit in ({}, {"white_balance_tint_ev": 0.0})
    )

    assert abs(free[0] - free[1]) < 8.0
    assert bound[0] - bound[1] > 40.0


def test_compression_leaves_its_traces_and_little_else() -> None:
    """A noisy image through JPEG differs, by less the better the quality."""
    ramp = np.linspace(0.2, 0.8, 64, dtype=np.float32)[:, None, None]
    noise = 0.05 * rng().standard_normal((64, 64, 1)).astype(np.float32)
    image = to_bytes(np.repeat(ramp + noise, 3, axis=2))
    rough = isp.compress_jpeg(image, 30).astype(int) - image
    fine = isp.compress_jpeg(image, 98).astype(int) - image
    assert np.abs(rough).mean() > 1.5 * np.abs(fine).mean() > 0.0


@pytest.mark.parametrize("name", sorted(set(preset_names(PRESETS)) - {"ideal"}))
def test_every_preset_takes_the_same_picture_twice(name: str) -> None:
    """Same stream, same bytes; a picture of a mid-grey scene is neither black nor white."""
    radiance, depth_m = flat(40.0, 45.0, 50.0), np.full((48, 64), 2.0)
    one, two, other = (
        photo(radiance, made(preset=name), depth_m=depth_m, stream=rng(stream)).rgb
        for stream in ("one", "one", "another")
    )
    assert one.shape == (48, 64, 3)
    assert (one == two).all()
    # A photograph that was developed before has its noise already.
    assert (one != other).any() == (name != "photograph")
    assert 30 < one.mean() < 225


def test_given_values_win_over_a_preset() -> None:
    pipeline = made(preset="phone", image_sensor={"bits": 14}, tone="srgb")
    assert pipeline.tone == "srgb"
    assert pipeline.image_sensor is not None
    assert (pipeline.image_sensor.bits, pipeline.image_sensor.full_well_e) == (14, 10_000.0)
