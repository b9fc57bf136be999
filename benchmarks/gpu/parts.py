"""Parts of the measurement, each in a separate process with a time limit.

A part that fails, hangs or kills its process loses only its own figures. Functions are named
``module:function`` below this package; arguments and results are JSON.
"""

import faulthandler
import json
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).parents[2]
AS_ON_GPU = "cpu-as-gpu"
"""Name of the CPU that takes the path of a GPU."""
_MARK = "benchmarks.gpu result: "


@dataclass(frozen=True)
class Result:
    """Outcome of a part.

    Attributes:
        name: Name of the part, with its configuration.
        seconds: From start to end.
        value: JSON; None after a failure.
        failure: File, kernel and error; empty if there is none.
    """

    name: str
    seconds: float
    value: Any
    failure: str


def run_part(name: str, function: str, limit_s: float, /, **arguments: Any) -> Result:
    """Call a function in a separate process."""
    started_s = time.perf_counter()
    command = [sys.executable, "-m", "benchmarks.gpu.parts", function, json.dumps(arguments)]
    try:
        done = subprocess.run(
            command, cwd=_ROOT, capture_output=True, text=True, timeout=limit_s, check=False
        )
        text, failure = done.stdout, _why(done.returncode, done.stderr)
    except subprocess.TimeoutExpired:
        text, failure = "", f"left out: not finished within {limit_s:.0f} s"
    value = None
    for line in text.splitlines():
        if line.startswith(_MARK):
            answer = json.loads(line.removeprefix(_MARK))
            value, failure = answer["value"], answer["failure"]
    return Result(name, time.perf_counter() - started_s, value, failure)


def _why(code: int, errors: str) -> str:
    return f"exit code {code}: {' | '.join(errors.strip().splitlines()[-6:])}"


@contextmanager
def named_kernels(synchronize: bool) -> Iterator[list[str]]:
    """Keep the name of the latest kernel; wait for each of them if its errors are to have it."""
    import warp as wp

    latest = [""]
    launch = wp.launch

    def noted(kernel: Any, *arguments: Any, **options: Any) -> Any:
        latest[0] = f"{kernel.module.name.rpartition('warp.')[2]}.{kernel.key}"
        result = launch(kernel, *arguments, **options)
        if synchronize:
            wp.synchronize()
        return result

    wp.launch = noted
    try:
        yield latest
    finally:
        wp.launch = launch


def _place(error: BaseException) -> str:
    """The innermost line of this project in the traceback of an error."""
    own = [
        f for f in traceback.extract_tb(error.__traceback__) if _ROOT in Path(f.filename).parents
    ]
    return f"{Path(own[-1].filename).relative_to(_ROOT)}:{own[-1].lineno}" if own else "?"


def main(arguments: Sequence[str]) -> None:
    """Run one part, and print its result as JSON."""
    faulthandler.enable()
    module, _, function = arguments[0].partition(":")
    values = json.loads(arguments[1])
    value, failure = None, ""
    if values.get("device") == AS_ON_GPU:
        from benchmarks.gpu import as_on_gpu

        as_on_gpu.pretend()
        values["device"] = "cpu"
    with named_kernels(synchronize=module == "references") as kernel:
        try:
            value = getattr(import_module(f"benchmarks.gpu.{module}"), function)(**values)
        except Exception as error:
            traceback.print_exc()
            text = str(error).strip().splitlines() or [""]
            failure = (
                f"{_place(error)}: kernel {kernel[0] or 'none'}: {type(error).__name__}: {text[0]}"
            )
    print(_MARK + json.dumps({"value": value, "failure": failure}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
