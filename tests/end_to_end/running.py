"""Run ``gen-data`` in its own process, as a user does."""

import hashlib
import json
import os
import select
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

TIMEOUT_S = 600
ROOT = Path(__file__).parents[2]
SMALL = ("--set", "sensors[0].size_px=[160, 120]", "--set", "shard_size=5")
"""Options that make a data set quick to generate."""


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "gen_data.cli", *arguments]


def environment(*before: Path) -> dict[str, str]:
    """This process's environment; it imports from these folders, then from the working tree."""
    inherited = os.environ.get("PYTHONPATH", "")
    folders = [*map(str, before), str(ROOT), *inherited.split(os.pathsep)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, folders))}


def gen_data(*arguments: str, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run to the end, with further environment variables; the caller checks the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        streams = [Path(folder, name) for name in ("stdout", "stderr")]
        for stream in streams:
            stream.touch()
        request = {
            "arguments": arguments, "cwd": str(cwd), "environment": {**environment(), **variables},
            "stdout": str(streams[0]), "stderr": str(streams[1]),
        }  # fmt: skip
        code = _answer(_server(), json.dumps(request))
        texts = [stream.read_text(encoding="utf-8") for stream in streams]
    return subprocess.CompletedProcess(command(*arguments), code, *texts)


@cache
def _server() -> subprocess.Popen[str]:
    """The process that forks commands; it ends when this one closes its input."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.end_to_end.cli_server"],
        cwd=ROOT,
        env=environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _answer(server: subprocess.Popen[str], request: str) -> int:
    assert server.stdin is not None and server.stdout is not None
    print(request, file=server.stdin, flush=True)
    if not select.select([server.stdout], [], [], TIMEOUT_S)[0]:
        raise subprocess.TimeoutExpired(request, TIMEOUT_S)
    return int(server.stdout.readline())


def digest(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] != "run"
    }
