"""Objects beside ten metres of street, by district: ``python -m benchmarks.bench_density``.

Scenes are drawn and not rendered. Counted is everything that a group of the template has along the
roads, on both sides together, over the length of all roads of the scene; traffic and people are
left out, because configurations draw their number.
"""

import argparse
import statistics
import time
from collections import Counter
from collections.abc import Iterator

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import scene_source
from gen_data.assets.library import Library, open_library
from gen_data.config.shared_values import probe_values
from gen_data.core import errors, interfaces
from gen_data.core.lane_geometry import LaneLine
from gen_data.core.scene import Scene
from gen_data.core.streams import Streams

LEFT_OUT = frozenset({"traffic", "people"})


def districts() -> list[str]:
    """Names of the districts of the street."""
    config = load_config("street")
    values = probe_values(config.document.entries["shared"], config.general.seed)
    return sorted({str(shared["district"]) for shared in values})


def draw_scenes(config: Config, library: Library, count: int) -> Iterator[Scene]:
    """Yield scenes after their scene randomizers; layouts that are rejected are left out."""
    source = scene_source(config, library)
    for number in range(count):
        streams = Streams(config.general.seed, number, index=number)
        scene, randomizers, _ = source(streams)
        try:
            for randomizer in randomizers:
                if randomizer.stage != interfaces.Stage.VIEW.value:
                    scene = randomizer(scene, library, streams.rng(f"randomizer/{randomizer.name}"))
        except errors.LayoutRejected:
            continue
        yield scene


def street_m(scene: Scene) -> float:
    """Length of all roads: that of the innermost lane of each."""
    lanes = {lane.road: LaneLine(lane).length_m for lane in scene.lanes if _is_first(lane.name)}
    return sum(lanes.values())


def _is_first(name: str) -> bool:
    return name.endswith("/forward0")


def count_objects(scene: Scene) -> Counter[str]:
    """Objects by group."""
    return Counter(body.group for body in scene.bodies if body.group not in (*LEFT_OUT, ""))


def main() -> None:
    """Print one row per district: all objects, then groups in order of frequency."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=8, help="scenes per district")
    parser.add_argument("--config", default="street.yaml")
    arguments = parser.parse_args()
    library = open_library(())
    for district in districts():
        config = load_config(arguments.config, overrides=(f"shared.district={district}",))
        start_s = time.process_time()
        drawn = list(draw_scenes(config, library, arguments.scenes))
        took_s = (time.process_time() - start_s) / arguments.scenes
        groups: Counter[str] = Counter()
        for scene in drawn:
            groups += count_objects(scene)
        length_m = sum(street_m(scene) for scene in drawn)
        median = statistics.median(sum(count_objects(s).values()) for s in drawn)
        listed = ", ".join(f"{n} {10 * k / length_m:.2f}" for n, k in groups.most_common())
        total = 10.0 * groups.total() / length_m
        print(
            f"{district}: {total:.1f} per 10 m ({listed}); {median:.0f} per scene, {took_s:.2f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
