"""Warp devices, with reproducible code generation."""

from __future__ import annotations

from functools import cache

import warp as wp

from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.silence_stdio import silence_stdio

# Not -march=native: fused multiply-adds would change bytes between machines. The inlining threshold
# saves a quarter of all ray time.
_COMPILER_FLAGS = "-ffp-contract=off -mllvm=-inline-threshold=30000"


def open_device(name: str) -> wp.Device:
    """The Warp device named ``auto``, ``cpu`` or ``cuda:N``.

    Raises:
        ConfigError: the machine has no such device.
    """
    _start()
    if name == "auto":
        name = "cuda:0" if wp.is_cuda_available() else "cpu"
    known = ["cpu", *(device.alias for device in wp.get_cuda_devices())]
    if name not in known:
        raise ConfigError(
            f"renderer device '{name}' does not exist on this machine; it has {', '.join(known)}."
            " Choose 'auto' or 'cpu', or install an NVIDIA driver."
        )
    return wp.get_device(name)


@cache
def _start() -> None:
    if hasattr(wp.config, "log_level"):
        wp.config.log_level = wp.LOG_ERROR
    else:
        wp.config.quiet = True
    wp.config.enable_backward = False
    wp.config.cpu_compiler_flags = _COMPILER_FLAGS
    with silence_stdio():  # Warp warns about a missing CUDA driver
        wp.init()
