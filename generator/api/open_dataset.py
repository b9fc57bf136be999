"""``gen_data.open``: finished data sets, and recipes, whose samples are rendered when read."""

from __future__ import annotations

from functools import cached_property, partial
from os import PathLike
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from gen_data.api.config import check_whole, path_text
from gen_data.api.dataset import (
    GeneratedSamples,
    IsPresent,
    SampleSequence,
    SplitIndices,
    StoredDataset,
)
from gen_data.core import urls

if TYPE_CHECKING:
    from gen_data.api.sample import SampleRecord
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.core.interfaces import DatasetInfo
    from gen_data.core.scene import Scene
    from gen_data.runner.provenance import KeptScene
    from gen_data.runner.sample_cache import Files, SampleCache


def open_dataset(
    source: str | PathLike[str],
    split: str = "",
    *,
    cache_bytes: int | None = None,
    trust: bool = False,
) -> SampleSequence:
    """Open a finished data set or a recipe; its samples equal the generated ones.

    Colours, ids and labels are exact; other quantities have the resolution of their files.
    Shards at a URL, and samples of a recipe, are kept in the user's cache folder when they are
    read. A sample of a recipe is rendered when it is read for the first time.

    Args:
        source: Folder of the data set, or its URL; or the file of a recipe.
        split: Only the samples of this split; see ``SampleSequence.split``. Empty = all.
        cache_bytes: Bound of the samples of all recipes on disk, the least recently used of which
            are removed; None = 20 GB. Of a recipe only.
        trust: Read folders of assets outside of the recipe's own folder; see ``pull``.

    Raises:
        StorageError: the folder holds no finished data set.
        UnknownNameError: its configuration has no such split.
        ConfigError, AssetError, DeterminismError: the recipe is wrong, or this installation has
            other assets or versions; see ``pull``.
    """
    place = path_text("source", source)
    if urls.is_url(place) or not Path(place).is_file():
        return StoredDataset(place, split)
    from gen_data.api.recipes import prepare
    from gen_data.runner import sample_cache
    from gen_data.runner.recipe import read_recipe

    if cache_bytes is not None:
        check_whole("cache_bytes", cache_bytes, 0)
    file = read_recipe(Path(place))
    factory, plan = prepare(file, False, trust)
    most = sample_cache.MAX_BYTES if cache_bytes is None else cache_bytes
    folder = sample_cache.sample_cache_dir()
    cache = sample_cache.SampleCache(sample_cache.content_of(plan), most, folder)
    numbers: range | SplitIndices = range(plan.n)
    if file.recipe.failed:
        numbers = SplitIndices(numbers, IsPresent(frozenset(file.recipe.failed)))
    samples = SampleSequence(RecipeSamples(factory, cache), numbers)
    return samples.split(split) if split else samples


class RecipeSamples(GeneratedSamples):
    """Samples of a recipe, from the cache or rendered."""

    def __init__(self, make_pipeline: PipelineFactory, cache: SampleCache) -> None:
        super().__init__(make_pipeline)
        self.cache = cache

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number, as it would be read from the finished data set."""
        from gen_data.runner.labels import LABELS_NAME, parse_labels
        from gen_data.runner.stored import LabelledImages, read_capture

        files = self.cache.find(index) or self._render(index)
        path = self.cache.path(index)

        def read(place: PurePath) -> bytes:
            return bytes(files[place.relative_to(path).as_posix()])

        labels = parse_labels(bytes(files[LABELS_NAME]))
        capture = read_capture(self.info, labels, path, read=read)
        return LabelledImages(partial(_parse_scene, files), labels, capture, self.info.cameras)

    def _render(self, index: int) -> Files:
        from gen_data.core.temporary_folders import temporary_folder
        from gen_data.runner.shard import write_images, write_records

        with self.pipeline() as pipeline, temporary_folder("sample") as folder:
            sample = pipeline.sample(index)
            write_images(pipeline.info, sample, folder)
            write_records(sample, None, folder)
            return self.cache.add(index, folder)

    @cached_property
    def info(self) -> DatasetInfo:
        """Facts about the data set."""
        return self.make_pipeline.info


def _parse_scene(files: Files, index: int) -> KeptScene:
    from gen_data.runner.provenance import SCENES_NAME, parse_scene

    def other_scene(base: int) -> Scene:
        raise AssertionError(f"sample {index} is complete, and needs no sample {base}")

    return parse_scene(bytes(files[SCENES_NAME]), other_scene)
