"""Remarks on a user's files, once per file."""

import warnings
from collections.abc import Iterable, Iterator, Set

from gen_data.assets.importer import FileRemarks
from gen_data.assets.library import Library
from gen_data.core.errors import AssetError, AssetWarning

_USER = "user/"
READ_MAX = 64
"""Most assets that are imported for their remarks alone; a folder may hold thousands."""


def collect_remarks(
    library: Library, asset_ids: Iterable[str], read_max: int = READ_MAX
) -> tuple[FileRemarks, ...]:
    """Remarks on the files of the user's assets among ``asset_ids``, by file.

    Remarks are complete for assets imported before; of the others, at most ``read_max`` are
    imported. An asset that cannot be used has none: its use reports the fault.
    """
    found: dict[str, list[str]] = {}
    for remarks in _each(library, asset_ids, read_max):
        found.setdefault(remarks.file, []).extend(remarks.unused)
    return tuple(FileRemarks(file, tuple(dict.fromkeys(unused))) for file, unused in found.items())


def warn_of_remarks(
    library: Library,
    asset_ids: Iterable[str],
    read_max: int = READ_MAX,
    told: Set[str] = frozenset(),
) -> frozenset[str]:
    """Warn once per file with an AssetWarning; return the files told of, with those before."""
    remarks = collect_remarks(library, asset_ids, read_max)
    for one in remarks:
        if one.file not in told:
            message = f"{one.file}: not used as it is: {'; '.join(one.unused)}"
            warnings.warn(message, AssetWarning, stacklevel=3)
    return frozenset(told) | {one.file for one in remarks}


def _each(library: Library, asset_ids: Iterable[str], read_max: int) -> Iterator[FileRemarks]:
    left = read_max
    for asset_id in sorted(asset_ids):
        if not asset_id.startswith(_USER):
            continue
        try:
            known = library.remarks(asset_id, read=False)
            if known is None and left > 0:
                left -= 1
                known = library.remarks(asset_id)
        except AssetError:
            continue
        yield from known or ()
