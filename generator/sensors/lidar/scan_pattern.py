"""Data sheets of laser scanners, and the directions of their pulses during a sweep.

Frame: X forward, Y left, Z up. A rotating scanner starts facing backwards and turns clockwise seen
from above, so that it faces ahead in the middle of its sweep.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gen_data.generator.config.base_model import Strict
from gen_data.generator.sensors.device_presets import load_preset

PRESETS = "gen_data.generator.sensors.lidar.presets"
Hertz = Annotated[float, Field(gt=0, le=10_000)]


class Block(Strict):
    """Lasers at equal steps of elevation, including first and last."""

    first: float = Field(ge=-90, le=90)
    last: float = Field(ge=-90, le=90)
    count: int = Field(ge=1, le=1024)


class Prisms(Strict):
    """Two rotating wedge prisms, one behind the other; each tilts the beam."""

    tilt_deg: tuple[float, float]
    rotation_hz: tuple[float, float]


class Sensitivity(Strict):
    """A device's sensitivity: the matte surface, square on, that it detects half of the time."""

    reflectance: float = Field(gt=0, le=1)
    range_m: float = Field(gt=0)


class LidarModel(Strict):
    """Data sheet of a laser scanner.

    Attributes:
        name: Its name in labels; empty = the name of its file.
        elevations_deg: Blocks of lasers, from the top; none for a rosette scanner.
        azimuth_offsets_deg: Offsets of the lasers to the left, repeated down the table.
        prisms: Prisms of a rosette scanner; none for a rotating one.
        rotation_hz: Sweeps per second.
        points_per_second: Pulses per second of all lasers together.
        range_m: Smallest and largest range.
        range_noise_m: Standard deviation of ranges.
        range_step_m: Quantisation of ranges; 0 = none.
        divergence_mrad: Full divergence angle of a beam.
        pulse_m: Returns of one pulse that are closer than this merge.
        wavelength_nm: Of the laser.
        seen: Sensitivity.
        white_intensity: Intensity in [0, 1] reported for a white matte surface; values above are
            for retro-reflectors.
    """

    name: str = ""
    elevations_deg: tuple[Block, ...] = ()
    azimuth_offsets_deg: tuple[float, ...] = ()
    prisms: Prisms | None = None
    rotation_hz: Hertz
    points_per_second: int = Field(ge=1, le=100_000_000)
    range_m: tuple[float, float]
    range_noise_m: float = Field(ge=0, le=1)
    range_step_m: float = Field(ge=0, le=1)
    divergence_mrad: float = Field(ge=0, le=100)
    pulse_m: float = Field(gt=0, le=10)
    wavelength_nm: float = Field(ge=400, le=2000)
    seen: Sensitivity
    white_intensity: float = Field(gt=0, le=1)

    @model_validator(mode="after")
    def _is_one_kind(self) -> LidarModel:
        if (self.prisms is None) == (not self.elevations_deg):
            raise ValueError("expected either elevations_deg or prisms")
        low, high = self.range_m
        if not 0 <= low < high:
            raise ValueError(f"range_m must rise from 0 or more, got [{low:g}, {high:g}]")
        return self

    def with_beams(self, beams: Sequence[tuple[float, float]]) -> LidarModel:
        """The same device with other lasers: (elevation, azimuth offset) [deg] in any order."""
        sorted_ = sorted(beams, key=lambda beam: -beam[0])
        blocks = tuple(Block(first=up, last=up, count=1) for up, _ in sorted_)
        offsets = tuple(left for _, left in sorted_)
        changed = {"elevations_deg": blocks, "azimuth_offsets_deg": offsets, "prisms": None}
        return self.model_copy(update=changed)

    def elevations_rad(self) -> NDArray[np.float64]:
        """Elevation of every laser, the highest first, [rings]; empty for a rosette scanner."""
        blocks = [np.linspace(b.first, b.last, b.count) for b in self.elevations_deg]
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
    """

    directions: NDArray[np.float32]
    ring: NDArray[np.uint16]
    time_s: NDArray[np.float32]
    order: NDArray[np.int32] | None = None


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
    columns = max(1, round(model.points_per_second / (model.rotation_hz * rings)))
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
    for field in fields:
        field.setflags(write=False)
    return Sweep(*fields)


def _tile_order(azimuth: NDArray[np.float64]) -> NDArray[np.int32]:
    """Indices of pulses with azimuths [columns, rings], tile by tile: nearby rays trace faster."""
    columns, rings = azimuth.shape
    column = np.floor((0.5 - azimuth / (2.0 * math.pi)) * columns).astype(np.int64) % columns
    ring = np.broadcast_to(np.arange(rings), azimuth.shape)
    keys = (column, ring, ring // TILE[1], column // TILE[0])
    return np.lexsort([key.reshape(-1) for key in keys]).astype(np.int32)


def _rosette(model: LidarModel, prisms: Prisms, start_s: float) -> Sweep:
    """One sweep of a rosette: the tilts of two rotating prisms add up (first order)."""
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
