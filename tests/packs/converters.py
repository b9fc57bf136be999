"""Converters of packs that only tests have."""

import json
import os
import shutil
import signal
import zipfile
from hashlib import sha256
from pathlib import Path

from gen_data.packs.pack_table import Pack

BOX = (
    "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
)


def zipped_box(path: Path, side: str = "1") -> Path:
    """A package with a box, of which one side has this length."""
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("data/box.obj", BOX.replace("v 1", f"v {side}"))
        file.writestr("package/__init__.py", "raise SystemExit('imported')")
    return path


def box_pack(archive: Path) -> Pack:
    return Pack(
        name="boxes",
        summary="a box",
        client="pip",
        package="package",
        version="1.0",
        sha256=sha256(archive.read_bytes()).hexdigest(),
        licence="CC-BY-3.0",
        wanted=("data/*",),
        converter="tests.packs.converters:box",
    )


def box(source: Path, target: Path) -> None:
    shutil.copyfile(source / "data" / "box.obj", target / "box.obj")
    entry = {"id": "box", "file": "box.obj", "category": "box", "tags": ["household", "pack"],
             "licence": "CC-BY-3.0", "author": "A. Modeller", "source": "a test"}  # fmt: skip
    (target / "index.json").write_text(json.dumps({"assets": [entry]}), encoding="utf-8")


def killed(source: Path, target: Path) -> None:
    """Half a pack, then the process dies as if its plug were pulled."""
    box(source, target)
    os.kill(os.getpid(), signal.SIGKILL)
