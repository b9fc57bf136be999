"""The image pipeline as one chain: its order, its presets, its place in configurations."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.config.distributions import Constant
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Camera, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.sensors.camera.image_pipeline import (
    PRESETS,
    STAGES,
    ImagePipeline,
    capture_photograph,
)
from gen_data.sensors.camera.isp import display_values, to_bytes
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.device_presets import preset_names
from tests.sensors.camera.photographs import EYE, WHITE_CD_M2, made, photo, rng
from tests.sensors.recorder import Recorder


def speckled(height: int = 48, width: int = 64) -> Any:
    """Radiance from black to five times white [cd/m^2]."""
    image = Streams(seed=2, scene=0).rng("image").uniform(0.0, 5.0, (height, width, 3)) ** 3
    return (image / 25.0 * WHITE_CD_M2).astype(np.float32)


def test_the_chain_has_the_order_of_a_camera() -> None:
    """Glass first, from its front to its barrel, then the sensor, then colours."""
    assert [stage.__name__.strip("_") for stage in STAGES] == [
        "lens_drops", "defocus", "shake", "flare", "glare", "blur", "chromatic_aberration",
        "vignetting", "image_circle", "image_sensor", "denoise", "saturation",
    ]  # fmt: skip


def test_every_stage_of_a_camera_with_all_errors_changes_its_picture() -> None:
    """Drops, blur, ghosts, veil, fringes, dark corners, noise, colours, tone and JPEG."""
    everything: dict[str, Any] = {
        "focus": {"distance_m": 0.2, "pixel_um": 100}, "exposure_control": {"f_number": 0.7},
        "flare": 0.5, "glare": 0.3, "blur_px": 2, "chromatic_aberration_px": 3,
        "vignetting": 0.5, "natural_vignetting": True, "exposure_compensation_ev": 1,
        "image_sensor": {"full_well_e": 500}, "color_matrix": [[2, -1, 0], [0, 1, 0], [0, 0, 1]],
        "saturation": 0.3, "white_balance": 1, "white_balance_norm": 6,
        "white_balance_tint_ev": 0, "contrast": 0.7, "tone": "knee", "sharpening": 1,
        "jpeg_quality": 40,
    }  # fmt: skip

    # Half of it in shade: saturated pixels show no balance.
    radiance = speckled() * np.where(np.arange(64) < 32, 0.05, 1.0)[None, :, None]

    def picture(given: dict[str, Any], weather: Weather) -> Any:
        return photo(radiance, made(**given), depth_m=np.full((48, 64), 2.0), weather=weather).rgb

    wet = Weather(lens_drops=0.3, seed=3)
    whole = picture(everything, wet)

    assert (whole != picture(everything, Weather())).any()
    for key in everything:
        less = {name: value for name, value in everything.items() if name != key}
        assert (whole != picture(less, wet)).any(), key


def test_ideal_is_the_default_and_reaches_every_exposure() -> None:
    """It exposes, and applies Uchimura's curve: nothing else happens to the radiance."""
    assert "ideal" in preset_names(PRESETS)
    assert ImagePipeline() == ImagePipeline(preset="ideal")

    ideal = photo(speckled())

    expected = to_bytes(display_values(speckled().astype(np.float64) / WHITE_CD_M2, "filmic"))
    assert np.abs(ideal.rgb.astype(int) - expected).max() <= 1
    assert ideal.ev100 == 8.0

    # IEC 61966-2-1: a quarter of white is byte 137, also at night.
    night = np.full((48, 64, 3), 0.25 * 1.2 * 2.0**-9)
    assert (photo(night, made(tone="srgb"), replace(EYE, ev100=-9.0)).rgb == 137).all()


def test_exposure_compensation_is_in_stops() -> None:
    """+1 stop shows half the luminance in the same tone."""
    brighter = photo(0.5 * speckled(), made(exposure_compensation_ev=1.0)).rgb

    np.testing.assert_array_equal(photo(speckled()).rgb, brighter)


def test_glare_ends_where_the_lens_shows_nothing() -> None:
    """Outside a fisheye's field: black, though light is scattered all around."""
    lens = Lens("kannala_brandt", (0.0,) * 4, half_field_rad=0.6)
    camera = Camera("eye", SE3(), Intrinsics(96, 96, 40.0, 40.0, 48.0, 48.0, lens), ev100=8.0)
    dark = np.isnan(camera.intrinsics.pixel_rays()[..., 0])
    radiance = np.where(dark[..., None], 0.0, speckled(96, 96))

    rgb = photo(radiance, made(glare=0.1), camera).rgb

    assert 0.2 < dark.mean() < 0.9
    assert not rgb[dark].any()
    assert (rgb[~dark] > 0).all()


def test_renderers_are_asked_for_radiance_and_only_for_the_depth_that_is_needed() -> None:
    """RGB is the camera's; radiance is not kept unless it was asked for."""
    renderer = Recorder(speckled())

    def captured(*channels: Channel) -> SensorReading:
        return capture_photograph(
            Scene("t"), renderer, EYE, frozenset(channels), ImagePipeline(), rng()
        )

    reading = captured(Channel.RGB, Channel.INSTANCE)
    assert renderer.asked == {Channel.RADIANCE, Channel.INSTANCE}
    assert set(reading.channels) == {Channel.RGB, Channel.INSTANCE}
    assert reading.ev100 == 8.0
    assert set(captured(Channel.RGB, Channel.RADIANCE).channels) == {Channel.RGB, Channel.RADIANCE}
    captured(Channel.INSTANCE)
    assert renderer.asked == {Channel.INSTANCE}


def test_radiance_is_left_as_it_was() -> None:
    radiance = speckled()
    kept = radiance.copy()
    photo(radiance, made(preset="webcam", focus=None), weather=Weather(lens_drops=0.2))
    assert np.array_equal(radiance, kept)


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "own.yaml"
    path.write_text(f"template: tabletop\n{text}")
    return str(path)


def test_deprecated_keys_are_read_with_a_warning_and_refused_beside_their_new_names(
    tmp_path: Path,
) -> None:
    """``formation`` with ``bloom``, ``shutter`` and ``photosites``, each told at its place."""
    old = "{bloom: 0.02, shutter: {f_number: 4.0}, photosites: {bits: 10}}"
    own = written(tmp_path, f"sensors:\n  - type: rgb_camera\n    formation: {old}\n")

    with pytest.warns(FutureWarning) as warned:
        (camera,) = load_config(own).sensors

    pipeline = camera.image_pipeline
    assert pipeline.glare == Constant(0.02)
    assert pipeline.exposure_control.f_number == 4.0
    assert pipeline.image_sensor.bits == 10
    told = [str(warning.message) for warning in warned]
    assert any("own.yaml:4:5: " in text and "called 'image_pipeline' now" in text for text in told)
    for name in ("glare", "exposure_control", "image_sensor"):
        assert any(f"called '{name}' now" in text for text in told), name

    own = written(tmp_path, "sensors:\n  - {type: rgb_camera, formation: {}, image_pipeline: {}}\n")
    with pytest.raises(ConfigError, match=r"own\.yaml:3:24: .*called 'image_pipeline' now"):
        load_config(own)


@pytest.mark.parametrize("key", ["tone", "glare", "exposure_compensation_ev"])
def test_properties_of_cameras_are_refused_under_render(tmp_path: Path, key: str) -> None:
    """One line with the place, and the key's new one."""
    own = written(
        tmp_path, f"render:\n  antialias: 2\n  {key}: 0.1\nsensors: [{{type: rgb_camera}}]\n"
    )

    with pytest.raises(ConfigError) as refused:
        load_config(own)

    first = str(refused.value).splitlines()[0]
    assert f"own.yaml:4:3: render.{key}: " in first
    assert f"sensors[].image_pipeline.{key}" in first
    assert "unknown key" not in str(refused.value)


def test_cameras_of_a_rig_share_the_settings_of_one() -> None:
    """Grey images of two cameras agree with ``settings_of`` up to their noise, and differ without.

    A name that no camera has is refused.
    """
    scene = Scene("t", cameras=tuple(replace(EYE, name=name) for name in ("left", "right")))
    drawn = made(exposure_error_ev={"uniform": [-3, 0]})
    grey = Recorder(np.full((48, 64, 3), 0.2 * WHITE_CD_M2, np.float32))

    def level(name: str, settings_of: str = "") -> float:
        sensor = RgbCamera(
            name=name, channels=(Channel.RGB,), image_pipeline=drawn, settings_of=settings_of
        )
        own = Streams(seed=5, scene=0).rng(f"sensor/{name}")
        reading = sensor.capture(scene, grey, frozenset(), own)
        return float(reading.channels[Channel.RGB].mean())

    assert level("right", "left") == level("left")
    assert level("right") != level("left")
    with pytest.raises(ConfigError, match=r"settings_of: there is no camera 'lefd'.*'left'"):
        level("right", "lefd")
