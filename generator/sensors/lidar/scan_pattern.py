"""Data sheets of laser scanners, and the pulses of a sweep, from a scanner that may move.

Frame: X forward, Y left, Z up. A rotating scanner starts facing backwards and turns clockwise seen
from above; it faces ahead in the middle of its sweep. That is the scene's instant, as of
KITTI's, which then triggers the cameras (Geiger et al., "Vision meets Robotics", 2013).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gen_data.config.base_model import Strict
from gen_data.core import scene_time, se3
from gen_data.core.asset_types import Float32
from gen_data.core.scene import Lidar, Scene
from gen_data.sensors.device_presets import load_preset

PRESETS = "gen_data.sensors.lidar.presets"
Elevation = Annotated[float, Field(ge=-90, le=90)]
Hertz = Annotated[float, Field(gt=0, le=10_000)]


class Block(Strict):
    """Lasers at equal steps of elevation [deg], including first and last.

    Attributes:
        first: Elevation of the first laser [deg].
        last: Elevation of the last laser [deg].
        count: Number of lasers.
        heights_m: Where the beams of the first and the last laser cross the axis of rotation, above
            the origin of the scanner's frame; even steps between them.
    """

    first: float = Field(ge=-90, le=90)
    last: float = Field(ge=-90, le=90)
    count: int = Field(ge=1, le=1024)
    heights_m: tuple[float, float] = (0.0, 0.0)


class Prisms(Strict):
    """Two rotating wedge prisms, one behind the other; each tilts the beam.

    Attributes:
        tilt_deg: Tilt of the beam by each prism.
        rotation_hz: Rotations of each prism per second; negative = the other way.
    """

    tilt_deg: tuple[float, float]
    rotation_hz: tuple[float, float]


class Sensitivity(Strict):
    """A device's sensitivity: the matte surface, square on, that it detects half of the time.

    Attributes:
        reflectance: Reflectance of that surface.
        range_m: Distance of that surface.
    """

    reflectance: float = Field(gt=0, le=1)
    range_m: float = Field(gt=0)


class Response(Strict):
    """Intensity that a device reports, where it is not proportional to reflectance.

    The laser's power follows the strength of the previous return, which compresses intensities. A
    reflectance c up to white gives ``(white + dark) * c * (1 + half) / (c + half) - dark``, or 0 if
    that is negative (the curve of Naka and Rushton 1966). Range is compensated in part:
    ``c = reflectance * (1 + (range / near)^2)^-p``.

    Attributes:
        half: Reflectance c at which the uncompressed signal has risen to about half.
        dark: Signal below which 0 is reported.
        range_exponent: p; 0 = range is compensated.
        noise: Standard deviation of intensities.
        laser_spread: Relative standard deviation of the gain between lasers.
        step: Quantisation; 0 = none.
    """

    half: float = Field(gt=0, le=10)
    dark: float = Field(ge=0, le=1)
    range_exponent: float = Field(ge=0, le=2)
    noise: float = Field(ge=0, le=1)
    laser_spread: float = Field(ge=0, le=0.5)
    step: float = Field(ge=0, le=0.1)


class LidarModel(Strict):
    """Data sheet of a laser scanner.

    Attributes:
        name: Its name in labels; empty = the name of its file.
        elevations_deg: Elevation of every laser in any order, such as firing order, or blocks of
            lasers from the top; none for a rosette scanner. Rings are numbered from the top.
        azimuth_offsets_deg: Offsets of the lasers to the left, one for each in the order of
            elevations_deg; fewer are repeated down the table.
        lateral_offsets_m: Distances at which the beams pass the axis of rotation, to its left,
            listed alike.
        prisms: Prisms of a rosette scanner; none for a rotating one.
        rotation_hz: Sweeps per second.
        points_per_second: Pulses per second of all lasers together; or give azimuth_step_deg.
        azimuth_step_deg: Angle from one pulse of a laser to its next.
        range_m: Smallest and largest range.
        range_noise_m: Standard deviation of ranges.
        range_step_m: Quantisation of ranges; 0 = none.
        divergence_mrad: Full divergence angle of a beam.
        pulse_m: Returns of one pulse that are closer than this merge.
        wavelength_nm: Wavelength of the laser.
        seen: Sensitivity.
        seen_far: Sensitivity to a brighter surface, farther away; null = light falls as within
            ``seen``. The range of data sheets grows less than with the square root of reflectance:
            receivers that are aligned for near targets lose light from far ones.
        near_m: Range within which the receiver, focused at a distance, collects less: received
            light is proportional to ``1 / (range^2 + near_m^2)``. Not applied to the air.
        seen_air: Sensitivity to fog, drops and flakes; null = ``seen``.
        white_intensity: Intensity in [0, 1] reported for a white matte surface; values above are
            for retro-reflectors.
        response: Reported intensities; null = proportional to reflectance, without noise.
    """

    name: str = ""
    elevations_deg: tuple[Block | Elevation, ...] = ()
    azimuth_offsets_deg: tuple[float, ...] = ()
    lateral_offsets_m: tuple[float, ...] = ()
    prisms: Prisms | None = None
    rotation_hz: Hertz
    points_per_second: int | None = Field(None, ge=1, le=100_000_000)
    azimuth_step_deg: float | None = Field(None, ge=0.001, le=120)
    range_m: tuple[float, float]
    range_noise_m: float = Field(ge=0, le=1)
    range_step_m: float = Field(ge=0, le=1)
    divergence_mrad: float = Field(ge=0, le=100)
    pulse_m: float = Field(gt=0, le=10)
    wavelength_nm: float = Field(ge=400, le=2000)
    seen: Sensitivity
    seen_far: Sensitivity | None = None
    near_m: float = Field(0.0, ge=0, le=1000)
    seen_air: Sensitivity | None = None
    white_intensity: float = Field(gt=0, le=1)
    response: Response | None = None

    @model_validator(mode="after")
    def _is_one_kind(self) -> "LidarModel":
        if (self.prisms is None) == (not self.elevations_deg):
            raise ValueError("expected either elevations_deg or prisms")
        if (self.points_per_second is None) == (self.azimuth_step_deg is None):
            raise ValueError("expected either points_per_second or azimuth_step_deg")
        if self.prisms and self.azimuth_step_deg:
            raise ValueError(
                "a scanner with prisms has no azimuth_step_deg; give points_per_second"
            )
        if self.response and self.response.range_exponent > 0 and self.near_m == 0:
            raise ValueError("response.range_exponent needs near_m above 0")
        if self.seen_far and self.loss_per_m < 0:
            raise ValueError(
                "seen_far must be farther and brighter than seen, got more light there"
            )
        low, high = self.range_m
        if not 0 <= low < high:
            raise ValueError(f"range_m must rise from 0 or more, got [{low:g}, {high:g}]")
        return self

    @model_validator(mode="after")
    def _sorts_lasers(self) -> "LidarModel":
        """Sort lasers from the top, each with its own offsets."""
        given = self.elevations_deg
        count = sum(one.count if isinstance(one, Block) else 1 for one in given)
        order = list(range(count))
        if not any(isinstance(one, Block) for one in given):
            order.sort(key=lambda k: -cast(float, given[k]))
        is_sorted = order == list(range(count))
        for name in ("azimuth_offsets_deg", "lateral_offsets_m"):
            values = getattr(self, name)
            if not values or not count:
                continue
            if count % len(values) or (not is_sorted and len(values) not in (1, count)):
                more = "" if is_sorted else ", as they are not listed from the top"
                raise ValueError(
                    f"{name}: expected one number for each of {count} lasers{more}, or fewer that "
                    f"repeat evenly, got {len(values)}"
                )
            if len(values) == count:
                object.__setattr__(self, name, tuple(values[k] for k in order))
        if not is_sorted:
            object.__setattr__(self, "elevations_deg", tuple(given[k] for k in order))
        return self

    @property
    def loss_per_m(self) -> float:
        """Decay of received light with range, beyond the lidar equation's; 0 without ``seen_far``.

        It makes the equation (``lidar_detection.received_light``) hold at both sensitivities.
        """
        near, far = self.seen, self.seen_far
        if far is None:
            return 0.0
        if far.range_m <= near.range_m:
            return -math.inf
        near2 = self.near_m**2
        light = far.reflectance / near.reflectance
        light *= (near.range_m**2 + near2) / (far.range_m**2 + near2)
        return math.log(light) / (far.range_m - near.range_m)

    def with_beams(self, beams: Sequence[tuple[float, float]]) -> "LidarModel":
        """The same device with other lasers: (elevation, azimuth offset) [deg] in any order."""
        sorted_ = sorted(beams, key=lambda beam: -beam[0])
        blocks = tuple(up for up, _ in sorted_)
        offsets = tuple(left for _, left in sorted_)
        changed = {
            "elevations_deg": blocks,
            "azimuth_offsets_deg": offsets,
            "lateral_offsets_m": (),
            "prisms": None,
        }
        return self.model_copy(update=changed)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks of lasers, from the top; a single laser is a block by itself."""
        given = self.elevations_deg
        return tuple(
            one if isinstance(one, Block) else Block(first=one, last=one, count=1) for one in given
        )

    @property
    def columns(self) -> int:
        """Pulses of a laser in one turn."""
        if self.azimuth_step_deg is not None:
            return max(1, round(360.0 / self.azimuth_step_deg))
        assert self.points_per_second is not None, "a sheet has one of both"
        rings = sum(block.count for block in self.blocks)
        return max(1, round(self.points_per_second / (self.rotation_hz * rings)))

    def heights_m(self) -> NDArray[np.float64]:
        """Height of every laser above the frame's origin, [rings]; empty for a rosette scanner."""
        blocks = [np.linspace(*b.heights_m, b.count) for b in self.blocks]
        return np.asarray(np.concatenate([np.zeros(0), *blocks]), np.float64)

    def elevations_rad(self) -> NDArray[np.float64]:
        """Elevation of every laser, the highest first, [rings]; empty for a rosette scanner."""
        blocks = [np.linspace(b.first, b.last, b.count) for b in self.blocks]
        return np.asarray(np.radians(np.concatenate([np.zeros(0), *blocks])), np.float64)


def lidar_model(name: str) -> LidarModel:
    """The preset of that name; ConfigError if there is none."""
    model: LidarModel = load_preset(PRESETS, name, LidarModel)
    return model


@dataclass(frozen=True, eq=False, slots=True)
class Sweep:
    """The pulses of one sweep, in the order of firing.

    Attributes:
        directions: Unit vectors in the lidar frame, float32 [n, 3].
        ring: Row of the table, uint16 [n].
        time_s: From the start of the sweep, float32 [n].
        order: As in LidarRays.
        origins_m: Origins of the pulses in the lidar frame, float32 [n, 3]; None = its origin.
    """

    directions: NDArray[np.float32]
    ring: NDArray[np.uint16]
    time_s: NDArray[np.float32]
    order: NDArray[np.int32] | None = None
    origins_m: NDArray[np.float32] | None = None


TILE = (32, 4)
"""Columns and rings of a tile; the pulses of a tile are adjacent in a sweep's order."""


def make_sweep(model: LidarModel, start_s: float) -> Sweep:
    """One sweep of a scanner; ``start_s`` affects only rosettes, which never repeat."""
    return _rotation(model) if model.prisms is None else _rosette(model, model.prisms, start_s)


@lru_cache(maxsize=8)
def _rotation(model: LidarModel) -> Sweep:
    """One rotation; its arrays are cached and read-only."""
    elevation = model.elevations_rad()
    rings = len(elevation)
    columns = model.columns
    offset = np.zeros(rings)
    if model.azimuth_offsets_deg:
        offset = np.radians(np.resize(np.asarray(model.azimuth_offsets_deg), rings))
    phase = (np.arange(columns) + 0.5) / columns
    azimuth = math.pi * (1.0 - 2.0 * phase)[:, None] + offset
    level = np.cos(elevation)
    directions = np.stack(
        [
            np.cos(azimuth) * level,
            np.sin(azimuth) * level,
            np.broadcast_to(np.sin(elevation), azimuth.shape),
        ],
        axis=-1,
    )
    time_s = np.broadcast_to((phase / model.rotation_hz)[:, None], azimuth.shape)
    ring = np.broadcast_to(np.arange(rings), azimuth.shape)
    fields = (
        directions.reshape(-1, 3).astype(np.float32),
        ring.reshape(-1).astype(np.uint16),
        time_s.reshape(-1).astype(np.float32),
        _tile_order(azimuth),
    )
    origins_m = _laser_origins_m(model, azimuth)
    for field in fields if origins_m is None else (*fields, origins_m):
        field.setflags(write=False)
    return Sweep(*fields, origins_m)


def _laser_origins_m(model: LidarModel, azimuth: NDArray[np.float64]) -> Float32 | None:
    """Origins of pulses with azimuths [columns, rings], [n, 3]; None if all are the frame's."""
    height = np.broadcast_to(model.heights_m(), azimuth.shape)
    left = np.zeros(azimuth.shape)
    if model.lateral_offsets_m:
        left = left + np.resize(np.asarray(model.lateral_offsets_m), azimuth.shape[1])
    if not (height.any() or left.any()):
        return None
    origins = np.stack([-np.sin(azimuth) * left, np.cos(azimuth) * left, height], axis=-1)
    return origins.reshape(-1, 3).astype(np.float32)


def _tile_order(azimuth: NDArray[np.float64]) -> NDArray[np.int32]:
    """Indices of pulses with azimuths [columns, rings], tile by tile: nearby rays trace faster."""
    columns, rings = azimuth.shape
    column = np.floor((0.5 - azimuth / (2.0 * math.pi)) * columns).astype(np.int64) % columns
    ring = np.broadcast_to(np.arange(rings), azimuth.shape)
    keys = (column, ring, ring // TILE[1], column // TILE[0])
    return np.lexsort([key.reshape(-1) for key in keys]).astype(np.int32)


def _rosette(model: LidarModel, prisms: Prisms, start_s: float) -> Sweep:
    """One sweep of a rosette: the tilts of two rotating prisms add up (first order)."""
    assert model.points_per_second is not None, "it has no azimuth_step_deg"
    count = max(1, round(model.points_per_second / model.rotation_hz))
    time_s = np.arange(count) / model.points_per_second
    left, up = np.zeros(count), np.zeros(count)
    for tilt_deg, rotation_hz in zip(prisms.tilt_deg, prisms.rotation_hz, strict=True):
        angle = 2.0 * math.pi * rotation_hz * (start_s + time_s)
        left += math.radians(tilt_deg) * np.cos(angle)
        up += math.radians(tilt_deg) * np.sin(angle)
    away = np.hypot(left, up)
    lateral = np.sinc(away / math.pi)
    directions = np.stack([np.cos(away), left * lateral, up * lateral], axis=-1)
    return Sweep(
        directions.astype(np.float32), np.zeros(count, np.uint16), time_s.astype(np.float32)
    )


@dataclass(frozen=True, eq=False, slots=True)
class SweepPulses:
    """The pulses of a sweep in the lidar frame of the scene's instant.

    Attributes:
        directions: Unit vectors, float32 [n, 3].
        origins_m: Origins of the pulses, float32 [n, 3]; None = the frame's origin.
        time_s: Emission times relative to the scene's instant, float32 [n]; None = all 0.
    """

    directions: Float32
    origins_m: Float32 | None = None
    time_s: Float32 | None = None

    def points_m(self, rows: NDArray[np.intp], range_m: Float32) -> Float32:
        """Points [m] at ranges on pulses ``rows``, float32 [k, 3]."""
        # take() and operations in place take half the time of indexing and a sum.
        points: Float32 = self.directions.take(rows, axis=0)
        points *= range_m[:, None]
        if self.origins_m is not None:
            points += self.origins_m.take(rows, axis=0)
        return points


def fire_pulses(scene: Scene, lidar: Lidar, sweep: Sweep) -> SweepPulses:
    """The pulses of a sweep from a scanner that may move; the scene is at the sweep's middle.

    Directions in ``sweep`` are in the lidar frame of each pulse's own instant.
    """
    still = SweepPulses(sweep.directions, sweep.origins_m)
    if not scene.tracks:
        return still
    time_s = sweep.time_s - np.float32(0.5 * lidar.sweep_s)
    body, T_body_lidar = carrier(scene, lidar)
    track = scene.track(body) if body else None
    if track is None:
        return replace(still, time_s=time_s)
    # Lasers that fire together share an instant, and a pose.
    fresh = np.diff(time_s, prepend=np.float32(-np.inf)) != 0.0
    instants_s = scene.time_s + time_s[fresh].astype(np.float64)
    R_world_body, t_world_body = track.poses(np.append(instants_s, scene.time_s))
    R_body_lidar, t_body_lidar = T_body_lidar.rotation(), np.array(T_body_lidar.translation_m)
    R = np.einsum("nij,jk->nik", R_world_body, R_body_lidar, optimize=False)
    t = t_world_body + np.einsum("nij,j->ni", R_world_body, t_body_lidar, optimize=False)
    R_lidar_shot = np.einsum("ji,njk->nik", R[-1], R[:-1], optimize=False).astype(np.float32)
    t_lidar_shot = np.einsum("ji,nj->ni", R[-1], t[:-1] - t[-1], optimize=False)
    if np.abs(t_lidar_shot).max() < 1e-6 and np.abs(R_lidar_shot - R_lidar_shot[0]).max() < 1e-7:
        return replace(still, time_s=time_s)
    count = np.diff(np.append(np.flatnonzero(fresh), len(fresh)))
    origins_m = t_lidar_shot.astype(np.float32).repeat(count, axis=0)
    if sweep.origins_m is not None:
        origins_m += _rotate_runs(R_lidar_shot, sweep.origins_m, count)
    return SweepPulses(_rotate_runs(R_lidar_shot, sweep.directions, count), origins_m, time_s)


def _rotate_runs(R: Float32, vectors: Float32, count: NDArray[np.intp]) -> Float32:
    """Rotate vectors [n, 3]: rotation k of [m, 3, 3] applies to the next ``count[k]`` of them."""
    rotated = np.zeros_like(vectors)
    for i in range(3):
        # By coordinate: four times as fast as a sum over the short last axis.
        for j in range(3):
            rotated[:, i] += R[:, i, j].repeat(count) * vectors[:, j]
    return rotated


def carrier(scene: Scene, lidar: Lidar) -> tuple[str, se3.SE3]:
    """Name of the body that carries a scanner, and ``T_body_lidar``; empty name = none."""
    if lidar.rig:
        rig = scene.rig(lidar.rig)
        return rig.body, rig.T_body_rig @ lidar.T_rig_lidar
    camera = scene.camera(lidar.camera)
    if not camera.rig:
        return "", se3.SE3()
    rig = scene.rig(camera.rig)
    T_body_camera = rig.T_body_rig @ camera.T_rig_camera
    return rig.body, T_body_camera @ scene_time.RIG_AXES @ lidar.T_rig_lidar
