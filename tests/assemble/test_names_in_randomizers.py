"""Names in randomizers that stand for nothing are refused before a run, with their place."""

from __future__ import annotations

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


@pytest.mark.parametrize(
    ("line", "place", "fact"),
    [
        (
            "{type: textures, name: t, textures: [wod]}",
            "mine.yaml:4:41: randomizers[0].textures",
            "there is no texture 'wod'",
        ),
        (
            "{type: backdrop, name: room, walls: [plastre]}",
            "mine.yaml:4:41: randomizers[0].walls",
            "there is no texture 'plastre'",
        ),
        (
            "{type: environment, name: e, images: [studoi]}",
            "mine.yaml:4:42: randomizers[0].images",
            "no environment is 'studoi'",
        ),
        (
            "{type: environment, name: e, images: [indoor, studoi]}",
            "mine.yaml:4:42: randomizers[0].images",
            "no environment is 'studoi'",
        ),
        (
            "{type: objects, name: cluter}",
            "mine.yaml:4:5: randomizers[0].group",
            "no object group 'cluter'",
        ),
        (
            "{type: objects, name: clutter, weights: {mugg: 2}}",
            "mine.yaml:4:45: randomizers[0].weights",
            "no category 'mugg'",
        ),
        (
            "{type: camera_pose, name: orbit, aim: cluter}",
            "mine.yaml:4:43: randomizers[0].aim",
            "nothing in the scene is named 'cluter'",
        ),
        (
            "{type: camera_pose, name: orbit, camera: colour}",
            "mine.yaml:4:46: randomizers[0].camera",
            "no camera 'colour'",
        ),
        (
            "{type: camera_pose, name: orbit, aim: clutter, fills: 0.0005}",
            "mine.yaml:4:59: randomizers[0].fills",
            "at most 0.0005 of the image of camera 'color'",
        ),
    ],
)
def test_an_unknown_name_is_refused_with_its_place_before_anything_runs(
    tmp_path: Path, line: str, place: str, fact: str
) -> None:
    message = refusal(tmp_path, line)

    assert place in message
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
