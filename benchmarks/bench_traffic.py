"""CPU milliseconds of traffic in a street: ``python -m benchmarks.bench_traffic``.

Five seconds of thirty vehicles and forty people in the town street: routes and paths, the
simulation of 100 steps, trajectories of 51 knots each, and the test for overlaps. One process, one
core; the best of several runs. Scenes of ``street_sequence.yaml``, reduced to these numbers.
"""

import argparse
import time
from collections.abc import Iterator
from typing import Any

from benchmarks.runs import machine
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import scene_source
from gen_data.assets.library import Library, open_library
from gen_data.core.errors import LayoutRejected
from gen_data.core.scene import Scene
from gen_data.core.streams import Streams
from gen_data.randomizers import traffic_flow
from gen_data.randomizers.traffic_flow import TrafficFlow
from gen_data.traffic.simulation import SimulatedMotion, simulate

FULL = {"traffic": ("gap_m=3", "count=29"), "people": ("gap_m=2", "count=40")}


def full_street(library: Library, seed: int) -> tuple[Scene, TrafficFlow]:
    """Street at rest with 30 vehicles, including the ego vehicle, and 40 people."""
    config = load_config("street_sequence.yaml", seed=seed)
    names = [randomizer.name for randomizer in config.probes[0].randomizers]
    overrides = [
        f"randomizers[{names.index(group)}].{text}"
        for group, texts in FULL.items()
        for text in texts
    ]
    config = load_config("street_sequence.yaml", seed=seed, overrides=overrides)
    streams = Streams(seed, 0)
    scene, randomizers, _ = scene_source(config, library)(streams)
    for randomizer in randomizers:
        if isinstance(randomizer, TrafficFlow):
            return scene, randomizer.model_copy(update={"duration_s": 5.0})
        scene = randomizer(scene, library, streams.rng(f"randomizer/{randomizer.name}"))
    raise AssertionError("street_sequence.yaml has no traffic_flow")


def measure_ms(scene: Scene, flow: TrafficFlow, library: Library) -> Iterator[dict[str, float]]:
    """Yield CPU times of the randomizer and of its simulation [ms], for each repetition."""
    simulating = 0.0

    def timed(*arguments: Any) -> SimulatedMotion:
        nonlocal simulating
        started = time.process_time()
        motion = simulate(*arguments)
        simulating = time.process_time() - started
        return motion

    traffic_flow.simulate = timed
    for attempt in range(20):
        rng = Streams(0, 0, attempt=attempt).rng("randomizer/flow")
        started = time.process_time()
        try:
            flow(scene, library, rng)
        except LayoutRejected:
            continue
        total = time.process_time() - started
        yield {"simulation": 1e3 * simulating, "all": 1e3 * total}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    library = open_library(())
    scene, flow = full_street(library, arguments.seed)
    vehicles = sum(b.group == "traffic" or b.name == "ego" for b in scene.bodies)
    people = sum(b.group == "people" for b in scene.bodies)
    print(f"{machine()}; {vehicles} vehicles, {people} people, {flow.duration_s:g} s")
    runs = list(measure_ms(scene, flow, library))
    for part in ("simulation", "all"):
        print(f"    {part:<11} {min(run[part] for run in runs):6.1f} CPU ms")


if __name__ == "__main__":
    main()
