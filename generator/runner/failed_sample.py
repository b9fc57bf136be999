"""Samples that could not be made, and that a run goes on without."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gen_data.core import errors

NOT_OF_A_SAMPLE = (
    errors.DeterminismError,
    errors.Interrupted,
    errors.OutOfMemory,
    errors.StorageError,
    errors.WorkerLost,
)
"""Errors of the machine or the run, which leaving out a sample does not mend."""

TEXT_MAX = 300
"""Longest text of an error in a record."""


@dataclass(frozen=True, slots=True)
class FailedSample:
    """A sample that a data set does not have; no file of the data set belongs to it.

    Attributes:
        index: Number of the sample.
        stage: Stage that failed: ``randomize``, ``layout``, ``physics``, ``render``, ``annotate``,
            ``write``, or ``process`` for a worker that crashed or hung.
        error: Class of the error, with the first line of its text where that is our own. It holds
            no path, time or place in memory, which differ between machines.
    """

    index: int
    stage: str
    error: str


def parse_failed(manifest: Mapping[str, Any]) -> tuple[FailedSample, ...]:
    """Samples that the data set of a manifest does not have, by index.

    Raises:
        ValueError: the manifest is damaged.
    """
    try:
        return tuple(FailedSample(**plain) for plain in manifest.get("failed", ()))
    except (TypeError, AttributeError) as error:
        raise ValueError(f"failed: {error}") from None


def may_be_skipped(error: errors.GenDataError) -> bool:
    """Whether an error concerns its sample alone."""
    return not isinstance(error, NOT_OF_A_SAMPLE)


def describe_failure(index: int, error: errors.GenDataError) -> FailedSample:
    """Describe the failure of a sample by the error that ``explain_errors`` made of it."""
    cause = error.__cause__ or error
    text = type(cause).__name__
    lines = str(cause).splitlines()
    if isinstance(cause, errors.SampleError) and lines:
        text = f"{text}: {lines[0]}"[:TEXT_MAX]
    return FailedSample(index, errors.stage_of(error), text)
