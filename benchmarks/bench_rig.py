"""Frames per second of whole rigs in traffic to disk: ``python -m benchmarks.bench_rig``.

KITTI's rig: two cameras of 1242x375, an HDL-64E, an inertial unit and a satellite receiver, with
COCO, KITTI, KITTI raw, SemanticKITTI and tables on disk. nuScenes' rig: six cameras of 1600x900, an
HDL-32E and five radars, with COCO, point clouds, bird's-eye maps and tables. All weathers.
"""

import argparse

from benchmarks.runs import format_summary, machine, measure_run
from gen_data.assemble.config import load_config


def main() -> None:
    """Print the figures of docs/performance.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=400, help="frames; sequences have 20")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rig", default="kitti_rig", help="name of a configuration")
    arguments = parser.parse_args()

    print(f"{machine()}, {arguments.workers} workers, {arguments.n} frames")
    config = load_config(arguments.rig, seed=1)
    summary = measure_run(config, arguments.n, arguments.workers)
    print(f"{config.name}: {format_summary(summary)}")


if __name__ == "__main__":
    main()
