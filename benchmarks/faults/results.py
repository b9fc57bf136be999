"""Results of campaigns, and their table."""

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TypeVar

from rich.console import Console
from rich.table import Table

T = TypeVar("T")
FAILURES_MAX = 10
"""Number of failures that a result keeps."""


@dataclass(frozen=True)
class Scale:
    """Size of a campaign.

    Attributes:
        is_full: Whether to make all attempts, instead of a sample of them.
        seed: Seed of drawn faults.
        end_s: Instant of the monotonic clock at which a campaign stops and reports its attempts.
    """

    is_full: bool
    seed: int = 0
    end_s: float = float("inf")

    def pick(self, full: int, quick: int) -> int:
        """Number of attempts."""
        return full if self.is_full else quick


@dataclass
class Result:
    """Outcome of a campaign.

    Attributes:
        attempts: Number of injected faults.
        held: Number of faults after which all promises held.
        notes: Counts in words, such as the number of operations.
        skipped: Skipped attempts -> the reason.
        failures: The first broken promises, in words.
        seconds: Duration.
    """

    attempts: int = 0
    held: int = 0
    notes: list[str] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, holds: bool, failure: str) -> None:
        """Count one attempt; ``failure`` describes it if it does not hold."""
        self.attempts += 1
        self.held += holds
        if not holds and len(self.failures) < FAILURES_MAX:
            self.failures.append(failure)

    def until_end(self, scale: Scale, tasks: Sequence[T]) -> Iterator[T]:
        """The tasks, until the time of the campaign is up; the others are stated as left out."""
        for number, task in enumerate(tasks):
            if time.monotonic() > scale.end_s:
                self.skip(f"{len(tasks) - number} of {len(tasks)} attempts", "the time was up")
                return
            yield task

    def skip(self, what: str, reason: str) -> None:
        """Record a skipped attempt."""
        self.skipped[what] = reason

    @property
    def is_clean(self) -> bool:
        """Whether every attempt held."""
        return self.held == self.attempts


def print_table(results: Mapping[str, Result]) -> None:
    """Print one row per campaign, then failures."""
    table = Table("campaign", "attempts", "held", "s", "details")
    for name, result in results.items():
        skips = [f"not done: {what} ({why})" for what, why in result.skipped.items()]
        details = "; ".join([*result.notes, *skips])
        table.add_row(
            name, str(result.attempts), str(result.held), f"{result.seconds:.0f}", details
        )
    console = Console(width=150)
    console.print(table)
    for line in _failures(results):
        console.print(line, markup=False)


def _failures(results: Mapping[str, Result]) -> Iterable[str]:
    for name, result in results.items():
        for failure in result.failures:
            yield f"{name}: {failure}"


def to_plain(results: Mapping[str, Result]) -> dict[str, object]:
    """The results as JSON values."""
    return {name: asdict(result) for name, result in results.items()}
