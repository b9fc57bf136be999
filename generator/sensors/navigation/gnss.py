"""A satellite receiver: where it is on the earth, how fast it goes, and how sure it is.

Errors are white noise and a first-order Gauss-Markov process (Brown and Hwang, "Introduction to
Random Signals and Applied Kalman Filtering"), made larger by the geometry of the satellites that
nothing hides, in proportion to the dilution of precision (Langley, "Dilution of Precision", GPS
World 1999).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.capture import Channel, LidarRays, Measurements
from gen_data.generator.core.geodesy import GeodeticOrigin, to_geodetic
from gen_data.generator.core.interfaces import Renderer
from gen_data.generator.core.measurement_dtypes import table_rows
from gen_data.generator.core.scene import Lidar, Scene
from gen_data.generator.core.scene_time import scene_at
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.device_presets import check_preset, load_preset
from gen_data.generator.sensors.mount_kinematics import MountMotion, mount_motion, remove_carrier
from gen_data.generator.sensors.mounting import Instrument, reading_times

MAKES = "gen_data.generator.sensors.navigation.gnss_presets"
SKY_M = 1000.0
"""Nothing farther away hides a satellite."""
NEEDED = 4
"""Satellites without which there is no fix: three coordinates and the clock."""
DILUTION_MAX = 20.0
"""Fixes of worse geometry are not reported."""

Degrees = Annotated[float, Field(ge=-180, le=180)]


class Spread(Strict):
    """Standard deviations of one axis under an open sky: white, and slowly wandering."""

    white_m: float = Field(ge=0)
    slow_m: float = Field(ge=0)


class GnssModel(Strict):
    """A make of receiver, and the corrections it gets.

    Attributes:
        quality: Of its fixes, as in NMEA GGA: 1 alone, 2 differential, 4 RTK, 5 RTK float.
        horizontal, vertical: Errors of position, per axis.
        correlation_s: Time after which slow errors have lost all but 1/e of their memory.
        velocity_m_s: Error of velocity, per axis.
    """

    quality: Literal[1, 2, 4, 5]
    horizontal: Spread
    vertical: Spread
    correlation_s: float = Field(gt=0)
    velocity_m_s: float = Field(ge=0)


class Gnss(Instrument):
    """A satellite receiver: where it is on the earth, and how fast; worse where the sky is hidden.

    Attributes:
        model: ``standalone``, ``ZED-F9P`` or ``RT3003``; a file of
            ``generator/sensors/navigation/gnss_presets``.
        origin_deg: Latitude and longitude of the world's origin; its X axis points east.
        origin_altitude_m: Of the world's origin, above the ellipsoid.
        satellites: Above the horizon; drawn anew for every sequence.
        mask_deg: Satellites lower than this are not used.
        noise: Factor on the model's errors; 0 = an ideal device.
    """

    kind: ClassVar[str] = "gnss"
    type: Literal["gnss"] = "gnss"
    name: str = Field("gnss", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    model: Annotated[str, AfterValidator(lambda name: check_preset(MAKES, name))] = "standalone"
    origin_deg: tuple[Annotated[float, Field(ge=-89, le=89)], Degrees] = (49.0114, 8.4244)
    origin_altitude_m: float = Field(115.0, ge=-1000, le=20_000)
    satellites: int = Field(12, ge=4, le=60)
    mask_deg: float = Field(10.0, ge=0, le=60)
    noise: float = Field(1.0, ge=0)

    @property
    def device_model(self) -> str:
        """What it is, for the labels."""
        return self.model

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """The fixes since the last step."""
        del channels
        times_s = reading_times(scene, self.rate_hz)
        shared = rng.of_sequence()
        sky = _constellation(self.satellites, math.radians(self.mask_deg), shared)
        ride = mount_motion(scene, self.name)
        seen = np.stack([_in_sight(scene, self.rig, ride, t, sky, renderer) for t in times_s])
        fixes = _fixes(sky, seen)
        make = load_preset(MAKES, self.model, GnssModel)
        rate_hz = self.rate_hz or 1.0 / scene.step_s
        slow = _slow(times_s, rate_hz, make.correlation_s, shared)
        columns = self._columns(make, ride, times_s, fixes, slow, rng)
        rows = table_rows("gnss", len(times_s), time_s=times_s, **columns)
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)

    def _columns(
        self,
        make: GnssModel,
        ride: MountMotion,
        times_s: Array,
        fixes: Fixes,
        slow: Array,
        rng: Rng,
    ) -> dict[str, Array]:
        """Positions and velocities with their errors; NaN without a fix."""
        across, up = make.horizontal, make.vertical
        growth = self.noise * np.stack([fixes.horizontal, fixes.horizontal, fixes.vertical], axis=1)
        white = np.array([across.white_m, across.white_m, up.white_m])
        slowly = np.array([across.slow_m, across.slow_m, up.slow_m])
        errors_m = growth * (white * rng.standard_normal(slow.shape) + slowly * slow)
        places_m = np.array([ride.pose(float(t)).translation_m for t in times_s])
        origin = GeodeticOrigin(*self.origin_deg, self.origin_altitude_m)
        there = np.round(to_geodetic(places_m + errors_m, origin), 10)
        speeds = np.array([ride.velocity_m_s(float(t)) for t in times_s])
        speeds += growth * make.velocity_m_s * rng.standard_normal(slow.shape)
        sigma_m = growth[:, 1:] * np.hypot(white, slowly)[1:]
        columns = {
            "latitude_deg": there[:, 0],
            "longitude_deg": there[:, 1],
            "altitude_m": np.round(there[:, 2], 6),
            "velocity_east_m_s": speeds[:, 0],
            "velocity_north_m_s": speeds[:, 1],
            "velocity_up_m_s": speeds[:, 2],
            "horizontal_sigma_m": sigma_m[:, 0],
            "vertical_sigma_m": sigma_m[:, 1],
        }
        columns = {name: np.where(fixes.good, v, np.nan) for name, v in columns.items()}
        quality = np.where(fixes.good, make.quality, 0)
        return {**columns, "satellites": fixes.satellites, "quality": quality}


@dataclass(frozen=True, eq=False, slots=True)
class Fixes:
    """What geometry allows at each reading, arrays [n].

    Attributes:
        satellites: In sight.
        good: Whether there is a fix.
        horizontal, vertical: Dilution of precision, in units of that under the open sky; 1 where
            there is no fix.
    """

    satellites: NDArray[np.intp]
    good: NDArray[np.bool_]
    horizontal: Array
    vertical: Array


def _constellation(count: int, mask_rad: float, rng: Rng) -> Array:
    """Directions towards satellites, even over the sky above the mask, [n, 3]."""
    up = rng.uniform(math.sin(mask_rad), 1.0, count)
    azimuth = rng.uniform(0.0, 2.0 * math.pi, count)
    level = np.sqrt(1.0 - up * up)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=1)


def _in_sight(
    scene: Scene, rig: str, ride: MountMotion, time_s: float, sky: Array, renderer: Renderer
) -> NDArray[np.bool_]:
    """Which satellites nothing hides, [satellites]."""
    place = SE3(ride.pose(time_s).translation_m)
    around = remove_carrier(scene_at(scene, float(time_s)), rig)
    beams = LidarRays(sky.astype(np.float32), 0.0, 1, SKY_M)
    echoes = renderer.scan(around, Lidar("antenna", "", T_world_lidar=place), beams)
    free: NDArray[np.bool_] = ~np.isfinite(echoes.range_m[:, 0])
    return free


def _fixes(sky: Array, seen: NDArray[np.bool_]) -> Fixes:
    """What the satellites in sight allow; ``seen`` is [n, satellites]."""
    open_sky = _dilution(sky)
    ratios, good = np.ones((len(seen), 2)), np.zeros(len(seen), np.bool_)
    for k, free in enumerate(seen):
        if free.sum() < NEEDED:
            continue
        found = _dilution(sky[free])
        good[k] = bool(np.all(found < DILUTION_MAX))
        if good[k]:
            ratios[k] = np.round(found / open_sky, 6)
    return Fixes(seen.sum(axis=1), good, ratios[:, 0], ratios[:, 1])


def _dilution(sky: Array) -> Array:
    """Horizontal and vertical dilution of precision of satellites in these directions, [2]."""
    design = np.column_stack([-sky, np.ones(len(sky))])
    normal = np.einsum("ni,nj->ij", design, design, optimize=False)
    if abs(float(np.linalg.det(normal))) < 1e-9:
        return np.full(2, np.inf)
    q = np.diag(np.linalg.inv(normal))
    dilution: Array = np.sqrt(np.array([q[0] + q[1], q[2]]))
    return dilution


def _slow(times_s: Array, rate_hz: float, correlation_s: float, shared: Rng) -> Array:
    """A Gauss-Markov process of deviation 1 at each reading, [n, 3].

    It is drawn from time 0 at every step, so that any instant can be made alone.
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
    slow: Array = values[np.rint(times_s * rate_hz).astype(int)]
    return slow
