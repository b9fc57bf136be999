"""Generation of one shard: samples, images, labels, provenance, commit."""

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from gen_data.core import interfaces, serialization
from gen_data.core.capture import Capture
from gen_data.core.errors import GenDataError, SampleError, in_stage
from gen_data.core.sample import Sample
from gen_data.runner import durable_files, resident_memory
from gen_data.runner.error_context import explain_errors
from gen_data.runner.failed_sample import FailedSample, describe_failure, may_be_skipped
from gen_data.runner.labels import LABELS_NAME, labels_line
from gen_data.runner.plan import Plan
from gen_data.runner.provenance import SCENES_NAME, scene_line
from gen_data.runner.shard_record import ShardRecord, describe_shard
from gen_data.runner.store import LocalStore

MediaWriter = Callable[[interfaces.DatasetInfo, Sample, Path], object]
"""Writes the images of a sample to their places in a shard folder."""

RecordWriter = Callable[[Sample, Sample | None, Path], object]
"""Adds scene and labels of a sample to a shard folder; the second is the scene's first sample."""

LinkedDigests = Callable[[int], Mapping[durable_files.Inode, str]]
"""Digests by inode of the files that a shard shares with another data set, by shard."""


class PipelineLike(Protocol):
    """Interface of a pipeline to the runner.

    ``info`` and ``exporters`` are available without entering it; ``sample`` is called inside a
    ``with`` block only.
    """

    @property
    def info(self) -> interfaces.DatasetInfo:
        """Facts about the data set, for exporters."""
        ...

    @property
    def exporters(self) -> Mapping[str, interfaces.Exporter]:
        """Exporters by name, which is also the name of the folder of their results."""
        ...

    def sample(self, index: int) -> Sample:
        """Sample number ``index``: a pure function of the plan and the index."""
        ...


class EnteredPipeline(PipelineLike, Protocol):
    """A pipeline that is also a context manager."""

    def __enter__(self) -> PipelineLike:
        """Start the engines."""
        ...

    def __exit__(self, *exception: Any) -> bool | None:
        """Stop the engines."""
        ...


def no_digests(shard: int) -> Mapping[durable_files.Inode, str]:
    """No file is shared with another data set."""
    del shard
    return {}


def write_images(info: interfaces.DatasetInfo, sample: Sample, shard_dir: Path) -> None:
    """Check a sample, then write its images to their places in a shard.

    Imports OpenCV when first used.

    Raises:
        SampleError: the sample is not valid; the message names the field.
    """
    from gen_data.annotations.sample_checks import check_sample
    from gen_data.exporters.image_files import write_media

    check_sample(info, sample)
    write_media(info, sample, shard_dir)


def write_records(sample: Sample, base: Sample | None, shard_dir: Path) -> None:
    """Add the lines of a sample to ``scenes.jsonl`` and ``labels.jsonl``.

    Raises:
        SampleError: a number is NaN or infinite; the message names the field.
    """
    try:
        lines = {SCENES_NAME: scene_line(sample, base), LABELS_NAME: labels_line(sample)}
    except ValueError as error:
        parts = {"scene": sample.scene, "truth": sample.truth, "frame": sample.frame}
        field = serialization.find_not_finite(serialization.to_plain(parts))
        if not field:
            raise
        raise SampleError(f"{field}: is NaN or infinite; expected a finite number") from error
    for name, line in lines.items():
        with (shard_dir / name).open("a", encoding="utf-8") as file:
            file.write(line + "\n")


@dataclass(frozen=True)
class Job:
    """Everything needed to generate a shard, except its number; picklable.

    Attributes:
        make_pipeline: Makes the same pipeline in any process.
        write_media: Writes the images of one sample.
        write_records: Adds scene and labels of one sample.
        linked_digests: Digests of files on disk that the two link into a shard, by inode.
        allow_mixed_numerics: Accept machines that compute differently; see ``admit_numerics``.
        skip_failed: Go on without samples that cannot be made.
        failed: Samples that are known not to exist, as in the source of an export.
    """

    plan: Plan
    store: LocalStore
    make_pipeline: Callable[[], EnteredPipeline]
    write_media: MediaWriter = write_images
    write_records: RecordWriter = write_records
    linked_digests: LinkedDigests = no_digests
    allow_mixed_numerics: bool = False
    skip_failed: bool = False
    failed: tuple[FailedSample, ...] = ()


@dataclass(frozen=True)
class MadeShard:
    """A committed shard, with the CPU seconds of its export and commit by stage."""

    record: ShardRecord
    timings_s: Mapping[str, float]


def ignore_failure(failure: FailedSample, text: str) -> None:
    """Report no failure."""
    del failure, text


def make_shard(
    job: Job,
    pipeline: PipelineLike,
    shard: int,
    on_sample: Callable[[Sample], None],
    on_failure: Callable[[FailedSample, str], None] = ignore_failure,
    failed: Sequence[FailedSample] = (),
) -> MadeShard:
    """Generate and commit one shard, without the samples in ``failed``.

    The images of each sample are written and dropped at once; exporters then receive all samples
    of the shard without pixels. Masks are tight crops: memory is bounded by the images of
    one sample and the labels of one shard.

    Raises:
        GenDataError: a sample cannot be generated, unless it may be skipped, or its files cannot be
            written.
    """
    indices = job.plan.samples_of(shard)
    absent = {f.index: f for f in (*job.failed, *failed) if f.index in indices}
    with job.store.errors():
        folder = job.store.scratch_dir()
    try:
        samples: list[Sample] = []
        heap = resident_memory.HeapTrimmer()
        for index in (i for i in indices if i not in absent):
            try:
                samples.append(_make_sample(job, pipeline, index, folder, samples, on_sample))
            except GenDataError as error:
                if not job.skip_failed or not may_be_skipped(error):
                    raise
                absent[index] = describe_failure(index, error)
                with job.store.errors():
                    _remove_files(index, folder)
                on_failure(absent[index], str(error))
            heap.trim_if_grown()
        started_s = time.process_time()
        # Exporters need not know shards without samples.
        for name in sorted(pipeline.exporters) if samples else ():
            with explain_errors(f"shard {shard}, exporter {name}"), job.store.errors():
                pipeline.exporters[name].write_shard(pipeline.info, samples, folder)
        with job.store.errors():
            linked = job.linked_digests(shard)
            if not samples:
                # A shard is never an empty folder.
                for name in (SCENES_NAME, LABELS_NAME):
                    (folder / name).touch()
            gone = tuple(absent[index] for index in sorted(absent))
            record = describe_shard(shard, indices, samples, folder, linked, gone)
            job.store.commit(folder, record, synced=linked)
        write_s = time.process_time() - started_s
    finally:
        # Frees the space after a failure; after a commit, the folder no longer exists.
        shutil.rmtree(folder, ignore_errors=True)
    return MadeShard(record, {"write": write_s})


def _remove_files(index: int, folder: Path) -> None:
    """Remove files of a failed sample from a shard folder, and folders that only it had."""
    for path in folder.glob(f"*/*/{index:09d}.*"):
        path.unlink()
    for pattern in ("*/*", "*"):
        for path in folder.glob(pattern):
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()


def _make_sample(
    job: Job,
    pipeline: PipelineLike,
    index: int,
    folder: Path,
    before: Sequence[Sample],
    on_sample: Callable[[Sample], None],
) -> Sample:
    """Generate a sample, write its images, scene and labels, and return it without pixels.

    ``before`` are the earlier samples of the shard.
    """
    with explain_errors(f"sample {index}", job.store.reproduce_command(index)):
        sample = pipeline.sample(index)
        started_s = time.process_time()
        with job.store.errors(), in_stage("write"):
            job.write_media(pipeline.info, sample, folder)
            base = next((s for s in before if s.scene_index == sample.scene_index), None)
            job.write_records(sample, base, folder)
        encode_s = time.process_time() - started_s
    on_sample(replace(sample, timings_s={**sample.timings_s, "encode": encode_s}))
    return drop_pixels(sample)


def drop_pixels(sample: Sample) -> Sample:
    """Remove images, points and rows from a sample; sensors keep poses, instants and faults."""
    capture = sample.capture
    readings = {
        name: replace(reading, channels={}, silhouettes={}, signal=None)
        for name, reading in capture.readings.items()
    }
    clouds = {
        name: replace(cloud, points=cloud.points[:0].copy(), origins=None)
        for name, cloud in capture.clouds.items()
    }
    tables = {
        name: replace(table, rows=table.rows[:0].copy()) for name, table in capture.tables.items()
    }
    return replace(sample, capture=Capture(readings, clouds, tables))
