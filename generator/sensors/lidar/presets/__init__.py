"""Presets of laser scanners: one YAML file each, with its sources."""

from __future__ import annotations

from gen_data.generator.sensors.device_presets import load_preset, preset_names
from gen_data.generator.sensors.lidar.scan_pattern import LidarModel


def model_names() -> tuple[str, ...]:
    """Names of all models, sorted."""
    return preset_names(__name__)


def lidar_model(name: str) -> LidarModel:
    """The model of that name.

    Raises:
        ConfigError: there is no such model.
    """
    model: LidarModel = load_preset(__name__, name, LidarModel)
    return model
