"""Conversion between Warp structs and NumPy records."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


@cache
def struct_dtype(struct: Any) -> np.dtype[Any]:
    """Structured dtype of a Warp struct; cached, because Warp computes it on every request."""
    dtype: np.dtype[Any] = np.dtype(struct.numpy_dtype())
    return dtype


def stack_records(records: Sequence[NDArray[np.void]], struct: Any) -> NDArray[np.void]:
    """Concatenated records of one struct; a single record of zeros if there are none."""
    dtype = struct_dtype(struct)
    joined = np.frombuffer(b"".join(record.tobytes() for record in records), dtype)
    return joined.copy() if len(joined) else np.zeros(1, dtype)


def to_device(records: NDArray[np.void], struct: Any, device: wp.Device) -> wp.array:
    """Upload records as an array.

    ``wp.array`` would compute the structured dtype again, which takes longer than copying.
    """
    shape = records.shape
    here = wp.array(ptr=records.ctypes.data, dtype=struct, shape=shape, device="cpu")
    return wp.clone(here, device=device)


def take_rows(values: wp.array, rows: NDArray[np.integer]) -> wp.array:
    """Some rows of a contiguous array, copied on its own device."""
    taken = wp.empty((len(rows), *values.shape[1:]), dtype=values.dtype, device=values.device)
    width = values.size // max(len(values), 1)
    for k, row in enumerate(rows.tolist()):
        wp.copy(taken, values, k * width, row * width, width)
    return taken


def copy_struct(instance: Any, struct: Any) -> Any:
    """A shallow copy of an instance of a Warp struct."""
    copy = struct()
    for name in struct.vars:
        setattr(copy, name, getattr(instance, name))
    return copy
