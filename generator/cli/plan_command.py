"""``gen-data plan``: what a run would make, without making it."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from gen_data.generator.cli.cost_estimate import Prices, Probe, estimate_rows
from gen_data.generator.cli.options import ConfigurationOptions, configuration_options
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.system_calls import usable_cores

if TYPE_CHECKING:
    from gen_data.generator.assemble.config import Config
    from gen_data.generator.runner.progress import RunProgress


@click.command("plan")
@click.argument("source", metavar="CONFIG")
@click.option("--n", "-n", type=click.IntRange(min=1), required=True, help="Number of samples.")
@click.option(
    "--probe", type=click.IntRange(min=1), help="Generate so many samples to measure time and size."
)
@click.option("--price-per-cpu-hour", type=float, help="Price of a core; needs --probe.")
@click.option("--price-per-gpu-hour", type=float, help="Price of a GPU; needs --probe.")
@click.option("--price-per-gb-month", type=float, help="Price of storage; needs --probe.")
@configuration_options
def plan(
    source: str,
    n: int,
    probe: int | None,
    price_per_cpu_hour: float | None,
    price_per_gpu_hour: float | None,
    price_per_gb_month: float | None,
    seed: int | None,
    overrides: tuple[str, ...],
    without: tuple[str, ...],
) -> None:
    """Print shards, size, categories and exports of a data set, without rendering it.

    With --probe, a few samples are generated in a temporary folder and removed again, and hours
    and files are extrapolated from them; without it sizes are estimates from the sizes of images,
    and no time is printed. Costs are hours times the prices that you give.
    """
    prices = Prices(price_per_cpu_hour, price_per_gpu_hour, price_per_gb_month)
    if probe is None and prices != Prices():
        raise ConfigError("--price-per-...: needs measured hours; expected --probe K with it")
    from rich.console import Console
    from rich.table import Table

    choice = ConfigurationOptions(source, seed, overrides, without)
    config = choice.config()
    table = Table(title=f"{config.name}: {n} samples", show_header=False)
    for name, value in _rows(config, n):
        table.add_row(name, value)
    if probe is not None:
        cores = usable_cores()
        for name, value in estimate_rows(_measure(choice, probe), n, cores, prices):
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
    from gen_data.generator.config.schema import docstring_summary
    from gen_data.generator.packs.provision import open_assets
    from gen_data.generator.pipeline.splits import split_of

    general = config.general
    per_scene = general.views_per_scene * general.steps_per_scene
    scenes = -(-n // per_scene)
    info = dataset_info(config, n, PipelineFactory(config, n).categories)
    # Refused here as in a run: formats that cannot hold the data set.
    exporters = ready_exporters(config, info, open_assets(config.asset_folders))
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


def _measure(choice: ConfigurationOptions, count: int) -> Probe:
    """Generate ``count`` samples in a temporary folder, in this process."""
    from gen_data.generator.api.generate import generate
    from gen_data.generator.core.temporary_folders import temporary_folder
    from gen_data.generator.renderers.warp.device import open_device

    done_s: dict[int, float] = {}

    def note(progress: RunProgress) -> None:
        done_s.setdefault(progress.done, time.monotonic())

    with temporary_folder("plan") as folder:
        summary = generate(
            choice.source,
            count,
            out=folder / "probe",
            workers=0,
            seed=choice.seed,
            overrides=(*choice.overrides, "splits={train: 1, val: 0, test: 0}"),
            without=choice.without,
            on_progress=note,
        )
        files = [p for p in (folder / "probe").rglob("*") if p.is_file() and "run" not in p.parts]
        # Hard links of exports take no space.
        size = sum({p.stat().st_ino: p.stat().st_size for p in files}.values())
    return Probe(
        summary.cpu_s,
        # The first sample includes the start of the engines.
        (done_s[count] - done_s[1]) / max(1, count - 1),
        size / count,
        len(files) / count,
        open_device("auto").is_cuda,
    )
