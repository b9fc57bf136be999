"""Assets that are prepared ahead: scenes find everything in the cache folder."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from gen_data.assemble.config import parse_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.runner.prepare import list_assets, prepare_assets

CONFIG = """
elements:
  - {type: surface, name: table, asset: table, top_size_m: [1.3, 0.9], height_m: 0.74}
  - {type: objects, name: clutter, on: table, count: 2, assets: {ids: ["mug?seed=0", "mug?seed=1"]}}
randomizers:
  - {type: objects, name: clutter, count: 2}
  - {type: textures, name: cover, targets: [clutter], textures: ["texture/wood_grain?seed=1"]}
  - {type: camera_pose, name: orbit, stage: view, distance_m: 1}
sensors:
  - {type: rgb_camera, name: color, size_px: [32, 24], hfov_deg: 60}
annotations: [boxes2d, boxes3d]
"""


@dataclass(frozen=True)
class Preparation:
    """Prepared assets in a separate cache folder, and the announcements."""

    factory: PipelineFactory
    cache: Path
    announced: list[tuple[str, int, int]]
    count: int


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    folder = tmp_path_factory.mktemp("prepared")
    factory = PipelineFactory(parse_config(CONFIG, "few.yaml", "few"), n=1)
    factory.__dict__["library"] = open_library((), folder / "cache", folder / "packs")
    announced: list[tuple[str, int, int]] = []
    count = prepare_assets(factory, lambda *next_one: announced.append(next_one))
    return Preparation(factory, folder / "cache", announced, count)


def test_a_scene_of_prepared_assets_stores_nothing_more(prepared: Preparation) -> None:
    before = {path.name for path in prepared.cache.rglob("*.arrays")}
    with prepared.factory() as pipeline:
        scene = pipeline.sample(0).scene
    things = [body for body in scene.bodies if body.group == "clutter"]
    assert {body.asset for body in things} <= {"mug?seed=0", "mug?seed=1"}
    assert "texture/wood_grain?seed=1" in {m.texture for body in things for m in body.materials}
    assert {path.name for path in prepared.cache.rglob("*.arrays")} == before != set()


def test_objects_and_textures_that_randomizers_lay_on_them_are_listed(
    prepared: Preparation,
) -> None:
    listed = list_assets(prepared.factory)
    assert {"mug?seed=0", "mug?seed=1", "texture/wood_grain?seed=1"} <= {*listed}
    assert not {"mug?seed=2", "texture/wood_grain?seed=2"} & {*listed}


def test_the_asset_that_comes_next_is_announced_with_its_number(prepared: Preparation) -> None:
    listed = list_assets(prepared.factory)
    assert prepared.announced == [(asset, k, len(listed)) for k, asset in enumerate(listed)]
    assert prepared.count == len(listed)
