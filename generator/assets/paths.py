"""Location of installed asset packs."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "GEN_DATA_ASSETS"
"""Environment variable with another folder for installed assets."""


def packs_dir() -> Path:
    """Folder with one subfolder per installed asset pack; it need not exist."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen) / "packs"
    import platformdirs

    return Path(platformdirs.user_data_path("gen-data")) / "packs"
