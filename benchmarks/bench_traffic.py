"""CPU milliseconds of traffic in a street: ``python -m benchmarks.bench_traffic``.

Five seconds of thirty vehicles and forty people in the town street: routes and paths, the
simulation of 100 steps, tracks of 51 knots each, and the test for overlaps. One process, one core;
the best of several runs. Scenes of ``street_sequence.yaml``, thinned to the asked numbers.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace

from benchmarks.runs import machine
from generator.assemble.recipe import blueprints
from generator.assemble.spec import load_spec
from generator.assets.library import Library, open_library
from generator.core.scene import Scene
from generator.core.streams import Streams
from generator.traffic.simulation import simulated
from randomizers import traffic_flow
from randomizers.groups import without_members
from randomizers.traffic_flow import TrafficFlow

FULL = {"traffic": ("gap_m=3", "count=29"), "people": ("gap_m=2", "count=40")}


def full_street(library: Library, seed: int) -> tuple[Scene, TrafficFlow]:
    """A street with 30 vehicles, the ego vehicle among them, and 40 people, before it moves."""
    spec = load_spec("street_sequence.yaml", seed=seed)
    names = [randomizer.name for randomizer in spec.randomizers]
    overrides = [
        f"randomizers[{names.index(group)}].{text}" for group, texts in FULL.items() for text in texts
    ]
    spec = load_spec("street_sequence.yaml", seed=seed, overrides=overrides)
    streams = Streams(seed, 0)
    plan = blueprints(spec, library)(streams)
    scene = without_members(plan.nominal, "traffic")
    for randomizer in plan.randomizers:
        if isinstance(randomizer, TrafficFlow):
            return scene, randomizer.model_copy(update={"duration_s": 5.0})
        scene = randomizer(scene, library, streams.rng(f"randomizer/{randomizer.name}"))
    raise AssertionError("street_sequence.yaml has no traffic_flow")
