"""Robots in scenes: which one, and where its wrist is."""

import pytest

from gen_data.core.errors import AssetError
from gen_data.core.scene import Scene
from gen_data.scene_templates.robot import Robot
from tests.randomizers.doubles import FakeAssets


def scene(asset: str | tuple[str, ...]) -> Scene:
    """A robot on the ground; the library has only ``two_link``."""
    return Robot(name="arm", asset=asset).add(Scene("test"), FakeAssets())


def test_of_several_robots_the_first_that_is_installed_stands_there() -> None:
    """A pack's arm is missing, so the next one is taken, in every place that names it."""
    built = scene(("robots/ur5e", "two_link", "robots/sawyer"))

    assert built.articulations[0].asset == built.instances[0].asset == "two_link"


@pytest.mark.parametrize("asset", ["two_lnk", ("two_lnk", "robots/ur5e")])
def test_a_robot_that_is_not_there_is_a_mistake(asset: str | tuple[str, ...]) -> None:
    with pytest.raises(AssetError, match=r"two_lnk.*did you mean 'two_link'"):
        scene(asset)
