"""The CPU takes the path of a GPU: its results can then be checked on any machine.

Kernels are compiled from the text for CUDA, one lane per thread; the host sees a device with
separate memory; lists that a GPU fills in any order are shuffled. Threads still run one after
another, and arithmetic is the CPU's.
"""

import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import warp as wp

from gen_data.renderers.warp import device

_FLAGS = " -DAS_ON_GPU -D__ffs=__builtin_ffs"
_LISTING = frozenset({"find_edges", "find_thin", "find_contrasts", "gather_light"})
"""Kernels whose first two outputs are the length of a list and the list, in any order."""


def _asked_by_warp() -> bool:
    return str(sys._getframe(2).f_globals["__name__"]).startswith("warp")


def pretend() -> None:
    """Make this process take the path of a GPU, for good. No kernel may be loaded yet."""
    opened: Any = device
    opened._COMPILER_FLAGS += _FLAGS
    opened.compile_kernels = _compile_on_first_use
    opened._start()
    # The CPU stays one to Warp, and is a GPU to the renderer.
    kind: Any = wp.Device
    kind.is_cpu = property(lambda _: _asked_by_warp())
    kind.is_cuda = property(lambda _: not _asked_by_warp())
    wp.launch = partial(_launch, wp.launch)


def _compile_on_first_use(alias: str) -> None:
    del alias


def _launch(launch: Callable[..., Any], kernel: Any, *args: Any, **kwargs: Any) -> Any:
    """Launch a kernel, and deal the list that it makes into another order."""
    result = launch(kernel, *args, **kwargs)
    if kernel.key in _LISTING:
        count, listed = (kwargs["outputs"] if "outputs" in kwargs else args[2])[:2]
        values = listed.numpy()[: count.numpy()[0]]
        values[:] = np.concatenate([values[k::7] for k in (3, 0, 6, 2, 5, 1, 4)])
    return result
