"""Files that descriptions of robots refer to by the names of packages or models."""

import re
from pathlib import PurePosixPath

from gen_data.assets.asset_folder import Folder
from gen_data.core.errors import AssetError

_PACKAGE_FILE = "package.xml"
_URI = re.compile(r"(?:package|model)://")
_NAME = re.compile(rb"<name>\s*([\w.-]+)\s*</name>")


def resolve_uri(folder: Folder, relative: str, uri: str) -> str:
    """Resolve ``package://x/y``, ``model://x/y`` or a relative path to a file below the folder.

    A package is the folder of that name next to or above the file ``relative``, or the one above it
    whose ``package.xml`` has that name. Older descriptions omit the package's name, so the path is
    also tried unchanged, and names of folders above the file may precede it.

    Returns:
        The first such file that exists, else the first in a folder that exists, else the path
        where it is expected first.

    Raises:
        AssetError: if it is another URL, absolute, or leaves the folder.
    """
    uri = uri.strip()
    if not _URI.match(uri):
        return folder.refer(relative, uri)
    path, name = PurePosixPath(uri.partition("://")[2].lstrip("/")), PurePosixPath(relative).name
    base = PurePosixPath(relative).parent
    candidates = []
    for ancestor in (base, *base.parents):
        package = _package_name(folder, ancestor)
        known = {ancestor.name or folder.root.resolve().name, package}
        # The asset folder itself stands for a package that nothing else names.
        unnamed = not ancestor.name and not package
        tails = [
            path,
            *(
                PurePosixPath(*path.parts[k:])
                for k in range(1, len(path.parts))
                if path.parts[k - 1] in known or (unnamed and k == 1)
            ),
        ]
        candidates += [folder.refer(str(ancestor / name), str(tail)) for tail in tails]
    beside = (c for c in candidates if _has_folder(folder, c))
    return next((c for c in candidates if folder.exists(c)), next(beside, candidates[0]))


def _has_folder(folder: Folder, relative: str) -> bool:
    """Whether a file's folder exists and is not the asset folder itself."""
    try:
        return "/" in relative and folder.path(relative).parent.is_dir()
    except AssetError:
        return False


def _package_name(folder: Folder, ancestor: PurePosixPath) -> str:
    """Name of the ROS package in a folder; empty if it is none."""
    file = str(ancestor / _PACKAGE_FILE)
    found = _NAME.search(folder.read(file)) if folder.exists(file) else None
    return found.group(1).decode() if found else ""
