"""Depth and ids against Intel Embree, on constructed and on shipped scenes."""

from collections.abc import Iterator

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary, Renderer
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.pipeline import Pipeline
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.renderers.embree import cast, near_edges
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    camera_at,
    room_mesh,
    scattered_pose,
    sphere_mesh,
)

LABELS = frozenset({Channel.Z_DEPTH, Channel.INSTANCE})
LIBRARY = FakeLibrary({
    "room": room_mesh(), "slab": box_mesh((1.6, 1.2, 0.04)), "box": box_mesh((0.2, 0.3, 0.1)),
    "ball": sphere_mesh(0.1, rings=24), "egg": sphere_mesh(0.07, rings=9),
})  # fmt: skip


def assert_agrees_with_embree(
    renderer: Renderer, assets: AssetLibrary, scene: Scene, camera: Camera
) -> None:
    """Depth within 0.1 mm and ids equal on 99.9 % of pixels; ids on all but silhouette pixels."""
    channels = renderer.render(scene, camera, LABELS).channels
    depth_m, ids = channels[Channel.Z_DEPTH], channels[Channel.INSTANCE]
    expected_m, expected_ids = cast(scene, assets, camera)
    both = np.isfinite(depth_m) & np.isfinite(expected_m)

    close = np.isinf(depth_m) & np.isinf(expected_m)
    close[both] = np.abs(depth_m[both] - expected_m[both]) < 1e-4
    assert close.mean() >= 0.999
    assert (ids == expected_ids).mean() >= 0.999

    inside = ~near_edges(expected_ids, expected_m)
    assert np.array_equal(ids[inside], expected_ids[inside])
    assert inside.mean() > 0.5


def random_scene(seed: int) -> tuple[Scene, Camera]:
    """A room with a slab and twenty rotated and scaled bodies that may intersect."""
    rng = np.random.default_rng(seed)
    bodies = [Body("room", "room"), Body("slab", "slab", SE3((0.0, 0.0, 0.7)), instance_id=1)]
    for k in range(20):
        pose = scattered_pose(rng, (-0.8, -0.6, 0.7), (0.8, 0.6, 1.2))
        asset = str(rng.choice(["box", "ball", "egg"]))
        scale = float(rng.uniform(0.4, 1.8))
        bodies.append(Body(f"b{k}", asset, pose, scale, instance_id=k + 2))
    eye = tuple(float(v) for v in rng.uniform((1.0, -1.5, 1.0), (2.0, 1.5, 2.2)))
    return Scene("random", tuple(bodies)), camera_at(eye, (0.0, 0.0, 0.8), (320, 240))


@pytest.mark.parametrize("seed", range(3))
def test_bodies_that_cut_each_other_agree_with_embree(seed: int) -> None:
    """Scaled, rotated, interpenetrating bodies: nothing is assumed about scenes."""
    assert_agrees_with_embree(WarpRenderer(LIBRARY, "cpu"), LIBRARY, *random_scene(seed))


@pytest.fixture(scope="module")
def tabletop() -> Iterator[Pipeline]:
    spec = load_config("tabletop.yaml", seed=3, overrides=("views_per_scene=1",))
    with open_pipeline(spec) as pipeline:
        yield pipeline


def assert_sample_agrees(pipeline: Pipeline, index: int) -> None:
    scene = pipeline.sample(index).scene
    assert_agrees_with_embree(pipeline.renderer, pipeline.assets, scene, scene.cameras[0])


@pytest.mark.parametrize("index", range(3))
def test_scenes_of_users_agree_with_embree(tabletop: Pipeline, index: int) -> None:
    """The arm, the table and its objects."""
    assert_sample_agrees(tabletop, index)


@pytest.mark.parametrize("numbers", [
    pytest.param(range(3, 7), marks=pytest.mark.slow),
    pytest.param(range(7, 23), marks=pytest.mark.exhaustive),
], ids=["four", "sixteen"])  # fmt: skip
def test_scenes_of_both_kinds_agree_with_embree(tabletop: Pipeline, numbers: range) -> None:
    """Further scenes, for cases that a few might miss."""
    renderer = WarpRenderer(LIBRARY, "cpu")
    for number in numbers:
        assert_agrees_with_embree(renderer, LIBRARY, *random_scene(number))
        assert_sample_agrees(tabletop, number)
