"""A small data set to certify, and a function that reseals a damaged copy of it."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import gen_data
from tests.certificate.sealing import SMALL


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty-two scenes of a table, two views each, as COCO; in three splits."""
    folder = tmp_path_factory.mktemp("certified") / "table"
    gen_data.generate("tabletop.yaml", 64, out=folder, workers=0, seed=1, **SMALL)
    return folder


@pytest.fixture
def damaged(dataset: Path, tmp_path: Path) -> Callable[[], Path]:
    """Makes a copy of the data set to be damaged, as somebody else has it: without ``run``."""
    without_run = shutil.ignore_patterns("run")
    return lambda: Path(shutil.copytree(dataset, tmp_path / "copy", ignore=without_run))
