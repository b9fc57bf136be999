"""Reference lines: plane curves by arc length, the five kinds of ASAM OpenDRIVE 1.4, 5.3.2-5.3.6.

A curve starts at its own origin along +X; poses are rows ``(x, y, heading)`` in metres and radians.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Curve(Protocol):
    """A piece of a reference line."""

    @property
    def length_m(self) -> float:
        """Its arc length."""
        ...

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n] from its start, in its own frame."""
        ...


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line."""

    length_m: float

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n]."""
        poses = np.zeros((len(s_m), 3))
        poses[:, 0] = s_m
        return poses


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc of constant curvature, positive to the left; 0 = straight."""

    length_m: float
    curvature_per_m: float

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n]; exact, and stable for any small curvature."""
        turn = self.curvature_per_m * s_m
        chord = s_m * np.sinc(turn / (2.0 * math.pi))
        return np.stack([chord * np.cos(turn / 2), chord * np.sin(turn / 2), turn], axis=1)


@dataclass(frozen=True, slots=True)
class Spiral:
    """A clothoid: the curvature changes linearly with arc length."""

    length_m: float
    start_per_m: float
    end_per_m: float

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n], by Gauss-Legendre quadrature of the heading."""
        rate = (self.end_per_m - self.start_per_m) / self.length_m

        def heading(s: Array) -> Array:
            return self.start_per_m * s + 0.5 * rate * s * s

        largest = max(abs(self.start_per_m), abs(self.end_per_m))
        panels = 1 + int(largest * self.length_m)
        x = _integral(lambda s: np.cos(heading(s)), s_m, panels)
        y = _integral(lambda s: np.sin(heading(s)), s_m, panels)
        return np.stack([x, y, heading(s_m)], axis=1)


@dataclass(frozen=True, slots=True)
class Poly3:
    """``v(u)``, a cubic across the start's direction; coefficients from the constant up."""

    length_m: float
    v: tuple[float, float, float, float]

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n]; u by Newton's method."""
        u = s_m.copy()
        for _ in range(30):
            excess = _integral(self._speed, u, 1 + int(self.length_m / 2.0)) - s_m
            u = u - excess / self._speed(u)
        return np.stack([u, cubic(self.v, u), np.arctan(_slope(self.v, u))], axis=1)

    def _speed(self, u: Array) -> Array:
        speed: Array = np.sqrt(1.0 + _slope(self.v, u) ** 2)
        return speed


@dataclass(frozen=True, slots=True)
class ParamPoly3:
    """``u(p), v(p)``, two cubics; p runs from 0 to ``end`` in proportion to arc length."""

    length_m: float
    u: tuple[float, float, float, float]
    v: tuple[float, float, float, float]
    end: float = 1.0

    def local(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n]."""
        p = s_m * (self.end / self.length_m)
        heading = np.unwrap(np.arctan2(_slope(self.v, p), _slope(self.u, p)))
        return np.stack([cubic(self.u, p), cubic(self.v, p), heading], axis=1)


@dataclass(frozen=True, slots=True)
class Placed:
    """A curve with its start pose."""

    s_m: float
    x_m: float
    y_m: float
    heading_rad: float
    curve: Curve

    def poses(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n] of the whole line, clipped to the curve's ends."""
        along = np.minimum(np.maximum(s_m - self.s_m, 0.0), self.curve.length_m)
        x, y, heading = self.curve.local(along).T
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        poses = np.zeros((len(s_m), 3))
        poses[:, 0] = self.x_m + c * x - s * y
        poses[:, 1] = self.y_m + s * x + c * y
        poses[:, 2] = self.heading_rad + heading
        return poses


@dataclass(frozen=True, slots=True)
class ReferenceLine:
    """Consecutive curves; ``s`` runs from 0 to ``length_m``."""

    pieces: tuple[Placed, ...]

    @property
    def length_m(self) -> float:
        """Its arc length."""
        return self.pieces[-1].s_m + self.pieces[-1].curve.length_m

    def poses(self, s_m: Array) -> Array:
        """Poses [n, 3] at arc lengths [n], clipped to the ends."""
        starts = np.array([piece.s_m for piece in self.pieces])
        if len(starts) == 1:
            return self.pieces[0].poses(s_m)
        which = np.clip(np.searchsorted(starts, s_m, side="right") - 1, 0, len(starts) - 1)
        poses = np.zeros((len(s_m), 3))
        for k in np.unique(which):
            here = which == k
            poses[here] = self.pieces[k].poses(s_m[here])
        return poses

    def points(self, s_m: Array, t_m: Array) -> Array:
        """Points [n, 2] at arc lengths and distances to the left."""
        return beside(self.poses(s_m), t_m)


def beside(poses: Array, t_m: Array) -> Array:
    """Points [..., 2] at distances [...] to the left of poses [..., 3], which may be broadcast."""
    x, y, heading = np.moveaxis(poses, -1, 0)
    return np.stack([x - t_m * np.sin(heading), y + t_m * np.cos(heading)], axis=-1)


def cubic(coefficients: Sequence[float], x: Array) -> Array:
    """``a + b x + c x^2 + d x^3``."""
    a, b, c, d = coefficients
    return a + x * (b + x * (c + x * d))


def _slope(coefficients: Sequence[float], x: Array) -> Array:
    _, b, c, d = coefficients
    return b + x * (2.0 * c + 3.0 * x * d)


def _integral(of: Callable[[Array], Array], upper: Array, panels: int) -> Array:
    """Integrals from 0 to each upper bound, by Gauss-Legendre quadrature on equal panels."""
    width = upper[:, None, None] / panels
    starts = np.arange(panels)[None, :, None] * width
    x = starts + 0.5 * width * (1.0 + _NODES)
    total: Array = (0.5 * width * _WEIGHTS * of(x)).sum(axis=(1, 2))
    return total
