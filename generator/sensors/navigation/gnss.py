"""GNSS receiver: geodetic position, velocity and their accuracy.

Example, for a scene with a rig ``ego``::

    sensors:
      - type: gnss
        name: gps
        rig: ego
        model: ZED-F9P
        rate_hz: 10

``sample.measurements["gps"]`` then holds the fixes since the last step, with the fields ``time_s``,
``latitude_deg``, ``longitude_deg``, ``altitude_m``, ``velocity_east_m_s`` ...,
``horizontal_sigma_m``, ``vertical_sigma_m``, ``satellites`` and ``quality`` (as in NMEA GGA).
Positions and velocities are NaN without a fix.

Errors are white noise and a first-order Gauss-Markov process (Brown and Hwang, "Introduction to
Random Signals and Applied Kalman Filtering"), scaled by the dilution of precision of the visible
satellites (Langley, "Dilution of Precision", GPS World 1999).
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core import geodesy, interfaces, scene_time
from gen_data.core.capture import Channel, LidarRays, Measurements
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Lidar, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.core.streams import Rng
from gen_data.sensors.device_presets import check_preset, load_preset
from gen_data.sensors.mounting import (
    Instrument,
    MountMotion,
    mount_motion,
    reading_times,
    remove_carrier,
)
from gen_data.sensors.navigation.navigation_faults import GnssFaults

COLUMNS = (
    TIME,
    Column("latitude_deg", "<f8", "WGS 84; NaN without a fix"),
    Column("longitude_deg", "<f8", "WGS 84; NaN"),
    Column("altitude_m", "<f8", "above the ellipsoid; NaN"),
    Column("velocity_east_m_s", "<f4", "NaN without a fix"),
    Column("velocity_north_m_s", "<f4", "NaN"),
    Column("velocity_up_m_s", "<f4", "NaN"),
    Column("horizontal_sigma_m", "<f4", "standard deviation of the position, per axis; NaN"),
    Column("vertical_sigma_m", "<f4", "standard deviation of the altitude; NaN"),
    Column("satellites", "|u1", "in sight"),
    Column("quality", "|u1", "as in NMEA GGA: 0 no fix, 1 alone, 2 differential, 4 RTK, 5 float"),
)
PRESETS = "gen_data.sensors.navigation.gnss_presets"
OCCLUSION_RANGE_M = 1000.0
"""Objects farther away occlude no satellite."""
SATELLITES_MIN = 4
"""Satellites needed for a fix: three coordinates and the receiver's clock."""
DILUTION_MAX = 20.0
"""Fixes with a larger dilution of precision are not reported."""

Degrees = Annotated[float, Field(ge=-180, le=180)]


class Spread(Strict):
    """Standard deviations of the error of one axis under an open sky.

    Attributes:
        white_m: White noise.
        slow_m: Gauss-Markov process.
    """

    white_m: float = Field(ge=0)
    slow_m: float = Field(ge=0)


class GnssModel(Strict):
    """Data sheet of a receiver with its source of corrections.

    Attributes:
        quality: Fix quality as in NMEA GGA: 1 standalone, 2 differential, 4 RTK, 5 RTK float.
        horizontal, vertical: Errors of position, per axis.
        correlation_s: Correlation time of slow errors, after which 1/e of an error remains.
        velocity_m_s: Standard deviation of velocity, per axis.
    """

    quality: Literal[1, 2, 4, 5]
    horizontal: Spread
    vertical: Spread
    correlation_s: float = Field(gt=0)
    velocity_m_s: float = Field(ge=0)


class Gnss(Instrument):
    """A GNSS receiver: position and velocity, less accurate where objects occlude the sky.

    Attributes:
        model: ``standalone``, ``ZED-F9P`` or ``RT3003``; a file of
            ``generator/sensors/navigation/gnss_presets``.
        origin_deg: Latitude and longitude of the world's origin; its X axis points east.
        origin_altitude_m: Altitude of the world's origin above the ellipsoid.
        satellites: Number of satellites above the mask; their directions are drawn per sequence.
        mask_deg: Elevation mask: satellites lower than this are not used.
        noise: Factor on the model's errors; 0 = an ideal device.
        faults: Jumps of the position; null = none.
    """

    kind: ClassVar[str] = "gnss"
    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    type: Literal["gnss"] = "gnss"
    name: str = Field("gnss", pattern=NAME_PATTERN)
    model: Annotated[str, AfterValidator(lambda name: check_preset(PRESETS, name))] = "standalone"
    origin_deg: tuple[Annotated[float, Field(ge=-89, le=89)], Degrees] = (49.0114, 8.4244)
    origin_altitude_m: float = Field(115.0, ge=-1000, le=20_000)
    satellites: int = Field(12, ge=4, le=60)
    mask_deg: float = Field(10.0, ge=0, le=60)
    noise: float = Field(1.0, ge=0)
    faults: GnssFaults | None = None

    def capture(
        self, scene: Scene, renderer: interfaces.Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Read the fixes at the instants since the last step."""
        del channels
        times_s = reading_times(scene, self.rate_hz)
        shared = rng.of_sequence()
        sky = _draw_constellation(self.satellites, math.radians(self.mask_deg), shared)
        motion = mount_motion(scene, self.name)
        visible = np.stack(
            [_is_visible(scene, self.rig, motion, t, sky, renderer) for t in times_s]
        )
        fixes = _compute_fixes(sky, visible)
        model = load_preset(PRESETS, self.model, GnssModel)
        rate_hz = self.rate_hz or 1.0 / scene.step_s
        slow = _draw_slow_errors(times_s, rate_hz, model.correlation_s, shared)
        columns = self._columns(model, motion, times_s, fixes, slow, rng)
        rows = table_rows(COLUMNS, len(times_s), time_s=times_s, **columns)
        fixed = Measurements(self.name, scene.device(self.name), rows, scene.time_s)
        return fixed if self.faults is None else self.faults.apply(fixed, rng)

    def _columns(
        self,
        model: GnssModel,
        motion: MountMotion,
        times_s: Array,
        fixes: "Fixes",
        slow: Array,
        rng: Rng,
    ) -> dict[str, Array]:
        """Positions and velocities with errors, by column; NaN without a fix."""
        across, up = model.horizontal, model.vertical
        growth = self.noise * np.stack([fixes.horizontal, fixes.horizontal, fixes.vertical], axis=1)
        white = np.array([across.white_m, across.white_m, up.white_m])
        slow_scale = np.array([across.slow_m, across.slow_m, up.slow_m])
        errors_m = growth * (white * rng.standard_normal(slow.shape) + slow_scale * slow)
        positions_m = np.array([motion.pose(float(t)).translation_m for t in times_s])
        origin = geodesy.GeodeticOrigin(*self.origin_deg, self.origin_altitude_m)
        geodetic = np.round(geodesy.to_geodetic(positions_m + errors_m, origin), 10)
        velocities = np.array([motion.velocity_m_s(float(t)) for t in times_s])
        velocities += growth * model.velocity_m_s * rng.standard_normal(slow.shape)
        sigma_m = growth[:, 1:] * np.hypot(white, slow_scale)[1:]
        columns = {
            "latitude_deg": geodetic[:, 0],
            "longitude_deg": geodetic[:, 1],
            "altitude_m": np.round(geodetic[:, 2], 6),
            "velocity_east_m_s": velocities[:, 0],
            "velocity_north_m_s": velocities[:, 1],
            "velocity_up_m_s": velocities[:, 2],
            "horizontal_sigma_m": sigma_m[:, 0],
            "vertical_sigma_m": sigma_m[:, 1],
        }
        columns = {name: np.where(fixes.valid, v, np.nan) for name, v in columns.items()}
        quality = np.where(fixes.valid, model.quality, 0)
        return {**columns, "satellites": fixes.satellites, "quality": quality}


@dataclass(frozen=True, eq=False, slots=True)
class Fixes:
    """Geometry of the visible satellites at each reading, arrays [n].

    Attributes:
        satellites: Number of visible satellites.
        valid: Whether there is a fix.
        horizontal, vertical: Dilution of precision relative to an open sky's; 1 without a fix.
    """

    satellites: NDArray[np.intp]
    valid: NDArray[np.bool_]
    horizontal: Array
    vertical: Array


def _draw_constellation(count: int, mask_rad: float, rng: Rng) -> Array:
    """Unit directions of satellites, uniform over the sky above the mask, world, [n, 3]."""
    up = rng.uniform(math.sin(mask_rad), 1.0, count)
    azimuth = rng.uniform(0.0, 2.0 * math.pi, count)
    level = np.sqrt(1.0 - up * up)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=1)


def _is_visible(
    scene: Scene,
    rig: str,
    motion: MountMotion,
    time_s: float,
    sky: Array,
    renderer: interfaces.Renderer,
) -> NDArray[np.bool_]:
    """Whether each satellite is visible from the antenna, [satellites]."""
    antenna = Lidar("antenna", "", T_world_lidar=SE3(motion.pose(time_s).translation_m))
    around = remove_carrier(scene_time.scene_at(scene, float(time_s)), rig)
    rays = LidarRays(sky.astype(np.float32), 0.0, 1, OCCLUSION_RANGE_M)
    return np.asarray(~np.isfinite(renderer.scan(around, antenna, rays).range_m[:, 0]))


def _compute_fixes(sky: Array, visible: NDArray[np.bool_]) -> Fixes:
    """Fixes from directions of satellites and their visibility [n, satellites]."""
    open_sky = _dilution(sky)
    ratios, valid = np.ones((len(visible), 2)), np.zeros(len(visible), np.bool_)
    for k, satellites in enumerate(visible):
        if satellites.sum() < SATELLITES_MIN:
            continue
        dilution = _dilution(sky[satellites])
        valid[k] = bool(np.all(dilution < DILUTION_MAX))
        if valid[k]:
            ratios[k] = np.round(dilution / open_sky, 6)
    return Fixes(visible.sum(axis=1), valid, ratios[:, 0], ratios[:, 1])


def _dilution(sky: Array) -> Array:
    """Horizontal and vertical dilution of precision of satellites, [2]; inf if they are degenerate.

    Square roots of the diagonal of ``(G^T G)^-1``, where a row of G is a negated direction and 1
    for the clock (Langley 1999).
    """
    design = np.column_stack([-sky, np.ones(len(sky))])
    normal = np.einsum("ni,nj->ij", design, design, optimize=False)
    if abs(float(np.linalg.det(normal))) < 1e-9:
        return np.full(2, np.inf)
    q = np.diag(np.linalg.inv(normal))
    return np.asarray(np.sqrt(np.array([q[0] + q[1], q[2]])))


def _draw_slow_errors(times_s: Array, rate_hz: float, correlation_s: float, shared: Rng) -> Array:
    """A Gauss-Markov process of standard deviation 1 at each reading, [n, 3].

    It is drawn from time 0 at every step, to let each step be generated alone.
    """
    last = round(float(times_s[-1]) * rate_hz)
    kept = math.exp(-1.0 / (rate_hz * correlation_s))
    fresh = shared.standard_normal((last + 1, 3))
    fresh[1:] *= math.sqrt(1.0 - kept * kept)
    values = np.zeros_like(fresh)
    value = np.zeros(3)
    for k, step in enumerate(fresh):
        value = kept * value + step
        values[k] = value
    return np.asarray(values[np.rint(times_s * rate_hz).astype(int)])
