"""Labelled samples per second of several worker processes on one device.

Workers are started once and then asked to work for a while, the first ones of them alone at first:
``python -m benchmarks.gpu.rates CONFIG DEVICE NUMBER FOLDER OVERRIDES``, one JSON line per request.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.bench_tabletop import OVERRIDES
from benchmarks.gpu.card import ask_driver

WORKLOADS = {"tabletop": OVERRIDES, "street": (), "rooms": ()}
_SAMPLES = 10**6
_SCENES_APART = 1000


def overrides_of(config: str, device: str, small: bool) -> tuple[str, ...]:
    """Overrides of a workload; small ones are for trying the benchmark out."""
    size = ("sensors[0].size_px=[64, 48]",) if small else ()
    return (*WORKLOADS[config], f"render.device={device}", *size)


def measure_rates(
    config: str, device: str, workers: Sequence[int], window_s: float, ready_s: float, small: bool
) -> dict[str, Any]:
    """Samples per second in memory and to disk, by number of workers.

    Returns:
        ``memory``, ``disk``: rates by number of workers; ``busy``: share of time in which the
        device had work, by the same keys; ``device_mb``: memory that all workers hold on it;
        ``stages``: CPU ms per sample to disk by stage, of the largest number of workers.
    """
    texts = overrides_of(config, device, small)
    idle_mb = _device_mb()
    started_s = time.perf_counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        _started(config, device, max(workers), folder, texts) as all_,
    ):
        for one in all_:
            one.wait(ready_s - (time.perf_counter() - started_s))
        able = [one for one in all_ if one.ready]
        if not able:
            raise RuntimeError(f"no worker was ready: {all_[0].last_words()}")
        figures: dict[str, Any] = {"ready": len(able), "start_s": time.perf_counter() - started_s}
        figures |= {"memory": {}, "disk": {}, "busy": {}}
        for place in ("memory", "disk"):
            for count in (n for n in workers if n <= len(able)):
                with _watched() as busy:
                    waiting = [one.ask(place, window_s) for one in able[:count]]
                    answers = [wait() for wait in waiting]
                figures[place][str(count)] = sum(a["n"] / a["s"] for a in answers)
                figures["busy"][f"{place} {count}"] = sum(busy) / max(len(busy), 1)
                figures["stages"] = {
                    stage: 1e3
                    * sum(a["cpu_s"].get(stage, 0.0) for a in answers)
                    / max(sum(a["n"] for a in answers), 1)
                    for stage in sorted({stage for a in answers for stage in a["cpu_s"]})
                }
        figures["device_mb"] = _device_mb() - idle_mb
        figures["errors"] = [one.last_words() for one in all_ if not one.ready][:1]
    return figures


def _device_mb() -> float:
    return float(ask_driver("memory.used") or 0)


class _Worker:
    """A worker process, asked through its pipes."""

    def __init__(self, command: list[str], log: Path) -> None:
        self._log = log
        with log.open("w") as errors:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True
            )
        self.ready = False

    def wait(self, limit_s: float) -> None:
        """Wait until it has made its first samples."""
        reader = threading.Thread(target=self._read_ready, daemon=True)
        reader.start()
        reader.join(max(limit_s, 0.1))

    def _read_ready(self) -> None:
        assert self.process.stdout is not None
        self.ready = self.process.stdout.readline().startswith("{")

    def ask(self, place: str, window_s: float) -> Callable[[], dict[str, Any]]:
        """Let it work; returns what waits for its answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps([place, window_s]) + "\n")
        self.process.stdin.flush()
        stdout = self.process.stdout

        def answer() -> dict[str, Any]:
            figures: dict[str, Any] = json.loads(stdout.readline())
            return figures

        return answer

    def last_words(self) -> str:
        """End of its error output."""
        return " | ".join(self._log.read_text().strip().splitlines()[-4:])


@contextmanager
def _started(
    config: str, device: str, count: int, folder: str, texts: Sequence[str]
) -> Iterator[list[_Worker]]:
    workers = []
    try:
        for number in range(count):
            command = [sys.executable, "-m", "benchmarks.gpu.rates", config, device, str(number)]
            command += [folder, json.dumps(texts)]
            workers.append(_Worker(command, Path(folder) / f"{number}.log"))
        yield workers
    finally:
        for one in workers:
            one.process.kill()
            one.process.wait()


@contextmanager
def _watched() -> Iterator[list[float]]:
    """Share of time in which the device had work, read again and again; empty without a driver."""
    shares: list[float] = []
    done = threading.Event()

    def watch() -> None:
        while not done.wait(0.2):
            text = ask_driver("utilization.gpu")
            if not text:
                return
            shares.append(float(text) / 100.0)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield shares
    finally:
        done.set()
        thread.join()


def work(config: str, number: int, folder: Path, texts: Sequence[str]) -> None:
    """Body of a worker: make samples for as long as each request says."""
    from dataclasses import replace

    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.identity import make_plan
    from gen_data.runner.shard import Job, make_shard
    from gen_data.runner.store import LocalStore

    factory = PipelineFactory(load_config(f"{config}.yaml", seed=1, overrides=texts), _SAMPLES)
    store = LocalStore(folder / str(number))
    with factory() as pipeline:
        info = pipeline.info
        in_scene = info.views_per_scene * info.steps_per_scene
        plan = replace(make_plan(factory), shard_size=in_scene)
        store.prepare(plan)
        job = Job(plan, store, factory)
        scene = number * _SCENES_APART
        for index in range(scene * in_scene, (scene + 1) * in_scene):
            pipeline.sample(index)
        print(json.dumps({}), flush=True)
        for line in sys.stdin:
            place, window_s = json.loads(line)
            made: list[dict[str, float]] = []
            started_s = time.perf_counter()
            while time.perf_counter() - started_s < window_s:
                scene += 1
                if place == "disk":
                    make_shard(job, pipeline, scene, lambda s: made.append(dict(s.timings_s)))  # noqa: B023
                    continue
                for index in range(scene * in_scene, (scene + 1) * in_scene):
                    made.append(dict(pipeline.sample(index).timings_s))
            spent_s = time.perf_counter() - started_s
            stages = {stage for timings in made for stage in timings}
            cpu_s = {stage: sum(t.get(stage, 0.0) for t in made) for stage in stages}
            print(json.dumps({"n": len(made), "s": spent_s, "cpu_s": cpu_s}), flush=True)


if __name__ == "__main__":
    work(sys.argv[1], int(sys.argv[3]), Path(sys.argv[4]), json.loads(sys.argv[5]))
