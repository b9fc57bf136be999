"""Suction: where a vacuum cup seals on a body, and the load that it carries.

A cup seals where its whole rim lies on the body: rays from points of the rim along the cup's axis
measure distance and slope of the surface below it. A gap anywhere lets air in. Mahler et al.,
Dex-Net 3.0 (2018), section IV, also require contact at every vertex of the rim.
"""

import math

import numpy as np

from gen_data.core.asset_types import SuctionCup
from gen_data.core.se3 import SE3, Array
from gen_data.physics.world import GRAVITY_M_S2, World

CONTACT_M = 0.0015
"""Largest distance between the rim and the surface below any of its points, which a soft lip of
that thickness bridges (assumed)."""
TILT_MAX_RAD = math.radians(5.0)
"""Largest angle between the cup's axis and the normal of the surface (assumed)."""
_RIM_POINTS = 12
_PROBE_M = 0.01
"""Rays begin this far behind the rim, to meet surfaces in front of it, too."""
_NORMAL = np.array([0.0, 0.0, 1.0])


def is_sealed(world: World, body: str, T_world_grasp: SE3, cup: SuctionCup) -> bool:
    """Whether a cup with this grasp frame is normal to a body and touches it all around its rim."""
    depths_m = rim_depths_m(world, body, T_world_grasp, cup)
    if not bool((np.abs(depths_m) <= CONTACT_M).all()):
        return False
    return _tilt_rad(depths_m, cup.radius_m) <= TILT_MAX_RAD


def rim_depths_m(world: World, body: str, T_world_grasp: SE3, cup: SuctionCup) -> Array:
    """Distances from points of the rim to the surface of a body [n]; inf = nothing below them."""
    origins = T_world_grasp.apply(_rim_m(cup.radius_m) - _PROBE_M * _NORMAL)
    return world.hits_m(body, origins, T_world_grasp.rotate(_NORMAL)) - _PROBE_M


def needed_force_n(mass_kg: float, acceleration_m_s2: Array) -> float:
    """Force that a cup needs to give a body an acceleration [3] in the world against gravity."""
    needed = np.asarray(acceleration_m_s2) + GRAVITY_M_S2 * _NORMAL
    return mass_kg * math.sqrt(float((needed * needed).sum()))


def _rim_m(radius_m: float) -> Array:
    """Points of the rim in the grasp frame, [n, 3]."""
    turns = 2.0 * np.pi * np.arange(_RIM_POINTS) / _RIM_POINTS
    return np.stack(
        [radius_m * np.cos(turns), radius_m * np.sin(turns), np.zeros(_RIM_POINTS)], axis=1
    )


def _tilt_rad(depths_m: Array, radius_m: float) -> float:
    """Angle between the axis and the normal of the plane that fits the depths best."""
    x, y, _ = (_rim_m(radius_m) / radius_m).T
    # On a circle the least-squares slopes are the first Fourier coefficients.
    slopes = 2.0 / len(depths_m) * np.array([(depths_m * x).sum(), (depths_m * y).sum()])
    return math.atan(math.hypot(*slopes.tolist()) / radius_m)
