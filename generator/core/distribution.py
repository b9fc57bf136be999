"""The distribution on package indices: its name, and the command that installs its extras."""

import json
import shlex
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

DISTRIBUTION = "gen-data-perception"
"""As in pyproject.toml. ``gen-data`` on the public index is another project."""
_FOLDER = Path(__file__).resolve().parents[2]
"""The checkout that this module lies in, or the package of an installed wheel."""


def install_command(*extras: str) -> str:
    """Command that adds extras to this installation, from any working folder.

    It installs from where this code came: the checkout that it lies in; the checkout or wheel that
    pip installed; where neither exists any more, the package index.
    """
    names = f"[{','.join(sorted(extras))}]"
    if (_FOLDER / "pyproject.toml").is_file():
        return f"pip install -e {shlex.quote(f'{_FOLDER}{names}')}"
    return f"pip install {shlex.quote(f'{_source() or DISTRIBUTION}{names}')}"


@cache
def _source() -> Path | None:
    """The folder or wheel that pip installed.

    Source: PEP 610, ``direct_url.json``.
    """
    try:
        origin = json.loads(distribution(DISTRIBUTION).read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return None
    url = urlsplit(origin.get("url", ""))
    path = Path(url2pathname(url.path))
    return path if url.scheme == "file" and path.exists() else None
