"""Messages for unexpected errors: place, fact, end of the traceback, command to reproduce."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from gen_data.core.errors import GenDataError, OutOfMemory, SampleError, lack_of_memory

TRACE_LINES = 12
CACHE_DAMAGE = ("Failed to find forward kernel", "Failed to load CPU module")
"""Texts of Warp's errors for a damaged compiled kernel on disk."""


@contextmanager
def explain_errors(place: str, command: str = "") -> Iterator[None]:
    """Turn any other error than a GenDataError into a SampleError with the place.

    A plain SampleError also gets place and command; its subclasses have better messages.
    """
    try:
        yield
    except GenDataError as error:
        if type(error) is not SampleError:
            raise
        reproduce = f"\n  Reproduce: {command}" if command else ""
        raise SampleError(f"{place}: {error}{reproduce}") from error
    except (Exception, KeyboardInterrupt, SystemExit) as error:
        # Requests to stop are Interrupted: the last two come from a plug-in.
        raise unexpected_error(error, place, command) from error


def unexpected_error(error: BaseException, place: str, command: str = "") -> SampleError:
    """Make a SampleError with the end of the traceback, which cannot be pickled itself.

    Lack of memory is one line: a traceback would not help.
    """
    if lacking := lack_of_memory(error):
        return OutOfMemory(f"{place}: {lacking}")
    trace = "".join(traceback.format_exception(type(error), error, error.__traceback__))
    lines = [f"{place}: {type(error).__name__}: {str(error) or 'without a message'}"]
    lines += [f"  {line}" for line in trace.rstrip().splitlines()[-TRACE_LINES:]]
    if any(text in str(error) for text in CACHE_DAMAGE):
        lines.append(
            "  Warp's cache of compiled kernels is damaged: delete its folder, "
            "~/.cache/warp or $WARP_CACHE_PATH, and repeat the command"
        )
    if command:
        lines.append(f"  Reproduce: {command}")
    return SampleError("\n".join(lines))
