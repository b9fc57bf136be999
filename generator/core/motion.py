"""Motion: trajectories of bodies and joints, twists, and instantaneous changes of state.

Poses are computed with ``+ - * / sqrt`` only, without transcendental functions: they have the same
bits on every processor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, se3


@dataclass(frozen=True, slots=True)
class Twist:
    """Velocity, acceleration and angular velocity of a frame at one instant, world axes.

    Attributes:
        velocity_m_s, acceleration_m_s2: Velocity and acceleration of the frame's origin.
        angular_velocity_rad_s: Angular velocity of the frame.
    """

    velocity_m_s: se3.Vec3 = (0.0, 0.0, 0.0)
    acceleration_m_s2: se3.Vec3 = (0.0, 0.0, 0.0)
    angular_velocity_rad_s: se3.Vec3 = (0.0, 0.0, 0.0)

    def seen_along(self, T_world_frame: se3.SE3) -> "Twist":
        """The same motion, expressed in the axes of another frame."""
        w, x, y, z = T_world_frame.quaternion_wxyz
        inverse = (w, -x, -y, -z)
        return Twist(
            se3.rotate_by_quaternion(inverse, self.velocity_m_s),
            se3.rotate_by_quaternion(inverse, self.acceleration_m_s2),
            se3.rotate_by_quaternion(inverse, self.angular_velocity_rad_s),
        )


STILL = Twist()
_SLOPE_WEIGHTS = ((-1.5, 2.0, -0.5), (-0.5, 0.0, 0.5), (0.5, -2.0, 1.5))
"""Weights of three places for the slope of their parabola at each of them, per step."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Trajectory of one body: poses at equal time steps, interpolated.

    Positions follow cubic Hermite curves with the slopes of Catmull and Rom (1974), which make
    velocity continuous; slopes at both ends are taken from the parabola through three knots, which
    makes constant acceleration exact. Rotations are interpolated linearly and normalised. The
    second
    derivative of such curves jumps at knots, and so does the rate of such rotations: acceleration
    and angular velocity are interpolated between central differences over a step instead, and
    extrapolated to both ends. Before the first and after the last knot the body is at rest.

    Attributes:
        body: Name of the body.
        step_s: Time between knots.
        knots: ``T_world_body`` at ``start_s + k * step_s``; at least two.
        start_s: Time of the first knot.
    """

    body: str
    step_s: float
    knots: tuple[se3.SE3, ...]
    start_s: float = 0.0

    def __post_init__(self) -> None:
        """Validate the knots.

        Raises:
            ValueError: fewer than two knots, or a step of 0 or less.
        """
        if len(self.knots) < 2 or not self.step_s > 0.0:
            raise ValueError(f"the track of '{self.body}' needs two knots and a step above 0 s")

    @property
    def end_s(self) -> float:
        """Time of the last knot."""
        return self.start_s + (len(self.knots) - 1) * self.step_s

    def pose(self, time_s: float) -> se3.SE3:
        """``T_world_body`` at an instant."""
        k, f = self._place(time_s)
        if f == 0.0:
            return self.knots[k]
        if f == 1.0:
            return self.knots[k + 1]
        weights = (
            (1.0 + 2.0 * f) * (1.0 - f) * (1.0 - f),
            f * (1.0 - f) * (1.0 - f),
            f * f * (3.0 - 2.0 * f),
            f * f * (f - 1.0),
        )
        return se3.SE3(self._combine(k, weights), self._interpolate_rotation(k, f))

    def poses(self, times_s: NDArray[np.floating]) -> tuple[se3.Array, se3.Array]:
        """Rotation matrices [n, 3, 3] and translations [n, 3] at several instants, as ``pose``."""
        rotations, translations = interpolate_poses((self,), times_s)
        return rotations[0], translations[0]

    def twist(self, time_s: float) -> Twist:
        """Twist of the body at an instant; ``STILL`` outside the knots."""
        if not self.start_s <= time_s <= self.end_s:
            return STILL
        k, f = self._place(time_s)
        h = self.step_s
        slope = (
            6.0 * f * (f - 1.0),
            (1.0 - f) * (1.0 - 3.0 * f),
            6.0 * f * (1.0 - f),
            f * (3 * f - 2),
        )
        return Twist(
            self._combine(k, tuple(w / h for w in slope)),
            self._acceleration(k + f),
            self._angular_velocity(k + f),
        )

    def carried_twist(self, time_s: float, arm_m: se3.Vec3) -> Twist:
        """Motion of a point on the body at an instant.

        With the lever arm r of the point, the velocity is ``v + w x r`` and the acceleration
        ``a + dw/dt x r + w x (w x r)``.

        Args:
            time_s: The instant.
            arm_m: From the body's origin to the point, outer axes.
        """
        body = self.twist(time_s)
        spin = body.angular_velocity_rad_s
        swing = _cross(spin, arm_m)
        inward = _sum(_cross(spin, swing), _cross(self.angular_acceleration(time_s), arm_m))
        return Twist(_sum(body.velocity_m_s, swing), _sum(body.acceleration_m_s2, inward), spin)

    def angular_acceleration(self, time_s: float) -> se3.Vec3:
        """Angular acceleration [rad/s^2] at an instant, outer axes; 0 outside the knots.

        The change of the angular velocity over a step around the instant, within the knots.
        """
        if not self.start_s <= time_s <= self.end_s or self.end_s == self.start_s:
            return (0.0, 0.0, 0.0)
        first_s = max(time_s - 0.5 * self.step_s, self.start_s)
        last_s = min(time_s + 0.5 * self.step_s, self.end_s)
        before, after = (
            self._angular_velocity((t - self.start_s) / self.step_s) for t in (first_s, last_s)
        )
        x, y, z = ((b - a) / (last_s - first_s) for a, b in zip(before, after, strict=True))
        return (x, y, z)

    def _acceleration(self, steps: float) -> se3.Vec3:
        """Acceleration [m/s^2] after a number of steps, from second differences at knots."""
        inner = len(self.knots) - 2
        if inner < 1:
            return (0.0, 0.0, 0.0)
        # Second difference k is that at knot k + 1.
        k = min(max(math.floor(steps) - 1, 0), max(inner - 2, 0))
        one = self._second_difference(k)
        if inner == 1:
            return one
        return _extrapolate(one, self._second_difference(k + 1), steps - 1.0 - k)

    def _second_difference(self, k: int) -> se3.Vec3:
        a, b, c = (self.knots[k + i].translation_m for i in range(3))
        x, y, z = ((a[i] - 2.0 * b[i] + c[i]) / (self.step_s * self.step_s) for i in range(3))
        return (x, y, z)

    def _angular_velocity(self, steps: float) -> se3.Vec3:
        """Angular velocity [rad/s], outer axes: means over steps, at their middles, and between."""
        count = len(self.knots) - 1
        k = min(max(math.floor(steps - 0.5), 0), max(count - 2, 0))
        one = _mean_angular_velocity(self.knots[k], self.knots[k + 1], self.step_s)
        if count == 1:
            return one
        other = _mean_angular_velocity(self.knots[k + 1], self.knots[k + 2], self.step_s)
        return _extrapolate(one, other, steps - 0.5 - k)

    def _place(self, time_s: float) -> tuple[int, float]:
        """Index of the knot before an instant, and the elapsed share of the step in [0, 1]."""
        last = len(self.knots) - 2
        # Rounded: instants summed in different ways must give the same pose.
        steps = round((time_s - self.start_s) / self.step_s, 9)
        k = min(max(math.floor(steps), 0), last)
        return k, min(max(steps - k, 0.0), 1.0)

    def _combine(self, k: int, weights: tuple[float, ...]) -> se3.Vec3:
        """Weighted sum of position and slope at knot k and at the next one."""
        a, b = self.knots[k].translation_m, self.knots[k + 1].translation_m
        from_, to = self._slope(k), self._slope(k + 1)
        x, y, z = (
            weights[0] * a[i] + weights[1] * from_[i] + weights[2] * b[i] + weights[3] * to[i]
            for i in range(3)
        )
        return (x, y, z)

    def _slope(self, k: int) -> se3.Vec3:
        """Displacement per step at a knot: the slope of the parabola through the nearest knots."""
        last = len(self.knots) - 1
        if last == 1:
            (x0, y0, z0), (x1, y1, z1) = (knot.translation_m for knot in self.knots)
            return (x1 - x0, y1 - y0, z1 - z0)
        first = min(max(k - 1, 0), last - 2)
        weights = _SLOPE_WEIGHTS[k - first]
        near = [self.knots[first + i].translation_m for i in range(3)]
        x, y, z = (sum(w * p[i] for w, p in zip(weights, near, strict=True)) for i in range(3))
        return (x, y, z)

    def _interpolate_rotation(self, k: int, f: float) -> tuple[float, float, float, float]:
        a, b = self.knots[k].quaternion_wxyz, self.knots[k + 1].quaternion_wxyz
        sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
        w, x, y, z = ((1.0 - f) * p + f * sign * q for p, q in zip(a, b, strict=True))
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        return (w / norm, x / norm, y / norm, z / norm)


def interpolate_poses(
    tracks: Sequence[Trajectory], times_s: NDArray[np.floating]
) -> tuple[se3.Array, se3.Array]:
    """Poses of several bodies at several instants, as ``Trajectory.pose``.

    Returns:
        Rotation matrices [tracks, n, 3, 3] and translations [tracks, n, 3].
    """
    times = np.asarray(times_s, np.float64)
    rotations = np.zeros((len(tracks), len(times), 3, 3))
    translations = np.zeros((len(tracks), len(times), 3))
    grids: dict[tuple[float, float, int], list[int]] = {}
    for i, track in enumerate(tracks):
        grids.setdefault((track.start_s, track.step_s, len(track.knots)), []).append(i)
    for (start_s, step_s, _), members in grids.items():
        # The rounding of ``Trajectory._place``, vectorised.
        steps = np.rint((times - start_s) / step_s * 1e9) / 1e9
        knots = [tracks[i].knots for i in members]
        rotations[members], translations[members] = _between(knots, steps)
    return rotations, translations


def _between(ways: Sequence[tuple[se3.SE3, ...]], steps: se3.Array) -> tuple[se3.Array, se3.Array]:
    """Interpolate several trajectories with equal numbers of knots, as ``interpolate_poses``."""
    last = len(ways[0]) - 1
    k = np.clip(np.floor(steps), 0, last - 1).astype(np.intp)
    f = np.clip(steps - k, 0.0, 1.0)[:, None]
    first, end = max(int(k.min()) - 1, 0), min(int(k.max()) + 2, last)
    near = [way[first : end + 1] for way in ways]
    places = np.array([[knot.translation_m for knot in way] for way in near])
    turns = np.array([[knot.quaternion_wxyz for knot in way] for way in near])
    i = np.arange(end + 1 - first)
    before, after = np.maximum(i - 1, 0), np.minimum(i + 1, end - first)
    slopes = (places[:, after] - places[:, before]) / (after - before)[:, None]
    if end - first > 1:
        # Ends of the trajectory, as in ``Trajectory._slope``; at other ends slopes are not used.
        for k_end, three in ((0, places[:, :3]), (2, places[:, -3:])):
            weights = np.array(_SLOPE_WEIGHTS[k_end])[:, None]
            slopes[:, 0 if k_end == 0 else -1] = (three * weights).sum(axis=1)
    k -= first
    g = 1.0 - f
    translations = (
        (1.0 + 2.0 * f) * g * g * places[:, k]
        + f * g * g * slopes[:, k]
        + f * f * (3.0 - 2.0 * f) * places[:, k + 1]
        + f * f * (f - 1.0) * slopes[:, k + 1]
    )
    a, b = turns[:, k], turns[:, k + 1]
    same = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    sign = np.where(same + a[..., 3] * b[..., 3] >= 0.0, 1.0, -1.0)[..., None]
    rotations = se3.quaternions_to_rotations((g * a + f * sign * b).reshape(-1, 4))
    return rotations.reshape(*a.shape[:2], 3, 3), translations


@dataclass(frozen=True, slots=True)
class JointTrajectory:
    """Trajectory of a robot's joint positions, linear between knots.

    Attributes:
        step_s: Time between knots.
        knots: One position per movable joint [rad or m], at ``start_s + k * step_s``.
        start_s: Time of the first knot.
    """

    step_s: float
    knots: tuple[tuple[float, ...], ...]
    start_s: float = 0.0

    def positions(self, time_s: float) -> tuple[float, ...]:
        """Positions at an instant; constant before the first and after the last knot."""
        last = len(self.knots) - 1
        steps = min(max(round((time_s - self.start_s) / self.step_s, 9), 0.0), float(last))
        k = min(math.floor(steps), last - 1) if last else 0
        one, other = self.knots[k], self.knots[min(k + 1, last)]
        return tuple(
            round((1.0 - (steps - k)) * a + (steps - k) * b, 6) + 0.0
            for a, b in zip(one, other, strict=True)
        )


@dataclass(frozen=True, slots=True)
class StateChange:
    """Change of a body's appearance at an instant: a lamp switches on, a walk takes a step.

    Attributes:
        time_s: Instant of the change; it lasts until the next change of the same body.
        body: Name of the body.
        asset: New mesh asset; empty = unchanged.
        materials: One per mesh slot; empty = unchanged.
        attributes: Changed attributes of its instance, ``(name, value)``.
    """

    time_s: float
    body: str
    asset: str = ""
    materials: tuple[asset_types.Material, ...] = ()
    attributes: tuple[tuple[str, str], ...] = ()


def _cross(a: se3.Vec3, b: se3.Vec3) -> se3.Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _sum(a: se3.Vec3, b: se3.Vec3) -> se3.Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _extrapolate(one: se3.Vec3, other: se3.Vec3, share: float) -> se3.Vec3:
    """The value at a share of the way from one to the other, or beyond them."""
    x, y, z = ((1.0 - share) * a + share * b for a, b in zip(one, other, strict=True))
    return (x, y, z)


def _mean_angular_velocity(one: se3.SE3, other: se3.SE3, step_s: float) -> se3.Vec3:
    """Mean angular velocity between two poses, in the outer frame's axes."""
    w, x, y, z = one.quaternion_wxyz
    dw, dx, dy, dz = se3.multiply_quaternions(other.quaternion_wxyz, (w, -x, -y, -z))
    if dw < 0.0:
        dw, dx, dy, dz = -dw, -dx, -dy, -dz
    sine = math.sqrt(dx * dx + dy * dy + dz * dz)
    rate = 2.0 * math.atan2(sine, dw) / (sine * step_s) if sine > 1e-12 else 2.0 / step_s
    return (rate * dx, rate * dy, rate * dz)
