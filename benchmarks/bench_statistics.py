"""Statistics of streets next to real ones: ``python -m benchmarks.bench_statistics --n 60``.

One table of the rows of ``bench_pictures`` and ``bench_scans``, for one or more configurations:
pictures of ``--n`` scenes, grey levels of people in the first ``--light`` of them, and scans of
the first ``--scans`` by KITTI's scanner, in clear weather, with one scene a frame. Each figure has
its standard error by a bootstrap over scenes. A row is ``out`` beyond the range of
``street_figures.yaml`` by two standard errors or more, and ``?`` beyond it by less: more scenes
decide.

``--out FILE`` adds the table in Markdown to the end of a file.
"""

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks import bench_pictures, bench_scans
from benchmarks.real_figures import RealFigures, judge, real_figures
from gen_data.assemble.config import load_config
from gen_data.core.streams import Streams

T = TypeVar("T")
RESAMPLES = 100
"""Draws of the bootstrap."""
SCANNER = "HDL-64E"
"""Model of the scanner that the real scans are from."""
SCANS_AS_REAL = ("shared.weather=ClearNoon", "steps_per_scene=1")
"""KITTI was recorded in dry weather by day."""


@dataclass(frozen=True, slots=True)
class Figure:
    """Our figure of a row and its standard error; NaN = not measured, unknown."""

    value: float
    error: float


@dataclass(frozen=True, slots=True)
class Column:
    """Figures of a configuration by row, and the numbers of scenes that they are from."""

    config: str
    figures: dict[str, Figure]
    scenes: dict[str, int]


def measure_pictures(
    config: str, scenes: Sequence[int], given: Sequence[str], *, light: bool
) -> list[list[bench_pictures.Picture]]:
    """Pictures of these scenes."""
    return list(bench_pictures.pictures_of_config(config, scenes, given, light=light))


def measure_scans(
    config: str, scenes: Sequence[int], given: Sequence[str]
) -> list[list[bench_scans.ScanFigures]]:
    """Figures of the scans of these scenes."""
    found = bench_scans.scans_of_config(config, scenes, [*given, *SCANS_AS_REAL])
    return [[bench_scans.measure(scan) for scan in scene] for scene in found]


def bootstrap(
    scenes: Sequence[Sequence[T]], summarise: Callable[[Sequence[T]], dict[str, float]]
) -> dict[str, Figure]:
    """Figures of all scenes with their standard errors; none without scenes."""
    if not scenes:
        return {}
    flat = [item for scene in scenes for item in scene]
    rng = Streams(seed=0, scene=0).rng("bootstrap")
    draws = rng.integers(len(scenes), size=(RESAMPLES, len(scenes)))
    drawn = [summarise([item for k in row for item in scenes[k]]) for row in draws]
    return {
        name: Figure(value, _deviation([one[name] for one in drawn]))
        for name, value in summarise(flat).items()
    }


def _deviation(values: Sequence[float]) -> float:
    known = [value for value in values if not math.isnan(value)]
    return float(np.std(known)) if len(known) > 1 else math.nan


def _with_rare_counts(figures: Mapping[str, Figure], pictures: int) -> dict[str, Figure]:
    """Counts of objects a picture, whose errors are at least one object in all pictures."""
    return {
        name: Figure(one.value, max(one.error, 1.0 / pictures))
        for name, one in figures.items()
        if name.endswith(" px")
    }


def summarise_scans(scans: Sequence[bench_scans.ScanFigures]) -> dict[str, float]:
    """Figures of scans without the columns that only ours have."""
    return {name: value for name, (value, *_) in bench_scans.summarise(scans).items()}


def measure_column(config: str, given: Sequence[str], n: int, light: int, scans: int) -> Column:
    """All figures of one configuration."""
    light = min(light, n)
    bright = measure_pictures(config, range(light), given, light=True) if light else []
    rest = measure_pictures(config, range(light, n), given, light=False) if light < n else []
    sensors = load_config(config, overrides=list(given)).sensors
    has_scanner = any(getattr(sensor, "model", None) == SCANNER for sensor in sensors)
    swept = measure_scans(config, range(scans), given) if has_scanner and scans else []
    found = [*bright, *rest]
    figures = bootstrap(found, bench_pictures.summarise)
    figures |= _with_rare_counts(figures, sum(map(len, found)))
    figures |= bootstrap(swept, summarise_scans)
    return Column(config, figures, {"pictures": n, "light": light, "scans": len(swept)})


def format_table(columns: Sequence[Column]) -> str:
    """The table in Markdown: real figures, and ours with their standard errors and verdicts."""
    heads = [
        f"`{c.config}` ({c.scenes['pictures']} scenes, {c.scenes['light']} with light, "
        f"{c.scenes['scans']} scans)"
        for c in columns
    ]
    lines = [f"| | real | {' | '.join(heads)} |", "|---" * (2 + len(columns)) + "|"]
    for kind in ("pictures", "scans"):
        real = real_figures(kind)
        for name, value in real.rows.items():
            cells = [_format_cell(real, name, c.figures.get(name)) for c in columns]
            if any(cells):
                known = "" if math.isnan(value) else f"{value:.4g}"
                lines.append(f"| {name} | {known} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _format_cell(real: RealFigures, name: str, ours: Figure | None) -> str:
    if ours is None or math.isnan(ours.value):
        return ""
    verdict = judge(real, name, ours.value, ours.error)
    mark = f" **{verdict}**" if verdict in ("out", "?") else ""
    return f"{ours.value:.3g} ± {ours.error:.1g}{mark}"


def main() -> None:
    """Measure the configurations in parallel and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--config", nargs="+", default=["street.yaml", "kitti_rig.yaml"])
    parser.add_argument("--n", type=int, default=60, help="scenes whose pictures are counted")
    parser.add_argument("--light", type=int, default=0, help="scenes with grey levels of people")
    parser.add_argument("--scans", type=int, default=0, help="scenes whose scans are measured")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--workers", type=int, default=1, help="configurations at a time")
    parser.add_argument("--out", type=Path, help="file that gets the table at its end")
    asked = parser.parse_args()
    with ProcessPoolExecutor(asked.workers, mp_context=get_context("spawn")) as pool:
        jobs = [
            pool.submit(measure_column, name, asked.set, asked.n, asked.light, asked.scans)
            for name in asked.config
        ]
        table = format_table([job.result() for job in jobs])
    print(table)
    if asked.out is not None:
        with asked.out.open("a", encoding="utf-8") as file:
            file.write(table + "\n")


if __name__ == "__main__":
    main()
