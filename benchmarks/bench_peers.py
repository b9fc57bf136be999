"""This renderer and its peers on one workload: ``python -m benchmarks.bench_peers``.

640x480, ten objects on a ground, two lamps; RGB, depth and instance PNG files and 2D boxes on disk.
``--workload fine``: objects of 12,000 triangles, a new scene in each view; ``small``: small meshes
and primitives, five views per scene. All renderers draw the same scenes (meshes, poses, cameras,
lamps), take turns round by round, and have a process each, pinned to one core. Figures are CPU
seconds of that process, of all threads and with system time. Masks are compared with this
renderer's, which proves that every peer draws the scenes. Settings of the peers: see the modules of
``benchmarks/peers``.

bpy and pyrender need an older NumPy than this project. They run in a separate environment:

    python3.11 -m venv peers
    peers/bin/pip install bpy pyrender OpenEXR opencv-python-headless
    p=peers/bin/python; python -m benchmarks.bench_peers --python "Blender Cycles=$p" "pyrender=$p"
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.peers import workload, worlds
from benchmarks.peers.worker import RENDERERS, output_folder
from benchmarks.runs import machine

OWN, REFERENCE = "ours", "TinyRenderer"
AGREEMENT_MIN = 0.9
"""Mean IoU of masks below which a renderer does not draw the scenes; edges alone cost 0.05."""
RUN_SAMPLES = 150
"""Samples of a run over which the start-up is spread."""
SLOW_S = 2.0
"""CPU seconds per sample above which a renderer takes part in one round only."""


@dataclass(frozen=True)
class Figures:
    """Figures of one renderer.

    Attributes:
        start_s: CPU seconds until the first round is over, less an ordinary round.
        rounds_s: CPU seconds per sample, by round.
        agreement: Mean IoU of its masks and ours; NaN = it draws other scenes.
    """

    start_s: float
    rounds_s: tuple[float, ...]
    agreement: float

    @property
    def typical_s(self) -> float:
        """CPU seconds per sample."""
        return statistics.median(self.rounds_s)

    @property
    def run_s(self) -> float:
        """The same with a share of the start-up, in a run of ``RUN_SAMPLES``."""
        return self.typical_s + self.start_s / RUN_SAMPLES


class Renderer:
    """A renderer in a separate process."""

    def __init__(self, name: str, folder: Path, interpreter: str, core: int) -> None:
        self.name = name
        command = [interpreter, "-m", "benchmarks.peers.worker", name, str(folder), str(core)]
        limits = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS")
        log = output_folder(folder, name).with_suffix(".log").open("w")
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            env={**os.environ, **dict.fromkeys(limits, "1")},
        )
        log.close()

    def __enter__(self) -> "Renderer":
        """Nothing: it starts when it is made."""
        return self

    def __exit__(self, *exception: object) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def wait(self) -> dict[str, Any]:
        """Its next answer; ``missing`` if it cannot run here."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        found: dict[str, Any] = json.loads(line) if line else {"missing": "it failed"}
        return found

    def measure_round(self) -> float:
        """CPU seconds of writing all samples once."""
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return float(self.wait()["cpu_s"])


def compare(
    names: Sequence[str],
    folder: Path,
    count: int,
    rounds: int,
    workload_name: str = "fine",
    interpreters: Mapping[str, str] | None = None,
) -> dict[str, Figures | str]:
    """Figures by renderer, or why it cannot run here."""
    core = max(os.sched_getaffinity(0))
    workload.prepare(folder, count, workload_name)
    found: dict[str, Figures | str] = {}
    with ExitStack() as stack:
        ready: dict[Renderer, float] = {}
        for name in names:
            interpreter = (interpreters or {}).get(name, sys.executable)
            renderer = stack.enter_context(Renderer(name, folder, interpreter, core))
            answer = renderer.wait()
            if "cpu_s" in answer:
                ready[renderer] = answer["cpu_s"]
            else:
                found[name] = str(answer["missing"])
        spent_s: dict[Renderer, list[float]] = {renderer: [] for renderer in ready}
        for number in range(rounds):
            for renderer, mine in spent_s.items():
                if number == 0 or ready[renderer] < SLOW_S * count:
                    mine.append(renderer.measure_round() / count)
        for renderer, mine in spent_s.items():
            start_s = ready[renderer] - count * statistics.median(mine)
            agreement = measure_agreement(folder, renderer.name, count)
            found[renderer.name] = Figures(start_s, tuple(mine), agreement)
    return found


def measure_agreement(folder: Path, name: str, count: int) -> float:
    """Mean IoU of a renderer's masks and ours; NaN without ours."""
    own, theirs = output_folder(folder, OWN), output_folder(folder, name)
    if not own.exists():
        return float("nan")
    pairs = [[worlds.plane_path(out, "instance", k) for out in (theirs, own)] for k in range(count)]
    return statistics.mean(worlds.mask_agreement(*map(_read, pair)) for pair in pairs)


def _read(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None, path
    return image


def format_table(found: Mapping[str, Figures | str]) -> str:
    """Rows of the table of docs/performance.md."""
    reference = found.get(REFERENCE)
    unit_s = run_unit_s = float("nan")
    if isinstance(reference, Figures):
        unit_s, run_unit_s = reference.typical_s, reference.run_s
    lines = [
        "| | CPU s per sample | rounds | of TinyRenderer | start-up, CPU s |"
        f" of TinyRenderer, {RUN_SAMPLES} samples and start | masks, IoU |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, figures in found.items():
        if isinstance(figures, str):
            lines.append(f"| {name} | not installed | | | | | {figures} |")
            continue
        spread = f"{min(figures.rounds_s):.3f} - {max(figures.rounds_s):.3f}"
        agreement = "" if np.isnan(figures.agreement) else f"{figures.agreement:.3f}"
        if figures.agreement < AGREEMENT_MIN:
            agreement += ": other scenes"
        lines.append(
            f"| {name} | {figures.typical_s:.3f} | {spread} | {figures.typical_s / unit_s:.2f} |"
            f" {figures.start_s:.1f} | {figures.run_s / run_unit_s:.2f} | {agreement} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=8, help="samples per round")
    parser.add_argument("--workload", choices=workload.VIEWS_PER_SCENE, default="fine")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", nargs="+", choices=RENDERERS, default=list(RENDERERS))
    parser.add_argument("--python", nargs="+", default=[], metavar="NAME=INTERPRETER")
    parser.add_argument("--out", type=Path, help="keep scenes and images here")
    arguments = parser.parse_args()

    interpreters = dict(text.split("=", 1) for text in arguments.python)
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.out or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        found = compare(
            arguments.only, folder.resolve(), arguments.scenes, arguments.rounds,
            arguments.workload, interpreters,
        )  # fmt: skip
    measured = f"{arguments.workload}, {arguments.scenes} samples, {arguments.rounds} rounds"
    print(f"{machine()}; {measured}\n")
    print(format_table(found))


if __name__ == "__main__":
    main()
