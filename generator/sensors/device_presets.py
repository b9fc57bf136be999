"""Device presets: one YAML file per make, with its sources."""

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TypeVar

from gen_data.config import base_model, validation, yaml_tree
from gen_data.config.problems import Problems
from gen_data.core.errors import ConfigError, did_you_mean

M = TypeVar("M", bound=base_model.Strict)


@cache
def preset_names(package: str) -> tuple[str, ...]:
    """Names of all presets in a package, sorted."""
    return tuple(sorted(path.stem for path in Path(str(files(package))).glob("*.yaml")))


def preset_path(package: str, name: str) -> Path:
    """Path of a preset's file."""
    return Path(str(files(package))) / f"{name}.yaml"


@cache
def load_preset(package: str, name: str, kind: type[M]) -> M:
    """Read and validate a preset. Raises ConfigError if there is no such file, or it is invalid."""
    try:
        check_preset(package, name)
    except ValueError as error:
        raise ConfigError(f"{package} has no preset '{name}'; {error}") from None
    problems = Problems()
    preset = validation.validate(yaml_tree.load_yaml(preset_path(package, name)), kind, problems)
    problems.raise_if_any()
    assert preset is not None
    return preset


def check_preset(package: str, name: str) -> str:
    """Return the name of an existing preset; for validators.

    Raises:
        ValueError: there is no such preset.
    """
    known = preset_names(package)
    if name not in known:
        raise ValueError(f"expected one of {', '.join(known)}{did_you_mean(name, known)}")
    return name
