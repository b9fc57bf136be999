"""Samples per second by number of workers: ``python -m benchmarks.scaling tabletop``.

Measures stages of samples at full size, and merging and verification of ``--merged`` samples with
small images, in one process. It then simulates runs of ``--samples`` with 1 to 1,000 workers: each
makes a shard, stores it, reports it to the driver, and gets the next one. Storage and driver serve
one shard at a time, in the order of their arrival. Merging follows the last shard, on one core.

The table names the bottleneck of each run: the part that works for the largest share of its time.
"""

import argparse
import heapq
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from benchmarks.runs import machine
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.runner.identity import format_licences, make_plan
from gen_data.runner.run import RunProgress, Settings, run
from gen_data.runner.verify import verify

WORKERS = (1, 2, 4, 8, 16, 64, 256, 1000)
DRIVER_S = 0.003
"""Of the supervisor, per shard: ``python -m tests.runner.simulation cluster 1000 20000 0``."""
SMALL_PX = "[96, 72]"


@dataclass(frozen=True)
class Costs:
    """Costs of a data set.

    Attributes:
        plan_s: Time before the first worker starts.
        start_s: Time of a worker until its first sample.
        sample_s: Time of a worker per sample.
        shard_size: Samples per shard.
        sample_bytes: Stored bytes per sample.
        driver_s: Time of the supervisor per shard.
        merge_s: Time after the last shard, per sample.
        verify_s: Time of ``gen-data verify`` per sample; not part of a run.
    """

    plan_s: float
    start_s: float
    sample_s: float
    shard_size: int
    sample_bytes: float
    driver_s: float
    merge_s: float
    verify_s: float = 0.0


@dataclass(frozen=True)
class Forecast:
    """A simulated run.

    Attributes:
        seconds: From its start to the manifest.
        samples_per_s: In the mean of the whole run.
        shares: Share of the time in which each part works: ``workers`` in their mean, ``storage``,
            ``driver``, and ``plan and merging``.
    """

    seconds: float
    samples_per_s: float
    shares: dict[str, float]

    @property
    def limit(self) -> str:
        """The part that works longest."""
        return max(self.shares, key=lambda part: self.shares[part])


def simulate(costs: Costs, samples: int, workers: int, bytes_per_s: float) -> Forecast:
    """Simulate a run on a virtual clock.

    Args:
        costs: Costs of the data set.
        samples: Number of samples, a multiple of the shard size.
        workers: Number of processes, each with a core.
        bytes_per_s: Throughput of the storage for all workers together.
    """
    shards = samples // costs.shard_size
    make_s = costs.shard_size * costs.sample_s
    store_s = costs.shard_size * costs.sample_bytes / bytes_per_s
    storage_s = driver_s = end_s = 0.0
    # Instants at which a worker has something for the storage (0), then for the driver (1).
    first = costs.plan_s + costs.start_s + make_s
    waiting = [(first, worker, 0) for worker in range(min(workers, shards))]
    begun = len(waiting)
    while waiting:
        now_s, worker, step = heapq.heappop(waiting)
        if step == 0:
            storage_s = max(now_s, storage_s) + store_s
            heapq.heappush(waiting, (storage_s, worker, 1))
            continue
        driver_s = end_s = max(now_s, driver_s) + costs.driver_s
        if begun < shards:
            begun += 1
            heapq.heappush(waiting, (driver_s + make_s, worker, 0))
    seconds = end_s + samples * costs.merge_s
    busy_s = {
        "workers": shards * make_s / workers,
        "storage": shards * store_s,
        "driver": shards * costs.driver_s,
        "plan and merging": costs.plan_s + samples * costs.merge_s,
    }
    shares = {part: spent_s / seconds for part, spent_s in busy_s.items()}
    return Forecast(seconds, samples / seconds, shares)


def measure_costs(name: str, n: int, merged: int) -> tuple[Costs, dict[str, float]]:
    """Costs of a shipped configuration on this machine, and of each stage, in CPU seconds."""
    full, stages = _measure(name, n, ())
    small, _ = _measure(name, merged, (f"sensors.color.size_px={SMALL_PX}",))
    return replace(full, merge_s=small.merge_s, verify_s=small.verify_s), stages


def _measure(name: str, n: int, overrides: Sequence[str]) -> tuple[Costs, dict[str, float]]:
    reached_s = {"begin": time.process_time()}
    factory = PipelineFactory(load_config(f"{name}.yaml", seed=1, overrides=overrides), n)
    plan = make_plan(factory)
    reached_s["plan"] = time.process_time()

    def observe(progress: RunProgress) -> None:
        if progress.done:
            reached_s.setdefault("first sample", time.process_time())
        reached_s.setdefault(progress.phase, time.process_time())

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        licences = partial(format_licences, factory)
        summary = run(plan, factory, out, Settings(progress=observe), licences)
        reached_s["end"] = time.process_time()
        verify(out)
    verified_s = time.process_time() - reached_s["end"]
    sample_s = sum(summary.cpu_s.values())
    costs = Costs(
        plan_s=reached_s["plan"] - reached_s["begin"],
        start_s=max(0.0, reached_s["first sample"] - reached_s["plan"] - sample_s),
        sample_s=sample_s,
        shard_size=plan.shard_size,
        sample_bytes=summary.bytes / n,
        driver_s=DRIVER_S,
        merge_s=(reached_s["end"] - reached_s["merging"]) / n,
        verify_s=verified_s / n,
    )
    return costs, dict(summary.cpu_s)


def format_forecasts(costs: Costs, samples: int, bytes_per_s: float) -> str:
    """Rows of the table of docs/scaling.md."""
    lines = [
        "| workers | samples/s | hours | workers busy | storage | driver | plan, merging | limit |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for workers in WORKERS:
        found = simulate(costs, samples, workers, bytes_per_s)
        shares = " | ".join(f"{100 * share:.0f} %" for share in found.shares.values())
        hours = found.seconds / 3600
        lines.append(
            f"| {workers} | {found.samples_per_s:,.0f} | {hours:.1f} | {shares} | {found.limit} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print measured costs, and the tables of simulated runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", choices=["street", "tabletop"])
    parser.add_argument("--n", type=int, default=40, help="samples at full size")
    parser.add_argument("--merged", type=int, default=2000, help="samples to merge and verify")
    parser.add_argument("--samples", type=int, default=1_000_000, help="of the simulated run")
    parser.add_argument("--mb-per-s", type=float, nargs="+", default=[200.0, 2000.0])
    parser.add_argument("--sample-ms", type=float, default=0.0, help="0 = as measured here")
    parser.add_argument("--shard-size", type=int, default=0, help="0 = the configuration's")
    arguments = parser.parse_args()

    costs, stages = measure_costs(arguments.scene, arguments.n, arguments.merged)
    costs = replace(
        costs,
        sample_s=arguments.sample_ms / 1e3 or costs.sample_s,
        shard_size=arguments.shard_size or costs.shard_size,
    )
    listed = ", ".join(f"{stage} {1e3 * spent_s:.1f}" for stage, spent_s in stages.items())
    print(f"{machine()}, {arguments.scene}, CPU ms per sample: {listed}")
    print(
        f"plan {costs.plan_s:.1f} s, start {costs.start_s:.1f} s, {costs.sample_bytes / 1e3:.0f} kB"
        f" per sample, shards of {costs.shard_size}, merging {1e3 * costs.merge_s:.2f} ms and"
        f" verify {1e3 * costs.verify_s:.2f} ms per sample (of {arguments.merged})"
    )
    samples = arguments.samples - arguments.samples % costs.shard_size
    for mb_per_s in arguments.mb_per_s:
        print(f"\n{samples:,} samples, storage of {mb_per_s:g} MB/s\n")
        print(format_forecasts(costs, samples, 1e6 * mb_per_s))


if __name__ == "__main__":
    main()
