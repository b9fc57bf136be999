"""Umbrellas in rain."""

from dataclasses import replace

import pytest

from gen_data.assets.library import Library
from gen_data.core.errors import ConfigError
from gen_data.core.members import Member, add_members
from gen_data.core.scene import ObjectGroup, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.randomizers.umbrellas import Umbrellas
from tests.randomizers.doubles import rng_of

POSES = ("walk", "stand", "walk_cup", "sit", "walk_slow")
COUNT = 60


def street(library: Library, rain_mm_h: float) -> Scene:
    """People in all poses, and a group that is not a target."""
    assets = tuple(f"simple_person?pose={pose}&seed=1" for pose in POSES)
    group = ObjectGroup("people", (), assets, 0, "along", lanes=("sidewalk",))
    scene = Scene("test", groups=(group,), weather=Weather(rain_mm_h=rain_mm_h))
    for asset in assets:
        members = [Member(asset, SE3((0.0, float(k), 0.0))) for k in range(COUNT)]
        start = sum(body.group == "people" for body in scene.bodies)
        scene = add_members(scene, group, members, library, first=start)
    return scene


def shares(library: Library, rain_mm_h: float) -> dict[str, float]:
    """Share of people under umbrellas, by the pose that they had."""
    before = street(library, rain_mm_h)
    after = Umbrellas(name="umbrellas")(before, library, rng_of("umbrellas"))
    found = dict.fromkeys(POSES, 0.0)
    for old, new in zip(before.bodies, after.bodies, strict=True):
        pose = old.asset.partition("pose=")[2].partition("&")[0]
        expected = "stand_umbrella" if pose == "stand" else "walk_umbrella"
        assert new.asset in (old.asset, old.asset.replace(f"pose={pose}", f"pose={expected}"))
        found[pose] += (new.asset != old.asset) / COUNT
    assert [i.asset for i in after.instances] == [b.asset for b in after.bodies]
    return found


def test_half_of_those_with_free_hands_open_one_in_rain(library: Library) -> None:
    """Walking and standing people; nobody who sits or carries a cup."""
    found = shares(library, 8.0)

    assert found["walk_cup"] == found["sit"] == 0.0
    assert all(0.35 < found[pose] < 0.75 for pose in ("walk", "stand", "walk_slow"))


def test_light_rain_opens_fewer_and_dry_weather_none(library: Library) -> None:
    """A fifth of the share at a fifth of the rain rate."""
    assert 0.01 < shares(library, 0.5)["walk"] < 0.3
    dry = street(library, 0.0)
    assert Umbrellas(name="umbrellas")(dry, library, rng_of("umbrellas")) is dry


def test_unknown_groups_are_refused(library: Library) -> None:
    wrong = Umbrellas(name="umbrellas", targets=("persons",))
    with pytest.raises(ConfigError, match=r"randomizers.umbrellas.targets.*'persons'.*people"):
        wrong.check(replace(street(library, 0.0)), library)
