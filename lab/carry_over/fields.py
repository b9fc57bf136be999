"""Fields of configurations that change a quantity: remedies where two sets differ."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gen_data.config.data_files import load_data
from gen_data.lab.carry_over.differences import Direction, Row
from gen_data.lab.carry_over.statistics import WHOLE

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

_TABLE: Mapping[str, Mapping[str, Any]] = load_data(__package__, "fields")
FIELDS_MAX = 3
"""Fields that are named for one row."""


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a kind of plug-in, or of ``labels``; ``fields.yaml`` explains the attributes."""

    kind: str
    path: str
    type: str = ""
    sign: int = 0
    needs: str = ""
    without: str = ""
    of_group: bool = False

    @property
    def name(self) -> str:
        """Place in a configuration, for plug-ins of any name."""
        return f"{self.kind} {self.type}: {self.path}" if self.type else f"{self.kind}: {self.path}"


def fields_of(quantity: str) -> list[Field]:
    """Fields that set a quantity, the most direct first."""
    fields = []
    for name in _TABLE["quantities"][quantity]:
        listed = [Field(**row) for row in _TABLE["sets"][name.removeprefix("-")]]
        fields += [replace(f, sign=-f.sign) if name[0] == "-" else f for f in listed]
    return fields


def remedies(row: Row, config: "Config | None", groups: Collection[str]) -> list[str]:
    """Changes of fields that bring our values closer to the real ones, the most direct first.

    Args:
        row: A row that differs.
        config: Our configuration; None = unknown.
        groups: Names of the groups that draw objects of the row's class; empty = unknown.
    """
    fields = fields_of(row.quantity)
    named = [] if config is None else [*_in_use(fields, config, groups, row.label)]
    if not named:
        return [f"set {field.name}" for field in fields[:FIELDS_MAX]]
    return [f"{_verb(field, row.direction)} {place}" for field, place in named[:FIELDS_MAX]]


def _verb(field: Field, direction: Direction) -> str:
    if direction in ("wider", "narrower"):
        return "narrow" if direction == "wider" else "widen"
    if not field.sign:
        return "change"
    return "lower" if (direction == "larger") == (field.sign > 0) else "raise"


def _in_use(
    fields: Sequence[Field], config: "Config", groups: Collection[str], label: str
) -> Iterator[tuple[Field, str]]:
    """Fields of the plug-ins of a configuration, with their paths as ``--set`` takes them."""
    probe = config.probes[0]
    used: Mapping[str, Sequence[Any]] = {
        "randomizer": probe.randomizers,
        "sensor": config.sensors,
        "element": probe.elements,
    }
    for field in fields:
        if field.kind == "labels":
            yield field, f"labels.{field.path}"
            continue
        for plugin in used[field.kind]:
            group = getattr(plugin, "group", "") or plugin.name
            is_of_class = not field.of_group or label == WHOLE or not groups or group in groups
            if plugin.type == field.type and is_of_class and _is_used(plugin, field):
                yield field, f"{field.kind}s.{plugin.name}.{field.path}"


def _is_used(plugin: Any, field: Field) -> bool:
    """Whether the plug-in has a value there; another field takes the place of one without."""
    if (field.needs and not getattr(plugin, field.needs)) or (
        field.without and getattr(plugin, field.without) is not None
    ):
        return False
    value = plugin
    for key in field.path.split("."):
        value = getattr(value, key, None)
    return value is not None
