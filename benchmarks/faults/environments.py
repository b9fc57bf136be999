"""The same command in environments that a user may have."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.faults import recorded_run, results

ROOT = Path(__file__).parents[2]
N = 4


@dataclass(frozen=True)
class Environment:
    """Environment in which a command is started.

    Attributes:
        variables: Environment variables; None = unset.
        cwd, out: Folders; ``{folder}`` is the campaign's own, which is writable by every user.
        prefix: Words before the command.
        options: Options of the command.
        umask: Umask of the process.
        needs: Program without which it is skipped.
    """

    variables: dict[str, str | None] = field(default_factory=dict)
    cwd: str = "{folder}"
    out: str = "{folder}/out"
    prefix: tuple[str, ...] = ()
    options: tuple[str, ...] = ("--workers", "0")
    umask: int = 0o022
    needs: str = ""


def _named(**values: str | None) -> Environment:
    return Environment(dict(values))


def _clock(instant: str) -> Environment:
    return Environment(prefix=("faketime", instant), needs="faketime")


ENVIRONMENTS = {
    "C locale": _named(LC_ALL="C", LANG="C"),
    "POSIX locale": _named(LC_ALL="POSIX"),
    "C.UTF-8 locale": _named(LC_ALL="C.UTF-8"),
    "Turkish locale": _named(LC_ALL="tr_TR.UTF-8", LANG="tr_TR.UTF-8"),
    "Japanese locale": _named(LANG="ja_JP.eucJP"),
    "no locale": _named(LC_ALL=None, LANG=None),
    "ASCII streams": _named(PYTHONIOENCODING="ascii", PYTHONUTF8="0"),
    "UTF-8 mode": _named(PYTHONUTF8="1"),
    "east": _named(TZ="Pacific/Kiritimati"),
    "west": _named(TZ="America/Adak"),
    "unknown time zone": _named(TZ="Nowhere/Atlantis"),
    "hash seed 0": _named(PYTHONHASHSEED="0"),
    "hash seed 1": _named(PYTHONHASHSEED="1"),
    "hash seed 4711": _named(PYTHONHASHSEED="4711"),
    "one OpenMP thread": _named(OMP_NUM_THREADS="1"),
    "eight OpenMP threads": _named(OMP_NUM_THREADS="8"),
    "three BLAS threads": _named(OPENBLAS_NUM_THREADS="3", MKL_NUM_THREADS="3"),
    "OpenBLAS for Nehalem": _named(OPENBLAS_CORETYPE="Nehalem"),
    "NumPy without AVX-512": _named(NPY_DISABLE_CPU_FEATURES="AVX512F AVX512CD AVX512_SKX"),
    "glibc without FMA": _named(GLIBC_TUNABLES="glibc.cpu.hwcaps=-FMA,-AVX2_Usable"),
    "OpenCV without IPP": _named(OPENCV_IPP="disabled"),
    "optimized Python": _named(PYTHONOPTIMIZE="2"),
    "development mode": _named(PYTHONDEVMODE="1", PYTHONWARNINGS="default"),
    "no bytecode": _named(PYTHONDONTWRITEBYTECODE="1"),
    "debug allocator": _named(PYTHONMALLOC="debug"),
    "narrow terminal": _named(COLUMNS="20", LINES="5"),
    "colours forced": _named(FORCE_COLOR="1", TERM="xterm-256color"),
    "dumb terminal": _named(TERM="dumb", NO_COLOR="1"),
    "temporary files on another disk": _named(TMPDIR="/dev/shm"),
    "no such temporary folder": _named(TMPDIR="/nowhere"),
    "no HOME": _named(HOME=None, XDG_CACHE_HOME="{cache}"),
    "folder /": Environment(cwd="/"),
    "folder with spaces, umlauts and a newline": Environment(out="{folder}/ä ö\n😀/out"),
    "long path": Environment(out="{folder}/" + "/".join(["n" * 100] * 3) + "/out"),
    "umask 077": Environment(umask=0o077),
    "umask 000": Environment(umask=0o000),
    "one worker": Environment(options=("--workers", "1")),
    "three workers": Environment(options=("--workers", "3")),
    "another user": Environment(
        {"HOME": "/nowhere", "XDG_CACHE_HOME": "{cache}"},
        prefix=("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"),
        needs="setpriv",
    ),
    "low priority": Environment(prefix=("nice", "-n", "15"), needs="nice"),
    "1971": _clock("1971-01-01 00:00:00"),
    "2038": _clock("2038-02-01 00:00:00"),
    "2106": _clock("2106-03-01 00:00:00"),
}

QUICK = "Turkish locale"
"""The one that a quick campaign has: lower and upper case are other letters there."""


def environments(scale: results.Scale, folder: Path) -> results.Result:
    """Generate the tiny data set in every environment; the first one is this process's own."""
    result = results.Result()
    names = list(ENVIRONMENTS)
    if not scale.is_full:
        names = [QUICK]
    folder.chmod(0o777)
    own = _generate(Environment(), folder / "own")
    digest = recorded_run.tree_digest(folder / "own/out")
    result.add(not own, f"own: {own}")
    for number, name in enumerate(result.until_end(scale, names)):
        environment = ENVIRONMENTS[name]
        if environment.needs and shutil.which(environment.needs) is None:
            result.skip(name, f"{environment.needs} is not installed")
            continue
        if environment.needs == "setpriv" and not _others_can_run(environment.prefix):
            result.skip(name, "only root can become that user, who must reach the interpreter")
            continue
        place = folder / str(number)
        problem = _generate(environment, place)
        outs = [path.parent for path in place.rglob("manifest.json")]
        if not problem and [recorded_run.tree_digest(out) for out in outs] != [digest]:
            problem = "other bytes"
        result.add(not problem, f"{name}: {problem}")
        shutil.rmtree(place, ignore_errors=True)
    return result


def _others_can_run(prefix: tuple[str, ...]) -> bool:
    """Whether the interpreter and this checkout can be used behind a prefix."""
    # The prefix may execute files that its processes may not.
    words = [sys.executable, "-c", "import gen_data"]
    inner = f"import subprocess; subprocess.run({words!r}, check=True)"
    command = [*prefix, sys.executable, "-c", inner]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, check=False
    )
    return done.returncode == 0


def _generate(environment: Environment, folder: Path) -> str:
    """Generate in a new folder; the fault, or nothing."""
    folder.mkdir(mode=0o777)
    folder.chmod(0o777)
    cache = os.environ.get("XDG_CACHE_HOME", str(Path("~/.cache").expanduser()))
    if environment.needs == "setpriv":
        # Another user cannot write to the cache of this one.
        cache = str(folder / "cache")
    places = {"folder": str(folder), "cache": cache}
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    for name, value in environment.variables.items():
        variables.pop(name, None)
        if value is not None:
            variables[name] = value.format(**places)
    out = environment.out.format(**places)
    command = [sys.executable, "-m", "gen_data.cli", "--config", str(recorded_run.CONFIG)]
    options = ["--n", str(N), "--out", out, *environment.options]
    old = os.umask(environment.umask)
    try:
        done = subprocess.run(
            [*environment.prefix, *command, *options], cwd=environment.cwd.format(**places),
            env=variables, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=300,
        )  # fmt: skip
    finally:
        os.umask(old)
    text = done.stderr.decode(errors="replace")
    return "" if done.returncode == 0 else f"exit code {done.returncode}: {text[-400:]}"
