"""Camera presets: one YAML file each, with the sources of its values."""

from __future__ import annotations

from functools import cache
from typing import Any

from gen_data.generator.config.yaml_tree import load_yaml
from gen_data.generator.sensors.device_presets import check_preset, preset_names, preset_path


def camera_names() -> tuple[str, ...]:
    """Names of all presets, sorted."""
    return preset_names(__name__)


@cache
def camera_preset(name: str) -> dict[str, Any]:
    """The values of a preset, as plain data.

    Raises:
        ValueError: there is no such preset.
    """
    plain = load_yaml(preset_path(__name__, check_preset(__name__, name))).plain()
    assert isinstance(plain, dict)
    return plain
