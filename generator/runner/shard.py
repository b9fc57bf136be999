"""Making one shard: samples, images, labels, provenance, commit."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from gen_data.generator.core.capture import Capture, SensorReading
from gen_data.generator.core.interfaces import DatasetInfo, Exporter
from gen_data.generator.core.sample import Sample
from gen_data.generator.runner.error_context import explain_errors
from gen_data.generator.runner.labels import LABELS_NAME, labels_line
from gen_data.generator.runner.plan import Plan
from gen_data.generator.runner.provenance import SCENES_NAME, scene_line
from gen_data.generator.runner.shard_record import ShardRecord, describe_shard
from gen_data.generator.runner.store import LocalStore

MediaWriter = Callable[[DatasetInfo, Sample, Path], object]


class PipelineLike(Protocol):
    """What the runner needs of a pipeline.

    ``info`` and ``exporters`` can be read without entering it; ``sample`` is called inside a
    ``with`` block only.
    """

    @property
    def info(self) -> DatasetInfo:
        """The data set as its exporters see it."""
        ...

    @property
    def exporters(self) -> Mapping[str, Exporter]:
        """Exporters by name; an exporter's results go to the folder of that name."""
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
        """Stop them."""
        ...


def write_images(info: DatasetInfo, sample: Sample, shard_dir: Path) -> None:
    """Encode a sample's images to where exporters expect them; imports OpenCV when first used."""
    from gen_data.exporters.image_files import write_media

    write_media(info, sample, shard_dir)


@dataclass(frozen=True)
class Job:
    """Everything that making a shard takes, except its number; picklable.

    Attributes:
        make_pipeline: Makes the same pipeline in any process.
        write_media: Writes the images of one sample.
    """

    plan: Plan
    store: LocalStore
    make_pipeline: Callable[[], EnteredPipeline]
    write_media: MediaWriter = write_images


@dataclass(frozen=True)
class MadeShard:
    """A committed shard, and the CPU seconds that its labels and its commit took, by stage."""

    record: ShardRecord
    timings_s: Mapping[str, float]


def make_shard(
    job: Job, pipeline: PipelineLike, shard: int, on_sample: Callable[[Sample], None]
) -> MadeShard:
    """Make and commit one shard.

    A sample's images are written and dropped as soon as it is made; exporters then see the whole
    shard as a list of samples whose readings have cameras and no pixels. Truth masks are tight
    crops, so memory stays within one sample's images and one shard's labels.

    Raises:
        GenDataError: a sample cannot be made, or its files cannot be written.
    """
    indices = job.plan.samples_of(shard)
    with job.store.errors():
        folder = job.store.scratch_dir()
    try:
        samples: list[Sample] = []
        for index in indices:
            samples.append(_written(job, pipeline, index, folder, samples, on_sample))
        started_s = time.process_time()
        for name in sorted(pipeline.exporters):
            with explain_errors(f"shard {shard}, exporter {name}"), job.store.errors():
                pipeline.exporters[name].write_shard(pipeline.info, samples, folder)
        with job.store.errors():
            record = describe_shard(shard, indices, samples, folder)
            job.store.commit(folder, record)
        write_s = time.process_time() - started_s
    finally:
        # After a failure, give the space back; after a commit there is nothing left here.
        shutil.rmtree(folder, ignore_errors=True)
    return MadeShard(record, {"write": write_s})


def _written(
    job: Job,
    pipeline: PipelineLike,
    index: int,
    folder: Path,
    before: Sequence[Sample],
    on_sample: Callable[[Sample], None],
) -> Sample:
    """One sample without its pixels, after they and its scene are in files.

    ``before`` are the shard's samples before it.
    """
    with explain_errors(f"sample {index}", job.store.reproduce_command(index)):
        sample = pipeline.sample(index)
        started_s = time.process_time()
        with job.store.errors():
            job.write_media(pipeline.info, sample, folder)
            with (folder / SCENES_NAME).open("a", encoding="utf-8") as scenes:
                base = next((s for s in before if s.scene_index == sample.scene_index), None)
                scenes.write(scene_line(sample, base) + "\n")
            with (folder / LABELS_NAME).open("a", encoding="utf-8") as labels:
                labels.write(labels_line(sample) + "\n")
        encode_s = time.process_time() - started_s
    on_sample(replace(sample, timings_s={**sample.timings_s, "encode": encode_s}))
    return drop_pixels(sample)


def drop_pixels(sample: Sample) -> Sample:
    """The sample with its labels, and of what its sensors saw only when and from where."""
    capture = sample.capture
    readings = {
        name: SensorReading(reading.sensor, reading.camera, {}, time_s=reading.time_s)
        for name, reading in capture.readings.items()
    }
    clouds = {
        name: replace(cloud, points=cloud.points[:0].copy())
        for name, cloud in capture.clouds.items()
    }
    return replace(sample, capture=Capture(readings, clouds))
