"""Bounds of procedural objects that come with the package.

Bounds decide where objects stand, and scenes try several times as many objects as they keep. With
empty caches, each of them would be made for its bounds alone.

The table is ``BOUNDS`` of ``content``: a row of a key and two corners for the mesh of each
object, followed by a row with the same key for its body, if it has one, sorted by key. A key has
the first 64 bits of the content key of the stored bounds, which changes with the version of the
family: rows of other versions are never found.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.content import content

ROW = np.dtype([("key", "<u8"), ("corners_m", "<f4", (2, 3))])
"""Key, and smallest and largest coordinates [m]."""
Corners = NDArray[np.float64]
"""Of the mesh and, if there is one, the body: smallest and largest coordinates [m], [1 or 2, 2, 3].
"""


class BoundsTable(NamedTuple):
    """Known bounds, sorted by key.

    Attributes:
        keys: uint64 [n].
        corners_m: Smallest and largest coordinates [m], float32 [n, 2, 3].
    """

    keys: NDArray[np.uint64]
    corners_m: NDArray[np.float32]

    def find(self, content_key: str) -> Corners | None:
        """Bounds by the content key of the stored ones; None if they are not known."""
        key = np.uint64(_short(content_key))
        first, end = (int(np.searchsorted(self.keys, key, side)) for side in ("left", "right"))
        return self.corners_m[first:end].astype(np.float64) if first < end else None


def table_path() -> Path:
    """The file of the table."""
    module = content()
    return Path(str(module.__file__)).with_name(module.BOUNDS)


@cache
def read_table() -> BoundsTable:
    """The table that comes with the package; an empty one where its file is missing."""
    path = table_path()
    rows = np.load(path, allow_pickle=False) if path.is_file() else np.zeros(0, ROW)
    return BoundsTable(rows["key"].copy(), rows["corners_m"].copy())


def encode_rows(known: Mapping[str, Corners]) -> NDArray[Any]:
    """Rows of a table, structured [n], from bounds by content key.

    Bounds that have no exact float32 are left out.
    """
    rows = [
        (_short(key), box)
        for key, corners in sorted(known.items())
        if np.array_equal(corners.astype(np.float32), corners)
        for box in corners.tolist()
    ]
    return np.array(rows, ROW)


def _short(content_key: str) -> int:
    return int(content_key[:16], 16)
