"""CPU time of truth on request, and its bounds: ``python -m benchmarks.bench_truth``.

A row per kind: median and maximum over scenes, in milliseconds per image or frame, or relative to
``depth`` alone. Costs per scene are distributed over its 20 frames. One process; scenes are made
twice, and the first time, which fills caches, does not count. Names of kinds choose rows.
"""

import argparse
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path

from benchmarks.runs import machine
from gen_data.annotations.annotate import annotate_ego
from gen_data.annotations.lanes import Lanes
from gen_data.annotations.occupancy import VoxelOccupancy
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import LAYERS, MIRRORED, Capture, Channel
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.exporters.argoverse_map import argoverse_map
from gen_data.exporters.nuscenes_files import map_area
from gen_data.exporters.nuscenes_map import map_expansion
from gen_data.exporters.road_map import road_map
from gen_data.pipeline.pipeline import Pipeline
from gen_data.runner.shard import drop_pixels

STEPS = 20
DEPTH = frozenset({Channel.Z_DEPTH})
TRACKS = "annotations=[{type: tracks, points: 256}]"


@dataclass(frozen=True)
class Row:
    """A kind of truth: where it is measured, how, and its bound; infinity for none."""

    kind: str
    config: str
    unit: str
    bound: float
    measure: Callable[[Pipeline, Sequence[Sample]], float]
    override: str = ""


def cpu_ms(work: Callable[[], object], repeats: int = 3) -> float:
    """Median processor time of some work [ms]."""
    spent = []
    for _ in range(repeats):
        begin_s = time.process_time()
        work()
        spent.append(time.process_time() - begin_s)
    return 1e3 * statistics.median(spent)


def stage_ms(pipeline: Pipeline, samples: Sequence[Sample]) -> float:
    """All annotations, per frame."""
    del pipeline
    return 1e3 * statistics.fmean(sample.timings_s["annotate"] for sample in samples)


def lanes_ms(pipeline: Pipeline, samples: Sequence[Sample]) -> float:
    """The annotation ``lanes``, per image."""
    annotate = Lanes().annotate_image
    return statistics.fmean(
        cpu_ms(partial(annotate, s.scene_of(name), pipeline.assets, reading, s.truth[name]))
        for s in samples
        for name, reading in s.capture.readings.items()
    )


def exporter_ms(name: str, pipeline: Pipeline, samples: Sequence[Sample]) -> float:
    """Cost of an exporter for a shard with all frames of a scene, per frame."""
    exporter, parts = pipeline.exporters[name], [drop_pixels(sample) for sample in samples]
    with tempfile.TemporaryDirectory() as folder:
        shards = (Path(folder) / str(number) for number in range(STEPS))
        write = partial(exporter.write_shard, pipeline.info, parts)
        return cpu_ms(lambda: write(next(shards))) / len(samples)


def image_exporter_ms(name: str, pipeline: Pipeline, samples: Sequence[Sample]) -> float:
    """The same per image."""
    return exporter_ms(name, pipeline, samples) / len(samples[0].truth)


def map_ms(
    make: Callable[[Scene, AssetLibrary], object], pipeline: Pipeline, samples: Sequence[Sample]
) -> float:
    """The map of a world, per frame."""
    return cpu_ms(lambda: make(samples[0].scene, pipeline.assets)) / len(samples)


def nuscenes(scene: Scene, assets: AssetLibrary) -> object:
    """Map expansion; its tokens cost as much as real ones."""
    names: dict[str, str] = {}
    return map_expansion(
        road_map(scene, assets),
        map_area(scene.lanes),
        lambda *parts: names.setdefault(repr(parts), f"{len(names):032x}"),
    )


def occupancy_ms(kind: str, pipeline: Pipeline, samples: Sequence[Sample]) -> float:
    """Cost of the default grid of a street, or the addition of one camera or scan, per frame."""
    sample = samples[0]
    scenes = {"": sample.scene, **sample.instants}

    def cost_ms(capture: Capture) -> float:
        given = scenes, [VoxelOccupancy()], pipeline.assets, capture
        return cpu_ms(partial(annotate_ego, *given), 5)

    grid_ms = cost_ms(Capture({}))
    if kind == "grid":
        return grid_ms
    readings, clouds = sample.capture.readings, sample.capture.clouds
    captures = {
        "camera": [Capture({name: reading}) for name, reading in readings.items()],
        "scan": [Capture({}, {name: cloud}) for name, cloud in clouds.items()],
    }
    return statistics.fmean(cost_ms(capture) for capture in captures[kind]) - grid_ms


def layers_ratio(
    channels: frozenset[Channel], pipeline: Pipeline, samples: Sequence[Sample]
) -> float:
    """Cost of channels of the first camera, with four layers, relative to depth alone."""
    scene = samples[0].scene

    def render(wanted: frozenset[Channel]) -> None:
        # Renderers keep labels of cameras that they recognise by identity.
        pipeline.renderer.render(scene, replace(scene.cameras[0], layers=4), wanted)

    return cpu_ms(partial(render, channels), 9) / cpu_ms(partial(render, DEPTH), 9)


ROWS = (
    Row("lanes", "lanes.yaml", "ms per image", 5.0, lanes_ms),
    Row("openlane", "lanes.yaml", "ms per image", 5.0, partial(image_exporter_ms, "openlane")),
    Row("culane", "lanes.yaml", "ms per image", 5.0, partial(image_exporter_ms, "culane")),
    Row("map_vectors", "lanes.yaml", "ms per frame", 5.0, partial(exporter_ms, "map_vectors")),
    Row("opendrive", "lanes.yaml", "ms per frame", 5.0, partial(exporter_ms, "opendrive")),
    Row("nuscenes map", "lanes.yaml", "ms per frame", 5.0, partial(map_ms, nuscenes)),
    Row(
        "argoverse map",
        "lanes.yaml",
        "ms per frame",
        5.0,
        partial(map_ms, lambda scene, assets: argoverse_map(road_map(scene, assets))),
    ),
    Row("tracks, street", "tracks.yaml", "ms per frame", 15.0, stage_ms, TRACKS),
    Row("tracks, table", "tabletop_sequence.yaml", "ms per frame", 15.0, stage_ms, TRACKS),
    Row("occupancy", "occupancy.yaml", "ms per frame", 60.0, partial(occupancy_ms, "grid")),
    *(
        Row(
            f"occupancy, {kind}",
            "occupancy.yaml",
            "ms per image or scan, besides",
            math.inf,
            partial(occupancy_ms, kind),
        )
        for kind in ("camera", "scan")
    ),
    *(
        Row(f"{kind}, {name}", f"{name}.yaml", "x depth", bound, partial(layers_ratio, channels))
        for name in ("tabletop", "street", "glassware")
        for kind, channels, bound in (
            ("layers", frozenset(LAYERS), 2.0),
            ("mirrors", frozenset(MIRRORED), math.inf),
        )
    ),
)


def sequences(pipeline: Pipeline, scenes: int) -> Iterator[list[Sample]]:
    """Up to 20 frames of the first view of some scenes, which were all made once before."""
    info = pipeline.info
    for number in range(2 * scenes):
        first = number % scenes * info.views_per_scene * info.steps_per_scene
        samples = [pipeline.sample(first + k) for k in range(min(STEPS, info.steps_per_scene))]
        if number >= scenes:
            yield samples


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", help="beginnings of names of rows; all by default")
    parser.add_argument("--scenes", type=int, default=3)
    arguments = parser.parse_args()
    print(machine())
    rows = [r for r in ROWS if r.kind.startswith(tuple(arguments.kinds or [""]))]
    for (name, override), group in groupby(rows, key=lambda row: (row.config, row.override)):
        own = list(group)
        found: dict[str, list[float]] = {row.kind: [] for row in own}
        overrides = [f"steps_per_scene={STEPS}", override] if override else []
        with open_pipeline(load_config(name, overrides=overrides)) as pipeline:
            for samples in sequences(pipeline, arguments.scenes):
                for row in own:
                    found[row.kind].append(row.measure(pipeline, samples))
        for row in own:
            values = found[row.kind]
            print(
                f"{row.kind:<20} {statistics.median(values):7.1f} {max(values):7.1f}"
                f"  < {row.bound:g} {row.unit}",
                flush=True,
            )


if __name__ == "__main__":
    main()
