"""Where the files are that configurations name.

A relative path starts from the folder of the file that names it; on the command line, from the
current folder. ``~`` is the user's home. Where there is nothing, a shipped file of that name is
meant. All paths in configurations and templates are found here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gen_data.generator.config.problems import Position, Problem
from gen_data.generator.core.errors import ConfigError, did_you_mean

PLAN = "plan.json"
"""A data set's own record names paths as its configuration did, which lies elsewhere."""


def find_path(
    name: str,
    position: Position | None,
    field: str,
    kind: str,
    *,
    shipped: Sequence[Path] = (),
    is_folder: bool = False,
) -> Path:
    """The file or folder that a configuration means.

    Args:
        name: As it is written. Of a shipped file only, ``.yaml`` may be left out.
        position: Of the name in a document; None for an argument of the command line.
        field: That holds the name.
        kind: Of thing, for the message: ``template``.
        shipped: Files that come with the package.
        is_folder: Whether a folder is expected.

    Raises:
        ConfigError: there is none; the message says where it was looked for.
    """
    path = _folder_of(position) / Path(name).expanduser()
    if path.is_dir() if is_folder else path.is_file() and not _is(path, position):
        return path
    by_name = {file.name: file for file in shipped}
    for known in (name, f"{name}.yaml"):
        if known in by_name and not _is(by_name[known], position):
            return by_name[known]
    fact = f"there is no {kind} '{name}'; looked for '{path}'"
    if by_name:
        fact += f"; shipped are {', '.join(by_name)}{did_you_mean(name, by_name)}"
    raise ConfigError(str(Problem(position, field, fact)) if position else fact)


def _folder_of(position: Position | None) -> Path:
    """Where relative paths of a document start."""
    if position is None or not Path(position.file).is_file():
        return Path()
    file = Path(position.file)
    return Path() if file.name == PLAN else file.parent


def _is(candidate: Path, position: Position | None) -> bool:
    """Whether a path is the document itself: a file that names itself means a shipped one."""
    return position is not None and candidate.resolve() == Path(position.file).resolve()
