"""A radar: detections with range, angles, radial velocity and radar cross section.

Rays through the world find what is lit, each standing for its solid angle. What falls into one
cell of range, azimuth, elevation and velocity is one echo of the sum of its cross sections, which
fluctuates from reading to reading (Swerling's first case): the signal in units of noise is
exponential with mean ``1 + SNR``, a detection what exceeds ``-ln(p)`` for a probability ``p`` of
false alarm, so that

    P(detection) = p^(1 / (1 + SNR)),    SNR ~ RCS / range^4

(Skolnik, "Introduction to Radar Systems", 3rd ed., chapter 2). Rain dims by ITU-R P.838-3; fog does
next to nothing at 77 GHz (ITU-R P.840). There is no multipath and no ambiguity of velocity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.capture import Channel, LidarHits, LidarRays, Measurements
from gen_data.generator.core.interfaces import Renderer
from gen_data.generator.core.measurement_dtypes import table_rows
from gen_data.generator.core.scene import Instance, Lidar, Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.device_presets import check_preset, load_preset
from gen_data.generator.sensors.mount_kinematics import mount_motion, remove_carrier, velocity_at
from gen_data.generator.sensors.mounting import Instrument
from gen_data.generator.sensors.radar.cross_section import (
    TARGETS,
    area_factor,
    cross_section_m2,
    silhouette_m2,
)
from gen_data.generator.sensors.radar.radar_detection import (
    Echo,
    Look,
    along,
    find_peaks,
    make_cells,
    merge_echoes,
)

MAKES = "gen_data.generator.sensors.radar.presets"
FALSE_ALARM = 1e-6
"""Probability that noise alone exceeds the threshold in one cell."""
THRESHOLD = -math.log(FALSE_ALARM)
HALF_SNR = THRESHOLD / math.log(2.0) - 1.0
"""Signal over noise of what is detected half of the time."""


class RadarModel(Strict):
    """A make of radar.

    Attributes:
        looks: Its scans.
        reference_dbsm: Radar cross section of the target that ``reach_m`` is about.
        least_dbsm: Weaker echoes are held back, as devices do to keep the road out.
        velocity_m_s: Fastest approaching (negative) and receding.
        detections_max: The strongest of a reading are kept.
        rain: k and alpha of the specific attenuation ``k R^alpha`` [dB/km], R in mm/h.
    """

    looks: tuple[Look, ...] = Field(min_length=1)
    reference_dbsm: float
    least_dbsm: float
    velocity_m_s: tuple[float, float]
    detections_max: int = Field(gt=0)
    rain: tuple[float, float]


class Radar(Instrument):
    """A radar: range, angles, radial velocity and radar cross section of what it detects.

    Attributes:
        model: ``ARS408-21`` or ``imaging``; a file of ``generator/sensors/radar/presets``.
        false_alarms: Mean number of detections of nothing, per reading.
        noise: Factor on the model's errors; 0 = an ideal device: no errors, no fluctuation, no
            false alarms, and whatever is detected half of the time is detected always.
    """

    kind: ClassVar[str] = "radar"
    type: Literal["radar"] = "radar"
    name: str = Field("radar", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    model: Annotated[str, AfterValidator(lambda name: check_preset(MAKES, name))] = "ARS408-21"
    false_alarms: float = Field(1.0, ge=0, le=1000)
    noise: float = Field(1.0, ge=0)

    @property
    def device_model(self) -> str:
        """What it is, for the labels."""
        return self.model

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """The detections of one reading, nearest first."""
        del channels
        make = load_preset(MAKES, self.model, RadarModel)
        found = [self._looked(look, make, scene, renderer, rng) for look in make.looks]
        joined = found[0].and_more(found[1:])
        strongest = np.argsort(-joined.snr, kind="stable")[: make.detections_max]
        order = strongest[np.argsort(joined.range_m[strongest], kind="stable")]
        return self._table(scene, joined.taken(order))

    def _looked(
        self, look: Look, make: RadarModel, scene: Scene, renderer: Renderer, rng: Rng
    ) -> Echo:
        """What one scan detects, as measured."""
        eye = scene.device(self.name).T_world_device
        rays = _rays(look, rng)
        beams = LidarRays(rays.directions.astype(np.float32), 0.0, 1, look.range_m[1])
        around = remove_carrier(scene, self.rig)
        echoes = renderer.scan(around, Lidar(self.name, "", T_world_lidar=eye), beams)
        lit = _lit(scene, self.name, rays, echoes)
        cells = make_cells(lit.taken(lit.range_m >= look.range_m[0]), look)
        gain = _gain(look, make, scene.weather.rain_mm_h, cells.echo)
        signal = gain * cells.echo.rcs_m2
        ideal = self.noise == 0.0
        draws = np.ones(len(signal)) if ideal else rng.standard_exponential(len(signal))
        signal = signal * draws
        echo = replace(cells.echo, rcs_m2=cells.echo.rcs_m2 * draws, snr=signal)
        peak = find_peaks(cells, signal)
        found = merge_echoes(echo, peak, signal)
        strong = found.rcs_m2 >= 10.0 ** (0.1 * make.least_dbsm)
        if ideal:
            return found.taken(strong & (found.snr >= HALF_SNR))
        # Noise is added once, and together with the signal of a single cell it is one exponential.
        heard = found.snr + draws[_firsts(peak, signal)]
        found = replace(found, snr=heard - 1.0).taken(strong & (heard > THRESHOLD))
        found = found.and_more([_false_alarms(look, make, self.false_alarms, rng)])
        measured = _noisy(found, look, self.noise, rng)
        gain = _gain(look, make, scene.weather.rain_mm_h, measured)
        return replace(measured, rcs_m2=measured.snr / gain)

    def _table(self, scene: Scene, found: Echo) -> Measurements:
        """Rows of detections, with the radar's own motion taken out of the velocity."""
        ride = mount_motion(scene, self.name)
        own = ride.pose(scene.time_s).inverse().rotate(ride.velocity_m_s(scene.time_s))
        towards = _directions(found.azimuth_rad, found.elevation_rad)
        categories = {i.instance_id: i.category_id for i in scene.instances}
        rows = table_rows(
            "radar",
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
    """A grid of directions, and the solid angle that each stands for; [n, 3] and [n]."""

    directions: Array
    azimuth_rad: Array
    elevation_rad: Array
    solid_angle_sr: Array


def _rays(look: Look, rng: Rng) -> Rays:
    """A grid over the field of view, shifted anew at every reading within its spacing."""
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


def _lit(scene: Scene, radar: str, rays: Rays, echoes: LidarHits) -> Echo:
    """What every ray that hits something sends back, before anything is measured."""
    (hit,) = np.nonzero(np.isfinite(echoes.range_m[:, 0]))
    range_m = echoes.range_m[hit, 0].astype(np.float64)
    ids = echoes.instance_id[hit, 0].astype(np.int64)
    ride = mount_motion(scene, radar)
    eye = scene.device(radar).T_world_device
    towards = eye.rotate(rays.directions[hit])
    places_m = towards * range_m[:, None] + np.asarray(eye.translation_m)
    velocity = -np.broadcast_to(ride.velocity_m_s(scene.time_s), towards.shape)
    areas_m2 = rays.solid_angle_sr[hit] * range_m**2
    surfaces = echoes.surface[hit, 0]
    rcs_m2 = areas_m2 * area_factor("", surfaces)
    for thing in scene.instances:
        (mine,) = np.nonzero(ids == thing.instance_id)
        if len(mine) == 0:
            continue
        levers_m = places_m[mine] - np.asarray(thing.T_world_instance.translation_m)
        velocity[mine] += velocity_at(thing.twist, levers_m)
        rcs_m2[mine] = _of_thing(thing, areas_m2[mine], surfaces[mine], -towards[mine])
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


def _of_thing(
    thing: Instance, areas_m2: Array, surfaces: NDArray[np.uint8], towards_radar: Array
) -> Array:
    """Cross sections of the rays on one thing; a target's own is shared by the area in sight."""
    target = TARGETS.get(thing.category)
    if target is None:
        return areas_m2 * area_factor(thing.category, surfaces)
    axis = towards_radar[len(towards_radar) // 2]
    whole_m2 = max(target.fill * silhouette_m2(thing, axis), float(areas_m2.sum()))
    return areas_m2 / whole_m2 * cross_section_m2(target, thing, axis)


def _firsts(group: NDArray[np.int64], power: Array) -> NDArray[np.intp]:
    """The strongest member of every group."""
    order = np.lexsort((-power, group))
    count = int(group.max()) + 1 if len(group) else 0
    firsts: NDArray[np.intp] = order[np.searchsorted(group[order], np.arange(count))]
    return firsts


def _gain(look: Look, make: RadarModel, rain_mm_h: float, echo: Echo) -> Array:
    """Signal over noise per square metre of cross section, [n]."""
    reach_m = along(look.reach_m, echo.azimuth_rad)
    reference_m2 = 10.0 ** (0.1 * make.reference_dbsm)
    k, alpha = make.rain
    loss_db = 2.0 * echo.range_m / 1000.0 * (k * rain_mm_h**alpha if rain_mm_h > 0.0 else 0.0)
    nearer: Array = reach_m / np.maximum(echo.range_m, 0.1)
    gain: Array = HALF_SNR / reference_m2 * nearer**4 * 10.0 ** (-0.1 * loss_db)
    return gain


def _false_alarms(look: Look, make: RadarModel, mean: float, rng: Rng) -> Echo:
    """Noise that exceeds the threshold, anywhere in the field of view; each look has its share."""
    count = int(rng.poisson(mean / len(make.looks)))
    half = math.radians(look.azimuth_deg)
    upward = math.radians(look.elevation_deg) if look.resolution.elevation_deg else 0.0
    nothing = np.zeros(count, np.int64)
    return Echo(
        rng.uniform(*look.range_m, count),
        rng.uniform(-half, half, count),
        rng.uniform(-upward, upward, count),
        rng.uniform(*make.velocity_m_s, count),
        np.zeros(count),
        THRESHOLD + rng.standard_exponential(count) - 1.0,
        nothing,
        nothing,
    )


def _noisy(echo: Echo, look: Look, factor: float, rng: Rng) -> Echo:
    """Detections with the errors of measurement."""
    draws = factor * rng.standard_normal((4, len(echo.range_m)))
    noise = look.noise
    spread = np.radians(along(noise.azimuth_deg, echo.azimuth_rad))
    return replace(
        echo,
        range_m=np.clip(echo.range_m + noise.range_m * draws[0], *look.range_m),
        azimuth_rad=echo.azimuth_rad + spread * draws[1],
        elevation_rad=echo.elevation_rad + math.radians(noise.elevation_deg) * draws[2],
        velocity_m_s=echo.velocity_m_s + noise.velocity_m_s * draws[3],
    )
