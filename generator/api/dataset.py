"""Data sets as lazy sequences of samples."""

from __future__ import annotations

import copy
import gc
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from gen_data.api.config import ConfigLike, check_whole, load_config
from gen_data.api.relabelling import LabelMapLike, RelabelledSamples, load_label_map
from gen_data.api.sample import Sample, SampleRecord, SampleSource
from gen_data.core import errors
from gen_data.runner.stored_objects import open_stored

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.core.capture import Channel
    from gen_data.pipeline import Pipeline
    from gen_data.pipeline.splits import Splits
    from gen_data.runner.stored import StoredSamples

Self = TypeVar("Self", bound="SampleSequence")

UNBOUNDED = range(sys.maxsize)
"""Indices of a data set without a size."""

ALL = "all"
"""All splits, chosen on purpose."""


class SampleSequence(Sequence[Sample], AbstractContextManager["SampleSequence", None]):
    """Samples by index. Slices are lazy sequences over the same source.

    Iteration, ``len``, negative indices and ``in`` work as for a list. A pickled sequence gives the
    same samples in another process.
    """

    def __init__(
        self, source: SampleSource, indices: range | SplitIndices, split: str = ""
    ) -> None:
        self._source = source
        self._indices = indices
        self._split = split

    @overload
    def __getitem__(self, index: int) -> Sample: ...

    @overload
    def __getitem__(self: Self, index: slice) -> Self: ...

    def __getitem__(self: Self, index: int | slice) -> Sample | Self:
        """One sample, or a sequence for a slice.

        Raises:
            SampleIndexError: the index is out of range; it is also an IndexError.
            SampleError: the sample cannot be generated.
            IndexKindError: the index is not a whole number; it is also a TypeError.
        """
        if isinstance(index, slice):
            part = copy.copy(self)
            part._indices = self._indices[index]
            return part
        _check_index(index)
        if index < 0 and not self.is_bounded:
            raise errors.SampleIndexError(
                f"index {index}: a data set without a size has no end; give n="
            )
        try:
            number = self._indices[index]
        except IndexError:
            raise errors.SampleIndexError(
                f"index {index} is out of range for {len(self._indices)} samples"
            ) from None
        return Sample(self._source.sample(number))

    def __len__(self) -> int:
        """Number of samples. Raises TypeError if the data set has no size."""
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

    def split(self: Self, name: str) -> Self:
        """The samples of one split, in their order; all views of a scene are in one split.

        Args:
            name: ``train``, ``val`` or ``test``; or ``all``, for all samples on purpose, of which
                loaders do not warn.

        Raises:
            UnknownNameError: the configuration has no such split.

        Warns:
            ConfigWarning: no sample is in it.
        """
        part = copy.copy(self)
        part._split = name
        if name == ALL:
            return part
        splits = self._splits
        known = [*splits.shares, ALL]
        if name not in known:
            is_empty = name in ("train", "val", "test")
            raise errors.UnknownNameError(
                f"there is no split '{name}'{': its share is 0' if is_empty else ''}; expected one "
                f"of {', '.join(known)}{'' if is_empty else errors.did_you_mean(str(name), known)}"
            )
        is_in = SplitTest(splits, self.config.get("seed", 0), self._samples_per_scene, name)
        part._indices = SplitIndices(self._indices, is_in)
        if part.is_bounded and not len(part):
            text = f"split '{name}': none of the {len(self)} samples is in it"
            warnings.warn(text, errors.ConfigWarning, stacklevel=2)
        return part

    def _select(self, split: str) -> None:
        """Keep the samples of a split; empty = all."""
        if split:
            chosen = self.split(split)
            self._indices, self._split = chosen._indices, chosen._split

    @property
    def _split_note(self) -> str:
        return f", {self._split}" if self._split else ""

    def warn_of_mixed_splits(self) -> None:
        """Warn with a ConfigWarning if samples of several splits are here, and none was chosen."""
        splits = self._splits
        names = list(splits.shares)
        if self._split or len(names) == 1:
            return
        if self.is_bounded:
            scenes = np.unique(self.scene_indices(np.arange(len(self)))).tolist()
            found = (splits.of_scene(scene, self.config.get("seed", 0)) for scene in scenes)
            first = next(found, "")
            if all(split == first for split in found):
                return
        warnings.warn(
            f"samples of the splits {', '.join(names[:-1])} and {names[-1]} are mixed; expected "
            f"one split: data.split('{names[0]}'); data.split('all') mixes them on purpose",
            errors.ConfigWarning,
            stacklevel=3,
        )

    def relabelled(self, label_map: LabelMapLike | None = None) -> SampleSequence:
        """The same samples with the classes and objects of a label map.

        Args:
            label_map: File or dictionary with the content of ``labels.map`` of a configuration;
                None = the map of this data set's configuration.

        Raises:
            ConfigError: it is invalid, or the configuration has none.
        """
        loaded = load_label_map(label_map, self.config)
        return SampleSequence(RelabelledSamples(self._source, loaded), self._indices, self._split)

    def scene_indices(self, positions: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the scenes of samples, which are cheapest to read one scene after the other.

        Args:
            positions: Indices into this sequence.
        """
        if isinstance(self._indices, range):
            numbers = self._indices.start + self._indices.step * positions
        else:
            numbers = np.array([self._indices[k] for k in positions.tolist()], np.int64)
        return np.asarray(numbers // self._samples_per_scene)

    @property
    def _samples_per_scene(self) -> int:
        count: int = self.config.get("views_per_scene", 1) * self.config.get("steps_per_scene", 1)
        return 2 * count if self.config.get("twins") else count

    @property
    def _splits(self) -> Splits:
        from gen_data.pipeline.splits import Splits

        return Splits(**self.config.get("splits", {}))

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


@dataclass(frozen=True)
class SplitTest:
    """Whether a sample of a configuration is in a split; picklable."""

    splits: Splits
    seed: int
    samples_per_scene: int
    split: str

    def __call__(self, number: int) -> bool:
        """Whether the sample is in it."""
        return self.splits.of_scene(number // self.samples_per_scene, self.seed) == self.split


@dataclass(frozen=True)
class IsPresent:
    """Whether a sample did not fail; picklable."""

    absent: frozenset[int]

    def __call__(self, number: int) -> bool:
        """Whether the sample exists."""
        return number not in self.absent


class SplitIndices(Sequence[int]):
    """Some of the indices, such as the samples of one split; picklable, and possibly endless.

    Args:
        indices: Numbers of samples.
        is_in: Whether a sample is among them.
    """

    def __init__(self, indices: range | SplitIndices, is_in: SplitTest | IsPresent) -> None:
        self._indices, self._is_in = indices, is_in
        self._found: list[int] = []
        self._sought = 0
        self._positions = UNBOUNDED
        if indices.stop != UNBOUNDED.stop:
            self._seek(len(indices))
            self._positions = range(len(self._found))

    @property
    def stop(self) -> int:
        """As of a range: the stop of ``UNBOUNDED`` if there is no end."""
        return self._positions.stop

    def __len__(self) -> int:
        """Number of indices."""
        return len(self._positions)

    @overload
    def __getitem__(self, index: int) -> int: ...

    @overload
    def __getitem__(self, index: slice) -> SplitIndices: ...

    def __getitem__(self, index: int | slice) -> int | SplitIndices:
        """One index, or the indices of a slice."""
        if isinstance(index, slice):
            part = copy.copy(self)
            part._positions = self._positions[index]
            return part
        position = self._positions[index]
        while position >= len(self._found):
            self._seek(2 * self._sought + 64)
        return self._found[position]

    def _seek(self, end: int) -> None:
        """Look through the given indices up to a position."""
        new = (self._indices[k] for k in range(self._sought, end))
        self._found.extend(number for number in new if self._is_in(number))
        self._sought = max(self._sought, end)


def _check_index(index: Any) -> None:
    """Refuse an index that is not a whole number; for a name, the text has the remedy."""
    if not hasattr(index, "__index__") or isinstance(index, bool):
        remedy = f"; .split({index!r}) has the samples of a split" if isinstance(index, str) else ""
        raise errors.IndexKindError(f"index: {index!r}; expected a whole number or a slice{remedy}")


class Dataset(SampleSequence):
    """Samples of a configuration, generated on access.

    Sample ``i`` depends only on the configuration, the seed and ``i``: it has the same pixels and
    labels in any order of access and in every process.

    Args:
        config: A YAML file, a shipped name such as ``tabletop.yaml``, the folder of a data set, or
            a dictionary with the same content; paths in a dictionary are relative to the current
            folder.
        seed: Replaces the configuration's seed.
        n: Number of samples, of all splits together; None = endless.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.
        channels: Names of additional channels for every camera, such as ``normals``.
        split: Only the samples of this split; see ``SampleSequence.split``. Empty = all.

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
        split: str = "",
    ) -> None:
        if n is not None:
            check_whole("n", n, least=0)
        loaded = load_config(config, seed=seed, overrides=overrides, without=without)
        indices = UNBOUNDED if n is None else range(n)
        from gen_data.assemble.pipeline_factory import PipelineFactory

        factory = PipelineFactory(loaded, n=1, extra_channels=_parse_channels(channels))
        super().__init__(GeneratedSamples(factory), indices)
        self._select(split)

    def __repr__(self) -> str:
        """Name and size."""
        size = f"{len(self)} samples" if self.is_bounded else "no end"
        return f"<Dataset '{self.config.get('template', '')}'{self._split_note}: {size}>"


class GeneratedSamples:
    """Samples of a pipeline in this process, which starts with the first access."""

    def __init__(self, make_pipeline: PipelineFactory) -> None:
        self.make_pipeline = make_pipeline
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
        """Forget the samples that were read."""
        self.stored.close()


class StoredDataset(SampleSequence):
    """Samples of a finished data set on disk."""

    def __init__(self, folder: str | PathLike[str], split: str = "") -> None:
        stored = open_stored(folder)
        every: range | SplitIndices = range(stored.plan.n)
        if stored.failed:
            absent = frozenset(failure.index for failure in stored.failed)
            every = SplitIndices(every, IsPresent(absent))
        super().__init__(ReadSamples(stored), every)
        self.folder = stored.folder
        self._select(split)

    def __repr__(self) -> str:
        """Folder and size."""
        return f"<StoredDataset '{self.folder}'{self._split_note}: {len(self)} samples>"


def _parse_channels(names: Sequence[str]) -> frozenset[Channel]:
    from gen_data.core.capture import Channel

    known = {channel.value: channel for channel in Channel if channel.is_image}
    for name in names:
        if name not in known:
            raise errors.ConfigError(
                f"channels: unknown channel '{name}'; expected some of {', '.join(known)}"
                f"{errors.did_you_mean(name, known)}"
            )
    return frozenset(known[name] for name in names)
