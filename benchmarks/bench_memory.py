"""Memory of a worker over many samples: ``python -m benchmarks.bench_memory tabletop --n 20000``.

Images are small unless ``--full-size`` is given: growth comes from assets and caches, which small
images draw as often. One line per interval, then the slope [MB per 1,000 samples]: the median of
the slopes between all pairs of readings (Theil-Sen) in the second half of the run.

``python -m benchmarks.bench_memory assets`` passes all assets of the library through the caches of
a renderer, ``--passes`` times in another order: the memory of a worker that has seen everything.
"""

import argparse
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np

from benchmarks.runs import format_summary, machine
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.runner import identity, resident_memory
from gen_data.runner.run import RunProgress, Settings, run

SMALL_PX = {"tabletop": (96, 72), "street": (124, 38)}
FIELDS = ("Rss", "Pss", "Pss_Anon", "Private_Dirty", "Shared_Clean")


def read_rollup(pid: int) -> dict[str, float]:
    """Memory of a process [MB] by the fields of ``smaps_rollup``; empty if it has ended."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]
    except OSError:
        return {}
    kilobytes = {name: line.split()[0] for name, _, line in (row.partition(":") for row in lines)}
    return {name: int(kilobytes[name]) * 1024 / 1e6 for name in FIELDS if name in kilobytes}


def worker_pids() -> list[int]:
    """Processes that this one has started."""
    tasks = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    return sorted(int(pid) for task in tasks for pid in task.read_text().split())


def theil_sen(x: Sequence[float], y: Sequence[float]) -> float:
    """Median of the slopes between all pairs of points; 0 for fewer than two points."""
    first, second = np.triu_indices(len(x), 1)
    a, b = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    run_length = a[second] - a[first]
    apart = run_length > 0.0
    if not apart.any():
        return 0.0
    return float(np.median((b[second] - b[first])[apart] / run_length[apart]))


@dataclass
class Recorder:
    """Readings of all workers, once per interval.

    Attributes:
        every: Samples between readings.
        rows: Number of samples, and the fields of the largest worker [MB].
    """

    every: int
    rows: list[tuple[int, dict[str, float]]] = field(default_factory=list)

    def observe(self, progress: RunProgress) -> None:
        """Take readings if the interval has passed."""
        last = self.rows[-1][0] if self.rows else 0
        if progress.done < last + self.every:
            return
        readings = [reading for pid in worker_pids() if (reading := read_rollup(pid))]
        if readings:
            largest = max(readings, key=lambda reading: reading["Rss"])
            self.rows.append((progress.done, largest))
            listed = "  ".join(f"{name} {value:6.1f}" for name, value in largest.items())
            print(f"{progress.done:6d} samples, largest of {len(readings)}: {listed}", flush=True)

    def slope(self, name: str) -> float:
        """Growth of a field in the second half of the run [MB per 1,000 samples]."""
        steady = self.rows[len(self.rows) // 2 :]
        made = [samples / 1e3 for samples, _ in steady]
        return theil_sen(made, [reading[name] for _, reading in steady])


def pass_all_assets(passes: int) -> None:
    """Print the memory of this process after each pass over all assets."""
    library = open_library()
    cache = DeviceCache(library, open_device("cpu"))
    kinds = ("object", "texture", "environment")
    found = {kind: [one.asset_id for one in library.find((), kind)] for kind in kinds}
    pairs = [(kind, asset_id) for kind in kinds for asset_id in found[kind]]
    print(f"{machine()}, {', '.join(f'{len(ids)} {kind}s' for kind, ids in found.items())}")
    upload = {"object": cache.mesh, "texture": cache.texture, "environment": cache.environment}
    for number in range(passes):
        pairs.sort(key=lambda pair: sha256(f"{number} {pair[1]}".encode()).digest())
        for count, (kind, asset_id) in enumerate(pairs):
            upload[kind](asset_id)
            if kind == "object":
                library.materials(asset_id)
                library.convex_parts(asset_id)
            if count % 100 == 0:
                resident_memory.release_memory()
        resident_memory.release_memory(file_bytes_kept=0)
        listed = "  ".join(f"{k} {v:6.1f}" for k, v in read_rollup(os.getpid()).items())
        print(f"pass {number}: {listed}", flush=True)


def main() -> None:
    """Print the readings and the figures of docs/performance.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", choices=[*sorted(SMALL_PX), "assets"])
    parser.add_argument("--n", type=int, default=20000)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--every", type=int, default=0, help="samples between readings")
    parser.add_argument("--full-size", action="store_true", help="the configured image size")
    parser.add_argument("--set", action="append", default=[], help="as of gen-data")
    parser.add_argument("--passes", type=int, default=4, help="of all assets")
    arguments = parser.parse_args()
    if arguments.scene == "assets":
        pass_all_assets(arguments.passes)
        return

    width, height = SMALL_PX[arguments.scene]
    size = () if arguments.full_size else (f"sensors.color.size_px=[{width}, {height}]",)
    overrides = (*size, *arguments.set)
    config = load_config(f"{arguments.scene}.yaml", seed=1, overrides=overrides)
    factory = PipelineFactory(config, arguments.n)
    recorder = Recorder(arguments.every or max(arguments.n // 100, 1))
    print(f"{machine()}, {arguments.workers} worker(s), {arguments.scene}, {' '.join(overrides)}")
    with tempfile.TemporaryDirectory() as folder:
        summary = run(
            identity.make_plan(factory),
            factory,
            Path(folder) / "out",
            Settings(arguments.workers, progress=recorder.observe),
            partial(identity.format_licences, factory),
        )
    print(format_summary(summary))
    for name in ("Rss", "Pss"):
        peak = max((reading[name] for _, reading in recorder.rows), default=0.0)
        print(f"{name}: peak {peak:.0f} MB, {recorder.slope(name):+.2f} MB per 1,000 samples")


if __name__ == "__main__":
    main()
