"""Distributions over rotations, directions and positions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from pydantic import AfterValidator, Field

from gen_data.config.distributions import base
from gen_data.config.yaml_scalars import format_number
from gen_data.core.se3 import Quaternion, Vec3, multiply_quaternions, rotate_by_quaternion

if TYPE_CHECKING:
    from gen_data.core.streams import Rng


def _unit(parts: tuple[float, ...], noun: str) -> tuple[float, ...]:
    largest = max(abs(v) for v in parts)
    if largest == 0:
        raise base.Malformed(f"{noun} must not be zero")
    scaled = [v / largest for v in parts]
    square = sum(v * v for v in scaled)
    # One that is unit already to the last digits stays as it is: reading it back changes nothing.
    if largest <= 1 and abs(square * largest * largest - 1) < 1e-12:
        return parts
    norm = math.sqrt(square)
    return tuple(v / norm for v in scaled)


UnitQuaternion = Annotated[
    tuple[float, float, float, float],
    base.sized(4, "expected a quaternion [w, x, y, z]"),
    AfterValidator(lambda parts: _unit(parts, "a quaternion")),
]
"""A rotation, scalar first; normalised."""
UnitVector = Annotated[
    tuple[float, float, float],
    base.sized(3, "expected a direction [x, y, z]"),
    AfterValidator(lambda parts: _unit(parts, "a direction")),
]
"""A direction; normalised."""


@base.parameters
class QuaternionWxyz(base.Distribution[Quaternion], key="quaternion_wxyz", kinds=("rotation",)):
    """A fixed rotation as a quaternion, scalar first; it is normalised."""

    quaternion_wxyz: UnitQuaternion

    def draw(self, rng: Rng) -> Quaternion:  # noqa: ARG002
        """The rotation; uses no random number."""
        return self.quaternion_wxyz

    def outcomes(self) -> tuple[Quaternion, ...]:
        """The rotation alone."""
        return (self.quaternion_wxyz,)


@base.parameters
class EulerDeg(base.Distribution[Quaternion], key="euler_deg", kinds=("rotation",)):
    """A fixed rotation: roll about X, then pitch about Y, then yaw about Z, all fixed axes [deg].

    The convention of URDF: R = Rz(yaw) Ry(pitch) Rx(roll).
    """

    roll_pitch_yaw_deg: Annotated[
        tuple[float, float, float],
        base.sized(3, "expected three angles [roll, pitch, yaw] in degrees"),
    ] = Field(description="[roll, pitch, yaw] in degrees, fixed axes")

    def draw(self, rng: Rng) -> Quaternion:  # noqa: ARG002
        """The rotation; uses no random number."""
        roll, pitch, yaw = (_half_turn_deg(v) for v in self.roll_pitch_yaw_deg)
        about_x = (roll[0], roll[1], 0.0, 0.0)
        about_y = (pitch[0], 0.0, pitch[1], 0.0)
        about_z = (yaw[0], 0.0, 0.0, yaw[1])
        return multiply_quaternions(about_z, multiply_quaternions(about_y, about_x))


@base.parameters
class So3(base.Distribution[Quaternion], key="so3", kinds=("rotation",), bare=True):
    """Every rotation is equally likely.

    Source: Shoemake, "Uniform random rotations", Graphics Gems III, 1992.
    """

    def draw(self, rng: Rng) -> Quaternion:
        """One unit quaternion, scalar first."""
        u1, u2, u3 = rng.random(), 2 * math.pi * rng.random(), 2 * math.pi * rng.random()
        a, b = math.sqrt(1 - u1), math.sqrt(u1)
        return (
            base.round_significant(b * math.cos(u3)),
            base.round_significant(a * math.sin(u2)),
            base.round_significant(a * math.cos(u2)),
            base.round_significant(b * math.sin(u3)),
        )


@base.parameters
class AboutZ(base.Distribution[Quaternion], key="about_z", kinds=("rotation",), bare=True):
    """A turn about the vertical; every angle of the range is equally likely.

    Attributes:
        yaw_deg: Range of the angle [deg].
    """

    yaw_deg: Annotated[
        tuple[float, float], base.sized(2, "about_z needs two numbers [low, high]")
    ] = Field((0.0, 360.0), description="[low, high] in degrees")

    def __post_init__(self) -> None:
        """Refuse a reversed range."""
        base.require_order(self.name, *self.yaw_deg)

    def draw(self, rng: Rng) -> Quaternion:
        """One unit quaternion, scalar first."""
        low, high = self.yaw_deg
        cosine, sine = _half_turn_deg(low + (high - low) * rng.random())
        return cosine, 0.0, 0.0, sine


@base.parameters
class Sphere(base.Distribution[Vec3], key="sphere", kinds=("direction",), bare=True):
    """Every direction is equally likely.

    By Archimedes' hat-box theorem the height on the unit sphere is uniform.
    """

    def draw(self, rng: Rng) -> Vec3:
        """One unit vector."""
        return _on_sphere(-1.0, 1.0, rng)


@base.parameters
class Cap(base.Distribution[Vec3], key="cap", kinds=("direction",)):
    """Directions within a cone about an axis, uniform by area on the unit sphere.

    Attributes:
        axis: Unit vector; normalised.
        half_angle_deg: From the axis to the rim [deg], 0 to 180.
    """

    axis: UnitVector
    half_angle_deg: float = Field(json_schema_extra={"minimum": 0, "maximum": 180})

    def __post_init__(self) -> None:
        """Refuse an impossible angle."""
        if not 0 <= self.half_angle_deg <= 180:
            raise base.Malformed(
                f"cap needs half_angle_deg in [0, 180], got {format_number(self.half_angle_deg)}",
                ("half_angle_deg",),
            )

    def draw(self, rng: Rng) -> Vec3:
        """One unit vector."""
        rim = base.round_significant(math.cos(math.radians(self.half_angle_deg)))
        return rotate_by_quaternion(_from_z(self.axis), _on_sphere(rim, 1.0, rng))


@base.parameters
class Box(base.Distribution[Vec3], key="box", kinds=("position",), needs="two corners [low, high]"):
    """Positions in an axis-aligned box, uniform by volume.

    Attributes:
        low_m, high_m: Opposite corners [m].
    """

    low_m: base.Vector
    high_m: base.Vector

    def __post_init__(self) -> None:
        """Refuse reversed corners."""
        for axis, low, high in zip("xyz", self.low_m, self.high_m, strict=True):
            base.require_order(f"box along {axis}", low, high)

    def draw(self, rng: Rng) -> Vec3:
        """One position [m]."""
        (x0, y0, z0), (x1, y1, z1) = self.low_m, self.high_m
        return (
            x0 + (x1 - x0) * rng.random(),
            y0 + (y1 - y0) * rng.random(),
            z0 + (z1 - z0) * rng.random(),
        )


@base.parameters
class Shell(base.Distribution[Vec3], key="shell", kinds=("position",)):
    """Positions between two spheres, uniform by volume.

    The cube of the radius and the sine of the elevation are uniform.

    Attributes:
        center_m: Common centre [m].
        radius_m: Inner and outer radius [m].
        elevation_deg: Range of the angle above the horizontal [deg], -90 to 90.
    """

    center_m: base.Vector
    radius_m: Annotated[
        tuple[float, float], base.sized(2, "radius_m needs two numbers [low, high]")
    ] = Field(description="[inner, outer]")
    elevation_deg: Annotated[
        tuple[float, float], base.sized(2, "elevation_deg needs two numbers [low, high]")
    ] = Field((-90.0, 90.0), description="[low, high], -90 to 90")

    def __post_init__(self) -> None:
        """Refuse reversed or impossible ranges."""
        base.require_order("shell radius_m", *self.radius_m, "radius_m")
        if self.radius_m[0] < 0:
            fact = f"shell needs radius_m >= 0, got {format_number(self.radius_m[0])}"
            raise base.Malformed(fact, ("radius_m",))
        low, high = self.elevation_deg
        base.require_order("shell elevation_deg", low, high, "elevation_deg")
        if low < -90 or high > 90:
            given = f"[{format_number(low)}, {format_number(high)}]"
            fact = f"shell needs elevation_deg within [-90, 90], got {given}"
            raise base.Malformed(fact, ("elevation_deg",))

    def draw(self, rng: Rng) -> Vec3:
        """One position [m]."""
        inner, outer = self.radius_m
        cubed = inner**3 + (outer**3 - inner**3) * rng.random()
        radius_m = min(max(base.round_significant(cubed ** (1 / 3)), inner), outer)
        low, high = (base.round_significant(math.sin(math.radians(v))) for v in self.elevation_deg)
        x, y, z = _on_sphere(low, high, rng)
        cx, cy, cz = self.center_m
        return cx + radius_m * x, cy + radius_m * y, cz + radius_m * z


def _on_sphere(sine_low: float, sine_high: float, rng: Rng) -> Vec3:
    """A unit vector whose height is uniform between two sines of elevation."""
    z = min(sine_low + (sine_high - sine_low) * rng.random(), sine_high)
    azimuth_rad = 2 * math.pi * rng.random()
    ring = math.sqrt(max(0.0, 1 - z * z))
    return (
        base.round_significant(ring * math.cos(azimuth_rad)),
        base.round_significant(ring * math.sin(azimuth_rad)),
        z,
    )


def _from_z(axis: Vec3) -> Quaternion:
    """The shortest rotation that takes +Z to a unit vector."""
    x, y, z = axis
    if z < -1 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    norm = math.sqrt((1 + z) * (1 + z) + x * x + y * y)
    return (1 + z) / norm, -y / norm, x / norm, 0.0


def _half_turn_deg(angle_deg: float) -> tuple[float, float]:
    half_rad = math.radians(0.5 * angle_deg)
    return base.round_significant(math.cos(half_rad)), base.round_significant(math.sin(half_rad))
