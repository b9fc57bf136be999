"""A small data set, and one with its recipe, for the tests of this folder."""

from pathlib import Path

import pytest

from gen_data import generate, recipe
from tests.end_to_end.running import SMALL, gen_data

CONFIG = """
seed: 3
shard_size: 2
assets: {folders: [meshes]}
elements:
  - {name: table, type: surface, asset: table, height_m: 0.7, top_size_m: [1, 1]}
  - {name: clutter, type: objects, on: table, assets: {tags: [user]}, count: 1}
randomizers: [{type: camera_pose, name: orbit, distance_m: {uniform: [0.8, 1]}}]
sensors: [{type: rgb_camera, name: color, size_px: [48, 32]}]
annotations: [boxes2d, instance_masks, poses]
exporters: [{type: coco}]
splits: {train: 1, val: 0, test: 0}
"""
BLOCK = """
v -.05 -.05 0
v .05 -.05 0
v .05 .05 0
v -.05 .05 0
v -.05 -.05 .1
v .05 -.05 .1
v .05 .05 .1
v -.05 .05 .1
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""
N = 5
"""Samples: three shards."""


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset")
    done = gen_data(
        "--config", "tabletop.yaml", "--n", "15", "--seed", "1", "--workers", "1",
        "--out", "one", *SMALL, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "one"


@pytest.fixture(scope="session")
def author(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the author: configuration, meshes, data set and recipe."""
    folder = tmp_path_factory.mktemp("author")
    (folder / "tiny.yaml").write_text(CONFIG)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "block.obj").write_text(BLOCK)
    generate(folder / "tiny.yaml", N, out=folder / "set", workers=0)
    (folder / "recipe.yaml").write_text(recipe(folder / "set"))
    return folder
