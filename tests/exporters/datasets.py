"""Data sets that all tests of a format read."""

from pathlib import Path
from typing import Any

import pytest


def street_in(exporter: Any, **facts: Any) -> Any:
    """Make the fixture ``dataset``: the seven frames of a street in a format."""

    @pytest.fixture(scope="module")
    def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
        folder: Path = tmp_path_factory.mktemp(exporter.type)
        return world.export(exporter, world.info(7, **facts), world.samples, folder)

    return dataset
