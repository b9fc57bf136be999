"""Columns of devices' measurements: the dtypes of ``Measurements.rows``.

Every device declares its columns in its own file. Every table has a ``time_s``, in seconds from the
beginning of the sequence. Axes are the device's, X forward, Y left, Z up, unless the name differs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

TIME_DECIMALS = 9
"""Decimals of instants: sums of different terms give the same instant."""


@dataclass(frozen=True, slots=True)
class Column:
    """One quantity of a table.

    Attributes:
        name: With its unit at the end.
        type: Type of the stored number, as numpy spells it, little-endian.
        meaning: In a few words; value for "nothing".
    """

    name: str
    type: str
    meaning: str


TIME = Column("time_s", "<f8", "since the beginning of the sequence")


def columns_dtype(columns: Sequence[Column]) -> np.dtype[np.void]:
    """Type of a row with these columns."""
    return np.dtype([(column.name, column.type) for column in columns])


def table_rows(columns: Sequence[Column], count: int, /, **values: ArrayLike) -> NDArray[np.void]:
    """Rows of a table: one value per row, or one for all; columns that are not given are 0."""
    rows: NDArray[Any] = np.zeros(count, columns_dtype(columns))
    for name, given in values.items():
        rows[name] = given
    rows["time_s"] = np.round(rows["time_s"], TIME_DECIMALS)
    return rows
