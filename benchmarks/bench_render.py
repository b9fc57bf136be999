"""CPU milliseconds per rendered frame, by kernel: ``python -m benchmarks.bench_render``.

640x480, the shipped tabletop with the arm and exactly ten objects, two soft-shadow lamps and
environment light, or the first camera of another configuration; RGB, depth, instance and category,
then amodal silhouettes too. One process, one core; scenes are drawn and settled before the clock
starts.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from benchmarks.bench_tabletop import make_config
from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core import interfaces, streams
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Scene
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph

LABELLED = frozenset({Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE, Channel.CATEGORY})


def settle_scenes(config: Config, count: int) -> tuple[list[Scene], interfaces.AssetLibrary]:
    """Settled scenes and the library of their assets."""
    with open_pipeline(config) as pipeline:
        return [pipeline.sample(i).scene for i in range(count)], pipeline.assets


def frame_ms(
    renderer: WarpRenderer, scenes: list[Scene], channels: frozenset[Channel], repeats: int
) -> list[float]:
    """CPU time of each scene, the best of several repetitions [ms]."""
    spent = np.zeros((repeats, len(scenes)))
    for row in spent:
        for k, scene in enumerate(scenes):
            started_s = time.process_time()
            photograph(renderer, scene, channels)
            row[k] = 1e3 * (time.process_time() - started_s)
    best: list[float] = spent.min(axis=0).tolist()
    return best


def photograph(renderer: WarpRenderer, scene: Scene, channels: frozenset[Channel]) -> SensorReading:
    """Render a scene and develop it with an ideal camera."""
    rng = streams.Streams(seed=0, scene=0).rng("camera")
    return capture_photograph(scene, renderer, scene.cameras[0], channels, ImagePipeline(), rng)


@contextmanager
def timed_launches() -> Iterator[dict[str, float]]:
    """CPU time by kernel within the context [ms]."""
    import warp as wp

    spent_ms: dict[str, float] = defaultdict(float)
    launch = wp.launch

    def timed(kernel: Any, *args: Any, **kwargs: Any) -> None:
        started_s = time.process_time()
        launch(kernel, *args, **kwargs)
        spent_ms[kernel.key] += 1e3 * (time.process_time() - started_s)

    wp.launch = timed
    try:
        yield spent_ms
    finally:
        wp.launch = launch


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--config", default="", help="another configuration, such as street")
    arguments = parser.parse_args()

    overrides = ("views_per_scene=1",)
    named = partial(load_config, arguments.config, seed=1, overrides=overrides)
    config = named() if arguments.config else make_config(1)
    scenes, assets = settle_scenes(config, arguments.scenes)
    started_s = time.perf_counter()
    renderer = WarpRenderer(assets, "cpu")
    photograph(renderer, scenes[0], LABELLED)
    print(f"first frame in this process: {time.perf_counter() - started_s:.1f} s")
    for name, channels in (("", LABELLED), (" with silhouettes", LABELLED | {Channel.AMODAL})):
        best = frame_ms(renderer, scenes, channels, arguments.repeats)
        each = ", ".join(f"{ms:.0f}" for ms in best)
        print(f"CPU ms per frame{name}: {np.mean(best):.1f} (scenes: {each})")
    with timed_launches() as spent_ms:
        frame_ms(renderer, scenes, LABELLED | {Channel.AMODAL}, 1)
    for kernel, ms in sorted(spent_ms.items(), key=lambda item: -item[1]):
        print(f"    {kernel:<20} {ms / len(scenes):6.1f} CPU ms")


if __name__ == "__main__":
    main()
