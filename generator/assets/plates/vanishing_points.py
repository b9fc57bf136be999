"""Horizon and focal length of a photograph from the vanishing points of its straight edges.

The world is taken for an Atlanta world: edges are vertical, or horizontal in a few directions
(Schindler and Dellaert, "Atlanta world", CVPR 2004). Edges are found by the line segment detector
(Grompone von Gioi et al., "LSD", Image Processing On Line 2, 2012). Every pair of the longest edges
proposes a vanishing point; the directions with the most support are then fitted to all edges that
agree with them. There is no randomness.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import UInt8
from gen_data.core.se3 import Array

_LONG_SIDE_PX = 1000
"""Size of the image in which edges are found."""
_SHORTEST_PX = 22.0
_PROPOSERS = 44
"""Edges of which all pairs propose vanishing points, for verticals and for horizontals."""
_AGREES = math.sin(math.radians(1.0))
"""Largest sine of the angle between a direction and the plane of an edge that agrees with it."""
_STEEP = math.tan(math.radians(30.0))
"""Verticals lean less than this, by their run over their rise in the image."""
_PITCH_MAX, _ROLL_MAX = math.sin(math.radians(45.0)), math.sin(math.radians(20.0))
_APART = math.cos(math.radians(15.0))
_LEVEL = math.sin(math.radians(1.5))
"""Largest sine of the elevation of a proposed horizontal direction."""
_TRIED = 48
"""Zeniths, those with the most support, whose second horizontal direction is searched."""
_END_PX = 0.6
"""Standard deviation of the ends of an edge, across it, for images of ``_LONG_SIDE_PX``."""
_SHARE = 0.3
"""Least share of the length of all edges that must agree with the directions."""
_SUPPORT = 8
_ERROR_MAX_RAD = math.radians(0.6)
_HFOV_DEG = tuple(range(32, 106, 6))
_FOCAL_ERROR = 0.06
"""Largest relative standard deviation of an estimated focal length."""


@dataclass(frozen=True, eq=False, slots=True)
class Edges:
    """Straight edges of an image.

    Attributes:
        ends_px: Both ends from the middle of the image, [n, 2, 2].
        lengths_px: In an image of ``_LONG_SIDE_PX``, [n].
        long_side_px: Of the image.
    """

    ends_px: Array
    lengths_px: Array
    long_side_px: float

    def normals(self, focal_px: float) -> Array:
        """Unit normals, [n, 3], in the camera frame, of the planes through edge and camera."""
        n = len(self.ends_px)
        rays = np.concatenate([self.ends_px / focal_px, np.ones((n, 2, 1))], axis=-1)
        return _unit(np.cross(rays[:, 0], rays[:, 1]))


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
    """A photograph whose edges define no horizon; the text says why."""


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
        NoHorizonError: too few edges agree on directions, or they leave the result uncertain.
    """
    if len(edges.lengths_px) < _SUPPORT:
        raise NoHorizonError(f"{len(edges.lengths_px)} straight edges were found")
    if focal_px is not None:
        return _fit(edges, focal_px, _propose(edges, focal_px), is_focal_known=True)
    trials = [0.5 * edges.long_side_px / math.tan(math.radians(0.5 * d)) for d in _HFOV_DEG]
    proposals = [_propose(edges, focal, right_angles=True) for focal in trials]
    best = max(range(len(trials)), key=lambda k: proposals[k].score)
    return _fit(edges, trials[best], proposals[best], is_focal_known=False)


@dataclass(frozen=True, eq=False, slots=True)
class _Proposal:
    """Zenith, [3], and horizontal directions, [k, 3], with the length of the edges that agree."""

    zenith: Array
    level: Array
    score: float


def _propose(edges: Edges, focal_px: float, *, right_angles: bool = False) -> _Proposal:
    """The zenith with the most support by vertical edges and two horizontal directions.

    With ``right_angles``, the horizontal directions are perpendicular to each other.
    """
    normals, lengths = edges.normals(focal_px), edges.lengths_px
    steep = _is_steep(edges)
    horizontal = _meetings(normals[~steep], lengths[~steep])
    scores = _support(horizontal, normals[~steep], lengths[~steep])
    zeniths = _meetings(normals[steep], lengths[steep])
    if len(horizontal):
        first = horizontal[int(np.argmax(scores))]
        zeniths = np.concatenate([zeniths, np.cross(first, horizontal)])
    zeniths = zeniths[np.sqrt((zeniths**2).sum(axis=1)) > 0.2]
    if not len(zeniths):
        raise NoHorizonError("its edges have no common vanishing point")
    zeniths = _unit(zeniths)
    zeniths = zeniths * np.where(zeniths[:, 1] > 0.0, -1.0, 1.0)[:, None]
    upright = (np.abs(zeniths[:, 2]) < _PITCH_MAX) & (np.abs(zeniths[:, 0]) < _ROLL_MAX)
    if not upright.any():
        raise NoHorizonError("its edges meet in no direction that may be the vertical")
    best = _Proposal(zeniths[0], np.zeros((0, 3)), -1.0)
    zeniths = zeniths[upright]
    upward = _support(zeniths, normals[steep], lengths[steep])
    bound = upward + _best_level(zeniths, horizontal, scores)
    for k in np.argsort(-bound, kind="stable")[:_TRIED]:
        zenith, up_score = zeniths[k], float(upward[k])
        level, level_score = _level_directions(zenith, horizontal, scores, right_angles)
        if up_score + level_score > best.score:
            best = _Proposal(zenith, level, up_score + level_score)
    return best


def _best_level(zeniths: Array, horizontal: Array, scores: Array) -> Array:
    """Support of the best horizontal direction of each zenith, [m]."""
    if not len(horizontal):
        return np.zeros(len(zeniths))
    return np.asarray(np.where(np.abs(zeniths @ horizontal.T) < _LEVEL, scores, 0.0).max(axis=1))


def _level_directions(
    zenith: Array, horizontal: Array, scores: Array, right_angles: bool
) -> tuple[Array, float]:
    """Up to two horizontal directions of a zenith with the most support, and their support."""
    if not len(horizontal):
        return np.zeros((0, 3)), 0.0
    near = np.where(np.abs(horizontal @ zenith) < _LEVEL, scores, -1.0)
    first = int(np.argmax(near))
    if near[first] <= 0.0:
        return np.zeros((0, 3)), 0.0
    across = np.abs(horizontal @ horizontal[first])
    other = np.where(across < (_LEVEL if right_angles else _APART), near, -1.0)
    second = int(np.argmax(other))
    chosen = [first] if other[second] <= 0.0 else [first, second]
    return horizontal[chosen], float(np.maximum(near[chosen], 0.0).sum())


def _is_steep(edges: Edges) -> NDArray[np.bool_]:
    run, rise = np.abs(edges.ends_px[:, 1] - edges.ends_px[:, 0]).T
    return np.asarray(run < _STEEP * rise)


def _meetings(normals: Array, lengths: Array) -> Array:
    """Directions, unit, [m, 3], in which pairs of the longest edges meet."""
    longest = np.argsort(-lengths, kind="stable")[:_PROPOSERS]
    i, j = np.triu_indices(len(longest), 1)
    meeting = np.cross(normals[longest[i]], normals[longest[j]])
    clear = np.sqrt((meeting**2).sum(axis=1)) > math.sin(math.radians(2.0))
    return _unit(meeting[clear])


def _support(directions: Array, normals: Array, lengths: Array) -> Array:
    """Length of the edges that agree with each direction, [m]."""
    return np.asarray((np.abs(directions @ normals.T) < _AGREES) @ lengths)


def _fit(
    edges: Edges, focal_px: float, start: _Proposal, *, is_focal_known: bool
) -> CameraEstimate:
    """Fit zenith, horizontal directions and perhaps the focal length to the edges that agree."""
    from scipy.optimize import least_squares

    frame = _Frame.around(start, focal_px, is_focal_known=is_focal_known)
    parameters = np.zeros(frame.count)
    for _ in range(3):
        owners = frame.assign(edges, parameters)
        used = owners >= 0
        if used.sum() < _SUPPORT:
            raise NoHorizonError(f"{int(used.sum())} straight edges agree on directions")
        solved = least_squares(
            lambda p, owners=owners: frame.residuals(edges, owners, p), parameters, loss="soft_l1"
        )
        parameters = solved.x
    share = float(edges.lengths_px[used].sum() / edges.lengths_px.sum())
    if share < _SHARE:
        raise NoHorizonError(
            f"{100.0 * share:.0f} % of the length of its edges agree on directions; expected at "
            f"least {100.0 * _SHARE:.0f} %"
        )
    information = solved.jac.T @ solved.jac + 1e-9 * np.eye(frame.count)
    # Residuals above their expectation enlarge the error.
    excess = max(2.0 * solved.cost / max(int(used.sum()) - frame.count, 1), 1.0)
    variance = np.diag(np.linalg.inv(information)) * excess
    error = math.sqrt(float(max(variance[0], variance[1])))
    if not error < _ERROR_MAX_RAD:
        raise NoHorizonError("its edges leave the horizon uncertain")
    zenith, _, focal = frame.directions(parameters)
    if not is_focal_known and not math.sqrt(float(variance[-1])) < _FOCAL_ERROR:
        raise NoHorizonError("its edges leave the field of view uncertain; give hfov_deg")
    return CameraEstimate(zenith, focal, error, int(used.sum()))


@dataclass(frozen=True, eq=False, slots=True)
class _Frame:
    """Parameters of a fit: tilts of the zenith, azimuths, and the logarithm of the focal length.

    Attributes:
        axes: Start of two horizontal axes and the zenith, rows, [3, 3].
        azimuths: Of the horizontal directions, at the start.
        focal_px: At the start.
        is_focal_known: The focal length is fixed; else the directions are at right angles.
    """

    axes: Array
    azimuths: tuple[float, ...]
    focal_px: float
    is_focal_known: bool

    @classmethod
    def around(cls, start: _Proposal, focal_px: float, *, is_focal_known: bool) -> "_Frame":
        zenith = start.zenith
        x = _unit(np.cross(zenith, [0.0, 0.0, 1.0])[None])[0]
        axes = np.stack([x, np.cross(zenith, x), zenith])
        azimuths = tuple(math.atan2(float(d @ axes[1]), float(d @ axes[0])) for d in start.level)
        if not is_focal_known:
            if not azimuths:
                raise NoHorizonError("its edges leave the field of view uncertain; give hfov_deg")
            azimuths = azimuths[:1]
        return cls(axes, azimuths, focal_px, is_focal_known)

    @property
    def count(self) -> int:
        return 2 + len(self.azimuths) + (0 if self.is_focal_known else 1)

    def directions(self, parameters: Array) -> tuple[Array, Array, float]:
        """Zenith [3], horizontal directions [k, 3] and focal length of parameters."""
        tilts = parameters[:2]
        zenith = _unit((self.axes[2] + tilts @ self.axes[:2])[None])[0]
        x = _unit((self.axes[0] - float(self.axes[0] @ zenith) * zenith)[None])[0]
        y = np.cross(zenith, x)
        angles = np.array(self.azimuths) + parameters[2 : 2 + len(self.azimuths)]
        if not self.is_focal_known:
            angles = np.concatenate([angles, angles + 0.5 * math.pi])
        level = np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y
        focal = self.focal_px * (1.0 if self.is_focal_known else math.exp(float(parameters[-1])))
        return zenith, level, focal

    def assign(self, edges: Edges, parameters: Array) -> NDArray[np.intp]:
        """Number of the direction that each edge agrees with best, 0 = the zenith; -1 = none."""
        zenith, level, focal = self.directions(parameters)
        sines = np.abs(edges.normals(focal) @ np.concatenate([zenith[None], level]).T)
        steep = _is_steep(edges)
        sines[~steep, 0] = 1.0
        sines[steep, 1:] += _AGREES * 0.5
        best = np.argmin(sines, axis=1)
        agrees = sines[np.arange(len(best)), best] < _AGREES
        return np.asarray(np.where(agrees, best, -1))

    def residuals(self, edges: Edges, owners: Sequence[int] | Array, parameters: Array) -> Array:
        """Angles between edges and their directions over their standard deviations."""
        owned = np.asarray(owners)
        zenith, level, focal = self.directions(parameters)
        chosen = np.concatenate([zenith[None], level])[owned[owned >= 0]]
        sines = (edges.normals(focal)[owned >= 0] * chosen).sum(axis=1)
        deviation = np.maximum(_END_PX * math.sqrt(2.0) / edges.lengths_px[owned >= 0], 2e-3)
        return np.asarray(sines / deviation)


def _unit(vectors: Array) -> Array:
    length = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.maximum(length, 1e-12))
