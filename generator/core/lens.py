"""Lens models: projection of directions to the plane at focal length 1, and its inverse.

====================  =============================================================================
model                 image of a direction (x, y, z); coefficients
====================  =============================================================================
``pinhole``           ``x / z, y / z``; none
``brown_conrady``     that, bent by OpenCV's rational model; ``k1 k2 p1 p2 k3 k4 k5 k6``
``kannala_brandt``    along (x, y), at ``t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9`` where t is the
                      angle to the axis (OpenCV's fisheye); ``k1 k2 k3 k4``
``equirectangular``   longitude ``atan2(x, z)`` and latitude ``atan2(y, hypot(x, z))``; none
====================  =============================================================================

Polynomials fold over: beyond some angle, images move back inwards. Directions beyond that angle
have no image here, as in a real lens.

Sources: Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32, 1966; Kannala
and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
fish-eye lenses", PAMI 28, 2006; the equations of OpenCV's calib3d module (``projectPoints``,
``fisheye::projectPoints``).
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

LensModel = Literal["pinhole", "brown_conrady", "kannala_brandt", "equirectangular"]

COEFFICIENTS: dict[LensModel, tuple[str, ...]] = {
    "pinhole": (),
    "brown_conrady": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "kannala_brandt": ("k1", "k2", "k3", "k4"),
    "equirectangular": (),
}
"""Names of the coefficients of each model, in OpenCV's order."""

_PLANE_MAX = 100.0
"""Farthest point of the plane at focal length 1: 89.4 degrees off the axis."""
_SAMPLES = 1025
_ITERATIONS_MAX = 64
_PRECISION = 1e-14
_MISSED = 1e-11
"""Largest error of an inverse, as a distance on the plane at focal length 1."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A lens: a projection model with its coefficients and field of view.

    Attributes:
        model: As in the table above.
        coefficients: All of ``COEFFICIENTS``, in that order.
        half_field_rad: Largest angle to the axis with an image; pi = the end of the model.
    """

    model: LensModel = "pinhole"
    coefficients: tuple[float, ...] = ()
    half_field_rad: float = math.pi

    def __post_init__(self) -> None:
        """Validate the coefficients and the field.

        Raises:
            ValueError: a wrong number of coefficients, or a field for a model without one.
        """
        names = COEFFICIENTS[self.model]
        if len(self.coefficients) != len(names):
            raise ValueError(
                f"lens '{self.model}' has {len(names)} coefficients {' '.join(names)}, "
                f"got {len(self.coefficients)}"
            )
        if not names and self.half_field_rad != math.pi:
            raise ValueError(f"lens '{self.model}' has no limit to its field")

    @property
    def folds(self) -> bool:
        """Whether its polynomial folds over within its field."""
        if not self.coefficients:
            return False
        whole = self.model == "brown_conrady" and self.half_field_rad >= 0.5 * math.pi
        # Tangential terms may fold by themselves.
        return _profile(self).folds or (whole and any(self.coefficients[2:4]))

    @property
    def fold_rad(self) -> float | None:
        """Angle to the axis at which its radial polynomial folds over; None if it never does."""
        profile = _profile(self) if self.coefficients else None
        return profile.end_rad if profile and profile.folds else None

    def radius(self, angle_rad: float) -> float:
        """Distance from the axis, on the plane, of the image of an angle to the axis.

        Tangential terms and the limit of the field are ignored.

        Raises:
            ValueError: the model has no image at that angle.
        """
        if self.model == "equirectangular":
            return angle_rad
        if self.model == "pinhole" and angle_rad < 0.5 * math.pi:
            return math.tan(angle_rad)
        end_rad = 0.5 * math.pi
        if self.coefficients:
            end_rad = _profile(replace(self, half_field_rad=math.pi)).end_rad
            if angle_rad <= end_rad:
                argument = math.tan(angle_rad) if self.model == "brown_conrady" else angle_rad
                return float(_radial(self, np.array([argument]))[0][0])
        raise ValueError(
            f"lens '{self.model}' shows nothing at {math.degrees(angle_rad):g} degrees from its "
            f"axis: its model ends at {math.degrees(end_rad):.4g} degrees"
        )

    def project(self, directions: Array) -> Array:
        """Project directions to the plane, [..., 2]; NaN for directions without an image.

        Directions are in the camera frame, of any length but 0, [..., 3].
        """
        x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if self.model == "equirectangular":
                across = np.sqrt(x * x + z * z)
                angles = np.stack([np.arctan2(x, z), np.arctan2(y, across)], axis=-1)
                return np.where(((across == 0.0) & (y == 0.0))[..., None], np.nan, angles)
            if self.model == "kannala_brandt":
                return _fisheye_image(self, x, y, z)
            front = np.where(z > 0, z, np.nan)
            plane = np.stack([x / front, y / front], axis=-1)
            return plane if self.model == "pinhole" else _distort(self, plane)

    def unproject(self, points: Array) -> Array:
        """Unit directions of points, camera frame, [..., 3]; NaN for points outside the field.

        The inverse of ``project``, to about 1e-13, for points on the plane [..., 2].
        """
        points = np.asarray(points, dtype=np.float64)
        flat = points.reshape(-1, 2)
        if self.model == "equirectangular":
            directions = _globe(flat)
        elif self.model == "kannala_brandt":
            directions = _fisheye_directions(self, flat)
        else:
            plane = flat if self.model == "pinhole" else _undistort(self, flat)
            directions = np.column_stack([plane, np.ones(len(plane))])
            directions /= np.sqrt((directions * directions).sum(axis=1))[:, None]
        return directions.reshape(*points.shape[:-1], 3)


PINHOLE = Lens()


@dataclass(frozen=True, eq=False, slots=True)
class _Profile:
    """The monotonic part of a radial function.

    Attributes:
        arguments: From 0 to the end: tangents of angles (Brown-Conrady) or angles.
        radii: Radii of their images, strictly increasing.
        end_rad: Angle at the end.
        folds: Whether it ends because the polynomial folds over.
    """

    arguments: Array
    radii: Array
    end_rad: float
    folds: bool


@lru_cache(maxsize=256)
def _profile(lens: Lens) -> _Profile:
    """The monotonic part of a lens with coefficients."""
    plane = lens.model == "brown_conrady"
    end_rad = min(lens.half_field_rad, math.atan(_PLANE_MAX)) if plane else lens.half_field_rad
    fold_rad = _first_fold(lens, end_rad)
    if fold_rad is not None:
        # Slightly before the fold, where the radius still rises.
        end_rad = fold_rad * (1.0 - 1e-9)
    angles = np.linspace(0.0, end_rad, _SAMPLES)
    arguments = np.tan(angles) if plane else angles
    radii = np.maximum.accumulate(_radial(lens, arguments)[0])
    return _Profile(arguments, radii, end_rad, fold_rad is not None)


def _first_fold(lens: Lens, end_rad: float) -> float | None:
    """The first angle up to ``end_rad`` at which the radius stops rising; None if it never does."""

    def rises(angles: Array) -> NDArray[np.bool_]:
        arguments = np.tan(angles) if lens.model == "brown_conrady" else angles
        with np.errstate(all="ignore"):
            _, slope, divisor = _radial(lens, arguments)
        return np.asarray((slope > 0.0) & (divisor > 0.0))

    angles = np.linspace(0.0, end_rad, 4 * _SAMPLES)
    falls = np.flatnonzero(~rises(angles))
    if not len(falls):
        return None
    low, high = float(angles[falls[0] - 1]), float(angles[falls[0]])
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rises(np.array([middle]))[0] else (low, middle)
    return low


def _radial(lens: Lens, u: Array) -> tuple[Array, Array, Array]:
    """Radius of the image, its derivative, and the denominator, which must be positive."""
    s = u * u
    if lens.model == "kannala_brandt":
        k1, k2, k3, k4 = lens.coefficients
        value = u * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))))
        slope = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))
        return value, slope, np.ones_like(u)
    k1, k2, _, _, k3, k4, k5, k6 = lens.coefficients
    over = 1.0 + s * (k1 + s * (k2 + s * k3))
    over_slope = k1 + s * (2.0 * k2 + s * 3.0 * k3)
    under = 1.0 + s * (k4 + s * (k5 + s * k6))
    under_slope = k4 + s * (2.0 * k5 + s * 3.0 * k6)
    slope = ((over + 2.0 * s * over_slope) * under - 2.0 * s * over * under_slope) / (under * under)
    return u * over / under, slope, under


def _invert_radial(lens: Lens, radii: Array) -> Array:
    """The arguments whose images have these radii, [n]; NaN beyond the end.

    Newton's method within bounds: a step that leaves them is replaced by bisection.
    """
    profile = _profile(lens)
    within = radii <= profile.radii[-1]
    target = np.where(within, radii, 0.0)
    cell = np.searchsorted(profile.radii, target, side="right") - 1
    cell = np.clip(cell, 0, _SAMPLES - 2)
    low, high = profile.arguments[cell], profile.arguments[cell + 1]
    first, last = profile.radii[cell], profile.radii[cell + 1]
    u = low + (target - first) / np.maximum(last - first, 1e-300) * (high - low)
    u = np.clip(u, low, high)
    for _ in range(_ITERATIONS_MAX):
        value, slope, _ = _radial(lens, u)
        beyond = value > target
        low, high = np.where(beyond, low, u), np.where(beyond, u, high)
        step = u - (value - target) / np.maximum(slope, 1e-300)
        step = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        moved = float((np.abs(step - u) / (1.0 + u)).max(initial=0.0))
        u = step
        if moved <= _PRECISION:
            break
    return np.where(within, u, np.nan)


def _fisheye_image(lens: Lens, x: Array, y: Array, z: Array) -> Array:
    across = np.sqrt(x * x + y * y)
    angle = np.arctan2(across, z)
    angle = np.where(angle <= _profile(lens).end_rad, angle, np.nan)
    # On the axis the image is the centre; exactly behind, the azimuth is undefined.
    stretch = _radial(lens, angle)[0] / np.where(across > 0, across, np.nan)
    stretch = np.where((across == 0) & (z > 0), 0.0, stretch)
    return np.stack([x * stretch, y * stretch], axis=-1)


def _fisheye_directions(lens: Lens, points: Array) -> Array:
    x, y = points.T
    radius = np.sqrt(x * x + y * y)
    angle = _invert_radial(lens, radius)
    # sin(a) / r goes to 1 at the centre.
    share = np.where(radius > 0, np.sin(angle) / np.where(radius > 0, radius, 1.0), 1.0)
    return np.column_stack([x * share, y * share, np.cos(angle)])


def _globe(points: Array) -> Array:
    longitude, latitude = points.T
    seen = (np.abs(longitude) <= math.pi) & (np.abs(latitude) <= 0.5 * math.pi)
    longitude, latitude = np.where(seen, longitude, np.nan), np.where(seen, latitude, np.nan)
    across = np.cos(latitude)
    return np.column_stack(
        [across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)]
    )


def _distort(lens: Lens, plane: Array) -> Array:
    """Brown and Conrady's distortion of points of the plane; NaN where it folds over."""
    x, y = plane[..., 0], plane[..., 1]
    radius = np.sqrt(x * x + y * y)
    inside = np.where(radius <= _profile(lens).arguments[-1], 1.0, np.nan)
    bent, jacobian = _distort_with_jacobian(lens, x * inside, y * inside)
    upright = jacobian[0] * jacobian[3] - jacobian[1] * jacobian[2] > 0.0
    return np.where(upright[..., None], np.stack(bent, axis=-1), np.nan)


def _distort_with_jacobian(
    lens: Lens, x: Array, y: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array, Array, Array]]:
    """Distorted coordinates of points, and the Jacobian by rows: xx, xy, yx, yy."""
    _, _, p1, p2, *_ = lens.coefficients
    s = x * x + y * y
    r = np.sqrt(s)
    value, slope, _ = _radial(lens, r)
    away = np.where(r > 0, r, 1.0)
    radial = np.where(r > 0, value / away, 1.0)
    # d(radial) / ds, times 2: radial depends on x and y by s alone.
    twice = np.where(r > 0, (slope - radial) / (away * away), 0.0)
    bent_x = x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x)
    bent_y = y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y
    xx = radial + x * x * twice + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + y * y * twice + 6.0 * p1 * y + 2.0 * p2 * x
    xy = x * y * twice + 2.0 * p1 * x + 2.0 * p2 * y
    return (bent_x, bent_y), (xx, xy, xy, yy)


def _undistort(lens: Lens, points: Array) -> Array:
    """The inverse of ``_distort``, [n, 2]; NaN for points without an inverse."""
    radius = np.sqrt((points * points).sum(axis=1))
    end = float(_profile(lens).radii[-1])
    tangential = any(lens.coefficients[2:4])
    # Tangential terms shift the rim: points slightly beyond it may still have an inverse.
    start = np.minimum(radius, end * (1.0 - 1e-6)) if tangential else radius
    safe = np.where(radius > 0, radius, 1)
    stretch = np.where(radius > 0, _invert_radial(lens, start) / safe, 1.0)
    plane = points * stretch[:, None]
    return _refine_inverse(lens, plane, points) if tangential else plane


def _refine_inverse(lens: Lens, plane: Array, target: Array) -> Array:
    """Invert the distortion by Newton's method; steps that increase the error are halved.

    From start values ``plane`` to the undistorted points of ``target``, [n, 2] each; NaN where the
    iteration fails. The lens has tangential terms.
    """
    miss, step = _newton_step(lens, plane, target)
    pace = np.ones(len(plane))
    for _ in range(_ITERATIONS_MAX):
        trial = plane - pace[:, None] * step
        trial_miss, trial_step = _newton_step(lens, trial, target)
        nearer = trial_miss < miss
        plane = np.where(nearer[:, None], trial, plane)
        step = np.where(nearer[:, None], trial_step, step)
        miss = np.where(nearer, trial_miss, miss)
        pace = np.where(nearer, 1.0, 0.5 * pace)
        if not ((miss > _PRECISION) & (pace > 1e-6)).any():
            break
    return np.where((miss <= _MISSED)[:, None], plane, np.nan)


def _newton_step(lens: Lens, plane: Array, target: Array) -> tuple[Array, Array]:
    """Error of points, [n], inf outside the lens's field, and the Newton step, [n, 2]."""
    bent, (xx, xy, yx, yy) = _distort_with_jacobian(lens, plane[:, 0], plane[:, 1])
    ex, ey = bent[0] - target[:, 0], bent[1] - target[:, 1]
    determinant = xx * yy - xy * yx
    end = float(_profile(lens).arguments[-1])
    valid = ((plane * plane).sum(axis=1) <= end * end) & (determinant > 0.0)
    divisor = np.where(valid, determinant, 1.0)
    step = np.column_stack([(yy * ex - xy * ey) / divisor, (xx * ey - yx * ex) / divisor])
    return np.where(valid, np.maximum(np.abs(ex), np.abs(ey)), np.inf), step
