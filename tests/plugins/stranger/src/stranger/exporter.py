"""Exporter that writes one JSON line per object and image."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from gen_data.config.base_model import Strict
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, Exporter
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json


class Lines(Strict):
    """``objects.jsonl`` with index, camera, category and distance of every object."""

    type: Literal["stranger_lines"] = "stranger_lines"

    @property
    def needs(self) -> frozenset[str]:
        """Names of the required annotations."""
        return frozenset({"stranger_distance"})

    @property
    def has_own_classes(self) -> bool:
        """It writes the categories of the data set."""
        return False

    def check(self, info: DatasetInfo) -> None:
        """Refuse a data set without a camera."""
        if not info.cameras:
            raise ConfigError(f"exporter '{self.type}': there is no camera")

    def with_assets(self, assets: AssetLibrary) -> Lines:
        """Return itself; it writes no geometry."""
        del assets
        return self

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the lines of one shard."""
        rows = [
            {
                "index": sample.index,
                "camera": camera,
                "category": truth.instance.category,
                "distance_m": truth.extra["stranger_distance"],
            }
            for sample in samples
            for camera in info.cameras
            for truth in sample.truth[camera].objects
        ]
        folder = shard_dir / self.type
        folder.mkdir(parents=True)
        text = "".join(canonical_json(row) + "\n" for row in rows)
        (folder / "objects.jsonl").write_text(text, encoding="utf-8")

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Concatenate the lines of all shards."""
        del info
        dataset_dir.mkdir(parents=True, exist_ok=True)
        parts = [(folder / self.type / "objects.jsonl").read_text("utf-8") for folder in shard_dirs]
        (dataset_dir / "objects.jsonl").write_text("".join(parts), encoding="utf-8")


PLUGIN: type[Exporter] = Lines
