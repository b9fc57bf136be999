"""Exposure: metering, exposure time and gain that achieve an exposure value, rolling shutter."""

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.config.base_model import Strict
from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import MIDDLE_GREY, luminance
from gen_data.core.se3 import Array
from gen_data.core.shutter import Shutter

EV100_RANGE = (1.0, 17.0)
"""Limits of a camera that states none: from 1/30 s at f/1.4 and ISO 3200 to sunlit snow.

Automatic exposure stops there, which keeps night scenes dark."""
EV100_DARKEST = -6.0
"""Landscape under a clear sky without the moon: the darkest value that a meter distinguishes."""
_METERED_EVERY = 4
_DIM_EV100 = 5.0
"""Of a home by lamplight."""
_EV100_STEPS = 256.0
"""Steps per exposure value: on a grid, as the last bit of a sum differs between processors."""


class ExposureControl(Strict):
    """Limits of exposure control: the time is lengthened first, then the gain raised.

    Attributes:
        f_number: F-number of the aperture.
        time_s: Shortest and longest exposure time.
        iso: Base and highest ISO speed.
    """

    f_number: float = Field(2.0, ge=0.7, le=64)
    time_s: tuple[float, float] = (1e-5, 1.0 / 30.0)
    iso: tuple[float, float] = (100.0, 3200.0)

    @model_validator(mode="after")
    def _ranges_rise(self) -> "ExposureControl":
        for name, (low, high) in (("time_s", self.time_s), ("iso", self.iso)):
            if not 0.0 < low <= high:
                raise ValueError(f"{name} must rise from above 0, got [{low:g}, {high:g}]")
        return self


@dataclass(frozen=True, slots=True)
class ExposureSettings:
    """Exposure of a photograph.

    Attributes:
        time_s: Exposure time.
        gain: ISO over base ISO.
        ev100: Resulting exposure value at ISO 100.
    """

    time_s: float
    gain: float
    ev100: float


def saturation_cd_m2(ev100: float) -> float:
    """The luminance that saturates the sensor [cd/m^2].

    Saturation-based speed: L_max = 1.2 * 2^EV100 (ISO 12232; Lagarde and de Rousiers 2014).
    """
    return float(1.2 * 2.0**ev100)


def reachable_ev100(control: ExposureControl) -> tuple[float, float]:
    """The lowest and the highest exposure value within the limits of a camera."""
    low, high = (exposure_settings(ev100, control).ev100 for ev100 in (-100.0, 100.0))
    return low, high


def meter_ev100(radiance: Float32, limits_ev100: tuple[float, float] = EV100_RANGE) -> float:
    """The exposure value that puts the centre-weighted log-average luminance at middle grey.

    Source: Reinhard et al., "Photographic tone reproduction for digital images", 2002. Radiance is
    linear RGB [cd/m^2], shape [h, w, 3].
    """
    sparse = radiance[::_METERED_EVERY, ::_METERED_EVERY].astype(np.float64)
    levels = luminance(sparse)
    weights = _centre_weights(*levels.shape)
    brightest = float(levels.max(initial=0.0))
    if brightest <= 0.0:
        return limits_ev100[0]
    # Black pixels (a missing background) are left out. "Black" is relative to a quantile, as the
    # maximum would depend on lamps in the image.
    bright = float(np.quantile(levels[levels > 0.0], 0.95))
    counted = levels > 1e-4 * bright
    logs = np.log2(levels[counted])
    average = float((logs * weights[counted]).sum() / weights[counted].sum())
    ev100 = average - math.log2(1.2 * MIDDLE_GREY)
    ev100 = min(max(ev100, limits_ev100[0]), limits_ev100[1])
    return round(ev100 * _EV100_STEPS) / _EV100_STEPS


def meter_mean_ev100(
    radiance: Float32,
    mean: float,
    clipped: float = 1.0,
    limits_ev100: tuple[float, float] = EV100_RANGE,
) -> float:
    """The lowest exposure value at which the image's mean does not exceed this one.

    Saturated pixels count as 1.

    Automatic exposure of machine vision cameras: "to achieve a specific average image intensity"
    of the whole image (Point Grey, Flea3 FL3-U3 Technical Reference, section 7.10). Bright surfaces
    lower the exposure until they saturate, dark ones have little weight; a log-average does the
    opposite.

    Args:
        radiance: Linear RGB [cd/m^2], shape [h, w, 3].
        mean: Share of saturation, above 0 and below 1.
        clipped: Largest share of the image that may saturate, above 0.
        limits_ev100: The lowest and the highest exposure value.
    """
    levels = np.sort(luminance(radiance[::_METERED_EVERY, ::_METERED_EVERY]).ravel())
    below = np.concatenate([[0.0], np.cumsum(levels, dtype=np.float64)])

    def is_dark_enough(step: int) -> bool:
        white = saturation_cd_m2(step / _EV100_STEPS)
        lit = int(np.searchsorted(levels, white))
        over = len(levels) - lit
        return over <= clipped * len(levels) and float(below[lit]) / white + over <= mean * len(
            levels
        )

    steps = range(*(round(ev100 * _EV100_STEPS) for ev100 in limits_ev100))
    return (steps.start + bisect_left(steps, True, key=is_dark_enough)) / _EV100_STEPS


def dimming_ev(ev100: float) -> float:
    """Stops by which a dim scene should look darker than one by day; 0 from ``_DIM_EV100`` on.

    The key, the brightness at which a picture shows a scene, is ``1.03 - 2 / (2 + log10(L + 1))``
    of the scene's luminance L [cd/m^2] (Krawczyk, Myszkowski and Seidel, "Perceptual effects in
    real-time tone mapping", SCCG 2005, compared with other implementations); it counts relative to
    a home by lamplight.
    """
    dim, here = (_key(MIDDLE_GREY * saturation_cd_m2(ev)) for ev in (_DIM_EV100, ev100))
    return max(0.0, round(math.log2(dim / here) * _EV100_STEPS) / _EV100_STEPS)


def _key(luminance_cd_m2: float) -> float:
    return 1.03 - 2.0 / (2.0 + math.log10(luminance_cd_m2 + 1.0))


def exposure_settings(ev100: float, control: ExposureControl) -> ExposureSettings:
    """The exposure nearest to an exposure value within the limits: time first, then gain.

    ``2^EV100 = N^2 / t * 100 / ISO`` (ISO 12232).
    """
    base, highest = control.iso
    wanted_s = control.f_number**2 / 2.0**ev100 * 100.0 / base
    time_s = min(max(wanted_s, control.time_s[0]), control.time_s[1])
    gain = min(max(wanted_s / time_s, 1.0), highest / base)
    reached = math.log2(control.f_number**2 / time_s * 100.0 / (base * gain))
    return ExposureSettings(time_s, gain, reached)


def _centre_weights(height: int, width: int) -> Array:
    y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
    x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    return 1.0 - 0.5 * np.clip(x[None] ** 2 + y[:, None] ** 2, 0.0, 1.0)


class ExposureTime(Strict):
    """Exposure time, which blurs moving objects.

    Brightness does not depend on it, but on ``ev100`` or the camera's meter.

    Attributes:
        time_s: Exposure time.
        samples: Largest number of instants averaged into an image; fewer are rendered where
            nothing moves by 0.3 px per sample, and one where nothing moves.
    """

    time_s: float = Field(gt=0, le=10)
    samples: int = Field(8, ge=1, le=256)


class RollingShutter(Strict):
    """Rows exposed one after the other, which skews moving objects.

    Attributes:
        readout_s: Time from the exposure of the first row to one row after the last.
        direction: Direction of the readout; ``down`` begins with the topmost row.
    """

    readout_s: float = Field(gt=0, le=10)
    direction: Literal["down", "up"] = "down"


def make_shutter(exposure: ExposureTime | None, rolling: RollingShutter | None) -> Shutter:
    """The shutter of a camera with these settings."""
    readout_s = 0.0 if rolling is None else rolling.readout_s
    if rolling is not None and rolling.direction == "up":
        readout_s = -readout_s
    if exposure is None:
        return Shutter(readout_s=readout_s)
    return Shutter(exposure.time_s, readout_s, exposure.samples)
