"""Radar detection: resolution cells of range, angle and velocity, and the peaks among them.

Echoes in one cell are not resolved. Cells are not independent: the response to a point is wider
than a cell, and detectors report local maxima only (Richards, "Fundamentals of Radar Signal
Processing", 2nd ed., 2014, chapter 6). Every cell is therefore assigned to its strongest neighbour,
that one to its own, and so on; all cells that end at the same peak form one detection with the sum
of their power, at its centroid.

Radar cross sections (RCS) at 77 GHz are given by category for road users, and by area for all else.
Sources and values are in ``targets.yaml`` and ``surfaces.yaml``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config import base_model, data_files
from gen_data.core import asset_types, scene
from gen_data.core.se3 import Array

Curve = tuple[tuple[float, float], ...]
"""Pairs of azimuth [deg] and value, linearly interpolated, symmetric about 0."""


class Fineness(base_model.Strict):
    """Resolutions or standard deviations of the four quantities; elevation 0 = not measured."""

    range_m: float = Field(gt=0)
    velocity_m_s: float = Field(gt=0)
    azimuth_deg: Curve = Field(min_length=1)
    elevation_deg: float = Field(0.0, ge=0)


class Look(base_model.Strict):
    """One of the scans that make up a reading.

    Attributes:
        azimuth_deg: Half of the horizontal field of view.
        elevation_deg: Half of the vertical field of view.
        range_m: Smallest and largest reported range.
        resolution: Sizes of cells.
        noise: Standard deviations.
        reach_m: Range at which the reference target is detected half of the time, by azimuth.
        spacing_deg: Between rays, horizontally and vertically.
    """

    azimuth_deg: float = Field(gt=0, le=90)
    elevation_deg: float = Field(gt=0, le=60)
    range_m: tuple[float, float]
    resolution: Fineness
    noise: Fineness
    reach_m: Curve = Field(min_length=1)
    spacing_deg: tuple[float, float]


@dataclass(frozen=True, eq=False, slots=True)
class Echo:
    """Echoes of rays, cells or detections; arrays [n]. ``origin`` as in the column of RADAR."""

    range_m: Array
    azimuth_rad: Array
    elevation_rad: Array
    velocity_m_s: Array
    rcs_m2: Array
    snr: Array
    instance_id: NDArray[np.int64]
    origin: NDArray[np.int64]

    def take(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> "Echo":
        """Select echoes by index or mask."""
        return replace(self, **{name: getattr(self, name)[which] for name in Echo.__slots__})

    def append(self, others: "Sequence[Echo]") -> "Echo":
        """Concatenate these echoes and others."""
        every = (self, *others)
        return replace(
            self,
            **{name: np.concatenate([getattr(e, name) for e in every]) for name in Echo.__slots__},
        )


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Echoes by cell; ``keys`` [n, 4] are indices of range, azimuth, elevation and velocity."""

    echo: Echo
    keys: NDArray[np.int64]


def make_cells(lit: Echo, look: Look) -> Cells:
    """Merge the echoes of rays by cell; labels are taken from the strongest ray."""
    fine = look.resolution
    upward = math.radians(fine.elevation_deg)
    bins = (
        lit.range_m / fine.range_m,
        _azimuth_bins(fine.azimuth_deg, lit.azimuth_rad),
        lit.elevation_rad / upward if upward else np.zeros_like(lit.range_m),
        lit.velocity_m_s / fine.velocity_m_s,
    )
    every = np.floor(np.stack(bins, axis=1)).astype(np.int64)
    keys, cell = np.unique(every, axis=0, return_inverse=True)
    merged = merge_echoes(lit, cell.reshape(-1), lit.rcs_m2)
    return Cells(merged if upward else replace(merged, elevation_rad=0.0 * merged.range_m), keys)


def find_peaks(cells: Cells, power: Array) -> NDArray[np.int64]:
    """Index of the peak that each cell belongs to, from 0, [n]; ``power`` is of each cell, [n]."""
    count = len(power)
    if count == 0:
        return np.zeros(0, np.int64)
    low = cells.keys.min(axis=0) - 1
    spans = cells.keys.max(axis=0) - low + 2
    strides = np.array([np.prod(spans[k + 1 :]) for k in range(4)], dtype=np.int64)
    codes = (cells.keys - low) @ strides  # in ascending order, as the keys are
    best, best_power = np.arange(count), power.copy()
    for offset in product((-1, 0, 1), repeat=4):
        wanted = codes + int(np.array(offset) @ strides)
        place = np.minimum(np.searchsorted(codes, wanted), count - 1)
        higher = (codes[place] == wanted) & (power[place] > best_power)
        best[higher], best_power[higher] = place[higher], power[place[higher]]
    while not np.array_equal(best[best], best):
        best = best[best]
    _, number = np.unique(best, return_inverse=True)
    return number.reshape(-1).astype(np.int64)


def merge_echoes(echo: Echo, group: NDArray[np.int64], power: Array) -> Echo:
    """Merge echoes by group: RCS and signal add up, the rest are power-weighted means.

    Labels are taken from the strongest echo.
    """
    count = int(group.max()) + 1 if len(group) else 0
    total = np.bincount(group, power, count)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(group, power * values, count) / total)

    strongest = strongest_members(group, power)
    return Echo(
        mean(echo.range_m),
        mean(echo.azimuth_rad),
        mean(echo.elevation_rad),
        mean(echo.velocity_m_s),
        np.bincount(group, echo.rcs_m2, count).astype(np.float64),
        np.bincount(group, echo.snr, count).astype(np.float64),
        echo.instance_id[strongest],
        echo.origin[strongest],
    )


def strongest_members(group: NDArray[np.int64], power: Array) -> NDArray[np.intp]:
    """Index of the strongest member of every group."""
    order = np.lexsort((-power, group))
    count = int(group.max()) + 1 if len(group) else 0
    return np.asarray(order[np.searchsorted(group[order], np.arange(count))])


def interpolate_curve(curve: Curve, azimuth_rad: Array) -> Array:
    """Values of a curve at azimuths, [n]."""
    at_deg, values = np.array(curve).T
    return np.asarray(np.interp(np.abs(np.degrees(azimuth_rad)), at_deg, values))


def _azimuth_bins(size_deg: Curve, azimuth_rad: Array) -> Array:
    """Azimuth in units of cells whose size depends on it: the integral of 1 / size."""
    azimuth_deg = np.linspace(0.0, 90.0, 901)
    per_deg = 1.0 / interpolate_curve(size_deg, np.radians(azimuth_deg))
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (per_deg[1:] + per_deg[:-1]) * 0.1)])
    bins = np.interp(np.abs(np.degrees(azimuth_rad)), azimuth_deg, sums)
    return np.asarray(np.copysign(bins, azimuth_rad))


@dataclass(frozen=True, slots=True)
class Target:
    """Radar cross section of a category of road users.

    Attributes:
        mean_dbsm: RCS, averaged over all aspect angles.
        swing_db: Excess square on to a side, and deficit across a corner.
        fill: Share of the box's silhouette that the object fills.
    """

    mean_dbsm: float
    swing_db: float
    fill: float


TARGETS = data_files.load_table(__package__, "targets", Target)
"""By category."""
METAL = frozenset(
    {"barrier", "bollard", "fence", "street_light", "traffic_light", "traffic_sign", "pole"}
)
"""Categories made of sheet metal and posts."""

GAMMA_DB = data_files.load_table(__package__, "surfaces", float)
"""RCS per area that faces the radar, by surface."""

METAL_DB = 0.0


def cross_section_m2(target: Target, instance: scene.Instance, towards_radar: Array) -> float:
    """Mean RCS [m^2] of a road user seen from a direction (unit, world)."""
    x, y, _ = instance.T_world_instance.inverse().rotate(towards_radar)
    level2 = float(x * x + y * y)
    # The cosine of four times the azimuth, without the angle.
    fourfold = 1.0 - 8.0 * float(x * x * y * y) / (level2 * level2) if level2 > 1e-12 else 0.0
    return float(10.0 ** (0.1 * (target.mean_dbsm + target.swing_db * fourfold)))


def silhouette_m2(instance: scene.Instance, towards_radar: Array) -> float:
    """Area [m^2] of a box's silhouette seen from a direction (unit, world)."""
    a, b, c = np.subtract(instance.box_max_m, instance.box_min_m)
    x, y, z = np.abs(instance.T_world_instance.inverse().rotate(towards_radar))
    return float(x * b * c + y * a * c + z * a * b)


def area_factor(category: str, surface: NDArray[np.uint8]) -> Array:
    """RCS per perpendicular area, for rays that hit one category (empty = unlabelled), [n].

    ``surface`` are numbers in ``SURFACES``, uint8 [n].
    """
    if category in METAL:
        return np.full(len(surface), 10.0 ** (0.1 * METAL_DB))
    table = np.array([GAMMA_DB[name] for name in asset_types.SURFACES])
    return np.asarray(10.0 ** (0.1 * table[surface]))
