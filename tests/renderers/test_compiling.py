"""Kernels are compiled once, in parallel, and then found in the cache."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from gen_data.generator.renderers import warp
from gen_data.generator.renderers.warp.device import open_device

_FIRST_SAMPLE = """
from gen_data.generator.assemble.pipeline_factory import open_pipeline
from gen_data.generator.assemble.config import load_config

spec = load_config("tabletop.yaml", overrides=["sensors=[{type: rgb_camera, size_px: [64, 48]}]"])
with open_pipeline(spec) as pipeline:
    pipeline.sample(0)
"""

KERNEL_MODULES = sorted(
    f"{path.parts[-3]}.kernels.{path.stem}"
    for path in Path(warp.__path__[0]).glob("*/kernels/*.py")
    if "@wp.kernel" in path.read_text(encoding="utf-8")
)


@pytest.mark.slow
def test_what_is_compiled_side_by_side_is_all_that_a_photograph_takes(tmp_path: Path) -> None:
    """Afterwards, the first sample of a process adds nothing to the cache, nor does the next."""
    compiler = [
        sys.executable,
        "-c",
        "from gen_data.generator.renderers.warp.device import open_device\n"
        "from gen_data.generator.renderers.warp.device import compile_kernels\n"
        "compile_kernels(open_device('cpu').alias)",
    ]
    environment = {**os.environ, "WARP_CACHE_PATH": str(tmp_path)}
    subprocess.run(compiler, env=environment, check=True)
    compiled = _modules(tmp_path)
    assert compiled
    for _process in range(2):
        subprocess.run([sys.executable, "-c", _FIRST_SAMPLE], env=environment, check=True)
        assert _modules(tmp_path) == compiled


@pytest.mark.slow
@pytest.mark.parametrize("name", KERNEL_MODULES)
def test_kernels_compile_for_cuda(name: str, tmp_path: Path) -> None:
    """Compilation to PTX, which needs Warp's compiler but no GPU."""
    open_device("cpu")
    module = importlib.import_module(f"{warp.__name__}.{name}")

    wp.compile_aot_module(module, arch=80, module_dir=tmp_path, use_ptx=True)

    (assembly,) = tmp_path.glob("*.ptx")
    assert ".entry" in assembly.read_text()


def _modules(cache: Path) -> list[str]:
    return sorted(path.name for path in cache.rglob("wp_*") if path.is_dir())
