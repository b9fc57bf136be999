"""Cost of the relief of streets: ``python -m benchmarks.bench_relief``.

The same samples with relief and without (``--without relief``), five views of a scene as in
``street.yaml``, in turns; each turn is a new process, whose first samples are not counted. CPU ms
per sample, of all threads and with system time, is the least of the rounds; the bound is a tenth
more.

The first round fills the caches; let it run once before for figures of warm caches.
"""

import argparse
import subprocess
import sys

from benchmarks.bench_scenes import measure
from benchmarks.runs import machine

VIEWS = 5
CONFIGS = ("street", "kitti_rig", "highway", "parking")
BOUND = 1.1


def main() -> None:
    """Print a row per configuration; exit with 1 if one is above the bound."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--configs", default=",".join(CONFIGS))
    parser.add_argument("--n", type=int, default=30)
    parser.add_argument("--warm-up", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--one", nargs="+", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        name, n, warm_up, *without = given.one
        print(measure(name, VIEWS, int(n), int(warm_up), *without))
        return
    print(f"{machine()}, {given.n} samples, {given.rounds} rounds")
    print(f"{'':<12} {'level, CPU ms':>14} {'relief, CPU ms':>15} {'ratio':>6}")
    worst = 0.0
    for name in given.configs.split(","):
        numbers = [str(given.n), str(given.warm_up)]
        rounds = [
            [_measured(name, *numbers, *without) for without in (("relief",), ())]
            for _ in range(given.rounds)
        ]
        level_ms, relief_ms = (min(column) for column in zip(*rounds, strict=True))
        worst = max(worst, relief_ms / level_ms)
        print(
            f"{name:<12} {level_ms:14.0f} {relief_ms:15.0f} {relief_ms / level_ms:6.2f}", flush=True
        )
    sys.exit(worst > BOUND)


def _measured(*arguments: str) -> float:
    command = [sys.executable, "-m", "benchmarks.bench_relief", "--one", *arguments]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    main()
