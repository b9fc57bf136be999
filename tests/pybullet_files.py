"""The files of pybullet for interpreters for which it has no wheel: those of its pack."""

import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

PACKAGE = "pybullet_data"
_INIT = "import os\n\n\ndef getDataPath():\n    return os.path.dirname(__file__)\n"


def provide_pybullet_data() -> None:
    """Let this process, and those it starts, find ``pybullet_data``.

    The first time, the pack's archive is fetched; its files stay in the cache folder of the user.
    """
    if find_spec(PACKAGE) is not None:
        return
    packages = _fetch()
    sys.path.append(str(packages))
    inherited = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [inherited, str(packages)]))


def _fetch() -> Path:
    """The folder that contains the package, which is complete or absent."""
    from gen_data.assets.library import default_cache_dir
    from gen_data.packs.archives import extract
    from gen_data.packs.fetch import check_archive, fetch
    from gen_data.packs.pack_table import find_pack

    pack = find_pack("pybullet")
    packages = default_cache_dir() / "tests" / f"pybullet-{pack.version}"
    if packages.is_dir():
        return packages
    packages.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=packages.parent) as scratch:
        archive_dir, source = Path(scratch, "archive"), Path(scratch, "source")
        archive_dir.mkdir()
        source.mkdir()
        archive = fetch(pack, archive_dir)
        check_archive(pack, archive)
        extract(archive, pack.wanted, source)
        (source / PACKAGE / "__init__.py").write_text(_INIT, encoding="utf-8")
        source.rename(packages)
    return packages
