"""CPU time of layers and mirrors relative to depth: ``python -m benchmarks.bench_layers``."""

import argparse
import time
from dataclasses import replace

from benchmarks.runs import machine
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import LAYERS, MIRRORED, Channel
from gen_data.core.interfaces import Renderer
from gen_data.core.scene import Scene

CONFIGS = ("tabletop.yaml", "street.yaml", "glassware.yaml")
DEPTH = frozenset({Channel.Z_DEPTH})
FURTHER = {"layers": frozenset(LAYERS), "mirrors": frozenset(MIRRORED)}


def render_ms(
    renderer: Renderer, scene: Scene, channels: frozenset[Channel], repeats: int
) -> float:
    """Least processor time of several images of the first camera [ms]."""
    times = []
    for _ in range(repeats):
        # Renderers keep labels of cameras that they recognise by identity.
        camera = replace(scene.cameras[0])
        begin_s = time.process_time()
        renderer.render(scene, camera, channels)
        times.append(time.process_time() - begin_s)
    return 1e3 * min(times)


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


def main() -> None:
    """Print the figures of docs/layers.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=9)
    arguments = parser.parse_args()
    print(machine())
    for name in CONFIGS:
        measure(name, arguments.scenes, arguments.repeats)


if __name__ == "__main__":
    main()
