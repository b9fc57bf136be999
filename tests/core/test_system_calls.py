"""Systems with fewer calls than Linux, imitated in separate processes.

Neither macOS nor Windows runs here: what is tested is that everything works without the calls that
they lack. Their own calls are replaced by ones that do the same.
"""

import os
import re
import subprocess
import sys
import textwrap
from contextlib import suppress
from pathlib import Path

import pytest

from gen_data.core import system_calls
from gen_data.core.system_calls import anonymous_file, try_lock, wake_channel
from tests.runner.test_processes import wait_for

ROOT = Path(__file__).parents[2]

MACOS = """
    import os, sys
    from gen_data.core import processes
    for name in ("memfd_create", "pipe2", "sched_getaffinity"):
        delattr(os, name)
    processes._has_death_signal = lambda: False
"""
"""Python without the calls that only Linux has."""

WINDOWS = """
    import fcntl, os, resource, select, signal, sys, types
    import gen_data.core.processes as processes

    class Msvcrt(types.ModuleType):
        LK_NBLCK = 2
        def setmode(self, descriptor, mode): ...
        def locking(self, descriptor, mode, size):
            assert mode == self.LK_NBLCK and size == 1
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, os.lseek(descriptor, 0, 1))

    sys.modules.update(msvcrt=Msvcrt("msvcrt"), fcntl=None, resource=None)
    for name in ("memfd_create", "pipe2", "sched_getaffinity", "fork", "register_at_fork", "getuid",
                 "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "sync", "pread"):
        delattr(os, name)
    for name in ("SIGHUP", "SIGKILL", "SIGXCPU", "pthread_sigmask"):
        delattr(signal, name)
    del select.poll
    os.O_BINARY = 0
    processes._has_death_signal = lambda: False
"""
"""Python without what Windows lacks, and with a lock that is one of POSIX."""


def program(system: str, code: str) -> list[str]:
    """Command that runs code on an imitated system; processes that it starts are of Linux."""
    return [sys.executable, "-c", textwrap.dedent(system) + textwrap.dedent(code)]


def run(system: str, code: str, folder: Path) -> str:
    done = subprocess.run(
        program(system, code),
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


GENERATE = """
    import gen_data, json
    from pathlib import Path
    small = ("sensors[0].size_px=[64, 48]", "randomizers.clutter.count=2")
    gen_data.generate("tabletop.yaml", n=2, out="out", workers={workers}, overrides=small)
    print(json.loads(Path("out/manifest.json").read_text())["dataset_id"])
"""


@pytest.fixture(scope="module")
def linux_id(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Id of the data set, made with everything that Linux has."""
    return run("", GENERATE.format(workers=0), tmp_path_factory.mktemp("linux"))


@pytest.mark.slow
@pytest.mark.parametrize(("system", "workers"), [(MACOS, 1), (WINDOWS, None)])
def test_a_data_set_is_the_same_on_a_system_with_fewer_calls(
    system: str, workers: int | None, linux_id: str, tmp_path: Path
) -> None:
    """Locks, temporary folders, readers of files, signals and workers have their stand-ins."""
    assert run(system, GENERATE.format(workers=workers), tmp_path) == linux_id


def test_workers_that_a_system_cannot_have_are_refused(tmp_path: Path) -> None:
    code = """
        import gen_data
        try:
            gen_data.generate("tabletop.yaml", n=2, out="out", workers=2)
        except gen_data.GenDataError as error:
            print(error)
    """

    assert run(WINDOWS, code, tmp_path).startswith("workers: 2; expected 0")


@pytest.mark.parametrize("system", [MACOS, WINDOWS])
def test_a_data_set_in_use_is_locked(system: str, tmp_path: Path) -> None:
    """A second process does not get the lock until the first one has ended."""
    code = """
        import os
        from gen_data.core.system_calls import try_lock
        got = try_lock(os.open("lock", os.O_RDWR | os.O_CREAT))
        print(got, flush=True)
        sys.stdin.read()
    """
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": tmp_path}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}

    def start() -> subprocess.Popen[str]:
        return subprocess.Popen(program(system, code), env=environment, **pipes)  # type: ignore[call-overload,no-any-return]

    first = start()
    assert first.stdout.readline() == "True\n"  # type: ignore[union-attr]
    assert start().communicate()[0] == "False\n"
    first.kill()
    first.communicate()
    assert start().communicate()[0] == "True\n"


def test_a_helper_ends_with_its_parent_where_no_kernel_ends_it(tmp_path: Path) -> None:
    """A thread watches the parent, and the helper's own child goes with it."""
    helper = tmp_path / "helper.py"
    helper.write_text(
        "import sys\n"
        "from gen_data.core import processes\n"
        "processes._has_death_signal = lambda: False\n"
        "processes._main(int(sys.argv[1]), sys.argv[2:])\n"
    )
    code = f"""
        import os, subprocess, sys
        child = subprocess.Popen(
            [sys.executable, {str(helper)!r}, str(os.getpid()), "--", "sleep", "617"]
        )
        print(child.pid, flush=True)
        child.wait()
    """
    parent = subprocess.Popen(
        program("", code),
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    number = int(parent.stdout.readline())
    children = Path(f"/proc/{number}/task/{number}/children")
    wait_for(lambda: bool(children.read_text().split()))
    sleeper = Path("/proc") / children.read_text().split()[0]

    parent.kill()
    parent.communicate()

    wait_for(lambda: not Path(f"/proc/{number}").exists())
    wait_for(lambda: not sleeper.exists())


def test_a_file_without_a_path_needs_no_memory_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """It holds the written bytes, for whoever has its descriptor."""
    monkeypatch.delattr(os, "memfd_create")
    descriptor = anonymous_file("job")
    os.write(descriptor, b"content")

    assert os.pread(descriptor, 100, 0) == b"content"
    assert os.fstat(descriptor).st_nlink == 0
    os.close(descriptor)


def test_a_full_wake_channel_does_not_block() -> None:
    """A signal handler must not wait for the main program."""
    reader, writer = wake_channel()
    sent = 0
    with suppress(BlockingIOError):
        while sent < 1 << 30:
            sent += writer.send(b"x" * 4096)
    assert sent < 1 << 30
    assert reader.recv(1) == b"x"
    reader.close()
    writer.close()


def test_a_lock_is_of_the_open_file(tmp_path: Path) -> None:
    """The same process with another descriptor is another holder."""
    one, other = (os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT) for _ in range(2))

    assert try_lock(one)
    assert not try_lock(other)
    os.close(one)
    assert try_lock(other)
    os.close(other)


def test_no_other_module_calls_what_only_some_systems_have() -> None:
    """All of it is behind the functions of one module, or behind a question for the call."""
    few = re.compile(r"\bimport (fcntl|resource)$|os\.(pipe2|memfd_create|sched_getaffinity)")
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for folder in ("generator", "content", "lab", "randomizers", "exporters", "scene_templates")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path != Path(system_calls.__file__).resolve()
        for line in path.read_text().splitlines()
        if few.search(line)
    ]

    assert found == ["generator/core/processes.py: import resource"]
