"""Results of a fit: fitted quantities, compared statistics, changed fields of a configuration."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gen_data.core.se3 import Array
from gen_data.lab.matching.indirect_inference import SPREAD_N, Estimate
from gen_data.lab.matching.quantities import CameraQuantity, LabelQuantity, LidarQuantity, base
from gen_data.lab.matching.real_files import Inventory

NOT_DETERMINED = "the recordings do not determine it"
TOO_FEW_SCENES = "narrower with more --scenes only"


@dataclass(frozen=True, slots=True)
class FittedQuantity:
    """One quantity and its fit.

    Attributes:
        name, unit: Name and unit of the quantity.
        path: Path of its field in the configuration; empty = it has none.
        statistic: The measured statistic.
        before: Typical value of the configuration; None = it has none.
        value: Fitted value in YAML, a number or a distribution. None = none was fitted; for JPEG,
            no compression.
        is_fitted: Whether the value is written.
        mean, low, high: Mean and the ends of its 95 % interval; None = unknown.
        spread: Standard deviation between recordings; None = unknown, or the same in all.
        n: Number of recordings that could be measured.
        n_enough: Number of recordings for an interval that is narrow enough; None = unknown.
        note: Reason if it is not fitted, or a remark.
    """

    name: str
    unit: str
    path: str
    statistic: str
    before: float | None = None
    value: Any = None
    is_fitted: bool = False
    mean: float | None = None
    low: float | None = None
    high: float | None = None
    spread: float | None = None
    n: int = 0
    n_enough: int | None = None
    note: str = ""


@dataclass(frozen=True, eq=False, slots=True)
class ComparedStatistic:
    """A statistic of real recordings, and of simulated ones before and after; NaN = none."""

    name: str
    real: Array
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class FittedField:
    """A field of the configuration with its new value, and the quantities that it states."""

    change: base.FieldChange
    quantities: tuple[FittedQuantity, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """Result for one kind of sensor.

    Attributes:
        remarks: Facts that limit it.
    """

    quantities: tuple[FittedQuantity, ...] = ()
    statistics: tuple[ComparedStatistic, ...] = ()
    fields: tuple[FittedField, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Match:
    """Result of a fit.

    Attributes:
        folder: Folder of the recordings.
        source: Configuration as given.
        resolved: The configuration as plain data.
        inventory: Files that were read and skipped.
        scenes: Number of simulated scenes.
    """

    folder: Path
    source: str
    resolved: Any
    inventory: Inventory
    scenes: int
    parts: tuple[Part, ...]

    @property
    def quantities(self) -> tuple[FittedQuantity, ...]:
        """Of all parts."""
        return tuple(row for part in self.parts for row in part.quantities)

    @property
    def statistics(self) -> tuple[ComparedStatistic, ...]:
        """Of all parts."""
        return tuple(row for part in self.parts for row in part.statistics)

    @property
    def fields(self) -> tuple[FittedField, ...]:
        """Of all parts."""
        return tuple(row for part in self.parts for row in part.fields)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Of all parts."""
        return tuple(text for part in self.parts for text in part.remarks)


def not_fitted(
    quantities: Iterable[CameraQuantity | LidarQuantity | LabelQuantity], reason: str
) -> tuple[FittedQuantity, ...]:
    """Rows of quantities that could not be fitted."""
    return tuple(
        FittedQuantity(q.name, q.unit, getattr(q, "path", ""), q.statistic, note=reason)
        for q in quantities
    )


def fitted_quantity(
    quantity: CameraQuantity | LidarQuantity | LabelQuantity,
    found: Estimate,
    before: float,
    value: Any,
    path: str,
) -> FittedQuantity:
    """Row of an estimate.

    Args:
        quantity: The estimated quantity.
        found: Its estimate.
        before: Coordinate of the configuration's value.
        value: Fitted value in YAML.
        path: Path of its field.
    """
    varies = quantity.axis.varies
    notes = (
        (NOT_DETERMINED, not found.determined),
        ("a single recording has no interval", found.n == 1),
        (f"spread unknown below {SPREAD_N} recordings", varies and 1 < found.n < SPREAD_N),
        (TOO_FEW_SCENES, found.determined and found.n > 1 and found.n_enough is None),
    )
    low, high = interval(found, quantity.to_value)
    return FittedQuantity(
        quantity.name,
        quantity.unit,
        path,
        quantity.statistic,
        quantity.to_value(before),
        value if found.determined else None,
        found.determined,
        quantity.to_value(found.mean),
        low,
        high,
        spread_of(found, quantity.to_value) if varies and found.n >= SPREAD_N else None,
        found.n,
        found.n_enough,
        "; ".join(text for text, applies in notes if applies),
    )


def interval(
    found: Estimate, to_value: Callable[[float], float]
) -> tuple[float | None, float | None]:
    """Ends of the 95 % interval in the parameter's unit; None = without limit."""
    if not math.isfinite(found.half_width):
        return None, None
    return to_value(found.mean - found.half_width), to_value(found.mean + found.half_width)


def spread_of(found: Estimate, to_value: Callable[[float], float]) -> float:
    """Standard deviation in the parameter's unit, from the deviation of its coordinate."""
    below, above = (to_value(found.mean + sign * found.spread) for sign in (-1.0, 1.0))
    return 0.5 * (above - below)
