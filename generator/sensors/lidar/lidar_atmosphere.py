"""Effects of fog, rain and snow on the pulses of a laser scanner.

* **Fog** attenuates by Beer and Lambert and scatters light back: the soft target of Rasshofer et
  al. 2011 as used by Hahner et al., "Fog Simulation on Real LiDAR Point Clouds for 3D Object
  Detection in Adverse Weather", ICCV 2021: back-scattering coefficient ``0.046 / visibility`` with
  ``visibility = ln 20 / extinction``, a pulse ``sin^2`` of half width 20 ns, and a receiver whose
  overlap with the beam rises from 0 at 0.9 m to 1 at 1 m.
* **Rain**: Goodin et al., "Predicting the Influence of Rain on LIDAR in ADAS", Electronics 2019:
  extinction ``0.01 R^0.6`` per metre, and noise of ``0.02 range (1 - exp(-R))^2`` for R in mm/h.
* **Snow**: extinction by ITU-R P.1814: ``a S^1.38`` dB/km, ``a = 5.42e-5 wavelength_nm + 5.496``
  (dry snow).
* **Drops and flakes** large enough to be detected at their range occur along the beam as a Poisson
  process, as in Hahner et al., "LiDAR Snowfall Simulation", CVPR 2022. Sizes of drops: Marshall and
  Palmer 1948; of flakes: Gunn and Marshall 1958, whose melted diameters are scaled by the cube root
  of ten, the ratio of the densities of water and snow.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, scene, streams
from gen_data.sensors.lidar.lidar_detection import Float32, Pulses, join_pulses, received_light
from gen_data.sensors.lidar.scan_pattern import LidarModel

PULSE_LENGTH_M = 20e-9 * 299_792_458.0
OVERLAP_M = (0.9, 1.0)
SOFT_GAIN = 2.0e6 / 299_792_458.0
"""Hahner et al. weight a hard target with 1e-6 / pi, and air with an integral over time: their
receivers, less sensitive at short range, measure fog weaker by this factor than the lidar equation
alone."""
DROP_REFLECTANCE = 0.005
"""A clear sphere scatters the 2 % its surface reflects in all directions: a quarter, as a disc."""
FLAKE_REFLECTANCE, FLAKE_GROWTH = 0.9, 10.0 ** (1.0 / 3.0)
APERTURE_M = 0.01
"""Width of a beam at the scanner."""
RANGE_STEPS = 512


@dataclass(frozen=True, slots=True)
class Particles:
    """Size distribution ``per_m4 * exp(-slope_per_m * diameter)`` per m^3 and m of diameter."""

    per_m4: float
    slope_per_m: float
    reflectance: float


def drops(rain_mm_h: float) -> Particles:
    """Size distribution of rain drops (Marshall and Palmer 1948)."""
    return Particles(8.0e6, 4100.0 * rain_mm_h**-0.21, DROP_REFLECTANCE)


def flakes(snow_mm_h: float) -> Particles:
    """Size distribution of snow flakes (Gunn and Marshall 1958)."""
    slope_per_m = 2550.0 * snow_mm_h**-0.48 / FLAKE_GROWTH
    return Particles(3.8e6 * snow_mm_h**-0.87 / FLAKE_GROWTH, slope_per_m, FLAKE_REFLECTANCE)


def rain_extinction_per_m(rain_mm_h: float) -> float:
    """Extinction of rain (Goodin et al. 2019)."""
    return float(0.01 * rain_mm_h**0.6) if rain_mm_h > 0.0 else 0.0


def snow_extinction_per_m(snow_mm_h: float, wavelength_nm: float) -> float:
    """Extinction of dry snow (ITU-R P.1814); 4.343 dB are a factor of e."""
    if snow_mm_h <= 0.0:
        return 0.0
    a = 5.42e-5 * wavelength_nm + 5.4958776
    return float(a * snow_mm_h**1.38 / 4.343 / 1000.0)


def optical_depth(
    weather: scene.Weather, model: LidarModel, height_m: float, up: Float32, range_m: Float32
) -> Float32:
    """One-way optical depth along beams, float32 [n, candidates]; light falls by its double.

    Fog has its full density at the world's origin, ``height_m`` below the scanner. ``up`` is z of
    the beams' directions in the world [n, 1]; ranges [n, candidates] are finite.
    """
    uniform = rain_extinction_per_m(weather.rain_mm_h)
    uniform += snow_extinction_per_m(weather.snow_mm_h, model.wavelength_nm)
    fog = weather.fog_extinction_per_m
    if weather.fog_height_m <= 0.0 or fog == 0.0:
        return np.asarray(range_m * np.float32(uniform + fog), np.float32)
    # Mean of exp(-up * r / H) over the ray; a series for nearly level rays avoids 0 / 0.
    climb = (up * range_m).astype(np.float64) / weather.fog_height_m
    level = np.abs(climb) < 1e-4
    mean = np.where(level, 1.0 - 0.5 * climb, -np.expm1(-climb) / np.where(level, 1.0, climb))
    here = fog * math.exp(-height_m / weather.fog_height_m)
    return np.asarray(range_m * (uniform + here * mean), np.float32)


def attenuate(pulses: Pulses, depth: Float32 | np.float32) -> Pulses:
    """Attenuate pulses by a one-way optical depth, both ways."""
    factor = np.exp(np.float32(-2.0) * depth)
    return replace(pulses, light=pulses.light * factor, reflectance=pulses.reflectance * factor)


def add_atmosphere(
    pulses: Pulses, weather: scene.Weather, model: LidarModel, height_m: float, rng: streams.Rng
) -> Pulses:
    """Add returns of fog, drops and flakes in front of the targets."""
    count = len(pulses.range_m)
    # Receivers of Hahner et al. (2021 and 2022) see the whole beam from 1 m on. Their strengths of
    # fog and snow hold with that; ``near_m`` is known for solid targets only.
    solid = {"near_m": 0.0, "seen_far": None}
    model = model.model_copy(update={"seen": model.seen_air or model.seen, **solid})
    nearest_m = pulses.range_m.min(axis=1, keepdims=True)
    fog = weather.fog_extinction_per_m
    if weather.fog_height_m > 0.0:
        fog *= math.exp(-height_m / weather.fog_height_m)
    air = [_fog_returns(count, fog, model, rng)] if fog > 0.0 else []
    if weather.rain_mm_h > 0.0:
        air.append(_particle_returns(count, drops(weather.rain_mm_h), model, rng))
    if weather.snow_mm_h > 0.0:
        air.append(_particle_returns(count, flakes(weather.snow_mm_h), model, rng))
    for more in air:
        light = np.where(more.range_m < nearest_m, more.light, np.float32(0.0))
        pulses = join_pulses(pulses, replace(more, light=light))
    return pulses


def rain_noise_m(rain_mm_h: float, range_m: Float32) -> Float32:
    """Standard deviation that rain adds to ranges (Goodin et al. 2019)."""
    return np.asarray(range_m * np.float32(0.02 * (1.0 - math.exp(-rain_mm_h)) ** 2), np.float32)


@lru_cache(maxsize=64)
def fog_peak(extinction_per_m: float) -> tuple[float, float]:
    """Range of the peak of fog's return [m], and the equivalent matte reflectance / range^2.

    ``gain * pi * beta * max over R of integral sin^2(pi (R - r) / L) exp(-2 a r) xi(r) / r^2 dr``.
    """
    beta = 0.046 * extinction_per_m / math.log(20.0)
    step_m = 0.02
    r = np.arange(OVERLAP_M[0] + 0.5 * step_m, 40.0, step_m)
    low, high = OVERLAP_M
    overlap = np.clip((r - low) / (high - low), 0.0, 1.0)
    density = overlap * np.exp(-2.0 * extinction_per_m * r) / (r * r) * step_m
    back = np.arange(0.0, PULSE_LENGTH_M, step_m)
    pulse = np.sin(np.pi * back / PULSE_LENGTH_M) ** 2
    response = np.convolve(density, pulse)[: len(r)]
    k = int(response.argmax())
    return float(r[k]), float(SOFT_GAIN * math.pi * beta * response[k])


def _fog_returns(count: int, extinction: float, model: LidarModel, rng: streams.Rng) -> Pulses:
    """Returns of fog; their range varies by a factor of up to two, as Hahner et al. observed."""
    peak_m, strength = fog_peak(extinction)
    range_m = np.float32(peak_m) * np.exp2(rng.uniform(-1.0, 1.0, (count, 1))).astype(np.float32)
    unit = np.float32(strength * model.seen.range_m**2 / model.seen.reflectance)
    light = np.full((count, 1), unit, np.float32)
    return _in_air(range_m, light, np.float32(strength) * range_m * range_m)


def _particle_returns(count: int, kind: Particles, model: LidarModel, rng: streams.Rng) -> Pulses:
    """Return of the first detectable drop or flake in each beam; inf = none."""
    r = np.linspace(0.0, model.range_m[1], RANGE_STEPS)
    across_m = APERTURE_M + 1e-3 * model.divergence_mrad * r
    least_m = across_m * r * _per_range(model, kind)
    per_m3 = kind.per_m4 / kind.slope_per_m * np.exp(-kind.slope_per_m * least_m)
    rate = per_m3 * 0.25 * math.pi * across_m**2
    # Expected number of particles up to r: inverting it at an exponential draw gives the first one.
    expected = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(r))])
    draw = rng.exponential(1.0, (count, 2))
    range_m = np.where(draw[:, :1] < expected[-1], np.interp(draw[:, :1], expected, r), np.inf)
    finite = np.where(np.isfinite(range_m), range_m, model.range_m[1])
    across_m = APERTURE_M + 1e-3 * model.divergence_mrad * finite
    diameter_m = across_m * finite * _per_range(model, kind) + draw[:, 1:] / kind.slope_per_m
    share = np.minimum(diameter_m / across_m, 1.0) ** 2
    reflectance = (share * kind.reflectance).astype(np.float32)
    light = received_light(reflectance, finite.astype(np.float32), model)
    return _in_air(range_m.astype(np.float32), light, reflectance)


def _per_range(model: LidarModel, kind: Particles) -> float:
    """Least diameter of a detectable particle over the beam's width, per metre of range."""
    return math.sqrt(model.seen.reflectance / kind.reflectance) / model.seen.range_m


def _in_air(range_m: Float32, light: Float32, reflectance: Float32) -> Pulses:
    """Candidates that belong to the air: without ids."""
    nothing: NDArray[np.uint16] = np.zeros(range_m.shape, np.uint16)
    air = np.full(range_m.shape, asset_types.SURFACES.index("air"), np.uint8)
    return Pulses(range_m, light, reflectance, nothing, nothing, air)
