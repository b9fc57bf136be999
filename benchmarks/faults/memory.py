"""The kernel kills a worker that exceeds its memory; the run continues, or reports it."""

import os
import sys
import time
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

from benchmarks.faults.results import Result, Scale
from gen_data.core.errors import GenDataError, WorkerLost
from gen_data.core.sample import Sample
from gen_data.runner.run import Settings, run
from tests.runner import doubles

CGROUP = Path("/sys/fs/cgroup/memory")
LIMIT_BYTES = 400 << 20
GREEDY_BYTES = 1 << 30


class GreedyPipeline(doubles.FakePipeline):
    """Takes more memory than the limit for one sample."""

    def sample(self, index: int) -> Sample:
        """Sample number ``index``; number 5 exceeds the limit."""
        if index == 5:
            greedy = bytearray(os.urandom(1 << 20) * (GREEDY_BYTES >> 20))
            time.sleep(0.01 * (greedy[0] > 255))
        return super().sample(index)


class GreedyFactory(doubles.FakeFactory):
    """Makes the greedy pipeline."""

    def __call__(self) -> doubles.FakePipeline:
        """The pipeline."""
        return GreedyPipeline(self.n, self.trouble)


def out_of_memory(scale: Scale, folder: Path) -> Result:
    """A run with one worker in a memory cgroup, whose sample 5 needs more than the limit."""
    del scale
    result = Result()
    group = CGROUP / f"gen-data-faults-{os.getpid()}"
    try:
        group.mkdir()
        (group / "memory.limit_in_bytes").write_text(str(LIMIT_BYTES))
    except OSError as error:
        result.skip("all", f"no writable memory cgroup (version 1) at {CGROUP}: {error.strerror}")
        return result
    try:
        code, message = _run_in(group, folder)
    finally:
        _remove(group)
    facts = ("sample 5", "out of memory", "gen-data repro")
    result.add(
        code == WorkerLost.exit_code and all(fact in message for fact in facts),
        f"exit code {code}: {message}",
    )
    shards = {path.stem for path in (folder / "out/shards").glob("*.json")}
    result.add(shards == {"000000", "000002"}, f"finished shards: {sorted(shards)}")
    doubles.make(folder / "out")
    doubles.make(folder / "reference")
    equal = doubles.tree_digest(folder / "out") == doubles.tree_digest(folder / "reference")
    result.add(equal, "with enough memory, the resumed data set has other bytes")
    result.notes.append("message, other shards, resumption")
    return result


def _run_in(group: Path, folder: Path) -> tuple[int | None, str]:
    """Exit code and message of a run whose processes are in a cgroup.

    It starts as a new process: a fork of this one may be larger than the worker, and the system
    kills the largest.
    """
    message = folder / "message"
    process = get_context("spawn").Process(target=_enter_and_run, args=(group, folder, message))
    process.start()
    process.join()
    return process.exitcode, message.read_text() if message.exists() else ""


def _enter_and_run(group: Path, folder: Path, message: Path) -> None:
    (group / "cgroup.procs").write_text(str(os.getpid()))
    try:
        settings = Settings(1, doubles.RESUME, write_media=doubles.write_raw_images)
        factory = GreedyFactory(10, doubles.Trouble())
        run(doubles.fake_plan(), factory, folder / "out", settings)
    except GenDataError as error:
        message.write_text(f"{type(error).__name__}: {error}", "utf-8")
        sys.exit(error.exit_code)


def _remove(group: Path) -> None:
    for _ in range(100):
        with suppress(OSError):
            group.rmdir()
            return
        time.sleep(0.05)
