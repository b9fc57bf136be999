"""Converter of the pybullet pack: the package's files as they are.

The index of these assets belongs to the library, because pybullet itself has the same files.
"""

from pathlib import Path

_DATA = "pybullet_data"


def convert(source: Path, target: Path) -> None:
    """Move the folder's content to the pack.

    Args:
        source: Holds the wanted members of the package.
        target: Empty folder of the pack.
    """
    for path in sorted((source / _DATA).iterdir()):
        path.rename(target / path.name)
