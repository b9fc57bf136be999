"""One sample on disk: the function behind ``gen-data sample``."""

import shutil
import tempfile
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from gen_data.api.config import ConfigLike, load_config
from gen_data.core.errors import ConfigError, StorageError


def write_sample(
    config: ConfigLike,
    index: int,
    out: str | PathLike[str],
    *,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
) -> Path:
    """Generate one sample of a configuration or data set, and write it in all of its formats.

    Its files have the same bytes as in the whole data set, whatever the number of samples there.

    Args:
        config: See ``Dataset``.
        index: Number of the sample, from 0.
        out: New or empty folder. ``sample/`` is a shard with this sample only; every exporter adds
            a folder.
        seed: Replaces the configuration's seed.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.

    Returns:
        The folder.

    Raises:
        ConfigError: the configuration or the index is wrong.
        StorageError: the folder is not empty, or cannot be written.
        SampleError: the sample cannot be generated.
    """
    from threadpoolctl import threadpool_limits

    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.durable_files import storage_errors
    from gen_data.runner.shard import drop_pixels, write_images, write_records

    if index < 0:
        raise ConfigError(f"index: {index} is negative; expected 0 or more")
    folder = Path(out)
    loaded = load_config(config, seed=seed, overrides=overrides, without=without)
    with threadpool_limits(limits=1), storage_errors(folder, ""):
        if folder.exists() and any(folder.iterdir()):
            raise StorageError(f"{folder}: is not empty; choose another folder with --out")
        with PipelineFactory(loaded, n=index + 1)() as pipeline:
            sample = pipeline.sample(index)
            folder.parent.mkdir(parents=True, exist_ok=True)
            unfinished = Path(tempfile.mkdtemp(prefix=".sample-", dir=folder.parent))
            try:
                shard_dir = unfinished / "sample"
                shard_dir.mkdir()
                write_images(pipeline.info, sample, shard_dir)
                write_records(sample, None, shard_dir)
                for name, exporter in pipeline.exporters.items():
                    exporter.write_shard(pipeline.info, [drop_pixels(sample)], shard_dir)
                    exporter.finalize(pipeline.info, [shard_dir], unfinished / name)
                    shutil.rmtree(shard_dir / name, ignore_errors=True)
                if folder.exists():
                    folder.rmdir()
                unfinished.rename(folder)
            finally:
                shutil.rmtree(unfinished, ignore_errors=True)
    return folder
