"""Formats of descriptions of robots and other jointed objects, by suffix."""

from collections.abc import Callable
from pathlib import PurePosixPath

from gen_data.assets import asset_folder, mjcf, sdf
from gen_data.assets.robot_description import RobotDescription
from gen_data.assets.urdf import read_urdf
from gen_data.core.errors import AssetError

_READERS: dict[str, Callable[[asset_folder.Folder, str], RobotDescription]] = {
    ".urdf": read_urdf,
    # Refused with the command that expands it.
    ".xacro": read_urdf,
    ".xml": mjcf.read_mjcf,
    ".sdf": sdf.read_sdf,
}
MJCF_SUFFIX = ".xml"
LISTED_SUFFIXES = frozenset(_READERS) - {".xacro"}
"""Of files that are assets in a folder without an index."""
_FOREIGN = {MJCF_SUFFIX}
"""Read by a native parser, and therefore in the sandbox."""


def is_description(file: str) -> bool:
    """Whether a file, by its suffix, describes links and joints."""
    return PurePosixPath(file).suffix.lower() in _READERS


def is_foreign(file: str) -> bool:
    """Whether a description is read in the sandbox only."""
    return PurePosixPath(file).suffix.lower() in _FOREIGN


def read_description(folder: asset_folder.Folder, relative: str) -> RobotDescription:
    """Read a description of links and joints.

    Raises:
        AssetError: if it is malformed, or of another format.
    """
    suffix = PurePosixPath(relative).suffix.lower()
    if suffix not in _READERS:
        raise AssetError(
            f"{folder.root / relative}: robots are not read from '{suffix}'; "
            f"give one of {', '.join(sorted(_READERS))}"
        )
    return _READERS[suffix](folder, relative)
