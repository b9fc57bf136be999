"""Radar cross sections (RCS) at 77 GHz: of road users by category, of all else by area.

Sources and values are in ``targets.yaml`` and ``surfaces.yaml``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.core.asset_types import SURFACES
from gen_data.generator.core.scene import Instance
from gen_data.generator.core.se3 import Array


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


TARGETS = load_table(__package__, "targets", Target)
"""By category."""
METAL = frozenset(
    {"barrier", "bollard", "fence", "street_light", "traffic_light", "traffic_sign", "pole"}
)
"""Categories made of sheet metal and posts."""

GAMMA_DB = load_table(__package__, "surfaces", float)
"""RCS per area that faces the radar, by surface."""

METAL_DB = 0.0


def cross_section_m2(target: Target, instance: Instance, towards_radar: Array) -> float:
    """Mean RCS [m^2] of a road user seen from a direction (unit, world)."""
    x, y, _ = instance.T_world_instance.inverse().rotate(towards_radar)
    level2 = float(x * x + y * y)
    # The cosine of four times the azimuth, without the angle.
    fourfold = 1.0 - 8.0 * float(x * x * y * y) / (level2 * level2) if level2 > 1e-12 else 0.0
    return float(10.0 ** (0.1 * (target.mean_dbsm + target.swing_db * fourfold)))


def silhouette_m2(instance: Instance, towards_radar: Array) -> float:
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
    table = np.array([GAMMA_DB[name] for name in SURFACES])
    factor: Array = 10.0 ** (0.1 * table[surface])
    return factor
