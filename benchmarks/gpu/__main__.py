"""Everything measured on a GPU, in one command: ``python -m benchmarks.gpu``.

    python -m benchmarks.gpu --make-references references.npz          (on any machine)
    python -m benchmarks.gpu --references references.npz --json gpu.json

About four minutes on a card of the class of an H100 with 16 cores, once kernels are compiled. Each
part has a process and a time limit; failures and timeouts are listed at the end. ``--device cpu``
takes the same path with tiny sizes.
"""

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.gpu import parts, report
from gen_data.core.system_calls import usable_cores

PARTS = ("card", "modules", "correct", "kernels", "sweeps", "paths", "rates")

REFERENCES_MAX = 8_000_000
"""Size of the file of all references [bytes]."""
RATES_S = 36.0
"""Bound of the measurements of one workload."""


class Measured:
    """Figures and failures by part; written after each of them."""

    def __init__(self, path: Path | None) -> None:
        self.figures: dict[str, Any] = {}
        self.failures: dict[str, str] = {}
        self.seconds: dict[str, float] = {}
        self._path = path

    def add(self, result: parts.Result, *place: str) -> None:
        """Add the result of a part, at a place in the figures."""
        print(f"{result.seconds:6.1f} s {result.name}: {result.failure or 'done'}", flush=True)
        self.seconds[result.name] = result.seconds
        if result.failure:
            self.failures[result.name] = result.failure
        else:
            inner = self.figures
            for key in place[:-1]:
                inner = inner.setdefault(key, {})
            inner[place[-1]] = result.value
        if self._path is not None:
            self._path.write_text(
                json.dumps(vars(self) | {"_path": ""}, indent=1), encoding="utf-8"
            )


def measure(arguments: argparse.Namespace) -> Measured:
    """Run the chosen parts one after another."""
    done = Measured(arguments.json)
    device, dry = arguments.device, arguments.device.startswith("cpu")
    limit_s = arguments.limit_s

    def one(name: str, function: str, *place: str, **values: Any) -> None:
        done.add(parts.run_part(name, function, limit_s, **values), *place)

    chosen = set(arguments.parts)
    if "card" in chosen:
        one("card", "card:describe_card", "card", device=device)
    if "modules" in chosen:
        one("modules, compiled", "card:compile_modules", "compiled", device=device)
        one("modules, loaded", "card:load_modules", "modules", device=device)
    if "correct" in chosen and arguments.references is not None:
        from benchmarks.gpu.references import config_names

        names = arguments.configs or config_names()
        where = {"references": str(arguments.references.resolve()), "device": device}
        for result in _side_by_side("references:compare", names, limit_s, where):
            done.add(result, "correct", result.name)
    if "kernels" in chosen:
        for name in ("tabletop",) if dry else ("tabletop", "street"):
            values = {"config": name, "device": device, "views": 1 if dry else 5, "small": dry}
            one(f"kernels {name}", "frames:time_kernels", "kernels", name, **values)
    if "sweeps" in chosen:
        rays, repeats = (1, 1) if dry else (4_000_000, 9)
        values = {"device": device, "rays": rays, "repeats": repeats, "small": dry}
        one("sweeps", "frames:time_sweeps", "sweeps", **values)
    if "paths" in chosen:
        for where in dict.fromkeys((device, "cpu")):
            size = (64, 48) if dry or where == "cpu" else (640, 480)
            values = {"device": where, "size_px": size, "samples": 1 if dry else 16}
            one(f"paths {where}", "frames:time_paths", "paths", where, **values)
    if "rates" in chosen:
        counts = [n for n in (1, 2, 4, 8, 16) if n <= usable_cores()]
        for name in arguments.workloads or (
            ("tabletop",) if dry else ("tabletop", "street", "rooms")
        ):
            values = {"config": name, "device": device, "workers": counts[:1] if dry else counts}
            values |= {"window_s": 0.1 if dry else 1.0, "small": dry, "scenes": 1 if dry else 16}
            values["limit_s"] = min(0.9 * limit_s, limit_s if dry else RATES_S)
            one(f"rates {name}", "rates:measure_rates", "rates", name, **values)
    return done


def _side_by_side(
    function: str, names: Sequence[str], limit_s: float, where: Mapping[str, str]
) -> Sequence[parts.Result]:
    """Call a function for several configurations; all of them share the limit of time."""
    deadline_s = time.perf_counter() + limit_s

    def call(name: str) -> parts.Result:
        left_s = max(deadline_s - time.perf_counter(), 1.0)
        return parts.run_part(name, function, left_s, name=name, **where)

    with ThreadPoolExecutor(max(1, usable_cores() - 2)) as pool:
        return list(pool.map(call, names))


def make_references(path: Path, names: Sequence[str], limit_s: float) -> bool:
    """Make references of configurations, or of all, on the CPU.

    Returns whether all were made and are small enough to be carried to a card.
    """
    # Light imports only above: most parts have a process.
    from benchmarks.gpu.references import config_names, write_references

    started_s = time.perf_counter()
    with TemporaryDirectory() as folder:
        where = {"folder": folder}
        names = names or config_names()
        # On few cores, all configurations take a quarter of an hour.
        limit_s *= len(names)
        results = _side_by_side("references:store_references", names, limit_s, where)
        for result in results:
            print(f"{result.seconds:6.1f} s {result.name}: {result.failure or 'done'}")
        size = write_references(path, [Path(r.value) for r in results if not r.failure])
    print(f"{path}: {size / 1e6:.1f} MB in {time.perf_counter() - started_s:.0f} s")
    if size > REFERENCES_MAX:
        print(f"{path}: more than {REFERENCES_MAX / 1e6:.0f} MB; keep fewer points or pixels")
    return size <= REFERENCES_MAX and not any(result.failure for result in results)


def main(words: Sequence[str] | None = None) -> int:
    """Measure, or make references; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--make-references", type=Path, metavar="FILE")
    parser.add_argument("--references", type=Path, metavar="FILE")
    parser.add_argument("--json", type=Path, metavar="OUT")
    parser.add_argument("--device", default="cuda:0")
    parser.add_argument("--configs", nargs="*", help="those to compare; all by default")
    parser.add_argument("--workloads", nargs="*", help="some of tabletop, street, rooms")
    parser.add_argument("--parts", nargs="*", default=PARTS, choices=PARTS)
    parser.add_argument("--limit-s", type=float, default=120.0, help="of each part")
    arguments = parser.parse_args(words)
    if arguments.make_references is not None:
        path, names = arguments.make_references, arguments.configs or ()
        return int(not make_references(path, names, arguments.limit_s))
    done = measure(arguments)
    print(report.format_report(done.figures, done.failures))
    wrong = any(c["findings"] for c in done.figures.get("correct", {}).values())
    return int(bool(done.failures) or wrong)


if __name__ == "__main__":
    sys.exit(main())
