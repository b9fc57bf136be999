"""What one shard costs on a Ray cluster, beside processes of this machine.

``python -m benchmarks.bench_cluster [SHARDS]``

Samples of 8 x 6 pixels, each of which sleeps for 50 ms, so that two workers do not share a core
with anything else that matters. One shard per sample: the time beyond the sleep is overhead.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from benchmarks.runs import machine
from gen_data.runner.ray_cluster import RayCluster
from gen_data.runner.run import Settings, Summary, run
from tests.runner.doubles import FakeFactory, Trouble, fake_plan, write_raw_images

SLEEP_S = 0.05
WORKERS = 2


def measure(shards: int, settings: Settings) -> Summary:
    """Make one sample per shard."""
    with tempfile.TemporaryDirectory() as folder:
        return run(
            replace(fake_plan(shards, 1), versions={}),
            FakeFactory(shards, Trouble(delay_s=SLEEP_S)),
            Path(folder) / "out",
            workers=WORKERS,
            resume_command="",
            settings=settings,
        )


def overhead_s(few: Summary, many: Summary) -> float:
    """Seconds of a worker per shard beyond the sleep; the start of the workers cancels out."""
    per_shard_s = (many.seconds - few.seconds) / (many.made - few.made)
    return per_shard_s * WORKERS - SLEEP_S


def main() -> None:
    """Measure both pools and print the overhead of a shard."""
    shards = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    cluster = RayCluster()
    print(machine())
    with cluster.connected():
        for name, settings in (
            ("local", Settings(write_media=write_raw_images)),
            ("ray", Settings(write_media=write_raw_images, open_pool=cluster.open_pool)),
        ):
            few, many = measure(20, settings), measure(20 + shards, settings)
            print(f"{name}: {overhead_s(few, many) * 1e3:.1f} ms per shard")


if __name__ == "__main__":
    main()
