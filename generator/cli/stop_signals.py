"""Requests to stop a command, by signal: clean up and end, within seconds, and at once if repeated.

The first request raises KeyboardInterrupt in the main thread, unless a run handles it
(``gen_data.runner.termination_signals``). Python delivers it between two steps of Python
code only, and drops it in some places, such as destructors. Therefore a thread watches: the process
ends ``PATIENCE_S`` after the first request, or at the second one.
"""

import os
import select
import signal
import socket
import threading
import time
from types import FrameType

from gen_data.core.system_calls import stop_signals, wake_channel

SIGNALS = stop_signals()
PATIENCE_S = 8.0
REPEATED_S = 0.1
"""Signals that follow within this time are the same request: ``timeout`` signals a process, and
then its group."""
INTERRUPTED = 130
"""Exit code of ``gen_data.core.errors.Interrupted``."""
SHOW_CURSOR = "\x1b[?25h"

_installed: list[signal.Signals] = []
_kept: list[socket.socket] = []
"""Sockets that live as long as the process."""
_raised: list[int] = []
"""Number of the signal that has raised KeyboardInterrupt; one at most: cleaning up is not
interrupted."""


def handle_stop_signals() -> None:
    """Install the handlers and the thread; further calls do nothing.

    ``nohup`` makes its command ignore SIGHUP, which stays ignored.
    """
    if _installed or threading.current_thread() is not threading.main_thread():
        return
    reader, writer = wake_channel()
    _kept.append(writer)
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    # A forked process would report its signals as signals of this one.
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_forget_wakeup)
    for number in SIGNALS:
        if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)
            _installed.append(number)
    threading.Thread(target=_watch, args=(reader,), daemon=True).start()


def ignore_stop_signals() -> None:
    """Let an interrupted process end with its own exit code, for at most ``PATIENCE_S``.

    Python restores the default handlers before it ends, and a signal would kill it then.
    """
    for number in _installed:
        signal.signal(number, signal.SIG_IGN)


def is_stop_requested() -> bool:
    """Whether a signal has raised KeyboardInterrupt, which some code turns into other errors."""
    return bool(_raised)


def _forget_wakeup() -> None:
    signal.set_wakeup_fd(-1)


def _interrupt(number: int, frame: FrameType | None) -> None:
    del frame
    if not _raised:
        _raised.append(number)
        raise KeyboardInterrupt


def _watch(reader: socket.socket) -> None:
    """End the process at the second request, or if the first one has no effect."""
    first_s: float | None = None
    while True:
        left_s = None if first_s is None else first_s + PATIENCE_S - time.monotonic()
        if left_s is not None and left_s <= 0.0:
            _end("gen-data: interrupted")
        ready, _, _ = select.select([reader], [], [], left_s)
        if not ready or not any(number in SIGNALS for number in reader.recv(4096)):
            continue
        if first_s is None:
            first_s = time.monotonic()
        elif time.monotonic() - first_s > REPEATED_S:
            _end("gen-data: interrupted twice, stopped at once")


def _end(message: str) -> None:
    """End this process without cleaning up; the kernel ends its helpers with it."""
    cursor = SHOW_CURSOR if os.isatty(2) else ""
    os.write(2, f"{cursor}{message}\n".encode())
    os._exit(INTERRUPTED)
