"""What is installed of the packages that do not have a wheel for every interpreter."""

from __future__ import annotations

from importlib.util import find_spec
from typing import get_args

import pytest

from gen_data.generator.physics.physics_config import EngineName, is_installed

INSTALLED: tuple[EngineName, ...] = tuple(filter(is_installed, get_args(EngineName)))
"""Physics engines."""
NO_RERUN = "rerun-sdk has no wheel for Python 3.10"
HAS_RERUN = find_spec("rerun") is not None
needs_rerun = pytest.mark.skipif(not HAS_RERUN, reason=NO_RERUN)
