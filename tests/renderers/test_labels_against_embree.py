"""Depth and ids agree with Embree on scenes as users generate them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from generator.assemble.recipe import open_pipeline
from generator.assemble.spec import load_spec
from generator.core.capture import Channel
from generator.pipeline import Pipeline
from tests.renderers.embree import cast, near_edges, open3d_or_skip

LABELS = frozenset({Channel.Z_DEPTH, Channel.RANGE, Channel.INSTANCE})


@pytest.fixture(scope="module")
def tabletop() -> Iterator[Pipeline]:
    """Random scenes of the shipped tabletop, one view each."""
    open3d_or_skip()
    spec = load_spec("tabletop.yaml", seed=3, overrides=("views_per_scene=1",))
    with open_pipeline(spec) as pipeline:
        yield pipeline


def assert_agrees_with_embree(pipeline: Pipeline, index: int) -> None:
    """Depth within 0.1 mm on 99.9 % of pixels; ids equal on all but silhouette pixels."""
    scene = pipeline.sample(index).scene
    camera = scene.cameras[0]
    reading = pipeline.renderer.render(scene, camera, LABELS)
    depth_m, ids = reading.channels[Channel.Z_DEPTH], reading.channels[Channel.INSTANCE]
    expected_m, expected_ids = cast(scene, pipeline.assets, camera)
    both = np.isfinite(depth_m) & np.isfinite(expected_m)

    close = np.where(both, np.abs(depth_m - expected_m) < 1e-4, depth_m == expected_m)
    assert close.mean() >= 0.999

    inside = ~near_edges(expected_ids, expected_m)
    assert np.array_equal(ids[inside], expected_ids[inside])
    assert inside.mean() > 0.5


@pytest.mark.parametrize("index", range(3))
def test_depth_and_ids_agree_with_embree(tabletop: Pipeline, index: int) -> None:
    """Three scenes of the arm, the table and its objects."""
    assert_agrees_with_embree(tabletop, index)


@pytest.mark.slow
def test_depth_and_ids_agree_with_embree_on_fifty_scenes(tabletop: Pipeline) -> None:
    """Fifty scenes, none excepted."""
    for index in range(50):
        assert_agrees_with_embree(tabletop, index)
