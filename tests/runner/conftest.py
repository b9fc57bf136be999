"""Data sets of ten samples that tests of this folder compare with, change or put elsewhere."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest

from tests.runner.doubles import make, tree_digest


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set that tests read and do not change."""
    out = tmp_path_factory.mktemp("finished") / "out"
    make(out)
    return out


@pytest.fixture(scope="session")
def reference_digest(finished: Path) -> str:
    return tree_digest(finished)


@pytest.fixture
def dataset(finished: Path, tmp_path: Path) -> Path:
    """A copy that the test may change."""
    return Path(shutil.copytree(finished, tmp_path / "set"))


@pytest.fixture
def memory() -> Iterator[str]:
    """URL of an empty place in memory."""
    system = fsspec.filesystem("memory")
    yield "memory://bucket/set"
    system.store.clear()
    system.pseudo_dirs[:] = [""]
