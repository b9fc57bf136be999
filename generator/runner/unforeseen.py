"""Errors nobody foresaw, made presentable: place, fact, command to reproduce, end of the trace."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from generator.core.errors import GenDataError, SampleError

TRACE_LINES = 12


@contextmanager
def explaining(place: str, command: str = "") -> Iterator[None]:
    """Turn whatever is no GenDataError into a SampleError that names the place.

    A plain SampleError gets place and command, too; its subclasses say more than that themselves.
    """
    try:
        yield
    except GenDataError as error:
        if type(error) is not SampleError:
            raise
        reproduce = f"\n  Reproduce: {command}" if command else ""
        raise SampleError(f"{place}: {error}{reproduce}") from error
    except Exception as error:
        raise unforeseen(error, place, command) from error


def unforeseen(error: Exception, place: str, command: str = "") -> SampleError:
    """A SampleError with the end of the error's traceback, which does not cross processes."""
    trace = "".join(traceback.format_exception(type(error), error, error.__traceback__))
    lines = [f"{place}: {type(error).__name__}: {error}"]
    lines += [f"  {line}" for line in trace.rstrip().splitlines()[-TRACE_LINES:]]
    if command:
        lines.append(f"  Reproduce: {command}")
    return SampleError("\n".join(lines))
