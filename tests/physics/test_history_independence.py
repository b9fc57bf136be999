"""settle(scene) is a function of the scene: of nothing before it, and of no process."""

import hashlib
import multiprocessing
from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.core.asset_types import ConvexParts
from gen_data.core.scene import ArmGoal, Articulation, Scene
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json
from gen_data.physics import PhysicsConfig, open_engine
from gen_data.physics.collision_shapes import collision_shape
from gen_data.physics.engine import Engine
from gen_data.physics.physics_config import EngineName
from gen_data.physics.world import World
from tests.physics.doubles import TABLE_TOP_Z_M, Solids, box, dropped_clutter, table_scene, thing
from tests.physics.panda import HOME


def with_arm(scene: Scene) -> Scene:
    targets = tuple(SE3((0.1, 0.1 * k, TABLE_TOP_Z_M + 0.35), (0, 1, 0, 0)) for k in (0, 1, 2))
    base = SE3((-0.5, 0.0, TABLE_TOP_Z_M))
    goal = ArmGoal("reach", pose_candidates=targets)
    return replace(scene, articulations=(Articulation("arm", "panda", 99, base, HOME, goal),))


def digest(engine: Engine, scene: Scene) -> str:
    return hashlib.sha256(canonical_json(engine.settle(scene)).encode()).hexdigest()


def settle_alone(name: EngineName, seed: int) -> str:
    with open_engine(Solids(), PhysicsConfig(engine=name)) as engine:
        return digest(engine, with_arm(dropped_clutter(seed)))


@pytest.mark.slow
def test_a_scene_settles_the_same_whatever_was_settled_before(
    engine: Engine, engine_name: EngineName
) -> None:
    """A, B, A, refused, A and A in a new engine: the same bytes for every A."""
    a, b = with_arm(dropped_clutter(5)), dropped_clutter(6)
    refused = table_scene(thing("lost", "box 0.1 0.1 0.1", x=2.0))

    first = digest(engine, a)
    other = digest(engine, b)
    second = digest(engine, a)
    assert engine.settle(refused).rejection is not None
    third = digest(engine, a)
    with open_engine(Solids(), PhysicsConfig(engine=engine_name)) as fresh:
        fourth = digest(fresh, a)

    assert first == second == third == fourth
    assert first != other


@pytest.mark.slow
def test_a_scene_settles_the_same_in_another_process(engine_name: EngineName) -> None:
    """Spawned: nothing is inherited; after other work in this one."""
    with open_engine(Solids(), PhysicsConfig(engine=engine_name)) as engine:
        engine.settle(dropped_clutter(1))
        here = digest(engine, with_arm(dropped_clutter(5)))
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(settle_alone, (engine_name, 5))

    assert here == there


def test_bodies_that_once_ignored_each_other_meet_again(world: World) -> None:
    """Pairs that may pass through each other are forgotten with the world they were in."""
    floor, cube = (
        collision_shape(ConvexParts((box(*size),))) for size in ((1, 1, 0.1), (0.1, 0.1, 0.1))
    )
    heights = []

    for passes_through in (True, False):
        world.reset()
        world.add("floor", floor, SE3((0, 0, -0.05)))
        world.add("cube", cube, SE3((0, 0, 0.05)), mass_kg=1.0)
        if passes_through:
            world.ignore("floor", ["cube"])
        world.step(120)
        heights.append(world.pose("cube").translation_m[2])

    assert heights[0] < -0.5
    assert heights[1] == pytest.approx(0.05, abs=0.0005)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_scenes(engine: Engine) -> None:
    """After a warm-up, sixty small scenes of ever new scale need less than 4 MB more."""

    def settle(count: int) -> None:
        for k in range(count):
            scale = 0.8 + 0.4 * ((k * 0.618034) % 1.0)
            engine.settle(table_scene(thing("cup", "mug 0.04 0.1", above_m=0.1, scale=scale)))

    settle(30)
    before = resident_mb()
    settle(60)

    assert resident_mb() - before < 4.0


def resident_mb() -> float:
    """Memory of this process that is in RAM [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
