"""A small data set shared by several tests."""

from pathlib import Path

import pytest

from tests.end_to_end.running import SMALL, gen_data


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset")
    done = gen_data(
        "--config", "tabletop.yaml", "--n", "15", "--seed", "1", "--workers", "1",
        "--out", "one", *SMALL, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "one"
