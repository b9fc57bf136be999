"""One renderer in a separate process: ``python -m benchmarks.peers.worker NAME FOLDER CORE``.

Answers every line on standard input by writing all samples of FOLDER once, and one line of JSON
with the CPU seconds used (of all threads, with system time).
"""

import json
import os
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.peers.worlds import Images, World, read_worlds, write_files

Round = Callable[[], None]
"""Writes all samples of a folder once."""
RENDERERS = {
    "ours": "own:open_renderer",
    "ours, full samples": "own:open_pipeline",
    "TinyRenderer": "bullet:open_tiny",
    "TinyRenderer, no shadow": "bullet:open_tiny_unshadowed",
    "PyBullet EGL": "bullet:open_egl",
    "MuJoCo": "mujoco_gl:open_renderer",
    "pyrender": "pyrender_gl:open_renderer",
    "Mitsuba": "mitsuba_paths:open_renderer",
    "Blender Cycles": "blender_cycles:open_renderer",
}
"""``module:function``; functions take the folder, or the worlds if the module has a ``draw``."""


def open_round(name: str, folder: Path) -> Round:
    """Load a renderer with the meshes of a folder."""
    module_name, _, function = RENDERERS[name].partition(":")
    opener: Callable[[Any], Any] = getattr(
        import_module(f"benchmarks.peers.{module_name}"), function
    )
    out = output_folder(folder, name)
    out.mkdir(exist_ok=True)
    if module_name == "own":
        round_: Round = opener(folder)
        return round_
    worlds = read_worlds(folder)
    draw: Callable[[World], Images] = opener(worlds)

    def write_all() -> None:
        for number, world in enumerate(worlds):
            write_files(draw(world), out, number)

    return write_all


def output_folder(folder: Path, name: str) -> Path:
    """Folder of a renderer's files."""
    return folder / name.replace(", ", "_").replace(" ", "_")


def main() -> None:
    """Serve rounds until standard input ends."""
    name, folder, core = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    os.sched_setaffinity(0, {core})
    # Whatever engines print must not mix with the answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(**facts: Any) -> None:
        print(json.dumps(facts), file=answers, flush=True)

    try:
        write_all = open_round(name, folder)
        write_all()
    except ImportError as error:
        answer(missing=str(error))
        return
    answer(cpu_s=time.process_time())
    for _ in sys.stdin:
        started_s = time.process_time()
        write_all()
        answer(cpu_s=time.process_time() - started_s)


if __name__ == "__main__":
    main()
