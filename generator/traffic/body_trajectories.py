"""Trajectories of upright bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gen_data.generator.core.motion import Trajectory
from gen_data.generator.core.se3 import SE3, Array, Vec3
from gen_data.generator.traffic.simulation import KNOT_S

STILL_M = 0.002
"""Displacement up to which a body counts as static."""


def make_upright_trajectories(
    names: Sequence[str],
    ground_m: Array,
    ahead: Array,
    climb: Array,
    offsets_m: Sequence[Vec3],
) -> list[Trajectory | None]:
    """Make trajectories of bodies on the ground; None for bodies that never move.

    Args:
        names: Names of the bodies [n].
        ground_m: Points of support on the ground [t, n, 3].
        ahead: Horizontal directions, unit [t, n, 2].
        climb: Sines of the upward pitch angles [t, n].
        offsets_m: Origin of each body [n], in a frame at that point with X ahead and Z up.
    """
    quaternions = _quaternions(ahead, climb)
    level = np.sqrt(1.0 - climb * climb)[..., None]
    c, s = ahead[..., :1], ahead[..., 1:]
    rise = climb[..., None]
    x, y, z = np.asarray(offsets_m).reshape(-1, 3).T[:, None, :, None]
    origin = ground_m + np.concatenate(
        [
            x * c * level - y * s - z * c * rise,
            x * s * level + y * c - z * s * rise,
            x * rise + z * level,
        ],
        axis=2,
    )
    origin, quaternions = np.round(origin, 6) + 0.0, np.round(quaternions, 8) + 0.0
    tracks: list[Trajectory | None] = []
    for k, name in enumerate(names):
        moved = np.abs(origin[:, k] - origin[0, k]).max() > STILL_M
        knots = tuple(
            SE3((a, b, d), (e, f, g, h))
            for (a, b, d), (e, f, g, h) in zip(
                origin[:, k].tolist(), quaternions[:, k].tolist(), strict=True
            )
        )
        tracks.append(Trajectory(name, KNOT_S, knots) if moved else None)
    return tracks


def _quaternions(ahead: Array, climb: Array) -> Array:
    """Unit quaternions [..., 4] of a yaw, then a pitch upwards, without trigonometric functions."""
    c, s = ahead[..., 0], ahead[..., 1]
    w, z = _half_angle(c, s)
    up_w, up_y = _half_angle(np.sqrt(1.0 - climb * climb), -climb)
    return np.stack([w * up_w, -z * up_y, w * up_y, z * up_w], axis=-1)


def _half_angle(c: Array, s: Array) -> tuple[Array, Array]:
    """Cosine (not negative) and sine of half an angle."""
    # Divide by the larger of the two roots: the other one may vanish.
    cosine, sine = np.sqrt(np.maximum(0.5 + 0.5 * c, 0.0)), np.sqrt(np.maximum(0.5 - 0.5 * c, 0.0))
    forward = c >= 0.0
    half_c = np.where(forward, cosine, 0.5 * np.abs(s) / np.maximum(sine, 0.5))
    half_s = np.where(forward, 0.5 * s / np.maximum(cosine, 0.5), np.where(s < 0.0, -sine, sine))
    return half_c, half_s
