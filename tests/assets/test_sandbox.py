"""The process that reads assets: limits, crashes, and its end.

The functions called in it are Python's own, with the effects that a hostile file has on a parser.
"""

import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gen_data.assets import sandbox
from gen_data.assets.parsing import parse_image
from gen_data.assets.readers.stl import read_stl
from gen_data.assets.sandbox import Sandbox
from gen_data.core.errors import AssetError


@pytest.fixture(scope="module")
def shared() -> Iterator[Sandbox]:
    """One child for the tests that it survives or that end it; it starts again by itself."""
    child = Sandbox()
    yield child
    child.close()


def test_results_and_errors_arrive_as_they_are(shared: Sandbox, tmp_path: Path) -> None:
    """All dtypes and shapes arrive as they were, in one process for several calls."""
    wanted = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1, 255], np.uint8)}
    for _ in range(2):
        arrays = shared.run(dict, wanted, place="x", input_bytes=0)
        assert {name: array.tolist() for name, array in arrays.items()} == {
            "a": [[0, 1, 2], [3, 4, 5]],
            "b": [1, 255],
        }
        assert arrays["b"].dtype == np.uint8
    (tmp_path / "a.png").write_bytes(b"noise")
    with pytest.raises(AssetError, match=r"a\.png: unreadable.*; [^\n]*$"):
        shared.run(parse_image, tmp_path, {}, "a.png", "rgb", place="x", input_bytes=0)
    # Everything but an AssetError is a fault of the program and keeps its traceback.
    with pytest.raises(RuntimeError, match="TypeError"):
        shared.run(read_stl, place="x", input_bytes=0)


def test_relative_paths_follow_the_folder_of_the_caller(
    shared: Sandbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for shade in (10, 200):
        here = tmp_path / str(shade)
        (here / "photos").mkdir(parents=True)
        Image.new("L", (2, 2), shade).save(here / "photos" / "a.png")
        monkeypatch.chdir(here)
        arrays = shared.run(
            parse_image, Path("photos"), {}, "a.png", "rgb", place="", input_bytes=0
        )
        assert next(iter(arrays.values())).max() == shade


def test_memory_and_time_are_limited(shared: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """An allocation beyond the limit is one error, and the process goes on."""
    with pytest.raises(AssetError, match=r"^a\.obj: needs more than 1\.1 GB"):
        shared.run(bytes, 3 << 30, place="a.obj", input_bytes=0)
    # A loop inside native code ends, too.
    monkeypatch.setattr(sandbox, "CPU_S", 1.0)
    with pytest.raises(AssetError, match=r"a\.obj: not read within 1 s of processor time"):
        shared.run(pow, 3, 10**9, place="a.obj", input_bytes=0)
    # A reader that waits takes no processor time, but no longer than the limit.
    monkeypatch.setattr(sandbox, "CPU_S", 0.5)
    monkeypatch.setattr(sandbox, "_WALL_PER_CPU", 2.0)
    with pytest.raises(AssetError, match="not read within"):
        shared.run(time.sleep, 60.0, place="a.obj", input_bytes=0)


def test_a_crash_is_an_error_of_the_file_and_no_connection_leaves(shared: Sandbox) -> None:
    """Segmentation faults and aborts name the file; the next file is read as usual."""
    with pytest.raises(AssetError, match=r"a\.ply: its reader crashed \(SIGSEGV\)"):
        shared.run(ctypes.string_at, 0, place="a.ply", input_bytes=0)
    with pytest.raises(AssetError, match=r"a\.ply: its reader crashed \(SIGABRT\)"):
        shared.run(os.abort, place="a.ply", input_bytes=0)
    assert shared.run(dict, place="x", input_bytes=0) == {}
    # Even the loopback interface is out of reach (network_namespaces(7)).
    if subprocess.run(["unshare", "-n", "true"], check=False).returncode != 0:
        pytest.skip("root may write everywhere: own network namespaces are not permitted here")
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        pytest.raises(RuntimeError, match=r"OSError|unreachable"),
    ):
        shared.run(socket.create_connection, server.getsockname(), 5.0, place="x", input_bytes=0)


def test_an_idle_process_ends_and_the_next_call_starts_another() -> None:
    """No memory is held while nothing is read."""
    child = Sandbox()
    child.run(dict, place="x", input_bytes=0)
    process = child._child
    assert process is not None
    os.kill(process.pid, signal.SIGTERM)
    process.wait()
    assert child.run(dict, place="x", input_bytes=0) == {}
    child.close()


def test_the_process_ends_with_its_parent(tmp_path: Path) -> None:
    """A killed program leaves nothing behind (prctl(2), PR_SET_PDEATHSIG)."""
    program = (
        "import sys, os, time; from gen_data.assets.sandbox import SANDBOX; "
        "SANDBOX.run(dict, place='x', input_bytes=0); "
        "print(SANDBOX._child.pid, flush=True); "
        "SANDBOX.run(time.sleep, 60.0, place='x', input_bytes=0)"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
        parent.wait()
    deadline_s = time.monotonic() + 10.0
    while Path(f"/proc/{pid}").exists() and time.monotonic() < deadline_s:
        time.sleep(0.01)
    assert not Path(f"/proc/{pid}").exists()
