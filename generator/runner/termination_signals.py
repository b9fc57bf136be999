"""Ctrl-C and SIGTERM as a flag and a file descriptor, instead of an exception anywhere."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from gen_data.generator.core.errors import Interrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Whether the user asked to stop. A context manager, for the main thread.

    In other threads it does nothing: there, signals are the host program's business.

    Attributes:
        wake_fd: Becomes readable when the user asks.
    """

    def __init__(self, message: str) -> None:
        self._message = message
        self._name = ""
        self._immediate = 0
        self._before: dict[signal.Signals, object] = {}
        self.wake_fd, self._signal_fd = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)

    def __enter__(self) -> Interruption:
        """Take over the signals."""
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *exception: object) -> None:
        """Give them back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        os.close(self.wake_fd)
        os.close(self._signal_fd)

    @property
    def pending(self) -> bool:
        """Whether the user asked and nobody has taken note."""
        return bool(self._name)

    def take(self) -> Interrupted:
        """The error to end with; nothing is pending any more."""
        error = Interrupted(f"{self._name}: {self._message}")
        self._name = ""
        try:
            os.read(self.wake_fd, 4096)
        except BlockingIOError:
            return error
        return error

    @contextmanager
    def immediate(self) -> Iterator[None]:
        """Raise Interrupted in the block at once: for code that may end anywhere."""
        self._immediate += 1
        try:
            if self.pending:
                raise self.take()
            yield
        finally:
            self._immediate -= 1

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        del frame
        self._name = "interrupted" if number == signal.SIGINT else signal.Signals(number).name
        if self._immediate:
            raise self.take()
        os.write(self._signal_fd, b"!")
