"""Compile all CPU kernels into the source tree, for a wheel that is then built from it.

``python -m gen_data.renderers.warp.kernel_bundle`` before ``python -m build --wheel``.
Kinds of GPUs may follow, such as ``sm_80 sm_90``: their kernels are compiled too, without a GPU.
The machine code fits every processor on which Warp compiles CPU kernels, because the compiler's
flags name none; Warp's own names of the files contain its LLVM and the target triple.
"""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from gen_data.renderers.warp.device import BUNDLES, EVERY_FRAME, bundle_folder, compile_in_parallel
from gen_data.renderers.warp.kernel_cache import copy_modules


def kernel_modules() -> tuple[str, ...]:
    """Names of all modules with kernels, below this package; the slowest to compile come first."""
    sources = sorted(Path(__file__).parent.glob("*/kernels/*.py"))
    names = [
        f"{path.parts[-3]}.kernels.{path.stem}"
        for path in sources
        if "@wp.kernel" in path.read_text(encoding="utf-8")
    ]
    rare = [name for name in names if name not in EVERY_FRAME]
    return (*rare, *EVERY_FRAME)


def write_bundle(kinds: Sequence[str] = ()) -> Path | None:
    """Compile all modules again and make them the only bundle; None if one fails to compile.

    Args:
        kinds: Kinds of GPUs, ``sm_N``, in addition to the CPU.
    """
    with TemporaryDirectory() as cache:
        modules = kernel_modules()
        if not all(compile_in_parallel(kind, modules, Path(cache)) for kind in ("cpu", *kinds)):
            return None
        bundle = bundle_folder()
        shutil.rmtree(BUNDLES, ignore_errors=True)
        bundle.mkdir(parents=True)
        copy_modules(Path(cache), bundle)
        return bundle


if __name__ == "__main__":
    sys.exit(write_bundle(sys.argv[1:]) is None)
