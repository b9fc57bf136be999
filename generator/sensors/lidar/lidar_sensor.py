"""Laser scanner on a rig or next to a camera."""

import math
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, WithJsonSchema, field_validator, model_validator

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import asset_types, errors, interfaces
from gen_data.core.capture import POINT, Channel, LidarHits, LidarRays, PointCloud, SecondaryHits
from gen_data.core.scene import Lidar, Scene, Weather
from gen_data.core.streams import Rng
from gen_data.sensors import device_presets, mounting
from gen_data.sensors.lidar import (
    beam_edges,
    lidar_atmosphere,
    lidar_detection,
    point_origins,
    scan_pattern,
)
from gen_data.sensors.lidar.lidar_faults import LidarFaults
from gen_data.sensors.sensor_faults import check_most

SUBRAYS = 7
"""Rays that sample a beam with divergence."""

CLEAR = Weather()


Angle = Annotated[float, Field(ge=-180, le=180)]
Beam = tuple[scan_pattern.Elevation, Angle]

BEAMS_SCHEMA = {
    "anyOf": [
        {"type": "string", "pattern": r"\.csv$"},
        {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
    ]
}
"""A file name is replaced by the file's content before validation: see ``datasheets``."""


class LidarSensor(mounting.Mounted):
    """A laser scanner on a rig, or mounted next to a camera.

    Attributes:
        name: Its name in labels and files.
        model: A file of ``generator/sensors/lidar/presets``, or a data sheet of the same layout
            next to the configuration: ``./my_lidar.yaml``. A sheet with ``like: VLP-16`` has all
            values of that scanner except its own: ``elevations_deg: [-10, -5, 0, 5]``,
            ``rotation_hz``, ``range_m``; without a rate, pulses are as dense in azimuth.
        beams: Replaces the model's lasers: elevation and azimuth offset to the left of each
            [deg], or the name of a CSV file with the columns ``elevation_deg`` and
            ``azimuth_offset_deg``. The model's pulses per second remain.
        rotation_hz: Sweeps per second; null = the model's. The model's pulses per second remain.
        camera: Without a rig: name of a camera listed before it; the rig is then at the camera's
            centre, along its axis.
        returns: Return of a pulse to report; ``dual`` reports two.
        divergence: Whether beams diverge: ``true`` traces seven rays of every beam instead of one,
            ``edges`` seven of each beam next to a change of range, for a third of the cost.
        window: Transmittance of the scanner's window, one way, relative to a clean one; dust and
            grime lower it. Light passes it twice.
        ideal: No noise, no missed return, no weather, no mirror images, a clean window: every hit
            within range.
        motion_distortion: Effect of the scanner's motion during a sweep. ``raw``: points are in
            the lidar frame at each pulse's instant. ``deskewed``: in the frame at the sweep's
            middle, as in KITTI's files; moving objects are where each pulse hit them. ``none``:
            all pulses leave in the middle of the sweep.
        faults: Dead beams and blocked parts of the window; null = none.
        origins: Whether to write the origin of each point: its path (direct, through glass, by a
            mirror), and the true instance and position.
    """

    type: Literal["lidar"] = "lidar"
    name: str = Field("lidar", pattern=NAME_PATTERN)
    model: str | scan_pattern.LidarModel = "HDL-64E"
    beams: Annotated[tuple[Beam, ...], WithJsonSchema(BEAMS_SCHEMA)] = Field((), max_length=4096)
    rotation_hz: float | None = Field(None, gt=0, le=100)
    camera: str = "color"
    returns: lidar_detection.Kept = "strongest"
    divergence: bool | Literal["edges"] = False
    window: float = Field(1.0, gt=0, le=1)
    ideal: bool = False
    motion_distortion: Literal["raw", "deskewed", "none"] = "deskewed"
    faults: LidarFaults | None = None
    origins: bool = False

    @field_validator("model")
    @classmethod
    def _is_known(cls, model: str | scan_pattern.LidarModel) -> str | scan_pattern.LidarModel:
        known = device_presets.preset_names(scan_pattern.PRESETS)
        if isinstance(model, str) and model not in known:
            raise ValueError(
                f"expected one of {', '.join(known)}, or the name of a .yaml file"
                f"{errors.did_you_mean(model, known)}"
            )
        return model

    @model_validator(mode="after")
    def _has_the_beams(self) -> "LidarSensor":
        rings = len(self.device.elevations_rad()) if self.faults is not None else 0
        if self.faults is not None and rings:
            _, most = self.faults.dead_beams.support()
            check_most("faults.dead_beams", most, rings, "beams")
        return self

    @property
    def device(self) -> scan_pattern.LidarModel:
        """The data sheet, with the settings of this sensor."""
        model = scan_pattern.lidar_model(self.model) if isinstance(self.model, str) else self.model
        if self.rotation_hz is not None:
            model = model.model_copy(update={"rotation_hz": self.rotation_hz})
        return model.with_beams(self.beams) if self.beams else model

    def count_rays(self, size_px: tuple[int, int]) -> int:
        """Number of pulses of a sweep, whatever the size of its camera's image."""
        del size_px
        return len(scan_pattern.make_sweep(self.device, 0.0).ring)

    def describe(self) -> interfaces.SensorInfo:
        """Describe a laser scanner."""
        return self._info(
            self.name,
            interfaces.Modality.LIDAR,
            origins=self.origins,
            motion_distortion=self.motion_distortion,
        )

    def mount(self, scene: Scene) -> Scene:
        """Add this scanner to its rig, or to its camera.

        Raises:
            ConfigError: the scene has no such rig or camera.
        """
        name = self.model if isinstance(self.model, str) else self.model.name
        sweep_s = round(1.0 / self.device.rotation_hz, 9)
        lidar = Lidar(
            self.name,
            self.camera,
            self.T_rig_sensor,
            model=name,
            sweep_s=sweep_s,
            origins=self.origins,
        )
        return mounting.add_lidar(scene, self, lidar)

    def capture(
        self, scene: Scene, renderer: interfaces.Renderer, channels: frozenset[Channel], rng: Rng
    ) -> PointCloud:
        """Capture one sweep."""
        del channels
        model = self.device
        lidar = scene.lidar(self.name)
        sweep = scan_pattern.make_sweep(model, float(rng.uniform(0.0, 3600.0)))
        shots = still = scan_pattern.SweepPulses(sweep.directions, sweep.origins_m)
        if self.motion_distortion != "none":
            shots = scan_pattern.fire_pulses(scene, lidar, sweep)
        beams = LidarRays(
            shots.directions,
            1e-3 * model.divergence_mrad,
            SUBRAYS if self.divergence is True else 1,
            model.range_m[1],
            shots.origins_m,
            shots.time_s,
            sweep.order,
            self.origins,
        )
        pulses, detours = self._find_pulses(scene, lidar, renderer, beams)
        weather = CLEAR if self.ideal else scene.weather
        if weather != CLEAR:
            pulses = _apply_weather(pulses, weather, model, lidar, shots, rng)
        if self.window < 1.0 and not self.ideal:
            pulses = lidar_atmosphere.attenuate(pulses, np.float32(-math.log(self.window)))
        pulses = lidar_detection.clip_range(pulses, model)
        detected = pulses.light > 0.0 if self.ideal else lidar_detection.is_detected(pulses, rng)
        returns = Returns.select(
            pulses, *lidar_detection.select_returns(pulses, detected, self.returns)
        )
        origins = None
        if self.origins:
            ids, detour = point_origins.split_numbers(returns.instance_id)
            returns = replace(returns, instance_id=ids)
            straight_m = shots.points_m(returns.row, returns.range_m)
            origins = point_origins.make_origins(ids, detour, straight_m, detours, lidar)
        if self.ideal:
            intensity = lidar_detection.report_intensity(returns.reflectance, model)
        else:
            ring = sweep.ring.take(returns.row)
            light = returns.reflectance
            intensity = lidar_detection.measure_intensity(light, returns.range_m, ring, model, rng)
            returns = _add_range_noise(returns, model, weather, rng)
        frames = still if self.motion_distortion == "raw" else shots
        points = _make_points(returns, intensity, frames, sweep)
        cloud = PointCloud(self.name, lidar, points, scene.time_s, origins)
        if self.faults is None:
            return cloud
        return self.faults.apply(cloud, int(sweep.ring.max()) + 1, rng)

    def _find_pulses(
        self, scene: Scene, lidar: Lidar, renderer: interfaces.Renderer, beams: LidarRays
    ) -> tuple[lidar_detection.Pulses, SecondaryHits | None]:
        """Candidates of all beams, and the secondary hits that their ids number."""
        hits = self._trace(scene, lidar, renderer, beams)
        pulses = lidar_detection.make_pulses(hits, self.device, self.returns)
        which = np.zeros(0, np.intp)
        if self.divergence == "edges":
            which = beam_edges.find_edges(hits.range_m[:, 0], self.device)
        if not len(which):
            return pulses, hits.detours
        wide = beam_edges.choose_beams(beams, which, SUBRAYS)
        more = self._trace(scene, lidar, renderer, wide, hits.detours)
        finer = lidar_detection.make_pulses(more, self.device, self.returns)
        pulses = lidar_detection.replace_pulses(pulses, which, finer)
        return pulses, point_origins.join_detours(hits.detours, more.detours)

    def _trace(
        self,
        scene: Scene,
        lidar: Lidar,
        renderer: interfaces.Renderer,
        beams: LidarRays,
        before: SecondaryHits | None = None,
    ) -> LidarHits:
        """Hits of beams; numbered after those ``before`` if origins are wanted."""
        hits = renderer.scan(scene, lidar, beams)
        hits = _without_mirrored(hits) if self.ideal else hits
        return point_origins.number_detours(hits, before) if self.origins else hits


@dataclass(frozen=True, eq=False, slots=True)
class Returns:
    """Reported returns, arrays [n]; ``row`` is the number of their pulse."""

    row: NDArray[np.intp]
    range_m: lidar_detection.Float32
    reflectance: lidar_detection.Float32
    instance_id: lidar_detection.UInt16
    category_id: lidar_detection.UInt16
    surface: lidar_detection.UInt8

    @classmethod
    def select(
        cls, pulses: lidar_detection.Pulses, rows: NDArray[np.intp], picks: NDArray[np.intp]
    ) -> "Returns":
        """Select candidate ``picks[k]`` of pulse ``rows[k]``."""
        which = rows * pulses.light.shape[1] + picks
        return cls(
            rows, *(getattr(pulses, name).ravel().take(which) for name in lidar_detection.FIELDS)
        )


def _without_mirrored(hits: LidarHits) -> LidarHits:
    """The hits without those by way of a mirror, where nothing is at the place of the point."""
    if hits.detours is None:
        return hits
    real = hits.detours.surface != asset_types.SURFACES.index("mirrored")
    values = {field.name: getattr(hits.detours, field.name) for field in fields(SecondaryHits)}
    kept: dict[str, Any] = {name: v[real] for name, v in values.items() if v is not None}
    return replace(hits, detours=replace(hits.detours, **kept) if real.any() else None)


def _apply_weather(
    pulses: lidar_detection.Pulses,
    weather: Weather,
    model: scan_pattern.LidarModel,
    lidar: Lidar,
    shots: scan_pattern.SweepPulses,
    rng: Rng,
) -> lidar_detection.Pulses:
    height_m = lidar.T_world_lidar.translation_m[2]
    up = shots.directions @ lidar.T_world_lidar.rotation()[2].astype(np.float32)
    finite = np.where(np.isfinite(pulses.range_m), pulses.range_m, np.float32(model.range_m[1]))
    depth = lidar_atmosphere.optical_depth(weather, model, height_m, up[:, None], finite)
    return lidar_atmosphere.add_atmosphere(
        lidar_atmosphere.attenuate(pulses, depth), weather, model, height_m, rng
    )


def _add_range_noise(
    returns: Returns, model: scan_pattern.LidarModel, weather: Weather, rng: Rng
) -> Returns:
    spread_m = np.float32(model.range_noise_m) + lidar_atmosphere.rain_noise_m(
        weather.rain_mm_h, returns.range_m
    )
    noise = rng.standard_normal(len(returns.range_m), dtype=np.float32)
    range_m = np.clip(returns.range_m + spread_m * noise, *model.range_m)
    if model.range_step_m > 0.0:
        range_m = np.rint(range_m / model.range_step_m) * model.range_step_m
    return replace(returns, range_m=range_m.astype(np.float32))


def _make_points(
    returns: Returns,
    intensity: lidar_detection.Float32,
    shots: scan_pattern.SweepPulses,
    sweep: scan_pattern.Sweep,
) -> NDArray[np.void]:
    """Records of ``POINT`` [n]; returns of one pulse are adjacent, nearest first."""
    rows = returns.row
    points: NDArray[Any] = np.zeros(len(rows), POINT)
    points["position_m"] = shots.points_m(rows, returns.range_m)
    points["intensity"] = intensity
    points["time_s"] = sweep.time_s.take(rows)
    points["ring"] = sweep.ring.take(rows)
    points["return_number"] = points["return_count"] = 1
    for name in lidar_detection.LABELS:
        points[name] = getattr(returns, name)
    if (np.diff(rows) > 0).all():
        return points
    per_pulse = np.bincount(rows, minlength=len(sweep.ring))
    first = np.cumsum(per_pulse) - per_pulse
    points["return_number"] = np.arange(len(rows)) - first[rows] + 1
    points["return_count"] = per_pulse[rows]
    return points
