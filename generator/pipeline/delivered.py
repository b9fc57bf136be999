"""Data sets without the readings that are lost on their way, for exporters.

Shards and ``labels.jsonl`` have all readings. The readings that arrive are linked into the folder
``_delivered`` of a shard, which is the shard that exporters see: a lost reading is missing, like a
reading of a sensor that does not read at this step. Exporters that show the truth have all
readings.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gen_data.core.capture import Capture
from gen_data.core.interfaces import DatasetInfo, Exporter, reading_paths
from gen_data.core.reported import copies
from gen_data.core.sample import Sample
from gen_data.exporters.base import WrappedExporter
from gen_data.exporters.image_files import link_or_copy

FOLDER = "_delivered"
"""Begins like the name of no sensor."""


@dataclass(frozen=True)
class DeliveredExporter(WrappedExporter):
    """An exporter that sees the readings that arrive."""

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Link the files that arrive, and write the labels of one shard."""
        folder = shard_dir / FOLDER
        folder.mkdir(exist_ok=True)

        def arrive(sample: Sample) -> Sample:
            arrived = arrived_sample(sample)
            for source, target in zip(
                _files(info, arrived, shard_dir), _files(info, arrived, folder), strict=True
            ):
                if not target.exists():
                    link_or_copy(source, target)
            return arrived

        self.exporter.write_shard(info, map(arrive, samples), folder)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards."""
        self.exporter.finalize(info, [folder / FOLDER for folder in shard_dirs], dataset_dir)


def arrived_sample(sample: Sample) -> Sample:
    """The sample without the readings that are lost, and without their annotations."""
    read = sample.capture
    kinds = (read.readings, read.clouds, read.tables)
    lost = {name for kind in kinds for name in kind if not copies(kind[name])}
    if not lost:
        return sample
    capture = Capture(
        {name: reading for name, reading in read.readings.items() if name not in lost},
        {name: cloud for name, cloud in read.clouds.items() if name not in lost},
        {name: table for name, table in read.tables.items() if name not in lost},
    )
    frame = sample.frame
    if frame is not None and frame.tracks is not None:
        kept = {n: t for n, t in frame.tracks.sensors.items() if n not in lost}
        frame = replace(frame, tracks=replace(frame.tracks, sensors=kept))
    return replace(
        sample,
        capture=capture,
        truth={name: truth for name, truth in sample.truth.items() if name not in lost},
        frame=frame,
        instants={name: scene for name, scene in sample.instants.items() if name not in lost},
    )


def delivered(own: Exporter, exporter: Exporter, info: DatasetInfo) -> Exporter:
    """The exporter of the readings that arrive; ``exporter`` itself if none may be lost.

    Args:
        own: As configured.
        exporter: The same, perhaps behind a label map and a view.
        info: Facts about the data set.
    """
    may_lose = any("lost" in sensor.faults for sensor in info.sensors)
    if not may_lose or getattr(own, "shows_truth", False):
        return exporter
    return DeliveredExporter(exporter)


def _files(info: DatasetInfo, sample: Sample, folder: Path) -> list[Path]:
    """Files of the readings of a sample."""
    images = [
        info.media_path(folder, name, channel, sample.index)
        for name in info.cameras
        if name in sample.capture.readings
        for channel in info.media[name]
    ]
    others = reading_paths(folder, sample.capture, sample.index)
    return images + [path for s in info.sensors for path in others.get(s.name, ())]
