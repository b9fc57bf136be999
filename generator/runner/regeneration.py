"""Pipelines that make the samples of an existing data set again: by generation or rendering."""

import ast
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gen_data.assemble.config import parse_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.config.yaml_scalars import json_as_yaml
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.temporary_folders import temporary_folder
from gen_data.runner import finalize, rerender
from gen_data.runner.identity import format_licences, make_plan
from gen_data.runner.layout import PLAN_NAME
from gen_data.runner.plan import Plan, compare_plans
from gen_data.runner.sample_stages import Difference, SampleFiles, compare_samples
from gen_data.runner.shard import EnteredPipeline, PipelineLike, write_images, write_records
from gen_data.runner.store import LocalStore
from gen_data.runner.stored import StoredSamples


@dataclass(frozen=True)
class Regeneration:
    """The means to make a data set again.

    Attributes:
        plan: This installation's plan: its versions may differ from the data set's.
        make_pipeline: Makes the pipeline in any process.
        licences: Formats the licences of assets.
        changes: Differences of ``plan`` from the plan of the data set, one line per field; without
            any, the bytes will be the same.
    """

    plan: Plan
    make_pipeline: Callable[[], EnteredPipeline]
    licences: finalize.LicencesOf
    changes: tuple[str, ...]


def plan_regeneration(folder: Path, plan: Plan, source: Path | None = None) -> Regeneration:
    """Plan to make the samples of a data set again.

    Args:
        folder: Folder of the data set, for messages.
        plan: Plan of the data set.
        source: The data set whose scenes were rendered again, if it was made like that.

    Raises:
        ConfigError: its configuration is not valid here, or ``source`` is missing or another one.
        AssetError: an asset is missing.
    """
    config = parse_config(json_as_yaml(plan.config), str(folder / PLAN_NAME), plan.name)
    if not plan.scenes_of:
        factory = PipelineFactory(config, plan.n)
        made = make_plan(factory)
        licences = partial(format_licences, factory)
        return Regeneration(made, factory, licences, tuple(compare_plans(plan, made)))
    wanted, _, redrawn = plan.scenes_of.partition(" ")
    if source is None:
        raise ConfigError(
            f"{folder}: its scenes come from another data set, {wanted[:16]}, which is needed "
            "to make its samples again; name its folder with --source"
        )
    stored = StoredSamples(source)
    if stored.dataset_id != wanted:
        raise ConfigError(
            f"--source {source}: is the data set {stored.dataset_id[:16]}; expected {wanted[:16]}, "
            f"whose scenes {folder} has"
        )
    was = parse_config(json_as_yaml(stored.plan.config), str(source / PLAN_NAME), plan.name)
    made, maker = rerender.rerender_plan(stored, was, config, ast.literal_eval(redrawn))
    licences = partial(format_licences, maker.factory)
    return Regeneration(made, maker, licences, tuple(compare_plans(plan, made)))


def compare_regenerated(
    store: LocalStore,
    plan: Plan,
    regeneration: Regeneration,
    indices: Sequence[int],
    semantic: bool = False,
) -> Iterator[Difference]:
    """Make samples of a data set again, and yield the first difference of each one that differs.

    Raises:
        StorageError: a stored file is missing or damaged.
        SampleError: a sample cannot be generated.
    """
    with ExitStack() as stack:
        pipeline = stack.enter_context(regeneration.make_pipeline())
        for index in indices:
            with temporary_folder("regenerated") as folder:
                again = write_alone(pipeline, index, folder)
                stored = SampleFiles(store.shard_dir(index // plan.shard_size), index)
                difference = compare_samples(stored, again, semantic)
            if difference is not None:
                yield difference


def write_alone(pipeline: PipelineLike, index: int, folder: Path) -> SampleFiles:
    """Generate one sample, and write it to an empty folder as the only one of a shard.

    Raises:
        SampleError: it cannot be generated.
    """
    sample = pipeline.sample(index)
    write_images(pipeline.info, sample, folder)
    write_records(sample, None, folder)
    return SampleFiles(folder, index)


def refuse_changes(folder: Path, changes: tuple[str, ...], purpose: str) -> None:
    """Refuse to go on if this installation makes other bytes than the data set's.

    Raises:
        StorageError: names the differences.
    """
    if changes:
        listed = "\n".join(f"  {line}" for line in changes[:20])
        more = f"\n  and {len(changes) - 20} more" if len(changes) > 20 else ""
        raise StorageError(
            f"{folder}: this installation cannot {purpose}, because it would make other bytes; "
            f"nothing was changed:\n{listed}{more}\n"
            "  Install the versions of the data set, or restore its assets"
        )
