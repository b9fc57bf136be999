"""Signals to stop as a flag and a file descriptor, instead of an exception at any point."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from gen_data.core import errors, system_calls

SIGNALS = system_calls.stop_signals()


class Interruption:
    """Requests to stop, by signal. A context manager for the main thread.

    In other threads it does nothing, because signals belong to the host program there.

    Attributes:
        wake: Becomes readable at a request.
    """

    def __init__(self, message: str) -> None:
        self._message = message
        self._name = ""
        self._immediate = 0
        self._before: dict[signal.Signals, object] = {}
        self.wake, self._writer = system_calls.wake_channel()

    def __enter__(self) -> "Interruption":
        """Install the signal handlers."""
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                # ``nohup`` makes its command ignore SIGHUP, which stays ignored.
                if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *exception: object) -> None:
        """Restore the previous handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        self.wake.close()
        self._writer.close()

    @property
    def pending(self) -> bool:
        """Whether there is a request that ``take`` has not returned."""
        return bool(self._name)

    def take(self) -> errors.Interrupted:
        """Return the error for the pending request, and clear the request."""
        error = errors.Interrupted(f"{self._name}: {self._message}")
        self._name = ""
        try:
            self.wake.recv(4096)
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
        # A full channel has woken its reader already.
        with suppress(BlockingIOError):
            self._writer.send(b"!")
