"""Labelled samples per second of several worker processes on one device.

All workers draw the scenes of one pool, each from another one on. The first worker draws the pool
while the others start, and so fills the caches of files once for all. Then the workers are asked to
work for a while, together and fewer of them:
``python -m benchmarks.gpu.rates ARGUMENTS``, one line of JSON per request.
"""

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from benchmarks.gpu.driver import ask_driver

_SAMPLES = 10**6
_FILL, _START = 0.35, 0.6
"""Shares of the time after which the pool is as it is, and workers that are not ready are left."""
Answer = dict[str, Any]


def overrides_of(config: str, device: str, small: bool) -> tuple[str, ...]:
    """Overrides of a workload; small ones are for trying the benchmark out."""
    from benchmarks.bench_tabletop import OVERRIDES

    own = {"tabletop": OVERRIDES, "street": (), "rooms": ()}[config]
    size = ("sensors[0].size_px=[64, 48]",) if small else ()
    return (*own, f"render.device={device}", *size)


def measure_rates(
    config: str, device: str, workers: Sequence[int], window_s: float, limit_s: float, small: bool,
    scenes: int,
) -> dict[str, Any]:  # fmt: skip
    """Samples per second in memory and to disk, by number of workers, as far as time suffices.

    Args:
        config: Name of the workload.
        device: Device of the renderer.
        workers: Numbers of workers; if fewer are ready, all of these are measured.
        window_s: Length of each measurement.
        limit_s: Total time limit for filling caches, starting workers, and measuring.
        small: Whether images are tiny.
        scenes: Largest pool.

    Returns:
        ``memory``, ``disk``: rates by number of workers; ``busy``: share of time in which the
        device had work, by the same keys; ``device_mb``: memory that all workers hold on it;
        ``stages``: CPU ms per sample to disk by stage, of the largest number of workers;
        ``scenes``: size of the pool; ``ready``: number of workers; ``start_s``: until they were;
        ``left_out``: skipped measurements, and why.
    """
    started_s = time.perf_counter()
    fill_s, ready_s, end_s = (started_s + limit_s * share for share in (_FILL, _START, 1.0))
    idle_mb = _device_mb()
    figures: dict[str, Any] = {"memory": {}, "disk": {}, "busy": {}, "stages": {}}
    with (
        tempfile.TemporaryDirectory() as folder,
        _started(config, device, small, max(workers), folder) as all_,
    ):
        filled = all_[0].ask("fill", fill_s - time.perf_counter(), scenes)(ready_s)
        if filled is None:
            raise RuntimeError(f"no scene within {_START * limit_s:.0f} s: {all_[0].last_words()}")
        pool = filled["scenes"]
        firsts = [one.ask("memory", 0.0, pool) for one in all_]
        able = [one for one, first in zip(all_, firsts, strict=True) if first(ready_s)]
        if not able:
            raise RuntimeError(f"no worker within {_START * limit_s:.0f} s")
        figures |= {"scenes": pool, "ready": len(able), "start_s": time.perf_counter() - started_s}
        late = [one for one in all_ if one not in able]
        left = [f"{len(late)} workers not ready: {late[0].last_words()}"] if late else []
        # The largest number first, in case that time runs out.
        for n in sorted({min(number, len(able)) for number in workers}, reverse=True):
            for place in ("disk", "memory"):
                with _watched() as busy:
                    answers = _work_together(able[:n], place, window_s, pool, end_s)
                if len(answers) < n:
                    left.append(f"{place}, {n} workers: {len(answers)} of them in time")
                    continue
                figures[place][str(n)] = sum(a["n"] / a["s"] for a in answers)
                figures["busy"][f"{place} {n}"] = sum(busy) / max(len(busy), 1)
                if place == "disk" and not figures["stages"]:
                    figures["stages"] = _mean_stages(answers)
        figures["device_mb"] = _device_mb() - idle_mb
    return figures | {"left_out": left}


def _work_together(
    workers: "Sequence[_Worker]", place: str, window_s: float, pool: int, end_s: float
) -> list[Answer]:
    """Timely answers of workers that work at the same time; none near the end."""
    if time.perf_counter() + window_s > end_s:
        return []
    waiting = [one.ask(place, window_s, pool) for one in workers]
    return [answer for wait in waiting if (answer := wait(end_s))]


def _mean_stages(answers: Sequence[Answer]) -> dict[str, float]:
    made = sum(a["n"] for a in answers)
    stages = sorted({stage for a in answers for stage in a["cpu_s"]})
    return {s: 1e3 * sum(a["cpu_s"].get(s, 0.0) for a in answers) / made for s in stages}


def _device_mb() -> float:
    return float(ask_driver("memory.used") or 0)


class _Worker:
    """A worker process, queried through its pipes; late answers are dropped."""

    def __init__(self, command: list[str], log: Path) -> None:
        self._log = log
        with log.open("w") as errors:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True
            )
        self._answers: SimpleQueue[Answer | None] = SimpleQueue()
        self._asked = 0
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._answers.put(json.loads(line))
        self._answers.put(None)

    def ask(self, place: str, window_s: float, pool: int) -> Callable[[float], Answer | None]:
        """Start its work; returns a function that waits for the answer until an instant at most."""
        self._asked += 1
        number = self._asked
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps([number, place, window_s, pool]) + "\n")
            self.process.stdin.flush()

        def answer(until_s: float) -> Answer | None:
            with suppress(Empty):
                while found := self._answers.get(timeout=max(until_s - time.perf_counter(), 0.01)):
                    if found["number"] == number:
                        return found
                # It has ended, and so will answer no further request.
                self._answers.put(None)
            return None

        return answer

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._listener.join()
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()

    def last_words(self) -> str:
        return " | ".join(self._log.read_text().strip().splitlines()[-4:]) or "still at work"


@contextmanager
def _started(
    config: str, device: str, small: bool, count: int, folder: str
) -> Iterator[list[_Worker]]:
    workers = []
    try:
        for number in range(count):
            values = {"config": config, "device": device, "small": small}
            values |= {"worker": number, "folder": folder}
            command = [sys.executable, "-m", "benchmarks.gpu.rates", json.dumps(values)]
            workers.append(_Worker(command, Path(folder) / f"{number}.log"))
        yield workers
    finally:
        for one in workers:
            one.end()


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


def work(config: str, device: str, small: bool, worker: int, folder: str) -> None:
    """Body of a worker: answer requests of a number, a place, seconds, and scenes of the pool.

    To fill caches it draws every scene of the pool once at most; for a measurement it goes on from
    its latest one. In any case it draws at least one.
    """
    from dataclasses import replace

    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.identity import make_plan
    from gen_data.runner.shard import Job, make_shard
    from gen_data.runner.store import LocalStore

    texts = overrides_of(config, device, small)
    factory = PipelineFactory(load_config(f"{config}.yaml", seed=1, overrides=texts), _SAMPLES)
    with factory() as pipeline:
        info = pipeline.info
        in_scene = info.views_per_scene * info.steps_per_scene
        plan = replace(make_plan(factory), shard_size=in_scene)
        at = worker
        for line in sys.stdin:
            number, place, window_s, pool = json.loads(line)
            made: list[dict[str, float]] = []
            started_s = time.perf_counter()
            for drawn in range(pool) if place == "fill" else count():  # noqa: B007
                scene, at = at % pool, at + 1
                if place == "disk":
                    # A store takes a shard once only.
                    store = LocalStore(Path(folder) / f"{worker}-{at}")
                    store.prepare(plan)
                    job = Job(plan, store, factory)
                    make_shard(job, pipeline, scene, lambda s: made.append(dict(s.timings_s)))  # noqa: B023
                else:
                    for index in range(scene * in_scene, (scene + 1) * in_scene):
                        made.append(dict(pipeline.sample(index).timings_s))
                spent_s = time.perf_counter() - started_s
                if spent_s >= window_s:
                    break
            stages = {stage for timings in made for stage in timings}
            cpu_s = {stage: sum(t.get(stage, 0.0) for t in made) for stage in stages}
            figures = {"n": len(made), "s": spent_s, "scenes": drawn + 1, "cpu_s": cpu_s}
            print(json.dumps(figures | {"number": number}), flush=True)


if __name__ == "__main__":
    work(**json.loads(sys.argv[1]))
