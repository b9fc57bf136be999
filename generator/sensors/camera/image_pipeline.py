"""Image pipeline: all stages from radiance to the bytes of a photograph, in order."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gen_data.config import base_model, yaml_tree
from gen_data.config.distributions import (
    Bounds,
    Constant,
    NonNegative,
    Positive,
    Scalar,
    UnitInterval,
)
from gen_data.core import capture, errors, interfaces, se3, streams
from gen_data.core.asset_types import Float32
from gen_data.core.scene import Camera, Scene, Weather
from gen_data.sensors.camera import isp, local_tone, optics
from gen_data.sensors.camera.denoising import denoise, is_noisy
from gen_data.sensors.camera.exposure import (
    EV100_DARKEST,
    EV100_RANGE,
    ExposureControl,
    ExposureSettings,
    dimming_ev,
    exposure_settings,
    meter_ev100,
    meter_mean_ev100,
    reachable_ev100,
    saturation_cd_m2,
)
from gen_data.sensors.camera.image_sensor import (
    ImageSensor,
    expected_exposure,
    expose,
    expose_colors,
    filter_shares,
    mosaic,
    scale_filters,
)
from gen_data.sensors.camera.isp import Tone, tone_to_bytes, tone_to_display
from gen_data.sensors.camera.lens_drops import lens_drops, refract_in_drops
from gen_data.sensors.camera.optics import add_flare, add_glare
from gen_data.sensors.device_presets import check_preset, preset_path

NONE = Constant(0.0)
CONTRASTS = 16
"""Steps of contrast per unit."""
_LEAST_SHARPENED_PX = 0.25
"""Radius below which unsharp masking changes nothing: a Gaussian spreads a thousandth then."""
PRESETS = "gen_data.sensors.camera.presets"
Row = tuple[float, float, float]


class Focus(base_model.Strict):
    """Focus of a lens with a finite depth of field.

    Attributes:
        distance_m: Focus distance; null = the median depth in the middle of the image.
        pixel_um: Pixel pitch, which converts the focal length from pixels to metres.
    """

    distance_m: Positive | None = None
    pixel_um: float = Field(3.0, gt=0, le=100)


class ImagePipeline(base_model.Strict):
    """Stages from radiance to a photograph; a stage that is left out has no effect.

    Distributions are drawn once per view: all images of a sequence have the same values.

    Attributes:
        preset: A camera of ``generator/sensors/camera/presets``, which provides defaults for all
            other keys; ``ideal`` has an exposure and a tone curve, and no errors.
        reduction: Width of the camera's photograph over the width of the image: above 1, the image
            is
            reduced from a larger photograph. Pixels, photosites and lengths in pixels of all other
            keys refer to the photograph; each pixel of the image is the mean of ``reduction``
            squared pixels of the photograph, after each has its tone.
        focus: Depth of field; null = everything is sharp.
        shake_px: Length of the path that the image moves along while the shutter is open, as in a
            hand; straight, in a drawn direction.
        flare: Share of the light far beyond white that returns as ghosts.
        glare: Share of all light that the lens scatters around its source; 0.02 suits a clean
            lens, 0.1 a dirty one.
        blur_px: Standard deviation of the point spread function of the lens together with the
            filter before the sensor: 0.4 to 0.7 for most cameras. Without it, thin lines are
            coloured by demosaicing.
        chromatic_aberration_px: Shift of red and blue against green at the corners.
        natural_vignetting: Whether illumination falls with the angle to the axis: with the fourth
            power of its cosine, for fisheyes as ``fisheye_pupil`` defines.
        fisheye_pupil: Power of the cosine of a fisheye's pupil: 0 turns to the light, 1 is flat.
        vignetting: Share of the light that the barrel blocks at the corners.
        metered_mean: Mean of the linear image that automatic exposure sets, as a share of
            saturation, where saturated pixels count as 1; null = the log-average luminance becomes
            middle grey.
        metered_clip: Largest share of the image that automatic exposure with a ``metered_mean``
            lets saturate; 1 = any.
        low_key: How far automatic exposure follows the eye, which sees dim scenes as dark: 1 leaves
            a street at night 2 stops below a picture by day, 0 brightens it as far as it can.
        exposure_compensation_ev: Added to the exposure, in stops; positive is brighter.
        exposure_error_ev: Error of metering, in stops; positive is brighter.
        exposure_control: Limits of aperture, time and gain of an image sensor; without a sensor
            every exposure is possible.
        image_sensor: The sensor; null = an ideal one.
        color_matrix: Matrix from white-balanced raw colours to linear sRGB; rows sum to 1.
        white_balance: Share of the illuminant's colour that automatic white balance corrects.
        white_balance_norm: Minkowski norm of each channel that estimates the illuminant: 1 = grey
            world, 6 = shades of grey, which errs least, large = white patch.
        white_balance_tint_ev: Largest difference of the estimate from the colours of lamps and
            daylight, between green and magenta, in stops; null = any estimate.
        warmth_ev: Error of the white balance: red over blue, in stops.
        denoise: Strength of noise reduction, where noise is visible: 1 averages pixels that differ
            by no more than noise, 0.5 to 0.9 leaves some grain.
        demosaic: Method of demosaicing: ``edge_aware`` as in good cameras, ``bilinear`` as in cheap
            ones, with coloured edges.
        saturation: Factor on saturation.
        contrast: Slope of the tone at middle grey on logarithmic axes: 1 adds none, 1.3 suits
            most cameras.
        tone: Tone curve, see ``generator/sensors/camera/isp.py``; ``log`` is for sensors with
            several exposures, and so is ``local``, which shows dark and bright areas as if each had
            a separate exposure, as phones do.
        sharpening: Amount of unsharp masking.
        sharpening_px: Radius of unsharp masking.
        jpeg_quality: Quality of compression, 1 to 100; null = none.
    """

    preset: str = "ideal"
    reduction: float = Field(1.0, ge=1, le=64)
    focus: Focus | None = None
    shake_px: Annotated[Scalar, Bounds(0, 60)] = NONE
    flare: UnitInterval = NONE
    glare: UnitInterval = NONE
    blur_px: Annotated[Scalar, Bounds(0, 20)] = NONE
    chromatic_aberration_px: Scalar = NONE
    natural_vignetting: bool = False
    fisheye_pupil: float = Field(0.0, ge=0, le=1)
    vignetting: UnitInterval = NONE
    metered_mean: float | None = Field(None, gt=0, lt=1)
    metered_clip: float = Field(1.0, gt=0, le=1)
    low_key: float = Field(0.0, ge=0, le=1)
    exposure_compensation_ev: Annotated[Scalar, Bounds(-10, 10)] = NONE
    exposure_error_ev: Annotated[Scalar, Bounds(-8, 8)] = NONE
    exposure_control: ExposureControl = ExposureControl()
    image_sensor: ImageSensor | None = None
    color_matrix: tuple[Row, Row, Row] | None = None
    white_balance: UnitInterval = NONE
    white_balance_norm: float = Field(1.0, ge=1, le=50)
    white_balance_tint_ev: float | None = Field(None, ge=0, le=8)
    warmth_ev: Annotated[Scalar, Bounds(-3, 3)] = NONE
    demosaic: isp.Demosaic = "edge_aware"
    denoise: float = Field(0.0, ge=0, le=4)
    saturation: NonNegative = Constant(1.0)
    contrast: Annotated[Scalar, Bounds(0.25, 4)] = Constant(1.0)
    tone: Tone | Literal["local"] = "filmic"
    sharpening: NonNegative = NONE
    sharpening_px: float = Field(1.0, gt=0, le=10)
    jpeg_quality: Annotated[Scalar, Bounds(1, 100)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _with_preset(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            return given
        preset = given.get("preset", "ideal")
        below = _preset(preset) if isinstance(preset, str) else {}
        return _lists_to_tuples(_merge_presets(below, given))

    @model_validator(mode="after")
    def _keeps_grey(self) -> "ImagePipeline":
        for row in self.color_matrix or ():
            if abs(sum(row) - 1.0) > 1e-6:
                raise ValueError(f"color_matrix: a row sums to {sum(row):g}; expected 1, to keep"
                                 " grey pixels grey")  # fmt: skip
        return self

    @property
    def headroom(self) -> float:
        """Largest value of the sensor, where 1 saturates a single exposure."""
        sensor = self.image_sensor
        return 1.0 if sensor is None else sensor.exposure_ratio ** (sensor.exposures - 1)


@dataclass(frozen=True, eq=False, slots=True)
class Shot:
    """Inputs that all stages of a photograph share.

    Attributes:
        pipeline: The camera's configuration.
        camera: Pose and lens.
        radiance: As rendered, float32 [h, w, 3].
        weather: Source of drops on the lens.
        depth_m: [h, w], along the optical axis for pinholes, else along the ray; inf = nothing.
            None if no stage needs it.
        ev100: Exposure value that was set or metered, without compensation and errors.
        exposure: Exposure of the shot, with both.
        rng: Draws parameters, which are the same at all steps of a sequence.
        noise_rng: Draws the noise of the sensor.
    """

    pipeline: ImagePipeline
    camera: Camera
    radiance: Float32
    weather: Weather
    depth_m: NDArray[np.floating] | None
    ev100: float
    exposure: ExposureSettings
    rng: streams.Rng
    noise_rng: streams.Rng


@dataclass(frozen=True, eq=False, slots=True)
class Light:
    """A linear image between two stages.

    Attributes:
        values: Linear RGB, float32 [h, w, 3]; not to be written to.
        white: The value that saturates the sensor.
    """

    values: Float32
    white: float


@dataclass(frozen=True, eq=False, slots=True)
class Photograph:
    """An image as a camera outputs it.

    Attributes:
        rgb: sRGB, uint8 [h, w, 3].
        ev100: Exposure value that was set or metered, without compensation and errors.
        signal: Before noise; None unless asked for.
    """

    rgb: NDArray[np.uint8]
    ev100: float
    signal: capture.ExpectedSignal | None = None


def capture_photograph(
    scene: Scene,
    renderer: interfaces.Renderer,
    camera: Camera,
    channels: frozenset[capture.Channel],
    pipeline: ImagePipeline,
    rng: streams.Rng,
    settings_rng: streams.Rng | None = None,
) -> capture.SensorReading:
    """Render the channels of a camera and, if RGB is among them, develop its photograph.

    ``rng`` and ``settings_rng`` are as for ``take_shot``.
    """
    developed = frozenset({capture.Channel.RGB, capture.Channel.SIGNAL})
    if capture.Channel.RGB not in channels:
        return renderer.render(scene, camera, channels - developed)
    needed = (channels - developed) | {capture.Channel.RADIANCE}
    # Points at the side of a wide lens have no depth along its axis: it is focused by range.
    depth = capture.Channel.Z_DEPTH if camera.intrinsics.straight else capture.Channel.RANGE
    if pipeline.focus is not None:
        needed = needed | {depth}
    tones = (_tones_of(camera, pipeline),) if pipeline.reduction > 1.0 else ()
    reading = renderer.render(scene, camera, needed, *tones)
    radiance = reading.channels[capture.Channel.RADIANCE]
    depth_m = reading.channels.get(depth)
    shot = take_shot(radiance, depth_m, camera, scene.weather, pipeline, rng, settings_rng)
    photo = develop(shot, with_signal=capture.Channel.SIGNAL in channels)
    images = {k: image for k, image in reading.channels.items() if k in channels}
    images[capture.Channel.RGB] = photo.rgb
    return replace(reading, channels=images, ev100=photo.ev100, signal=photo.signal)


def _tones_of(camera: Camera, pipeline: ImagePipeline) -> interfaces.FindTones:
    """Range of the photosites that each pixel is the mean of."""

    def find(radiance: Float32) -> interfaces.Tones:
        white = saturation_cd_m2(_set_or_metered(radiance, camera, pipeline))
        return interfaces.Tones(white, pipeline.headroom * white)

    return find


def take_shot(
    radiance: Float32,
    depth_m: NDArray[np.floating] | None,
    camera: Camera,
    weather: Weather,
    pipeline: ImagePipeline,
    rng: streams.Rng,
    settings_rng: streams.Rng | None = None,
) -> Shot:
    """Set or meter the exposure of a photograph.

    Arguments are as in ``Shot``; the depth is needed only by a pipeline with a focus. ``rng`` draws
    the noise, and the settings too unless another camera's stream is given for them.
    """
    noise_rng, rng = rng, (settings_rng or rng).of_sequence()
    ev100 = _set_or_metered(radiance, camera, pipeline)
    wanted = ev100 - _draw(pipeline, "exposure_compensation_ev", rng)
    wanted -= _draw(pipeline, "exposure_error_ev", rng)
    exposure = ExposureSettings(0.0, 1.0, wanted)
    if pipeline.image_sensor is not None:
        exposure = exposure_settings(wanted, pipeline.exposure_control)
    return Shot(pipeline, camera, radiance, weather, depth_m, ev100, exposure, rng, noise_rng)


def develop(shot: Shot, *, with_signal: bool = False) -> Photograph:
    """Apply all of ``STAGES`` and the tone; ``with_signal`` adds the signal, and changes no byte.

    Raises:
        SampleError: a stage makes NaN or infinite values.
    """
    pipeline, exposure = shot.pipeline, shot.exposure
    light, signal = Light(shot.radiance, saturation_cd_m2(exposure.ev100)), None
    for stage in STAGES:
        if with_signal and stage is _image_sensor and pipeline.image_sensor is not None:
            signal = _expected_signal(light, pipeline.image_sensor, shot)
        light = stage(light, shot)
    if not np.isfinite(light.values).all():
        # The tone curve makes a bound of it.
        raise errors.SampleError(
            f"{shot.camera.name}.image_pipeline: a stage makes NaN or infinite values of finite "
            f"radiance (exposure value {exposure.ev100:g}, gain {exposure.gain:g})"
        )
    rgb = _compress(_tone(light, shot), shot)
    if with_signal and signal is None:
        # Rounding to bytes is all the noise of an ideal camera.
        quantised = np.full(rgb.shape, 1.0 / (255.0 * math.sqrt(12.0)), np.float32)
        signal = capture.ExpectedSignal(rgb.astype(np.float32) / np.float32(255.0), quantised)
    return Photograph(rgb, shot.ev100, signal)


def _set_or_metered(radiance: Float32, camera: Camera, pipeline: ImagePipeline) -> float:
    return _metered(radiance, pipeline) if camera.ev100 is None else camera.ev100


def _metered(radiance: Float32, pipeline: ImagePipeline) -> float:
    """The exposure value by the pipeline's meter, within the limits of a camera with a sensor."""
    low, high = EV100_RANGE
    if pipeline.image_sensor is not None:
        low, high = reachable_ev100(pipeline.exposure_control)
    if pipeline.low_key == 0.0:
        return _meter(radiance, pipeline, (low, high))
    # A scene darker than the camera's limit is not darkened further.
    ev100 = _meter(radiance, pipeline, (min(low, EV100_DARKEST), high))
    return min(max(ev100 + pipeline.low_key * dimming_ev(ev100), low), high)


def _meter(radiance: Float32, pipeline: ImagePipeline, limits_ev100: tuple[float, float]) -> float:
    if pipeline.metered_mean is None:
        return meter_ev100(radiance, limits_ev100)
    return meter_mean_ev100(radiance, pipeline.metered_mean, pipeline.metered_clip, limits_ev100)


def _draw(pipeline: ImagePipeline, field: str, rng: streams.Rng) -> float:
    """Draw a setting. Raises SampleError if it is not a finite number, as of a faulty plug-in."""
    drawn: float = getattr(pipeline, field).draw(rng)
    if not math.isfinite(drawn):
        raise errors.SampleError(f"image_pipeline.{field}: drew {drawn}; expected a finite number")
    return drawn


def _lens_drops(light: Light, shot: Shot) -> Light:
    drops = lens_drops(shot.weather, shot.camera)
    return replace(light, values=refract_in_drops(light.values, drops)) if len(drops) else light


def _defocus(light: Light, shot: Shot) -> Light:
    focus = shot.pipeline.focus
    if focus is None:
        return light
    assert shot.depth_m is not None, "a camera with a focus renders depth"
    pitch_m = focus.pixel_um * 1e-6 * shot.pipeline.reduction
    focal_m = shot.camera.intrinsics.fx_px * pitch_m
    at_m = focus.distance_m
    focus_m = _centre_m(shot.depth_m) if at_m is None else at_m.draw(shot.rng)
    radius_px = optics.blur_radius_px(
        shot.depth_m, max(focus_m, 2.0 * focal_m), focal_m,
        shot.pipeline.exposure_control.f_number, pitch_m,
    )  # fmt: skip
    return replace(light, values=optics.defocus(light.values, radius_px))


def _shake(light: Light, shot: Shot) -> Light:
    length_px = _draw(shot.pipeline, "shake_px", shot.rng) / shot.pipeline.reduction
    if length_px <= 0.0:
        return light
    turn = math.pi * float(shot.rng.uniform())
    return replace(light, values=optics.smear(light.values, length_px, turn))


def _flare(light: Light, shot: Shot) -> Light:
    share = _draw(shot.pipeline, "flare", shot.rng)
    if share <= 0.0:
        return light
    return replace(light, values=add_flare(light.values, share, light.white))


def _vignetting(light: Light, shot: Shot) -> Light:
    loss = _draw(shot.pipeline, "vignetting", shot.rng)
    values = optics.apply_vignetting(light.values, loss) if loss > 0.0 else light.values
    if shot.pipeline.natural_vignetting:
        falloff = optics.natural_falloff(shot.camera.intrinsics, shot.pipeline.fisheye_pupil)
        values = optics.scale_pixels(values, falloff)
    return replace(light, values=values)


def _image_circle(light: Light, shot: Shot) -> Light:
    """Black out pixels outside the lens's field, into which earlier stages spread light."""
    lens = shot.camera.intrinsics
    if lens.straight or light.values is shot.radiance:
        return light
    inside = np.isfinite(lens.pixel_rays()[..., 2:])
    return replace(light, values=np.where(inside, light.values, np.float32(0.0)))


def _image_sensor(light: Light, shot: Shot) -> Light:
    """Linear sRGB with white 1, from the sensor's values: white balance, then demosaicing."""
    pipeline, sensor = shot.pipeline, shot.pipeline.image_sensor
    if sensor is None:
        return _white_balance(light, shot)
    camera_from_srgb, srgb_from_camera = _color_matrices(pipeline)
    image = isp.transform_colors(light.values, camera_from_srgb / light.white)
    gains = np.ones(3, np.float32)
    share = _draw(pipeline, "white_balance", shot.rng)
    warmth_ev = _draw(pipeline, "warmth_ev", shot.rng)
    if sensor.pattern != "mono":
        gains = isp.white_balance_gains(_illuminant(image, pipeline), share, warmth_ev)
        # No gain is below 1, and the result is clipped: fully saturated pixels stay white.
        gains = gains / gains.min()
    image = _read_sensor(np.maximum(image, 0.0), gains, sensor, shot)
    return Light(isp.transform_colors(image, srgb_from_camera), 1.0)


def _expected_signal(light: Light, sensor: ImageSensor, shot: Shot) -> capture.ExpectedSignal:
    """Of the photosites, before white balance and demosaicing."""
    camera_from_srgb, _ = _color_matrices(shot.pipeline)
    image = np.maximum(isp.transform_colors(light.values, camera_from_srgb / light.white), 0.0)
    settings = shot.exposure.gain, shot.exposure.time_s, sensor
    count = shot.pipeline.reduction**2
    if count > 1.0 and sensor.pattern != "mono":
        shares = filter_shares(sensor.pattern)
        planes = [(image[..., k], share * count) for k, share in enumerate(shares)]
    else:
        planes = [(mosaic(image, sensor.pattern), count)]
    expected = [expected_exposure(plane, *settings, photosites) for plane, photosites in planes]
    mean, stddev = (np.stack(images, axis=-1) for images in zip(*expected, strict=True))
    return capture.ExpectedSignal(mean, stddev)


def _read_sensor(image: Float32, gains: Float32, sensor: ImageSensor, shot: Shot) -> Float32:
    """White-balanced colours [h, w, 3], at most the headroom, from light on photosites."""
    pipeline, exposure = shot.pipeline, shot.exposure
    settings = exposure.gain, exposure.time_s, sensor, shot.noise_rng
    count = pipeline.reduction**2
    if count > 1.0 and sensor.pattern != "mono":
        colors = optics.scale_channels(expose_colors(image, *settings, count), gains)
        return np.asarray(np.minimum(colors, np.float32(pipeline.headroom)), np.float32)
    raw = expose(mosaic(image, sensor.pattern), *settings, count)
    raw = scale_filters(raw, sensor.pattern, gains)
    return isp.demosaic(raw, sensor.pattern, pipeline.demosaic, pipeline.headroom)


def _denoise(light: Light, shot: Shot) -> Light:
    pipeline, sensor = shot.pipeline, shot.pipeline.image_sensor
    if sensor is None or pipeline.denoise == 0.0:
        return light
    count = pipeline.reduction**2
    white_e = sensor.full_well_e * count / shot.exposure.gain
    if not is_noisy(white_e):
        return light
    read_noise_e = 0.5 * sum(sensor.read_noise_e.support()) * pipeline.reduction
    values = denoise(light.values, white_e, read_noise_e, pipeline.denoise)
    return replace(light, values=values)


def _white_balance(light: Light, shot: Shot) -> Light:
    pipeline = shot.pipeline
    share = _draw(pipeline, "white_balance", shot.rng)
    warmth_ev = _draw(pipeline, "warmth_ev", shot.rng)
    if share == 0.0 and warmth_ev == 0.0:
        return light
    camera_from_srgb, srgb_from_camera = _color_matrices(pipeline)
    image = isp.transform_colors(light.values, camera_from_srgb / light.white)
    gains = isp.white_balance_gains(_illuminant(image, pipeline), share, warmth_ev)
    return Light(isp.transform_colors(image, srgb_from_camera * gains), 1.0)


def _illuminant(image: Float32, pipeline: ImagePipeline) -> se3.Array:
    """Estimated colour of the light in a linear image, [3], both in the camera's colours."""
    estimate = isp.estimate_illuminant(image, pipeline.white_balance_norm)
    if pipeline.white_balance_tint_ev is None:
        return estimate
    camera_from_srgb, srgb_from_camera = _color_matrices(pipeline)
    # By rows, because a matrix product may round differently on other processors.
    lamp = isp.move_to_lamps(
        (srgb_from_camera * estimate).sum(axis=1), pipeline.white_balance_tint_ev
    )
    return np.asarray(np.maximum((camera_from_srgb * lamp).sum(axis=1), 1e-3))


Stage = Callable[[Light, Shot], Light]


def _effect(field: str, neutral: float, apply: Callable[[Float32, float], Float32]) -> Stage:
    """A stage that applies a strength, drawn from a field of the pipeline, unless it is neutral."""
    is_length = field.endswith("_px")

    def stage(light: Light, shot: Shot) -> Light:
        drawn = _draw(shot.pipeline, field, shot.rng)
        drawn = drawn / shot.pipeline.reduction if is_length else drawn
        return light if drawn == neutral else replace(light, values=apply(light.values, drawn))

    stage.__name__ = f"_{field.removesuffix('_px')}"
    return stage


STAGES: tuple[Stage, ...] = (
    _lens_drops,
    _defocus,
    _shake,
    _flare,
    _effect("glare", 0.0, add_glare),
    _effect("blur_px", 0.0, optics.apply_blur),
    _effect("chromatic_aberration_px", 0.0, optics.apply_chromatic_aberration),
    _vignetting,
    _image_circle,
    _image_sensor,
    _denoise,
    _effect("saturation", 1.0, isp.scale_saturation),
)
"""From radiance to linear sRGB, in the order of a real camera; tone and JPEG follow."""


def _tone(light: Light, shot: Shot) -> NDArray[np.uint8]:
    pipeline, scale = shot.pipeline, 1.0 / light.white
    # On a grid, to use tables of bytes again.
    contrast = round(_draw(shot.pipeline, "contrast", shot.rng) * CONTRASTS) / CONTRASTS
    amount = _draw(shot.pipeline, "sharpening", shot.rng)
    radius_px = pipeline.sharpening_px / pipeline.reduction
    is_sharpened = amount > 0.0 and radius_px >= _LEAST_SHARPENED_PX
    if pipeline.tone == "local":
        display = local_tone.fuse_exposures(light.values, scale, pipeline.headroom, contrast)
    elif is_sharpened:
        display = tone_to_display(light.values, scale, pipeline.tone, pipeline.headroom, contrast)
    else:
        return tone_to_bytes(light.values, scale, pipeline.tone, pipeline.headroom, contrast)
    if is_sharpened:
        return isp.sharpen_to_bytes(display, amount, radius_px)
    return isp.to_bytes(display)


def _compress(image: NDArray[np.uint8], shot: Shot) -> NDArray[np.uint8]:
    quality = shot.pipeline.jpeg_quality
    return image if quality is None else isp.compress_jpeg(image, round(quality.draw(shot.rng)))


def _color_matrices(pipeline: ImagePipeline) -> tuple[se3.Array, se3.Array]:
    """Matrices from linear sRGB to camera colours and back, [3, 3] each."""
    back = np.eye(3) if pipeline.color_matrix is None else np.array(pipeline.color_matrix)
    return np.linalg.inv(back), back


def _centre_m(depth_m: NDArray[np.floating]) -> float:
    """Median depth of the middle ninth of an image; 1 km if it is empty."""
    height, width = depth_m.shape
    middle = depth_m[height // 3 : height - height // 3, width // 3 : width - width // 3]
    there = middle[np.isfinite(middle)]
    return float(np.median(there)) if len(there) else 1000.0


@cache
def _preset(name: str) -> dict[str, Any]:
    """The values of a preset, as plain data; ValueError if there is no such preset."""
    plain = yaml_tree.load_yaml(preset_path(PRESETS, check_preset(PRESETS, name))).plain()
    assert isinstance(plain, dict)
    return plain


def _merge_presets(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Merge values over a preset's values; sub-models are merged key by key."""
    merged = dict(below)
    for key, value in above.items():
        under = merged.get(key)
        both = isinstance(value, Mapping) and isinstance(under, Mapping)
        inner = both and key in ("focus", "exposure_control", "image_sensor")
        merged[key] = _merge_presets(under, value) if inner else value  # type: ignore[arg-type]
    return merged


def _lists_to_tuples(value: Any) -> Any:
    """Replace lists, as YAML has them, by tuples, as strict validation requires them."""
    if isinstance(value, Mapping):
        return {key: _lists_to_tuples(item) for key, item in value.items()}
    return tuple(map(_lists_to_tuples, value)) if isinstance(value, list) else value
