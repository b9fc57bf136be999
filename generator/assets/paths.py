"""Where things lie that belong to the user and not to a data set."""

from __future__ import annotations

import os
from pathlib import Path

ASSETS_VARIABLE = "GEN_DATA_ASSETS"


def packs_dir() -> Path:
    """The folder of installed asset packs: below $GEN_DATA_ASSETS, or the user's data folder."""
    from platformdirs import user_data_path

    chosen = os.environ.get(ASSETS_VARIABLE)
    return (Path(chosen) if chosen else user_data_path("gen-data")) / "packs"
