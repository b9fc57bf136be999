"""The child process of ``sandbox.Sandbox``."""

import ctypes
import json
import os
import pickle
import select
import signal
import sys
import tempfile
import traceback
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.assets import asset_cache, sandbox
from gen_data.core import errors, processes, system_calls

try:
    resource: Any = import_module("resource")
except ImportError:
    resource = None

_IDLE_S = 5.0
_FILES_MAX = 256
_CLONE_NEWUSER, _CLONE_NEWNET = 0x10000000, 0x40000000  # <linux/sched.h>


def main(parent_pid: int, temporary_folder: str) -> None:
    """Serve requests from standard input until it ends or stays silent."""
    processes.end_with_parent(parent_pid)
    tempfile.tempdir = temporary_folder
    # An interrupt from the terminal reaches the whole group; the parent decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.dup(1)
    # Libraries print warnings, which must not mix with replies.
    os.dup2(2, 1)
    _give_up_rights()
    system_calls.read_binary(0, replies)
    while _is_request_due():
        head = _read(sandbox.LENGTH.size)
        if not head:
            break
        reply = _serve(_read(sandbox.LENGTH.unpack(head)[0]))
        _write(replies, sandbox.LENGTH.pack(len(reply)) + reply)


def _is_request_due() -> bool:
    """Whether a request comes before this process has been idle for long enough."""
    # Windows waits for sockets only: there, this process ends with its parent or its input.
    return resource is None or bool(select.select([0], [], [], _IDLE_S)[0])


def _give_up_rights() -> None:
    """No core dumps, few open files and, where permitted, no network; Windows has no limits."""
    processes.forbid_core_dumps()
    if resource is None:
        return
    files = min(_FILES_MAX, resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    if sys.platform == "linux":
        # An own network namespace has no interfaces. Unprivileged users need a user namespace,
        # which some systems forbid; then only the readers themselves avoid the network.
        libc = ctypes.CDLL(None)
        if libc.unshare(_CLONE_NEWNET) != 0:
            libc.unshare(_CLONE_NEWUSER | _CLONE_NEWNET)


def _serve(request: bytes) -> bytes:
    """Encoded result, or error, of a request."""
    function, arguments, place, cpu_s, memory_bytes, working_folder = pickle.loads(request)
    try:
        if working_folder:
            # The parent may have changed it since this process started, as notebooks do.
            os.chdir(working_folder)
        _limit(cpu_s, memory_bytes)
        return asset_cache.encode_arrays("", function(*arguments))
    except errors.AssetError as error:
        return _encode_error(str(error), expected=True)
    except MemoryError:
        message = f"{place}: needs more than {memory_bytes / 1e9:.1f} GB; simplify it"
        return _encode_error(message, expected=True)
    except Exception:
        return _encode_error(traceback.format_exc(), expected=False)


def _limit(cpu_s: float, memory_bytes: int) -> None:
    """Limit processor time, memory and file sizes from now on; the first kills the process.

    On Windows, only the parent's limit on time holds.
    """
    if resource is None:
        return
    usage = resource.getrusage(resource.RUSAGE_SELF)
    used_s = usage.ru_utime + usage.ru_stime
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    resource.setrlimit(resource.RLIMIT_CPU, (int(used_s + cpu_s) + 1, hard))
    # Archives of stages are unpacked to a temporary folder.
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (memory_bytes, hard))
    with suppress(OSError, ValueError):
        # Writable memory, and not the address space, of which native libraries reserve gigabytes.
        held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (held + memory_bytes, hard))


def _encode_error(message: str, *, expected: bool) -> bytes:
    text = json.dumps({"message": message, "expected": expected})
    arrays: asset_cache.Arrays = {"error": np.frombuffer(text.encode(), np.uint8)}
    return asset_cache.encode_arrays("", arrays)


def _read(size: int) -> bytes:
    """Read ``size`` bytes from standard input; fewer at its end."""
    data = b""
    while len(data) < size and (part := os.read(0, size - len(data))):
        data += part
    return data


def _write(descriptor: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]
