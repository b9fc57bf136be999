"""Resolution of the paths in configurations and templates.

A relative path starts from the folder of the file that contains it; on the command line, from the
current folder. ``~`` is the home folder. If nothing exists there, a shipped file of that name is
used. A finished data set remembers where its folders were (``LOCATIONS``) and can be read
from anywhere.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from gen_data.config.problems import Position, Problem
from gen_data.config.yaml_scalars import abbreviate
from gen_data.core import errors, urls

PLAN = "plan.json"
"""Record of a data set; its paths are relative to its configuration, which lies elsewhere."""

LOCATIONS = "locations.json"
"""Next to the log of a data set: ``{folder as written: where it was}``; no part of its identity."""


def find_path(
    name: str,
    position: Position | None,
    field: str,
    kind: str,
    *,
    shipped: Sequence[Path] = (),
    is_folder: bool = False,
    also: str = "",
) -> Path:
    """Find a file or folder that a configuration names.

    Args:
        name: As written; ``.yaml`` may be omitted for shipped files.
        position: Position of the name in its document; None for an argument of the command line.
        field: Dotted path of the field with the name.
        kind: Noun for the message, such as ``template``.
        shipped: Files of the package.
        is_folder: Whether a folder is expected.
        also: Input that the caller takes instead of a file, for the message; empty = nothing.

    Raises:
        ConfigError: there is none; the message gives the path.
    """
    try:
        path = _base_folder(position) / Path(name).expanduser()
        if path.is_dir() if is_folder else path.is_file() and not _is_document(path, position):
            return path
    except (OSError, RuntimeError) as error:
        # A name that is too long, a folder that may not be read, or the home of an unknown user.
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise _error(position, field, f"'{abbreviate(name)}' is not a {kind} ({reason})") from None
    by_name = {file.name: file for file in shipped}
    for known in (name, f"{name}.yaml"):
        if known in by_name and not _is_document(by_name[known], position):
            return by_name[known]
    if is_folder and (remembered := _remembered_folder(name, position)) is not None:
        return remembered
    fact = f"there is no {kind} '{abbreviate(name)}'; looked for '{abbreviate(str(path), 300)}'"
    if urls.is_url(name):
        fact = (
            f"'{abbreviate(name)}' is a URL; expected a {kind} on this machine: copy it first, as "
            "with 'aws s3 cp --recursive'"
        )
    elif name and not is_folder and path.is_dir():
        expected = f"a file with a {kind}{also and f', or {also}'}"
        fact = f"'{abbreviate(str(path), 300)}' is a folder; expected {expected}"
    elif by_name:
        expected = f"a file{also and f', {also}'} or a shipped name, which gen-data describe lists"
        fact += f"{errors.did_you_mean(name, by_name)}; expected {expected}"
    raise _error(position, field, fact)


def _error(position: Position | None, field: str, fact: str) -> errors.ConfigError:
    return errors.ConfigError(str(Problem(position, field, fact)) if position else fact)


def _base_folder(position: Position | None) -> Path:
    file = Path() if position is None else Path(position.file)
    # A text that is not saved yet has a folder, too.
    return file.parent if file.name != PLAN and file.parent.is_dir() else Path()


def write_locations(run_dir: Path, folders: Mapping[str, Path]) -> None:
    """Remember where the folders of a data set are, by their names in its configuration."""
    if folders:
        places = {name: str(path.resolve()) for name, path in sorted(folders.items())}
        (run_dir / LOCATIONS).write_text(json.dumps(places, ensure_ascii=False) + "\n", "utf-8")


def _remembered_folder(name: str, position: Position | None) -> Path | None:
    """Folder of that name when the data set of a plan was generated; None if it is unknown."""
    if position is None or Path(position.file).name != PLAN:
        return None
    try:
        places = json.loads((Path(position.file).parent / "run" / LOCATIONS).read_bytes())
        folder = Path(places[name])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return folder if folder.is_dir() else None


def _is_document(candidate: Path, position: Position | None) -> bool:
    """Whether a path is the document itself, whose own name stands for a shipped file."""
    return position is not None and candidate.resolve() == Path(position.file).resolve()
