"""Workers that are hit while they start: the moment when nobody listens yet."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.end_to_end.running import environment
from tests.runner.doubles import RESUME, notes_of
from tests.runner.test_processes import HANG_S, ROOT, processes_of_session, start_fake_run, wait_for

PIPE_BYTES = 65_536
"""Capacity of a pipe on Linux (``man 7 pipe``)."""

AT_BIRTH = """
import os, signal, sys
# The command that starts a worker names its module; helpers of the standard library do not.
if any("gen_data.runner.worker" in a for a in sys.orig_argv):
    try:
        os.close(os.open({marker!r}, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        pass
    else:
        {action}
"""
"""A ``sitecustomize`` module: Python runs it before this project's code, here in the first
worker."""

SIGNALS_AT_BIRTH = {
    "ctrl-c": "os.killpg(os.getpgrp(), signal.SIGINT)",
    "SIGINT to the supervisor": "os.kill(os.getppid(), signal.SIGINT)",
    "SIGTERM to the supervisor": "os.kill(os.getppid(), signal.SIGTERM)",
    "ctrl-c, then the worker hangs": "os.killpg(os.getpgrp(), signal.SIGINT); signal.pause()",
    "SIGTERM, then the worker stops": (
        "os.kill(os.getppid(), signal.SIGTERM); os.kill(os.getpid(), signal.SIGSTOP)"
    ),
}


def with_action_at_birth(folder: Path, action: str) -> Mapping[str, str]:
    """The environment in which the first worker does something before it is a worker."""
    text = AT_BIRTH.format(marker=str(folder / "born"), action=action)
    (folder / "sitecustomize.py").write_text(text)
    return environment(folder)


def finish(process: subprocess.Popen[str]) -> str:
    """Output of a run until its end; a run that does not end is killed and fails the test."""
    try:
        return process.communicate(timeout=HANG_S)[1]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        process.communicate()
        raise


@pytest.mark.slow
@pytest.mark.parametrize(
    ("action", "ballast_bytes", "note", "log"),
    [("os.kill(os.getpid(), signal.SIGKILL)", 3 * PIPE_BYTES,
      "killed by signal 9 (SIGKILL); out of memory? while starting", ""),
     ("sys.modules['gen_data.runner'] = None", 0, "exited with status 1 while starting",
      "ModuleNotFoundError")],
    ids=["killed while nobody reads a job three times as large as a pipe", "cannot be imported"],
)  # fmt: skip
def test_a_worker_that_ends_at_birth_is_replaced_and_reported_in_the_run_folder(
    tmp_path: Path, action: str, ballast_bytes: int, note: str, log: str
) -> None:
    """The terminal shows no traceback of a process that the user never started."""
    environment = with_action_at_birth(tmp_path, action)
    process = start_fake_run(tmp_path / "out", 1, 0.0, ballast_bytes, environment=environment)
    message = finish(process)
    assert (process.returncode, message) == (0, "")
    assert note in notes_of(tmp_path / "out")[0]
    assert log in (tmp_path / "out/run/worker-0.log").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("action", "ballast_bytes"),
    [(SIGNALS_AT_BIRTH["ctrl-c"], 0),
     *(pytest.param(action, 3 * PIPE_BYTES, id=k) for k, action in SIGNALS_AT_BIRTH.items())],
)  # fmt: skip
def test_a_signal_at_a_start_ends_the_run(tmp_path: Path, action: str, ballast_bytes: int) -> None:
    """Exit code 130, the command to go on with and no traceback; no process is left."""
    environment = with_action_at_birth(tmp_path, action)
    process = start_fake_run(tmp_path / "out", 2, 0.1, ballast_bytes, environment=environment)
    message = finish(process)
    assert process.returncode == 130, message
    assert RESUME in message
    assert "Traceback" not in message
    wait_for(lambda: processes_of_session(process.pid) == [])


def test_a_supervisor_killed_while_a_worker_starts_leaves_nobody(tmp_path: Path) -> None:
    """The new worker finds itself without a parent and ends, silently."""
    environment = with_action_at_birth(tmp_path, "os.kill(os.getppid(), signal.SIGKILL)")
    process = start_fake_run(tmp_path / "out", 1, 0.0, environment=environment)
    message = finish(process)
    assert message == ""
    wait_for(lambda: processes_of_session(process.pid) == [])


def test_a_worker_that_cannot_be_killed_does_not_keep_the_run(tmp_path: Path) -> None:
    """A process stuck in the kernel ignores SIGKILL: Ctrl-C ends the run all the same."""
    program = (
        "import subprocess, sys, types\n"
        "from tests.runner import fake_run\n"
        "from gen_data.runner import processes\n"
        "processes.JOIN_S = 0.2\n"
        "subprocess.Popen.kill = lambda self: None\n"
        "sys.exit(fake_run.main())\n"
    )
    action = "signal.signal(2, 1); os.killpg(os.getpgrp(), signal.SIGINT); signal.pause()"
    command = [sys.executable, "-c", program, str(tmp_path / "out"), "1", "0"]
    environment = with_action_at_birth(tmp_path, action)
    options = {"stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    process = subprocess.Popen(command, cwd=ROOT, env=environment, **options)
    message = finish(process)
    # Nobody else ends the worker: it sleeps before it could tie itself to its parent.
    (worker,) = processes_of_session(process.pid)
    os.kill(worker, signal.SIGKILL)
    assert process.returncode == 130, message
    assert RESUME in message
