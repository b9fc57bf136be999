"""Generation of a data set on disk: the function behind ``gen-data --config ... --n ...``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.api.config import ConfigLike, check_whole, count_workers, load_config
from gen_data.api.label_gaps import check_label_gaps
from gen_data.core import errors, urls

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.plan import Plan
    from gen_data.runner.processes import Pool, StandbyWorker
    from gen_data.runner.progress import RunProgress, Summary
    from gen_data.runner.ray_cluster import RayCluster
    from gen_data.runner.run import Settings
    from gen_data.runner.shard import Job


def generate(  # noqa: PLR0913  (keywords of one front door)
    config: ConfigLike,
    n: int,
    *,
    out: str | PathLike[str] | None = None,
    workers: int | None = None,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
    repair: bool = False,
    allow_mixed_numerics: bool = False,
    force: bool = False,
    skip_failed: bool = False,
    sample_timeout_s: float | None = None,
    shards: tuple[int, int] | None = None,
    cluster: RayCluster | None = None,
    on_progress: Callable[[RunProgress], None] | None = None,
    resume_command: str = "the same call of gen_data.generate",
) -> Summary:
    """Generate a data set, or the missing part of an unfinished one.

    Args:
        config: See ``Dataset``.
        n: Number of samples, at least 1.
        out: Folder, or URL such as ``s3://bucket/set``; None = ``out/<name of configuration>``.
        workers: Processes; None = one per core, 0 = this process. The bytes do not depend on it.
            On a cluster, None = as many as its machines can hold when the run starts.
        seed: Replaces the configuration's seed.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.
        repair: Hash all existing files first, and restore damaged ones.
        allow_mixed_numerics: Go on on a machine that computes differently from the first one.
        force: Start although the disk is probably too small.
        skip_failed: Go on without samples that fail; ``failed`` of the summary and of the manifest
            names them, and only ``repair`` tries them again.
        sample_timeout_s: Time after which a sample hangs [s]: no second try. None = the
            configuration's, or else 300 s and 3 tries. Not with ``workers=0``.
        shards: First shard and the one after the last, for a part of the data set in a folder of
            its own; ``merge`` gathers the parts. None = all.
        cluster: Ray cluster that generates the shards; None = processes of this machine.
        on_progress: Called after each sample and shard.
        resume_command: Command that error messages give for resuming; empty = there is none.

    Returns:
        Summary of the run, with identity and folder of the data set.

    Raises:
        ConfigError: the configuration or an argument is wrong.
        GenDataError: any other failure; see ``gen_data.core.errors``.
        Interrupted: Ctrl-C or SIGTERM; finished shards are kept.
        NoLabels: labels were asked for, and no sample has one; the data set is finished.

    Warns:
        ConfigWarning: ``n`` is so small that a split of the configuration stays empty; or a sensor,
            or a class of the label map, has no label.
        AssetWarning: a file of the user holds something that is not used, such as a skeleton.
    """
    with standby_worker(cluster, workers) as standby:
        check_arguments(config, n, out, workers, repair)
        _check_time_limit(sample_timeout_s)
        # Before the imports below: errors of a configuration come at once.
        loaded = load_config(config, seed=seed, overrides=overrides, without=without)
        factory = make_factory(loaded, n)
        settings = replace(
            make_settings(factory, skip_failed, sample_timeout_s),
            resume_command=resume_command,
            progress=on_progress,
            repair=repair,
            allow_mixed_numerics=allow_mixed_numerics,
            is_forced=force,
        )
        return run_factory(factory, settings, standby, RunChoice(out, workers, shards, cluster))


@dataclass(frozen=True)
class RunChoice:
    """Where and how a data set is generated; see ``generate``."""

    out: str | PathLike[str] | None
    workers: int | None
    shards: tuple[int, int] | None
    cluster: RayCluster | None


def run_factory(
    factory: PipelineFactory,
    settings: Settings,
    standby: StandbyWorker | None,
    choice: RunChoice,
    plan: Plan | None = None,
) -> Summary:
    """Generate the data set of a checked factory; see ``generate``. Without a plan it makes one."""
    from gen_data.runner.identity import make_plan

    with (
        _opened(choice.cluster, choice.workers, standby) as (pool, workers),
        _folder(factory.config, choice.out) as folder,
    ):
        plan = plan or make_plan(factory)
        shards = choice.shards and check_shards(choice.shards, plan.shard_count)
        settings = replace(settings, workers=workers, open_pool=pool, shards=shards)
        summary = _run(factory, plan, folder, settings)
    return check_label_gaps(summary)


def _run(factory: PipelineFactory, plan: Plan, folder: Path | str, settings: Settings) -> Summary:
    """Run the plan of a factory, and name unused contents of the user's files."""
    from gen_data.assets.file_remarks import warn_of_remarks
    from gen_data.runner.identity import format_licences
    from gen_data.runner.run import run

    told = warn_of_remarks(factory.library, plan.assets)
    summary = run(plan, factory, folder, settings, partial(format_licences, factory))
    # Of files that workers were the first to read.
    warn_of_remarks(factory.library, plan.assets, read_max=0, told=told)
    return summary


def make_settings(
    factory: PipelineFactory, skip_failed: bool, sample_timeout_s: float | None
) -> Settings:
    """Settings of a run, with the size of a sample and the configuration's own limits."""
    from gen_data.assemble.size_estimate import estimate_sample_bytes
    from gen_data.runner.run import Limits, Settings

    general = factory.config.general
    return Settings(
        sample_bytes=estimate_sample_bytes(factory.config, factory.info),
        skip_failed=skip_failed or general.skip_failed,
        limits=Limits(sample_s=sample_timeout_s or general.sample_timeout_s),
    )


@contextmanager
def standby_worker(
    cluster: RayCluster | None, workers: int | None
) -> Iterator[StandbyWorker | None]:
    """The first worker of this machine, which prepares itself during planning; None if unused."""
    from gen_data.runner.processes import StandbyWorker

    if cluster is not None or count_workers(workers) == 0:
        yield None
        return
    with StandbyWorker() as standby:
        yield standby


@contextmanager
def _folder(loaded: Config, out: str | PathLike[str] | None) -> Iterator[Path | str]:
    """Folder or URL of the data set; a finished run remembers its asset folders in a folder."""
    from gen_data.config.paths import write_locations
    from gen_data.runner.store import LocalStore

    folder = fspath(out) if out is not None else Path("out") / loaded.name
    yield folder
    if not urls.is_url(folder):
        store = LocalStore(Path(folder))
        with store.errors():
            write_locations(store.run_dir, loaded.asset_locations)


@contextmanager
def _opened(
    cluster: RayCluster | None, workers: int | None, standby: StandbyWorker | None
) -> Iterator[tuple[Callable[[Job], Pool], int]]:
    from threadpoolctl import threadpool_limits

    from gen_data.runner.processes import open_worker_pool

    if cluster is not None and workers == 0:
        raise errors.ConfigError("workers: 0 on a cluster; expected at least 1, or no number")
    with threadpool_limits(limits=1):
        if cluster is None:
            yield partial(open_worker_pool, standby=standby), count_workers(workers)
            return
        with cluster.connected():
            yield cluster.open_pool, workers or cluster.worker_count()


def check_arguments(
    config: ConfigLike, n: int, out: str | PathLike[str] | None, workers: int | None, repair: bool
) -> None:
    """Refuse wrong numbers, repair at a URL, and a folder in which another run writes."""
    from gen_data.runner.object_store import open_store

    check_whole("n", n)
    if n < 1:
        raise errors.ConfigError(f"n: {n} samples cannot be made; expected at least 1")
    count_workers(workers)
    if repair and out is not None and urls.is_url(out):
        raise errors.ConfigError(
            f"out: {fspath(out)} cannot be repaired in place; expected a folder: run the command "
            "without repair, which replaces damaged shards, or repair a copy"
        )
    open_store(_guess_folder(config, out)).check_unlocked()


def _check_time_limit(limit_s: float | None) -> None:
    if limit_s is not None and not 0.0 < limit_s < math.inf:
        raise errors.ConfigError(
            f"sample_timeout_s: {limit_s:g} is not a time limit; expected seconds above 0"
        )


def make_factory(loaded: Config, n: int) -> PipelineFactory:
    """A checked factory of pipelines; warns of splits that stay empty."""
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.pipeline.splits import warn_of_empty_splits
    from gen_data.sensors.mounting import warn_of_early_readings

    general, stated = loaded.general, loaded.document.get("splits")
    scenes = -(-n // general.samples_per_scene)
    warn_of_empty_splits(
        scenes,
        loaded.split_shares,
        general.splits.assign,
        general.seed,
        stated=stated is not None and bool(stated.content),
    )
    warn_of_early_readings(loaded.sensors, general.steps_per_scene)
    factory = PipelineFactory(loaded, n)
    factory.check()
    return factory


def check_shards(shards: tuple[int, int], count: int) -> range:
    """The range of shards that exist. Raises ConfigError if there are none."""
    first, end = shards
    if not 0 <= first < min(end, count):
        raise errors.ConfigError(
            f"shards: {first}:{end} are none of the {count} shards; expected FIRST:END with "
            f"0 <= FIRST < {count} and END above FIRST"
        )
    return range(first, min(end, count))


def _guess_folder(config: ConfigLike, out: str | PathLike[str] | None) -> str | PathLike[str]:
    """Folder of the data set, as far as it is known before the configuration is read."""
    if out is not None:
        return out
    return Path("out") / ("config" if isinstance(config, Mapping) else Path(config).stem)
