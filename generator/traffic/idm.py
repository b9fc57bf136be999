"""The Intelligent Driver Model.

Treiber, Hennecke, Helbing, "Congested traffic states in empirical observations and microscopic
simulations", Physical Review E 62(2), 2000.
"""

from dataclasses import dataclass

import numpy as np

from gen_data.core.se3 import Array

HARDEST_M_S2 = 8.0
"""Largest deceleration: the limit of tyres on a dry road."""


@dataclass(frozen=True, eq=False, slots=True)
class Drivers:
    """Parameters of n drivers; arrays [n].

    Attributes:
        headway_s: Desired time gap to the vehicle ahead.
        standstill_m: Gap at a standstill.
        acceleration_m_s2: Largest acceleration.
        braking_m_s2: Comfortable deceleration.
    """

    headway_s: Array
    standstill_m: Array
    acceleration_m_s2: Array
    braking_m_s2: Array


def free_acceleration(drivers: Drivers, speed_m_s: Array, wanted_m_s: Array) -> Array:
    """Acceleration [n] on a free road: ``a (1 - (v / v0)^4)``."""
    ratio = speed_m_s / np.maximum(wanted_m_s, 0.1)
    squared = ratio * ratio
    free: Array = drivers.acceleration_m_s2 * (1.0 - squared * squared)
    return free


def interaction(drivers: Drivers, speed_m_s: Array, gap_m: Array, leader_m_s: Array) -> Array:
    """Deceleration due to the leader [n]: ``a (s* / s)^2``.

    Args:
        drivers: Parameters of the drivers.
        speed_m_s: Own speeds [n].
        gap_m: Gaps to the leaders [n]; ``inf`` = none.
        leader_m_s: Speeds of the leaders [n].
    """
    scale = 2.0 * np.sqrt(drivers.acceleration_m_s2 * drivers.braking_m_s2)
    closing = speed_m_s * (speed_m_s - leader_m_s) / scale
    wanted = drivers.standstill_m + np.maximum(0.0, speed_m_s * drivers.headway_s + closing)
    ratio = wanted / np.maximum(gap_m, 0.05)
    taken: Array = drivers.acceleration_m_s2 * ratio * ratio
    return taken


def equilibrium_speed(drivers: Drivers, gap_m: Array, wanted_m_s: Array) -> Array:
    """Upper bound of the speeds [n] that suit a gap behind a leader of equal speed.

    The equilibrium gap is ``(s0 + v T) / sqrt(1 - (v / v0)^4)``; dropping the root
    gives an upper bound of the speed, which the wanted speed bounds as well.
    """
    room = np.maximum(gap_m - drivers.standstill_m, 0.0) / drivers.headway_s
    speeds: Array = np.minimum(room, wanted_m_s)
    return speeds
