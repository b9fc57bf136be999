"""Turns that leave an object as it looks, found on its surface and colours.

For models whose assets state none. Candidates are turns about the axes of the asset's frame and the
diagonals between them, about the principal axes of the surface, and half turns across an axis that
was found, all through the centroid of the surface, which every symmetry keeps. A turn counts if
turned points of the surface lie on the surface, where it has their colour.

Two sets of points sample the surface: their distance without a turn is the error of
sampling and the noise of textures, which a turn may add little to.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Symmetry
from gen_data.core.se3 import SE3, Array

POINTS = 20_000
"""Sampled points that turned points are compared with."""
PROBES = 3_000
"""Points that are turned."""
FOLDS = tuple(range(24, 1, -1))
_DIAGONALS = np.array(
    [(1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)], np.float64
) / math.sqrt(2.0)
"""Axes of half turns of objects modelled along the axes of their frame, such as an elbow."""
ANGLES_RAD = (1.0, 2.2, 0.3)
"""Turns that stand for every angle; no simple parts of a circle."""
FAR_SHARE = 0.006
"""Distance from the surface that a turn may add, as a share of the diameter: polygons stand for
circles. BOP itself allows 0.1."""
COLOR_LEVELS = 8.0
"""Mean difference of colour that a turn may add, of 255 levels."""
TAIL_LEVELS = 40.0
"""The same in the 98th percentile: a print is on a small part of the surface."""
NEAR = 0.03
"""Sines below this count as 0."""
FIT = 1.1
"""Fits of turns that count as equal: a gear of 14 teeth nearly fits itself after a fifteenth."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on a surface.

    Attributes:
        points: [n, 3], any unit of length.
        colors: SRGB [n, 3] in [0, 255].
    """

    points: Array
    colors: Array


def sample_triangles(corners: Array, count: int, shift: float) -> tuple[NDArray[np.intp], Array]:
    """Spread points evenly over triangles [m, 3, 3]; other shifts in [0, 1) give other points.

    Returns:
        Indices of triangles [count], and weights of their corners [count, 3]. Empty for a surface
        without area.

    Source of the sequence: Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences",
    2018, R2.
    """
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    ends = np.cumsum(areas)
    if not len(ends) or not ends[-1] > 0.0:
        return np.zeros(0, np.intp), np.zeros((0, 3))
    k = np.arange(count)
    chosen = np.searchsorted(ends, (k + shift) / count * ends[-1], side="right")
    a, b = ((k + shift) * step % 1.0 for step in (0.7548776662466927, 0.5698402909980532))
    folded = a + b > 1.0
    a, b = np.where(folded, 1.0 - a, a), np.where(folded, 1.0 - b, b)
    return np.minimum(chosen, len(ends) - 1), np.stack([1.0 - a - b, a, b], axis=1)


def find_symmetries(surface: Samples, probes: Samples) -> tuple[Symmetry, ...]:
    """Find turns that leave the surface and its colours as they are.

    Args:
        surface: ``POINTS`` samples of the surface.
        probes: ``PROBES`` other samples of it.

    Returns:
        Axes in the frame of the points, through points in their unit.
    """
    if not len(surface.points):
        return ()
    search = _Search(surface, probes)
    found: list[Symmetry] = []
    for axis in _distinct([*np.eye(3), *_DIAGONALS, *search.principal_axes]):
        fold = search.fold_about(axis)
        if fold is not None:
            found.append(search.symmetry(axis, fold))
    turning = [symmetry for symmetry in found if symmetry.fold == 0]
    if len(turning) == 1:
        # With every turn about one axis, one half turn across it makes all others.
        main = np.array(turning[0].axis)
        across = [s for s in found if s.fold and abs(float(main @ np.array(s.axis))) < NEAR]
        return (*turning, *across[:1])
    if turning:
        return tuple(turning[:2])  # A ball: these make every turn.
    for axis in _half_turn_axes(found):
        if search.fit(axis, math.pi) is not None:
            found.append(search.symmetry(axis, 2))
            break  # With the turns about the main axis, it makes all others.
    return tuple(found)


@dataclass(frozen=True)
class _Difference:
    """Distances of points from the surface, and differences of colour; means and largest."""

    distance: float
    farthest: float
    color: float
    color_tail: float


class _Search:
    """Samples of one surface, ready for comparison."""

    def __init__(self, surface: Samples, probes: Samples) -> None:
        from scipy.spatial import cKDTree

        self._surface, self._probes = surface, probes
        self._tree = cKDTree(surface.points)
        self._centroid: Array = surface.points.mean(axis=0)
        around = surface.points - self._centroid
        self._far = FAR_SHARE * 2.0 * float(np.linalg.norm(around, axis=1).max())
        _, vectors = np.linalg.eigh(around.T @ around)
        self.principal_axes: Array = vectors.T
        self._still = self._compare(probes.points, probes.colors)

    def symmetry(self, axis: Array, fold: int) -> Symmetry:
        """A symmetry about an axis through the centroid."""
        x, y, z = (float(v) + 0.0 for v in np.round(axis, 9))
        u, v, w = (float(c) for c in self._centroid)
        return Symmetry((x, y, z), fold, (u, v, w))

    def fold_about(self, axis: Array) -> int | None:
        """Number of equal turns about an axis; 0 = every angle, None = no turn."""
        if all(self.fit(axis, angle_rad) is not None for angle_rad in ANGLES_RAD):
            return 0
        fits = {n: fit for n in FOLDS if (fit := self._fit_of_fold(axis, n)) is not None}
        # No fit is better than the sampling.
        good = FIT * max(min(fits.values(), default=0.0), self._still.distance)
        return max((n for n, fit in fits.items() if fit <= good), default=None)

    def _fit_of_fold(self, axis: Array, fold: int) -> float | None:
        """Mean distance after the worst of equal turns; None if one of them does not fit."""
        worst = 0.0
        for k in range(1, fold // 2 + 1):
            fit = self.fit(axis, 2.0 * math.pi * k / fold)
            if fit is None:
                return None
            worst = max(worst, fit)
        return worst

    def fit(self, axis: Array, angle_rad: float) -> float | None:
        """Mean distance of turned points from the surface; None if the object looks different."""
        half = 0.5 * angle_rad
        x, y, z = (math.sin(half) * float(v) for v in axis)
        turn = SE3((0.0, 0.0, 0.0), (math.cos(half), x, y, z)).rotation()
        points = (self._probes.points - self._centroid) @ turn.T + self._centroid
        # Most turns fail for the first few points.
        farthest = self._still.farthest + self._far
        if self._compare(points[::40], self._probes.colors[::40]).farthest > farthest:
            return None
        found = self._compare(points, self._probes.colors)
        keeps = (
            found.farthest <= farthest
            and found.color <= self._still.color + COLOR_LEVELS
            and found.color_tail <= self._still.color_tail + TAIL_LEVELS
        )
        return found.distance if keeps else None

    def _compare(self, points: Array, colors: Array) -> _Difference:
        distances, nearest = self._tree.query(points)
        levels = np.abs(colors - self._surface.colors[nearest]).max(axis=1)
        return _Difference(
            float(distances.mean()),
            float(distances.max()),
            float(levels.mean()),
            float(np.quantile(levels, 0.98)),
        )


def _distinct(axes: Sequence[Array]) -> list[Array]:
    """Axes without any that is nearly parallel to an earlier one: an inexact copy of it."""
    found: list[Array] = []
    for axis in axes:
        if all(abs(float(axis @ other)) < 1.0 - NEAR for other in found):
            found.append(axis)
    return found


def _half_turn_axes(found: Sequence[Symmetry]) -> Iterator[Array]:
    """Axes across the only one with discrete turns, in steps of half of its smallest turn."""
    if len(found) != 1 or found[0].fold < 2:
        return
    main = np.array(found[0].axis)
    across = np.eye(3)[int(np.argmin(np.abs(main)))]
    across = across - (across @ main) * main
    across /= np.linalg.norm(across)
    other = np.cross(main, across)
    for k, part in itertools.product(range(found[0].fold), (0.0, 0.5)):
        angle_rad = math.pi * (k + part) / found[0].fold
        yield math.cos(angle_rad) * across + math.sin(angle_rad) * other
