"""Comparison of results of readers with data sets, in a separate process."""

import contextlib
import io
import logging
import tempfile
import warnings
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.readers.table import READERS, Reader
from benchmarks.readers.views import Comparison


def examine_rows(rows: Sequence[int], folder: Path, scratch: str) -> dict[int, Comparison | None]:
    """Compare results of readers, by their numbers in the table."""
    tempfile.tempdir = scratch
    return {k: examine(READERS[k], folder) for k in rows}


def examine(reader: Reader, folder: Path) -> Comparison | None:
    """Compare a reader's result with the data set; None without its packages."""
    if not is_installed(reader):
        return None
    comparison, stated = Comparison(), folder / reader.data.replace("runs", "tabletop")
    logging.disable(logging.ERROR)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            warnings.simplefilter("ignore")  # they concern the packages
            found = list(reader.read(folder / reader.data / reader.format))
        comparison.add_views(reader.expected(stated), found, reader.is_partial)
    # A reader may refuse a file in any way.
    except Exception as error:
        comparison.faults.append(f"{type(error).__name__}: {error}")
        return comparison
    limits = (
        (reader.unit and not comparison.objects, "nothing was compared"),
        (comparison.worst > reader.tolerance, f"numbers differ by {comparison.worst:.3g}"),
        *_limits("masks", comparison.iou, reader.iou, smallest=True),
        *_limits("lenses", comparison.lens, reader.lens, smallest=False),
    )
    comparison.faults += [fault for is_wrong, fault in limits if is_wrong]
    return comparison


def _limits(
    name: str, found: float | None, limit: float | None, *, smallest: bool
) -> tuple[tuple[bool, str], ...]:
    """Faults of masks or lenses; they are where the table expects them."""
    if limit is None:
        return ()
    if found is None:
        return ((True, f"no {name} were read"),)
    return (
        (found < limit if smallest else found > limit, f"{name}: {found:.6g}, limit {limit:g}"),
    )


def is_installed(reader: Reader) -> bool:
    """Whether the packages of a reader are there."""
    return all(map(installed, (reader.package, *reader.needs)))


def installed(package: str) -> str:
    """Release of a package; empty if it is absent."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
