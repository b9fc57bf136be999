"""Distributions over rotations, directions and positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from generator.config.distributions.base import (
    Distribution,
    Kind,
    Malformed,
    in_order,
    inside,
    read_fields,
    read_number,
    read_range,
    read_vector,
    stable,
)
from generator.config.scalars import number, shown
from generator.core.se3 import Quaternion, Vec3, multiply_quaternions, rotate_by_quaternion

if TYPE_CHECKING:
    from generator.core.streams import Rng

_VECTOR_SCHEMA = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_RANGE_SCHEMA = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_NOTHING_SCHEMA: Mapping[str, Any] = {"type": "null"}


@dataclass(frozen=True)
class QuaternionWxyz(Distribution[Quaternion]):
    """A fixed rotation as a quaternion, scalar first; it is normalised."""

    quaternion_wxyz: Quaternion

    name: ClassVar[str] = "quaternion_wxyz"
    kinds: ClassVar[frozenset[str]] = frozenset({"rotation"})

    def __post_init__(self) -> None:
        """Normalise."""
        object.__setattr__(self, "quaternion_wxyz", read_quaternion(self.quaternion_wxyz))

    def draw(self, rng: Rng) -> Quaternion:  # noqa: ARG002
        """The rotation; uses no random number."""
        return self.quaternion_wxyz

    def outcomes(self) -> tuple[Quaternion, ...]:
        """The rotation alone."""
        return (self.quaternion_wxyz,)

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> QuaternionWxyz:  # noqa: ARG003
        """Read ``[w, x, y, z]``."""
        return cls(read_quaternion(argument))

    def argument(self) -> list[float]:
        """``[w, x, y, z]``."""
        return list(self.quaternion_wxyz)

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """Four numbers."""
        return dict(constant)


@dataclass(frozen=True)
class EulerDeg(Distribution[Quaternion]):
    """A fixed rotation: roll about X, then pitch about Y, then yaw about Z, all fixed axes [deg].

    The convention of URDF: R = Rz(yaw) Ry(pitch) Rx(roll).
    """

    roll_pitch_yaw_deg: Vec3

    name: ClassVar[str] = "euler_deg"
    kinds: ClassVar[frozenset[str]] = frozenset({"rotation"})

    def draw(self, rng: Rng) -> Quaternion:  # noqa: ARG002
        """The rotation; uses no random number."""
        roll, pitch, yaw = (_half_turn_deg(v) for v in self.roll_pitch_yaw_deg)
        about_x = (roll[0], roll[1], 0.0, 0.0)
        about_y = (pitch[0], 0.0, pitch[1], 0.0)
        about_z = (yaw[0], 0.0, 0.0, yaw[1])
        return multiply_quaternions(about_z, multiply_quaternions(about_y, about_x))

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> EulerDeg:  # noqa: ARG003
        """Read ``[roll, pitch, yaw]``."""
        return cls(read_vector(argument, "three angles [roll, pitch, yaw] in degrees"))

    def argument(self) -> list[float]:
        """``[roll, pitch, yaw]``."""
        return list(self.roll_pitch_yaw_deg)

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG003
        """Three numbers."""
        return {**_VECTOR_SCHEMA, "description": "[roll, pitch, yaw] in degrees, fixed axes"}


@dataclass(frozen=True)
class So3(Distribution[Quaternion]):
    """Every rotation is equally likely.

    Source: Shoemake, "Uniform random rotations", Graphics Gems III, 1992.
    """

    name: ClassVar[str] = "so3"
    kinds: ClassVar[frozenset[str]] = frozenset({"rotation"})
    bare: ClassVar[bool] = True

    def draw(self, rng: Rng) -> Quaternion:
        """One unit quaternion, scalar first."""
        u1, u2, u3 = rng.random(), 2 * math.pi * rng.random(), 2 * math.pi * rng.random()
        a, b = math.sqrt(1 - u1), math.sqrt(u1)
        return (
            stable(b * math.cos(u3)),
            stable(a * math.sin(u2)),
            stable(a * math.cos(u2)),
            stable(b * math.sin(u3)),
        )

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> So3:  # noqa: ARG003
        """Read nothing."""
        _read_nothing(argument, cls.name)
        return cls()

    def argument(self) -> None:
        """Nothing."""

    def to_yaml(self) -> str:
        """The bare name."""
        return self.name

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG003
        """Nothing."""
        return dict(_NOTHING_SCHEMA)


@dataclass(frozen=True)
class AboutZ(Distribution[Quaternion]):
    """A turn about the vertical; every angle of the range is equally likely.

    Attributes:
        yaw_deg: Range of the angle [deg].
    """

    yaw_deg: tuple[float, float] = (0.0, 360.0)

    name: ClassVar[str] = "about_z"
    kinds: ClassVar[frozenset[str]] = frozenset({"rotation"})
    bare: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a reversed range."""
        in_order(self.name, *self.yaw_deg)

    def draw(self, rng: Rng) -> Quaternion:
        """One unit quaternion, scalar first."""
        low, high = self.yaw_deg
        cosine, sine = _half_turn_deg(low + (high - low) * rng.random())
        return cosine, 0.0, 0.0, sine

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> AboutZ:  # noqa: ARG003
        """Read ``[low, high]`` in degrees, or nothing for a full turn."""
        return cls() if argument is None else cls(read_range(argument, cls.name, read_number))

    def argument(self) -> list[float]:
        """``[low, high]`` in degrees."""
        return list(self.yaw_deg)

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG003
        """Two numbers, or nothing."""
        angles = {**_RANGE_SCHEMA, "description": "[low, high] in degrees"}
        return {"anyOf": [angles, dict(_NOTHING_SCHEMA)]}


@dataclass(frozen=True)
class Sphere(Distribution[Vec3]):
    """Every direction is equally likely.

    By Archimedes' hat-box theorem the height on the unit sphere is uniform.
    """

    name: ClassVar[str] = "sphere"
    kinds: ClassVar[frozenset[str]] = frozenset({"direction"})
    bare: ClassVar[bool] = True

    def draw(self, rng: Rng) -> Vec3:
        """One unit vector."""
        return _on_sphere(-1.0, 1.0, rng)

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Sphere:  # noqa: ARG003
        """Read nothing."""
        _read_nothing(argument, cls.name)
        return cls()

    def argument(self) -> None:
        """Nothing."""

    def to_yaml(self) -> str:
        """The bare name."""
        return self.name

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG003
        """Nothing."""
        return dict(_NOTHING_SCHEMA)


@dataclass(frozen=True)
class Cap(Distribution[Vec3]):
    """Directions within a cone about an axis, uniform by area on the unit sphere.

    Attributes:
        axis: Unit vector; normalised.
        half_angle_deg: From the axis to the rim [deg], 0 to 180.
    """

    axis: Vec3
    half_angle_deg: float

    name: ClassVar[str] = "cap"
    kinds: ClassVar[frozenset[str]] = frozenset({"direction"})

    def __post_init__(self) -> None:
        """Normalise the axis; refuse an impossible angle."""
        object.__setattr__(self, "axis", read_direction(self.axis))
        if not 0 <= self.half_angle_deg <= 180:
            raise Malformed(
                f"cap needs half_angle_deg in [0, 180], got {number(self.half_angle_deg)}",
                ("half_angle_deg",),
            )

    def draw(self, rng: Rng) -> Vec3:
        """One unit vector."""
        rim = stable(math.cos(math.radians(self.half_angle_deg)))
        return rotate_by_quaternion(_from_z(self.axis), _on_sphere(rim, 1.0, rng))

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Cap:  # noqa: ARG003
        """Read ``{axis, half_angle_deg}``."""
        fields = read_fields(argument, cls.name, ("axis", "half_angle_deg"))
        with inside("axis"):
            axis = read_direction(fields["axis"])
        with inside("half_angle_deg"):
            half_angle_deg = read_number(fields["half_angle_deg"])
        return cls(axis, half_angle_deg)

    def argument(self) -> dict[str, Any]:
        """``{axis, half_angle_deg}``."""
        return {"axis": list(self.axis), "half_angle_deg": self.half_angle_deg}

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """Axis and angle."""
        return {
            "type": "object",
            "properties": {
                "axis": dict(constant),
                "half_angle_deg": {"type": "number", "minimum": 0, "maximum": 180},
            },
            "required": ["axis", "half_angle_deg"],
            "additionalProperties": False,
        }


@dataclass(frozen=True)
class Box(Distribution[Vec3]):
    """Positions in an axis-aligned box, uniform by volume.

    Attributes:
        low_m, high_m: Opposite corners [m].
    """

    low_m: Vec3
    high_m: Vec3

    name: ClassVar[str] = "box"
    kinds: ClassVar[frozenset[str]] = frozenset({"position"})

    def __post_init__(self) -> None:
        """Refuse reversed corners."""
        for axis, low, high in zip("xyz", self.low_m, self.high_m, strict=True):
            in_order(f"box along {axis}", low, high)

    def draw(self, rng: Rng) -> Vec3:
        """One position [m]."""
        (x0, y0, z0), (x1, y1, z1) = self.low_m, self.high_m
        return (
            x0 + (x1 - x0) * rng.random(),
            y0 + (y1 - y0) * rng.random(),
            z0 + (z1 - z0) * rng.random(),
        )

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Box:  # noqa: ARG003
        """Read two corners."""
        if not isinstance(argument, (list, tuple)) or len(argument) != 2:
            raise Malformed(f"box needs two corners [low, high], got {shown(argument)}")
        with inside(0):
            low_m = read_vector(argument[0])
        with inside(1):
            high_m = read_vector(argument[1])
        return cls(low_m, high_m)

    def argument(self) -> list[list[float]]:
        """Two corners."""
        return [list(self.low_m), list(self.high_m)]

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """Two corners."""
        return {"type": "array", "items": dict(constant), "minItems": 2, "maxItems": 2}


@dataclass(frozen=True)
class Shell(Distribution[Vec3]):
    """Positions between two spheres, uniform by volume.

    The cube of the radius and the sine of the elevation are uniform.

    Attributes:
        center_m: Common centre [m].
        radius_m: Inner and outer radius [m].
        elevation_deg: Range of the angle above the horizontal [deg], -90 to 90.
    """

    center_m: Vec3
    radius_m: tuple[float, float]
    elevation_deg: tuple[float, float] = (-90.0, 90.0)

    name: ClassVar[str] = "shell"
    kinds: ClassVar[frozenset[str]] = frozenset({"position"})

    def __post_init__(self) -> None:
        """Refuse reversed or impossible ranges."""
        with inside("radius_m"):
            in_order("shell radius_m", *self.radius_m)
            if self.radius_m[0] < 0:
                raise Malformed(f"shell needs radius_m >= 0, got {number(self.radius_m[0])}")
        with inside("elevation_deg"):
            low, high = self.elevation_deg
            in_order("shell elevation_deg", low, high)
            if low < -90 or high > 90:
                raise Malformed(
                    "shell needs elevation_deg within [-90, 90], "
                    f"got [{number(low)}, {number(high)}]"
                )

    def draw(self, rng: Rng) -> Vec3:
        """One position [m]."""
        inner, outer = self.radius_m
        cubed = inner**3 + (outer**3 - inner**3) * rng.random()
        radius_m = min(max(stable(cubed ** (1 / 3)), inner), outer)
        low, high = (stable(math.sin(math.radians(v))) for v in self.elevation_deg)
        x, y, z = _on_sphere(low, high, rng)
        cx, cy, cz = self.center_m
        return cx + radius_m * x, cy + radius_m * y, cz + radius_m * z

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Shell:  # noqa: ARG003
        """Read ``{center_m, radius_m, elevation_deg}``; the last may be missing."""
        fields = read_fields(argument, cls.name, ("center_m", "radius_m"), ("elevation_deg",))
        with inside("center_m"):
            center_m = read_vector(fields["center_m"])
        with inside("radius_m"):
            radius_m = read_range(fields["radius_m"], "radius_m", read_number)
        if "elevation_deg" not in fields:
            return cls(center_m, radius_m)
        with inside("elevation_deg"):
            elevation_deg = read_range(fields["elevation_deg"], "elevation_deg", read_number)
        return cls(center_m, radius_m, elevation_deg)

    def argument(self) -> dict[str, Any]:
        """``{center_m, radius_m, elevation_deg}``."""
        return {
            "center_m": list(self.center_m),
            "radius_m": list(self.radius_m),
            "elevation_deg": list(self.elevation_deg),
        }

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """Centre, radii, elevations."""
        return {
            "type": "object",
            "properties": {
                "center_m": dict(constant),
                "radius_m": {**_RANGE_SCHEMA, "description": "[inner, outer]"},
                "elevation_deg": {**_RANGE_SCHEMA, "description": "[low, high], -90 to 90"},
            },
            "required": ["center_m", "radius_m"],
            "additionalProperties": False,
        }


def read_quaternion(value: Any) -> Quaternion:
    """A unit quaternion, scalar first; Malformed if it is not four numbers, or zero."""
    if not isinstance(value, (list, tuple)) or len(value) != 4:
        raise Malformed(f"expected a quaternion [w, x, y, z], got {shown(value)}")
    q: list[float] = []
    for i, item in enumerate(value):
        with inside(i):
            q.append(read_number(item))
    w, x, y, z = _normalised(q, "a quaternion")
    return w, x, y, z


def read_direction(value: Any) -> Vec3:
    """A unit vector; Malformed if it is not three numbers, or zero."""
    x, y, z = _normalised(list(read_vector(value, "a direction [x, y, z]")), "a direction")
    return x, y, z


def _normalised(parts: list[float], what: str) -> list[float]:
    largest = max(abs(v) for v in parts)
    if largest == 0:
        raise Malformed(f"{what} must not be zero")
    scaled = [v / largest for v in parts]
    square = sum(v * v for v in scaled)
    # One that is unit already to the last digits stays as it is: reading it back changes nothing.
    if largest <= 1 and abs(square * largest * largest - 1) < 1e-12:
        return parts
    norm = math.sqrt(square)
    return [v / norm for v in scaled]


def _on_sphere(sine_low: float, sine_high: float, rng: Rng) -> Vec3:
    """A unit vector whose height is uniform between two sines of elevation."""
    z = min(sine_low + (sine_high - sine_low) * rng.random(), sine_high)
    azimuth_rad = 2 * math.pi * rng.random()
    ring = math.sqrt(max(0.0, 1 - z * z))
    return stable(ring * math.cos(azimuth_rad)), stable(ring * math.sin(azimuth_rad)), z


def _from_z(axis: Vec3) -> Quaternion:
    """The shortest rotation that takes +Z to a unit vector."""
    x, y, z = axis
    if z < -1 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    norm = math.sqrt((1 + z) * (1 + z) + x * x + y * y)
    return (1 + z) / norm, -y / norm, x / norm, 0.0


def _half_turn_deg(angle_deg: float) -> tuple[float, float]:
    """Cosine and sine of half the angle."""
    half_rad = math.radians(0.5 * angle_deg)
    return stable(math.cos(half_rad)), stable(math.sin(half_rad))


def _read_nothing(argument: Any, name: str) -> None:
    if argument is not None:
        raise Malformed(f"{name} takes no argument, got {shown(argument)}; write {name} alone")
