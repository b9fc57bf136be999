"""``gen-data plan``: size, cost and contents of a run, before it starts."""

import time
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from gen_data.cli import cost_estimate, options, tables
from gen_data.core.errors import ConfigError, NoLabels
from gen_data.core.system_calls import usable_cores
from gen_data.exporters.label_map import category_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from gen_data.assemble.config import Config
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.progress import RunProgress


@click.command("plan")
@click.argument("source", metavar="CONFIG")
@click.option("--n", "-n", type=click.IntRange(min=1), required=True, help="Number of samples.")
@click.option(
    "--probe", type=click.IntRange(min=1), help="Generate so many samples to measure time and size."
)
@click.option("--price-per-cpu-hour", type=float, help="Price of a core; needs --probe.")
@click.option("--price-per-gpu-hour", type=float, help="Price of a GPU; needs --probe.")
@click.option("--price-per-gb-month", type=float, help="Price of storage; needs --probe.")
@options.configuration_options
def plan(
    source: str,
    n: int,
    probe: int | None,
    price_per_cpu_hour: float | None,
    price_per_gpu_hour: float | None,
    price_per_gb_month: float | None,
    **changes: "Unpack[options.Changes]",
) -> None:
    """Print shards, size, categories and exports of a data set, without rendering it.

    With --probe, a few samples are generated in a temporary folder and removed again, and hours
    and files are extrapolated from them; without it sizes are estimates from the sizes of images,
    and no time is printed. Costs are hours times the prices that you give.
    """
    prices = cost_estimate.Prices(price_per_cpu_hour, price_per_gpu_hour, price_per_gb_month)
    if probe is None and prices != cost_estimate.Prices():
        raise ConfigError("--price-per-...: needs measured hours; expected --probe K with it")
    from rich.console import Console

    from gen_data.assemble.config import load_config

    config = load_config(source, **changes)
    facts = list(plan_rows(config, n))
    if probe is not None:
        facts += cost_estimate.estimate_rows(
            _measure(source, changes, probe), n, usable_cores(), prices
        )
    tables.print_facts(Console(), f"{config.name}: {n} samples", facts)


def plan_rows(config: "Config", n: int) -> Iterator[tuple[str, str]]:
    """Names and values of the facts about ``n`` samples of a configuration."""
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.assemble.size_estimate import estimate_image_bytes
    from gen_data.assets.file_remarks import collect_remarks
    from gen_data.config.schema import docstring_summary
    from gen_data.pipeline.splits import split_of
    from gen_data.runner.durable_files import format_bytes
    from gen_data.runner.identity import possible_assets

    general = config.general
    scenes = -(-n // general.samples_per_scene)
    factory = PipelineFactory(config, n)
    factory.check()
    info = factory.info
    exporters = {exporter.type: exporter for exporter in config.exporters}
    yield "scenes", _product(scenes, info.views_per_scene, general.steps_per_scene)
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
    yield from _class_rows(config, factory)
    for name, exporter in exporters.items():
        yield f"export {name}", docstring_summary(type(exporter))
    used = [asset.asset_id for asset in possible_assets(factory)]
    for remarks in collect_remarks(factory.library, used):
        yield "not used", f"{remarks.file}: {'; '.join(remarks.unused)}"
    yield "size, estimated", f"{format_bytes(estimate_image_bytes(config, info) * n)} of images"


def _class_rows(config: "Config", factory: "PipelineFactory") -> Iterator[tuple[str, str]]:
    """Classes of the label map, and how many assets each has in the groups of objects."""
    assets = {a for scene in factory.nominal for g in scene.groups if g.annotated for a in g.assets}
    found = [factory.library.get(asset) for asset in assets]
    counts = Counter(name for a in found for name in {a.category, f"{a.category}/{a.subcategory}"})
    for name, own in config.general.labels.map.classes_of.items():
        used = [source for source in own if category_of(source) in factory.categories]
        drawn = sum(counts[category] for category in used)
        text = ", ".join(used) or "no category: it stays empty"
        yield f"class {name}", f"{text}; {drawn} of {len(assets)} assets to draw from"


def _product(scenes: int, views: int, steps: int) -> str:
    """Factors of the number of samples: ``4 scenes x 3 views x 1 instant``."""
    counts = ((scenes, "scene"), (views, "view"), (steps, "instant"))
    return " x ".join(f"{count:,} {noun}{'' if count == 1 else 's'}" for count, noun in counts)


def _measure(source: str, changes: options.Changes, count: int) -> cost_estimate.Probe:
    """Generate ``count`` samples in a temporary folder, in this process."""
    from gen_data.api.generate import generate
    from gen_data.core.temporary_folders import temporary_folder
    from gen_data.renderers.warp.device import open_device
    from gen_data.report.label_gaps import count_objects
    from gen_data.runner.stored import StoredSamples

    done_s: dict[int, float] = {}

    def note(progress: "RunProgress") -> None:
        done_s.setdefault(progress.done, time.monotonic())

    with temporary_folder("plan") as folder:
        try:
            summary = generate(
                source,
                count,
                out=folder / "probe",
                workers=0,
                seed=changes["seed"],
                overrides=(*changes["overrides"], "splits={train: 1, val: 0, test: 0}"),
                without=changes["without"],
                on_progress=note,
                resume_command="",
            )
        except NoLabels as error:
            summary = error.summary
        objects = count_objects(StoredSamples(folder / "probe"))
        files = [p for p in (folder / "probe").rglob("*") if p.is_file() and "run" not in p.parts]
        # Hard links of exports take no space.
        size = sum({p.stat().st_ino: p.stat().st_size for p in files}.values())
    return cost_estimate.Probe(
        summary.cpu_s,
        # The first sample includes the start of the engines.
        (done_s[count] - done_s[1]) / max(1, count - 1),
        size / count,
        len(files) / count,
        open_device("auto").is_cuda,
        {name: number / count for name, number in objects.items()},
    )
