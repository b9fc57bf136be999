"""Equal bytes for any number of workers, any order and any interruptions."""

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from gen_data.runner.run import Limits, Settings
from gen_data.runner.verify import verify
from tests.runner.doubles import make, notes_of, tree_digest, write_raw_images
from tests.runner.fake_run import DELAY_S, SHARD_SIZE, N
from tests.runner.test_processes import start_fake_run


@pytest.fixture(scope="module")
def reference_digest(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Digest of the uninterrupted data set, made in this process."""
    out = tmp_path_factory.mktemp("reference") / "out"
    make(out, N, SHARD_SIZE)
    return tree_digest(out)


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_the_number_of_workers_does_not_matter(
    tmp_path: Path, reference_digest: str, workers: int
) -> None:
    """One, two and three processes give the same bytes as none."""
    make(tmp_path / "out", N, SHARD_SIZE, workers=workers)

    assert tree_digest(tmp_path / "out") == reference_digest


def test_workers_replaced_for_their_memory_change_nothing(tmp_path: Path) -> None:
    """With a limit of one byte, every worker leaves after its shard."""
    settings = Settings(limits=Limits(rss_bytes=1, rss_growth=0.0), write_media=write_raw_images)
    make(tmp_path / "kept", 8, 4)

    summary = make(tmp_path / "replaced", 8, 4, workers=1, settings=settings)

    assert tree_digest(tmp_path / "replaced") == tree_digest(tmp_path / "kept")
    assert summary.worker_deaths == 0
    assert [note for note in notes_of(tmp_path / "replaced") if "MB and is replaced" in note]


def test_exporters_that_must_copy_give_the_bytes_of_those_that_link(
    tmp_path: Path, reference_digest: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the file system has hard links is not visible in the data set."""

    def copy(source: Path, target: Path) -> None:
        Path(target).write_bytes(Path(source).read_bytes())

    monkeypatch.setattr(os, "link", copy)
    make(tmp_path / "out", N, SHARD_SIZE)

    assert tree_digest(tmp_path / "out") == reference_digest
    assert verify(tmp_path / "out", full=True).samples == N


def test_samples_do_not_depend_on_how_many_there_are(tmp_path: Path) -> None:
    """The shards of a small data set are the first shards of a larger one."""
    make(tmp_path / "small", 8, 4)
    make(tmp_path / "large", 16, 4)

    for shard in ("000000", "000001"):
        small = tree_digest(tmp_path / "small" / "shards" / shard)
        assert small == tree_digest(tmp_path / "large" / "shards" / shard)


def kill_once(out: Path, after_s: float) -> bool:
    """Start or resume a run and kill its whole process group; False if it had already ended."""
    process = start_fake_run(out, workers=2, delay_s=DELAY_S)
    try:
        process.wait(timeout=after_s)
        killed = False
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        killed = True
    process.communicate()
    return killed


@pytest.mark.parametrize("times", [3, pytest.param(12, marks=pytest.mark.slow)])
def test_killed_at_random_instants_and_resumed_it_is_the_same_data_set(
    tmp_path: Path, reference_digest: str, times: int
) -> None:
    """Kill -9 of the whole process group; a folder meets several, then is finished."""
    rng = random.Random(3)
    kills = 0
    for attempt in range(40):
        out = tmp_path / f"out{attempt // 4}"
        kills += kill_once(out, after_s=rng.uniform(0.15, 1.0))
        if kills == times:
            break

    assert kills == times, "runs end too quickly to be killed: raise DELAY_S"
    for out in sorted(tmp_path.iterdir()):
        make(out, N, SHARD_SIZE)
        assert tree_digest(out) == reference_digest
        verify(out, full=True)


def test_a_resumed_run_makes_only_what_is_missing(tmp_path: Path) -> None:
    """Samples of committed shards are not generated again."""
    out = tmp_path / "out"
    process = start_fake_run(out, workers=1, delay_s=DELAY_S)
    while not (out / "shards" / "000002.json").exists():
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    there = len(list((out / "shards").glob("*.json")))

    summary = make(out, N, SHARD_SIZE)

    assert summary.made == N - there * SHARD_SIZE
