"""Path of a vehicle that follows a line: pure pursuit with a kinematic bicycle.

Coulter, "Implementation of the pure pursuit path tracking algorithm", CMU-RI-TR-92-01, 1992: the
rear axle moves on the circle that is tangent to its direction and passes through a point of the
line ahead. A kinematic bicycle's path does not depend on its speed, so it is computed once, by
distance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array


@dataclass(frozen=True, eq=False, slots=True)
class Courses:
    """Paths of the rear axles of n vehicles, at m even stations of their lines.

    Attributes:
        xy_m: Middles of the rear axles [n, m, 2].
        ahead: Directions [n, m, 2], unit.
        curvature_per_m: Curvatures of the paths [n, m], positive to the left.
    """

    xy_m: Array
    ahead: Array
    curvature_per_m: Array

    def poses(self, stations: Array) -> tuple[Array, Array]:
        """Interpolate rear axles [..., n, 2] and directions [..., n, 2] at stations [..., n].

        Args:
            stations: Stations in units of ``STATION_M`` from the start of each course.
        """
        last = self.xy_m.shape[1] - 2
        k = np.clip(stations.astype(np.int64), 0, last)
        f = np.clip(stations - k, 0.0, 1.0)[..., None]
        rows = np.arange(len(self.xy_m))
        a, b = self.xy_m[rows, k], self.xy_m[rows, k + 1]
        u, v = self.ahead[rows, k], self.ahead[rows, k + 1]
        chord = b - a
        span = np.sqrt(chord[..., :1] * chord[..., :1] + chord[..., 1:] * chord[..., 1:])
        g = 1.0 - f
        # Cubic Hermite interpolation: its ends have the axle's directions.
        xy = (1.0 + 2.0 * f) * g * g * a + f * f * (3.0 - 2.0 * f) * b
        xy = xy + span * (f * g * g * u + f * f * (f - 1.0) * v)
        return xy, normalize(g * u + f * v)


def follow_lines(
    lines_m: Array, xy_m: Array, ahead: Array, lookahead: NDArray[np.int64], sharpest_per_m: Array
) -> Courses:
    """Compute the paths of n vehicles along their lines.

    Args:
        lines_m: Points of the lines [n, m + l, 2], ``STATION_M`` apart, the first next to each
            vehicle's rear axle.
        xy_m: Start positions of the rear axles [n, 2].
        ahead: Start directions of the vehicles [n, 2], unit.
        lookahead: Lookahead in stations [n, m], at most l.
        sharpest_per_m: Largest curvatures that they can steer [n].
    """
    n, m = lookahead.shape
    tangents = normalize(np.gradient(lines_m, axis=1))
    rows = np.arange(n)
    xy, way, curvature = np.zeros((n, m, 2)), np.zeros((n, m, 2)), np.zeros((n, m))
    p, h = np.array(xy_m, dtype=np.float64), np.array(ahead, dtype=np.float64)
    for k in range(m):
        xy[:, k], way[:, k] = p, h
        to = lines_m[rows, k + lookahead[:, k]] - p
        across = h[:, 0] * to[:, 1] - h[:, 1] * to[:, 0]
        bend = 2.0 * across / np.maximum(to[:, 0] * to[:, 0] + to[:, 1] * to[:, 1], 0.25)
        bend = np.clip(bend, -sharpest_per_m, sharpest_per_m)
        curvature[:, k] = bend
        if k + 1 == m:
            break
        # Advance until the axle is next to the line's next station.
        t, ahead_of = tangents[:, k + 1], lines_m[:, k + 1] - p
        along = np.maximum(h[:, 0] * t[:, 0] + h[:, 1] * t[:, 1], 0.3)
        step = np.maximum((ahead_of[:, 0] * t[:, 0] + ahead_of[:, 1] * t[:, 1]) / along, 0.0)
        middle = rotate_small(h, 0.5 * bend * step)
        p = p + step[:, None] * middle
        h = rotate_small(middle, 0.5 * bend * step)
    return Courses(xy, way, curvature)


def rotate_small(vectors: Array, angle_rad: Array) -> Array:
    """Rotate vectors [n, 2] to the left by small angles [n], with ``tan(x / 2) = x / 2``."""
    q = 0.5 * angle_rad
    scale = 1.0 / (1.0 + q * q)
    c, s = (1.0 - q * q) * scale, 2.0 * q * scale
    x, y = vectors[:, 0], vectors[:, 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def normalize(vectors: Array) -> Array:
    """Scale vectors [..., 2] to length 1."""
    x, y = vectors[..., :1], vectors[..., 1:]
    scaled: Array = vectors / np.maximum(np.sqrt(x * x + y * y), 1e-12)
    return scaled
