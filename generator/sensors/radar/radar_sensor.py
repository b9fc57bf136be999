"""Radar: detections with range, angles, radial velocity and radar cross section (RCS).

Rays sample the illuminated surfaces, each for its solid angle. All echoes in one cell of range,
azimuth, elevation and velocity add up to one whose RCS fluctuates from reading to reading
(Swerling's first case): the signal in units of noise is exponential with mean ``1 + SNR``, and a
detection is a signal above ``-ln(p)`` for a probability ``p`` of false alarm, hence

    P(detection) = p^(1 / (1 + SNR)),    SNR ~ RCS / range^4

(Skolnik, "Introduction to Radar Systems", 3rd ed., chapter 2). Rain attenuates by ITU-R P.838-3;
fog is negligible at 77 GHz (ITU-R P.840). Multipath and velocity ambiguity are not modelled.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core.capture import Channel, LidarHits, LidarRays, Measurements
from gen_data.core.interfaces import Renderer
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Instance, Lidar, Scene
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.device_presets import check_preset, load_preset
from gen_data.sensors.mounting import Instrument, mount_motion, remove_carrier, velocity_at
from gen_data.sensors.radar.radar_detection import (
    TARGETS,
    Echo,
    Look,
    area_factor,
    cross_section_m2,
    find_peaks,
    interpolate_curve,
    make_cells,
    merge_echoes,
    silhouette_m2,
    strongest_members,
)

COLUMNS = (
    TIME,
    Column("range_m", "<f4", "distance from the radar"),
    Column("azimuth_rad", "<f4", "to the left of its axis"),
    Column("elevation_rad", "<f4", "above its axis; 0 where the device cannot tell"),
    Column("velocity_m_s", "<f4", "radial, relative to the radar; positive = receding"),
    Column("velocity_compensated_m_s", "<f4", "the same without the radar's own motion"),
    Column("rcs_dbsm", "<f4", "radar cross section as measured, fluctuation included"),
    Column("snr_db", "<f4", "signal over noise"),
    Column("instance_id", "<u2", "the strongest reflector; 0 = unlabelled or noise"),
    Column("category_id", "<u2", "of that instance; 0"),
    Column("origin", "|u1", "0 false alarm, 1 an instance, 2 ground and the like"),
)
PRESETS = "gen_data.sensors.radar.presets"
FALSE_ALARM = 1e-6
"""Probability that noise alone exceeds the threshold in one cell."""
THRESHOLD = -math.log(FALSE_ALARM)
HALF_SNR = THRESHOLD / math.log(2.0) - 1.0
"""Signal-to-noise ratio that is detected half of the time."""


class RadarModel(Strict):
    """Data sheet of a radar.

    Attributes:
        looks: Its scans.
        reference_dbsm: RCS of the reference target of ``reach_m``.
        least_dbsm: Weaker echoes are suppressed, as devices do to exclude the road.
        velocity_m_s: Highest approaching (negative) and receding speed.
        detections_max: Only this many of the strongest detections are reported.
        rain: k and alpha of the specific attenuation ``k R^alpha`` [dB/km], R in mm/h.
    """

    looks: tuple[Look, ...] = Field(min_length=1)
    reference_dbsm: float
    least_dbsm: float
    velocity_m_s: tuple[float, float]
    detections_max: int = Field(gt=0)
    rain: tuple[float, float]


class Radar(Instrument):
    """A radar: range, angles, radial velocity and radar cross section of detections.

    Attributes:
        model: ``ARS408-21`` or ``imaging``; a file of ``generator/sensors/radar/presets``.
        false_alarms: Mean number of false alarms per reading.
        noise: Factor on the model's errors; 0 = an ideal device: no errors, no fluctuation, no
            false alarms, and a fixed threshold where the probability of detection is one half.
    """

    kind: ClassVar[str] = "radar"
    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    view: ClassVar[str] = "gen_data.preview.sensor_views:radar_view"
    type: Literal["radar"] = "radar"
    name: str = Field("radar", pattern=NAME_PATTERN)
    model: Annotated[str, AfterValidator(lambda name: check_preset(PRESETS, name))] = "ARS408-21"
    false_alarms: float = Field(1.0, ge=0, le=1000)
    noise: float = Field(1.0, ge=0)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Measure the detections of one reading, nearest first."""
        del channels
        model = load_preset(PRESETS, self.model, RadarModel)
        scans = [self._scan(look, model, scene, renderer, rng) for look in model.looks]
        detections = scans[0].append(scans[1:])
        strongest = np.argsort(-detections.snr, kind="stable")[: model.detections_max]
        order = strongest[np.argsort(detections.range_m[strongest], kind="stable")]
        return self._make_rows(scene, detections.take(order))

    def _scan(
        self, look: Look, model: RadarModel, scene: Scene, renderer: Renderer, rng: Rng
    ) -> Echo:
        eye = scene.device(self.name).T_world_device
        rays = _make_rays(look, rng)
        beams = LidarRays(rays.directions.astype(np.float32), 0.0, 1, look.range_m[1])
        around = remove_carrier(scene, self.rig)
        hits = renderer.scan(around, Lidar(self.name, "", T_world_lidar=eye), beams)
        echoes = _ray_echoes(scene, self.name, rays, hits)
        cells = make_cells(echoes.take(echoes.range_m >= look.range_m[0]), look)
        gain = _gain(look, model, scene.weather.rain_mm_h, cells.echo)
        signal = gain * cells.echo.rcs_m2
        ideal = self.noise == 0.0
        draws = np.ones(len(signal)) if ideal else rng.standard_exponential(len(signal))
        signal = signal * draws
        echo = replace(cells.echo, rcs_m2=cells.echo.rcs_m2 * draws, snr=signal)
        peak = find_peaks(cells, signal)
        peaks = merge_echoes(echo, peak, signal)
        strong = peaks.rcs_m2 >= 10.0 ** (0.1 * model.least_dbsm)
        if ideal:
            return peaks.take(strong & (peaks.snr >= HALF_SNR))
        # Signal and noise of a single cell together are one exponential with mean 1 + SNR: the
        # noise, added once per peak, is the draw of its strongest cell.
        received = peaks.snr + draws[strongest_members(peak, signal)]
        found = replace(peaks, snr=received - 1.0).take(strong & (received > THRESHOLD))
        found = found.append([_draw_false_alarms(look, model, self.false_alarms, rng)])
        measured = _add_noise(found, look, self.noise, rng)
        gain = _gain(look, model, scene.weather.rain_mm_h, measured)
        return replace(measured, rcs_m2=measured.snr / gain)

    def _make_rows(self, scene: Scene, found: Echo) -> Measurements:
        """Rows of detections, with velocities also compensated for the radar's own motion."""
        motion = mount_motion(scene, self.name)
        own = motion.pose(scene.time_s).inverse().rotate(motion.velocity_m_s(scene.time_s))
        towards = _directions(found.azimuth_rad, found.elevation_rad)
        categories = {i.instance_id: i.category_id for i in scene.instances}
        rows = table_rows(
            COLUMNS,
            len(found.range_m),
            time_s=scene.time_s,
            range_m=found.range_m,
            azimuth_rad=found.azimuth_rad,
            elevation_rad=found.elevation_rad,
            velocity_m_s=found.velocity_m_s,
            velocity_compensated_m_s=found.velocity_m_s + towards @ own,
            rcs_dbsm=10.0 * np.log10(np.maximum(found.rcs_m2, 1e-12)),
            snr_db=10.0 * np.log10(np.maximum(found.snr, 1e-12)),
            instance_id=found.instance_id,
            category_id=[categories.get(int(k), 0) for k in found.instance_id],
            origin=found.origin,
        )
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)


@dataclass(frozen=True, eq=False, slots=True)
class Rays:
    """A grid of unit directions [n, 3] with their angles and solid angles [n], radar frame."""

    directions: Array
    azimuth_rad: Array
    elevation_rad: Array
    solid_angle_sr: Array


def _make_rays(look: Look, rng: Rng) -> Rays:
    """A grid over the field of view with a random offset, against aliasing."""
    across, upward = (math.radians(step) for step in look.spacing_deg)
    shift = rng.uniform(0.0, 1.0, 2)
    half = math.radians(look.azimuth_deg), math.radians(look.elevation_deg)
    azimuth = np.arange(-half[0] + shift[0] * across, half[0], across)
    elevation = np.arange(-half[1] + shift[1] * upward, half[1], upward)
    azimuth, elevation = (grid.ravel() for grid in np.meshgrid(azimuth, elevation))
    solid_angle = across * upward * np.cos(elevation)
    return Rays(_directions(azimuth, elevation), azimuth, elevation, solid_angle)


def _directions(azimuth_rad: Array, elevation_rad: Array) -> Array:
    """Unit vectors in the radar's frame, [n, 3]."""
    level = np.cos(elevation_rad)
    return np.stack(
        [level * np.cos(azimuth_rad), level * np.sin(azimuth_rad), np.sin(elevation_rad)], axis=1
    )


def _ray_echoes(scene: Scene, radar: str, rays: Rays, hits: LidarHits) -> Echo:
    (hit,) = np.nonzero(np.isfinite(hits.range_m[:, 0]))
    range_m = hits.range_m[hit, 0].astype(np.float64)
    ids = hits.instance_id[hit, 0].astype(np.int64)
    motion = mount_motion(scene, radar)
    eye = scene.device(radar).T_world_device
    towards = eye.rotate(rays.directions[hit])
    points_m = towards * range_m[:, None] + np.asarray(eye.translation_m)
    velocity = -np.broadcast_to(motion.velocity_m_s(scene.time_s), towards.shape)
    areas_m2 = rays.solid_angle_sr[hit] * range_m**2
    surfaces = hits.surface[hit, 0]
    rcs_m2 = areas_m2 * area_factor("", surfaces)
    for instance in scene.instances:
        (own,) = np.nonzero(ids == instance.instance_id)
        if len(own) == 0:
            continue
        levers_m = points_m[own] - np.asarray(instance.T_world_instance.translation_m)
        velocity[own] += velocity_at(instance.twist, levers_m)
        rcs_m2[own] = _instance_rcs_m2(instance, areas_m2[own], surfaces[own], -towards[own])
    return Echo(
        range_m,
        rays.azimuth_rad[hit],
        rays.elevation_rad[hit],
        np.einsum("ni,ni->n", velocity, towards, optimize=False),
        rcs_m2,
        np.zeros(len(hit)),
        ids,
        np.where(ids > 0, 1, 2),
    )


def _instance_rcs_m2(
    instance: Instance, areas_m2: Array, surfaces: NDArray[np.uint8], towards_radar: Array
) -> Array:
    """RCS of the rays on one instance, [n]; a target's RCS is divided by visible area."""
    target = TARGETS.get(instance.category)
    if target is None:
        return areas_m2 * area_factor(instance.category, surfaces)
    axis = towards_radar[len(towards_radar) // 2]
    whole_m2 = max(target.fill * silhouette_m2(instance, axis), float(areas_m2.sum()))
    return areas_m2 / whole_m2 * cross_section_m2(target, instance, axis)


def _gain(look: Look, model: RadarModel, rain_mm_h: float, echo: Echo) -> Array:
    """Signal-to-noise ratio per square metre of RCS, [n]."""
    reach_m = interpolate_curve(look.reach_m, echo.azimuth_rad)
    reference_m2 = 10.0 ** (0.1 * model.reference_dbsm)
    k, alpha = model.rain
    loss_db = 2.0 * echo.range_m / 1000.0 * (k * rain_mm_h**alpha if rain_mm_h > 0.0 else 0.0)
    nearer: Array = reach_m / np.maximum(echo.range_m, 0.1)
    return np.asarray(HALF_SNR / reference_m2 * nearer**4 * 10.0 ** (-0.1 * loss_db))


def _draw_false_alarms(look: Look, model: RadarModel, mean: float, rng: Rng) -> Echo:
    """Noise above the threshold, uniform over the field of view; ``mean`` is for all looks."""
    count = int(rng.poisson(mean / len(model.looks)))
    half = math.radians(look.azimuth_deg)
    upward = math.radians(look.elevation_deg) if look.resolution.elevation_deg else 0.0
    nothing = np.zeros(count, np.int64)
    return Echo(
        rng.uniform(*look.range_m, count),
        rng.uniform(-half, half, count),
        rng.uniform(-upward, upward, count),
        rng.uniform(*model.velocity_m_s, count),
        np.zeros(count),
        THRESHOLD + rng.standard_exponential(count) - 1.0,
        nothing,
        nothing,
    )


def _add_noise(echo: Echo, look: Look, factor: float, rng: Rng) -> Echo:
    draws = factor * rng.standard_normal((4, len(echo.range_m)))
    noise = look.noise
    spread = np.radians(interpolate_curve(noise.azimuth_deg, echo.azimuth_rad))
    return replace(
        echo,
        range_m=np.clip(echo.range_m + noise.range_m * draws[0], *look.range_m),
        azimuth_rad=echo.azimuth_rad + spread * draws[1],
        elevation_rad=echo.elevation_rad + math.radians(noise.elevation_deg) * draws[2],
        velocity_m_s=echo.velocity_m_s + noise.velocity_m_s * draws[3],
    )
