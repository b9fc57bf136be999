"""The asset library of a run, with files that it fetches when they are first needed."""

import sys
from collections.abc import Sequence
from pathlib import Path

from gen_data.assets import file_library, library
from gen_data.assets.paths import OFFLINE, may_fetch
from gen_data.core.errors import AssetError


def open_assets(user_roots: Sequence[Path] = ()) -> library.Library:
    """Open the library with the user's folders; it provides the files of pybullet."""
    return library.open_library(user_roots, provide=provide_pybullet)


def provide_pybullet(folder: Path) -> None:
    """Install the pack with the files of pybullet, which is installed where it has a wheel.

    One line on stderr reports that it is fetched. Several processes may call this at once.

    Args:
        folder: Folder of installed packs.

    Raises:
        AssetError: it cannot be fetched.
    """
    if not may_fetch():
        return
    from gen_data.packs.install import install_once
    from gen_data.packs.pack_table import find_pack

    pack = find_pack(file_library.PYBULLET)

    def announce() -> None:
        sys.stderr.write(
            f"fetching robot arms and objects once: {pack.source} (a download of 103 MB, of which "
            f"35 MB stay in {folder}; licence {pack.licence})\n"
        )
        sys.stderr.flush()

    try:
        install_once(pack, folder, announce)
    except AssetError as error:
        raise AssetError(
            f"{error}\n  Robot arms and some objects are files of pybullet. With {OFFLINE}=1, "
            "everything that needs none of them goes on without"
        ) from None
