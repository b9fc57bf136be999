"""Base of exporters that keep a JSON line per photograph until their data set is merged."""

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.exporters import base, fragments, sensor_selection


class ImageRowsExporter(base.ExporterBase):
    """An exporter of all cameras with the rgb channel, whose images it links."""

    type: str
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without photographs.

        Raises:
            ConfigError: no sensor writes the rgb channel.
        """
        sensor_selection.check_channels(info, (), self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a JSON line per photograph to ``<split>.images.jsonl``.

        Raises:
            ConfigError: see ``check``.
        """
        self.check(info)
        rows: dict[str, list[Mapping[str, Any]]] = {}
        for sample, sensor in sensor_selection.photographs(info, samples):
            facts = self.image_row(info, sample, sensor)
            row = {**facts, "sensor": sensor, "sample": sample.index}
            rows.setdefault(f"{sample.split}.images", []).append(row)
        fragments.write_fragments(shard_dir / self.type, rows)

    @abstractmethod
    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> Mapping[str, Any]:
        """Contents of a photograph's line besides ``sensor`` and ``sample``."""
