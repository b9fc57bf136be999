"""Cameras as data: one YAML file each, with the sources of its figures."""

from __future__ import annotations

from functools import cache
from typing import Any

from generator.config.document import load
from generator.sensors.presets import known_preset, preset_names, preset_path


def camera_names() -> tuple[str, ...]:
    """Names of all presets, sorted."""
    return preset_names(__name__)


@cache
def camera_preset(name: str) -> dict[str, Any]:
    """The values of a preset, as plain data.

    Raises:
        ValueError: there is no such preset.
    """
    plain = load(preset_path(__name__, known_preset(__name__, name))).plain()
    assert isinstance(plain, dict)
    return plain
