"""Data sets as lazy sequences of samples."""

from __future__ import annotations

import copy
import gc
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.api.config import ConfigLike, check_whole, load_config, path_text
from gen_data.generator.api.relabelling import LabelMapLike, RelabelledSamples, load_label_map
from gen_data.generator.api.sample import Sample, SampleRecord
from gen_data.generator.core.errors import ConfigError, SampleIndexError, did_you_mean
from gen_data.generator.runner.stored_objects import open_stored

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

    from gen_data.generator.core.capture import Channel
    from gen_data.generator.pipeline import Pipeline
    from gen_data.generator.runner.stored import StoredSamples

Self = TypeVar("Self", bound="SampleSequence")

UNBOUNDED = range(sys.maxsize)
"""Indices of a data set without a size."""


class SampleSource(Protocol):
    """Source of the samples of a sequence."""

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number."""
        ...

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names; category id ``k`` is ``categories[k - 1]``."""
        ...

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration as plain values."""
        ...

    def close(self) -> None:
        """Release the engines; a later call of ``sample`` restarts them."""
        ...


class SampleSequence(Sequence[Sample], AbstractContextManager["SampleSequence", None]):
    """Samples by index. Slices are lazy sequences over the same source.

    Iteration, ``len``, negative indices and ``in`` work as for a list. A pickled sequence gives the
    same samples in another process.
    """

    def __init__(self, source: SampleSource, indices: range) -> None:
        self._source = source
        self._indices = indices

    @overload
    def __getitem__(self, index: int) -> Sample: ...

    @overload
    def __getitem__(self: Self, index: slice) -> Self: ...

    def __getitem__(self: Self, index: int | slice) -> Sample | Self:
        """One sample, or a sequence for a slice.

        Raises:
            SampleIndexError: the index is out of range; it is also an IndexError.
            SampleError: the sample cannot be generated.
        """
        if isinstance(index, slice):
            part = copy.copy(self)
            part._indices = self._indices[index]
            return part
        check_whole("index", index)
        if index < 0 and not self.is_bounded:
            raise SampleIndexError(f"index {index}: a data set without a size has no end; give n=")
        try:
            number = self._indices[index]
        except IndexError:
            raise SampleIndexError(
                f"index {index} is out of range for {len(self._indices)} samples"
            ) from None
        return Sample(self._source.sample(number))

    def __len__(self) -> int:
        """Number of samples.

        Raises:
            TypeError: the data set has no size.
        """
        if not self.is_bounded:
            raise TypeError("a data set without a size has no length; give n=, or take a slice")
        return len(self._indices)

    def __iter__(self) -> Iterator[Sample]:
        """Iterate over the samples in order; endless if the data set has no size."""
        for number in self._indices:
            yield Sample(self._source.sample(number))

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories; category id ``k`` is ``categories[k - 1]``."""
        return self._source.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration as plain dictionaries, lists, strings and numbers."""
        return self._source.config

    def relabelled(self, label_map: LabelMapLike | None = None) -> SampleSequence:
        """The same samples with the classes and objects of a label map.

        Args:
            label_map: File or dictionary with the content of ``labels.map`` of a configuration;
                None = that of this data set's configuration.

        Raises:
            ConfigError: it is invalid, or the configuration has none.
        """
        loaded = load_label_map(label_map, self.config)
        return SampleSequence(RelabelledSamples(self._source, loaded), self._indices)

    def scene_indices(self, positions: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the scenes of samples, which are cheapest to read one scene after the other.

        Args:
            positions: Indices into this sequence.
        """
        config = self._source.config
        per_scene = config.get("views_per_scene", 1) * config.get("steps_per_scene", 1)
        numbers = self._indices.start + self._indices.step * positions
        return np.asarray(numbers // per_scene)

    def close(self) -> None:
        """Release the engines; further use restarts them."""
        self._source.close()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the sequence."""
        self.close()

    @property
    def is_bounded(self) -> bool:
        """Whether it has a number of samples."""
        return self._indices.stop != UNBOUNDED.stop


class Dataset(SampleSequence):
    """Samples of a configuration, generated on access.

    Sample ``i`` depends only on the configuration, the seed and ``i``: it has the same pixels and
    labels in any order of access and in every process.

    Args:
        config: A YAML file, a shipped name such as ``tabletop.yaml``, the folder of a data set, or
            a dictionary with the same content; paths in a dictionary are relative to the current
            folder.
        seed: Replaces the configuration's seed.
        n: Number of samples; None = endless.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.
        channels: Names of additional channels for every camera, such as ``normals``.

    Raises:
        ConfigError: the configuration is wrong; the message lists all errors.

    Example:
        >>> data = Dataset("tabletop.yaml", seed=7)
        >>> data[3].cameras["color"].rgb.shape
        (480, 640, 3)
    """

    def __init__(
        self,
        config: ConfigLike,
        *,
        seed: int | None = None,
        n: int | None = None,
        overrides: Sequence[str] = (),
        without: Sequence[str] = (),
        channels: Sequence[str] = (),
    ) -> None:
        if n is not None:
            check_whole("n", n, least=0)
        loaded = load_config(config, seed=seed, overrides=overrides, without=without)
        indices = UNBOUNDED if n is None else range(n)
        super().__init__(GeneratedSamples(loaded, _parse_channels(channels)), indices)

    def __repr__(self) -> str:
        """Name and size."""
        size = f"{len(self)} samples" if self.is_bounded else "no end"
        return f"<Dataset '{self.config.get('template', '')}': {size}>"


class GeneratedSamples:
    """Samples of a pipeline in this process, which starts with the first access."""

    def __init__(self, config: Any, channels: frozenset[Channel]) -> None:
        from gen_data.generator.assemble.pipeline_factory import PipelineFactory

        self.make_pipeline = PipelineFactory(config, n=1, extra_channels=channels)
        self._pipeline: Pipeline | None = None
        self._thread_pools: tuple[int, ThreadpoolController] | None = None
        self._resources = ExitStack()

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number."""
        with self.pipeline() as pipeline:
            return pipeline.sample(index)

    @contextmanager
    def pipeline(self) -> Iterator[Pipeline]:
        """The pipeline, for computations whose bits do not depend on the surrounding program."""
        # The last bits of sums in BLAS, and so of poses, depend on the number of threads.
        with self._find_thread_pools().limit(limits=1), paused_collection():
            if self._pipeline is None:
                self._pipeline = self._resources.enter_context(self.make_pipeline())
            yield self._pipeline

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories that a sample may contain."""
        return self.make_pipeline.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration."""
        return self.make_pipeline.config.resolved

    def close(self) -> None:
        """Stop the engines."""
        self._pipeline = None
        self._resources.close()

    def _find_thread_pools(self) -> ThreadpoolController:
        """Thread pools of the loaded libraries; sought again when modules have been imported."""
        from threadpoolctl import ThreadpoolController

        modules = len(sys.modules)
        if self._thread_pools is None or self._thread_pools[0] != modules:
            self._thread_pools = modules, ThreadpoolController()
        return self._thread_pools[1]

    def __getstate__(self) -> dict[str, Any]:
        """Engines stay in their process."""
        kept = {"_pipeline": None, "_thread_pools": None, "_resources": ExitStack()}
        return {**self.__dict__, **kept}


@contextmanager
def paused_collection() -> Iterator[None]:
    """Leave reference cycles alone for the moment.

    A scene makes thousands of small objects and no cycles among them. Automatic collection would
    walk over everything in the process again and again, which takes some 5 % of the time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@dataclass(frozen=True)
class ReadSamples:
    """Samples of a finished data set, whose parts are read on access."""

    stored: StoredSamples

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number."""
        return self.stored.labelled(index)

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories."""
        return self.stored.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration of the data set."""
        return self.stored.config

    def close(self) -> None:
        """Forget what was read."""
        self.stored.close()


class StoredDataset(SampleSequence):
    """Samples of a finished data set on disk."""

    def __init__(self, folder: str | PathLike[str]) -> None:
        stored = open_stored(folder)
        super().__init__(ReadSamples(stored), range(stored.n))
        self.folder = stored.folder

    def __repr__(self) -> str:
        """Folder and size."""
        return f"<StoredDataset '{self.folder}': {len(self)} samples>"


def open_dataset(folder: str | PathLike[str]) -> StoredDataset:
    """Open a finished data set in a folder or at a URL; its samples equal the generated ones.

    Colours, ids and labels are exact; other quantities have the resolution of their files.
    Shards at a URL are copied to a cache in the user's cache folder when their samples are read.

    Raises:
        StorageError: the folder holds no finished data set.
    """
    return StoredDataset(path_text("folder", folder))


def _parse_channels(names: Sequence[str]) -> frozenset[Channel]:
    from gen_data.generator.core.capture import Channel

    known = {channel.value: channel for channel in Channel if channel is not Channel.AMODAL}
    for name in names:
        if name not in known:
            raise ConfigError(
                f"channels: unknown channel '{name}'; expected some of {', '.join(known)}"
                f"{did_you_mean(name, known)}"
            )
    return frozenset(known[name] for name in names)
