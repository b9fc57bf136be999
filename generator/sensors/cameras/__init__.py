"""Cameras as data: one YAML file each, with the sources of its figures."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from generator.config.document import load
from generator.core.errors import did_you_mean


def camera_names() -> tuple[str, ...]:
    """Names of all presets, sorted."""
    return tuple(sorted(path.stem for path in Path(str(files(__name__))).glob("*.yaml")))


@cache
def camera_preset(name: str) -> dict[str, Any]:
    """The values of a preset, as plain data.

    Raises:
        ValueError: there is no such preset.
    """
    known = camera_names()
    if name not in known:
        raise ValueError(
            f"there is no camera '{name}'; expected one of {', '.join(known)}"
            f"{did_you_mean(name, known)}"
        )
    plain = load(Path(str(files(__name__))) / f"{name}.yaml").plain()
    assert isinstance(plain, dict)
    return plain
