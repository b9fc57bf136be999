"""What a parameter may be: the noun, the kinds of value, and the table of distributions.

A new distribution is one class and one line in ``DISTRIBUTIONS``.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from generator.config.scalars import abbreviated, number, shown
from generator.core.errors import did_you_mean
from generator.core.plugins import PluginTable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from generator.core.streams import Rng

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

DISTRIBUTIONS: PluginTable[Distribution[Any]] = PluginTable(
    "distribution",
    {
        "constant": "generator.config.distributions.discrete:Constant",
        "choice": "generator.config.distributions.discrete:Choice",
        "sequence": "generator.config.distributions.discrete:Sequence",
        "probability": "generator.config.distributions.discrete:Probability",
        "uniform": "generator.config.distributions.numeric:Uniform",
        "log_uniform": "generator.config.distributions.numeric:LogUniform",
        "normal": "generator.config.distributions.numeric:Normal",
        "uniform_integer": "generator.config.distributions.numeric:UniformInteger",
        "quaternion_wxyz": "generator.config.distributions.space:QuaternionWxyz",
        "euler_deg": "generator.config.distributions.space:EulerDeg",
        "so3": "generator.config.distributions.space:So3",
        "about_z": "generator.config.distributions.space:AboutZ",
        "sphere": "generator.config.distributions.space:Sphere",
        "cap": "generator.config.distributions.space:Cap",
        "box": "generator.config.distributions.space:Box",
        "shell": "generator.config.distributions.space:Shell",
    },
)


class Malformed(ValueError):
    """A value that is no distribution, and where in it the fault lies.

    Attributes:
        fact: What is wrong and what was expected.
        path: Keys and indices from the value of the field down to the fault.
        at_key: The last key of the path is at fault, not its value.
    """

    def __init__(
        self, fact: str, path: tuple[str | int, ...] = (), *, at_key: bool = False
    ) -> None:
        super().__init__(fact)
        self.fact = fact
        self.path = path
        self.at_key = at_key


@contextmanager
def inside(*path: str | int) -> Iterator[None]:
    """Whatever is malformed within lies below ``path``."""
    try:
        yield
    except Malformed as error:
        raise Malformed(error.fact, (*path, *error.path), at_key=error.at_key) from None


@dataclass(frozen=True, eq=False)
class Kind(Generic[T]):
    """What a field's values are.

    Attributes:
        name: What distributions declare in ``kinds``.
        expected: How messages name a constant of it: ``a number``.
        read: The value a plain constant stands for; raises Malformed.
        read_key: The same for a key of a mapping, which is always text.
        schema: JSON Schema of a constant.
        example: A constant, as plain data.
    """

    name: str
    expected: str
    read: Callable[[Any], T]
    read_key: Callable[[str], T]
    schema: Mapping[str, Any]
    example: Any


class Distribution(ABC, Generic[T_co]):
    """A parameter that is drawn anew for each scene or view.

    Frozen and comparable. In YAML it is a mapping with one key, its name. One that needs no
    argument can also be written as that name alone.
    """

    name: ClassVar[str]
    kinds: ClassVar[frozenset[str]]
    bare: ClassVar[bool] = False

    @abstractmethod
    def draw(self, rng: Rng) -> T_co:
        """One value."""

    def outcomes(self) -> tuple[T_co, ...]:
        """Every value that can be drawn, where they are few; empty = a continuum."""
        return ()

    @classmethod
    @abstractmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Distribution[Any]:
        """The distribution that ``{name: argument}`` stands for. Raises Malformed."""

    @abstractmethod
    def argument(self) -> Any:
        """What ``from_yaml`` reads back."""

    def to_yaml(self) -> Any:
        """Plain data that reads back as this distribution."""
        return {self.name: self.argument()}

    @classmethod
    @abstractmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """JSON Schema of the argument; ``constant`` is the schema of one value of the field."""


class Numeric(Distribution[T_co]):
    """A distribution over numbers, whose reach can be checked without drawing."""

    @abstractmethod
    def mean(self) -> float:
        """Expected value."""

    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value that can be drawn."""


def read(value: Any, kind: Kind[T]) -> Distribution[T]:
    """The distribution a plain value stands for: a constant, a name, or a one-key mapping.

    Raises:
        Malformed: if it stands for none, or for one that does not fit the kind.
    """
    if isinstance(value, Distribution):
        return read(value.to_yaml(), kind)
    if isinstance(value, Mapping):
        return _read_mapping(value, kind)
    if isinstance(value, str) and kind.name != "name":
        known = names_of(kind.name)
        if value in known and distribution(value).bare:
            return distribution(value).from_yaml(None, kind)
        if did_you_mean(value, known):
            raise _unknown(value, kind)
    return distribution("constant").from_yaml(value, kind)


def _read_mapping(value: Mapping[str, Any], kind: Kind[T]) -> Distribution[T]:
    known = names_of(kind.name)
    if len(value) != 1:
        raise Malformed(
            f"a distribution is a mapping with one key, got {len(value)} keys; "
            f"expected one of {', '.join(known)}"
        )
    ((name, argument),) = value.items()
    if name not in known:
        raise _unknown(name, kind, (name,))
    with inside(name):
        return distribution(name).from_yaml(argument, kind)


def _unknown(name: str, kind: Kind[Any], path: tuple[str, ...] = ()) -> Malformed:
    known = names_of(kind.name)
    if name in known:
        return Malformed(f"'{name}' needs an argument; write {{{name}: ...}}")
    if name in DISTRIBUTIONS:
        fact = f"distribution '{name}' does not give {kind.expected}"
    else:
        fact = f"unknown distribution '{abbreviated(name)}'"
    return Malformed(
        f"{fact}; expected one of {', '.join(known)}{did_you_mean(name, known)}",
        path,
        at_key=bool(path),
    )


@cache
def distribution(name: str) -> type[Distribution[Any]]:
    """The class of a distribution; ConfigError if the name is unknown."""
    found: type[Distribution[Any]] = DISTRIBUTIONS.load(name)
    return found


@cache
def names_of(kind: str) -> tuple[str, ...]:
    """Names of the distributions over one kind of value, in the order of the table."""
    ordered = (
        *DISTRIBUTIONS.entries,
        *(n for n in DISTRIBUTIONS if n not in DISTRIBUTIONS.entries),
    )
    return tuple(name for name in ordered if kind in distribution(name).kinds)


def read_number(value: Any) -> float:
    """A finite number; Malformed if it is anything else."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise Malformed(f"expected a number, got {shown(value)}")
    if not math.isfinite(value):
        raise Malformed(f"expected a finite number, got {value}")
    return float(value)


def read_whole_number(value: Any) -> int:
    """A whole number; Malformed if it is anything else."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise Malformed(f"expected a whole number, got {shown(value)}")
    return value


def read_range(value: Any, name: str, item: Callable[[Any], T]) -> tuple[T, T]:
    """Two values ``[low, high]``; their order is the distribution's business."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise Malformed(f"{name} needs two numbers [low, high], got {shown(value)}")
    with inside(0):
        low = item(value[0])
    with inside(1):
        high = item(value[1])
    return low, high


def read_vector(value: Any, what: str = "three numbers [x, y, z]") -> tuple[float, float, float]:
    """Three finite numbers."""
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise Malformed(f"expected {what}, got {shown(value)}")
    parts: list[float] = []
    for i, item in enumerate(value):
        with inside(i):
            parts.append(read_number(item))
    return parts[0], parts[1], parts[2]


def read_fields(
    value: Any, name: str, required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> Mapping[str, Any]:
    """A mapping that has all required keys and no others than the optional ones."""
    known = (*required, *optional)
    if not isinstance(value, Mapping):
        raise Malformed(f"{name} needs a mapping with {', '.join(known)}, got {shown(value)}")
    for key in value:
        if key not in known:
            raise Malformed(
                f"unknown key {shown(key)} of {name}; expected {', '.join(known)}"
                f"{did_you_mean(key, known)}",
                (key,),
                at_key=True,
            )
    for key in required:
        if key not in value:
            raise Malformed(f"{name} needs '{key}'")
    return value


def in_order(name: str, low: float, high: float) -> None:
    """Malformed unless ``low <= high``."""
    if not low <= high:
        raise Malformed(f"{name} needs low <= high, got [{number(low)}, {number(high)}]")


def stable(value: float) -> float:
    """The value on a grid of 12 significant digits.

    exp(), sin() and their like differ in the last bit between C libraries and processors; on the
    grid they agree.
    """
    return float(f"{value:.12g}")
