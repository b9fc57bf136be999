"""Names that become parts of paths.

Records, manifests and asset indexes may come from somebody else: a name with ``..``, a separator or
a drive would lead out of the folder that it is joined to. Names are checked where they are parsed.
"""

import ntpath
import re

NAME_MAX = 255
"""Longest name of a file on common file systems."""
CATEGORY_MAX = 60
"""Longest name of a category: exporters name files by it."""
_ORDINARY = re.compile(r"\w[\w.-]{0,99}(?:/\w[\w.-]{0,99})*", re.ASCII)
"""Paths whose parts are names beyond doubt: nearly all, and records list thousands of them."""


def check_name(name: str, longest: int = NAME_MAX) -> str:
    """Return a name that can be one part of a path.

    Raises:
        ValueError: it is blank, too long, ``.`` or ``..``, or has a separator, a drive, a control
            character or another one that cannot be printed.
    """
    fits = (
        isinstance(name, str) and 0 < len(name) <= longest and name.isprintable() and name.strip()
    )
    leads_away = name in (".", "..") or any(separator in name for separator in "/\\")
    if not fits or leads_away or ntpath.splitdrive(name)[0]:
        raise ValueError(
            f"{str(name)[:longest]!r} cannot name a file; expected a name of 1 to {longest} "
            "printable characters, without / and \\"
        )
    return name


def check_inner_path(path: str) -> str:
    """Return a path relative to a folder, with ``/`` between its parts, that stays inside it.

    Raises:
        ValueError: a part is not a name.
    """
    if isinstance(path, str) and _ORDINARY.fullmatch(path):
        return path
    try:
        for name in path.split("/"):
            check_name(name)
    except ValueError as error:
        raise ValueError(f"{path[:NAME_MAX]!r}: {error}") from None
    return path
