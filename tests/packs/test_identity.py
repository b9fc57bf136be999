"""A data set records the packs it may draw from, and their attribution."""

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.paths import packs_dir
from gen_data.packs.install import install
from gen_data.runner.identity import format_licences, make_plan
from gen_data.runner.plan import compare_plans
from tests.packs.converters import box_pack, zipped_box


@pytest.fixture
def factory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PipelineFactory:
    """The shipped tabletop, on a machine without packs."""
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path / "assets"))
    return PipelineFactory(load_config("tabletop.yaml"), n=10)


def installed_box(tmp_path: Path, side: str) -> None:
    archive = zipped_box(tmp_path / f"{side}.zip", side)
    install(box_pack(archive), packs_dir(), archive)


def test_without_packs_a_plan_names_none(factory: PipelineFactory) -> None:
    """Data sets of procedural assets are independent of packs."""
    assert not [name for name in make_plan(factory).versions if name.startswith("pack ")]


def test_a_pack_is_part_of_the_plan_and_licences(factory: PipelineFactory, tmp_path: Path) -> None:
    """Its household object may lie on the table."""
    installed_box(tmp_path, "0.1")
    plan = make_plan(factory)
    assert plan.versions["pack boxes"].startswith("1.0 ")
    assert "boxes/box" in plan.assets
    text = format_licences(factory, ["boxes/box"])
    assert "| a test | CC-BY-3.0 | A. Modeller | boxes/box |" in text


def test_another_pack_content_is_another_data_set(factory: PipelineFactory, tmp_path: Path) -> None:
    """Resuming is refused; the difference is named."""
    installed_box(tmp_path, "0.1")
    before = make_plan(factory)
    installed_box(tmp_path, "0.2")
    differences = compare_plans(before, make_plan(factory))
    assert any(line.startswith("versions.pack boxes: was") for line in differences)
    assert compare_plans(before, before) == []


def test_panoramas_that_may_light_a_scene_belong_to_the_data_set(factory: PipelineFactory) -> None:
    assert [name for name in make_plan(factory).assets if name.startswith("environment/")]
