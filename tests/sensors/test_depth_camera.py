"""Depth cameras against published formulas and geometry."""

import json
import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.errors import ConfigError, SampleError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.depth.depth_camera import DepthCamera, DepthModel
from gen_data.sensors.depth.structured_light import axial_noise_m, lateral_noise_px
from gen_data.sensors.depth.time_of_flight import unwrap_phases
from gen_data.sensors.device_presets import preset_names
from tests.renderers.fake_library import FakeLibrary, box_mesh

SIZE_PX = (200, 150)
HFOV_DEG = 60.0
FOCAL_PX = 100.0 / math.tan(math.radians(30.0))
THICK_M = 0.2
LIGHT_M_S = 299_792_458.0


def grey(albedo: float) -> Material:
    return Material(base_color=(albedo, albedo, albedo), roughness=1.0, specular=0.0)


MESHES = {
    "wall": box_mesh((60.0, 60.0, THICK_M), (grey(0.5),)),
    "dark": box_mesh((60.0, 60.0, THICK_M), (grey(0.01),)),
    "board": box_mesh((0.6, 60.0, THICK_M), (grey(0.5),)),
}
RENDERER = WarpRenderer(FakeLibrary(MESHES), "cpu")


def board(asset: str, z_m: float, lean_rad: float = 0.0) -> Body:
    turn = (math.cos(0.5 * lean_rad), 0.0, math.sin(0.5 * lean_rad), 0.0)
    back_m = 0.5 * THICK_M
    place = (back_m * math.sin(lean_rad), 0.0, z_m + back_m * math.cos(lean_rad))
    return Body(asset, asset, SE3(place, turn))


def scene(*bodies: Body, lens: Intrinsics | None = None) -> Scene:
    lens = lens or Intrinsics.from_hfov(*SIZE_PX, math.radians(HFOV_DEG))
    return Scene(
        "test",
        bodies=bodies,
        cameras=(Camera("depth_camera", SE3(), lens),),
        lights=(Light("lamp", "sphere", position_m=(0.3, -1.0, 0.0), intensity_cd=100.0),),
        environment=Environment(luminance_cd_m2=10.0),
    )


def model(kind: str, range_m: tuple[float, float] = (0.0, 50.0), **principle: Any) -> DepthModel:
    plain = {
        "size_px": SIZE_PX, "hfov_deg": HFOV_DEG, "range_m": range_m,
        "principle": {"kind": kind, **principle},
    }  # fmt: skip
    return DepthModel.model_validate_json(json.dumps(plain))


def read(device: DepthModel, *bodies: Body, seed: int = 0) -> SensorReading:
    sensor = DepthCamera(model=device)
    rng = Streams(seed, scene=0).rng("sensor/depth_camera")
    return sensor.capture(scene(*bodies), RENDERER, frozenset(), rng)


def measured(device: DepthModel, *bodies: Body) -> tuple[np.ndarray, np.ndarray]:
    """Its reading and the truth, [h, w]."""
    reading = read(device, *bodies)
    return reading.channels[Channel.MEASURED_DEPTH], reading.channels[Channel.Z_DEPTH]


def seen_share(z_m: np.ndarray) -> float:
    return float(np.isfinite(z_m).mean())


# -- all of them ---------------------------------------------------------------------------------


def test_an_ideal_device_reports_the_truth_within_its_range() -> None:
    """Holes on the other side of it."""
    near_m, true_m = measured(model("ideal"), board("wall", 2.0))
    far_m, _ = measured(model("ideal", (0.5, 1.9)), board("wall", 2.0))

    assert np.array_equal(near_m, true_m)
    assert np.allclose(true_m, 2.0, atol=1e-5)
    assert seen_share(far_m) == 0.0


@pytest.mark.parametrize("name", preset_names("gen_data.sensors.depth"))
def test_every_device_sees_a_grey_wall_at_a_metre_and_a_half(name: str) -> None:
    """Nearly everywhere, and to within a few centimetres."""
    sensor = DepthCamera(model=name, size_px=SIZE_PX)
    rng = Streams(0, scene=0).rng("sensor/depth_camera")
    reading = sensor.capture(scene(board("wall", 1.5)), RENDERER, frozenset(), rng)

    z_m = reading.channels[Channel.MEASURED_DEPTH]
    assert seen_share(z_m) > 0.85
    assert np.quantile(np.abs(z_m[np.isfinite(z_m)] - 1.5), 0.9) < 0.08
    assert reading.channels[Channel.INFRARED].max() > 0


@pytest.mark.parametrize("kind", ["structured_light", "active_stereo", "time_of_flight"])
def test_labels_stay_the_truth(kind: str) -> None:
    bodies = (board("board", 1.0), board("wall", 2.0))
    reading = read(model(kind), *bodies)
    ideal = RENDERER.render(scene(*bodies), scene().cameras[0], frozenset({Channel.Z_DEPTH}))

    truth = reading.channels[Channel.Z_DEPTH]
    assert np.array_equal(truth, ideal.channels[Channel.Z_DEPTH])
    assert not np.array_equal(truth, reading.channels[Channel.MEASURED_DEPTH])


def test_other_seeds_make_other_noise() -> None:
    """And the same seed the same."""
    one, same, other = (
        read(model("time_of_flight"), board("wall", 2.0), seed=seed)
        .channels[Channel.MEASURED_DEPTH]
        .tobytes()
        for seed in (0, 0, 1)
    )

    assert one == same
    assert one != other


def test_a_lens_that_is_no_pinhole_is_refused() -> None:
    fisheye = Intrinsics.from_hfov(40, 30, 1.0, Lens("kannala_brandt", (0.0, 0.0, 0.0, 0.0)))
    rng = Streams(0, scene=0).rng("x")

    with pytest.raises(SampleError, match=r"is a pinhole, got the lens kannala_brandt"):
        DepthCamera().capture(scene(lens=fisheye), RENDERER, frozenset(), rng)


# -- structured light ----------------------------------------------------------------------------


@pytest.mark.parametrize(("z_m", "sigma_m"), [(1.0, 0.001884), (2.0, 0.006064), (3.0, 0.014044)])
def test_axial_noise_is_that_of_nguyen_and_others(z_m: float, sigma_m: float) -> None:
    """0.0012 + 0.0019 (z - 0.4)^2, quantisation included; to 6 %.

    With 1/32 px of a focal length of 173 px steps are nearly as of a Kinect.
    """
    device = model("structured_light", step_px=0.03125)
    seen_m, true_m = measured(device, board("wall", z_m))

    assert np.std((seen_m - true_m)[np.isfinite(seen_m)]) == pytest.approx(sigma_m, rel=0.06)


def test_steep_surfaces_are_noisier_by_the_published_term() -> None:
    """At 70 degrees and 1 m: 0.0001 * 1.2217^2 / 0.3491^2 more; across, 0.035 * 3.5 px more."""
    lean = np.full(1, math.radians(70.0), np.float32)
    z_m = np.ones(1, np.float32)
    assert axial_noise_m(z_m, lean)[0] == pytest.approx(0.001884 + 0.0012246, rel=1e-3)
    assert axial_noise_m(z_m, 0.5 * lean)[0] == pytest.approx(0.001884, rel=1e-5)
    assert lateral_noise_px(lean)[0] == pytest.approx(0.8 + 0.035 * 3.5, rel=1e-3)


def test_disparities_are_whole_eighths_of_a_pixel() -> None:
    """On a leaning wall every depth is ``8 f b / n``."""
    device = model("structured_light", baseline_m=0.075)
    seen_m, _ = measured(device, board("wall", 1.5, lean_rad=0.4))
    steps = 8.0 * FOCAL_PX * 0.075 / seen_m[np.isfinite(seen_m)].astype(float)

    assert np.abs(steps - np.rint(steps)).max() < 1e-4
    assert len(np.unique(np.rint(steps))) > 10


def test_the_projectors_shadow_is_as_wide_as_the_disparities_differ() -> None:
    """It is to the left if the projector is to the right: ``f b (1 / 0.8 - 1 / 2)`` = 12 px.

    The board is from -0.3 to 0.3 m: 65 px to either side of the middle.
    """
    device = model("structured_light", baseline_m=0.0923, noise=0.0, window_share=0.0)
    seen_m, _ = measured(device, board("board", 0.8), board("wall", 2.0))
    holes = np.flatnonzero(~np.isfinite(seen_m[75]))

    edge_px = 100.0 - FOCAL_PX * 0.3 / 0.8
    width_px = FOCAL_PX * 0.0923 * (1.0 / 0.8 - 1.0 / 2.0)
    assert len(holes) == pytest.approx(width_px, abs=1.5)
    assert holes.max() == pytest.approx(edge_px - 0.5, abs=1.0)


def test_what_returns_too_little_or_too_much_light_is_a_hole() -> None:
    """A dark wall far away, a bright one close by, and a wall that leans away too far."""
    assert seen_share(measured(model("structured_light"), board("dark", 3.0))[0]) < 0.01
    assert seen_share(measured(model("structured_light"), board("wall", 0.1))[0]) < 0.01
    assert seen_share(measured(model("structured_light"), board("wall", 3.0))[0]) > 0.99
    steep = measured(model("structured_light"), board("wall", 2.0, lean_rad=1.5))[0]
    assert not np.isfinite(steep[:, 100]).any()


# -- time of flight ------------------------------------------------------------------------------

SINGLE = {"modulation_mhz": [30], "bounce": 0.0, "flying": False, "electrons": 20_000.0}


def middle(z_m: np.ndarray) -> np.ndarray:
    """Where range and depth are the same to a thousandth: at most 2.5 degrees off the axis."""
    return z_m[70:80, 94:106]


def test_phase_noise_follows_from_the_electrons() -> None:
    """``L / (2 pi) * sqrt(variance / 2) / A`` with A = 20000 * 0.5 / z^2, as infrared shows it.

    Variance of a sample: its mean ``A / contrast + ambient`` and the square of the reading noise.
    """
    device = model("time_of_flight", contrast=0.5, ambient=300.0, read_noise=30.0, **SINGLE)
    reading = read(device, board("wall", 2.0))
    z_m, infrared = (reading.channels[c] for c in (Channel.MEASURED_DEPTH, Channel.INFRARED))

    amplitude = 20_000.0 * 0.5 / 4.0
    variance = amplitude / 0.5 + 300.0 + 30.0**2
    ambiguity_m = LIGHT_M_S / 60e6
    sigma_m = ambiguity_m / (2.0 * math.pi) * math.sqrt(0.5 * variance) / amplitude
    around = z_m[50:100, 70:130]
    assert middle(infrared).mean() == pytest.approx(amplitude, rel=0.02)
    assert np.std(around) == pytest.approx(sigma_m, rel=0.05)
    assert np.mean(around) == pytest.approx(2.0, abs=3.0 * sigma_m / math.sqrt(around.size))


def test_one_frequency_wraps_around_where_several_do_not() -> None:
    """At 30 MHz 6.5 m is 6.5 - 4.9965 m; with 16, 80 and 120 MHz it is 6.5 m.

    8 MHz divides all of these: 20 m is 20 - 18.737 m.
    """
    bright = {**SINGLE, "electrons": 1e6, "full_well": 1e7}
    three = {**bright, "modulation_mhz": [16, 80, 120]}
    for near, z_m, expected_m in (
        (bright, 4.5, 4.5),
        (bright, 6.5, 6.5 - LIGHT_M_S / 60e6),
        (three, 6.5, 6.5),
        (three, 20.0, 20.0 - LIGHT_M_S / 16e6),
    ):
        seen_m, _ = measured(model("time_of_flight", **near), board("wall", z_m))
        assert np.median(middle(seen_m)) == pytest.approx(expected_m, abs=0.02)


def test_phases_that_belong_to_no_distance_disagree() -> None:
    """Exact phases agree to nothing; a pair that is half a turn off does not."""
    mhz = (16, 80, 120)
    range_m = np.array([[0.3, 3.1, 17.0]])
    phases = np.stack([4e6 * math.pi * f * range_m / LIGHT_M_S for f in mhz]) % (2 * math.pi)
    found_m, disagreement = unwrap_phases(phases.astype(np.float32), mhz)
    off = phases + np.array([0.0, 0.5 * math.pi, 0.0])[:, None, None]
    _, worse = unwrap_phases((off % (2 * math.pi)).astype(np.float32), mhz)

    assert np.allclose(found_m, range_m, atol=1e-4)
    assert disagreement.max() < 1e-3
    assert worse.min() > 0.3


@pytest.mark.parametrize("flying", [True, False])
def test_pixels_fly_only_at_edges_and_only_with_a_footprint(flying: bool) -> None:
    """Depths between a board at 0.9 m and a wall at 1.5 m occur at the board's edges alone."""
    sure = {**SINGLE, "electrons": 1e6, "full_well": 1e8, "flying": flying}
    seen_m, true_m = measured(
        model("time_of_flight", **sure), board("board", 0.9), board("wall", 1.5)
    )
    between = (seen_m > 0.95) & (seen_m < 1.45)
    edge = np.zeros(true_m.shape, bool)
    step = np.abs(np.diff(true_m, axis=1)) > 0.3
    edge[:, 1:] |= step
    edge[:, :-1] |= step

    assert not (between & ~edge).any()
    assert between.any() == flying


def test_a_bounce_makes_distances_longer() -> None:
    """On a flat wall: none without it, and more with more."""
    sure = {**SINGLE, "electrons": 1e6, "full_well": 1e8}
    bias_m = [
        float(
            np.median(np.subtract(*measured(model("time_of_flight", **given), board("wall", 2.0))))
        )
        for given in (sure, {**sure, "bounce": 0.1}, {**sure, "bounce": 0.3})
    ]

    assert abs(bias_m[0]) < 2e-4
    assert 0.001 < bias_m[1] < 0.5 * bias_m[2]
    assert bias_m[2] < 0.1


def test_weak_and_overflowing_pixels_are_holes() -> None:
    """A dark wall at 4 m, and a grey one at 20 cm."""
    device = model("time_of_flight")
    assert seen_share(measured(device, board("dark", 4.0))[0]) < 0.05
    assert seen_share(measured(device, board("wall", 0.2))[0]) == 0.0
    assert seen_share(measured(device, board("wall", 4.0))[0]) > 0.99


# -- active stereo -------------------------------------------------------------------------------

BASE_M = 0.05


def disparity_error_px(device: DepthModel, *bodies: Body) -> np.ndarray:
    seen_m, true_m = measured(device, *bodies)
    return (FOCAL_PX * BASE_M * (1.0 / seen_m - 1.0 / true_m))[np.isfinite(seen_m)]


@pytest.mark.parametrize(("z_m", "lean_rad"), [(0.5, 0.0), (0.77, 0.0), (0.6, 0.5)])
def test_matching_finds_projected_dots_to_a_tenth_of_a_pixel(z_m: float, lean_rad: float) -> None:
    """The median error, wherever between whole pixels the disparity lies; without a bias."""
    dots = {"pitch_mrad": 50, "dot_mrad": 5}
    device = model("active_stereo", baseline_m=BASE_M, dots=dots)
    error_px = disparity_error_px(device, board("wall", z_m, lean_rad))

    assert len(error_px) > 0.75 * SIZE_PX[0] * SIZE_PX[1]
    assert np.median(np.abs(error_px)) < 0.1
    assert abs(np.median(error_px)) < 0.05


def test_a_blank_wall_needs_the_projector() -> None:
    """Without dots few matches are right."""
    lit, blank = (
        disparity_error_px(model("active_stereo", projector_cd=cd), board("wall", 0.6))
        for cd in (70.0, 0.0)
    )
    pixels = SIZE_PX[0] * SIZE_PX[1]

    assert (np.abs(lit) < 0.3).sum() > 0.7 * pixels
    assert (np.abs(blank) < 0.3).sum() < 0.35 * pixels


def test_edges_are_fat_and_their_left_sides_have_holes() -> None:
    """The right camera does not see a strip of the wall, ``f b (1 / 0.4 - 1 / 2)`` px wide.

    Blocks that hold a bit of the board take all of themselves for it.
    """
    device = model("active_stereo", baseline_m=BASE_M, dots={"pitch_mrad": 50, "dot_mrad": 5})
    near = Body("post", "board", SE3((0.3, 0.0, 0.4 + 0.5 * THICK_M)))
    seen_m, true_m = measured(device, near, board("wall", 2.0))
    edge_px = int(np.flatnonzero(np.diff(true_m[75]) < -1.0)[0]) + 1
    strip = seen_m[20:130, edge_px - 12 : edge_px - 4]
    beside = seen_m[20:130, edge_px - 1]

    assert np.isfinite(strip).mean() < 0.75
    assert np.isfinite(seen_m[20:130, edge_px - 50 : edge_px - 25]).mean() > 0.9
    assert (beside < 0.6).mean() > 0.3


# -- pairs of colour cameras ---------------------------------------------------------------------


def stereo(
    right_m: tuple[float, float, float] = (0.1, 0.0, 0.0), of: str = "right"
) -> SensorReading:
    lens = Intrinsics.from_hfov(*SIZE_PX, math.radians(HFOV_DEG))
    cameras = (Camera("left", SE3(), lens), Camera("right", SE3(right_m), lens))
    world = Scene("t", bodies=(board("board", 0.8), board("wall", 2.0)), cameras=cameras)
    channels = ("depth", "disparity", "disparity_visible")
    sensor = RgbCamera(name="left", channels=channels, stereo_with=of)
    return sensor.capture(world, RENDERER, frozenset(), Streams(0, scene=0).rng("s"))


def test_a_camera_of_a_pair_tells_disparities() -> None:
    """``f b / z`` everywhere.

    Not visible are a strip of the wall next to the board and one at the image's left rim, as wide
    as the disparities differ.
    """
    channels = stereo().channels
    disparity, visible = channels[Channel.DISPARITY], channels[Channel.DISPARITY_VISIBLE]
    wall_px, board_px = FOCAL_PX * 0.1 / 2.0, FOCAL_PX * 0.1 / 0.8

    assert np.allclose(disparity, FOCAL_PX * 0.1 / channels[Channel.Z_DEPTH], rtol=1e-6)
    hidden = np.flatnonzero(visible[75] == 0.0)
    rim, strip = hidden[hidden < 20], hidden[hidden >= 20]
    assert len(rim) == pytest.approx(wall_px, abs=1.0)
    assert len(strip) == pytest.approx(board_px - wall_px, abs=1.5)
    assert (visible[visible > 0.0] == disparity[visible > 0.0]).all()


def test_cameras_that_are_no_pair_are_told_why() -> None:
    """Names, the fact and the remedy."""
    with pytest.raises(SampleError, match=r"'left' and 'right' are not a rectified pair: .*rig"):
        stereo((0.1, 0.02, 0.0))
    with pytest.raises(ConfigError, match=r"there is no camera 'rihgt'.*did you mean 'right'"):
        stereo(of="rihgt")
    with pytest.raises(ValidationError, match="name it with stereo_with"):
        RgbCamera(channels=("disparity",))
