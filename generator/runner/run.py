"""Runs: from a plan to a finished data set, or to an error that says how to resume."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from gen_data.generator.core.errors import GenDataError
from gen_data.generator.core.sample import Sample
from gen_data.generator.runner.finalize import LicencesOf, finalize
from gen_data.generator.runner.plan import Plan
from gen_data.generator.runner.processes import run_supervisor
from gen_data.generator.runner.progress import RunMonitor, RunProgress, Summary
from gen_data.generator.runner.shard import (
    EnteredPipeline,
    Job,
    LinkedDigests,
    MediaWriter,
    RecordWriter,
    make_shard,
    no_digests,
    write_images,
    write_records,
)
from gen_data.generator.runner.store import FolderState, LocalStore, Scan
from gen_data.generator.runner.supervisor import Limits, Supervisor
from gen_data.generator.runner.termination_signals import Interruption
from gen_data.generator.runner.verify import find_deviations
from gen_data.generator.runner.worker import done_event
from gen_data.generator.runner.worker_events import SampleDone

__all__ = ["Limits", "RunProgress", "Settings", "Summary", "run"]

IN_PROCESS = -1
"""Worker number of this process."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run; they change no byte of the data set.

    Attributes:
        full_check: On resumption, hash existing files instead of comparing sizes. This also
            repairs a damaged data set: damaged shards are generated again.
        limits: Limits on silence, deaths and memory of workers.
        write_media, write_records, linked_digests: See ``Job``; picklable.
    """

    full_check: bool = False
    limits: Limits = field(default_factory=Limits)
    write_media: MediaWriter = write_images
    write_records: RecordWriter = write_records
    linked_digests: LinkedDigests = no_digests


def _silent(progress: RunProgress) -> None:
    del progress


def run(  # noqa: PLR0913  (every argument is the choice of the caller)
    plan: Plan,
    make_pipeline: Callable[[], EnteredPipeline],
    out: Path,
    *,
    workers: int,
    resume_command: str,
    progress: Callable[[RunProgress], None] | None = None,
    licences: LicencesOf | None = None,
    settings: Settings | None = None,
) -> Summary:
    """Generate a data set, or the missing part of an unfinished one.

    Args:
        plan: The identity of the data set.
        out: Its folder: absent, empty, or started with an equal plan.
        make_pipeline: Makes the same pipeline in any process; picklable unless ``workers`` is 0.
        workers: Processes that generate shards; 0 generates them in this process, for debugging.
        resume_command: Command that error messages give for resuming.
        progress: Called after each sample and shard.
        licences: Makes the text of ``LICENSES-ASSETS.md``; None = no such file.
        settings: None = the defaults.

    Raises:
        StorageError: the folder belongs to another data set, or cannot be written.
        ConfigError: another run is writing there.
        SampleError: a sample cannot be generated; WorkerLost if it kills its process.
        DeterminismError: a shard came out differently the second time.
        Interrupted: Ctrl-C or SIGTERM; committed shards stay.
    """
    settings = settings or Settings()
    store = LocalStore(Path(out).absolute(), resume_command)
    message = f"finished shards are kept; resume with:\n    {resume_command}"
    with Interruption(message) as interruption:
        with interruption.immediate(), store.errors():
            store.state(plan)
        with store.locked():
            job = Job(
                plan,
                store,
                make_pipeline,
                settings.write_media,
                settings.write_records,
                settings.linked_digests,
            )
            run_ = _Run(job, workers, progress or _silent, settings, interruption)
            return replace(run_.execute(licences), folder=str(out))


@dataclass(frozen=True)
class _Run:
    job: Job
    workers: int
    progress: Callable[[RunProgress], None]
    settings: Settings
    interruption: Interruption

    def execute(self, licences: LicencesOf | None) -> Summary:
        """Generate the missing shards, merge and seal them."""
        plan, store = self.job.plan, self.job.store
        with self.interruption.immediate():
            with store.errors():
                state = store.state(plan)
                if state is FolderState.FINISHED and self._is_intact():
                    return self._summarize_finished()
            store.prepare(plan)
            scan = store.scan(plan, self.settings.full_check)
        monitor = RunMonitor(store, scan, plan.n, self.progress)
        monitor.show("samples")
        try:
            self._generate(scan, monitor)
            with self.interruption.immediate():
                monitor.show("merging")
                dataset_id = finalize(plan, store, self.job.make_pipeline(), licences)
        finally:
            # This may also fail on a faulty disk; the next run starts with it.
            with suppress(OSError):
                store.clear_scratch()
        return self._summarize(dataset_id, scan, monitor)

    def _generate(self, scan: Scan, monitor: RunMonitor) -> None:
        if not scan.missing:
            return
        if self.workers == 0:
            with self.interruption.immediate():
                self._generate_here(scan, monitor)
            return
        supervisor = Supervisor(
            shards=scan.missing,
            samples_of=self.job.plan.samples_of,
            workers=self.workers,
            describe_sample=self.job.store.reproduce_command,
            limits=self.settings.limits,
        )
        run_supervisor(self.job, supervisor, self.interruption, monitor.observe)
        monitor.worker_deaths = supervisor.deaths
        if supervisor.error is not None:
            raise supervisor.error

    def _generate_here(self, scan: Scan, monitor: RunMonitor) -> None:
        with self.job.make_pipeline() as pipeline:
            for shard in scan.missing:

                def on_sample(sample: Sample, shard: int = shard) -> None:
                    monitor.observe(SampleDone(IN_PROCESS, shard, sample.index, sample.timings_s))

                made = make_shard(self.job, pipeline, shard, on_sample)
                objection: GenDataError | None = monitor.observe(done_event(IN_PROCESS, made))
                if objection is not None:
                    raise objection

    def _is_intact(self) -> bool:
        """Whether a finished data set is undamaged; additional files do not matter."""
        found = find_deviations(self.job.store.root, self.settings.full_check)
        return all(finding.kind == "extra" for finding in found)

    def _summarize_finished(self) -> Summary:
        manifest = json.loads(self.job.store.manifest_path.read_bytes())
        return Summary(
            dataset_id=manifest["dataset_id"],
            samples=self.job.plan.n,
            made=0,
            seconds=0.0,
            rejections=manifest["rejections"],
            bytes=manifest["bytes"],
            already_complete=True,
        )

    def _summarize(self, dataset_id: str, scan: Scan, monitor: RunMonitor) -> Summary:
        summary = Summary(
            dataset_id=dataset_id,
            samples=self.job.plan.n,
            made=monitor.made,
            seconds=monitor.seconds,
            rejections=monitor.rejections,
            bytes=scan.bytes + monitor.bytes,
            cpu_s=monitor.mean_cpu_s(),
            worker_deaths=monitor.worker_deaths,
            rss_bytes_max=monitor.rss_bytes_max,
        )
        monitor.log({"summary": summary})
        return summary
