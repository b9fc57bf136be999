"""Cost of new scenes, of this checkout and an older one: ``python -m benchmarks.bench_scenes OLD``.

Both draw the same samples, one new scene each, in turns; each turn is a new process, whose first
samples are not counted. CPU ms per sample, of all threads and with system time, is the least
of the rounds; the ratio is this checkout's over the older one's.

The first round of each build fills the caches; let it run once before for figures of warm caches.
"""

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.runs import machine

CONFIGS = ("street", "kitti_rig", "rooms", "pedestrians", "closeup", "tabletop")
_HERE = Path(__file__).resolve().parent.parent


def measure(name: str, views: int, n: int, warm_up: int, *without: str) -> float:
    """CPU ms per sample of ``n`` samples after ``warm_up`` others, with images and labels.

    ``without`` names randomizers to leave out.
    """
    factory_module = _module("assemble.pipeline_factory")
    shards = _module("runner.shard")
    overrides = (f"views_per_scene={views}", "steps_per_scene=1")
    config = _module("assemble.config").load_config(
        f"{name}.yaml", overrides=overrides, without=without
    )
    factory = factory_module.PipelineFactory(config, n + warm_up)
    with tempfile.TemporaryDirectory() as folder, factory() as pipeline:
        # As workers do, which collect garbage between shards.
        gc.disable()
        gc.freeze()
        for index in range(n + warm_up):
            if index == warm_up:
                started_s = time.process_time()
            shard = Path(folder) / str(index)
            shard.mkdir()
            sample = pipeline.sample(index)
            shards.write_images(pipeline.info, sample, shard)
            shards.write_records(sample, None, shard)
            for exporter in pipeline.exporters.values():
                exporter.write_shard(pipeline.info, [sample], shard)
        return 1e3 * (time.process_time() - started_s) / n


def _module(name: str) -> Any:
    """A module of the core, which was in ``gen_data.generator`` before."""
    import gen_data

    return import_module(f"{gen_data.Scene.__module__.removesuffix('core.scene')}{name}")


def _measure_in(checkout: Path, *arguments: str) -> float:
    """Run this file with the packages of a checkout."""
    command = [sys.executable, str(Path(__file__).resolve()), "--one", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True)
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print a row per configuration."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old", type=Path, nargs="?", help="checkout of the older build")
    parser.add_argument("--configs", default=",".join(CONFIGS))
    parser.add_argument("--views", type=int, default=1, help="views per scene")
    parser.add_argument("--n", type=int, default=40)
    parser.add_argument("--warm-up", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        name, *numbers = given.one
        views, n, warm_up = map(int, numbers)
        print(measure(name, views, n, warm_up))
        return
    if given.old is None:
        parser.error("expected the path of an older checkout")
    print(f"{machine()}, {given.views} views per scene, {given.n} samples, {given.rounds} rounds")
    print(f"{'':<12} {'old, CPU ms':>12} {'new, CPU ms':>12} {'ratio':>6}")
    numbers = [str(number) for number in (given.views, given.n, given.warm_up)]
    for name in given.configs.split(","):
        rounds = [
            [_measure_in(where, name, *numbers) for where in (given.old, _HERE)]
            for _ in range(given.rounds)
        ]
        old_ms, new_ms = (min(column) for column in zip(*rounds, strict=True))
        print(f"{name:<12} {old_ms:12.0f} {new_ms:12.0f} {new_ms / old_ms:6.2f}", flush=True)


if __name__ == "__main__":
    main()
