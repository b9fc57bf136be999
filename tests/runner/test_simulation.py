"""Runs with virtual processes, and supervisors with planted faults, which the runs must find."""

from typing import Any

import pytest

from gen_data.core.errors import Interrupted, StorageError, WorkerLost
from gen_data.runner.supervisor import State, Supervisor
from gen_data.runner.worker_events import Action, Exited
from tests.runner.simulation import Run

SEEDS = range(300)


def test_every_run_ends_with_all_its_shards_or_an_error() -> None:
    """300 of the seeds of ``python -m tests.runner.simulation``; all kinds of ends occur."""
    ends = {type(Run(seed).execute()) for seed in SEEDS}
    assert ends == {type(None), WorkerLost, StorageError, Interrupted}


class WaitsForStarts(Supervisor):
    """Never kills a process that does not start."""

    def _patience_s(self, worker: Any) -> float:
        return float("inf") if worker.state is State.STARTING else super()._patience_s(worker)


class ForgetsShards(Supervisor):
    """Does not generate the shard of a dead worker again."""

    def _on_shard_death(self, number: int, worker: object, cause: str) -> list[Action]:
        actions = super()._on_shard_death(number, worker, cause)  # type: ignore[arg-type]
        self._again.clear()
        return actions


class StartsForEver(Supervisor):
    """Does not count processes that end while they start."""

    def _on_exit(self, event: Exited, worker: object) -> list[Action]:
        self._failed_starts = 0
        return super()._on_exit(event, worker)  # type: ignore[arg-type]


class TriesForEver(Supervisor):
    """Does not count the deaths on a shard."""

    def _on_shard_death(self, number: int, worker: object, cause: str) -> list[Action]:
        self._deaths.clear()
        return super()._on_shard_death(number, worker, cause)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("mutant", "fault"),
    [(WaitsForStarts, "never ends"), (ForgetsShards, "missing silently"),
     (StartsForEver, "endless starting|never ends"),
     (TriesForEver, "more attempts|endless starting")],
)  # fmt: skip
def test_a_planted_fault_is_found(mutant: type[Supervisor], fault: str) -> None:
    """Each within 300 seeds; otherwise the simulation would prove nothing."""

    def run_all() -> None:
        for seed in SEEDS:
            Run(seed, mutant).execute()

    with pytest.raises(AssertionError, match=fault):
        run_all()
