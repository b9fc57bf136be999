"""Converters of packs that only tests have."""

import json
import os
import shutil
import signal
from pathlib import Path

BOX = (
    "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
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
