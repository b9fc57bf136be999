"""Kernels are compiled once, in parallel, and then found in the cache."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from gen_data.generator.renderers import warp
from gen_data.generator.renderers.warp.device import open_device

_REPORT_MODULES = """
import warp as wp
from gen_data.generator.renderers.warp import device

alias = device.open_device("cpu").alias
wp.config.log_level = wp.LOG_INFO
"""
_EVERY_FRAME = "device.load_kernels(alias, device.EVERY_FRAME)"
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
def test_what_is_compiled_side_by_side_is_all_that_a_photograph_takes() -> None:
    """The first sample of a process loads the modules of every frame, and no other."""
    compiled = _loaded_modules(_EVERY_FRAME)
    assert len(compiled) >= 10
    assert _loaded_modules(_FIRST_SAMPLE) == compiled


@pytest.mark.slow
@pytest.mark.parametrize("name", KERNEL_MODULES)
def test_kernels_compile_for_cuda(name: str, tmp_path: Path) -> None:
    """Compilation to PTX, which needs Warp's compiler but no GPU."""
    open_device("cpu")
    module = importlib.import_module(f"{warp.__name__}.{name}")

    wp.compile_aot_module(module, arch=80, module_dir=tmp_path, use_ptx=True)

    (assembly,) = tmp_path.glob("*.ptx")
    assert ".entry" in assembly.read_text()


def _loaded_modules(program: str) -> set[tuple[str, str]]:
    """Names and hashes of the kernel modules that a program loads."""
    done = subprocess.run(
        [sys.executable, "-c", _REPORT_MODULES + program],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    return set(re.findall(r"Module (\S+) ([0-9a-f]+) load on device", done.stdout))
