"""Controls of an item's fields: ranges from the schema, densities and drawn values."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from gen_data.config.distributions import Constant, Distribution
from gen_data.config.merging import node_name
from gen_data.config.schema import FieldSchema
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.config.yaml_tree import Node
from gen_data.core.bounded_cache import CountCache
from gen_data.core.streams import Streams
from gen_data.lab.edit.completion import describe_field, item_schema, root_schema

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

SECTIONS = ("elements", "randomizers", "sensors")
"""Sections whose items have controls by name."""
GENERAL = "general"
"""Stands for the fields of a configuration outside these sections."""
RANGES = ("uniform", "log_uniform", "uniform_integer")
HIDDEN = frozenset({"type", "name"})
BINS = 24
DRAWS = 2000
"""Number of draws from which a density is estimated."""


@dataclass(frozen=True)
class Control:
    """A field of an item, shown as a slider, range, switch or set of choices.

    Attributes:
        field: Name of the field.
        kind: ``number``, ``range``, ``normal``, ``chance``, ``flag``, ``choice`` (one of some),
            ``weights`` (a distribution over names) or ``text``, for anything else.
        value: Plain data of the configuration, or the default.
        form: Name of its distribution; empty for a constant.
        low, high, step: Ends and step of the slider.
        legal: Legal values, which may exceed the slider; empty = any, or not numeric.
        options: Legal values of a choice; outcomes of weights.
        help: Type, default and description.
        place: ``file:line`` that gives the value; empty for a default.
    """

    field: str
    kind: str
    value: Any
    form: str = ""
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    legal: str = ""
    options: tuple[Any, ...] = ()
    help: str = ""
    place: str = ""

    def yaml(self, changed: Any) -> Any:
        """Plain data of a changed value.

        Args:
            changed: A number; low and high of a range; mean and deviation of a normal; names that
                are chosen, for weights.
        """
        if self.kind == "range":
            return {self.form: [self._number(one) for one in changed]}
        if self.kind == "normal":
            mean, stddev = changed
            return {"normal": {**self.value["normal"], "mean": mean, "stddev": stddev}}
        if self.kind == "chance":
            return {"probability": round(changed, 4)} if self.form else round(changed, 4)
        if self.kind == "weights":
            old = outcomes(self.value)
            return {"choice": {name: old.get(name, 1) for name in changed}}
        return self._number(changed) if self.kind == "number" else changed

    def _number(self, value: float) -> float | int:
        is_whole = self.form == "uniform_integer" or (self.step >= 1 and float(value).is_integer())
        return round(value) if is_whole else float(f"{value:.6g}")


def list_items(config: "Config") -> list[tuple[str, str]]:
    """Sections and names of all items with controls."""
    document = config.document
    return [
        (GENERAL, ""),
        *(
            (section, node_name(item))
            for section in SECTIONS
            for item in document.entries[section].items
        ),
    ]


def list_controls(config: "Config", section: str, name: str) -> list[Control]:
    """Controls of an item; none if there is no such item."""
    if section == GENERAL:
        model, item = root_schema(), config.document
        fields = [
            f for f in model.fields if not model.child(f).fields and _is_simple(model.child(f))
        ]
    else:
        listed = config.document.entries[section].items if section in SECTIONS else ()
        found = next((one for one in listed if node_name(one) == name), None)
        kind = found.get("type") if found else None
        schema = item_schema(section, str(kind.content)) if kind else None
        if found is None or schema is None:
            return []
        model, item = schema, found
        fields = [field for field in model.fields if field not in HIDDEN]
    return [_control(model, field, item.get(field)) for field in fields]


def _is_simple(field: FieldSchema) -> bool:
    return field.schema.get("type") in ("integer", "number", "boolean")


def _control(model: FieldSchema, name: str, node: Node | None) -> Control:
    field = model.child(name)
    value = node.plain() if node is not None else field.schema.get("default")
    place = ""
    if node is not None and node.position.file != "(default)":
        place = f"{node.position.file.rpartition('/')[2]}:{node.position.line}"
    known: dict[str, Any] = {"value": value, "help": describe_field(model, name), "place": place}
    form = next(iter(value)) if isinstance(value, Mapping) and len(value) == 1 else ""
    kind, choices = _kind(field, value, form)
    if kind in ("choice", "weights"):
        return Control(name, kind, form=form, options=tuple(choices), **known)
    if kind not in ("number", "range", "normal", "chance"):
        return Control(name, kind, form=form, **known)
    low, high, step = _extent(field, value, form, is_angle=name.endswith("_deg"))
    legal = "" if form == "probability" else _legal(field)
    return Control(name, kind, form=form, low=low, high=high, step=step, legal=legal, **known)


def _legal(field: FieldSchema) -> str:
    """Legal values of a field of numbers, in words."""
    limits = next((one.limits for one in (field, *field.branches) if one.limits), None)
    if limits is None:
        return ""
    low = f"{'above' if limits.open_low else 'from'} {limits.low:g}"
    high = f"{'below' if limits.open_high else 'to'} {limits.high:g}"
    return " ".join(text for text in (low, high) if not text.endswith("inf"))


def _kind(field: FieldSchema, value: Any, form: str) -> tuple[str, Sequence[Any]]:
    options = [field, *field.branches]
    numbers = [one for one in options if one.schema.get("type") in ("number", "integer")]
    choices = next((one.choices for one in options if len(one.choices) > 1), [])
    if form == "choice":
        return "weights", list(choices) or list(outcomes(value))
    if form == "probability":
        return "chance", ()
    if form in RANGES and isinstance(value[form], (list, tuple)):
        return "range", ()
    if form == "normal":
        return "normal", ()
    if choices and not form:
        return "choice", choices
    if isinstance(value, bool):
        return "flag", ()
    if isinstance(value, (int, float)) and (numbers or field.branches):
        return "number", ()
    return ("number", ()) if isinstance(value, (int, float)) else ("text", ())


def outcomes(value: Any) -> dict[str, float]:
    """Names of a choice and their weights."""
    listed = value["choice"]
    return dict(listed) if isinstance(listed, Mapping) else dict.fromkeys(map(str, listed), 1)


def _extent(
    field: FieldSchema, value: Any, form: str, *, is_angle: bool
) -> tuple[float, float, float]:
    """Ends and step of a slider: the legal values within the order of magnitude of the value."""
    if form == "probability":
        return 0.0, 1.0, 0.01
    numbers = list(_numbers(value))
    limits = next((one.limits for one in (field, *field.branches) if one.limits), None)
    largest = max((abs(number) for number in numbers), default=0.0) or 1.0
    low, high = (-math.inf, math.inf) if limits is None else (limits.low, limits.high)
    # A full turn for angles; otherwise multiples of the value, or the whole legal range if small.
    reach = 360.0 if is_angle else 4.0 * largest
    low = low if low >= -reach * 5 else -reach
    high = high if high <= reach * 5 else reach
    whole = form == "uniform_integer" or field.schema.get("type") == "integer"
    whole = whole or any(one.schema.get("type") == "integer" for one in field.branches)
    step = 1.0 if whole else 10.0 ** math.floor(math.log10(max(high - low, 1e-6) / 100.0))
    low = low + step if limits is not None and limits.open_low and low == limits.low else low
    low = round(math.ceil(low / step - 1e-9) * step, 12)  # Sliders count steps from there.
    high = high - step if limits is not None and limits.open_high and high == limits.high else high
    return min([low, *numbers]), max([high, *numbers]), step


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, Mapping):
        for one in value.values():
            yield from _numbers(one)
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield from _numbers(one)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield float(value)


@dataclass(frozen=True)
class Density:
    """A declared distribution and values drawn from it, over the same bins or names.

    Attributes:
        labels: Centres of the bins, or names.
        declared, drawn: Shares, which sum to 1 each; 0 of nothing.
        count: Number of drawn values.
    """

    labels: tuple[str, ...]
    declared: tuple[float, ...]
    drawn: tuple[float, ...]
    count: int


def density(distribution: Distribution[Any], drawn: Sequence[Any]) -> Density | None:
    """Density of a distribution of numbers or names, and drawn values; None for others."""
    key = to_flow_yaml(distribution.to_yaml())
    expected = _EXPECTED.get(key, lambda: _draw_many(distribution))
    if not all(isinstance(one, (int, float, str)) for one in expected):
        return None
    if isinstance(expected[0], (str, bool)):
        names = sorted({str(one) for one in (*expected, *drawn)})
        return Density(
            tuple(names),
            _shares([str(e) for e in expected], names),
            _shares([str(d) for d in drawn], names),
            len(drawn),
        )
    numbers, found = np.array(expected, float), np.array(drawn, float)
    low, high = float(min([*numbers, *found])), float(max([*numbers, *found]))
    if all(isinstance(one, int) for one in expected) and high - low < BINS:
        edges = np.arange(math.floor(low) - 0.5, math.ceil(high) + 1.0)
    else:
        edges = np.linspace(low, high if high > low else low + 1.0, BINS + 1)
    centers = tuple(f"{c:.4g}" for c in 0.5 * (edges[1:] + edges[:-1]))
    declared, seen = (np.histogram(one, edges)[0] / max(len(one), 1) for one in (numbers, found))
    return Density(centers, tuple(declared.tolist()), tuple(seen.tolist()), len(drawn))


_EXPECTED: CountCache[list[Any]] = CountCache(64)


def _draw_many(distribution: Distribution[Any]) -> list[Any]:
    rng = Streams(0, 0).rng("edit/density")
    drawn = []
    for turn in range(DRAWS):
        rng.index = turn  # A sequence takes its values in turn.
        drawn.append(distribution.draw(rng))
    return drawn


def _shares(values: Sequence[str], names: Sequence[str]) -> tuple[float, ...]:
    return tuple(values.count(name) / max(len(values), 1) for name in names)


def find_distribution(
    config: "Config | None", section: str, name: str, field: str
) -> Distribution[Any] | None:
    """Distribution of a field of an item in the first scene; None if it is constant or absent."""
    listed: Sequence[Any] = getattr(config.probes[0], section, ()) if config else ()
    item = next((one for one in listed if getattr(one, "name", None) == name), None)
    value = getattr(item, field, None) if isinstance(item, BaseModel) else None
    is_drawn = isinstance(value, Distribution) and not isinstance(value, Constant)
    return value if is_drawn else None


def low_middle_high(distribution: Distribution[Any]) -> tuple[Any, Any, Any] | None:
    """The 2nd, 50th and 98th percentile of a distribution of numbers; None for others."""
    rng = Streams(0, 0).rng("edit/quantiles")
    values = [distribution.draw(rng) for _ in range(DRAWS // 4)]
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        return None
    low, middle, high = np.quantile(values, (0.02, 0.5, 0.98), method="nearest").tolist()
    return low, middle, high


def three_values(
    control: Control, distribution: Distribution[Any] | None
) -> tuple[Any, Any, Any] | None:
    """Low, middle and high value of a field: of its distribution, or half and twice a number."""
    if distribution is not None:
        return low_middle_high(distribution)
    if control.kind != "number":
        return None
    value = float(control.value)
    if value == 0.0:
        values = (control.low, 0.5 * (control.low + control.high), control.high)
    else:
        values = (0.5 * value, value, 2.0 * value)
    is_whole = isinstance(control.value, int) and control.step >= 1
    limited = (min(max(one, control.low), control.high) for one in values)
    low, middle, high = (control.yaml(round(one) if is_whole else one) for one in limited)
    return low, middle, high
