"""Configurations of the Python API: files, names, dictionaries, objects."""

import operator
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gen_data.core.errors import ConfigError
from gen_data.core.system_calls import CAN_PASS_FILES, usable_cores

if TYPE_CHECKING:
    from pydantic import BaseModel

    from gen_data.assemble.config import Config
    from gen_data.config.yaml_tree import Node

Model = TypeVar("Model", bound="BaseModel")

ConfigLike = str | PathLike[str] | Mapping[str, Any]
"""A file, a shipped name, the folder of a data set, or a dictionary of the same content."""


def load_config(
    config: ConfigLike,
    *,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
) -> "Config":
    """Load and validate a configuration.

    Raises:
        ConfigError: the message lists all errors with their positions.
    """
    from gen_data.assemble.config import load_config, parse_config

    if seed is not None:
        check_whole("seed", seed)
    choice: dict[str, Any] = {"seed": seed, "overrides": overrides, "without": without}
    if isinstance(config, Mapping):
        return parse_config(_yaml_text(config), "<config>", "config", **choice)
    return load_config(path_text("config", config), **choice)


def read_document(source: ConfigLike, title: str) -> "Node":
    """Read a YAML file, or a dictionary, which errors call ``<title>``.

    Raises:
        ConfigError: it cannot be read; the message has the position.
    """
    from gen_data.config.yaml_tree import load_yaml, parse_yaml

    if isinstance(source, Mapping):
        return parse_yaml(_yaml_text(source), f"<{title}>")
    return load_yaml(Path(path_text(title, source)))


def read_model(document: "Node", model: type[Model]) -> Model:
    """Validate a document as a model.

    Raises:
        ConfigError: the message lists all errors with their positions.
    """
    from gen_data.config.problems import Problems
    from gen_data.config.validation import validate

    problems = Problems()
    loaded = validate(document, model, problems)
    problems.raise_if_any()
    assert loaded is not None
    return loaded


def check_whole(name: str, value: object, least: int | None = None) -> None:
    """Refuse an argument that is not a whole number of at least ``least``; None = any.

    Raises:
        ConfigError: it is none; True and False are none either.
    """
    try:
        whole = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        whole = None
    if whole is None or isinstance(value, bool):
        raise ConfigError(f"{name}: {value!r}; expected a whole number")
    if least is not None and whole < least:
        raise ConfigError(f"{name}: {whole}; expected at least {least}")


def path_text(name: str, value: object) -> str:
    """The text of an argument that is a path, URL or shipped name.

    Raises:
        ConfigError: it is none.
    """
    text = fspath(value) if isinstance(value, PathLike) else value
    if not isinstance(text, str) or "\0" in text:
        raise ConfigError(f"{name}: {value!r}; expected a path, as a text or a pathlib.Path")
    return text


def count_workers(workers: int | None) -> int:
    """Number of worker processes; None = one per core, or 0 where the system has none (Windows).

    Raises:
        ConfigError: it is negative, or the system has no workers.
    """
    if workers is not None:
        check_whole("workers", workers)
    if workers is None:
        return usable_cores() if CAN_PASS_FILES else 0
    if workers > 0 and not CAN_PASS_FILES:
        raise ConfigError(
            f"workers: {workers}; expected 0, this process: on this system, processes cannot be "
            "given open files"
        )
    if workers < 0:
        raise ConfigError(
            f"workers: {workers}; expected at least 1, or 0 to generate in this process"
        )
    return workers


def _yaml_text(config: Mapping[str, Any]) -> str:
    import yaml

    try:
        return yaml.safe_dump(_plain(config), sort_keys=False, allow_unicode=True)
    except yaml.YAMLError as error:
        raise ConfigError(f"<config>: holds a value that is not YAML: {error}") from None


def _plain(value: Any) -> Any:
    """Convert a value, with typed plug-ins in it, to dictionaries, lists and scalars."""
    from pydantic import BaseModel

    if isinstance(value, BaseModel):
        return _plain(value.model_dump(mode="json", exclude_unset=True) | _type_of(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return fspath(value) if isinstance(value, PathLike) else value


def _type_of(plugin: Any) -> dict[str, str]:
    """The ``type`` of a plug-in, which is a default and so unset in its dump."""
    kind = getattr(plugin, "type", None)
    return {} if kind is None else {"type": kind}
