"""Where asset packs are installed."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "GEN_DATA_ASSETS"
"""Environment variable that names another folder for installed assets."""


def packs_dir() -> Path:
    """The folder that holds one folder per installed asset pack; it need not exist."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen) / "packs"
    import platformdirs

    return Path(platformdirs.user_data_path("gen-data")) / "packs"
