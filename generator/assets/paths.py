"""Location of installed asset packs, and whether one may be fetched without being asked for."""

import os
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
