"""Samples read back from a finished data set."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.capture import (
    Capture,
    Channel,
    Measurements,
    PointCloud,
    SensorReading,
)
from gen_data.generator.core.errors import StorageError
from gen_data.generator.core.interfaces import DatasetInfo, cloud_path, media_path, table_path
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.serialization import from_plain
from gen_data.generator.runner.labels import LABELS_NAME, Labels, read_labels
from gen_data.generator.runner.plan import load_plan
from gen_data.generator.runner.provenance import SCENES_NAME, KeptScene, read_scenes
from gen_data.generator.runner.store import MANIFEST_NAME, SHARDS_NAME

SHARDS_KEPT = 4
"""Number of shards whose scenes and labels stay in memory; images are read on access."""


class StoredSamples:
    """Samples of a finished data set, by index.

    Raises:
        StorageError: the folder holds no finished data set.
    """

    def __init__(self, folder: str | PathLike[str]) -> None:
        self.folder = Path(folder)
        self.plan = load_plan(self.folder)
        manifest = self._read_manifest()
        self.info: DatasetInfo = manifest[0]
        self.dataset_id: str = manifest[1]
        self._shard = lru_cache(SHARDS_KEPT)(self._read_shard)

    @property
    def n(self) -> int:
        """Number of samples."""
        return self.plan.n

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories."""
        return self.info.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration of the data set."""
        config: Mapping[str, Any] = self.plan.config
        return config

    def sample(self, index: int) -> Sample:
        """Return the sample of that number; its images are decoded on access.

        Raises:
            StorageError: a file of the sample's shard is missing or damaged.
        """
        shard = index // self.plan.shard_size
        folder = self.shard_dir(shard)
        kept, labels = self._shard(shard)[index - shard * self.plan.shard_size]
        return Sample(
            index=kept.index,
            scene_index=kept.scene_index,
            view_index=kept.view_index,
            step_index=kept.step_index,
            split=kept.split,
            scene=kept.scene,
            capture=self._capture(folder, labels),
            truth=labels.truth,
            attempts=kept.attempts,
            view_attempts=kept.view_attempts,
            cameras=self.info.cameras,
            frame=labels.frame,
        )

    def close(self) -> None:
        """Drop the shards from memory."""
        self._shard.cache_clear()

    def _capture(self, folder: Path, labels: Labels) -> Capture:
        index = labels.index
        readings = {
            name: SensorReading(
                name,
                labels.truth[name].camera,
                ImageFiles(folder, name, index, self.info.media[name], self.info.depth_scale_m),
                time_s=image.time_s,
                ev100=image.ev100,
            )
            for name, image in labels.images.items()
        }
        clouds = {
            name: PointCloud(name, scan.lidar, _load(cloud_path(folder, name, index)), scan.time_s)
            for name, scan in labels.scans.items()
        }
        tables = {
            name: Measurements(
                name, table.device, _load(table_path(folder, name, index)), table.time_s
            )
            for name, table in labels.tables.items()
        }
        return Capture(readings, clouds, tables)

    def _read_shard(self, shard: int) -> list[tuple[KeptScene, Labels]]:
        folder = self.shard_dir(shard)
        try:
            scenes = list(read_scenes(folder / SCENES_NAME))
            by_index = {kept.index: kept.scene for kept in scenes}
            return list(zip(scenes, read_labels(folder / LABELS_NAME, by_index), strict=True))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StorageError(
                f"{folder}: its scenes or labels cannot be read ({error}); check the data set with:"
                f"\n    gen-data verify {self.folder} --full"
            ) from error

    def shard_dir(self, shard: int) -> Path:
        """Folder of the files of a shard."""
        return self.folder / SHARDS_NAME / f"{shard:06d}"

    def _read_manifest(self) -> tuple[DatasetInfo, str]:
        """Facts about the data set, and its id."""
        path = self.folder / MANIFEST_NAME
        try:
            manifest = json.loads(path.read_bytes())
            return from_plain(DatasetInfo, manifest["info"]), str(manifest["dataset_id"])
        except FileNotFoundError:
            raise StorageError(
                f"{path}: missing; the data set is unfinished: run the command that began it again"
            ) from None
        except (ValueError, KeyError, TypeError) as error:
            raise StorageError(f"{path}: damaged ({error})") from None

    def __getstate__(self) -> dict[str, Any]:
        """Pickle only the folder."""
        return {"folder": self.folder}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Open the folder."""
        self.__init__(state["folder"])  # type: ignore[misc]


class ImageFiles(Mapping[Channel, NDArray[Any]]):
    """Images of one reading by channel, decoded at each access."""

    def __init__(
        self,
        folder: Path,
        sensor: str,
        index: int,
        channels: tuple[Channel, ...],
        depth_scale_m: float,
    ) -> None:
        self._paths = {c: media_path(folder, sensor, c, index) for c in channels}
        self._depth_scale_m = depth_scale_m

    def __getitem__(self, channel: Channel) -> NDArray[Any]:
        """Decode one image."""
        from gen_data.exporters.image_files import read_image

        return read_image(self._paths[channel], channel, self._depth_scale_m)

    def __iter__(self) -> Iterator[Channel]:
        """The channels, in order."""
        return iter(self._paths)

    def __contains__(self, channel: object) -> bool:
        """Whether the reading has the channel; decodes nothing."""
        return channel in self._paths

    def __len__(self) -> int:
        """Number of channels."""
        return len(self._paths)


def _load(path: Path) -> NDArray[np.void]:
    try:
        records: NDArray[np.void] = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{path}: cannot be read ({error}); generate the data set again"
        ) from error
    return records
