"""Run campaigns: ``python -m benchmarks.faults --full``; see the package."""

import argparse
import json
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from benchmarks.faults.results import Result, Scale, print_table, to_plain

CAMPAIGNS = {
    "kills_at_calls": "crashes:kills_at_calls", "kills_at_instants": "crashes:kills_at_instants",
    "errnos_at_calls": "crashes:errnos_at_calls", "errnos_for_ever": "crashes:errnos_for_ever",
    "crash_states": "crashes:crash_states", "power_cuts": "power_cuts:power_cuts",
    "out_of_memory": "memory:out_of_memory", "simulated_runs": "orders:simulated_runs",
    "orders": "orders:orders", "samples_alone": "orders:samples_alone", "ray": "orders:ray",
    "environments": "environments:environments", "bit_flips": "bit_flips:bit_flips",
    "objects": "elsewhere:objects", "foreign": "elsewhere:foreign", "derived": "elsewhere:derived",
    "caches": "elsewhere:caches", "structured_configurations": "configurations:structured",
    "mutated_configurations": "configurations:mutated_bytes",
    "hostile_assets": "assets:hostile_assets",
}  # fmt: skip


def load(name: str) -> Callable[[Scale, Path], Result]:
    """The function of a campaign."""
    module, function = CAMPAIGNS[name].split(":")
    loaded: Callable[[Scale, Path], Result] = getattr(
        import_module(f"benchmarks.faults.{module}"), function
    )
    return loaded


def run_campaign(name: str, scale: Scale, scratch: Path | None = None) -> Result:
    """Run one campaign in a temporary folder below ``scratch``."""
    started_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix=f"faults-{name}-", dir=scratch) as folder:
        result = load(name)(scale, Path(folder))
    result.seconds = time.monotonic() - started_s
    return result


def main() -> int:
    """Run the chosen campaigns; exit code 1 if a promise is broken."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="a sample of every campaign [default]")
    size.add_argument("--full", action="store_true", help="every number of docs/trust.md")
    parser.add_argument("--only", action="append", choices=sorted(CAMPAIGNS), help="repeatable")
    parser.add_argument("--seed", type=int, default=0, help="of drawn faults")
    parser.add_argument("--json", type=Path, help="write the results to this file")
    parser.add_argument("--scratch", type=Path, help="folder for temporary files, such as /dev/shm")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="limit per campaign")
    given = parser.parse_args()
    results = {}
    for name in given.only or CAMPAIGNS:
        print(f"{name} ...", file=sys.stderr, flush=True)
        scale = Scale(given.full, given.seed, time.monotonic() + 60.0 * given.minutes)
        results[name] = run_campaign(name, scale, given.scratch)
        if given.json is not None:
            facts = {"machine": platform.platform(), "campaigns": to_plain(results)}
            given.json.write_text(json.dumps(facts, indent=1) + "\n", "utf-8")
    print_table(results)
    return 0 if all(result.is_clean for result in results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
