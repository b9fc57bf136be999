"""CPU seconds until a path-traced image looks converged: ``python -m benchmarks.bench_pathtraced``.

The scenes of the tests against Mitsuba at 128x96; all twelve take half an hour. Each renderer
renders its own reference, then images of 1, 2, 4, ... samples until their FLIP against it
(Andersson et al. 2020) falls below 0.05; time is interpolated on logarithmic axes. Compared are
the path-traced tier on the CPU, with and without denoiser, and Mitsuba 3: ``llvm_ad_rgb``
(vectorised; loads an LLVM of the system, see DRJIT_LIBLLVM_PATH) and ``scalar_rgb``; the denoiser
of Mitsuba runs on GPUs of one vendor only. Each renderer has a process of its own; time is the CPU
time of one image with compiled kernels.
"""

import argparse
import json
import math
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.renderers.mitsuba_scene import mitsuba_scene
from tests.renderers.paths import settings_of
from tests.renderers.test_path_tracing_against_mitsuba import PICTURES, Picture, flip_of

OWN = ("own", "own, denoised")
SIZE_PX = (128, 96)
GOAL = 0.05
SAMPLES = tuple(2**k for k in range(11))
Render = Callable[[int, int], np.ndarray]
"""Samples and seed to radiance."""


def load_picture(name: str) -> Picture:
    """Scene of the tests at the size of the benchmark."""
    picture = PICTURES[name]()
    k = picture.camera.intrinsics
    width_px, height_px = SIZE_PX
    f_px = k.fx_px * width_px / k.width_px
    intrinsics = Intrinsics(width_px, height_px, f_px, f_px, 0.5 * width_px, 0.5 * height_px)
    return replace(picture, camera=replace(picture.camera, intrinsics=intrinsics))


def own_render(picture: Picture, *, denoise: bool = False) -> Render:
    """Path-traced tier; the noise depends on the name of the camera."""

    @cache
    def renderer_of(samples: int) -> WarpRenderer:
        settings = settings_of(samples).model_copy(update={"denoise": denoise})
        return WarpRenderer(picture.library, "cpu", settings)

    def render(samples: int, seed: int) -> np.ndarray:
        camera = replace(picture.camera, name=f"camera {seed}")
        renderer = renderer_of(samples)
        reading = renderer.render(picture.scene, camera, frozenset({Channel.RADIANCE}))
        return reading.channels[Channel.RADIANCE].astype(np.float64)

    return render


def mitsuba_render(picture: Picture, variant: str) -> Render:
    """Mitsuba 3 with a variant."""
    import mitsuba as mi

    mi.set_variant(variant)
    environment = picture.environment() if picture.environment else None
    loaded = mitsuba_scene(
        picture.scene, picture.camera, picture.library, picture.bsdfs, environment
    )
    return lambda samples, seed: np.array(mi.render(loaded, spp=samples, seed=seed), np.float64)


def measure_convergence(render: Render, reference: np.ndarray) -> list[tuple[int, float, float]]:
    """(samples, CPU time [s], FLIP) of each image until the goal is reached."""
    rows = []
    for samples in SAMPLES:
        render(samples, 2)
        spent = []
        for seed in (3, 4, 5):
            started_s = time.process_time()
            image = render(samples, seed)
            spent.append(time.process_time() - started_s)
        rows.append((samples, min(spent), flip_of(reference, image)))
        if rows[-1][2] < GOAL:
            break
    return rows


def seconds_to_goal(rows: list[tuple[int, float, float]]) -> float:
    """CPU time at which FLIP reaches the goal [s]; at least that of the first image."""
    if len(rows) == 1 or rows[-1][2] >= GOAL:
        return rows[-1][1] if rows[-1][2] < GOAL else math.inf
    (_, t0, f0), (_, t1, f1) = rows[-2:]
    part = math.log(f0 / GOAL) / math.log(f0 / f1)
    return math.exp(math.log(t0) + part * math.log(t1 / t0))


def run_in_process(
    renderer: str, scenes: Sequence[str], reference_samples: int
) -> dict[str, list] | None:
    """Figures of one renderer by scene; None if it cannot run here."""
    command = [sys.executable, "-m", "benchmarks.bench_pathtraced", "--renderer", renderer]
    command += ["--reference", str(reference_samples), "--scenes", *scenes]
    finished = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [line for line in finished.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if finished.returncode == 0 and lines else None


def main() -> None:
    """Print a table, or the figures of one renderer as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reference", type=int, default=4096, help="samples of references")
    parser.add_argument("--renderer", help="one of OWN or a variant of Mitsuba: that one alone")
    parser.add_argument("--scenes", nargs="+", choices=PICTURES, default=list(PICTURES))
    arguments = parser.parse_args()
    if arguments.renderer:
        figures = {}
        for scene in arguments.scenes:
            picture = load_picture(scene)
            ours = arguments.renderer in OWN
            plain = own_render(picture) if ours else mitsuba_render(picture, arguments.renderer)
            render = own_render(picture, denoise=True) if arguments.renderer == OWN[1] else plain
            figures[scene] = measure_convergence(render, plain(arguments.reference, 1))
        print(json.dumps(figures))
        return
    table = {
        renderer: run_in_process(renderer, arguments.scenes, arguments.reference)
        for renderer in (*OWN, "llvm_ad_rgb", "scalar_rgb")
    }
    for renderer, figures in table.items():
        if figures is None:
            print(f"{renderer:13} cannot run here")
            continue
        for scene, rows in figures.items():
            samples, cpu_s, flip = rows[-1]
            per_path_us = 1e6 * cpu_s / (samples * SIZE_PX[0] * SIZE_PX[1])
            print(
                f"{renderer:13} {scene:15} FLIP {GOAL} after {seconds_to_goal(rows):6.3f} CPU s;"
                f" {samples} samples: FLIP {flip:.4f}, {per_path_us:.2f} us per path"
            )


if __name__ == "__main__":
    main()
