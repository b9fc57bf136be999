"""Kernels are compiled once, in parallel, and then found in the cache."""

import importlib
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
import warp as wp

from gen_data.renderers import warp
from gen_data.renderers.warp.device import EVERY_FRAME, compile_in_parallel, open_device
from gen_data.renderers.warp.kernel_cache import copy_modules
from tests.tiers import exhaustive

_REPORT_MODULES = """
import sys
import warp as wp
from gen_data.renderers.warp import device

alias = device.open_device("cpu").alias
wp.config.log_level = wp.LOG_INFO
"""
_EVERY_FRAME = "device.load_kernels(alias, device.EVERY_FRAME)"
_FIRST_SAMPLE = """
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assemble.config import load_config

spec = load_config("tabletop.yaml", overrides=["sensors=[{type: rgb_camera, size_px: [64, 48]}]"])
with open_pipeline(spec) as pipeline:
    pipeline.sample(0)
"""

_FIRST_TABLETOP = """
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assemble.config import load_config

with open_pipeline(load_config("tabletop.yaml")) as pipeline:
    pipeline.sample(0)
"""
_MAKE_BUNDLE = """
from pathlib import Path
from gen_data.renderers.warp import kernel_cache

device.BUNDLES = Path(sys.argv[1])
device.load_kernels(alias, [sys.argv[2]])
device.bundle_folder().mkdir(parents=True)
kernel_cache.copy_modules(device.kernel_folder(), device.bundle_folder())
"""
_USE_BUNDLE = """
from pathlib import Path

device.BUNDLES = Path(sys.argv[1])
device.compile_in_parallel = None
device.compile_kernels(alias)
device.load_kernels(alias, [sys.argv[2]])
"""

KERNEL_MODULES = sorted(
    f"{path.parts[-3]}.kernels.{path.stem}"
    for path in Path(warp.__path__[0]).glob("*/kernels/*.py")
    if "@wp.kernel" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", KERNEL_MODULES)
def test_no_module_fuses_multiplications_and_additions(name: str) -> None:
    """Labels from a GPU would have other bytes; by default Warp fuses them there."""
    module = importlib.import_module(f"{warp.__name__}.{name}")

    assert wp.get_module_options(module)["fuse_fp"] is False


@pytest.mark.slow
def test_what_is_compiled_side_by_side_is_all_that_a_photograph_takes() -> None:
    """The first sample of a process loads the modules of every frame, and no other."""
    compiled = _loaded_modules(_EVERY_FRAME)
    assert len(compiled) >= 10
    assert _loaded_modules(_FIRST_SAMPLE) == compiled


@pytest.mark.slow
def test_a_tabletop_compiles_nothing_that_only_streets_weather_or_path_tracing_use() -> None:
    """Only the modules of every frame: its laser points come from the depth image."""
    loaded = {name for name, _ in _loaded_modules(_FIRST_TABLETOP)}

    assert loaded == {f"{warp.__name__}.{name}" for name in EVERY_FRAME}


@pytest.mark.slow
def test_kernels_of_the_distribution_are_loaded_instead_of_compiled(tmp_path: Path) -> None:
    """In an empty cache, Warp itself finds them, by the hash of sources, flags and target."""
    arguments = [str(tmp_path / "bundles"), "visibility.kernels.edge_detection"]

    built = _run(_MAKE_BUNDLE, arguments, {"WARP_CACHE_PATH": str(tmp_path / "build")})
    used = _run(_USE_BUNDLE, arguments, {"WARP_CACHE_PATH": str(tmp_path / "cache")})

    assert re.findall(r"edge_detection .*\((\w+)\)", built) == ["compiled"]
    assert re.findall(r"edge_detection .*\((\w+)\)", used) == ["cached"]


@pytest.mark.slow
def test_modules_are_compiled_side_by_side_into_the_folder_given(tmp_path: Path) -> None:
    """Directly within it, where the caller looks for them."""
    name = "visibility.kernels.edge_detection"

    assert compile_in_parallel("cpu", [name], tmp_path)

    (module,) = tmp_path.glob("*")
    assert module.name.startswith(f"wp_{warp.__name__}.{name}_")
    assert list(module.glob("*.o"))


@pytest.mark.slow
def test_modules_are_compiled_for_a_kind_of_gpu_without_one(tmp_path: Path) -> None:
    """Machine code under the name by which Warp looks for it on such a GPU."""
    name = "visibility.kernels.edge_detection"

    assert compile_in_parallel("sm_90", [name], tmp_path)

    (module,) = tmp_path.glob("*")
    assert module.name.startswith(f"wp_{warp.__name__}.{name}_")
    (code,) = module.glob("*.cubin")
    assert code.name == f"{module.name}.sm90.cubin"
    assert code.read_bytes().startswith(b"\x7fELF")


def test_modules_are_copied_without_sources_and_never_over_others(tmp_path: Path) -> None:
    """Unfinished folders and other packages' stay behind."""
    source, target = tmp_path / "source", tmp_path / "target"
    for name in ("wp_gen_data.a_1", "wp_gen_data.b_2", "wp_gen_data.c_3_p7_t8", "wp_other_4"):
        (source / name).mkdir(parents=True)
        (source / name / "x.o").write_bytes(b"new")
        (source / name / "x.cpp").write_bytes(b"source")
    (target / "wp_gen_data.b_2").mkdir(parents=True)
    (target / "wp_gen_data.b_2" / "x.o").write_bytes(b"old")

    copy_modules(source, target)

    files = {
        p.relative_to(target).as_posix(): p.read_bytes() for p in target.rglob("*.*") if p.is_file()
    }
    assert files == {"wp_gen_data.a_1/x.o": b"new", "wp_gen_data.b_2/x.o": b"old"}
    assert sorted(path.name for path in target.iterdir()) == ["wp_gen_data.a_1", "wp_gen_data.b_2"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=exhaustive if k % 3 else ())
        for k, name in enumerate(KERNEL_MODULES)
    ],
)
def test_kernels_compile_for_cuda(name: str, tmp_path: Path) -> None:
    """Compilation to PTX, which needs Warp's compiler but no GPU."""
    open_device("cpu")
    module = importlib.import_module(f"{warp.__name__}.{name}")

    wp.compile_aot_module(module, arch=80, module_dir=tmp_path, use_ptx=True)

    (assembly,) = tmp_path.glob("*.ptx")
    assert ".entry" in assembly.read_text()


def _loaded_modules(program: str) -> set[tuple[str, str]]:
    """Names and hashes of the kernel modules that a program loads."""
    return set(re.findall(r"Module (\S+) ([0-9a-f]+) load on device", _run(program)))


def _run(program: str, arguments: Sequence[str] = (), environment: Mapping[str, str] = {}) -> str:
    """Output of a program in a separate process, Warp's reports included."""
    done = subprocess.run(
        [sys.executable, "-c", _REPORT_MODULES + program, *arguments],
        check=True, capture_output=True, text=True, env={**os.environ, **environment},
    )  # fmt: skip
    return done.stdout
