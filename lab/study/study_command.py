"""``gen-data study``: the value of changes of a configuration on real pictures."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.lab.study.experiment import Variant

HELP = """Measure the value of changes of a configuration on real labelled pictures.

REAL_FOLDER has labels in the layout of COCO, KITTI, YOLO or VOC. A small detector is trained on
data of CONFIG, the baseline, and of every variant, with several seeds; all are judged on the real
pictures. The same command goes on after an interruption.

\b
gen-data study photos tabletop.yaml --without each
gen-data study photos tabletop.yaml --set randomizers.clutter.count=9 --mix 50
gen-data study photos tabletop.yaml --against shelf.yaml
gen-data study photos --results old=a.json --results new=b.json
"""


@click.command("study", help=HELP)
@click.argument("real_folder", type=click.Path(path_type=Path))
@click.argument("config", required=False)
@click.option(
    "--without", multiple=True, metavar="NAME", help="Omit a randomizer; each = one by one."
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override one field.")
@click.option("--against", multiple=True, metavar="CONFIG", help="Another configuration.")
@click.option("--mix", multiple=True, type=int, metavar="K", help="Add K real pictures.")
@click.option(
    "--results",
    multiple=True,
    metavar="NAME=FILE",
    help="Instead of training: COCO results of a detector of yours.",
)
@click.option(
    "--split",
    default="",
    help="Part of the name of COCO's annotation file, or of a split of YOLO's data.yaml.",
)
@click.option("--n", "-n", type=int, default=400, show_default=True, help="Samples per data set.")
@click.option("--seeds", type=int, default=3, show_default=True, help="Repetitions.")
@click.option("--steps", type=int, default=800, show_default=True, help="Training steps.")
@click.option(
    "--size", type=int, default=256, show_default=True, help="Input of the detector [px]."
)
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), default=Path("out/study"), show_default=True
)
@click.option("--workers", "-w", type=int, help="Processes [default: one per core].")
def study(
    real_folder: Path,
    config: str | None,
    without: tuple[str, ...],
    overrides: tuple[str, ...],
    against: tuple[str, ...],
    mix: tuple[int, ...],
    results: tuple[str, ...],
    split: str,
    n: int,
    seeds: int,
    steps: int,
    size: int,
    out: Path,
    workers: int | None,
) -> None:
    """Compare variants of a configuration, or results of detectors."""
    from gen_data.lab.study.experiment import Experiment
    from gen_data.lab.study.study import compare_results, run_study

    variants = () if config is None else list_variants(config, without, overrides, against, mix)
    if results and variants:
        raise ConfigError("--results stands instead of a configuration; give one of them")
    if results:
        findings = compare_results(real_folder, _named_files(results), out, split=split)
    elif len(variants) > 1:
        experiment = Experiment(
            real_folder, variants, split=split, n=n, seeds=seeds, steps=steps, size_px=size
        )
        findings = run_study(experiment, out, workers=workers, report=partial(click.echo, err=True))
    else:
        raise ConfigError(
            "there is nothing to compare; expected a configuration with --without, --set, "
            "--against or --mix, or at least two --results"
        )
    _print(findings, out)


def list_variants(
    config: str,
    without: tuple[str, ...],
    overrides: tuple[str, ...],
    against: tuple[str, ...],
    mix: tuple[int, ...],
) -> "tuple[Variant, ...]":
    """The baseline and one variant per option."""
    from gen_data.assemble.config import load_config
    from gen_data.lab.study.experiment import BASELINE, Variant

    if any(count < 1 for count in mix):
        raise ConfigError(f"--mix: {min(mix)}; expected at least 1 real picture")
    names = [name for name in without if name != "each"]
    if "each" in without:
        every = (r.name for probe in load_config(config).probes for r in probe.randomizers)
        names += [name for name in dict.fromkeys(every) if name not in names]
    return (
        Variant(BASELINE, config),
        *(Variant(f"without {name}", config, without=(name,)) for name in names),
        *(Variant(text, config, overrides=(text,)) for text in overrides),
        *(Variant(other, other) for other in against),
        *(Variant(f"with {count} real", config, real=count) for count in mix),
    )


def _named_files(texts: tuple[str, ...]) -> dict[str, Path]:
    files = {}
    for text in texts:
        name, _, file = text.partition("=")
        if not name or not file:
            raise ConfigError(f"--results: '{text}'; expected NAME=FILE")
        files[name] = Path(file)
    if len(files) < 2:
        raise ConfigError("--results: expected at least two files with different names")
    return files


def _print(findings: dict[str, Any], out: Path) -> None:
    from rich.console import Console

    from gen_data.cli.tables import print_tables
    from gen_data.lab.study.study import PAGE

    print_tables(Console(), findings["tables"])
    click.echo(f"wrote {out / PAGE}")
