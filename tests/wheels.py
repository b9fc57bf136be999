"""Packages without a wheel for every interpreter, or that need libraries of the system."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any, get_args

import pytest

from gen_data.physics.physics_config import EngineName, is_installed

INSTALLED: tuple[EngineName, ...] = tuple(filter(is_installed, get_args(EngineName)))
"""Physics engines."""
NO_RERUN = "rerun-sdk has no wheel for Python 3.10"
HAS_RERUN = find_spec("rerun") is not None
needs_rerun = pytest.mark.skipif(not HAS_RERUN, reason=NO_RERUN)


def needs_open3d(test: Callable[..., Any]) -> Callable[..., Any]:
    """Mark a test that imports Open3D: slow, and skipped where it cannot be loaded."""
    return pytest.mark.slow(pytest.mark.usefixtures("open3d")(test))
