"""Samples read back from a finished data set."""

import io
import json
import re
import shlex
from array import array
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from os import PathLike
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.core import measurement_dtypes, path_names, serialization, urls
from gen_data.core.capture import (
    ORIGIN,
    POINT,
    Capture,
    Channel,
    Measurements,
    PointCloud,
    SensorReading,
)
from gen_data.core.errors import SampleIndexError, StorageError
from gen_data.core.interfaces import DatasetInfo, cloud_path, origins_path, table_path
from gen_data.core.sample import EgoTruth, ImageTruth, Sample
from gen_data.core.scene import Camera, Scene
from gen_data.runner import durable_files, failed_sample, layout, plan, store
from gen_data.runner.labels import LABELS_NAME, Labels, parse_labels
from gen_data.runner.provenance import SCENES_NAME, KeptScene, parse_scene

K = TypeVar("K")
T = TypeVar("T")

SHARDS_KEPT = 16
"""Number of shards whose line positions stay in memory; lines and images are read on access."""

BASE_SCENES_KEPT = 2
"""Number of scenes that stay in memory for their further views."""


class JsonLines:
    """Lines of a file by number, read on access."""

    def __init__(self, path: Path) -> None:
        self._path = path
        data = np.frombuffer(path.read_bytes(), np.uint8)
        self._ends = np.flatnonzero(data == ord("\n")) + 1

    def line(self, number: int) -> bytes:
        """Read a line. Raises ValueError if the file ends before."""
        if number >= len(self._ends):
            raise ValueError(f"it has {len(self._ends)} lines, expected more")
        start = int(self._ends[number - 1]) if number else 0
        with self._path.open("rb") as file:
            file.seek(start)
            return file.read(int(self._ends[number]) - start)


class StoredSamples:
    """Samples of a finished data set, by index.

    Attributes:
        failed: Samples that the data set does not have.

    Raises:
        StorageError: the folder holds no finished data set.
    """

    def __init__(self, folder: str | PathLike[str]) -> None:
        if urls.is_url(folder):
            raise StorageError(urls.needs_folder(folder))
        self.folder = Path(folder)
        self.plan = plan.load_plan(self.folder)
        manifest = self._read_manifest()
        self.info: DatasetInfo = manifest[0]
        self.dataset_id: str = manifest[1]
        self.failed: tuple[failed_sample.FailedSample, ...] = manifest[2]
        self._absent = sorted(failure.index for failure in self.failed)
        self._lines = lru_cache(2 * SHARDS_KEPT)(self._open_lines)
        # Views of one scene follow each other, and share most of it.
        self._base_scene = lru_cache(BASE_SCENES_KEPT)(self._read_base_scene)

    @property
    def n(self) -> int:
        """Number of samples that exist; their indices are in ``indices``."""
        return self.plan.n - len(self.failed)

    @cached_property
    def indices(self) -> Sequence[int]:
        """Indices of all samples, ascending: the plan's indices without the failed ones."""
        absent = set(self._absent)
        every = range(self.plan.n)
        return array("q", (i for i in every if i not in absent)) if absent else every

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories."""
        return self.info.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration of the data set."""
        config: Mapping[str, Any] = self.plan.config
        return config

    def labelled(self, index: int, has_points: bool = True) -> "LabelledImages":
        """The sample of that number, whose scene, images and points are read on access.

        Without ``has_points``, its scans are empty, as exporters receive them.

        Raises:
            StorageError: a file of the sample's shard is missing or damaged.
        """
        folder = self._folder_of(index)
        with self._damage(folder / LABELS_NAME):
            labels = parse_labels(self._line(LABELS_NAME, index))
        capture = read_capture(self.info, labels, folder, has_points=has_points)
        return LabelledImages(self.kept_scene, labels, capture, self.info.cameras)

    def sample(self, index: int, has_points: bool = True) -> Sample:
        """The whole sample of that number, see ``labelled``, with its scene.

        Raises:
            StorageError: a file of the sample's shard is missing or damaged.
        """
        light, kept = self.labelled(index, has_points), self.kept_scene(index)
        return Sample(
            index=kept.index,
            scene_index=kept.scene_index,
            view_index=kept.view_index,
            step_index=kept.step_index,
            split=kept.split,
            scene=kept.scene,
            capture=light.capture,
            truth=light.truth,
            attempts=kept.attempts,
            view_attempts=kept.view_attempts,
            cameras=self.info.cameras,
            frame=light.frame,
        )

    def kept_scene(self, index: int) -> KeptScene:
        """Read the scene of a sample. Raises StorageError if it is missing or damaged."""
        with self._damage(self._folder_of(index) / SCENES_NAME):
            return parse_scene(self._line(SCENES_NAME, index), self._base_scene)

    def _read_base_scene(self, index: int) -> Scene:
        return self.kept_scene(index).scene

    def close(self) -> None:
        """Forget the positions of lines."""
        self._lines.cache_clear()
        self._base_scene.cache_clear()

    def _open_lines(self, path: Path) -> JsonLines:
        return JsonLines(path)

    def _line(self, name: str, index: int) -> bytes:
        lines = self._lines(self._folder_of(index) / name)
        # Failed samples have no lines.
        first = index - index % self.plan.shard_size
        before = bisect_left(self._absent, index) - bisect_left(self._absent, first)
        return lines.line(index - first - before)

    def _folder_of(self, index: int) -> Path:
        place = bisect_left(self._absent, index)
        if place < len(self._absent) and self._absent[place] == index:
            failure = self.failed[place]
            raise SampleIndexError(
                f"{self.folder}: sample {index} does not exist, as it could not be made "
                f"({failure.stage}: {failure.error})"
            )
        return self.shard_dir(index // self.plan.shard_size)

    @contextmanager
    def _damage(self, path: Path) -> Iterator[None]:
        """Turn errors of a damaged file into a StorageError with a remedy."""
        try:
            yield
        except plan.DAMAGE as error:
            fact = error.strerror if isinstance(error, OSError) else error
            raise StorageError(
                f"{path}: cannot be read ({fact}); check the data set with:"
                f"\n    gen-data verify {self.folder} --full"
            ) from error

    def shard_dir(self, shard: int) -> Path:
        """Folder of the files of a shard."""
        return self.folder / layout.SHARDS_NAME / f"{shard:06d}"

    def _read_manifest(self) -> tuple[DatasetInfo, str, tuple[failed_sample.FailedSample, ...]]:
        """Facts about the data set, its id, and the samples that it does not have."""
        path = self.folder / layout.MANIFEST_NAME
        try:
            manifest = json.loads(path.read_bytes())
            info = serialization.from_plain(DatasetInfo, manifest["info"])
            path_names.check_name(info.name)
            for name in (*info.categories, *(sensor.name for sensor in info.sensors)):
                path_names.check_name(name)
            return info, parse_dataset_id(manifest, path), failed_sample.parse_failed(manifest)
        except FileNotFoundError:
            raise StorageError(
                f"{path}: missing; the data set is unfinished: run the command that began it again"
            ) from None
        except plan.DAMAGE as error:
            raise StorageError(
                f"{path}: damaged ({error}); restore the file from a copy, or remove it and run "
                "the command that made the data set again"
            ) from None

    def __getstate__(self) -> dict[str, Any]:
        """Pickle only the folder."""
        return {"folder": self.folder}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Open the folder."""
        self.__init__(state["folder"])  # type: ignore[misc]


class CheckedSamples(StoredSamples):
    """Samples whose scenes and labels are held against the records of their shards.

    Results made from them get new checksums, which damage in the source would pass.
    """

    def __init__(self, folder: str | PathLike[str]) -> None:
        super().__init__(folder)
        self.record = lru_cache(SHARDS_KEPT)(store.LocalStore(self.folder).record)
        """Record of a shard; None if it is missing or damaged."""
        self._checked: set[Path] = set()

    def check(self, path: Path) -> None:
        """Hold a file of a shard's own folder against the shard's record, once.

        Raises:
            StorageError: it is damaged.
        """
        if path in self._checked:
            return
        record = self.record(int(path.parent.name))
        expected = {file.path: file.sha256 for file in record.files} if record else {}
        check_digest(path, expected.get(path.name), self.folder, RECORDED)
        self._checked.add(path)

    def _open_lines(self, path: Path) -> JsonLines:
        self.check(path)
        return super()._open_lines(path)


RECORDED = "the digest in the shard's record"


def check_digest(path: Path, sha256: str | None, folder: Path, source: str) -> None:
    """Refuse a damaged file of the data set in ``folder``; ``source`` names its digest.

    Raises:
        StorageError: the file does not have that digest, or none is known (None).
    """
    if durable_files.hash_file(path) != sha256:
        raise StorageError(
            f"{path}: its sha256 is not {source}.\n  Repair: "
            f"gen-data repair {shlex.quote(str(folder))}"
        )


def parse_dataset_id(manifest: Mapping[str, Any], place: object) -> str:
    """The id in a manifest, which names a folder.

    Raises:
        StorageError: it is not the sha256 of a data set.
    """
    identity = manifest.get("dataset_id")
    if not isinstance(identity, str) or not re.fullmatch(r"[0-9a-f]{64}", identity):
        raise StorageError(
            f"{place}: damaged (dataset_id is not a sha256); expected the manifest of a data set"
        )
    return identity


def read_capture(
    info: DatasetInfo,
    labels: Labels,
    folder: Path,
    *,
    has_points: bool = True,
    read: Callable[[Path], bytes] = Path.read_bytes,
) -> Capture:
    """The readings of a sample, whose images, points and rows are read on access.

    Args:
        info: Facts about the data set.
        labels: Labels of the sample.
        folder: Folder of its shard.
        has_points: Whether scans have points and tables rows; exporters receive none.
        read: Reads a file below the folder.
    """
    index = labels.index
    readings = {
        name: SensorReading(
            name,
            labels.truth[name].camera,
            ImageFiles(info, folder, labels.truth[name].camera, index, read),
            time_s=image.time_s,
            ev100=image.ev100,
            faults=image.faults,
        )
        for name, image in labels.images.items()
    }

    def cloud(name: str) -> PointCloud:
        scan = labels.scans[name]
        if not has_points:
            return PointCloud(name, scan.lidar, np.zeros(0, POINT), scan.time_s, faults=scan.faults)
        path = cloud_path(folder, name, index)
        points = _load(path, POINT, read)
        if not np.isfinite(points["position_m"]).all():
            raise StorageError(
                f"{path}: contains a position that is not finite; generate the data set again"
            )
        origins = None
        if scan.lidar.origins:
            origins = _load(origins_path(folder, name, index), ORIGIN, read)
        return PointCloud(name, scan.lidar, points, scan.time_s, origins, scan.faults)

    def table(name: str) -> Measurements:
        kept = labels.tables[name]
        dtype = measurement_dtypes.columns_dtype(info.sensor(name).columns)
        path = table_path(folder, name, index)
        rows = _load(path, dtype, read) if has_points else np.zeros(0, dtype)
        return Measurements(name, kept.device, rows, kept.time_s, kept.faults)

    return Capture(readings, ReadOnAccess(labels.scans, cloud), ReadOnAccess(labels.tables, table))


@dataclass(frozen=True, eq=False)
class LabelledImages:
    """A stored sample, which is read in parts: training needs no scene.

    Attributes: see ``Sample``; ``read_scene`` returns the scene of an index.
    """

    read_scene: Callable[[int], KeptScene]
    labels: Labels
    capture: Capture
    cameras: tuple[str, ...]

    @property
    def index(self) -> int:
        """Number of the sample."""
        return self.labels.index

    @property
    def split(self) -> str:
        """Its split."""
        return self.labels.split

    @property
    def truth(self) -> Mapping[str, ImageTruth]:
        """Annotations by camera."""
        return self.labels.truth

    @property
    def frame(self) -> EgoTruth | None:
        """Annotations of the sample as a whole."""
        return self.labels.frame

    @cached_property
    def scene(self) -> Scene:
        """The scene; read on first access."""
        return self.read_scene(self.index).scene


class ReadOnAccess(Mapping[K, T], Generic[K, T]):
    """Values by name or channel, read from disk at each access."""

    def __init__(self, names: Iterable[K], read: Callable[[K], T]) -> None:
        self._names = tuple(names)
        self._read = read

    def __getitem__(self, name: K) -> T:
        """Read one value."""
        if name not in self._names:
            raise KeyError(name)
        return self._read(name)

    def __contains__(self, name: object) -> bool:
        """Whether there is such a value; reads nothing."""
        return name in self._names

    def __iter__(self) -> Iterator[K]:
        """The names."""
        return iter(self._names)

    def __len__(self) -> int:
        """Number of values."""
        return len(self._names)


class ImageFiles(Mapping[Channel, NDArray[Any]]):
    """Images of one reading by channel, decoded at each access."""

    def __init__(
        self,
        info: DatasetInfo,
        folder: Path,
        camera: Camera,
        index: int,
        read: Callable[[Path], bytes] = Path.read_bytes,
    ) -> None:
        name, intrinsics = camera.name, camera.intrinsics
        self._paths = {
            c: info.media_path(folder, name, c, index) for c in info.sensor(name).channels
        }
        self._size_px = (intrinsics.width_px, intrinsics.height_px)
        self._depth_scale_m = info.depth_scale_m
        self._categories = len(info.categories)
        self._read = read

    def __getitem__(self, channel: Channel) -> NDArray[Any]:
        """Decode one image."""
        from gen_data.exporters.image_files import read_image

        path = self._paths[channel]
        image = read_image(path, channel, self._depth_scale_m, self._size_px, self._read)
        if channel is Channel.CATEGORY and image.max() > self._categories:
            raise StorageError(
                f"{path}: holds the category {image.max()}; expected 0 to {self._categories}; "
                "generate the data set again"
            )
        return image

    def __iter__(self) -> Iterator[Channel]:
        """The channels, in order."""
        return iter(self._paths)

    def __contains__(self, channel: object) -> bool:
        """Whether the reading has the channel; decodes nothing."""
        return channel in self._paths

    def __len__(self) -> int:
        """Number of channels."""
        return len(self._paths)


def _load(path: Path, dtype: np.dtype[np.void], read: Callable[[Path], bytes]) -> NDArray[np.void]:
    try:
        records: NDArray[np.void] = np.load(io.BytesIO(read(path)), allow_pickle=False)
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{path}: cannot be read ({error}); generate the data set again"
        ) from error
    if records.dtype != dtype or records.ndim != 1:
        raise StorageError(
            f"{path}: holds {records.dtype} records {list(records.shape)}; expected a list of "
            f"{dtype}; generate the data set again"
        )
    return records
