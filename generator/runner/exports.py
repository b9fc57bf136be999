"""Export of a finished data set in further formats, without a renderer.

It is a run like any other, whose samples are read instead of generated and whose images are linked
instead of encoded: with the same interruptions, resumption, workers and manifest. Its plan is the
data set's plan with other exporters; the result has the same bytes as the data set that generation
with these exporters gives.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.core.interfaces import DatasetInfo, Exporter, reading_paths
from gen_data.core.sample import Sample
from gen_data.exporters.image_files import link_or_copy
from gen_data.runner import durable_files, labels, layout, plan, seal, shard_record, verify
from gen_data.runner.progress import Summary
from gen_data.runner.provenance import SCENES_NAME
from gen_data.runner.run import Settings, run
from gen_data.runner.stored import RECORDED, CheckedSamples, StoredSamples, check_digest

NEW_BYTES = 8_000.0
"""Least size of an export's additions to a sample: labels, and entries in records and sums."""

if TYPE_CHECKING:
    from gen_data.assemble.config import Config


@dataclass(frozen=True)
class StoredPipeline:
    """A pipeline that reads its samples from a finished data set; picklable.

    Attributes:
        asset_folders: Asset folders of the data set's configuration.
        has_points: Whether samples have the points of their scans, which exporters do not need.
    """

    stored: StoredSamples
    exporters: Mapping[str, Exporter]
    asset_folders: tuple[Path, ...] = ()
    has_points: bool = False

    @property
    def info(self) -> DatasetInfo:
        """Facts about the data set."""
        return self.stored.info

    def sample(self, index: int) -> Sample:
        """Read a sample; its images are decoded on access."""
        sample = self.stored.sample(index, self.has_points)
        capture = sample.capture
        times_s = {name: one.time_s for name, one in capture.readings.items()}
        times_s |= {name: one.time_s for name, one in capture.clouds.items()}
        apart = {name: t for name, t in times_s.items() if t != sample.scene.time_s}
        if not apart:
            return sample
        # Sensors with an offset see the scene of another instant, which files do not hold.
        ids = {name: number for number, name in enumerate(self.info.categories, 1)}
        # Loads all kinds of assets, which most exports do without.
        from gen_data.packs.provision import open_assets
        from gen_data.pipeline.finalize_scene import Timeline

        timeline = Timeline(sample.scene, open_assets(self.asset_folders), ids)
        return replace(sample, instants={name: timeline.at(t) for name, t in apart.items()})

    def __call__(self) -> "StoredPipeline":
        """Make the pipeline of a process."""
        return self

    def __enter__(self) -> "StoredPipeline":
        """Start; there are no engines."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Drop the loaded data."""
        self.stored.close()


@dataclass(frozen=True)
class LinkedFiles:
    """Links the files of a data set into the shards of its export."""

    stored: CheckedSamples

    def link_media(self, info: DatasetInfo, sample: Sample, shard_dir: Path) -> None:
        """Link images, laser scans and measurements of a sample."""
        index, capture = sample.index, sample.capture
        source_dir = self._source_dir(index)
        pairs = [
            (
                info.media_path(source_dir, name, c, index),
                info.media_path(shard_dir, name, c, index),
            )
            for name in capture.readings
            for c in info.media[name]
        ]
        sources, targets = (reading_paths(d, capture, index) for d in (source_dir, shard_dir))
        for name in sources:
            pairs += zip(sources[name], targets[name], strict=True)
        for source, target in pairs:
            link_or_copy(source, target)

    def link_records(self, sample: Sample, base: Sample | None, shard_dir: Path) -> None:
        """Link the scenes and labels of the whole shard, with its first sample."""
        del base
        if not (shard_dir / SCENES_NAME).exists():
            for name in (SCENES_NAME, labels.LABELS_NAME):
                link_or_copy(self._source_dir(sample.index) / name, shard_dir / name)

    def digests(self, shard: int) -> Mapping[durable_files.Inode, str]:
        """Digests by inode of the files of a shard that exports link.

        Raises:
            StorageError: a file does not have the digest of the shard's record: results of
                exporters from it are wrong.
        """
        found = {}
        folder = self.stored.shard_dir(shard)
        for file in _linked_files(self.stored, shard):
            path = folder / file.path
            if path.parent == folder:
                # Checked before it was read.
                self.stored.check(path)
            else:
                check_digest(path, file.sha256, self.stored.folder, RECORDED)
            found[durable_files.get_inode(path)] = file.sha256
        return found

    def _source_dir(self, index: int) -> Path:
        return self.stored.shard_dir(index // self.stored.plan.shard_size)


def _linked_sample_bytes(stored: CheckedSamples) -> float:
    """Mean size of the files of a sample that exports link, in the first shard."""
    sizes = [file.bytes for file in _linked_files(stored, 0)]
    record = stored.record(0)
    return sum(sizes) / max(record.samples if record else 0, 1)


def _linked_files(stored: CheckedSamples, shard: int) -> list[shard_record.FileRecord]:
    record = stored.record(shard)
    sensors = {sensor.name for sensor in stored.info.sensors}
    return [
        file
        for file in (record.files if record else ())
        if file.path in (SCENES_NAME, labels.LABELS_NAME) or file.path.partition("/")[0] in sensors
    ]


def _read_licences(path: Path) -> str:
    """The text that is copied into the export. Raises StorageError if the file is damaged."""
    expected = seal.read_sums(path.parent).digests.get(path.name)
    check_digest(path, expected, path.parent, f"the one in {layout.SUMS_NAME}")
    return path.read_text("utf-8")


def _is_same_disk(one: Path, other: Path) -> bool:
    """Whether hard links from one folder to another, which may not exist yet, are possible."""
    while not other.exists():
        other = other.parent
    return one.stat().st_dev == other.stat().st_dev


def export(
    stored: StoredSamples,
    config: "Config",
    exporters: Mapping[str, Exporter],
    out: Path,
    settings: Settings,
) -> Summary:
    """Write a finished data set in other formats, as a separate data set.

    Args:
        stored: The data set.
        config: Its configuration, with these exporters.
        exporters: By name; checked.
        out: Folder of the new data set. Its shards are hard links to the old one's, or
            copies on another file system.
        settings: Choices of the caller; sizes of files, writers and failed samples are added.

    Raises:
        GenDataError: see ``run``.
    """
    verify.check_source(stored.folder)
    source = CheckedSamples(stored.folder)
    licences = stored.folder / layout.LICENCES_NAME
    text = _read_licences(licences) if licences.exists() else None
    files = LinkedFiles(source)
    linked_bytes = _linked_sample_bytes(source)
    linked = _is_same_disk(stored.folder, out.absolute())
    return run(
        replace(stored.plan, config=config.resolved, format_version=plan.FORMAT_VERSION),
        StoredPipeline(source, exporters, config.asset_folders),
        out,
        replace(
            settings,
            write_media=files.link_media,
            write_records=files.link_records,
            linked_digests=files.digests,
            # The size of new files of later shards follows from the first one.
            sample_bytes=NEW_BYTES + (0.0 if linked else linked_bytes),
            linked_bytes=linked_bytes if linked else 0.0,
            failed=stored.failed,
        ),
        licences=None if text is None else lambda _: text,
    )
