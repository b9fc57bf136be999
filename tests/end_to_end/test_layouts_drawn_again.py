"""A layout without a place for the camera of its last view is drawn again, for all of its views.

Scene 0 of the configuration has places for views 0 and 1 in its first layout, and none for view 2,
which another shard holds.
"""

import json
from pathlib import Path

import pytest

import gen_data
from gen_data.core.errors import SceneRejected
from gen_data.report.drawn_parameters import replay_scenes
from gen_data.runner.stored import StoredSamples
from tests.end_to_end.running import digest

CONFIG = """
seed: 9
views_per_scene: 3
shard_size: 2
physics: {layout_attempts_max: 5}
elements:
  - {name: table, type: surface, asset: table, height_m: 0.7, top_size_m: [0.6, 0.6]}
  - {name: clutter, type: objects, on: table, assets: {ids: ["bowl?seed=0"]}}
randomizers:
  - {type: objects, name: clutter, count: {choice: {2: 1, 9: 1}}}
  - type: camera_pose
    name: orbit
    aim: clutter
    distance_m: 0.28
    azimuth_deg: 0
    elevation_deg: 20
    jitter_m: 0
sensors: [{type: rgb_camera, name: color, size_px: [48, 32]}]
annotations: [boxes2d]
exporters: [{type: coco}]
splits: {train: 1}
"""
N = 6


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "bowls.yaml"
    path.write_text(CONFIG)
    return path


@pytest.fixture(scope="module")
def whole(config: Path) -> Path:
    gen_data.generate(config, N, out=config.parent / "whole", workers=0)
    return config.parent / "whole"


@pytest.mark.slow
def test_all_views_show_the_layout_that_has_places_for_all(whole: Path) -> None:
    stored = StoredSamples(whole)
    kept = [stored.kept_scene(index) for index in range(N)]
    assert [one.attempts for one in kept] == [2, 2, 2, 1, 1, 1]
    assert len({one.scene.bodies for one in kept[:3]}) == 1
    assert json.loads((whole / "manifest.json").read_text())["rejections"] == 1


@pytest.mark.slow
def test_two_workers_and_shards_made_before_earlier_ones_give_the_same_bytes(
    whole: Path, tmp_path: Path, config: Path
) -> None:
    """Shard 1, with view 2 of scene 0, is made by another process, or in an earlier run."""
    gen_data.generate(config, N, out=tmp_path / "two", workers=2)
    for shards in ((1, 2), (0, 1), None):
        gen_data.generate(config, N, out=tmp_path / "resumed", workers=0, shards=shards)
    assert digest(tmp_path / "two") == digest(tmp_path / "resumed") == digest(whole)


@pytest.mark.slow
@pytest.mark.parametrize("index", [2, 0])
def test_a_sample_on_its_own_has_the_bytes_of_the_data_set(
    index: int, whole: Path, config: Path, tmp_path: Path
) -> None:
    gen_data.write_sample(config, index, tmp_path / "one")
    (image,) = (tmp_path / "one").rglob(f"rgb/*{index}.png")
    (stored,) = whole.glob(f"shards/*/color/rgb/*{index}.png")
    assert image.read_bytes() == stored.read_bytes()


@pytest.mark.slow
def test_scenes_are_drawn_again_from_the_plan_with_the_reason(whole: Path) -> None:
    """As the report and the certificate do; the values of the layout that was accepted count."""
    stored = StoredSamples(whole)
    replay = replay_scenes(stored, 2)
    assert replay.differences == []
    of_views = sum(stored.kept_scene(index).view_attempts - 1 for index in range(N))
    remedy = "other distance_m, azimuth_deg or elevation_deg (randomizers.orbit)"
    assert replay.rejections == {("no free place for camera 'color'", remedy): 1 + of_views}
    counts = replay.parameters["clutter.count"]
    assert (len(counts.values), len(counts.firsts)) == (2, 2)


@pytest.mark.slow
def test_a_view_that_no_layout_has_a_place_for_names_camera_view_and_remedy(config: Path) -> None:
    overrides = ["randomizers.orbit.clearance_m=0.3", "physics.layout_attempts_max=2"]
    text = (
        "scene 0: no valid layout in 2 attempts (2 x no free place for camera 'color').\n"
        "  Best: attempt 1: all 2 draws of view 0 are rejected.\n"
        "  Try: 1. other distance_m, azimuth_deg or elevation_deg (randomizers.orbit)"
    )
    with (
        gen_data.Dataset(config, n=N, overrides=overrides) as data,
        pytest.raises(SceneRejected) as error,
    ):
        data[2]
    assert str(error.value) == text
