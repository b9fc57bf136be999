"""One small data set that several tests look at."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

# Test folders are no packages: the helper module is loaded by its path, once.
_spec = importlib.util.spec_from_file_location("running", Path(__file__).with_name("running.py"))
assert _spec is not None and _spec.loader is not None
running = importlib.util.module_from_spec(_spec)
sys.modules["running"] = running
_spec.loader.exec_module(running)


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fifteen small tabletop samples, made by one worker process."""
    folder = tmp_path_factory.mktemp("dataset")
    done = running.gen_data(
        "--config", "tabletop.yaml", "--n", "15", "--seed", "1", "--workers", "1",
        "--out", "one", *running.SMALL, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "one"
