"""Labelled samples per second of streets to disk: ``python -m benchmarks.bench_street``.

1242x375, the shipped street with up to 30 vehicles in motion, as many parked, and 40 people; RGB,
depth, instance and category PNGs, COCO and KITTI labels on disk; all weathers of the configuration.
"""

import argparse

from benchmarks.runs import format_summary, machine, measure_run
from gen_data.assemble.config import Config, load_config

OVERRIDES = (
    "views_per_scene=5", "shared.traffic=busy", "randomizers.traffic.gap_m={uniform: [4, 20]}",
    "randomizers.traffic.count=20", "randomizers.parked.count=10",
    "randomizers.people.gap_m={uniform: [0.5, 8]}", "randomizers.people.count=40",
)  # fmt: skip


def make_config(weather: str) -> Config:
    """Street with 30 vehicles and 40 people; an empty ``weather`` keeps the configured one."""
    given = (f"shared.weather={weather}",) if weather else ()
    return load_config("street.yaml", seed=1, overrides=(*OVERRIDES, *given))


def main() -> None:
    """Print the figures of docs/performance.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=500)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--weather", default="", help="one preset instead of all")
    arguments = parser.parse_args()

    print(f"{machine()}, {arguments.workers} workers, {arguments.n} samples")
    summary = measure_run(make_config(arguments.weather), arguments.n, arguments.workers)
    print(f"street, {arguments.weather or 'all weathers'}: {format_summary(summary)}")


if __name__ == "__main__":
    main()
