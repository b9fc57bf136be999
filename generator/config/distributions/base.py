"""Distributions as values: the base class, the table, and the reader of their YAML form.

A new distribution is one class with typed fields and one line in ``DISTRIBUTIONS``. Its fields
give its constructor, its YAML form, its messages and its JSON Schema.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, wraps
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, TypeVar, cast

from pydantic import BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass
from typing_extensions import dataclass_transform

from gen_data.config.yaml_scalars import abbreviate, format_number, quote_value, resolve_scalar
from gen_data.core import errors, plugins

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

    from gen_data.core.streams import Rng

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

DISTRIBUTIONS: plugins.PluginTable[Distribution[Any]] = plugins.PluginTable(
    "distribution",
    {
        "constant": "gen_data.config.distributions.discrete:Constant",
        "choice": "gen_data.config.distributions.discrete:Choice",
        "sequence": "gen_data.config.distributions.discrete:Sequence",
        "probability": "gen_data.config.distributions.discrete:Probability",
        "uniform": "gen_data.config.distributions.numeric:Uniform",
        "log_uniform": "gen_data.config.distributions.numeric:LogUniform",
        "normal": "gen_data.config.distributions.numeric:Normal",
        "uniform_integer": "gen_data.config.distributions.numeric:UniformInteger",
        "mixture": "gen_data.config.distributions.mixture:Mixture",
        "quaternion_wxyz": "gen_data.config.distributions.space:QuaternionWxyz",
        "euler_deg": "gen_data.config.distributions.space:EulerDeg",
        "so3": "gen_data.config.distributions.space:So3",
        "about_z": "gen_data.config.distributions.space:AboutZ",
        "sphere": "gen_data.config.distributions.space:Sphere",
        "cap": "gen_data.config.distributions.space:Cap",
        "box": "gen_data.config.distributions.space:Box",
        "shell": "gen_data.config.distributions.space:Shell",
    },
)


class Malformed(ValueError):
    """A value that is not a distribution, and the place of the fault in it.

    Attributes:
        fact: The fault and the expectation.
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


@dataclass(frozen=True, eq=False)
class Kind(Generic[T]):
    """The values of a field.

    Attributes:
        name: Distributions list it in ``kinds``.
        expected: A constant of it in messages: ``a number``.
        read: The value of a plain constant; raises Malformed.
        schema: JSON Schema of a constant.
        of_number: Name of the distribution that a plain number stands for, if it is not a constant.
    """

    name: str
    expected: str
    read: Callable[[Any], T]
    schema: Mapping[str, Any]
    of_number: str = ""

    def read_key(self, text: str) -> T:
        """The value of a key of a mapping, which is always text. Raises Malformed."""
        if self.schema.get("type") == "string":
            return self.read(text)
        if self.schema.get("type") == "array":
            wanted = "weights by value need a number or a name"
            raise Malformed(f"{wanted}, got {quote_value(text)}; use a list")
        try:
            value = resolve_scalar(text)
        except ValueError as error:
            raise Malformed(str(error)) from None
        return self.read(value)


class Distribution(ABC, Generic[T_co]):
    """A parameter that is drawn again for each scene or view.

    Frozen and comparable. In YAML it is a mapping with one key, its name; the value of that key,
    the argument, follows from its fields: nothing without fields, the value of a single field, a
    list of all fields in order if ``needs`` is set, else a mapping of fields.

    Attributes:
        name: Its key in YAML.
        kinds: Names of the kinds of values that it can give.
        bare: The name alone is enough.
        needs: Words for a list of all fields, if that is the argument.
    """

    name: ClassVar[str] = ""
    kinds: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[str] = ""
    bare: ClassVar[bool] = False
    __pydantic_fields__: ClassVar[dict[str, FieldInfo]]

    def __init_subclass__(
        cls, *, key: str = "", kinds: tuple[str, ...] = (), needs: str = "", bare: bool = False
    ) -> None:
        """Attributes of the class are keywords of its definition; others are inherited.

        ``key`` is its name: Python 3.10 takes the keyword ``name`` for the class's.
        """
        super().__init_subclass__()
        cls.name, cls.kinds = key or cls.name, kinds or cls.kinds
        cls.needs, cls.bare = needs or cls.needs, bare or cls.bare

    @abstractmethod
    def draw(self, rng: Rng) -> T_co:
        """One value."""

    def outcomes(self) -> tuple[T_co, ...]:
        """Every value that can be drawn, where they are few; empty = a continuum."""
        return ()

    @classmethod
    def from_yaml(cls, argument: Any, kind: Kind[Any]) -> Distribution[Any]:
        """The distribution that ``{name: argument}`` stands for. Raises Malformed."""
        del kind
        make: Callable[..., Distribution[Any]] = cls
        names = cls.field_names()
        if argument is None and cls.bare:
            return make()
        if not names:
            raise Malformed(
                f"{cls.name} takes no argument, got {quote_value(argument)}; write {cls.name} alone"
            )
        if cls.needs:
            return make(*_require_items(argument, len(names), f"{cls.name} needs {cls.needs}"))
        if len(names) == 1:
            return make(argument)
        if not isinstance(argument, Mapping):
            listed = ", ".join(names.values())
            raise Malformed(
                f"{cls.name} needs a mapping with {listed}, got {quote_value(argument)}"
            )
        return make(**argument)

    def argument(self) -> Any:
        """Plain data that ``from_yaml`` reads back."""
        values = {key: to_plain(getattr(self, name)) for name, key in self.field_names().items()}
        if self.needs:
            return list(values.values())
        if len(values) == 1:
            return next(iter(values.values()))
        return {key: value for key, value in values.items() if value is not None}

    def to_yaml(self) -> Any:
        """Plain data that reads back as this distribution."""
        return {self.name: self.argument()} if self.field_names() else self.name

    @classmethod
    def schema(cls, constant: Mapping[str, Any]) -> dict[str, Any]:
        """JSON Schema of the argument; ``constant`` is the schema of one value of the field."""
        del constant
        whole = _without_titles(TypeAdapter(cls).json_schema())
        parts: list[dict[str, Any]] = list(whole.get("properties", {}).values())
        nothing = {"type": "null"}
        if not parts:
            return nothing
        if cls.needs:
            count = len(parts)
            lengths = {"minItems": count, "maxItems": count, "description": cls.needs}
            return {"type": "array", "items": parts[0], **lengths}
        if len(parts) == 1:
            return {"anyOf": [parts[0], nothing]} if cls.bare else parts[0]
        kept = ("type", "properties", "required", "additionalProperties")
        return {key: whole[key] for key in kept}

    @classmethod
    def field_names(cls) -> dict[str, str]:
        """Attributes, and their keys in YAML."""
        return {name: info.alias or name for name, info in cls.__pydantic_fields__.items()}


class Numeric(Distribution[T_co]):
    """A distribution over numbers, whose reach can be checked without drawing."""

    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value that can be drawn."""


CONFIG = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)

D = TypeVar("D", bound=Distribution[Any])


@dataclass_transform(frozen_default=True, field_specifiers=(field, Field))
def parameters(cls: type[D]) -> type[D]:
    """Make a distribution a frozen dataclass whose fields pydantic validates.

    Its constructor raises Malformed.
    """
    made = cast("type[D]", pydantic_dataclass(frozen=True, config=CONFIG)(cls))
    validate: Callable[..., None] = made.__init__

    @wraps(validate)
    def init(self: D, /, *arguments: Any, **named: Any) -> None:
        try:
            validate(self, *arguments, **named)
        except ValidationError as error:
            raise _malformed(error, made) from None

    # Assigned this way because type checkers take constructors for immutable.
    setattr(made, "__init__", init)  # noqa: B010
    return made


def reader(annotation: Any) -> Callable[[Any], Any]:
    """A function that validates a plain value as a type, and raises Malformed."""
    adapter: TypeAdapter[Any] = TypeAdapter(annotation, config=CONFIG)

    def read_value(value: Any) -> Any:
        try:
            return adapter.validate_python(value)
        except ValidationError as error:
            raise _malformed(error) from None

    return read_value


def sized(count: int, expectation: str) -> BeforeValidator:
    """Accept a list of ``count`` items only; ``expectation`` begins the message."""
    return BeforeValidator(lambda value: tuple(_require_items(value, count, expectation)))


Vector = Annotated[tuple[float, float, float], sized(3, "expected three numbers [x, y, z]")]
"""Three finite numbers."""

read_number = reader(float)


def read_distribution(value: Any, kind: Kind[T]) -> Distribution[T]:
    """The distribution a plain value stands for: a constant, a name, or a one-key mapping.

    Raises:
        Malformed: if it stands for none, or for one that does not fit the kind.
    """
    if isinstance(value, Distribution):
        return read_distribution(value.to_yaml(), kind)
    if isinstance(value, Mapping):
        return _read_mapping(value, kind)
    if isinstance(value, str) and kind.name != "name":
        known = distribution_names(kind.name)
        if value in known and distribution(value).bare:
            return distribution(value).from_yaml(None, kind)
        if errors.did_you_mean(value, known):
            raise _unknown(value, kind)
    if kind.of_number and isinstance(value, (int, float)) and not isinstance(value, bool):
        return distribution(kind.of_number).from_yaml(value, kind)
    return distribution("constant").from_yaml(value, kind)


def _read_mapping(value: Mapping[str, Any], kind: Kind[T]) -> Distribution[T]:
    known = distribution_names(kind.name)
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


@contextmanager
def inside(*path: str | int) -> Iterator[None]:
    """Extend the path of a fault in a part of a value by the path to that part."""
    try:
        yield
    except Malformed as error:
        raise Malformed(error.fact, (*path, *error.path), at_key=error.at_key) from None


def _unknown(name: str, kind: Kind[Any], path: tuple[str, ...] = ()) -> Malformed:
    known = distribution_names(kind.name)
    if name in known:
        return Malformed(f"'{name}' needs an argument; write {{{name}: ...}}")
    if name in DISTRIBUTIONS:
        fact = f"distribution '{name}' does not give {kind.expected}"
    else:
        fact = f"unknown distribution '{abbreviate(name)}'"
    return Malformed(
        f"{fact}; expected one of {', '.join(known)}{errors.did_you_mean(name, known)}",
        path,
        at_key=bool(path),
    )


@cache
def distribution(name: str) -> type[Distribution[Any]]:
    """The class of a distribution; ConfigError if the name is unknown."""
    found: type[Distribution[Any]] = DISTRIBUTIONS.load(name)
    return found


@cache
def distribution_names(kind: str) -> tuple[str, ...]:
    """Names of the distributions over one kind of value, in the order of the table."""
    ordered = (
        *DISTRIBUTIONS.entries,
        *(n for n in DISTRIBUTIONS if n not in DISTRIBUTIONS.entries),
    )
    return tuple(name for name in ordered if kind in distribution(name).kinds)


def require_order(name: str, low: float, high: float, *path: str) -> None:
    """Raise Malformed, at a path, unless ``low <= high``."""
    if not low <= high:
        raise Malformed(
            f"{name} needs low <= high, got [{format_number(low)}, {format_number(high)}]", path
        )


def round_significant(value: float) -> float:
    """The value on a grid of 12 significant digits.

    exp(), sin() and their like differ in the last bit between C libraries and processors; on the
    grid they agree.
    """
    return float(f"{value:.12g}")


def to_plain(value: Any) -> Any:
    """A value with lists instead of tuples, as YAML has them."""
    return [to_plain(item) for item in value] if isinstance(value, tuple) else value


def _require_items(value: Any, count: int, expectation: str) -> list[Any] | tuple[Any, ...]:
    if not isinstance(value, (list, tuple)) or len(value) != count:
        raise Malformed(f"{expectation}, got {quote_value(value)}")
    return value


def _malformed(error: ValidationError, cls: type[Distribution[Any]] | None = None) -> Malformed:
    """The first fault that pydantic found, unknown keys before all others."""
    unknown_key = "unexpected_keyword_argument"
    details = error.errors(include_url=False)
    detail = min(details, key=lambda detail: detail["type"] != unknown_key)
    path = detail["loc"]
    if cls is not None and len(cls.field_names()) == 1:
        path = path[1:]
    cause = detail.get("ctx", {}).get("error")
    if isinstance(cause, Malformed):
        return Malformed(cause.fact, (*path, *cause.path), at_key=cause.at_key)
    if cls is not None and detail["type"] == unknown_key:
        known = list(cls.field_names().values())
        key = str(path[-1])
        return Malformed(
            f"unknown key {quote_value(key)} of {cls.name}; expected {', '.join(known)}"
            f"{errors.did_you_mean(key, known)}",
            path,
            at_key=True,
        )
    if cls is not None and detail["type"] == "missing":
        return Malformed(f"{cls.name} needs '{path[-1]}'")
    return Malformed(_wrong_number(detail), path)


def _wrong_number(detail: ErrorDetails) -> str:
    if detail["type"] == "finite_number":
        return f"expected a finite number, got {detail['input']}"
    expected = "a whole number" if detail["type"].startswith("int") else "a number"
    return f"expected {expected}, got {quote_value(detail['input'])}"


def _without_titles(schema: Any) -> Any:
    """A JSON Schema of pydantic's without the titles and defaults that it adds."""
    if isinstance(schema, list):
        return [_without_titles(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {k: _without_titles(v) for k, v in schema.items() if k not in ("title", "default")}
