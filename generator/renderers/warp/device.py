"""Warp devices, with reproducible code generation and parallel compilation of kernels on first use.

Warp compiles a module when it is first used, one at a time and on one core: the dozen modules that
every image needs would delay the first sample. Here they are copied from the distribution into
Warp's cache if it brings them, and else separate processes compile them side by side. Failures are
harmless: a module that is missing from the cache is compiled on first use.
"""

import hashlib
import os
import platform
import subprocess
import sys
import warnings
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import warp as wp

from gen_data.core import activity, errors, processes, system_calls
from gen_data.renderers.warp import kernel_cache

# Not -march=native: fused multiply-adds would change bytes between machines. The inlining threshold
# saves a quarter of all ray time.
_COMPILER_FLAGS = "-ffp-contract=off -mllvm=-inline-threshold=30000"


def open_device(name: str) -> wp.Device:
    """The Warp device named ``auto``, ``cpu``, ``cuda:N`` or, for the first one, ``cuda``.

    Raises:
        ConfigError: the machine has no such device, or Warp cannot compile for it.
    """
    _start()
    if name == "auto":
        name = "cuda" if wp.is_cuda_available() else "cpu"
    name = "cuda:0" if name == "cuda" else name
    known = ["cpu", *(device.alias for device in wp.get_cuda_devices())]
    if name not in known:
        reason = why_no_gpu()
        raise errors.ConfigError(
            f"render.device: '{name}' does not exist on this machine; it has {', '.join(known)}"
            f"{reason and f' ({reason})'}. Choose 'auto' or 'cpu'."
        )
    device, toolkit = wp.get_device(name), wp.get_cuda_toolkit_version()
    if name == "cpu" or toolkit is None or toolkit < _CUDA_13:
        return device
    if device.arch < _ARCH_MIN_OF_CUDA_13:
        raise errors.ConfigError(
            f"render.device: '{name}' ({device.name}, sm_{device.arch}) is too old for this build"
            f" of warp-lang; expected sm_{_ARCH_MIN_OF_CUDA_13} or newer. Choose 'cpu', or install"
            " a build of warp-lang for CUDA 12."
        )
    return device


_CUDA_13, _ARCH_MIN_OF_CUDA_13 = (13, 0), 75
"""Turing; source: release notes of CUDA 13.0, "deprecated architectures"."""


def why_no_gpu() -> str:
    """Why Warp finds no GPU on this machine, and the remedy, on one line; empty if it finds one."""
    _start()
    if wp.get_cuda_devices():
        return ""
    toolkit, driver = wp.get_cuda_toolkit_version(), wp.get_cuda_driver_version()
    if toolkit is None:
        return "this build of warp-lang has no CUDA; install the one for Linux or Windows on x86_64"
    # Drivers run programs of all minor versions of their CUDA.
    needed = f"{toolkit[0]}.0"
    if driver is None:
        return f"no NVIDIA driver was found; install one for CUDA {needed} or newer"
    if driver < (toolkit[0], 0):
        known = f"{driver[0]}.{driver[1]}"
        return f"its NVIDIA driver is for CUDA {known}, but warp-lang needs {needed}; update it"
    return "the NVIDIA driver shows no device; compare nvidia-smi and CUDA_VISIBLE_DEVICES"


def prepare_device(name: str) -> None:
    """Load the kernels of every image on the device ``auto``, ``cpu`` or ``cuda:N``."""
    alias = open_device(name).alias
    compile_kernels(alias)
    load_kernels(alias, EVERY_FRAME)


@cache
def _start() -> None:
    if hasattr(wp.config, "log_level"):
        wp.config.log_level = wp.LOG_ERROR
    else:
        wp.config.quiet = True
    wp.config.enable_backward = False
    wp.config.cpu_compiler_flags = _COMPILER_FLAGS
    # Machine code instead of PTX, which each driver would compile again, in its own way.
    wp.config.cuda_output = "cubin"
    system_calls.keep_freed_memory()
    with processes.silence_stdio():  # Warp warns about a missing CUDA driver
        try:
            wp.init()
        except OSError:  # It creates the folder of its cache.
            with kernel_cache.no_private_folder():
                wp.config.kernel_cache_dir = str(kernel_cache.private_folder())
                wp.init()


def kernel_folder() -> Path:
    """Folder of compiled kernels of this version of Warp."""
    _start()
    return Path(wp.config.kernel_cache_dir)


EVERY_FRAME = (
    "realtime.kernels.lattice_lighting",
    "realtime.kernels.lattice_interpolation",
    "realtime.kernels.soft_shadows",
    "visibility.kernels.rasterizer",
    "visibility.kernels.msaa",
    "visibility.kernels.amodal",
    "visibility.kernels.label_resolve",
    "realtime.kernels.shadow_culling",
    "scene.kernels.bvh_build",
    "scene.kernels.lattice",
    "visibility.kernels.edge_detection",
    "scene.kernels.environment_lighting",
)
"""Kernel modules, below this package, that every image needs; the slowest to compile come first."""
BUNDLES = Path(__file__).parent / "compiled"
"""Folder of modules that the distribution was built with; missing in a source tree."""
_RECORD_BYTES = 64
"""Of a module's name in the pipe: longer than any, and short enough to be read in one piece."""


@cache
def compile_kernels(device: str) -> None:
    """Fill Warp's cache for a device with the kernels of ``EVERY_FRAME``, if they are missing.

    A bundle of the distribution that fits these kernels, this version of Warp and this platform has
    the kernels of every frame and all others, for the CPU and possibly for some kinds of GPUs. Of
    several processes that find the cache empty, one fills it and the others wait.

    Warns:
        CacheWarning: compiled kernels were damaged; they are compiled again. Or kernels are
            missing, and the cache cannot be written; see ``fill_cache``.

    Raises:
        StorageError: kernels are missing and can be written nowhere.
    """
    stamp = f"gen-data-{_digest()}-{device[:4]}"
    folder = Path(wp.config.kernel_cache_dir)
    # Set afterwards, in any case: Warp compiles missing kernels there at their first use.
    wp.config.kernel_cache_dir = str(
        kernel_cache.fill_cache(folder, stamp, lambda chosen: _fill(chosen, stamp, device))
    )


def _fill(folder: Path, stamp_name: str, device: str) -> None:
    cores = system_calls.usable_cores()
    stamp = folder / stamp_name
    with (folder / "gen-data.lock").open("a") as lock:
        system_calls.wait_for_lock(lock.fileno())
        damaged = kernel_cache.remove_damaged_modules(folder)
        if damaged:
            fact = f"{folder}: {len(damaged)} compiled kernel module(s) were damaged"
            warnings.warn(f"{fact} and are compiled again", errors.CacheWarning, stacklevel=2)
        if stamp.exists() and not damaged:
            return
        kernel_cache.require_space(folder)
        bundle = bundle_folder()
        if bundle.is_dir():
            kernel_cache.copy_modules(bundle, folder)
        bundled = device == "cpu" and bundle.is_dir()
        if not bundled:
            activity.tell("compiling the renderer, once on this machine")
        if not bundled and (cores < 2 or not compile_in_parallel(device, EVERY_FRAME, folder)):
            return
        stamp.touch()
        kernel_cache.remove_damaged_modules(folder)


def bundle_folder() -> Path:
    """Folder of the kernels compiled from these sources, by this Warp, on such a platform."""
    _start()
    return BUNDLES / f"{_digest()}-{sys.platform}-{platform.machine().lower()}"


BLOCK_DIM = 32
"""Threads of a block on a GPU. Kernels have thousands of long threads rather than millions of short
ones: in blocks of 256, Warp's default, they would leave most multiprocessors without work. It is
the same for all kernels, since Warp compiles a module once for each size."""


def launch(
    kernel: wp.Kernel,
    dim: Any,
    inputs: Sequence[Any],
    outputs: Sequence[Any] = (),
    *,
    device: wp.Device,
) -> None:
    """Launch a kernel on a device; on the CPU, its threads run one after another."""
    block_dim = None if device.is_cpu else BLOCK_DIM
    wp.launch(kernel, dim, [*inputs], [*outputs], device=device, block_dim=block_dim)


def load_kernels(device_name: str, names: Sequence[str]) -> None:
    """Load kernel modules in this process, which compiles those missing from the cache."""
    device = open_device(device_name)
    for name in names:
        module = f"{__package__}.{name}"
        import_module(module)
        wp.load_module(module, device=device, block_dim=None if device.is_cpu else BLOCK_DIM)


def compile_in_parallel(device: str, names: Sequence[str], folder: Path) -> bool:
    """Let one process per core take modules from a pipe; returns whether all succeeded.

    Args:
        device: Warp's name of the device; or ``sm_N``, which compiles for GPUs of this kind without
            having one.
        names: Names of the modules, below this package.
        folder: Cache that takes the compiled modules.
    """
    queue, feed = os.pipe()
    running: list[subprocess.Popen[bytes]] = []
    try:
        with os.fdopen(feed, "wb") as file:
            file.writelines(name.encode().ljust(_RECORD_BYTES) for name in names)
        for _ in range(min(system_calls.usable_cores(), len(names))):
            command = processes.tie([sys.executable, "-m", __name__, device, str(folder)])
            with processes.interrupts_blocked():
                running.append(subprocess.Popen(command, stdin=queue, stdout=subprocess.DEVNULL))
        codes = [process.wait() for process in running]
    finally:
        os.close(queue)
        # After an interruption, the host program may go on.
        for process in running:
            process.kill()
    return not any(codes)


def _compile_queued(device: str, folder: str) -> None:
    """Compile the modules whose names arrive on standard input, which other processes share."""
    _start()
    # Set afterwards: Warp appends its version to a folder that it starts with.
    wp.config.kernel_cache_dir = folder
    while record := os.read(sys.stdin.fileno(), _RECORD_BYTES):
        name = record.decode().strip()
        if device.startswith("sm_"):
            module = import_module(f"{__package__}.{name}")
            wp.set_module_options({"block_dim": BLOCK_DIM}, module)
            wp.compile_aot_module(module, arch=int(device.removeprefix("sm_")), use_ptx=False)
        else:
            load_kernels(device, [name])


def _digest() -> str:
    """Digest of the kernels' sources and of the compiler's settings."""
    digest = hashlib.sha256(f"{wp.config.version} {wp.config.cpu_compiler_flags}".encode())
    for source in sorted(Path(__file__).parent.glob("*/kernels/*.*")):
        if source.suffix in (".h", ".py"):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


if __name__ == "__main__":
    _compile_queued(*sys.argv[1:])
