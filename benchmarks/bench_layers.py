"""CPU time of layers and mirrors over depth, and of occupancy: ``-m benchmarks.bench_layers``."""

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from statistics import median

from benchmarks.runs import machine
from gen_data.annotations.annotate import annotate_ego
from gen_data.annotations.occupancy import VoxelOccupancy
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import LAYERS, MIRRORED, Capture, Channel
from gen_data.core.interfaces import AssetLibrary, Renderer
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene

CONFIGS = ("tabletop.yaml", "street.yaml", "glassware.yaml")
DEPTH = frozenset({Channel.Z_DEPTH})
FURTHER = {"layers": frozenset(LAYERS), "mirrors": frozenset(MIRRORED)}


def cpu_times_ms(action: Callable[[], object], repeats: int) -> list[float]:
    """Processor time of several calls after a first one, which fills caches [ms]."""
    times = []
    for _ in range(repeats + 1):
        begin_s = time.process_time()
        action()
        times.append(1e3 * (time.process_time() - begin_s))
    return times[1:]


def render_ms(
    renderer: Renderer, scene: Scene, channels: frozenset[Channel], repeats: int
) -> float:
    """Least processor time of several images of the first camera [ms]."""

    def render() -> None:
        # Renderers keep labels of cameras that they recognise by identity.
        renderer.render(scene, replace(scene.cameras[0]), channels)

    return min(cpu_times_ms(render, repeats))


def measure(name: str, scenes: int, repeats: int) -> None:
    """Print the times of the first views of some scenes of a configuration."""
    with open_pipeline(load_config(name)) as pipeline:
        for number in range(scenes):
            scene = pipeline.sample(number * pipeline.info.views_per_scene).scene
            depth_ms = render_ms(pipeline.renderer, scene, DEPTH, repeats)
            ratios = [
                f"{kind} {render_ms(pipeline.renderer, scene, wanted, repeats) / depth_ms:.2f}"
                for kind, wanted in FURTHER.items()
            ]
            print(f"{name} scene {number}: depth {depth_ms:.1f} ms; {', '.join(ratios)}")


def occupancy_ms(sample: Sample, assets: AssetLibrary, repeats: int) -> Mapping[str, float]:
    """Median processor time of the default grid alone, and added by each sensor [ms]."""
    clouds, readings = sample.capture.clouds, sample.capture.readings
    captures = {"grid": Capture({})}
    captures |= {name: Capture({name: reading}) for name, reading in readings.items()}
    captures |= {name: Capture({}, {name: cloud}) for name, cloud in clouds.items()}
    scenes = {"": sample.scene, **sample.instants}
    found = {
        name: median(
            cpu_times_ms(partial(annotate_ego, scenes, [VoxelOccupancy()], assets, given), repeats)
        )
        for name, given in captures.items()
    }
    return {name: ms - found["grid"] * (name != "grid") for name, ms in found.items()}


def measure_occupancy(scenes: int, repeats: int) -> None:
    """Print the times of the first sample of some drives of ``occupancy.yaml``."""
    with open_pipeline(load_config("occupancy.yaml")) as pipeline:
        info = pipeline.info
        for number in range(scenes):
            sample = pipeline.sample(number * info.views_per_scene * info.steps_per_scene)
            found = occupancy_ms(sample, pipeline.assets, repeats)
            times = ", ".join(f"{name} {ms:.0f}" for name, ms in found.items())
            print(f"occupancy.yaml scene {number}: {times} ms")


def main() -> None:
    """Print the figures of docs/layers.md and docs/occupancy.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--configs", nargs="*", default=CONFIGS, help="configurations of layers")
    arguments = parser.parse_args()
    print(machine())
    for name in arguments.configs:
        measure(name, arguments.scenes, arguments.repeats)
    measure_occupancy(arguments.scenes, arguments.repeats)


if __name__ == "__main__":
    main()
