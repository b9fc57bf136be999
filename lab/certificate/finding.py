"""Findings of a claim's check: one per export, sensor or data set."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

EVIDENCE_MAX = 12
"""Contradictions that a finding lists; all are counted."""

Figure = int | float | str


class Status(str, Enum):
    """Outcome of a check. An unchecked claim is not a pass: its reason states why."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"


@dataclass(frozen=True)
class Finding:
    """One outcome.

    Attributes:
        subject: The checked export or sensor; empty = the data set.
        status: The outcome.
        reason: Why it was not checked; empty otherwise.
        figures: Counts and measurements, by name; numbers are rounded, to be the same on every
            machine.
        evidence: The first contradictions, in words; empty unless failed.
    """

    subject: str
    status: Status
    reason: str = ""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    evidence: tuple[str, ...] = ()


def not_checked(subject: str, reason: str) -> Finding:
    """A finding about something that could not be checked."""
    return Finding(subject, Status.NOT_CHECKED, reason)


@dataclass
class Contradictions:
    """Contradictions of one subject: all are counted, the first are kept.

    Attributes:
        count: Number of all.
        first: The first ``EVIDENCE_MAX``, in words.
    """

    count: int = 0
    first: list[str] = field(default_factory=list)

    def add(self, text: str) -> None:
        """Count a contradiction."""
        self.count += 1
        if len(self.first) < EVIDENCE_MAX:
            self.first.append(text)

    def judge(self, subject: str, figures: Mapping[str, Figure], tolerated: int = 0) -> Finding:
        """The finding: passed without contradictions, or with at most the tolerated number.

        Args:
            subject: See ``Finding``.
            figures: See ``Finding``; the number of contradictions is added.
            tolerated: Largest number of contradictions that still passes.
        """
        counted = {**figures, "contradictions": self.count}
        if self.count <= tolerated:
            return Finding(subject, Status.PASSED, figures=counted)
        return Finding(subject, Status.FAILED, "", counted, tuple(self.first))
