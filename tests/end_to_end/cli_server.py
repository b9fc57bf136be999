"""Run the command line in forks of one process that has imported it.

``python -m tests.end_to_end.cli_server`` reads requests from its standard input, a line of JSON
each, and answers each with the exit code. Each command has a process of its own, with its own
folder, environment and streams; only imports and reads of the package's own files, seconds for each
command, happen once.
"""

import atexit
import gc
import importlib
import json
import os
import pkgutil
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import gen_data

PACKAGES = tuple(
    module.name
    for module in pkgutil.iter_modules(gen_data.__path__)
    if module.ispkg and module.name not in ("configs", "generator", "tests", "gen_data")
)
LEFT_OUT = (
    "__main__", "rerun_recording", "study.detector", "study.pretrained", "study.run_training",
    "study.training",
)  # fmt: skip
"""Ends of names of modules that run when imported, or whose libraries start threads, as torch."""


def serve() -> None:
    """Answer requests until the input ends; a fork ends with the exit code of its command."""
    from gen_data.core.processes import SINGLE_THREADED

    # As the command line does, before NumPy is imported.
    os.environ.update(dict.fromkeys(SINGLE_THREADED, "1"))
    _import_all()
    from gen_data.assemble.config import load_config
    from gen_data.assets.library import open_library
    from gen_data.cli.main import main

    # Models of plug-ins, and the list of built-in assets.
    load_config("tabletop.yaml")
    open_library().find({"mug"})
    if len(list(Path("/proc/self/task").iterdir())) > 1:
        raise RuntimeError("an import started a thread: forks of this process may hang")
    gc.freeze()  # a collection would copy the memory that forks share
    for line in sys.stdin:
        process_id = os.fork()
        if process_id == 0:
            _enter(json.loads(line))
            _leave(main)
        status = os.waitpid(process_id, 0)[1]
        print(os.waitstatus_to_exitcode(status), flush=True)


def _import_all() -> None:
    for name in PACKAGES:
        package = importlib.import_module(f"gen_data.{name}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith(LEFT_OUT):
                _import_if_possible(module.name)


def _import_if_possible(name: str) -> None:
    """Leave out what needs a physics engine that has no wheel for this interpreter."""
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name not in ("mujoco", "pybullet"):
            raise


def _enter(request: dict[str, Any]) -> None:
    """Make this process the one of a command: folder, environment, arguments and streams."""
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["gen-data", *request["arguments"]]
    for number, path in enumerate((os.devnull, request["stdout"], request["stderr"])):
        opened = os.open(path, os.O_RDWR)
        os.dup2(opened, number)
        os.close(opened)


def _leave(main: Callable[[], None]) -> NoReturn:
    """Run a command and end this process without taking the imported modules down."""
    code: Any = 0
    try:
        main()
    except SystemExit as end:
        code = end.code
    except BaseException:
        traceback.print_exc()
        code = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code or 0)


if __name__ == "__main__":
    serve()
