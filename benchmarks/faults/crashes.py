"""Crashes and errors of the disk during a run; afterwards the same command goes on."""

import errno
import os
import random
import shutil
import signal
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TypeVar

import pytest

from benchmarks.faults import children
from benchmarks.faults.recorded_run import RESUME, record, reference_digest, resumes_to, tree_digest
from benchmarks.faults.results import Result, Scale
from gen_data.core.errors import GenDataError, StorageError
from tests.runner.fragile_disk import FragileDisk, Killed

T = TypeVar("T")

ERRNOS = ("ENOSPC", "EDQUOT", "EIO", "EROFS", "EACCES", "EMFILE")
PLANTED_BUGS = {
    "folders of shards not synced": ("store.sync_tree", lambda folder, synced: None),
    "merged folders not synced": ("finalize.sync_tree", lambda folder, synced: None),
    "records and plan not synced": (
        "store.write_durably",
        lambda path, data, scratch: path.write_bytes(data),
    ),
    "manifest and sums not synced": (
        "store.LocalStore.replace_file",
        lambda store, name, data, scratch: (store.root / name).write_bytes(data),
    ),
    "parents of new names not synced": ("durable_files.sync_path", lambda path: None),
}
RUN_S = 4.0
"""Instants of kills are drawn from this duration of a run with two worker processes."""


def kills_at_calls(scale: Scale, folder: Path) -> Result:
    """SIGKILL at every system call of a run that changes a file, then resumption."""
    result = Result()
    if shutil.which("strace") is None:
        result.skip("all", "strace is not installed")
        return result
    digest = reference_digest(folder)
    calls = children.writing_calls(folder)
    chosen = calls if scale.is_full else calls[:: max(1, len(calls) // 12)]
    result.notes.append(f"{len(calls)} writing system calls in a run of 3 shards")
    _judge_all(result, scale, partial(_kill_at, folder, digest), chosen)
    return result


def _judge_all(result: Result, scale: Scale, judge: Callable[[T], str], tasks: Sequence[T]) -> None:
    """Count tasks, judged in forked processes: an empty text is a promise that held."""
    problems = children.spread(judge, tasks)
    for task in result.until_end(scale, tasks):
        problem = next(problems)
        result.add(not problem, f"{task}: {problem}")


def _kill_at(folder: Path, digest: str, call: children.Call) -> str:
    out = folder / f"killed-{call.name}-{call.number}"
    inject = f"inject={call.name}:signal=SIGKILL:when={call.number}"
    ended = children.trace(out, "-o", "/dev/null", "-e", f"trace={call.name}", "-e", inject)
    problem = resumes_to(out, digest) if ended.code == -signal.SIGKILL else "it was not killed"
    shutil.rmtree(out, ignore_errors=True)
    return problem


def errnos_at_calls(scale: Scale, folder: Path) -> Result:
    """An error of one system call, of all kinds in turn; one message, then resumption."""
    result = Result()
    if shutil.which("strace") is None:
        result.skip("all", "strace is not installed")
        return result
    digest = reference_digest(folder)
    calls = [call for call in children.writing_calls(folder) if call.name != "close"]
    tasks = [(call, ERRNOS[k % len(ERRNOS)]) for k, call in enumerate(calls)]
    chosen = tasks if scale.is_full else tasks[:: max(1, len(tasks) // 12)]
    _judge_all(result, scale, partial(_fail_at, folder, digest), chosen)
    return result


def _fail_at(folder: Path, digest: str, task: tuple[children.Call, str]) -> str:
    call, name = task
    out = folder / f"failed-{call.name}-{call.number}"
    inject = f"inject={call.name}:error={name}:when={call.number}"
    ended = children.trace(out, "-o", "/dev/null", "-e", f"trace={call.name}", "-e", inject)
    problem = _judge_error(ended, out, name) or resumes_to(out, digest)
    shutil.rmtree(out, ignore_errors=True)
    return problem


def _judge_error(ended: children.Ended, out: Path, name: str) -> str:
    """Whether an error ended in success, or in one message with path, error and command."""
    if ended.code == 0:
        return ""
    if ended.code != StorageError.exit_code:
        return f"exit code {ended.code}: {ended.message[-300:]}"
    facts = (f"({name})", str(out), RESUME)
    missing = [fact for fact in facts if fact not in ended.message]
    return f"{missing} is missing in: {ended.message}" if missing else ""


def errnos_for_ever(scale: Scale, folder: Path) -> Result:
    """Every error at the k-th operation and all later ones, for every k, then resumption."""
    digest = reference_digest(folder)
    count = _count_operations(folder)
    tasks = [(k, name) for k in range(1, count + 1) for name in ERRNOS]
    chosen = tasks if scale.is_full else tasks[:: max(1, len(tasks) // 30)]
    result = Result(notes=[f"{count} operations, {len(ERRNOS)} errors"])
    result.skip("EINTR, short writes", "Python repeats these calls itself")
    _judge_all(result, scale, partial(_break_at, folder, digest), chosen)
    return result


def _count_operations(folder: Path) -> int:
    disk = FragileDisk(folder / "counted", folder / "attic")
    with pytest.MonkeyPatch.context() as patch:
        disk.install(patch)
        record().make(folder / "counted")
    return disk.count


def _break_at(folder: Path, digest: str, task: tuple[int, str]) -> str:
    k, name = task
    out = folder / f"broken-{k}-{name}"
    number = getattr(errno, name)
    message = ""
    with pytest.MonkeyPatch.context() as patch:
        FragileDisk(out, folder / f"attic-{k}-{name}", fail_at=k, errno=number).install(patch)
        try:
            record().make(out)
            code = 0
        except GenDataError as error:
            code, message = error.exit_code, str(error)
        except OSError as error:
            code, message = children.UNEXPECTED, repr(error)
    problem = _judge_error(children.Ended(code, message), out, name) or resumes_to(out, digest)
    shutil.rmtree(out, ignore_errors=True)
    return problem


def crash_states(scale: Scale, folder: Path) -> Result:
    """Power cuts in a model of the disk: unsynced bytes and names are lost at random."""
    digest = reference_digest(folder)
    count = _count_operations(folder)
    states = scale.pick(20_000, 150)
    tasks = [(k % (count + 1), scale.seed + k) for k in range(states)]
    result = Result()
    kinds = set()
    problems = children.spread(partial(_cut_power_at, folder, digest), tasks)
    for task in result.until_end(scale, tasks):
        state, problem = next(problems)
        kinds.add(state)
        result.add(not problem, f"operation {task[0]}, seed {task[1]}: {problem}")
    result.notes.append(f"{len(kinds)} different states at {count + 1} instants")
    caught = sum(_is_caught(folder, digest, place, bug) for place, bug in PLANTED_BUGS.values())
    result.notes.append(f"{caught} of {len(PLANTED_BUGS)} planted bugs caught")
    result.add(caught == len(PLANTED_BUGS), "a planted bug was not caught")
    return result


def _is_caught(folder: Path, digest: str, place: str, bug: object) -> bool:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"gen_data.runner.{place}", bug)
        problems = [_cut_power_at(folder, digest, (0, seed))[1] for seed in range(12)]
    return any(problems)


def _cut_power_at(folder: Path, digest: str, task: tuple[int, int]) -> tuple[str, str]:
    """Digest of the folder after a cut at an operation (0 = after the end), and the problem."""
    k, seed = task
    out, attic = folder / f"cut-{k}-{seed}", folder / f"attic-{k}-{seed}"
    disk = FragileDisk(out, attic, fail_at=k)
    with pytest.MonkeyPatch.context() as patch:
        disk.install(patch)
        with suppress(Killed):
            record().make(out)
        disk.cut_power(seed)
    state = tree_digest(out) if out.exists() else ""
    if not (out / "manifest.json").exists():
        problem = resumes_to(out, digest) if k else "a finished data set was lost"
    else:
        problem = "" if state == digest else "a finished data set has other bytes"
    shutil.rmtree(out, ignore_errors=True)
    shutil.rmtree(attic, ignore_errors=True)
    return state, problem


def kills_at_instants(scale: Scale, folder: Path) -> Result:
    """SIGKILL of processes of a run with two workers at random instants, then resumption."""
    rng = random.Random(scale.seed)
    digest = reference_digest(folder)
    result = Result()
    early, twice, late = (scale.pick(50, 2), scale.pick(50, 1), scale.pick(100, 1))
    plans = [[rng.uniform(0.0, 2.0)] for _ in range(early)]
    plans += [[rng.uniform(0.0, RUN_S), rng.uniform(0.0, RUN_S)] for _ in range(twice)]
    plans += [[rng.uniform(0.0, RUN_S)] for _ in range(late)]
    rng.shuffle(plans)
    kills = 0
    for number, instants_s in enumerate(result.until_end(scale, plans)):
        out = folder / f"instants-{number}"
        problem = ""
        for instant_s in instants_s:
            killed, problem = _kill_after(out, instant_s, rng.choice(TARGETS), digest)
            kills += killed
            if problem:
                break
        problem = problem or resumes_to(out, digest)
        result.add(not problem, f"{number}, {instants_s} s: {problem}")
        shutil.rmtree(out, ignore_errors=True)
    result.notes.append(
        f"{kills} kills; planned are {early} in the first 2 s, {twice} runs that are killed again "
        f"while they resume, and {late} more"
    )
    result.skip("runs on Ray", "the tests of the Ray backend kill its nodes")
    return result


TARGETS = ("group", "group", "supervisor", "supervisor", "one worker", "all workers")
HANG_S = 120.0


def _kill_after(out: Path, instant_s: float, target: str, digest: str) -> tuple[bool, str]:
    """Whether a process was killed, and the fault afterwards if any."""
    message = out.with_name(f"{out.name}.message")
    pid = children.fork_run(out, message, workers=2, delay_s=0.2)
    time.sleep(instant_s)
    if os.waitpid(pid, os.WNOHANG)[0]:
        return False, ""
    workers = _children_of(pid)
    if target == "group":
        os.killpg(pid, signal.SIGKILL)
    elif target == "supervisor" or not workers:
        os.kill(pid, signal.SIGKILL)
    else:
        for worker in workers[: 1 if target == "one worker" else None]:
            _kill(worker)
        code = _wait_at_most(pid, HANG_S)
        if code is None:
            os.killpg(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return True, f"{target} killed: the run hangs"
        if code != 0:
            return True, f"{target} killed: exit code {code}"
        return True, "" if tree_digest(out) == digest else f"{target} killed: other bytes"
    os.waitpid(pid, 0)
    deadline_s = time.monotonic() + 5.0
    while any(_is_alive(worker) for worker in workers):
        if time.monotonic() > deadline_s:
            return True, f"{target} killed: workers live on"
        time.sleep(0.01)
    return True, ""


def _children_of(pid: int) -> list[int]:
    """Worker processes of a supervisor; other helpers of multiprocessing end with them."""
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    except OSError:
        return []
    found = []
    for child in map(int, text.split()):
        try:
            line = Path(f"/proc/{child}/cmdline").read_bytes()
        except OSError:
            continue
        if b"resource_tracker" not in line:
            found.append(child)
    return found


def _is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def _kill(pid: int) -> None:
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def _wait_at_most(pid: int, seconds: float) -> int | None:
    """Exit code of a child; None if it does not end."""
    deadline_s = time.monotonic() + seconds
    while time.monotonic() < deadline_s:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    return None
