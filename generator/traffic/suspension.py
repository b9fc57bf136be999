"""Bodies of vehicles on their suspension: they roll in bends, and pitch when speed changes.

Wheels turn with the body, since a vehicle is one mesh: on the ground they stay within 2 cm.
"""

import math

import numpy as np

from gen_data.core.se3 import Array

ROLL_PER_M_S2 = math.radians(4.0) / 9.81
"""3 to 7 degrees per g for passenger cars (Gillespie, Fundamentals of Vehicle Dynamics, 1992)."""
PITCH_M = math.radians(1.5) / 9.81 * 2.7
"""Rise of the front axle over the rear one [m] per m/s^2: 1.5 degrees per g at a wheelbase of 2.7 m
(assumed, 30 %)."""
_SETTLING = 5
"""Knots of 0.1 s over which accelerations are averaged: half a period at 1 to 1.5 Hz."""


def sway(
    speed_m_s: Array, acceleration_m_s2: Array, ahead: Array, step_s: float
) -> tuple[Array, Array]:
    """How bodies of cars move on their springs.

    Args:
        speed_m_s: Along their paths [t, n].
        acceleration_m_s2: Along their paths [t, n].
        ahead: Directions, unit [t, n, 2].
        step_s: Time between instants.

    Returns:
        Rises [m] of the front axles over the rear ones, positive when they speed up, and sines of
        the roll angles, positive to the right, as in bends to the left, both [t, n].
    """
    turned = np.zeros_like(speed_m_s)
    cross = ahead[:-1, :, 0] * ahead[1:, :, 1] - ahead[:-1, :, 1] * ahead[1:, :, 0]
    turned[1:], turned[0] = cross / step_s, cross[0] / step_s if len(cross) else 0.0
    sideways = speed_m_s * turned
    return PITCH_M * _settled(acceleration_m_s2), ROLL_PER_M_S2 * _settled(sideways)


def _settled(values: Array) -> Array:
    """Means [t, n] of the neighbouring instants of each one; ends go on."""
    half = _SETTLING // 2
    padded = np.concatenate([values[:1]] * half + [values] + [values[-1:]] * half)
    means: Array = np.mean([padded[k : k + len(values)] for k in range(_SETTLING)], axis=0)
    return means
