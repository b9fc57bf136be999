"""Names in randomizers that stand for nothing are refused before a run, with their place."""

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.core.errors import ConfigError
from gen_data.randomizers.base import find_textures

HEAD = (
    "template: tabletop\n"
    "sensors: [{type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}]\n"
    "randomizers:\n"
)


def refusal(folder: Path, *lines: str) -> str:
    path = folder / "mine.yaml"
    path.write_text(HEAD + "".join(f"  - {line}\n" for line in lines))
    factory = PipelineFactory(load_config(str(path)), n=1)
    with pytest.raises(ConfigError) as caught:
        assert factory.nominal
    return str(caught.value)


@pytest.mark.parametrize(("given", "column", "field", "fact"), [
    ("textures, name: t, textures: [wod]", 41, "textures", "there is no texture 'wod'"),
    ("backdrop, name: room, walls: [plastre]", 41, "walls", "there is no texture 'plastre'"),
    ("environment, name: e, images: [studoi]", 42, "images", "no environment is 'studoi'"),
    ("environment, name: e, images: [indoor, studoi]", 42, "images", "no environment is 'studoi'"),
    ("objects, name: cluter", 5, "group", "no object group 'cluter'"),
    ("objects, name: clutter, weights: {mugg: 2}", 45, "weights", "no category 'mugg'"),
    ("textures, name: t, textures: [wood], prints: true, categories: [mug, mugg]", 75, "categories",
     "no object has the category 'mugg'"),
    ("reaching_hand, name: hands, held_categories: [mugg]", 57, "held_categories",
     "no object has the category 'mugg'"),
    ("textures, name: t, textures: [wood], targets: [cluter]", 58, "targets",
     "there is no 'cluter'"),
    ("camera_intrinsics, name: lens, camera: colour", 51, "camera", "there is no camera 'colour'"),
    ("camera_intrinsics, name: lens, hfov_deg: 60, lens: {k1: 0.1}", 63, "lens",
     "model 'pinhole' with no coefficients, not k1; "),
    ("arm_motion, name: task, objects: [cluter]", 45, "objects", "no object group 'cluter'"),
    ("camera_pose, name: orbit, aim: cluter", 43, "aim", "nothing in the scene is named 'cluter'"),
    ("camera_pose, name: orbit, camera: colour", 46, "camera", "no camera 'colour'"),
    ("camera_pose, name: orbit, aim: clutter, fills: 0.0005", 59, "fills",
     "at most 0.0005 of the image of camera 'color'"),
])  # fmt: skip
def test_an_unknown_name_is_refused_with_its_place_before_anything_runs(
    tmp_path: Path, given: str, column: int, field: str, fact: str
) -> None:
    message = refusal(tmp_path, f"{{type: {given}}}")

    assert f"mine.yaml:4:{column}: randomizers[0].{field}" in message
    assert fact in message
    assert "; expected " in message


def test_all_unknown_names_are_told_at_once(tmp_path: Path) -> None:
    message = refusal(
        tmp_path, "{type: textures, name: t, textures: [wod]}", "{type: objects, name: cluter}"
    )

    assert message.index("mine.yaml:4:") < message.index("mine.yaml:5:")


def test_textures_are_named_by_id_tag_or_family() -> None:
    """An id is one texture; a tag or a family is several."""
    library = open_library(())
    one, *_ = (a.asset_id for a in library.find((), kind="texture"))
    assert find_textures(library, (one,), "textures") == (one,)
    assert len(find_textures(library, ("wood",), "textures")) > 1


def test_of_many_textures_the_nearest_are_listed(tmp_path: Path) -> None:
    text = refusal(tmp_path, "{type: textures, name: t, textures: [wod]}")
    assert "did you mean 'wood'?" in text
    assert len(text.splitlines()[0]) < 250


@pytest.mark.parametrize(("given", "fact"), [
    ("camera_pose, name: orbit, rig: ego", "rig: there is no stand 'ego'; there are none"),
    ("rig_calibration, name: play, rig: ego",
     "rig: no sensor is on a rig 'ego'; rigs with sensors: none"),
])  # fmt: skip
def test_a_rig_in_a_scene_without_rigs_is_refused(tmp_path: Path, given: str, fact: str) -> None:
    message = refusal(tmp_path, f"{{type: {given}}}")
    assert f"randomizers[0].{fact}" in message.splitlines()[0]


def test_objects_hang_in_boughs_only(tmp_path: Path) -> None:
    """On a table, every attempt at a layout failed, for want of room as it said."""
    config = tmp_path / "mine.yaml"
    config.write_text(HEAD.replace("randomizers:\n", "elements:\n  clutter: {placement: hang}\n"))
    with pytest.raises(ConfigError) as caught:
        assert PipelineFactory(load_config(str(config)), n=1).nominal
    assert str(caught.value).startswith(
        f"{config}:4:24: elements[3].placement: nothing can hang on 'table'; expected an element "
        "of type fruit_bough as 'on'"
    )
