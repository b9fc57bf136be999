"""Facts about the device, and the compilation of its kernels."""

import sys
import time
from datetime import date
from pathlib import Path
from typing import Any

import warp as wp

from benchmarks.gpu.driver import ask_driver
from benchmarks.runs import machine
from gen_data.core.system_calls import usable_cores
from gen_data.renderers.warp.device import (
    compile_in_parallel,
    kernel_folder,
    load_kernels,
    open_device,
)
from gen_data.renderers.warp.kernel_bundle import kernel_modules


def describe_card(device: str) -> dict[str, Any]:
    """Device, driver, memory, and the machine around it."""
    opened = open_device(device)
    facts: dict[str, Any] = {
        "date": date.today().isoformat(), "device": opened.name, "processor": machine(),
        "cores": usable_cores(), "python": sys.version.split()[0], "warp": wp.config.version,
    }  # fmt: skip
    if opened.is_cuda:
        facts |= {
            "arch": f"sm_{opened.arch}", "multiprocessors": opened.sm_count,
            "memory_mb": round(opened.total_memory / 1e6), "driver": ask_driver("driver_version"),
            "cuda": {"driver": wp.get_cuda_driver_version(), "warp": wp.get_cuda_toolkit_version()},
        }  # fmt: skip
    return facts


def compile_modules(device: str) -> dict[str, Any]:
    """Compile all kernel modules side by side, as far as they are not cached."""
    folder = kernel_folder()
    started_s = time.time()
    complete = compile_in_parallel(open_device(device).alias, kernel_modules(), folder)
    wall_s = time.time() - started_s
    made = [path for path in folder.glob("wp_gen_data.*/*") if path.stat().st_mtime >= started_s]
    return {
        "complete": complete, "wall_s": round(wall_s, 1), "compiled": len({p.parent for p in made}),
    }  # fmt: skip


def load_modules(device: str) -> dict[str, dict[str, float]]:
    """Seconds to load each module, which compiles a missing one, and size of its code [kB]."""
    alias = open_device(device).alias
    suffixes = {".o"} if alias == "cpu" else {".cubin", ".ptx"}
    figures = {}
    for name in kernel_modules():
        started_s = time.perf_counter()
        load_kernels(alias, [name])
        spent_s = time.perf_counter() - started_s
        folders = kernel_folder().glob(f"wp_gen_data.renderers.warp.{name}_*")
        latest = max(folders, key=lambda folder: folder.stat().st_mtime)
        size = sum(f.stat().st_size for f in Path(latest).iterdir() if f.suffix in suffixes)
        figures[name] = {"load_s": round(spent_s, 2), "kb": round(size / 1e3)}
    return figures
