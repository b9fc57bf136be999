"""Assets of a configuration, prepared ahead of its first run."""

from collections.abc import Callable, Sequence

from gen_data.api.config import ConfigLike, load_config


def prepare_assets(
    config: ConfigLike,
    *,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
    on_progress: Callable[[str, int, int], None] | None = None,
) -> int:
    """Make and store everything that a configuration can use, as ``gen-data assets prepare`` does.

    Args:
        config: See ``Dataset``.
        seed: Replaces the configuration's seed.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.
        on_progress: Called before each asset with its id, its number from 0 and the number of all.

    Returns:
        Number of assets; assets that the cache folder has are only read.

    Raises:
        ConfigError: the configuration is wrong.
        AssetError: an asset cannot be made or read.
    """
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.prepare import prepare_assets as prepare

    loaded = load_config(config, seed=seed, overrides=overrides, without=without)
    return prepare(PipelineFactory(loaded, n=1), on_progress or _ignore)


def _ignore(asset_id: str, number: int, count: int) -> None:
    del asset_id, number, count
