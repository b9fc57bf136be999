"""Run ``gen-data`` in its own process, as a user does."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SMALL = ("--set", "sensors[0].size_px=[160, 120]", "--set", "shard_size=5")
"""Options that make a data set quick to generate."""


def command(*arguments: str) -> list[str]:
    """The command line of ``gen-data`` with these arguments, in this environment."""
    return [sys.executable, "-m", "gen_data.generator.cli", *arguments]


def environment() -> dict[str, str]:
    """This process's environment, with the working tree importable from any folder."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def gen_data(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run to the end; the caller checks the exit code."""
    return subprocess.run(
        command(*arguments),
        cwd=cwd,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )


def digest(folder: Path) -> dict[str, str]:
    """sha256 of every file of a data set except those in ``run/``."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] != "run"
    }
