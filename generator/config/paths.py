"""Resolution of the paths in configurations and templates.

A relative path starts from the folder of the file that contains it; on the command line, from the
current folder. ``~`` is the home folder. If nothing exists there, a shipped file of that name is
used.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gen_data.generator.config.problems import Position, Problem
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.urls import is_url

PLAN = "plan.json"
"""Record of a data set; its paths are those of its configuration, which lies elsewhere."""


def find_path(
    name: str,
    position: Position | None,
    field: str,
    kind: str,
    *,
    shipped: Sequence[Path] = (),
    is_folder: bool = False,
) -> Path:
    """Find a file or folder that a configuration names.

    Args:
        name: As written; ``.yaml`` may be omitted for shipped files.
        position: Of the name in its document; None for an argument of the command line.
        field: Dotted path of the field with the name.
        kind: Noun for the message, such as ``template``.
        shipped: Files of the package.
        is_folder: Whether a folder is expected.

    Raises:
        ConfigError: there is none; the message gives the path.
    """
    path = _base_folder(position) / Path(name).expanduser()
    if path.is_dir() if is_folder else path.is_file() and not _is_document(path, position):
        return path
    by_name = {file.name: file for file in shipped}
    for known in (name, f"{name}.yaml"):
        if known in by_name and not _is_document(by_name[known], position):
            return by_name[known]
    fact = f"there is no {kind} '{name}'; looked for '{path}'"
    if is_url(name):
        fact = (
            f"'{name}' is a URL; expected a {kind} on this machine: copy it first, as with "
            "'aws s3 cp --recursive'"
        )
    elif by_name:
        fact += f"; shipped are {', '.join(by_name)}{did_you_mean(name, by_name)}"
    raise ConfigError(str(Problem(position, field, fact)) if position else fact)


def _base_folder(position: Position | None) -> Path:
    """Folder that relative paths of a document start from."""
    if position is None or not Path(position.file).is_file():
        return Path()
    file = Path(position.file)
    return Path() if file.name == PLAN else file.parent


def _is_document(candidate: Path, position: Position | None) -> bool:
    """Whether a path is the document itself, whose own name stands for a shipped file."""
    return position is not None and candidate.resolve() == Path(position.file).resolve()
