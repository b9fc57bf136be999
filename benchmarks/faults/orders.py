"""Equal bytes whatever the number of processes and the order of work."""

import random
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path

from benchmarks.faults import recorded_run, results
from tests.runner.simulation import Run

ROOT = Path(__file__).parents[2]
LONG_N = 16
"""Samples of a data set of eight shards."""


def simulated_runs(scale: results.Scale, folder: Path) -> results.Result:
    """The production supervisor with virtual processes, pipes and clock, by seed."""
    del folder
    result = results.Result()
    ends: Counter[str] = Counter()
    for seed in range(scale.seed, scale.seed + scale.pick(10_000, 300)):
        try:
            error = Run(seed).execute()
        except AssertionError as failure:
            result.add(False, str(failure))
            continue
        ends["complete" if error is None else type(error).__name__] += 1
        result.add(True, "")
    result.notes += [f"{number} {end}" for end, number in sorted(ends.items())]
    return result


def orders(scale: results.Scale, folder: Path) -> results.Result:
    """One to eight workers, shards in reversed and random order, and a prefix."""
    result = results.Result()
    recording, digest = recorded_run.record(LONG_N), recorded_run.reference_digest(folder, LONG_N)
    for workers in (1, 2, 3, 8) if scale.is_full else (2,):
        out = folder / f"workers-{workers}"
        recording.make(out, workers=workers)
        result.add(recorded_run.tree_digest(out) == digest, f"{workers} workers")
    rng = random.Random(scale.seed)
    shards = list(range(LONG_N // 2))
    shuffled = [rng.sample(shards, len(shards)) for _ in range(scale.pick(20, 1))]
    for number, order in enumerate([shards[::-1], *shuffled]):
        out = folder / f"order-{number}"
        for shard in order:
            recording.make(out, shards=range(shard, shard + 1))
        result.add(recorded_run.tree_digest(out) == digest, f"order {order}")
    recorded_run.record(recorded_run.N).make(folder / "prefix")
    for shard in range(recorded_run.N // 2):
        one, other = (folder / name / f"shards/{shard:06d}" for name in ("prefix", "reference"))
        result.add(
            recorded_run.tree_digest(one) == recorded_run.tree_digest(other),
            f"shard {shard} of a prefix",
        )
    result.notes.append(
        "1, 2, 3 and 8 workers; reversed and random order; a prefix" if scale.is_full else ""
    )
    return result


def samples_alone(scale: results.Scale, folder: Path) -> results.Result:
    """Samples in random order, whose engines have seen other ones before, and alone."""
    from gen_data.api.generate import generate
    from gen_data.core.errors import NoLabels
    from gen_data.runner.deep_verify import find_irreproducible_samples

    result = results.Result()
    n = scale.pick(200, 10)
    out = folder / "out"
    with suppress(NoLabels):  # Tiny images show little.
        generate(recorded_run.CONFIG, n, out=out, workers=0)
    indices = random.Random(scale.seed).sample(range(n), n)
    found = list(find_irreproducible_samples(out, indices, False, None))
    for index in indices:
        result.add(not any(f"sample {index}" == f.samples for f in found), f"sample {index}")
    command = [sys.executable, "-m", "gen_data.cli", "repro", str(out), "--index"]
    alone = indices[: scale.pick(5, 0)]
    for index in alone:
        done = subprocess.run(
            [*command, str(index)], cwd=ROOT, capture_output=True, text=True, check=False
        )
        result.add(done.returncode == 0, f"sample {index} alone: {done.stderr[-300:]}")
    result.notes.append(f"{n} in random order, {len(alone)} of them also in separate processes")
    with recorded_run.open_factory(1)() as pipeline:
        assert pipeline.sample(0).index == 0
    return result


def ray(scale: results.Scale, folder: Path) -> results.Result:
    """The tests of the Ray backend, if this version has one."""
    del scale, folder
    result = results.Result()
    tests = sorted(str(path) for path in (ROOT / "tests/runner").glob("test_ray*.py"))
    if not tests:
        result.skip("all", "this version has no tests/runner/test_ray*.py")
        return result
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-m", "slow or not slow", *tests], cwd=ROOT,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    result.add(done.returncode == 0, done.stdout[-500:])
    result.notes.append(done.stdout.strip().splitlines()[-1])
    return result
