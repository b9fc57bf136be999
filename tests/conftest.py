"""Fixtures and rules for every test.

With ``GEN_DATA_CI`` set, a skipped test fails: a test that is skipped everywhere tests nothing.
"""

import atexit
import importlib
import os
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Generator
from typing import Any

import pytest

from tests.pybullet_files import provide_pybullet_data
from tests.wheels import HAS_RERUN

# Packs installed on this machine must not change results; processes that tests start inherit it.
# Set before the first use, hence not in a fixture.
os.environ["GEN_DATA_ASSETS"] = tempfile.mkdtemp(prefix="gen-data-no-packs-")
atexit.register(shutil.rmtree, os.environ["GEN_DATA_ASSETS"], ignore_errors=True)

provide_pybullet_data()


def _check_descriptor(descriptor: Any) -> None:
    os.fstat(descriptor)


# No power fails while tests run: a disk takes longer for fsync than they take for all else.
# ``tests/runner/fragile_disk.py`` counts calls of this function as it would calls of the other.
os.fsync = _check_descriptor

collect_ignore = [] if HAS_RERUN else ["exporters/test_rerun.py", "preview"]

SKIPS_ALLOWED_IN_CI = (
    "this machine computes otherwise",  # where another processor stored digests
    "root may write everywhere",  # CI runs as root in some places
    "mounting a small file system needs root",  # and as a user without mount(2) in others
    "no folder with the catalogue pack",  # which only Debian's registry has
    "numpy's type hints are older and vaguer on Python 3.10",  # CI has 3.11
)
"""Reasons that depend on the machine of CI, and not on packages installed by ``.ci/run``."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """As many processes as this one may use cores and 2 GB each; none for single files.

    One thread each: a second one of OpenMP or BLAS would spin while it waits for a core.
    """
    if all(argument.partition("::")[0].endswith(".py") for argument in config.args):
        return 0
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    memory_gb = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9
    return max(1, min(cores, int(memory_gb / 2.0)))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out exhaustive tests, slow ones included, unless ``-m`` names them."""
    if "exhaustive" in config.option.markexpr:
        return
    left_out = [item for item in items if item.get_closest_marker("exhaustive")]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if not item.get_closest_marker("exhaustive")]


@pytest.fixture(scope="session")
def library() -> Any:
    """Assets of the package; imported on request, because it looks for packs."""
    return importlib.import_module("tests.libraries").library()


@pytest.fixture(scope="session")
def open3d() -> Any:
    """The package; tests that use it are skipped, with the remedy, where it cannot be loaded."""
    try:
        return importlib.import_module("open3d")
    except (ImportError, OSError) as error:
        pytest.skip(
            f"open3d ({error}): pip install open3d; "
            "apt-get install libusb-1.0-0 libgl1 libegl1 libx11-6 libidn2-0 libgomp1"
        )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _skips_fail((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _skips_fail((yield))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Limit the resources of a hostile file: 10 s of processor time, and 1 GB in this process.

    The process that parses files has separate limits (``generator/assets/sandbox.py``).
    """
    if item.get_closest_marker("hostile") is None:
        yield
        return
    before_s, before_kb = time.process_time(), _peak_kb()
    yield
    assert time.process_time() - before_s < 10.0, "the file takes too long"
    assert _peak_kb() - before_kb < 1_000_000, "the file takes too much memory"


def _peak_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _skips_fail(report: pytest.TestReport | pytest.CollectReport) -> Any:
    reason = str(report.longrepr[2]) if isinstance(report.longrepr, tuple) else ""
    allowed = any(text in reason for text in SKIPS_ALLOWED_IN_CI)
    if os.environ.get("GEN_DATA_CI") and report.skipped and not allowed:
        report.outcome = "failed"
        report.longrepr = f"{reason} (with GEN_DATA_CI a skip fails: see tests/conftest.py)"
    return report
