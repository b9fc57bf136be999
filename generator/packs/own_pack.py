"""Packs of a user's assets: one file with equal bytes for equal content, named by its digest.

A pack is a ZIP file without compression, whose bytes would depend on the release of a library; its
members are sorted, and have no times and no access rights.
"""

import re
import shutil
import tempfile
import zipfile
from pathlib import Path

from gen_data.assets.asset_folder import MAX_FILE_BYTES, Folder, list_files
from gen_data.assets.library import default_cache_dir
from gen_data.core.errors import AssetError
from gen_data.core.whole_files import whole_file
from gen_data.packs import archives
from gen_data.packs.fetch import file_digest

SUFFIX = ".zip"
FORMAT = 1
_COMMENT = b"gen-data assets, format %d"
_EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The first instant that ZIP can express."""
_RIGHTS = 0o100644 << 16
_UNIX = 3
_LIMITS = archives.Limits(
    members=100_000, file_bytes=MAX_FILE_BYTES, total_bytes=1 << 40, ratio=1.0
)


def write_pack(folder: Path, target: Path) -> str:
    """Write all files of a folder but hidden ones into a pack, and return its SHA-256.

    Raises:
        AssetError: there is none, or one cannot be read, is too large, or is a link out of it.
        OSError: the pack cannot be written.
    """
    # An earlier pack in the folder is none of its assets.
    names = [name for name in list_files(folder) if (folder / name).resolve() != target.resolve()]
    if not names:
        raise AssetError(f"{folder}: has no files; expected a folder of assets")
    reader = Folder(folder)
    with whole_file(target) as unfinished:
        with zipfile.ZipFile(unfinished, "w") as archive:
            archive.comment = _COMMENT % FORMAT
            for name in sorted(names):
                member = zipfile.ZipInfo(name, _EARLIEST)
                member.create_system, member.external_attr = _UNIX, _RIGHTS
                archive.writestr(member, reader.read(name))
        return file_digest(unfinished)


def unpacked(pack: Path, sha256: str) -> Path:
    """The folder with the files of a pack, which is unpacked at the first call.

    Args:
        pack: File of the pack; it need not exist any more once it was unpacked.
        sha256: Its digest.

    Raises:
        AssetError: the pack is missing, has another digest, or is of a newer format.
        OSError: it cannot be unpacked.
    """
    # The name of the folder is the category of assets that state none.
    folder = own_packs_dir() / sha256 / pack.stem
    if folder.is_dir():
        return folder
    if not pack.is_file():
        raise AssetError(f"{pack}: is missing")
    found = file_digest(pack)
    if found != sha256:
        raise AssetError(
            f"{pack}: was changed or cut off: its digest is {found[:16]}, expected {sha256[:16]}"
        )
    _check_format(pack)
    folder.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(".part", dir=folder.parent))
    try:
        archives.extract(pack, ("*",), scratch / "files", _LIMITS)
        if not folder.is_dir():
            (scratch / "files").rename(folder)
    except OSError:
        # Another process may have been faster.
        if not folder.is_dir():
            raise
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return folder


def own_packs_dir() -> Path:
    """Folder of unpacked packs, by digest; it need not exist."""
    return default_cache_dir() / "own-packs"


def _check_format(pack: Path) -> None:
    try:
        with zipfile.ZipFile(pack) as archive:
            comment = archive.comment.decode("ascii", "replace")
    except (OSError, zipfile.BadZipFile):
        comment = ""
    stated = re.fullmatch(r"gen-data assets, format (\d{1,9})", comment)
    if stated is None:
        raise AssetError(f"{pack}: is not a pack; expected one that gen-data assets pack wrote")
    if int(stated[1]) > FORMAT:
        raise AssetError(
            f"{pack}: is of format {stated[1]}, newer than this gen-data; expected {FORMAT}: "
            "update gen-data"
        )
