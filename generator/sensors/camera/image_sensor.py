"""Image sensor: digital numbers from light, with photon, pixel and read noise.

The model follows EMVA standard 1288: electrons are Poisson around light times response plus dark
current times time; a gain, read noise and a converter of so many bits follow.
"""

import math
from functools import lru_cache
from typing import Annotated, Literal

import cv2
import numpy as np
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.config.distributions import NonNegative, discrete
from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import luminance
from gen_data.core.streams import Rng, Streams

Pattern = Literal["rggb", "bggr", "grbg", "gbrg", "mono"]

FILTERS = {"rggb": (0, 1, 1, 2), "bggr": (2, 1, 1, 0), "grbg": (1, 0, 2, 1), "gbrg": (1, 2, 0, 1)}
"""Channels of the filters of two by two pixels, row by row."""

_NORMAL_FROM_E = 64.0

Share = Annotated[float, Field(ge=0, le=1)]


class ImageSensor(Strict):
    """Data sheet of an image sensor.

    Attributes:
        pattern: Colour filter array, first row then second; ``mono`` = no filters.
        full_well_e: Full-well capacity at base gain [electrons].
        read_noise_e: Standard deviation of the read noise [electrons].
        dark_current_e_s: Dark current [electrons per second].
        prnu: Photo-response non-uniformity: standard deviation of the gain of pixels about 1.
        dsnu_e: Dark-signal non-uniformity: standard deviation of the offset [electrons].
        hot_pixels: Share of pixels with two hundred times the dark current.
        bits: Resolution of the analogue-digital converter.
        exposures: Number of exposures merged into one of high dynamic range.
        exposure_ratio: Ratio of each exposure to the next shorter one.
        device_seed: Seed of the fixed pattern: one per individual device.
    """

    pattern: Pattern = "rggb"
    full_well_e: float = Field(10_000.0, gt=0)
    read_noise_e: NonNegative = discrete.Constant(3.0)
    dark_current_e_s: NonNegative = discrete.Constant(5.0)
    prnu: Share = 0.005
    dsnu_e: float = Field(0.5, ge=0)
    hot_pixels: Share = 0.0
    bits: int = Field(12, ge=8, le=16)
    exposures: int = Field(1, ge=1, le=4)
    exposure_ratio: float = Field(16.0, gt=1)
    device_seed: int = 0


def mosaic(image: Float32, pattern: Pattern) -> Float32:
    """Light on pixels behind their colour filters, float32 [h, w]; ``mono`` takes luminance.

    ``image`` is the linear response of the three filters, float32 [h, w, 3].
    """
    if pattern == "mono":
        return np.asarray(luminance(image), np.float32)
    raw = np.empty_like(image[..., 0])
    for k, channel in enumerate(FILTERS[pattern]):
        raw[k // 2 :: 2, k % 2 :: 2] = image[k // 2 :: 2, k % 2 :: 2, channel]
    return raw


def scale_filters(raw: Float32, pattern: Pattern, gains: Float32) -> Float32:
    """Raw values [h, w] times the gain, of [3], of their pixels' filters; green's for ``mono``."""
    scaled = np.empty_like(raw)
    for k, channel in enumerate(FILTERS.get(pattern, (1, 1, 1, 1))):
        phase = np.s_[k // 2 :: 2, k % 2 :: 2]
        np.multiply(raw[phase], gains[channel], out=scaled[phase])
    return scaled


def expose(
    light: Float32,
    gain: float,
    time_s: float,
    sensor: ImageSensor,
    rng: Rng,
    photosites: float = 1.0,
) -> Float32:
    """Digital values of an exposure, float32 [h, w], from 0; above 1 only with several exposures.

    Args:
        light: Light on pixels; 1 saturates them at this gain; any range.
        gain: ISO over base ISO, 1 or more: the well is used up to ``full_well_e / gain``.
        time_s: Exposure time.
        sensor: Data sheet.
        rng: Draws the noise.
        photosites: Number of photosites that a pixel is the mean of.
    """
    merged = _expose_once(light, gain, time_s, sensor, rng, photosites)
    reach = 1.0
    for _ in range(1, sensor.exposures):
        reach *= sensor.exposure_ratio
        dimmed, short_s = light / reach, time_s / reach
        shorter = _expose_once(dimmed, gain, short_s, sensor, rng, photosites)
        # Nearly saturated pixels take their value from the next shorter exposure.
        merged = np.where(merged >= 0.95 * reach / sensor.exposure_ratio, shorter * reach, merged)
    return merged.astype(np.float32)


def expose_colors(
    light: Float32, gain: float, time_s: float, sensor: ImageSensor, rng: Rng, photosites: float
) -> Float32:
    """As ``expose``, of pixels that have photosites behind all filters: float32 [h, w, 3]."""
    colors = [
        expose(channel, gain, time_s, sensor, rng, share * photosites)
        for channel, share in zip(cv2.split(light), filter_shares(sensor.pattern), strict=True)
    ]
    return np.asarray(cv2.merge(colors), np.float32)


def filter_shares(pattern: Pattern) -> list[float]:
    """Share of the photosites behind the filters of red, green and blue."""
    filters = FILTERS[pattern]
    return [filters.count(k) / len(filters) for k in range(3)]


def expected_exposure(
    light: Float32, gain: float, time_s: float, sensor: ImageSensor, photosites: float = 1.0
) -> tuple[Float32, Float32]:
    """Mean and standard deviation of ``expose`` over devices and photographs, float32 [h, w] each.

    The total noise of EMVA standard 1288, release 4.0: shot noise of light and dark current, read
    noise in the middle of its range, non-uniformity of response and offset, and quantisation by
    steps with a variance of 1/12; hot pixels are left out. Saturated pixels have the mean 1.
    """
    mean, stddev = _expected_once(light, gain, time_s, sensor, photosites)
    reach = 1.0
    for _ in range(1, sensor.exposures):
        reach *= sensor.exposure_ratio
        below = 0.95 * reach / sensor.exposure_ratio
        shorter = _expected_once(light / reach, gain, time_s / reach, sensor, photosites)
        # As in ``expose``.
        bright = mean >= below
        mean = np.where(bright, shorter[0] * reach, mean)
        stddev = np.where(bright, shorter[1] * reach, stddev)
    return mean.astype(np.float32), stddev.astype(np.float32)


def _expected_once(
    light: Float32, gain: float, time_s: float, sensor: ImageSensor, photosites: float
) -> tuple[Float32, Float32]:
    well_e = np.float32(sensor.full_well_e * photosites / gain)
    mean = np.clip(light, 0.0, 1.0)
    dark_e = 0.5 * sum(sensor.dark_current_e_s.support()) * photosites * time_s
    read_noise_e = 0.5 * sum(sensor.read_noise_e.support())
    step_e = float(well_e) / (((1 << sensor.bits) - 1) * photosites)
    constant_e2 = dark_e + (read_noise_e**2 + sensor.dsnu_e**2) * photosites + step_e**2 / 12.0
    signal_e = mean * well_e
    uneven = np.float32(sensor.prnu**2 / photosites)
    variance_e2 = signal_e * signal_e * uneven + signal_e + np.float32(constant_e2)
    return mean, np.sqrt(variance_e2) / well_e


def _expose_once(
    light: Float32, gain: float, time_s: float, sensor: ImageSensor, rng: Rng, photosites: float
) -> Float32:
    """One exposure of means over photosites: their electrons and variances add up."""
    well_e = sensor.full_well_e * photosites / gain
    response, offset_e, dark = _fixed_pattern(light.shape, sensor, photosites)
    dark_e = sensor.dark_current_e_s.draw(rng) * photosites * time_s
    # Beyond eight full wells all pixels saturate: the bound keeps the draw in its range.
    mean_e = np.clip(light, 0.0, 8.0)
    mean_e *= response
    mean_e *= np.float32(well_e)
    mean_e += np.float32(dark_e) * dark
    read_noise_e = sensor.read_noise_e.draw(rng) * math.sqrt(photosites)
    level = _read_electrons(mean_e, read_noise_e, rng)
    level += offset_e - np.float32(dark_e)
    # A mean has more levels than its terms.
    steps = np.float32(((1 << sensor.bits) - 1) * photosites)
    level /= np.float32(well_e)
    level *= steps
    np.clip(np.rint(level, out=level), 0, steps, out=level)
    level /= steps
    return level


def _read_electrons(mean_e: Float32, read_noise_e: float, rng: Rng) -> Float32:
    """Poisson numbers of these means, which are used up, with normal read noise.

    From ``_NORMAL_FROM_E`` on, both are drawn as one normal number of the sum of their variances:
    the distribution functions of electrons differ by less than 0.01 (the skewness over six times
    the square root of two pi), and drawing takes a tenth of the time.
    """
    level = rng.standard_normal(mean_e.shape, dtype=np.float32)
    stddev_e = np.sqrt(mean_e + np.float32(read_noise_e * read_noise_e))
    # By number: NumPy is slow on masks.
    few = np.flatnonzero(mean_e < _NORMAL_FROM_E)
    stddev_e.reshape(-1)[few] = read_noise_e
    mean_e.reshape(-1)[few] = rng.poisson(mean_e.reshape(-1)[few])
    level *= stddev_e
    level += mean_e
    return level


@lru_cache(maxsize=8)
def _fixed_pattern(
    shape: tuple[int, int], sensor: ImageSensor, photosites: float
) -> tuple[Float32, Float32, Float32]:
    """Gain, offset [e] and relative dark current of every pixel of one device, [h, w] each."""
    rng = Streams(seed=sensor.device_seed, scene=0).rng("photosites")
    spread = math.sqrt(photosites)
    response = 1.0 + sensor.prnu / spread * rng.standard_normal(shape, dtype=np.float32)
    offset_e = sensor.dsnu_e * spread * rng.standard_normal(shape, dtype=np.float32)
    is_hot = rng.random(shape) < sensor.hot_pixels
    # Of a mean, one photosite of many is hot.
    dark = np.where(is_hot, np.float32(1.0 + 199.0 / photosites), np.float32(1.0))
    return response.astype(np.float32), offset_e.astype(np.float32), dark.astype(np.float32)
