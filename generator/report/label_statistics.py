"""Statistics of labels by category, collected from a stream."""

import math
from array import array
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gen_data.report.label_files import Label, Picture, Points

Column = NDArray[np.float64]

COLUMNS = (
    "width_px", "height_px", "occlusion_level", "truncation", "visible_fraction", "distance_m",
    "length_m", "width_m", "height_m",
)  # fmt: skip


@dataclass
class Survey:
    """Statistics of a data set; NaN in a column = not annotated.

    Attributes:
        images: Number of objects by (split, image).
        numbers: Rows of ``COLUMNS``, one per object, by (category, KITTI's type).
        points: Numbers of keypoints outside the image, hidden and visible, by category.
        assets: Number of objects by (category, id of the asset).
    """

    images: Counter[tuple[str, str]] = field(default_factory=Counter)
    numbers: "dict[tuple[str, str], array[float]]" = field(default_factory=dict)
    points: dict[str, list[int]] = field(default_factory=dict)
    assets: Counter[tuple[str, str]] = field(default_factory=Counter)

    @property
    def categories(self) -> tuple[str, ...]:
        """Names of the categories, sorted."""
        return tuple(sorted({category for category, _ in self.numbers}))

    def category_columns(self, category: str) -> dict[str, Column]:
        """All columns of a category."""
        return self._columns([key for key in self.numbers if key[0] == category])

    def kind_columns(self, kind: str) -> dict[str, Column]:
        """All columns of one of KITTI's types; empty if there is no such object."""
        return self._columns([key for key in self.numbers if key[1] == kind])

    def objects_per_image(self, split: str | None = None) -> Column:
        """Number of objects in each image of one split, or of all."""
        return np.array(
            [n for (where, _), n in self.images.items() if split in (None, where)], np.float64
        )

    def _columns(self, keys: list[tuple[str, str]]) -> dict[str, Column]:
        parts = [np.array(self.numbers[key]).reshape(-1, len(COLUMNS)) for key in sorted(keys)]
        table = np.concatenate([np.zeros((0, len(COLUMNS))), *parts])
        return {name: table[:, k] for k, name in enumerate(COLUMNS)}


def collect_statistics(records: Iterable[Picture | Label | Points]) -> Survey:
    """Collect the statistics of a report; nine numbers per object stay in memory."""
    found = Survey()
    for record in records:
        add_record(found, record)
    return found


def add_record(found: Survey, record: Picture | Label | Points) -> None:
    """Add one record to the statistics."""
    if isinstance(record, Picture):
        found.images[(record.split, record.name)] += 0
    elif isinstance(record, Points):
        counts = found.points.setdefault(record.category, [0, 0, 0])
        for state, n in enumerate(record.counts):
            counts[state] += n
    else:
        found.images[record.image] += 1
        column = found.numbers.setdefault((record.category, record.kind), array("d"))
        column.extend(_row(record))
        if record.asset:
            found.assets[record.category, record.asset] += 1


def _row(label: Label) -> tuple[float, ...]:
    size_m = label.size_lwh_m or (None, None, None)
    in_image = (label.width_px, label.height_px, label.occlusion_level, label.truncation)
    values = (*in_image, label.visible_fraction, label.distance_m, *size_m)
    return tuple(math.nan if value is None else float(value) for value in values)
