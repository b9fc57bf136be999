"""Laser scanners as data: one YAML file each, with its sources."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from generator.config.document import load
from generator.config.problems import Problems
from generator.config.validation import validate
from generator.core.errors import ConfigError, did_you_mean
from generator.sensors.scanning import LidarModel


def model_names() -> tuple[str, ...]:
    """Names of all models, sorted."""
    folder = Path(str(files(__name__)))
    return tuple(sorted(path.stem for path in folder.glob("*.yaml")))


@cache
def lidar_model(name: str) -> LidarModel:
    """The model of that name.

    Raises:
        ConfigError: there is no such model.
    """
    known = model_names()
    if name not in known:
        raise ConfigError(
            f"there is no lidar model '{name}'; expected one of {', '.join(known)}"
            f"{did_you_mean(name, known)}"
        )
    problems = Problems()
    model = validate(load(Path(str(files(__name__))) / f"{name}.yaml"), LidarModel, problems)
    problems.raise_if_any()
    assert model is not None
    return model
