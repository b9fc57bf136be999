"""Runs: from a plan to a finished data set, or to an error that explains how to resume."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from gen_data.core.errors import GenDataError
from gen_data.core.sample import Sample
from gen_data.runner.failed_sample import FailedSample, parse_failed
from gen_data.runner.finalize import LicencesOf, finalize
from gen_data.runner.free_space import DOCUMENTS_BYTES, SpaceCheck
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.layout import MANIFEST_NAME, PLAN_NAME, SHARDS_NAME, SUMS_NAME
from gen_data.runner.numerics_guard import admit_numerics
from gen_data.runner.object_store import open_store
from gen_data.runner.plan import Plan, plan_bytes
from gen_data.runner.processes import Pool, open_worker_pool, run_supervisor
from gen_data.runner.progress import RunMonitor, RunProgress, Summary
from gen_data.runner.proof import Proof
from gen_data.runner.repair import quarantine_extra, restore_plan
from gen_data.runner.seal import Expectation, SealedBefore, parse_seal, parse_sums
from gen_data.runner.shard import (
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
from gen_data.runner.store import FolderState, LocalStore, Scan
from gen_data.runner.supervisor import Limits, Supervisor
from gen_data.runner.termination_signals import Interruption
from gen_data.runner.worker import done_event
from gen_data.runner.worker_events import SampleDone, SampleSkipped

__all__ = ["Limits", "RunProgress", "Settings", "Summary", "run"]

IN_PROCESS = -1
"""Worker number of this process."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run; they change no byte of the data set.

    Attributes:
        workers: Processes that generate shards; 0 generates them in this process.
        resume_command: Command that error messages give for resuming; empty = there is none, as
            the folder is temporary.
        progress: Called after each sample and shard.
        repair: Hash existing files before anything else, restore a damaged ``plan.json``, and move
            files that do not belong to the data set to ``run/quarantine``. Without it, damaged
            shards are also generated again, but files of an unfinished data set are hashed last.
        sample_bytes: Estimated size of a sample; 0 = unknown. A data set that will not fit on the
            disk is refused.
        is_forced: Generate it until the disk is full.
        linked_bytes: Size of the files of a sample that are hard links and take no space.
        shards: Range of shards to generate; the data set stays unfinished while others are
            missing. None = all.
        limits: Limits on silence, deaths and memory of workers.
        open_pool: Opens the pool of workers: processes of this machine, or a cluster.
        skip_failed: Record samples that cannot be made in the manifest, and go on without them.
            Shards that earlier runs made without some samples are kept, but ``repair`` tries these
            again. Errors of storage, lack of memory and exporters end the run as without it.
        proof: Required digests of the data set; None = any result.
        allow_mixed_numerics, failed, write_media, write_records, linked_digests: See ``Job``;
            picklable.
    """

    workers: int = 0
    resume_command: str = ""
    progress: Callable[[RunProgress], None] | None = None
    repair: bool = False
    allow_mixed_numerics: bool = False
    skip_failed: bool = False
    proof: Proof | None = None
    failed: tuple[FailedSample, ...] = ()
    sample_bytes: float = 0.0
    is_forced: bool = False
    linked_bytes: float = 0.0
    shards: range | None = None
    limits: Limits = field(default_factory=Limits)
    open_pool: Callable[[Job], Pool] = open_worker_pool
    write_media: MediaWriter = write_images
    write_records: RecordWriter = write_records
    linked_digests: LinkedDigests = no_digests


def _silent(progress: RunProgress) -> None:
    del progress


def run(
    plan: Plan,
    make_pipeline: Callable[[], EnteredPipeline],
    out: Path | str,
    settings: Settings,
    licences: LicencesOf | None = None,
) -> Summary:
    """Generate a data set, or the missing part of an unfinished one.

    Args:
        plan: The identity of the data set.
        out: Its folder, or a URL of object storage: absent, empty, or started with an equal plan.
        make_pipeline: Makes the same pipeline in any process; picklable unless the settings have
            no workers.
        settings: Workers, and further choices of the caller.
        licences: Makes the text of ``LICENSES-ASSETS.md``; None = no such file.

    Raises:
        StorageError: the folder belongs to another data set, or cannot be written.
        ConfigError: another run is writing there.
        SampleError: a sample cannot be generated; WorkerLost if it kills its process.
        NumericsError: this machine computes differently from the one that began the data set.
        DeterminismError: a shard, or a repaired data set, came out differently the second time.
        Interrupted: Ctrl-C or SIGTERM; committed shards stay.
    """
    store = open_store(out, settings.resume_command)
    kept = f"finished shards are kept; resume with:\n    {settings.resume_command}"
    message = kept if settings.resume_command else "nothing is kept"
    with Interruption(message) as interruption:
        with interruption.immediate(), store.errors():
            if settings.repair:
                restore_plan(store, plan)
            store.state(plan)
        with store.locked():
            job = Job(
                plan,
                store,
                make_pipeline,
                settings.write_media,
                settings.write_records,
                settings.linked_digests,
                # Bytes that must equal known ones need no other guard.
                settings.allow_mixed_numerics
                or (settings.proof is not None and not settings.proof.semantic)
                or bool(_read_seal(store, plan).ids),
                settings.skip_failed,
                settings.failed,
            )
            run_ = _Run(job, settings.progress or _silent, settings, interruption)
            return replace(run_.execute(licences), folder=str(out))


UNSEALED = SealedBefore(frozenset(), {})


def read_failed(store: LocalStore) -> tuple[FailedSample, ...]:
    """Samples that a finished data set does not have; none if its manifest is damaged."""
    try:
        return parse_failed(json.loads(store.read_manifest()))
    except (OSError, ValueError):
        return ()


def lacks_samples(store: LocalStore, plan: Plan) -> bool:
    """Whether samples of a data set, finished or not, failed."""
    records = filter(None, map(store.record, range(plan.shard_count)))
    return bool(read_failed(store)) or any(record.failed for record in records)


def _read_seal(store: LocalStore, plan: Plan) -> SealedBefore:
    """Read the seal of this very data set, which repair must not change; it may have none."""
    found = store.read_documents((PLAN_NAME, SUMS_NAME, MANIFEST_NAME))
    seal = parse_seal(found[SUMS_NAME], found[MANIFEST_NAME])
    bytes_of_plan = plan_bytes(plan)
    same = found[PLAN_NAME] == bytes_of_plan or (
        seal.sums.get(PLAN_NAME) == hashlib.sha256(bytes_of_plan).hexdigest()
    )
    return seal if same else UNSEALED


@dataclass(frozen=True)
class _Run:
    job: Job
    progress: Callable[[RunProgress], None]
    settings: Settings
    interruption: Interruption

    def execute(self, licences: LicencesOf | None) -> Summary:
        plan, store = self.job.plan, self.job.store
        with self.interruption.immediate():
            with store.errors():
                state = store.state(plan)
                if state is FolderState.NEW:
                    self._space.before_start(self._count(range(plan.shard_count)))
                finished = state is FolderState.FINISHED
                retried = self.settings.repair and finished and read_failed(store)
                is_checked = finished and not retried
                if is_checked and store.is_intact(self.settings.repair, self._show_checked):
                    self._prove(self._sealed_shards())
                    return self._summarize_finished()
                sealed_before = UNSEALED if retried else _read_seal(store, plan)
            store.prepare(plan)
            hashed = finished or self.settings.repair
            whole = store.scan(plan, hashed, whole_only=self.settings.repair)
            self._prove(self._committed_shards(whole))
            scan = whole.within(self.settings.shards)
        samples = self._count(scan.missing)
        if scan.samples == 0:
            self._space.before_start(samples)
        total = scan.samples + samples
        monitor = RunMonitor(
            store, scan, total, self.progress, self._space, proof=self.settings.proof
        )
        monitor.show("samples")
        try:
            self._generate(scan, monitor)
            if left := len(whole.missing) - len(scan.missing):
                return replace(self._summarize("", scan, monitor), shards_left=left)
            if not hashed:
                self._replace_damaged(scan, monitor)
            with self.interruption.immediate():
                monitor.show("merging")
                pipeline = self.job.make_pipeline()
                store.fetch_shards(plan, with_files=bool(pipeline.exporters))
                dataset_id = finalize(
                    plan, store, pipeline, licences, self._expected(sealed_before)
                )
                store.publish()
                if self.settings.repair:
                    quarantine_extra(store)
        finally:
            # This may also fail on a faulty disk; the next run starts with it.
            with suppress(OSError):
                store.clear_scratch()
        return self._summarize(dataset_id, scan, monitor)

    def _expected(self, sealed_before: SealedBefore) -> Expectation:
        proof = self.settings.proof
        return sealed_before if proof is None or proof.semantic else proof

    def _prove(self, shards: Iterator[tuple[int, str, str]]) -> None:
        """Refuse shards of earlier runs that others were expected for.

        ``shards`` has their numbers, and the digests of their records and labels.
        """
        if self.settings.proof is not None:
            for shard, record, labels in shards:
                found = self.settings.proof.objection(shard, record, labels)
                if found is not None:
                    raise found

    def _sealed_shards(self) -> Iterator[tuple[int, str, str]]:
        digests = parse_sums(self.job.store.read_documents((SUMS_NAME,))[SUMS_NAME]).digests
        for shard in range(self.job.plan.shard_count):
            place = f"{SHARDS_NAME}/{shard:06d}"
            yield shard, digests.get(f"{place}.json", ""), digests.get(f"{place}/{LABELS_NAME}", "")

    def _committed_shards(self, existing: Scan) -> Iterator[tuple[int, str, str]]:
        missing = set(existing.missing)
        for shard in range(self.job.plan.shard_count):
            record = None if shard in missing else self.job.store.record(shard)
            if record is not None:
                yield shard, record.sha256, record.sha256_of(LABELS_NAME)

    def _show_checked(self, share: float) -> None:
        n = self.job.plan.n
        self.progress(RunProgress("checking", int(share * n), n, 0.0, 0, 0))

    @property
    def _space(self) -> SpaceCheck:
        chosen = self.settings
        return SpaceCheck(
            self.job.store,
            chosen.sample_bytes,
            chosen.is_forced,
            chosen.linked_bytes,
            # The plan and its copy.
            2 * len(plan_bytes(self.job.plan)) + DOCUMENTS_BYTES,
        )

    def _count(self, shards: Sequence[int]) -> int:
        chosen = Scan(shards).within(self.settings.shards).missing
        if not chosen:
            return 0
        last = self.job.plan.samples_of(chosen[-1])
        # Only the last shard of a data set may be shorter than the others.
        return (len(chosen) - 1) * self.job.plan.shard_size + len(last)

    def _generate(self, scan: Scan, monitor: RunMonitor) -> None:
        if not scan.missing:
            return
        if self.settings.workers == 0:
            with self.interruption.immediate():
                self._generate_here(scan, monitor)
            return
        supervisor = Supervisor(
            shards=scan.missing,
            samples_of=self.job.plan.samples_of,
            workers=self.settings.workers,
            describe_sample=self.job.store.reproduce_command,
            limits=self.settings.limits,
            skip_failed=self.settings.skip_failed,
        )
        open_pool = self.settings.open_pool
        run_supervisor(self.job, open_pool, supervisor, self.interruption, monitor.observe)
        monitor.worker_deaths = supervisor.deaths
        if supervisor.error is not None:
            raise supervisor.error

    def _replace_damaged(self, scan: Scan, monitor: RunMonitor) -> None:
        """Hash the shards of earlier runs, and replace damaged ones: no damage may be sealed."""
        plan, store = self.job.plan, self.job.store
        if len(scan.missing) == plan.shard_count:
            return
        made = set(scan.missing)
        with self.interruption.immediate():
            monitor.show("checking")
            earlier = (shard for shard in range(plan.shard_count) if shard not in made)
            damaged = store.quarantine_damaged(plan, earlier)
        if damaged:
            listed = ", ".join(map(str, damaged[:10]))
            monitor.log({"note": f"{len(damaged)} damaged shard(s) are replaced: {listed}"})
            self._generate(Scan(damaged), monitor)

    def _generate_here(self, scan: Scan, monitor: RunMonitor) -> None:
        with self.job.make_pipeline() as pipeline:
            admit_numerics(self.job, pipeline)
            for shard in scan.missing:

                def on_sample(sample: Sample, shard: int = shard) -> None:
                    monitor.observe(SampleDone(IN_PROCESS, shard, sample.index, sample.timings_s))

                def on_failure(failed: FailedSample, text: str, shard: int = shard) -> None:
                    monitor.observe(SampleSkipped(IN_PROCESS, shard, failed, text))

                made = make_shard(self.job, pipeline, shard, on_sample, on_failure)
                objection: GenDataError | None = monitor.observe(done_event(IN_PROCESS, made))
                if objection is not None:
                    raise objection

    def _summarize_finished(self) -> Summary:
        manifest = json.loads(self.job.store.read_manifest())
        failed = read_failed(self.job.store)
        return Summary(
            dataset_id=manifest["dataset_id"],
            samples=self.job.plan.n - len(failed),
            made=0,
            seconds=0.0,
            rejections=manifest["rejections"],
            bytes=manifest["bytes"],
            already_complete=True,
            failed=failed,
        )

    def _summarize(self, dataset_id: str, scan: Scan, monitor: RunMonitor) -> Summary:
        summary = Summary(
            dataset_id=dataset_id,
            samples=scan.samples + monitor.made
            if not dataset_id
            else self.job.plan.n - len(monitor.failed),
            made=monitor.made,
            seconds=monitor.seconds,
            rejections=monitor.rejections,
            bytes=scan.bytes + monitor.bytes,
            cpu_s=monitor.mean_cpu_s(),
            worker_deaths=monitor.worker_deaths,
            rss_bytes_max=monitor.rss_bytes_max,
            failed=monitor.failed,
        )
        monitor.log({"summary": summary})
        return summary
