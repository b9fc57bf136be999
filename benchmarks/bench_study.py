"""Experiments with known answers: ``python -m benchmarks.bench_study {ranking,weakness} [--out]``.

``ranking``: a harmful, a useless and a helpful randomizer, which ``gen-data study`` has to
    distinguish on pictures of another renderer tier, lens and light. ``weakness``: a configuration
    that rarely draws an exposure found in half of the pictures; ``gen-data adapt`` has to detect
    this, and its next round has to raise average precision there. Both print their tables, whether
    the answer is right, and CPU seconds of all processes. An interrupted experiment in ``--out``
    continues.
"""

import argparse
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gen_data
from benchmarks import runs
from gen_data.lab.study.adapt import CURRICULUM, adapt, tabulate
from gen_data.lab.study.experiment import Experiment, Variant, list_runs, perform, prepare
from gen_data.lab.study.study import run_study

CONFIGS = Path(__file__).with_name("studies")
"""Folder of the configurations."""
JUDGED_SEED = 900
"""Seed of the data on which misses of a detector are measured; it trains on others."""


def run_ranking(out: Path, sizes: Mapping[str, int]) -> bool:
    """Compare the configuration with three others that each lack one randomizer.

    Returns:
        Whether the study finds an improvement without the harmful one, a deterioration without the
        helpful one, and no difference without the useless one.
    """
    config = str(CONFIGS / "ranking.yaml")
    answers = {"wide": "better", "weights": "no difference found", "orbit": "worse"}
    variants = tuple(Variant(f"without {name}", config, without=(name,)) for name in answers)
    real = make(CONFIGS / "ranking_real.yaml", sizes["pictures"], out / "real")
    found = study((Variant("baseline", config), *variants), real, out / "study", sizes)
    return all(
        found["variants"][f"without {name}"]["verdict"] == answer
        for name, answer in answers.items()
    )


def run_weakness(out: Path, sizes: Mapping[str, int]) -> bool:
    """Adapt to misses of a detector, and compare the next round with the configuration.

    Returns:
        Whether the exposure is re-weighted, twice with the same bytes and equal data sets,
        and the study finds the next round better.
    """
    config = str(CONFIGS / "weakness.yaml")
    real = make(CONFIGS / "weakness_real.yaml", sizes["pictures"], out / "real")
    judged = make(Path(config), 2 * sizes["n"], out / "judged", seed=JUDGED_SEED)
    baseline = Variant("baseline", config)
    first = Experiment(real, (baseline,), seeds=1, **fit_sizes(sizes))
    prepared = prepare(first)
    perform(prepared, out / "first", 1, say)
    detector = list_runs(prepared, out / "first")[0].folder / "detector.pt"
    folders = [out / name for name in ("curriculum", "repeated")]
    rounds = []
    for folder in folders:
        (folder / CURRICULUM).unlink(missing_ok=True)
        rounds.append(adapt(config, judged, folder, detector=detector, strength=2.0))
    print_table(tabulate(rounds[0], 2.0))
    replays = all(
        len({(folder / name).read_bytes() for folder in folders}) == 1
        for name in (CURRICULUM, rounds[0].config.name)
    )
    ids = [
        gen_data.generate(str(one.config), 4, out=out / f"replayed_{k}", workers=1).dataset_id
        for k, one in enumerate(rounds)
    ]
    print(f"replayed: equal files {replays}, data sets {' and '.join(ids)}")
    adapted = Variant("round 1", str(rounds[0].config))
    found = study((baseline, adapted), real, out / "study", sizes)
    return (
        replays
        and len(set(ids)) == 1
        and "shared.exposure_ev" in rounds[0].changed
        and found["variants"]["round 1"]["verdict"] == "better"
    )


EXPERIMENTS: Mapping[str, Callable[[Path, Mapping[str, int]], bool]] = {
    "ranking": run_ranking, "weakness": run_weakness,
}  # fmt: skip


def make(config: Path, n: int, folder: Path, seed: int | None = None) -> Path:
    """Generate a data set, or finish it."""
    gen_data.generate(str(config), n, out=folder, workers=1, seed=seed)
    return folder


def study(
    variants: tuple[Variant, ...], real: Path, out: Path, sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Perform a study and print its tables."""
    experiment = Experiment(real, variants, seeds=sizes["seeds"], **fit_sizes(sizes))
    found = run_study(experiment, out, workers=1, report=say)
    for table in found["tables"]:
        print_table(table)
    return found


def fit_sizes(sizes: Mapping[str, int]) -> dict[str, int]:
    """Sizes of data sets and trainings."""
    return {name: sizes[name] for name in ("n", "steps", "size_px")}


def print_table(table: Mapping[str, Any]) -> None:
    """Print a table as Markdown."""
    print(f"\n{table['title']} ({table['note']})\n")
    for row in (table["header"], ["---"] * len(table["header"]), *table["rows"]):
        print("| " + " | ".join(row) + " |")


def say(line: str) -> None:
    """Print a line at once."""
    print(line, file=sys.stderr, flush=True)


def main() -> None:
    """Perform an experiment; exit with 1 if its answer is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiment", choices=EXPERIMENTS)
    parser.add_argument("--out", type=Path, default=Path("out/bench_study"))
    parser.add_argument("--pictures", type=int, default=200)
    parser.add_argument("--n", type=int, default=400)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=800)
    parser.add_argument("--size-px", type=int, default=112)
    args = vars(parser.parse_args())
    name, out = args.pop("experiment"), args.pop("out")
    started_s = time.perf_counter()
    is_right = EXPERIMENTS[name](out / name, args)
    spent_s = time.perf_counter() - started_s
    print(f"\n{name}: {'as expected' if is_right else 'NOT as expected'}")
    print(f"{spent_s:.0f} s, {runs.cpu_s():.0f} CPU s; {runs.machine()}")
    raise SystemExit(0 if is_right else 1)


if __name__ == "__main__":
    main()
