"""What holds for every test."""

from __future__ import annotations

import os
import tempfile

# Packs that happen to be installed on this machine must not change what tests see; processes that
# tests start inherit it. Set before anything asks, hence not in a fixture.
os.environ["GEN_DATA_ASSETS"] = tempfile.mkdtemp(prefix="gen-data-no-packs-")
