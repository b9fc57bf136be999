"""Results of several kernels in one piece of device memory: the host reads and waits once."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

_HOST: dict[Any, tuple[type[np.generic], tuple[int, ...]]] = {
    float: (np.float32, ()),
    int: (np.int32, ()),
    wp.uint16: (np.uint16, ()),
    wp.vec2: (np.float32, (2,)),
    wp.vec2i: (np.int32, (2,)),
    wp.vec3: (np.float32, (3,)),
}
_ALIGNED = 64
"""Every array begins at a multiple of this many bytes: a line of the processor's cache."""


@dataclass(frozen=True, eq=False, slots=True)
class Readback:
    """Arrays of a device that the host reads together.

    Attributes:
        parts: The arrays, not initialised; valid as long as ``memory`` is.
        memory: Buffer that contains them, one after another.
        dtypes: Their types.
    """

    parts: tuple[wp.array, ...]
    memory: wp.array
    dtypes: tuple[Any, ...]

    @classmethod
    def allocate(cls, count: int, dtypes: Sequence[Any], device: wp.Device) -> "Readback":
        """Arrays of ``count`` elements each."""
        offsets = np.cumsum([0, *(_nbytes(count, dtype) for dtype in dtypes)]).tolist()
        memory = wp.empty(offsets[-1], dtype=wp.uint8, device=device)
        parts = tuple(
            wp.array(ptr=(memory.ptr or 0) + offset, shape=count, dtype=dtype, device=device)
            for offset, dtype in zip(offsets, dtypes, strict=False)
        )
        return cls(parts, memory, tuple(dtypes))

    def numpy(self) -> tuple[NDArray[Any], ...]:
        """The arrays on the host; they keep the memory of all of them alive."""
        values, offset, arrays = self.memory.numpy(), 0, []
        for part, dtype in zip(self.parts, self.dtypes, strict=True):
            kind, shape = _HOST[dtype]
            end = offset + part.size * np.dtype(kind).itemsize * int(np.prod(shape))
            arrays.append(values[offset:end].view(kind).reshape(part.size, *shape))
            offset += _nbytes(part.size, dtype)
        return tuple(arrays)


def _nbytes(count: int, dtype: Any) -> int:
    """Bytes of an array, and of the gap before the next one."""
    kind, shape = _HOST[dtype]
    used = count * np.dtype(kind).itemsize * int(np.prod(shape))
    return -(-used // _ALIGNED) * _ALIGNED
