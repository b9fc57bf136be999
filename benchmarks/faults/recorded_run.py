"""A run of three shards that takes milliseconds: its samples are rendered once and replayed.

Everything after the samples is the program's own: checks, images, labels, COCO files, commit,
resumption, merging, seal.
"""

import hashlib
import os
import pickle
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gen_data.api.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core import errors, interfaces
from gen_data.core.sample import Sample
from gen_data.runner.identity import make_plan
from gen_data.runner.plan import Plan
from gen_data.runner.run import Settings, Summary, run

CONFIG = Path(__file__).with_name("tiny.yaml")
N = 6
RESUME = "gen-data --config tiny.yaml --n 6 --out here"


@dataclass(frozen=True)
class Replay:
    """A pipeline of recorded samples, and the factory that makes it in any process."""

    info: interfaces.DatasetInfo
    exporters: Mapping[str, interfaces.Exporter]
    samples: Sequence[Sample]

    def __call__(self) -> "Replay":
        """The pipeline."""
        return self

    def __enter__(self) -> "Replay":
        """There are no engines."""
        return self

    def __exit__(self, *exception: object) -> None:
        """There are no engines."""

    def sample(self, index: int) -> Sample:
        """Sample number ``index``."""
        return self.samples[index]


@dataclass(frozen=True)
class Recording:
    """Plan and samples of the tiny data set."""

    plan: Plan
    replay: Replay

    def make(
        self, out: Path | str, *, workers: int = 0, shards: range | None = None,
        repair: bool = False, delay_s: float = 0.0,
    ) -> Summary:  # fmt: skip
        """Make the data set, or the rest of it.

        Args:
            out: Its folder or URL.
            workers: Processes; 0 = this one.
            shards: Range of shards; None = all.
            repair: See ``Settings``.
            delay_s: Duration of a sample, to let a run last.
        """
        replay: Callable[[], Any] = self.replay if delay_s == 0.0 else Slow(self.replay, delay_s)
        settings = Settings(workers, RESUME, shards=shards, repair=repair)
        return run(self.plan, replay, out, settings, licences=str)


@dataclass(frozen=True)
class Slow:
    """Makes a replay whose samples take time."""

    replay: Replay
    delay_s: float

    def __call__(self) -> Replay:
        """The pipeline."""
        return _SlowReplay(
            self.replay.info, self.replay.exporters, self.replay.samples, self.delay_s
        )


@dataclass(frozen=True)
class _SlowReplay(Replay):
    delay_s: float = 0.0

    def sample(self, index: int) -> Sample:
        """Sample number ``index``, after a while."""
        import time

        time.sleep(self.delay_s)
        return super().sample(index)


@cache
def record(n: int = N) -> Recording:
    """Render the samples of the tiny data set."""
    factory = open_factory(n)
    plan = make_plan(factory)
    with factory() as pipeline:
        samples = tuple(pipeline.sample(index) for index in range(n))
        replay = Replay(factory.info, dict(pipeline.exporters), samples)
    # As in worker processes, which receive the job through a pipe.
    return pickle.loads(pickle.dumps(Recording(plan, replay)))


def open_factory(n: int) -> PipelineFactory:
    """Factory of pipelines of the tiny configuration."""
    return PipelineFactory(load_config(CONFIG), n)


def tree_digest(folder: Path) -> str:
    """SHA-256 over the sorted lines ``sha256  path`` of every file outside ``run/``."""
    lines = []
    for inner, folders, names in os.walk(folder):
        if inner == str(folder):
            with suppress(ValueError):
                folders.remove("run")
        for name in names:
            path = Path(inner, name)
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            lines.append(f"{digest}  {path.relative_to(folder)}")
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def reference_digest(folder: Path, n: int = N) -> str:
    """Digest of the data set, made without any fault in ``folder / 'reference'``."""
    out = folder / "reference"
    if not (out / "manifest.json").exists():
        record(n).make(out)
    return tree_digest(out)


def resumes_to(out: Path, digest: str) -> str:
    """Resume a run; empty if the result has this digest, otherwise the fault."""
    try:
        record().make(out)
    except errors.GenDataError as error:
        return f"resuming failed: {error}"
    return "" if tree_digest(out) == digest else "the resumed data set has other bytes"
