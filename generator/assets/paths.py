"""Location of installed asset packs, and whether one may be fetched without being asked for."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

VARIABLE = "GEN_DATA_ASSETS"
"""Environment variable with another folder for installed assets."""
OFFLINE = "GEN_DATA_OFFLINE"
"""Environment variable; with any text but ``0`` nothing is fetched."""


def packs_dir() -> Path:
    """Folder with one subfolder per installed asset pack; it need not exist."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen) / "packs"
    import platformdirs

    return Path(platformdirs.user_data_path("gen-data")) / "packs"


def may_fetch() -> bool:
    """Whether files that are needed may be fetched without a command of the user."""
    return os.environ.get(OFFLINE, "") in ("", "0")


@contextmanager
def offline() -> Iterator[None]:
    """Fetch nothing in the block, in this process and its children."""
    before = os.environ.get(OFFLINE)
    os.environ[OFFLINE] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[OFFLINE]
        else:
            os.environ[OFFLINE] = before
