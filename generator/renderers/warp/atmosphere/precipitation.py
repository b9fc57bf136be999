"""Falling rain and snow as motion-blurred streaks in the image.

Only particles that are large in the image are drawn individually: the rest is haze, which presets
of rain and snow contain as fog.

Sources: Marshall and Palmer, "The distribution of raindrops with size", J. Meteorology 5, 1948;
Atlas, Srivastava and Sekhon, Reviews of Geophysics 11, 1973 (speed of drops); Sekhon and
Srivastava, "Snow size spectra and radar reflectivity", J. Atmospheric Sciences 27, 1970; Garg and
Nayar, "Vision and rain", IJCV 75, 2007 (opacity of streaks).
"""

import math
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import colorimetry, intrinsics, scene, se3, streams
from gen_data.renderers.warp.atmosphere.kernels import precipitation
from gen_data.renderers.warp.visibility.frame_context import CameraView

_NEAREST_M = 0.35
# Aperture of the lens: near particles are defocused by that much.
_APERTURE_M = 0.002
_EXPOSURE_S = (1.0 / 500.0, 1.0 / 40.0)
_F_NUMBER = 2.0
_METERED_EVERY = 61
_COUNT_MAX = 60_000
_SPHERE_MAX = 480_000
# Diameter of a flake relative to the drop to which it melts: its density is about 0.05.
_FLAKE = 2.7


@dataclass(frozen=True, slots=True)
class Kind:
    """Particles with an exponential distribution of diameters.

    Attributes:
        density_per_m3: Number density of particles above the smallest diameter.
        slope_per_m: Slope of the distribution.
        least_m: Smallest diameter that is drawn.
        farthest_m: Largest distance at which particles are drawn.
    """

    density_per_m3: float
    slope_per_m: float
    least_m: float
    farthest_m: float


def rain(rate_mm_h: float) -> Kind:
    """Raindrops; Marshall and Palmer: 8000 per m^3 and mm, slope 4.1 R^-0.21 per mm."""
    slope_per_mm, least_mm = 4.1 * rate_mm_h**-0.21, 1.0
    density = 8000.0 / slope_per_mm * math.exp(-slope_per_mm * least_mm)
    return Kind(density, slope_per_mm * 1e3, least_mm * 1e-3, 6.0)


def snow(rate_mm_h: float) -> Kind:
    """Snowflakes; Sekhon and Srivastava: 2500 R^-0.94 per m^3 and mm, slope 2.29 R^-0.45 per mm.

    Diameters refer to the melted drops.
    """
    slope_per_mm, least_mm = 2.29 * rate_mm_h**-0.45, 0.7
    density = 2500.0 * rate_mm_h**-0.94 / slope_per_mm * math.exp(-slope_per_mm * least_mm)
    return Kind(density, slope_per_mm * 1e3 / _FLAKE, least_mm * 1e-3 * _FLAKE, 14.0)


def light_level_ev100(radiance: wp.array, fixed_ev100: float | None) -> float:
    """Exposure value that a camera is set to, or that suits the light it receives.

    Without a setting it is approximated from the median luminance of the radiance [cd/m^2], flat
    linear RGB: only the length of streaks depends on it.
    """
    if fixed_ev100 is not None:
        return fixed_ev100
    levels = colorimetry.luminance(radiance.numpy()[::_METERED_EVERY])
    # Black pixels, outside a lens's field or without a background, are ignored.
    lit = levels[levels > 0.0]
    median_cd_m2 = float(np.median(lit)) if len(lit) else 0.0
    # Rounded: the last bit of a logarithm must have no effect.
    # White is 1.2 * 2^EV100 cd/m^2 (ISO 12232); metering places the mean at middle grey.
    return round(math.log2(max(median_cd_m2, 1e-6) / (1.2 * colorimetry.MIDDLE_GREY)) * 16.0) / 16.0


def usual_exposure_s(ev100: float) -> float:
    """Exposure time of a camera at ISO 100 and f/2, limited to a usual range."""
    return float(min(max(_F_NUMBER**2 / 2.0**ev100, _EXPOSURE_S[0]), _EXPOSURE_S[1]))


def draw_precipitation(frame: CameraView, z_m: wp.array, radiance: wp.array) -> bool:
    """Draw falling particles over the radiance [cd/m^2], in place; returns whether there are any.

    ``z_m`` are the image's depths, as of GBuffer.
    """
    weather, camera = frame.world.weather, frame.state.camera
    if weather.rain_mm_h <= 0.0 and weather.snow_mm_h <= 0.0:
        return False
    exposure_s = camera.shutter.exposure_s
    if not exposure_s:
        exposure_s = usual_exposure_s(light_level_ev100(radiance, camera.ev100))
    found = [
        make_streaks(kind, camera, weather, exposure_s, name)
        for name, rate, kind in (
            ("rain", weather.rain_mm_h, rain(max(weather.rain_mm_h, 1e-3))),
            ("snow", weather.snow_mm_h, snow(max(weather.snow_mm_h, 1e-3))),
        )
        if rate > 0.0
    ]
    values = np.concatenate(found)
    if not len(values):
        return False
    values = values[np.argsort(-values["z_m"], kind="stable")]
    first, listed = _streaks_by_row(values, frame.view.height)
    device = frame.cache.device
    streaks = wp.array(values, dtype=precipitation.Streak, device=device)
    inputs = [frame.view, frame.world.record, streaks]
    frame.launch(precipitation.light_streaks, len(values), inputs)
    lists = [wp.array(a, dtype=wp.int32, device=device) for a in (first, listed)]
    inputs = [frame.view.width, z_m, streaks, *lists]
    frame.launch(precipitation.draw_streaks, frame.view.height, inputs, [radiance])
    return True


def make_streaks(
    kind: Kind, camera: scene.Camera, weather: scene.Weather, exposure_s: float, name: str
) -> NDArray[np.void]:
    """Streak records of all visible particles of a kind."""
    k = camera.intrinsics
    if not k.straight:
        return trace_through_lens(kind, camera, weather, exposure_s, name)
    T = camera.T_world_camera
    spread = (k.width_px / k.fx_px) * (k.height_px / k.fy_px) / 3.0
    expected = kind.density_per_m3 * spread * (kind.farthest_m**3 - _NEAREST_M**3)
    u, z, diameter_m, way = _draw_particles(
        kind, camera, weather, exposure_s, name, expected, _COUNT_MAX
    )
    x = (u[1] * k.width_px - k.cx_px) / k.fx_px * z
    y = (u[2] * k.height_px - k.cy_px) / k.fy_px * z
    p = np.stack([x, y, z], axis=-1)
    ends = []
    for side in (-0.5, 0.5):
        q = p + side * way
        depth = np.maximum(q[:, 2], 0.5 * _NEAREST_M)
        u_px = q[:, 0] / depth * k.fx_px + k.cx_px
        ends.append(np.stack([u_px, q[:, 1] / depth * k.fy_px + k.cy_px], axis=1))
    return _streak_records(T, np.stack(ends, axis=1), p, z, diameter_m, k.fx_px)


def _draw_particles(
    kind: Kind,
    camera: scene.Camera,
    weather: scene.Weather,
    exposure_s: float,
    name: str,
    expected: float,
    count_max: int,
) -> tuple[se3.Array, se3.Array, se3.Array, se3.Array]:
    """Uniform numbers [5, n], distances, diameters and motion in the camera frame [n, 3]."""
    T = camera.T_world_camera
    rng = streams.Streams(seed=weather.seed, scene=0).rng(
        f"{name} {camera.name} {T.translation_m} {T.quaternion_wxyz}"
    )
    u = rng.random((5, min(poisson(expected, rng), count_max)))
    # Uniform in volume: the cube of the distance is uniform.
    distance_m = np.cbrt(_NEAREST_M**3 + u[0] * (kind.farthest_m**3 - _NEAREST_M**3))
    diameter_m = kind.least_m - np.log(1.0 - u[3]) / kind.slope_per_m
    way = _velocity(name, diameter_m, u[4], weather.seed) * exposure_s
    way = np.einsum("ij,nj->ni", T.rotation().T, way, optimize=False)
    return u, distance_m, diameter_m, way


def _streak_records(
    T_world_camera: se3.SE3,
    ends_px: se3.Array,
    p_camera: se3.Array,
    depth_m: se3.Array,
    diameter_m: se3.Array,
    px_per_rad: se3.Array | float,
) -> NDArray[np.void]:
    """Streak records of particles with the given ends [n, 2, 2], places [n, 3] and depths [n]."""
    values = np.zeros(len(depth_m), dtype=precipitation.Streak.numpy_dtype())
    values["start_px"], values["end_px"] = ends_px[:, 0], ends_px[:, 1]
    values["z_m"] = depth_m
    there = np.einsum("ij,nj->ni", T_world_camera.rotation(), p_camera, optimize=False)
    values["p_m"] = there + T_world_camera.translation_m
    length = np.sqrt(((values["end_px"] - values["start_px"]) ** 2).sum(axis=1))
    sharp = px_per_rad * diameter_m / depth_m
    wide = np.maximum(sharp + px_per_rad * _APERTURE_M / depth_m, 1.0)
    # Area of the particle's disk divided by the area of its streak.
    area = 0.25 * math.pi * sharp**2 / (wide * length + 0.25 * math.pi * wide**2)
    values["opacity"] = np.minimum(area, 1.0)
    values["radius_px"] = 0.5 * wide
    return values


def trace_through_lens(
    kind: Kind, camera: scene.Camera, weather: scene.Weather, exposure_s: float, name: str
) -> NDArray[np.void]:
    """As ``make_streaks``, for lenses with distortion: depths are ranges.

    Particles are distributed over the narrowest cone that contains the image, and the ones in the
    image are kept.
    """
    k, T = camera.intrinsics, camera.T_world_camera
    least_cosine = _rim_cosine(k)
    cube_m3 = kind.farthest_m**3 - _NEAREST_M**3
    expected = kind.density_per_m3 * 2.0 * math.pi * (1.0 - least_cosine) / 3.0 * cube_m3
    u, range_m, diameter_m, way = _draw_particles(
        kind, camera, weather, exposure_s, name, expected, _SPHERE_MAX
    )
    cosine = 1.0 - u[1] * (1.0 - least_cosine)
    sine, turn = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * u[2]
    p = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1) * range_m[:, None]
    ends = np.stack([k.project(p - 0.5 * way), k.project(p + 0.5 * way)], axis=1)
    middle = k.project(p)
    inside = ((middle >= 0.0) & (middle < (k.width_px, k.height_px))).all(axis=1)
    # Ends half an image apart lie on both sides of a seam.
    whole = np.abs(ends[:, 1] - ends[:, 0]).max(axis=1) < 0.5 * k.width_px
    kept = np.flatnonzero(inside & whole)[:_COUNT_MAX]
    px_per_rad = _px_per_rad(k, middle[kept])
    return _streak_records(T, ends[kept], p[kept], range_m[kept], diameter_m[kept], px_per_rad)


def _rim_cosine(k: intrinsics.Intrinsics) -> float:
    """Cosine of the widest angle to the axis in the image; -1 if its corners are dark."""
    u, v = (np.linspace(0.0, size, 65) for size in (k.width_px, k.height_px))
    sides = [np.stack(np.broadcast_arrays(u, end), axis=-1) for end in (0.0, float(k.height_px))]
    sides += [np.stack(np.broadcast_arrays(end, v), axis=-1) for end in (0.0, float(k.width_px))]
    cosines = k.rays(np.concatenate(sides))[:, 2]
    return -1.0 if np.isnan(cosines).any() else float(max(cosines.min() - 1e-3, -1.0))


def _px_per_rad(k: intrinsics.Intrinsics, places_px: se3.Array) -> se3.Array:
    """Side in pixels of the image of a small square angle, per radian, [n]."""
    right, below = np.array([0.5, 0.0]), np.array([0.0, 0.5])
    across = k.rays(places_px + right) - k.rays(places_px - right)
    down = k.rays(places_px + below) - k.rays(places_px - below)
    area = np.cross(across, down)
    usual = 1.0 / k.fx_px
    angles = np.nan_to_num(np.sqrt(np.sqrt((area * area).sum(axis=1))), nan=usual)
    return np.asarray(1.0 / np.maximum(angles, 0.05 * usual))


def poisson(expected: float, rng: streams.Rng) -> int:
    """A Poisson-distributed number, by the normal limit for large means."""
    if expected > 64.0:
        u1, u2 = (float(v) for v in rng.random(2))
        normal = math.sqrt(-2.0 * math.log(1.0 - u1)) * math.cos(2.0 * math.pi * u2)
        return max(round(expected + math.sqrt(expected) * normal), 0)
    product, count, end = float(rng.random()), 0, math.exp(-expected)
    while product > end:
        product *= float(rng.random())
        count += 1
    return count


def _velocity(name: str, diameter_m: se3.Array, u: se3.Array, seed: int) -> se3.Array:
    """World velocities [m/s], [n, 3]: fall, and drift with the wind."""
    wind = streams.Streams(seed=seed, scene=0).rng("wind").random(2)
    angle, gust = 2.0 * math.pi * wind[0], 3.0 * wind[1]
    drift = gust * (0.8 + 0.4 * u)
    if name == "rain":
        fall = 9.65 - 10.3 * np.exp(-0.6 * diameter_m * 1e3)
    else:
        fall = 0.9 + 0.5 * u
        angle = angle + 1.5 * np.sin(37.0 * u)
    return np.stack([drift * np.cos(angle), drift * np.sin(angle), -fall], axis=-1)


def _streaks_by_row(
    values: NDArray[np.void], height: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Streaks that touch each row, in the given order: starts [height + 1] and numbers."""
    ys = np.stack([values["start_px"][:, 1], values["end_px"][:, 1]])
    margin = values["radius_px"] + 0.5
    top = np.clip(np.floor(ys.min(axis=0) - margin), 0, height).astype(np.int64)
    bottom = np.clip(np.ceil(ys.max(axis=0) + margin), 0, height).astype(np.int64)
    counts = np.maximum(bottom - top, 0)
    number = np.repeat(np.arange(len(values)), counts)
    within = np.arange(len(number)) - np.repeat(np.cumsum(counts) - counts, counts)
    row = np.repeat(top, counts) + within
    order = np.argsort(row, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=height))])
    return first.astype(np.int32), number[order].astype(np.int32)
