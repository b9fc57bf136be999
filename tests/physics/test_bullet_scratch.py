"""Scratch files of the physics engine."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gen_data.core.asset_types import ConvexParts
from gen_data.core.se3 import SE3
from gen_data.physics import PhysicsConfig, open_engine
from gen_data.physics.collision_shapes import collision_shape
from gen_data.runner.resident_memory import release_memory, resident_bytes
from tests.physics.doubles import Solids, table_scene, thing

pytest.importorskip("pybullet")

from gen_data.physics.bullet_world import BulletWorld


def test_a_world_that_is_never_closed_leaves_no_folder(tmp_path: Path) -> None:
    """A program may end, or forget a data set, without closing it."""
    code = (
        "from gen_data.physics.bullet_world import BulletWorld\n"
        "import os\n"
        "world = BulletWorld(1 / 240, 50)\n"
        "print(len(os.listdir(os.environ['TMPDIR'])))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={"PATH": "", "TMPDIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.strip() == "1"
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_shapes_at_new_scales_take_neither_memory_nor_disk() -> None:
    """Otherwise every file that pybullet has read stays in memory: 18 MB for these shapes."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    shape = collision_shape(ConvexParts((np.asarray(ball.vertices),)))

    def files_after_a_fall(step: int) -> int:
        world.reset()
        world.add("ball", shape, SE3((0.0, 0.0, 1.0)), scale=1.025**step, mass_kg=1.0)
        world.step(1)
        world.reset()
        return len(list(world._folder.iterdir()))

    world = BulletWorld(1 / 240, 10)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gen_data.physics.bullet_world._HULL_FILES", 20)
        for step in range(-230, -200):
            files_after_a_fall(step)
        release_memory()
        before = resident_bytes()
        files = [files_after_a_fall(step) for step in range(-200, 200)]
        release_memory()
        grown = resident_bytes() - before
    world.close()

    assert max(files) <= 20
    assert grown < 8e6


def test_an_engine_gives_its_scratch_files_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is left in the temporary folder, and leaving twice does no harm."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with open_engine(Solids(), PhysicsConfig(engine="pybullet")) as engine:
        engine.settle(table_scene(thing("cup", "mug 0.04 0.1", above_m=0.1)))
        assert list(tmp_path.iterdir())
    engine.__exit__(None, None, None)

    assert not list(tmp_path.iterdir())
