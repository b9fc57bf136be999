"""What a laser scanner is, and where it sends its pulses during one sweep.

Frame: X forward, Y left, Z up. A turning scanner starts behind itself and turns clockwise seen from
above, so that it looks ahead in the middle of its sweep.
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

Hertz = Annotated[float, Field(gt=0, le=10_000)]


class Block(Strict):
    """Lasers at even steps of elevation, first and last included."""

    first: float = Field(ge=-90, le=90)
    last: float = Field(ge=-90, le=90)
    count: int = Field(ge=1, le=1024)


class Prisms(Strict):
    """Two wedge prisms that turn one behind the other; each tilts the beam."""

    tilt_deg: tuple[float, float]
    rotation_hz: tuple[float, float]


class Sensitivity(Strict):
    """A matte surface, square on, that answers half of the time: how sensitive a scanner is."""

    reflectance: float = Field(gt=0, le=1)
    range_m: float = Field(gt=0)


class LidarModel(Strict):
    """A laser scanner's data sheet.

    Attributes:
        name: What labels call it; empty = the file it is in.
        elevations_deg: Blocks of lasers, from the top; none for a rosette.
        azimuth_offsets_deg: Of the lasers to the left, repeated down the table.
        prisms: What draws a rosette; none for a scanner that turns.
        rotation_hz: Sweeps per second.
        points_per_second: Pulses, all lasers together.
        range_m: Least and largest range.
        range_noise_m: Standard deviation.
        range_step_m: Ranges are whole multiples of it; 0 = any.
        divergence_mrad: Full angle of a beam.
        pulse_m: Returns of one pulse that are closer than this run into one.
        wavelength_nm: Of the light.
        seen: How sensitive it is.
        white_intensity: Reported for a white matte surface, of 1; above it are retro-reflectors.
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
        """The same device with other lasers: (elevation, azimuth offset) in degrees, any order."""
        sorted_ = sorted(beams, key=lambda beam: -beam[0])
        blocks = tuple(Block(first=up, last=up, count=1) for up, _ in sorted_)
        offsets = tuple(left for _, left in sorted_)
        changed = {"elevations_deg": blocks, "azimuth_offsets_deg": offsets, "prisms": None}
        return self.model_copy(update=changed)

    def elevations_rad(self) -> NDArray[np.float64]:
        """Elevation of every laser, the highest first [rings]; empty for a rosette."""
        blocks = [np.linspace(b.first, b.last, b.count) for b in self.elevations_deg]
        return np.asarray(np.radians(np.concatenate([np.zeros(0), *blocks])), np.float64)


@dataclass(frozen=True, eq=False, slots=True)
class Sweep:
    """The pulses of one sweep, in the order of firing.

    Attributes:
        directions: Unit vectors in the lidar frame, float32 [n, 3].
        ring: Row of the table, uint16 [n].
        time_s: From the start of the sweep, float32 [n].
        order: As of Beams.
    """

    directions: NDArray[np.float32]
    ring: NDArray[np.uint16]
    time_s: NDArray[np.float32]
    order: NDArray[np.int32] | None = None


TILE = (32, 4)
"""Columns and rings whose pulses are neighbours in a sweep's order."""


def make_sweep(model: LidarModel, start_s: float) -> Sweep:
    """One sweep of a scanner.

    Args:
        model: What it is.
        start_s: When it starts; matters to rosettes only, which never repeat.
    """
    return _turn(model) if model.prisms is None else _rosette(model, model.prisms, start_s)


@lru_cache(maxsize=8)
def _turn(model: LidarModel) -> Sweep:
    """The same at every turn, and therefore not to be written to."""
    elevation = model.elevations_rad()
    rings = len(elevation)
    columns = max(1, round(model.points_per_second / (model.rotation_hz * rings)))
    offset = np.zeros(rings)
    if model.azimuth_offsets_deg:
        offset = np.radians(np.resize(np.asarray(model.azimuth_offsets_deg), rings))
    turned = (np.arange(columns) + 0.5) / columns
    azimuth = math.pi * (1.0 - 2.0 * turned)[:, None] + offset
    level = np.cos(elevation)
    directions = np.stack(
        [
            np.cos(azimuth) * level,
            np.sin(azimuth) * level,
            np.broadcast_to(np.sin(elevation), azimuth.shape),
        ],
        axis=-1,
    )
    time_s = np.broadcast_to((turned / model.rotation_hz)[:, None], azimuth.shape)
    ring = np.broadcast_to(np.arange(rings), azimuth.shape)
    fields = (
        directions.reshape(-1, 3).astype(np.float32),
        ring.reshape(-1).astype(np.uint16),
        time_s.reshape(-1).astype(np.float32),
        _tiled(azimuth),
    )
    for field in fields:
        field.setflags(write=False)
    return Sweep(*fields)


def _tiled(azimuth: NDArray[np.float64]) -> NDArray[np.int32]:
    """Pulses of azimuths [columns, rings] tile by tile."""
    columns, rings = azimuth.shape
    column = np.floor((0.5 - azimuth / (2.0 * math.pi)) * columns).astype(np.int64) % columns
    ring = np.broadcast_to(np.arange(rings), azimuth.shape)
    keys = (column, ring, ring // TILE[1], column // TILE[0])
    return np.lexsort([key.reshape(-1) for key in keys]).astype(np.int32)


def _rosette(model: LidarModel, prisms: Prisms, start_s: float) -> Sweep:
    """Tilts of two turning prisms add up (small wedges, first order)."""
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
