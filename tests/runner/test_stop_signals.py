"""Ctrl-C, SIGTERM and SIGHUP during any command: real processes that run a few lines."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gen_data.api import generate as generate_module
from gen_data.cli.main import cli
from gen_data.core.errors import Interrupted
from gen_data.runner import run as run_module
from gen_data.runner.termination_signals import Interruption
from tests.carry_over.labelled import write_coco
from tests.runner.doubles import FakeFactory, fake_plan, write_raw_images
from tests.runner.test_processes import HANG_S, ROOT, wait_for

START = """
import pathlib, signal, sys, time
import click
# nohup(1), as around a whole test run, lets children ignore it.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from gen_data.cli import main as command_line, stop_signals
stop_signals.PATIENCE_S = 1.0
def begun():
    pathlib.Path(sys.argv[1]).touch()
@click.command()
@click.argument("marker")
def command(marker):
{body}
command_line.cli = command
command_line.main()
"""
"""The command line with another command; it touches a file when it has begun."""

SLEEPS = """
    try:
        begun()
        time.sleep(600)
    finally:
        print("cleaned up", flush=True)
"""
SWALLOWS = """
    begun()
    for _ in range(600):
        try:
            time.sleep(1)
        except KeyboardInterrupt:
            pass
"""
COMPUTES = """
    import hashlib
    begun()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""
TRANSLATES = """
    begun()
    try:
        time.sleep(600)
    except KeyboardInterrupt:
        raise ImportError("a library could not be imported")
"""
CLEANS_UP_FOR_LONG = """
    stop_signals.PATIENCE_S = 600.0
    try:
        begun()
        time.sleep(600)
    finally:
        begun_cleaning = pathlib.Path(sys.argv[1] + "-cleaning").touch()
        time.sleep(600)
"""


def start(body: str, folder: Path) -> subprocess.Popen[str]:
    marker = folder / "begun"
    command = [sys.executable, "-c", START.format(body=body), str(marker)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, cwd=ROOT, text=True, **pipes)
    wait_for(marker.exists)
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_lets_a_command_clean_up(tmp_path: Path, number: signal.Signals) -> None:
    """Exit code 130, one line, and the command's final steps are done."""
    process = start(SLEEPS, tmp_path)
    process.send_signal(number)
    printed, message = process.communicate(timeout=HANG_S)
    assert (process.returncode, printed) == (130, "cleaned up\n")
    assert message.strip() == "gen-data: interrupted"


@pytest.mark.parametrize(
    ("body", "number"),
    [(SWALLOWS, signal.SIGTERM), (COMPUTES, signal.SIGTERM), (TRANSLATES, signal.SIGINT)],
    ids=["swallowed", "native code", "an interrupted import, which is an ImportError"],
)
def test_a_signal_without_effect_ends_the_process_all_the_same(
    tmp_path: Path, body: str, number: signal.Signals
) -> None:
    """Code that drops KeyboardInterrupt, or computes for hours, is ended after the patience."""
    process = start(body, tmp_path)
    process.send_signal(number)
    message = process.communicate(timeout=HANG_S)[1]
    assert (process.returncode, message.strip()) == (130, "gen-data: interrupted")


@pytest.mark.parametrize(
    "error", ["MemoryError", "ImportError('x.so: failed to map segment from shared object')"]
)
def test_lack_of_memory_is_one_line(tmp_path: Path, error: str) -> None:
    """Under ``ulimit -v``, libraries cannot even be loaded; a traceback would not help."""
    process = start(f"\n    begun()\n    raise {error}\n", tmp_path)
    message = process.communicate(timeout=HANG_S)[1]
    assert process.returncode == 6
    assert message.startswith("gen-data: out of memory: the system refused more memory")
    assert len(message.splitlines()) == 1


def test_the_second_ctrl_c_is_immediate(tmp_path: Path) -> None:
    """Cleaning up takes ten minutes; the second signal ends it."""
    process = start(CLEANS_UP_FOR_LONG, tmp_path)
    process.send_signal(signal.SIGINT)
    wait_for((tmp_path / "begun-cleaning").exists)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    message = process.communicate(timeout=HANG_S)[1]
    assert process.returncode == 130
    assert message.strip() == "gen-data: interrupted twice, stopped at once"


@pytest.mark.parametrize(
    ("command", "text"), [("again", "kept; resume with:\n    again"), ("", "nothing is kept")]
)
def test_an_interrupted_run_names_a_command_only_where_shards_stay(
    command: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Temporary folders go, with all finished shards in them."""
    messages: list[str] = []

    def interruption(message: str) -> Interruption:
        messages.append(message)
        return Interruption(message)

    monkeypatch.setattr(run_module, "Interruption", interruption)
    settings = run_module.Settings(resume_command=command, write_media=write_raw_images)
    run_module.run(fake_plan(2), FakeFactory(2), tmp_path / "set", settings)
    assert [message.endswith(text) for message in messages] == [True]


@pytest.mark.parametrize(
    "arguments",
    [["plan", "tabletop.yaml", "--n", "10", "--probe", "2"],
     ["report", "tabletop.yaml", "--compare-real", "REAL"]],
)  # fmt: skip
def test_samples_of_temporary_folders_cannot_be_resumed(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their commands named "the same call of gen_data.generate" after Ctrl-C."""
    write_coco(tmp_path / "real", 1, pictures=2)

    def interrupted(*_: object, resume_command: str = "default", **__: object) -> None:
        raise Interrupted(resume_command)

    monkeypatch.setattr(generate_module, "generate", interrupted)
    words = [str(tmp_path / "real") if word == "REAL" else word for word in arguments]
    with pytest.raises(Interrupted) as caught:
        cli.main(words, standalone_mode=False)
    assert str(caught.value) == ""
