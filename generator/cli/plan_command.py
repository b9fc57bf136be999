"""``gen-data plan``: what a run would make, without making it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from gen_data.generator.cli.options import ConfigurationOptions, configuration_options

if TYPE_CHECKING:
    from gen_data.generator.assemble.config import Config


@click.command("plan")
@click.argument("source", metavar="CONFIG")
@click.option("--n", "-n", type=click.IntRange(min=1), required=True, help="Number of samples.")
@click.option(
    "--probe", type=click.IntRange(min=1), help="Generate so many samples to measure time and size."
)
@configuration_options
def plan(
    source: str,
    n: int,
    probe: int | None,
    seed: int | None,
    overrides: tuple[str, ...],
    without: tuple[str, ...],
) -> None:
    """Print shards, size, categories and exports of a data set, without rendering it.

    With --probe, a few samples are generated in a temporary folder and removed again; without it
    sizes are estimates from the sizes of images, and no time is printed.
    """
    from rich.console import Console
    from rich.table import Table

    choice = ConfigurationOptions(source, seed, overrides, without)
    config = choice.config()
    table = Table(title=f"{config.name}: {n} samples", show_header=False)
    for name, value in _rows(config, n):
        table.add_row(name, value)
    if probe is not None:
        for name, value in _measured(
            ConfigurationOptions(source, seed, overrides, without), n, probe
        ):
            table.add_row(name, value)
    console = Console()
    Console(width=None if console.is_terminal else 120).print(table)


def _rows(config: Config, n: int) -> Iterator[tuple[str, str]]:
    from gen_data.generator.assemble.pipeline_factory import (
        PipelineFactory,
        dataset_info,
        ready_exporters,
    )
    from gen_data.generator.assemble.size_estimate import estimate_image_bytes
    from gen_data.generator.assets.library import open_library
    from gen_data.generator.config.schema import docstring_summary
    from gen_data.generator.pipeline.splits import split_of

    general = config.general
    per_scene = general.views_per_scene * general.steps_per_scene
    scenes = -(-n // per_scene)
    info = dataset_info(config, n, PipelineFactory(config, n).categories)
    # Refused here as in a run: formats that cannot hold the data set.
    exporters = ready_exporters(config, info, open_library(config.asset_folders))
    yield (
        "scenes",
        f"{scenes} of {general.views_per_scene} views, {general.steps_per_scene} instants",
    )
    yield "shards", f"{-(-n // general.shard_size)} of {general.shard_size} samples"
    counted = min(scenes, 10_000)
    splits = Counter(
        split_of(k, config.split_shares, general.splits.assign, general.seed)
        for k in range(counted)
    )
    yield (
        "splits",
        ", ".join(f"{name} {splits[name] / counted:.0%}" for name in config.split_shares),
    )
    for sensor in info.sensors:
        channels = ", ".join(c.value for c in sensor.channels) or sensor.kind or "points"
        yield f"sensor {sensor.name}", f"{sensor.modality.value}: {channels}"
    yield "categories", f"{len(info.categories)}: {', '.join(info.categories)}"
    for name, exporter in exporters.items():
        own = next(e for e in config.exporters if e.type == exporter.type)
        yield f"export {name}", docstring_summary(type(own))
    yield "size, estimated", f"{estimate_image_bytes(config, info) * n / 1e9:.2f} GB of images"


def _measured(choice: ConfigurationOptions, n: int, probe: int) -> Iterator[tuple[str, str]]:
    """Time and size of a run, from a few samples in a temporary folder."""
    import os

    from gen_data.generator.api.generate import generate
    from gen_data.generator.core.temporary_folders import temporary_folder

    with temporary_folder("plan") as folder:
        summary = generate(
            choice.source,
            probe,
            out=folder / "probe",
            workers=0,
            seed=choice.seed,
            overrides=(*choice.overrides, "splits={train: 1, val: 0, test: 0}"),
            without=choice.without,
        )
        files = [p for p in (folder / "probe").rglob("*") if p.is_file() and "run" not in p.parts]
        # Hard links of exports take no space.
        size = sum({p.stat().st_ino: p.stat().st_size for p in files}.values())
    cores = len(os.sched_getaffinity(0))
    cpu_s = sum(summary.cpu_s.values()) if summary.cpu_s else 0.0
    yield (
        "size, measured",
        f"{size / probe * n / 1e9:.2f} GB ({size / probe / 1e3:.0f} kB per sample)",
    )
    yield "CPU, measured", f"{cpu_s * n / 3600:.2f} h ({cpu_s:.2f} s per sample)"
    yield f"time on {cores} cores", f"{cpu_s * n / 3600 / cores:.2f} h"
