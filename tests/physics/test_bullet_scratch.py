"""Scratch files of the physics engine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def test_a_world_that_is_never_closed_leaves_no_folder(tmp_path: Path) -> None:
    """A program may end, or forget a data set, without closing it."""
    code = (
        "from gen_data.generator.physics.bullet import World\n"
        "import os\n"
        "world = World(1 / 240, 50)\n"
        "print(len(os.listdir(os.environ['TMPDIR'])))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={"PATH": "", "TMPDIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.strip() == "1"
    assert not list(tmp_path.iterdir())
