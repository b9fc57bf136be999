"""Horizon and focal length of a photograph from the vanishing points of its straight edges.

The world is taken for a Manhattan world (Coughlan and Yuille, ICCV 1999): edges along the vertical
and two horizontal directions at right angles. Edges are found by the line segment detector
(Grompone von Gioi et al., "LSD", Image Processing On Line 2, 2012); pairs of the longest lines
propose directions. There is no randomness.

An estimate is stated only where the edges confirm it: most of their length agrees, no other frame
has nearly as much, and it changes little if a part of the lines is left out. The edges of a table
top may be parallel to a wall, too: a photograph with a ground looks down, or up a little.
"""

import itertools
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import UInt8
from gen_data.core.se3 import Array

_LONG_SIDE_PX = 1000
"""Size of the image in which edges are found."""
_SHORTEST_PX = 22.0
_AGREES = math.sin(math.radians(1.5))
"""Largest sine of the angle between an edge and a vanishing point that agree."""
_SAME_LINE = math.sin(math.radians(0.7))
"""Largest sine of the angle between the planes of edges that count as one line."""
_PROPOSERS = 56
"""Lines of which all pairs propose directions."""
_DIRECTIONS = 24
_APART = math.cos(math.radians(3.0))
"""Cosine of the least angle between different directions, and between zeniths that rival."""
_RIGHT = math.sin(math.radians(2.0))
"""Largest cosine between directions at right angles."""
_SPREAD = math.sin(math.radians(6.0))
"""Least spread of the lines of a direction about it: parallels in the image define none."""
_PART = 0.15
"""Least share of each of two directions in the support of a frame of two."""
_LINES_TWO, _LINES_THREE = 7, 4
"""Least number of lines of a frame of two directions, and of each of three directions."""
_SHARE_TWO, _SHARE_THREE = 0.7, 0.45
"""Least share of the length of all edges that agree with a frame of two, and of three directions:
three confirm one another, while two at right angles are found in any picture."""
_PITCH_MIN, _PITCH_MAX = math.sin(math.radians(-75.0)), math.sin(math.radians(20.0))
_ROLL_MAX = math.sin(math.radians(20.0))
_RIVAL = 0.85
"""Support of another frame, as a share of the best's, from which the estimate is ambiguous."""
_END_PX = 0.6
"""Standard deviation of the ends of an edge, across it, for images of ``_LONG_SIDE_PX``."""
_SUPPORT = 8
_GROUPS = 8
"""Parts of the lines that are left out in turn (delete-a-group jackknife)."""
_ERROR_MIN_RAD, _ERROR_MAX_RAD = math.radians(0.5), math.radians(1.5)
_HFOV_DEG = tuple(range(32, 106, 6))
_FOCAL_ERROR = 0.06
"""Largest relative standard deviation of an estimated focal length."""
_NO_FIELD = "its edges leave the field of view uncertain; give hfov_deg"


@dataclass(frozen=True, eq=False, slots=True)
class Edges:
    """Straight edges of an image.

    Attributes:
        ends_px: Both ends from the middle of the image, [n, 2, 2].
        lengths_px: In an image of ``_LONG_SIDE_PX``, [n].
        long_side_px: Long side of the image.
    """

    ends_px: Array
    lengths_px: Array
    long_side_px: float

    def normals(self, focal_px: float) -> Array:
        """Unit normals, [n, 3], in the camera frame, of the planes through edge and camera."""
        n = len(self.ends_px)
        rays = np.concatenate([self.ends_px / focal_px, np.ones((n, 2, 1))], axis=-1)
        return _unit(np.cross(rays[:, 0], rays[:, 1]))

    def sines(self, directions: Array, focal_px: float) -> Array:
        """Sines, [m, n], between edges and the lines from their middles to vanishing points.

        Args:
            directions: Directions of the vanishing points in the camera frame, [m, 3].
            focal_px: Focal length.
        """
        along = self.ends_px[:, 1] - self.ends_px[:, 0]
        middle = 0.5 * (self.ends_px[:, 1] + self.ends_px[:, 0])
        x, y = (
            focal_px * directions[:, k, None] - directions[:, 2, None] * middle[:, k]
            for k in range(2)
        )
        return np.asarray(
            (x * along[:, 1] - y * along[:, 0]) / (np.hypot(x, y) * np.hypot(*along.T) + 1e-9)
        )


@dataclass(frozen=True, eq=False, slots=True)
class CameraEstimate:
    """Camera of a photograph.

    Attributes:
        zenith: Unit vector in the camera frame (X right, Y down, Z forward), [3].
        focal_px: Given or estimated.
        error_rad: Standard deviation of the zenith's direction.
        support: Number of edges that agree.
    """

    zenith: Array
    focal_px: float
    error_rad: float
    support: int


class NoHorizonError(ValueError):
    """A photograph whose edges define no horizon; the text explains why."""


def find_edges(rgb: UInt8) -> Edges:
    """Straight edges of an image, uint8 [h, w, 3]; there may be none."""
    height, width = rgb.shape[:2]
    long_side = float(max(height, width))
    scale = min(_LONG_SIDE_PX / long_side, 1.0)
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    if scale < 1.0:
        size = (round(width * scale), round(height * scale))
        grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    found = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD).detect(grey)[0]
    ends = np.zeros((0, 2, 2)) if found is None else found.reshape(-1, 2, 2).astype(np.float64)
    # OpenCV puts pixel centres at integers.
    ends = (ends + 0.5) * (width / grey.shape[1], height / grey.shape[0])
    ends -= (0.5 * width, 0.5 * height)
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T) * (_LONG_SIDE_PX / long_side)
    kept = lengths >= _SHORTEST_PX
    return Edges(ends[kept], lengths[kept], long_side)


def estimate_camera(edges: Edges, focal_px: float | None) -> CameraEstimate:
    """Estimate the zenith and, if it is not given, the focal length.

    Raises:
        NoHorizonError: the edges do not confirm an estimate.
    """
    if len(edges.lengths_px) < _SUPPORT:
        raise NoHorizonError(f"{len(edges.lengths_px)} straight edges were found")
    if focal_px is not None:
        return _fit(edges, _propose(edges, focal_px), focal_px, is_focal_known=True)
    found = []
    for hfov_deg in _HFOV_DEG:
        trial_px = 0.5 * edges.long_side_px / math.tan(math.radians(0.5 * hfov_deg))
        with suppress(NoHorizonError):
            found.append((_propose(edges, trial_px), trial_px))
    # Two vanishing points at right angles fit any focal length; the third confirms it.
    found = [one for one in found if one[0].has_three]
    if not found:
        raise NoHorizonError(_NO_FIELD)
    return _fit(edges, *max(found, key=lambda one: one[0].share), is_focal_known=False)


@dataclass(frozen=True, eq=False, slots=True)
class _Frame:
    """Directions at right angles, of which the third is the zenith.

    Attributes:
        axes: Rows, unit, [3, 3].
        share: Share of the length of all edges that agrees.
        lines: Lines that agree with each axis, the fewest first.
        part: Share of the second axis in the length that agrees, in order of their lengths.
    """

    axes: Array
    share: float
    lines: tuple[int, ...]
    part: float

    @property
    def has_three(self) -> bool:
        """Whether lines show all three directions."""
        return self.lines[0] >= _LINES_THREE

    @property
    def is_confirmed(self) -> bool:
        """Whether the frame has more support than frames of other pictures have by chance."""
        if self.has_three:
            return self.share >= _SHARE_THREE
        is_shown = sum(self.lines) >= _LINES_TWO and self.part >= _PART
        return is_shown and self.share >= _SHARE_TWO


def _propose(edges: Edges, focal_px: float) -> _Frame:
    """The frame with the most support.

    Raises:
        NoHorizonError: there is none, its support may be chance, or another has nearly as much.
    """
    frames = list(_frames(edges, focal_px))
    if not frames:
        raise NoHorizonError("its edges show no two directions at right angles")
    best = max(frames, key=lambda one: one.share)
    if not best.is_confirmed:
        least = _SHARE_THREE if best.has_three else _SHARE_TWO
        raise NoHorizonError(
            f"{100.0 * best.share:.0f} % of the length of its edges, in {sum(best.lines)} lines, "
            f"agree on directions at right angles; expected at least {100.0 * least:.0f} % in "
            f"{_LINES_TWO} lines"
        )
    rivals = [f.share for f in frames if abs(float(f.axes[2] @ best.axes[2])) < _APART]
    if max(rivals, default=0.0) > _RIVAL * best.share:
        raise NoHorizonError("its edges fit more than one horizon")
    return best


def _lines(normals: Array, lengths: Array) -> NDArray[np.intp]:
    """Number of the line of each edge, [n]; the longest edges begin lines."""
    owner = np.full(len(normals), -1)
    for k in np.argsort(-lengths, kind="stable"):
        if owner[k] < 0:
            across = np.cross(normals, normals[k])
            same = (across**2).sum(axis=1) < _SAME_LINE**2
            owner[same & (owner < 0)] = k
    return np.unique(owner, return_inverse=True)[1]


def _directions(edges: Edges, focal_px: float, lines: NDArray[np.intp]) -> Array:
    """Directions with the most support, unit, [k, 3]."""
    normals, lengths = edges.normals(focal_px), edges.lengths_px
    total = np.bincount(lines, lengths)
    longest = np.argsort(-total, kind="stable")[:_PROPOSERS]
    first = [int(np.argmax(np.where(lines == k, lengths, -1.0))) for k in longest]
    i, j = np.triu_indices(len(first), 1)
    ends = normals[first]
    meeting = np.cross(ends[i], ends[j])
    clear = (meeting**2).sum(axis=1) > math.sin(math.radians(2.0)) ** 2
    found = _unit(meeting[clear])
    support = _agrees(edges, found, focal_px) @ lengths
    kept: list[Array] = []
    for k in np.argsort(-support, kind="stable"):
        if all(abs(float(found[k] @ one)) < _APART for one in kept):
            direction, spread = _refine(edges, focal_px, found[k])
            if spread >= _SPREAD:
                kept.append(direction)
        if len(kept) == _DIRECTIONS:
            break
    return np.array(kept).reshape(-1, 3)


def _refine(edges: Edges, focal_px: float, direction: Array) -> tuple[Array, float]:
    """The direction that fits the edges best that agree with it, and their spread about it."""
    normals, values = edges.normals(focal_px), np.zeros(3)
    for _ in range(2):
        is_used = _agrees(edges, direction[None], focal_px)[0]
        used, weights = normals[is_used], edges.lengths_px[is_used]
        values, vectors = np.linalg.eigh((used * weights[:, None]).T @ used / weights.sum())
        direction = vectors[:, 0]
    return direction, math.sqrt(max(float(values[1]), 0.0))


def _agrees(edges: Edges, directions: Array, focal_px: float) -> NDArray[np.bool_]:
    """Whether edges agree with directions, [m, n]."""
    return np.asarray(np.abs(edges.sines(directions, focal_px)) < _AGREES)


def _frames(edges: Edges, focal_px: float) -> Iterator[_Frame]:
    """Frames of every two directions at right angles, with every axis that may be the zenith."""
    lengths = edges.lengths_px
    lines = _lines(edges.normals(focal_px), lengths)
    for a, b in itertools.combinations(_directions(edges, focal_px, lines), 2):
        if abs(float(a @ b)) > _RIGHT:
            continue
        b = _unit(b - float(a @ b) * a)  # noqa: PLW2901
        axes = np.stack([a, b, np.cross(a, b)])
        sines = np.abs(edges.sines(axes, focal_px))
        owner = np.where(sines.min(axis=0) < _AGREES, sines.argmin(axis=0), 3)
        length = np.bincount(owner, lengths, 4)[:3]
        counts = sorted(len(set(lines[owner == k])) for k in range(3))
        share, part = float(length.sum() / lengths.sum()), float(np.sort(length)[1] / length.sum())
        for k in range(3):
            turned = np.roll(axes, 2 - k, axis=0) * (-1.0 if axes[k, 1] > 0.0 else 1.0)
            zenith = turned[2]
            if _PITCH_MIN < zenith[2] < _PITCH_MAX and abs(zenith[0]) < _ROLL_MAX:
                yield _Frame(turned, share, tuple(counts), part)


def _fit(edges: Edges, start: _Frame, focal_px: float, *, is_focal_known: bool) -> CameraEstimate:
    """Fit a frame, and perhaps the focal length, to the edges that agree."""
    fit = _Fit(edges, start.axes, focal_px, is_focal_known)
    parameters = np.zeros(3 if is_focal_known else 4)
    for _ in range(3):
        owners = fit.assign(parameters)
        if (owners >= 0).sum() < _SUPPORT:
            raise NoHorizonError(f"{int((owners >= 0).sum())} straight edges agree on directions")
        parameters = fit.solve(owners, parameters)
    axes, focal = fit.frame(parameters)
    part = _lines(edges.normals(focal), edges.lengths_px) % _GROUPS
    without = [fit.solve(np.where(part == k, -1, owners), parameters) for k in range(_GROUPS)]
    zeniths = np.array([fit.frame(p)[0][2] for p in without])
    # Variance of a delete-a-group jackknife: (G - 1) / G times the sum of squares.
    error = math.sqrt((_GROUPS - 1.0) * float(zeniths.var(axis=0).sum()))
    if not error < _ERROR_MAX_RAD:
        raise NoHorizonError("its edges leave the horizon uncertain")
    if not is_focal_known:
        logarithms = np.array([p[3] for p in without])
        if not math.sqrt((_GROUPS - 1.0) * float(logarithms.var())) < _FOCAL_ERROR:
            raise NoHorizonError(_NO_FIELD)
    return CameraEstimate(axes[2], focal, max(error, _ERROR_MIN_RAD), int((owners >= 0).sum()))


@dataclass(frozen=True, eq=False, slots=True)
class _Fit:
    """Fit of a rotation [rad], [3], and perhaps the logarithm of the focal length.

    Attributes:
        axes: Axes of the frame at the start, rows, [3, 3].
        focal_px: At the start.
    """

    edges: Edges
    axes: Array
    focal_px: float
    is_focal_known: bool

    def frame(self, parameters: Array) -> tuple[Array, float]:
        """Axes and focal length of parameters."""
        turn, _ = cv2.Rodrigues(np.asarray(parameters[:3], np.float64))
        scale = 1.0 if self.is_focal_known else math.exp(float(parameters[3]))
        return np.asarray(self.axes @ turn.T), self.focal_px * scale

    def assign(self, parameters: Array) -> NDArray[np.intp]:
        """Number of the axis that each edge agrees with; -1 = none."""
        axes, focal = self.frame(parameters)
        sines = np.abs(self.edges.sines(axes, focal))
        return np.where(sines.min(axis=0) < _AGREES, np.argmin(sines, axis=0), -1)

    def solve(self, owners: NDArray[np.intp], parameters: Array) -> Array:
        """Parameters for which the edges lie best in the directions of their axes."""
        from scipy.optimize import least_squares

        used = owners >= 0
        # A turn of an edge about its middle moves its ends by half its length.
        weights = 0.5 * math.sqrt(2.0) * self.edges.lengths_px[used] / _END_PX
        weights = np.minimum(weights, 500.0)

        def residuals(p: Array) -> Array:
            axes, focal = self.frame(p)
            every = self.edges.sines(axes, focal)[:, used]
            return np.asarray(every[owners[used], np.arange(every.shape[1])] * weights)

        return np.asarray(least_squares(residuals, parameters, loss="soft_l1").x)


def _unit(vectors: Array) -> Array:
    length = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.maximum(length, 1e-12))
