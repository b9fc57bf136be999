"""Read exports with the packages of users: ``python -m benchmarks.readers``; see the package."""

import argparse
import os
import subprocess
import sys
import tempfile
import venv
import warnings
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.readers.table import Reader
    from benchmarks.readers.views import Comparison

HERE = Path(__file__).parent
DATA = {"tabletop": ("bent_tabletop.yaml", 4), "rig": ("rig.yaml", 3), "arm": ("arm.yaml", 4)}
"""Configuration and number of samples by the name of a data set."""
RUNS = ({"type": "coco", "segmentation": "rle"}, {"type": "cvat", "shapes": "polygon"})
"""Formats of ``runs``, which is exported from ``tabletop``: other shapes of masks."""
FAULTS_MAX = 5


def main() -> int:
    """Make the data sets, read them and print the table; 1 if a reader disagrees."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.readers", description=__doc__)
    parser.add_argument("--venv", type=Path, help="environment with all readers; made if absent")
    parser.add_argument("--strict", action="store_true", help="an absent package is a failure")
    parser.add_argument("--only", action="append", default=[], help="package or format; repeatable")
    parser.add_argument("--out", type=Path, help="folder that keeps the data sets for another run")
    given = parser.parse_args()
    if given.venv is not None and Path(sys.prefix) != given.venv.resolve():
        return run_in(given.venv.resolve())
    from benchmarks.readers.examine import examine_rows, is_installed
    from benchmarks.readers.table import READERS

    rows = [
        k
        for k, reader in enumerate(READERS)
        if not given.only or {reader.package, reader.format} & {*given.only}
    ]
    parts: dict[str, list[int]] = defaultdict(list)
    for k in filter(lambda k: is_installed(READERS[k]), rows):
        parts[READERS[k].package].append(k)
    with tempfile.TemporaryDirectory(prefix="readers-") as scratch:
        folder = given.out or Path(scratch) / "data"
        make_data(folder)
        found: dict[int, Comparison | None] = dict.fromkeys(rows)
        for part in parts.values():
            # A process for each package: some disturb others, such as by copies of a C library.
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                found |= pool.submit(examine_rows, part, folder, scratch).result()
    results = [(READERS[k], found[k]) for k in rows]
    print_table(results)
    absent = any(comparison is None for _, comparison in results)
    wrong = any(comparison is not None and comparison.faults for _, comparison in results)
    return int(wrong or (absent and given.strict))


def run_in(folder: Path) -> int:
    """Run this command in an environment, which gets all readers when it is made."""
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        pip = [str(python), "-m", "pip", "install", "-q"]
        wanted = str(HERE / "requirements.txt")
        subprocess.run([*pip, "-e", f"{HERE.parent.parent}[certify]", "-r", wanted], check=True)
        others = str(HERE / "requirements-without-dependencies.txt")
        subprocess.run([*pip, "--no-deps", "-r", others], check=True)
    command = [str(python), "-m", "benchmarks.readers", *sys.argv[1:]]
    return subprocess.run(command, check=False).returncode


def make_data(folder: Path) -> None:
    """Generate the data sets that are not there."""
    import gen_data

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gen_data.ConfigWarning)
        for name, (config, n) in DATA.items():
            if not (folder / name / "manifest.json").exists():
                gen_data.generate(HERE / config, n, out=folder / name, workers=0)
        if not (folder / "runs/manifest.json").exists():
            gen_data.export(folder / "tabletop", RUNS, folder / "runs")


def print_table(results: "list[tuple[Reader, Comparison | None]]") -> None:
    """Print one row per reader, then the faults and the absent packages."""
    from rich.console import Console
    from rich.table import Table

    from benchmarks.readers.examine import installed

    table = Table("reader", "version", "format", "objects", "worst", "mask IoU", "lens", "ok", "")
    for reader, found in results:
        if found is None:
            continue
        name = reader.format + {"runs": " (run lengths, polygons)"}.get(reader.data, "")
        worst = f"{found.worst:.2g} {reader.unit}" if reader.unit else ""
        iou = "" if found.iou is None else f"{found.iou:.3f}"
        lens = "" if found.lens is None else f"{found.lens:.2g}"
        ok = "no" if found.faults else "yes"
        release, count = installed(reader.package), str(found.objects)
        table.add_row(reader.package, release, name, count, worst, iou, lens, ok, reader.because)
    console = Console(width=200)
    console.print(table)
    for reader, found in results:
        for fault in found.faults[:FAULTS_MAX] if found is not None else ():
            console.print(f"{reader.package}, {reader.format}: {fault}", markup=False)
    absent = sorted({reader.package for reader, found in results if found is None})
    if absent:
        console.print(f"absent: {', '.join(absent)}", markup=False)


if __name__ == "__main__":
    sys.exit(main())
