"""Parsing of foreign files in a child process with limits: a hostile file harms nothing.

Parsers of meshes, images and stages partly consist of native code. In a child of bounded memory and
processor time, without rights to write or to connect, a crash or an endless loop ends in one error.
"""

import atexit
import io
import json
import os
import pickle
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from gen_data.assets.asset_cache import Arrays, decode_arrays
from gen_data.core.errors import AssetError
from gen_data.core.processes import SINGLE_THREADED
from gen_data.core.system_calls import KILLED

LENGTH = struct.Struct("<Q")
"""Length prefix of requests and replies on the pipes between both processes."""
CPU_S, CPU_S_PER_BYTE = 10.0, 2e-6
MEMORY_BYTES, MEMORY_PER_BYTE = 1 << 30, 40
"""Limits of one call: a constant share and one in proportion to the size of the files.

A mesh of 100 MB thus has 210 s and 5 GB; the largest packs need a tenth of that.
"""
_START = (
    "import os, sys; sys.path[:] = sys.argv[3:]; "
    f"os.environ.update(dict.fromkeys({(*SINGLE_THREADED, 'PXR_WORK_THREAD_LIMIT')!r}, '1')); "
    "from gen_data.assets.sandbox_process import main; "
    "main(int(sys.argv[1]), sys.argv[2])"
)
"""Modules are found as in this process, whatever the working directory holds."""
TOO_LONG = -int(getattr(signal, "SIGXCPU", 24))
"""Exit status of a process that has used up its processor time."""
_WALL_PER_CPU = 12.0
"""Wall time in multiples of the limit of processor time: other processes may hold the cores."""


class Sandbox:
    """A child process that calls functions one at a time; started on demand.

    The child ends by itself when it has nothing to do for some seconds, and with its parent.
    """

    def __init__(self) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._lock = threading.Lock()

    def run(
        self, function: Callable[..., Arrays], *arguments: Any, place: str, input_bytes: int
    ) -> Arrays:
        """Call a function of a module in the child.

        Args:
            function: Function of a module.
            arguments: Values that can be pickled; paths are relative to this process's folder.
            place: Beginning of an error message: the file.
            input_bytes: Total size of the files that the function reads; its limits grow with it.

        Returns:
            Its result: arrays of numbers by name.

        Raises:
            AssetError: as the function does, or if it reaches a limit or crashes.
        """
        cpu_s = CPU_S + CPU_S_PER_BYTE * input_bytes
        memory_bytes = MEMORY_BYTES + MEMORY_PER_BYTE * input_bytes
        request = pickle.dumps((function, arguments, place, cpu_s, memory_bytes, _working_folder()))
        with self._lock:
            return _decode_reply(self._call(request, cpu_s, place))

    def close(self) -> None:
        """End the child."""
        if self._child is not None and self._owner == os.getpid():
            self._child.kill()
            self._reap()

    def _call(self, request: bytes, cpu_s: float, place: str) -> bytes:
        """Reply to a request. Raises AssetError if the child ends without one."""
        status = 0
        # A second time, because an idle child may end just before it receives the request.
        for _ in range(2):
            try:
                reply = self._exchange(request, cpu_s * _WALL_PER_CPU)
            except BaseException:
                # An interrupted exchange would leave its reply for the next request.
                self.close()
                raise
            if reply is not None:
                return reply
            status = self._reap()
            if status != 0:
                break
        raise AssetError(f"{place}: {_describe_end(status, cpu_s)}")

    def _exchange(self, request: bytes, timeout_s: float) -> bytes | None:
        """Send a request and receive its reply; None if the child ended or took too long."""
        child = self._running_child()
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            child.stdin.write(LENGTH.pack(len(request)) + request)
            child.stdin.flush()
        except BrokenPipeError:
            return None
        # Whatever blocks below ends with the child. Windows has no wait for pipes with a timeout.
        guard = threading.Timer(timeout_s, child.kill)
        guard.daemon = True
        guard.start()
        try:
            head = _receive(child.stdout.fileno(), LENGTH.size)
            return head and _receive(child.stdout.fileno(), LENGTH.unpack(head)[0])
        finally:
            guard.cancel()

    def _running_child(self) -> subprocess.Popen[bytes]:
        if self._owner != os.getpid():
            # A forked copy of a process must not talk to the child of the original.
            self._child = None
        if self._child is not None and self._child.poll() is not None:
            self._reap()
        if self._child is None:
            # Resolved: a worker's folder is a link that only the worker itself can follow.
            folder = os.path.realpath(tempfile.gettempdir())
            self._child = subprocess.Popen(
                [sys.executable, "-c", _START, str(os.getpid()), folder, *sys.path],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
            self._owner = os.getpid()
        return self._child

    def _reap(self) -> int:
        """Exit status of the child, which has ended or does not answer."""
        child, self._child = self._child, None
        assert child is not None
        try:
            status = child.wait(timeout=0.5)
        except subprocess.TimeoutExpired:
            child.kill()
            status = child.wait()
        for pipe in (child.stdin, child.stdout):
            # Closing flushes data that the child no longer receives.
            with suppress(BrokenPipeError):
                if pipe is not None:
                    pipe.close()
        return status


def _working_folder() -> str:
    """The folder that relative paths start from; empty if it no longer exists."""
    try:
        return str(Path.cwd())
    except OSError:
        return ""


def _describe_end(status: int, cpu_s: float) -> str:
    """Reason and remedy for an exit status of the child (negative: number of a signal)."""
    if status in (KILLED, TOO_LONG):
        return f"not read within {cpu_s:.0f} s of processor time; simplify or split it"
    name = signal.Signals(-status).name if status < 0 else f"exit status {status}"
    return f"its reader crashed ({name}); the file is damaged, export it again"


def _receive(descriptor: int, size: int) -> bytes | None:
    """Read ``size`` bytes; None at the end of the stream."""
    parts = io.BytesIO()
    while parts.tell() < size:
        part = os.read(descriptor, min(size - parts.tell(), 1 << 20))
        if not part:
            return None
        parts.write(part)
    return parts.getvalue()


def _decode_reply(reply: bytes) -> Arrays:
    """Arrays of a reply. Raises AssetError if it holds an error message instead.

    Replies are not unpickled, because the file that was parsed may have taken over the child.
    """
    arrays = decode_arrays(reply, "")
    if arrays is None:
        raise RuntimeError("unreadable reply of the process that reads assets")
    if "error" in arrays:
        error = json.loads(arrays["error"].tobytes())
        raise (AssetError if error["expected"] else RuntimeError)(error["message"])
    return arrays


SANDBOX = Sandbox()
"""The child of this process."""
atexit.register(SANDBOX.close)


def run_sandboxed(
    function: Callable[..., Arrays], root: Path, files: Mapping[str, str], *arguments: object
) -> Arrays:
    """Call ``function(root, files, *arguments)`` in this process's sandbox.

    Args:
        function: Function of a module.
        root: Folder of the files.
        files: The files, relative to the folder, and their digests.
        arguments: Further arguments; values that can be pickled.

    Raises:
        AssetError: as the function does, or if it reaches a limit or crashes.
    """
    sizes = [path.stat().st_size for name in files if (path := root / name).is_file()]
    place = str(root / next(iter(files), ""))
    return SANDBOX.run(function, root, files, *arguments, place=place, input_bytes=sum(sizes))
