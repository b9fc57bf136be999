"""URLs of object storage, as opposed to paths."""

import re
from os import PathLike, fspath

SCHEME = re.compile(r"[a-z][a-z0-9+.-]+://")


def is_url(place: str | PathLike[str]) -> bool:
    """Whether a place is a URL, such as ``s3://bucket/folder``, and not a path."""
    return SCHEME.match(fspath(place)) is not None


def needs_folder(place: str | PathLike[str]) -> str:
    """Message for a function that reads folders only and got a URL."""
    return (
        f"{fspath(place)}: is a URL; expected a folder: copy the data set first, as with "
        "'aws s3 cp --recursive'. URLs are read by gen_data.open and by gen-data verify"
    )
