"""Real worker processes: they die, hang, fail and are interrupted."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import pytest

from gen_data.core.errors import OutOfMemory, SampleError, SceneRejected, WorkerLost
from gen_data.runner.processes import StandbyWorker, open_worker_pool
from gen_data.runner.run import Limits, Settings
from gen_data.runner.worker import make_sendable
from tests.runner.doubles import RESUME, Trouble, make, notes_of, tree_digest, write_raw_images

ROOT = Path(__file__).parents[2]
HANG_S = 120.0
"""Time limit for steps that take a second on an idle machine; only hanging ones exceed it."""


def impatient(silence_s: float) -> Settings:
    return Settings(limits=Limits(silence_s=silence_s), write_media=write_raw_images)


def start_fake_run(
    out: Path,
    workers: int,
    delay_s: float,
    ballast_bytes: int = 0,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[str]:
    arguments = [str(out), str(workers), str(delay_s), str(ballast_bytes)]
    command = [sys.executable, "-m", "tests.runner.fake_run", *arguments]
    options = {"stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    return subprocess.Popen(command, cwd=ROOT, env=environment, **options)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + HANG_S
    while time.monotonic() < deadline_s:
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError("waited in vain")


def processes_of_session(session: int) -> list[int]:
    """Pids of the living processes of a session; zombies do not count."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(path.parent.name))
    return sorted(found)


def committed(out: Path) -> int:
    return len(list((out / "shards").glob("*.json"))) if (out / "shards").exists() else 0


@pytest.mark.slow
def test_a_killed_workers_shard_is_made_again(tmp_path: Path, reference_digest: str) -> None:
    """One SIGKILL at sample 5: the same bytes, and the log reports it."""
    trouble = Trouble(killed_once_at=5, marker=str(tmp_path / "marker"))
    summary = make(tmp_path / "out", workers=2, trouble=trouble)
    assert summary.worker_deaths == 1
    assert tree_digest(tmp_path / "out") == reference_digest
    (note,) = notes_of(tmp_path / "out")
    assert "killed by signal 9 (SIGKILL)" in note
    assert "shard 1, sample 5" in note


@pytest.mark.slow
def test_a_poisoned_sample_is_named_and_a_healed_run_makes_its_shard(
    tmp_path: Path, reference_digest: str
) -> None:
    """Three deaths on shard 1, then WorkerLost with the command that makes sample 6 alone."""
    with pytest.raises(WorkerLost) as caught:
        make(tmp_path / "out", workers=2, trouble=Trouble(killed_at=6))
    assert "shard 1: its worker process died 3 times, at last in sample 6" in str(caught.value)
    assert "killed by signal 9 (SIGKILL)" in str(caught.value)
    assert f"gen-data repro {tmp_path / 'out'} --index 6" in str(caught.value)
    records = sorted(path.name for path in (tmp_path / "out/shards").glob("*.json"))
    assert records == ["000000.json", "000002.json"]
    # After the cause is gone, the same command makes the one missing shard.
    summary = make(tmp_path / "out", workers=1)
    assert summary.made == 4
    assert tree_digest(tmp_path / "out") == reference_digest


@pytest.mark.slow
def test_a_hanging_worker_is_killed_and_replaced(tmp_path: Path, reference_digest: str) -> None:
    """Silence over the limit counts as death."""
    trouble = Trouble(hangs_once_at=5, marker=str(tmp_path / "marker"))
    make(tmp_path / "out", workers=1, trouble=trouble, settings=impatient(2.0))
    assert "no sign of life for 2 s" in notes_of(tmp_path / "out")[0]
    assert tree_digest(tmp_path / "out") == reference_digest


@pytest.mark.slow
def test_killed_workers_leave_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Temporary files of engines are removed with the run, under a name of any length."""
    elsewhere = tmp_path / "temporary"
    elsewhere.mkdir()
    monkeypatch.setenv("TMPDIR", str(elsewhere))
    out = tmp_path / ("long name\n" * 20) / "out"
    make(out, workers=1, trouble=Trouble(killed_once_at=5, marker=str(tmp_path / "marker")))
    assert list(elsewhere.iterdir()) == []
    assert not (out / "run/tmp").exists()


@pytest.mark.parametrize("workers", [0, 1])
def test_a_rejected_scene_comes_back_as_itself(tmp_path: Path, workers: int) -> None:
    """The error crosses the process border with its type and text."""
    with pytest.raises(SceneRejected, match=r"scene 3: no valid layout.*object fell off"):
        make(tmp_path / "out", workers=workers, trouble=Trouble(rejected_at=6))
    assert (tmp_path / "out/shards/000000.json").exists()
    assert not (tmp_path / "out/run/tmp").exists()


@pytest.mark.parametrize("workers", [0, 1])
def test_a_bug_is_one_message_with_place_trace_and_command(tmp_path: Path, workers: int) -> None:
    """An error nobody foresaw names sample, line of code and how to see it again."""
    with pytest.raises(SampleError) as caught:
        make(tmp_path / "out", workers=workers, trouble=Trouble(bug_at=6))
    assert str(caught.value).startswith("sample 6: ValueError: a wheel came off\n")
    assert "doubles.py" in str(caught.value)
    assert "--index 6" in str(caught.value)
    # The terminal belongs to the command line; a worker has its own log.
    if workers:
        assert "a wheel came off" in (tmp_path / "out/run/worker-0.log").read_text()


def test_a_wrong_sample_is_named_with_the_command_that_makes_it(tmp_path: Path) -> None:
    """The pipeline names the fault; the runner adds the place."""
    with pytest.raises(SampleError) as caught:
        make(tmp_path / "out", workers=1, trouble=Trouble(wrong_at=6))
    assert str(caught.value) == (
        "sample 6: two labels contradict each other\n"
        f"  Reproduce: gen-data repro {tmp_path / 'out'} --index 6"
    )


@pytest.mark.slow
def test_workers_that_cannot_start_end_the_run(tmp_path: Path) -> None:
    with pytest.raises(WorkerLost, match="while they start: killed by signal 9"):
        make(tmp_path / "out", workers=1, trouble=Trouble(start_fails=True))


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_stops_soon_and_tells_how_to_go_on(tmp_path: Path, number: signal.Signals) -> None:
    """Exit code 130, the resume command, nobody left running."""
    process = start_fake_run(tmp_path / "out", workers=2, delay_s=0.1)
    wait_for(lambda: committed(tmp_path / "out") >= 1)
    os.killpg(process.pid, number) if number == signal.SIGINT else process.send_signal(number)
    _, message = process.communicate(timeout=HANG_S)
    assert process.returncode == 130
    assert RESUME in message
    assert "Traceback" not in message
    assert committed(tmp_path / "out") >= 1
    wait_for(lambda: processes_of_session(process.pid) == [])


def test_a_killed_supervisor_leaves_no_process_behind(tmp_path: Path) -> None:
    """SIGKILL of the parent alone: the kernel ends its workers."""
    process = start_fake_run(tmp_path / "out", workers=2, delay_s=0.1)
    wait_for(lambda: committed(tmp_path / "out") >= 1)
    assert len(processes_of_session(process.pid)) >= 3
    process.kill()
    process.communicate()
    wait_for(lambda: processes_of_session(process.pid) == [])


def test_handlers_of_signals_are_given_back_and_threads_leave_them_alone(tmp_path: Path) -> None:
    """Only the main thread may have handlers; a host program keeps its own."""
    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=make, args=(tmp_path / "out",))
    thread.start()
    thread.join()
    assert signal.getsignal(signal.SIGINT) is before
    assert (tmp_path / "out/manifest.json").exists()
    # After a run, Ctrl-C has its earlier meaning.
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    make(tmp_path / "again")
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


class Stubborn(SceneRejected):
    def __init__(self) -> None:
        super().__init__(3, ())

    def __reduce__(self) -> tuple[object, ...]:
        return (Stubborn, ("one argument too many",))


def test_errors_that_travel_from_workers_are_named_with_their_remedy() -> None:
    """A damaged kernel cache, lack of memory whatever a library makes of it, and odd classes."""
    for text in ("Failed to find forward kernel 'grow_tree'", "Failed to load CPU module 'm'"):
        assert "delete its folder, ~/.cache/warp" in str(make_sendable(RuntimeError(text)))
    assert "~/.cache/warp" not in str(make_sendable(RuntimeError("something else")))
    error = RuntimeError("Failed to load the shared library 'warp.so'")
    error.__cause__ = OSError("warp.so: failed to map segment from shared object")
    for cause in (MemoryError(), error):
        sent = make_sendable(cause)
        assert type(sent) is OutOfMemory
        assert str(sent).startswith("a worker could not start: out of memory")
        assert "\n" not in str(sent)
    # Errors that cannot be pickled arrive as their nearest base class.
    arrived = make_sendable(Stubborn())
    assert type(arrived) is SampleError
    assert str(arrived).startswith("scene 3: no valid layout")


def with_standby(standby: StandbyWorker) -> Settings:
    """Settings of a run whose first worker has waited for it."""
    return Settings(
        open_pool=partial(open_worker_pool, standby=standby), write_media=write_raw_images
    )


@pytest.mark.slow
def test_a_worker_that_stood_by_makes_the_same_files(tmp_path: Path, reference_digest: str) -> None:
    """It takes part until it is dismissed; its output goes to the log of the first worker."""
    with StandbyWorker() as standby:
        make(tmp_path / "out", workers=1, settings=with_standby(standby))
    assert standby.process.returncode == 0
    assert tree_digest(tmp_path / "out") == reference_digest
    assert notes_of(tmp_path / "out") == []


def test_a_worker_that_died_standing_by_is_replaced(tmp_path: Path, reference_digest: str) -> None:
    """The run starts another process in its place."""
    with StandbyWorker() as standby:
        standby.process.kill()
        standby.process.wait()
        make(tmp_path / "out", workers=1, settings=with_standby(standby))
    assert tree_digest(tmp_path / "out") == reference_digest
    assert notes_of(tmp_path / "out") == []


def test_a_worker_without_a_job_does_not_outlive_the_plan() -> None:
    """As after an error in a configuration."""
    with pytest.raises(KeyError), StandbyWorker() as standby:
        raise KeyError
    assert standby.process.returncode == -signal.SIGKILL
