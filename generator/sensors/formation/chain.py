"""The whole way from luminance to a photograph, and what varies on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from generator.config.distributions import (
    Bounds,
    Constant,
    NonNegative,
    Positive,
    Scalar,
    UnitInterval,
)
from generator.config.strict import Strict
from generator.core.geometry import Float32
from generator.core.intrinsics import Intrinsics
from generator.core.streams import Rng
from generator.sensors.cameras import camera_preset
from generator.sensors.formation import development, optics
from generator.sensors.formation.photosites import Photosites, exposed, filter_at, mosaic

NONE = Constant(0.0)
Row = tuple[float, float, float]


class Shutter(Strict):
    """How an exposure is reached: long first, then with gain.

    Attributes:
        f_number: Of the aperture.
        time_s: Shortest and longest exposure.
        iso: Base and highest speed.
    """

    f_number: float = Field(2.0, ge=0.7, le=64)
    time_s: tuple[float, float] = (1e-5, 1.0 / 30.0)
    iso: tuple[float, float] = (100.0, 3200.0)

    @model_validator(mode="after")
    def _ranges_rise(self) -> Shutter:
        for name, (low, high) in (("time_s", self.time_s), ("iso", self.iso)):
            if not 0.0 < low <= high:
                raise ValueError(f"{name} must rise from above 0, got [{low:g}, {high:g}]")
        return self


class Focus(Strict):
    """A lens that is sharp at one distance only.

    Attributes:
        distance_m: Where it is sharp; null = at what the middle of the image shows.
        pixel_um: Size of a photosite: with the focal length in pixels it gives that of the lens.
    """

    distance_m: Positive | None = None
    pixel_um: float = Field(3.0, gt=0, le=100)


class Formation(Strict):
    """How a photograph comes about; a stage that is left out does nothing.

    Attributes:
        preset: A camera of ``generator/sensors/cameras``, whose values hold where none is given.
        focus: Depth of field.
        flare: Share of what is far beyond white that returns as ghosts.
        bloom: Share of the light that is scattered around bright spots.
        chromatic_aberration_px: Between red and blue images and the green one, at the corners.
        natural_vignetting: Whether light falls off with the angle to the axis: with the fourth
            power of its cosine, and as ``fisheye_pupil`` says before a fisheye.
        fisheye_pupil: Power of the cosine by which a fisheye's pupil is foreshortened: 0 turns to
            the light, 1 is flat.
        vignetting: Share of the light that the barrel takes at the corners.
        shutter: Aperture, times and gains.
        exposure_error_ev: What metering gets wrong; positive is brighter.
        photosites: The sensor; null = an ideal one.
        color_matrix: Rows of linear sRGB from white-balanced raw colours; rows sum to 1.
        white_balance: Share of the light's colour that is taken out, by the grey-world assumption.
        warmth_ev: Error of the white balance: red over blue, in stops.
        demosaic: Method.
        saturation: Factor on colour.
        tone: Curve; ``log`` is for sensors of several exposures.
        sharpening: Amount of unsharp masking.
        sharpening_px: Its radius.
        jpeg_quality: Of compression, 1 to 100; null = none.
    """

    preset: str = ""
    focus: Focus | None = None
    flare: UnitInterval = NONE
    bloom: UnitInterval = NONE
    chromatic_aberration_px: Scalar = NONE
    natural_vignetting: bool = False
    fisheye_pupil: float = Field(0.0, ge=0, le=1)
    vignetting: UnitInterval = NONE
    shutter: Shutter = Shutter()
    exposure_error_ev: Annotated[Scalar, Bounds(-8, 8)] = NONE
    photosites: Photosites | None = None
    color_matrix: tuple[Row, Row, Row] | None = None
    white_balance: UnitInterval = NONE
    warmth_ev: Annotated[Scalar, Bounds(-3, 3)] = NONE
    demosaic: development.Demosaic = "edge_aware"
    saturation: NonNegative = Constant(1.0)
    tone: development.Tone = "filmic"
    sharpening: NonNegative = NONE
    sharpening_px: float = Field(1.0, gt=0, le=10)
    jpeg_quality: Annotated[Scalar, Bounds(1, 100)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _with_preset(cls, given: Any) -> Any:
        """The preset's values below those that are given."""
        if not isinstance(given, Mapping):
            return given
        preset = given.get("preset")
        below = camera_preset(preset) if isinstance(preset, str) and preset else {}
        return _with_tuples(_merged(below, given))

    @model_validator(mode="after")
    def _keeps_grey(self) -> Formation:
        for row in self.color_matrix or ():
            if abs(sum(row) - 1.0) > 1e-6:
                raise ValueError(f"color_matrix: a row sums to {sum(row):g}; expected 1, so that"
                                 " grey stays grey")  # fmt: skip
        return self


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Values of both, the upper ones first; mappings that name models are merged within."""
    merged = dict(below)
    for key, value in above.items():
        under = merged.get(key)
        both = isinstance(value, Mapping) and isinstance(under, Mapping)
        inner = both and key in ("focus", "shutter", "photosites")
        merged[key] = _merged(under, value) if inner else value  # type: ignore[arg-type]
    return merged


def _with_tuples(value: Any) -> Any:
    """YAML knows only lists; what passes through Python must say what it means."""
    if isinstance(value, Mapping):
        return {key: _with_tuples(item) for key, item in value.items()}
    return tuple(map(_with_tuples, value)) if isinstance(value, list) else value


@dataclass(frozen=True, slots=True)
class Exposed:
    """How a picture was exposed.

    Attributes:
        time_s: How long.
        gain: ISO over base ISO.
        ev100: Luminance ``1.2 * 2^ev100`` is white.
    """

    time_s: float
    gain: float
    ev100: float


def exposure_for(ev100: float, shutter: Shutter) -> Exposed:
    """The exposure nearest to a metered value: time first, then gain, within what there is.

    ``2^EV100 = N^2 / t * 100 / ISO`` (ISO 12232).
    """
    base, highest = shutter.iso
    wanted_s = shutter.f_number**2 / 2.0**ev100 * 100.0 / base
    time_s = min(max(wanted_s, shutter.time_s[0]), shutter.time_s[1])
    gain = min(max(wanted_s / time_s, 1.0), highest / base)
    reached = math.log2(shutter.f_number**2 / time_s * 100.0 / (base * gain))
    return Exposed(time_s, gain, reached)


def photograph(
    luminance: Float32,
    z_m: NDArray[np.floating],
    camera: Intrinsics,
    metered_ev100: float,
    formation: Formation,
    rng: Rng,
) -> NDArray[np.uint8]:
    """The photograph of a scene, sRGB uint8 [h, w, 3].

    Args:
        luminance: Linear Rec. 709 colours [cd/m^2], float32 [h, w, 3].
        z_m: Along the optical axis or, before a lens that is no pinhole, along the ray [m], [h, w];
            inf = nothing. Read only for depth of field.
        camera: What its lens does to angles.
        metered_ev100: What the camera's meter says.
        formation: The camera.
        rng: Draws what varies, and noise.
    """
    metered = metered_ev100 - formation.exposure_error_ev.draw(rng)
    exposure = exposure_for(metered, formation.shutter)
    white = 1.2 * 2.0**exposure.ev100
    image = _through_lens(luminance, z_m, camera, white, formation, rng)
    image = image * np.float32(1.0 / white)
    camera_from_srgb, srgb_from_camera = _color_matrices(formation)
    image = image @ camera_from_srgb.T
    reach = 1.0
    if formation.photosites is not None:
        sites = formation.photosites
        reach = sites.exposure_ratio ** (sites.exposures - 1)
        image = _read_out(image, exposure, formation, reach, rng)
    else:
        image = image * _balance(image, formation, rng)
    return _developed(image @ srgb_from_camera.T, reach, formation, rng)


def _through_lens(
    image: Float32,
    z_m: NDArray[np.floating],
    camera: Intrinsics,
    white: float,
    formation: Formation,
    rng: Rng,
) -> Float32:
    if formation.focus is not None:
        focus = formation.focus
        focal_m = camera.fx_px * focus.pixel_um * 1e-6
        at_m = _centre_m(z_m) if focus.distance_m is None else focus.distance_m.draw(rng)
        radius = optics.blur_radius_px(
            z_m, max(at_m, 2.0 * focal_m), focal_m, formation.shutter.f_number,
            focus.pixel_um * 1e-6,
        )  # fmt: skip
        image = optics.defocused(image, radius)
    flare, bloom = formation.flare.draw(rng), formation.bloom.draw(rng)
    aberration_px = formation.chromatic_aberration_px.draw(rng)
    loss = formation.vignetting.draw(rng)
    if flare > 0.0:
        image = optics.flared(image, flare, white)
    if bloom > 0.0:
        image = optics.bloomed(image, bloom)
    if aberration_px != 0.0:
        image = optics.with_chromatic_aberration(image, aberration_px)
    if loss > 0.0:
        image = optics.vignetted(image, loss)
    if formation.natural_vignetting:
        image = image * optics.natural_falloff(camera, formation.fisheye_pupil)[..., None]
    return image


def _centre_m(z_m: NDArray[np.floating]) -> float:
    """Median depth of the middle ninth of an image; 1 km where nothing is there."""
    height, width = z_m.shape
    middle = z_m[height // 3 : height - height // 3, width // 3 : width - width // 3]
    seen = middle[np.isfinite(middle)]
    return float(np.median(seen)) if len(seen) else 1000.0


def _color_matrices(formation: Formation) -> tuple[Float32, Float32]:
    """Camera colours from linear sRGB, and back, float32 [3, 3]."""
    if formation.color_matrix is None:
        return np.eye(3, dtype=np.float32), np.eye(3, dtype=np.float32)
    back = np.array(formation.color_matrix)
    return np.linalg.inv(back).astype(np.float32), back.astype(np.float32)


def _read_out(
    image: Float32, exposure: Exposed, formation: Formation, reach: float, rng: Rng
) -> Float32:
    """White-balanced camera colours as the photosites and demosaicing give them."""
    sites = formation.photosites
    assert sites is not None
    light = np.maximum(mosaic(image, sites.pattern), 0.0)
    raw = exposed(light, exposure.gain, exposure.time_s, sites, rng)
    gains = _balance(image, formation, rng)
    if sites.pattern != "mono":
        raw = raw * gains[filter_at(sites.pattern, *raw.shape)]
    return development.demosaiced(raw, sites.pattern, formation.demosaic, 2.0 * reach)


def _balance(image: Float32, formation: Formation, rng: Rng) -> Float32:
    """Gains of the white balance, float32 [3]; green is the measure."""
    share, warmth_ev = formation.white_balance.draw(rng), formation.warmth_ev.draw(rng)
    gains = np.ones(3, np.float32)
    if share > 0.0:
        gains = development.grey_world_gains(image) ** np.float32(share)
    error = np.array([2.0 ** (0.5 * warmth_ev), 1.0, 2.0 ** (-0.5 * warmth_ev)], np.float32)
    return np.asarray(gains * error, np.float32)


def _developed(image: Float32, reach: float, formation: Formation, rng: Rng) -> NDArray[np.uint8]:
    saturation = formation.saturation.draw(rng)
    if saturation != 1.0:
        grey = (image @ np.array([0.2126, 0.7152, 0.0722], np.float32))[..., None]
        image = grey + np.float32(saturation) * (image - grey)
    shown = development.toned(image, formation.tone, reach)
    amount = formation.sharpening.draw(rng)
    if amount > 0.0:
        shown = development.sharpened(shown, amount, formation.sharpening_px)
    photo = development.to_bytes(shown)
    if formation.jpeg_quality is not None:
        photo = development.through_jpeg(photo, round(formation.jpeg_quality.draw(rng)))
    return photo
