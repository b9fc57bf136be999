"""Radar cross sections (RCS) at 77 GHz.

The mean RCS of road users depends on their category:

* **pedestrians** -8 dBsm (Yamada, Tanaka and Nishikawa, "Radar cross section for pedestrian in
  76 GHz band", EuMC 2005; within 2 dB in Fortuny-Guasch and Chareau, EUR 25762, 2013);
* **cars** 10 dBsm, 5 dB more square on to one of their sides and as much less across corners, as
  polar plots show (Matsunami et al., ICSPCS 2012; Silberling et al., DRI-TM-14-70-1, 2014);
* **bicycles** 0 dBsm with their rider (Belgiovane and Chen, "Bicycles and human riders
  backscattering at 77 GHz for automotive radar", EuCAP 2016);
* others are round figures between and beyond these, in order of size.

The RCS of everything else is proportional to its area: ``gamma * cos(t)`` per area of a patch whose
normal is at an angle ``t`` to the radar (Barton, "Radar System Analysis and Modeling", 2005, for
ground), which is ``gamma`` per area perpendicular to the ray. Values of gamma are round figures:
smooth road -28 dB, plants -14 dB (Ulaby and Dobson, "Handbook of Radar Scattering Statistics for
Terrain", 1989), masonry -8 dB, metal sheet and posts 0 dB.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


PERSON = Target(-8.0, 0.0, 0.5)
TARGETS = {
    "adult": PERSON,
    "animal": Target(-10.0, 0.0, 0.5),
    "bicycle": Target(-2.0, 3.0, 0.35),
    "bus": Target(20.0, 6.0, 0.95),
    "car": Target(10.0, 5.0, 0.85),
    "child": Target(-11.0, 0.0, 0.5),
    "cyclist": Target(0.0, 3.0, 0.45),
    "motorcycle": Target(3.0, 4.0, 0.5),
    "motorcyclist": Target(4.0, 4.0, 0.5),
    "pedestrian": PERSON,
    "person": PERSON,
    "trailer": Target(18.0, 6.0, 0.9),
    "tram": Target(25.0, 6.0, 0.95),
    "truck": Target(18.0, 6.0, 0.9),
    "van": Target(12.0, 5.0, 0.9),
}
"""By category."""

METAL = frozenset(
    {"barrier", "bollard", "fence", "street_light", "traffic_light", "traffic_sign", "pole"}
)
"""Categories made of sheet metal and posts."""

GAMMA_DB = {
    "": -10.0,
    "air": -99.0,
    "asphalt": -28.0,
    "marking": -28.0,
    "pavement": -26.0,
    "kerb": -12.0,
    "grass": -14.0,
    "leaf": -14.0,
    "bark": -12.0,
    "sign": 0.0,
    "plate": 0.0,
    "glass": -15.0,
    "window": -12.0,
    "facade": -8.0,
    "roof": -8.0,
    "paint": 0.0,
    "tyre": -15.0,
    "skin": -8.0,
    "lamp": -5.0,
    "mirrored": -99.0,
}
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
    """RCS per perpendicular area, for rays that hit one category, [n].

    Args:
        category: Of the object; empty = unlabelled.
        surface: Numbers in ``SURFACES``, uint8 [n].
    """
    if category in METAL:
        return np.full(len(surface), 10.0 ** (0.1 * METAL_DB))
    table = np.array([GAMMA_DB[name] for name in SURFACES])
    factor: Array = 10.0 ** (0.1 * table[surface])
    return factor
