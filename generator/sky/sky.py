"""The sky at any time of day, under any clouds, as an environment.

The sun stands in the direction of +X and is not in the image: it is a Light. Luminances are those
of the real sky: the illuminance of level ground is ``daylight.sky_illuminance_lux``.

Sources: Preetham, Shirley and Smits, "A practical analytic model for daylight", SIGGRAPH 1999
(clear sky: Perez' formula for chromaticity, and luminance as published); CIE S 011/E:2003 (measured
luminance of clear, hazy and overcast skies).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_table
from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import REC709_FROM_XYZ, REC709_LUMINANCE, luminance
from gen_data.core.noise import smoothstep
from gen_data.sky import daylight, equirectangular
from gen_data.sky.clouds import cloud_layer

Array = NDArray[np.float64]
Image = TypeVar("Image", NDArray[np.float64], NDArray[np.float32])

MODELS = ("measured", "preetham")
"""Where a sky's luminances come from."""
_ROWS = 512
_MEAN_ROWS = 64
_STRIP_ROWS = 16
# Less light than this share of the rest is not computed.
_NEGLIGIBLE = 1e-3
# CIE S 011/E:2003, types 12 (clear) and 13 (clear, polluted): a to e. The turbidity of the
# latter is assumed; the former is daylight.CLEAR_TURBIDITY.
_CLEAR, _POLLUTED = (-1.0, -0.32, 10.0, -3.0, 0.45), (-1.0, -0.32, 16.0, -3.0, 0.30)
_POLLUTED_TURBIDITY = 6.0
_TABLES = load_table(__package__, "preetham", tuple[tuple[float, ...], ...])
# A cloud deck (about 6600 K), the clear horizon (D75, assumed), a city's glow, clean night air,
# land from afar.
_DECK = np.array((0.967, 1.0, 1.097))
_HORIZON = np.array((0.927, 1.007, 1.144))
_CITY = np.array((1.22, 0.97, 0.65))
_AIRGLOW = np.array((0.62, 0.95, 2.6))
_SOIL = np.array((1.05, 1.02, 0.80))
# A lit city from above: about 5 lx (EN 13201-2, class P3) on an albedo of an eighth.
_STREETS_CD_M2 = 0.2


@dataclass(frozen=True, slots=True)
class SkyModel:
    """Parameters of a sky.

    Attributes:
        seed: Seed of the clouds.
        sun_altitude_deg: Over the horizon; negative at night.
        turbidity: 2 very clear, 3 usual, 6 hazy.
        cloudiness: 0 clear, 0.5 broken clouds, 1 overcast.
        ground_albedo: Albedo of the land below the horizon.
        model: ``measured``: the illuminance of IES RP-21, distributed by CIE S 011, under any
            clouds, day and night.
            ``preetham``: the luminances of Preetham's clear sky by day as published.
    """

    seed: int = 0
    sun_altitude_deg: float = 40.0
    turbidity: float = 2.5
    cloudiness: float = 0.0
    ground_albedo: float = 0.18
    model: str = "measured"

    @property
    def sun_altitude_rad(self) -> float:
        """Of the sun."""
        return math.radians(self.sun_altitude_deg)


def sky(
    seed: int,
    sun_altitude_deg: float,
    turbidity: float,
    cloudiness: float,
    ground_albedo: float,
    model: str = "measured",
) -> Float32:
    """Relative luminance, mean 1; float32 [512, 1024, 3].

    Raises:
        ValueError: a parameter is outside its range.
    """
    known = SkyModel(seed, sun_altitude_deg, turbidity, cloudiness, ground_albedo, model)
    return equirectangular.normalize_luminance(luminance_cd_m2(known, _ROWS))


def sun_lux(model: SkyModel) -> float:
    """Illuminance of the sun alone, on a surface that faces it [lx]."""
    if model.model == "preetham":
        return daylight.preetham_sun_lux(model.sun_altitude_rad, model.turbidity)
    return daylight.sun_illuminance_lux(model.sun_altitude_rad, model.turbidity, model.cloudiness)


def mean_luminance_cd_m2(model: SkyModel) -> float:
    """Mean over the whole sphere, the value for ``Environment.luminance_cd_m2``."""
    image = luminance_cd_m2(model, _MEAN_ROWS)
    weights = _row_weights(_MEAN_ROWS)
    rows = np.einsum("hwc,c->h", image, REC709_LUMINANCE, optimize=False) / image.shape[1]
    return float((rows * weights).sum())


def luminance_cd_m2(model: SkyModel, rows: int) -> Float32:
    """Luminance of sky and land, linear RGB [rows, 2 * rows, 3].

    Raises:
        ValueError: a parameter is outside its range.
    """
    _check(model)
    above = equirectangular.pixel_directions(rows, rows // 2)
    if model.model == "preetham":
        zenith = daylight.preetham_zenith_cd_m2(model.sun_altitude_rad, model.turbidity)
        half = preetham_sky(above[:, :rows], model.sun_altitude_rad, model.turbidity)
        return _with_land(_mirror(zenith * half), model)
    night_lux = daylight.night_illuminance_lux(model.cloudiness)
    day_lux = daylight.sky_illuminance_lux(model.sun_altitude_rad, model.cloudiness) - night_lux
    parts = []
    if day_lux > _NEGLIGIBLE * night_lux:
        parts.append(_scale_to_lux(_daylight(above, model), day_lux))
    if night_lux > _NEGLIGIBLE * day_lux:
        parts.append(_scale_to_lux(_night(above, model), night_lux))
    return _with_land(sum(parts[1:], start=parts[0]), model)


def clear_sky(d: Array, sun_altitude_rad: float, turbidity: float) -> Array:
    """Relative luminance of the clear sky by day, linear RGB, zenith 1.

    Luminances follow CIE S 011; Preetham's fit leaves the sky opposite a sun in haze half as
    bright. Colours are Preetham's, with a horizon as pale as in photographs.

    Args:
        d: Unit directions, shape [h, w, 3], each row level.
        sun_altitude_rad: Over the horizon.
        turbidity: Turbidity of the air.
    """
    angles = _SkyAngles.of(d, sun_altitude_rad)
    clear_to = daylight.CLEAR_TURBIDITY
    hazy = (turbidity - clear_to) / (_POLLUTED_TURBIDITY - clear_to)
    hazy = min(max(hazy, 0.0), 1.0)
    a, b, c, falloff, e = (
        (1.0 - hazy) * clear + hazy * polluted
        for clear, polluted in zip(_CLEAR, _POLLUTED, strict=True)
    )
    # The standard's indicatrix is Perez' less a constant, which makes it 1 at a right angle.
    at_right_angle = 1.0 - c * math.exp(falloff * math.pi / 2.0)
    luminance = angles.relative((a, b, c, falloff, e), at_right_angle)
    # Preetham's fit turns pink at the horizon of clear air, which in truth is pale.
    high = _ramp(4.0, 20.0, math.degrees(sun_altitude_rad))
    pale = np.exp(-angles.up / 0.22)[..., None] * high
    return _colored(angles, turbidity, luminance, pale)


def preetham_sky(d: Array, sun_altitude_rad: float, turbidity: float) -> Array:
    """Relative luminance of the clear sky by day, linear RGB, zenith 1; Preetham 1999.

    Args:
        d: Unit directions, shape [h, w, 3], each row level.
        sun_altitude_rad: Over the horizon.
        turbidity: Turbidity of the air.
    """
    angles = _SkyAngles.of(d, sun_altitude_rad)
    luminance = angles.relative(_perez_factors("luminance", turbidity))
    return _colored(angles, turbidity, luminance, np.zeros(1))


@dataclass(frozen=True, slots=True)
class _SkyAngles:
    """Angles of directions in the sky, which all formulas share.

    Attributes:
        up: Height of each row, its sine; at least 0.012, since they diverge at the horizon. [h, 1].
        angle_rad, cosine_squared: Angle between each direction and the sun, its cosine squared, [h,
            w].
        sun_zenith_rad: Distance of the sun from the zenith.
    """

    up: Array
    angle_rad: Array
    cosine_squared: Array
    sun_zenith_rad: float

    @classmethod
    def of(cls, d: Array, sun_altitude_rad: float) -> "_SkyAngles":
        """Of unit directions [h, w, 3], each row level."""
        towards = d[..., 0] * math.cos(sun_altitude_rad) + d[..., 2] * math.sin(sun_altitude_rad)
        towards = np.clip(towards, -1.0, 1.0)
        up = np.maximum(d[:, :1, 2], 0.012)
        return cls(up, np.arccos(towards), towards**2, 0.5 * math.pi - sun_altitude_rad)

    def relative(self, factors: Sequence[float], constant: float = 1.0) -> Array:
        """Perez' formula of five factors, relative to its value at the zenith."""
        a, b, c, falloff, e = factors

        def value(up: Array, angle: Array, cosine_squared: Array) -> Array:
            gradation = 1.0 + a * np.exp(b / up)
            indicatrix = constant + c * np.exp(falloff * angle) + e * cosine_squared
            product: Array = gradation * indicatrix
            return product

        zenith = np.full(1, self.sun_zenith_rad)
        at_zenith = value(np.ones(1), zenith, np.cos(zenith) ** 2)
        return value(self.up, self.angle_rad, self.cosine_squared) / float(at_zenith[0])


def _perez_factors(table: str, turbidity: float) -> list[float]:
    return [factor * turbidity + constant for factor, constant in _TABLES[table]]


def _colored(angles: _SkyAngles, turbidity: float, luminance: Array, pale: Array) -> Array:
    """Luminances in Preetham's colours.

    Args:
        angles: Angles of the directions.
        turbidity: Turbidity of the air.
        luminance: Luminance of each direction [h, w].
        pale: Share of the horizon's own colour in place of Preetham's, broadcast to [h, w, 1].
    """
    powers = np.array(
        [angles.sun_zenith_rad**3, angles.sun_zenith_rad**2, angles.sun_zenith_rad, 1.0]
    )
    terms = np.array([turbidity**2, turbidity, 1.0])[:, None] * powers
    x, y = (
        float((np.array(_TABLES[f"zenith_{axis}"]) * terms).sum())
        * angles.relative(_perez_factors(axis, turbidity))
        for axis in ("x", "y")
    )
    # Channel by channel: numpy is slow on products of three by three, and along short axes.
    red, blue, pale = x / y, (1.0 - x - y) / y, pale[..., 0]
    rgb = [np.maximum(a * red + b + c * blue, 0.02) for a, b, c in REC709_FROM_XYZ.tolist()]
    rgb = [c + pale * (horizon - c) for c, horizon in zip(rgb, _HORIZON.tolist(), strict=True)]
    red, green, blue = (c * share for c, share in zip(rgb, REC709_LUMINANCE.tolist(), strict=True))
    gain = luminance / (red + green + blue)
    return np.stack([channel * gain for channel in rgb], axis=-1)


def overcast_sky(d: Array) -> Array:
    """Relative luminance of the overcast sky, zenith 1: CIE standard overcast sky."""
    graded: Array = (1.0 + 2.0 * np.maximum(d[..., 2:], 0.0)) / 3.0 * _DECK
    return graded


def _in_strips(compute: Callable[[Array], Array], d: Array) -> Array:
    """Result of a row-by-row function; in strips, whose intermediate arrays stay in caches."""
    return np.concatenate([compute(d[k : k + _STRIP_ROWS]) for k in range(0, len(d), _STRIP_ROWS)])


def _mirror(half: Array) -> Float32:
    """Both sides of the plane through the sun and the zenith, which differ in clouds only."""
    columns = half.shape[1]
    both = np.zeros((len(half), 2 * columns, *half.shape[2:]), np.float32)
    both[:, :columns], both[:, columns:] = half, half[:, ::-1]
    return both


def _daylight(d: Array, model: SkyModel) -> Float32:
    """Sky lit by the sun, any unit: clear air, clouds in it, a closed deck."""
    altitude = model.sun_altitude_rad
    # In 32 bits, whose exponentials take a fifth of the time.
    half: Any = d[:, : d.shape[1] // 2].astype(np.float32)
    lit_from_rad = max(altitude, math.radians(1.5))
    by_day = _in_strips(lambda strip: clear_sky(strip, lit_from_rad, model.turbidity), half)
    dusk = 1.0 - _ramp(-1.0, 6.0, model.sun_altitude_deg)
    by_day = _scale_to_lux(by_day, 1.0)
    if dusk > 0.0:
        by_day = by_day * (1.0 - dusk) + _scale_to_lux(_twilight(half, model), 1.0) * dusk
    image = _mirror(by_day)
    if model.cloudiness == 0.0:
        return image
    cover, light = cloud_layer(d, model.cloudiness, altitude, model.seed)
    # A white cloud reflects all light of sun and sky.
    clear_lux = daylight.sky_illuminance_lux(altitude)
    sun_lux = daylight.sun_illuminance_lux(altitude, model.turbidity) * max(math.sin(altitude), 0.1)
    warm = np.array(daylight.sun_color(max(altitude, 0.01), model.turbidity))
    lit = (0.7 * sun_lux * warm + 1.3 * clear_lux * _DECK) / (math.pi * clear_lux)
    towards = half[..., 0] * math.cos(altitude) + half[..., 2] * math.sin(altitude)
    rim = _mirror(1.0 + 0.9 * np.exp((towards - 1.0) / 0.03))
    _lay(image, cover, (light * rim)[..., None] * lit.astype(np.float32))
    closed = _ramp(0.6, 0.95, model.cloudiness)
    if closed == 0.0:
        return _scale_to_lux(image, 1.0)
    shade = np.float32(0.72) + np.float32(0.5) * np.where(cover > 0.0, light, np.float32(0.5))
    deck: Float32 = overcast_sky(d[:, :1]).astype(np.float32) * shade[..., None]
    return _scale_to_lux(image, 1.0 - closed) + _scale_to_lux(deck, closed)


def _lay(image: Float32, cover: Float32, clouds: Float32) -> None:
    """Lay clouds over a sky, in place; their image is used up."""
    clouds -= image
    clouds *= cover[..., None]
    image += clouds


def _twilight(d: Array, model: SkyModel) -> Array:
    """A band of glow over the place where the sun is below the horizon, blue above.

    A painter's fit to photographs, not a simulation: only its total follows a source.
    """
    up = np.maximum(d[..., 2:], 0.0)
    level = np.sqrt(np.maximum(1.0 - d[..., 2:] ** 2, 1e-9))
    ahead = 0.5 + 0.5 * d[..., :1] / level
    sunk = _ramp(2.0, -9.0, model.sun_altitude_deg)
    zenith = np.array((0.30, 0.42, 0.78)) * (1.0 - sunk) + np.array((0.15, 0.27, 0.75)) * sunk
    glow = np.array((1.9, 0.95, 0.42)) * (1.0 - sunk) + np.array((1.7, 0.80, 0.38)) * sunk
    away = np.array((0.62, 0.50, 0.62)) * (1.0 - sunk) + np.array((0.28, 0.33, 0.60)) * sunk
    low = np.exp(-up / (0.20 - 0.09 * sunk))
    band = np.exp(-up / (0.42 - 0.22 * sunk)) * ahead**2
    image: Array = zenith * (0.45 + 0.55 * ahead * np.exp(-up / 0.7))
    image = image + (away - 0.5 * zenith) * low * (1.0 - ahead)
    return image + glow * band * (1.1 + 2.6 * low * ahead**3)


def _night(d: Array, model: SkyModel) -> Float32:
    """Airglow, and a city's lights scattered back: strongest low, or from the clouds' bases."""
    up = np.maximum(d[:, :1, 2:], 0.0)
    clear = 0.22 * _AIRGLOW + (0.35 + 0.65 * np.exp(-up / 0.22)) * _CITY
    image: Float32 = np.broadcast_to(clear, d.shape).astype(np.float32)
    if model.cloudiness > 0.0:
        cover, light = cloud_layer(d, model.cloudiness, 1.0, model.seed)
        glow = (5.0 * _CITY * (0.6 + 0.4 * np.exp(-up / 0.4))).astype(np.float32)
        _lay(image, cover, (np.float32(0.4) + np.float32(0.6) * light)[..., None] * glow)
    return image


def _with_land(image: Float32, model: SkyModel) -> Float32:
    """The sky above land that sun and sky light, hazy in the distance."""
    rows = len(image)
    altitude = model.sun_altitude_rad
    sun = sun_lux(model) * max(math.sin(altitude), 0.0) * np.array(daylight.sun_color(altitude))
    light = _level_light(image) + sun
    soil = _SOIL if model.ground_albedo < 0.5 else np.ones(3)
    land = model.ground_albedo / math.pi * light * soil
    land = land + _STREETS_CD_M2 * _ramp(-1.0, -8.0, model.sun_altitude_deg) * _CITY
    haze = image[-1] - land
    whole = np.zeros((2 * rows, *image.shape[1:]), np.float32)
    whole[:rows] = image
    heights = np.cos(math.pi * (np.arange(2 * rows) + 0.5) / (2 * rows))
    far = np.exp(heights[rows:] / 0.02)
    for first in range(0, rows, _STRIP_ROWS):
        strip = slice(first, first + _STRIP_ROWS)
        whole[rows:][strip] = land + haze * far[strip, None, None]
    return whole


def _scale_to_lux(image: Image, lux: float) -> Image:
    """Scale a sky, or its half, in place to that illuminance of level ground."""
    image *= image.dtype.type(lux / float(luminance(_level_light(image))))
    return image


def _level_light(image: Array | Float32) -> Array:
    """Illuminance of level ground by a hemisphere, or by two of the half that is given; RGB."""
    rows = len(image)
    edges = np.cos(0.5 * math.pi * np.arange(rows + 1) / rows)
    # Solid angle times cosine of each row, zenith first.
    weights = math.pi * (edges[:-1] ** 2 - edges[1:] ** 2) / image.shape[1]
    flat = image.reshape(rows, -1)
    columns = np.einsum("hk,h->k", flat, weights.astype(image.dtype), optimize=False)
    light: Array = columns.reshape(-1, 3).sum(axis=0, dtype=np.float64)
    return light


def _row_weights(rows: int) -> Array:
    edges = np.cos(math.pi * np.arange(rows + 1) / rows)
    weights: Array = (edges[:-1] - edges[1:]) / 2.0
    return weights


def _ramp(low: float, high: float, x: float) -> float:
    return float(smoothstep(low, high, np.full(1, x, np.float64))[0])


def _check(model: SkyModel) -> None:
    limits = (
        ("sun_altitude_deg", model.sun_altitude_deg, -90.0, 90.0),
        ("turbidity", model.turbidity, 1.8, 8.0),
        ("cloudiness", model.cloudiness, 0.0, 1.0),
        ("ground_albedo", model.ground_albedo, 0.0, 1.0),
    )
    for name, value, low, high in limits:
        if not low <= value <= high:
            raise ValueError(f"{name} is {value:g}; expected a number in [{low:g}, {high:g}]")
    if model.model not in MODELS:
        raise ValueError(f"model is '{model.model}'; expected one of {', '.join(MODELS)}")
    if model.model == "preetham" and (model.cloudiness > 0.0 or model.sun_altitude_deg < 1.0):
        raise ValueError(
            "preetham's sky has no clouds and no night; expected cloudiness 0 and sun_altitude_deg "
            "from 1 on"
        )
