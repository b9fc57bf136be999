"""The vehicle that carries the sensors: its place, its rig, and how a configuration adds it."""

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assets.library import Library
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.randomizers.ego_on_lane import EgoOnLane
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.ego import Ego
from gen_data.scene_templates.road import Road
from tests.randomizers.doubles import rng_of


def street(library: Library, ego: Ego) -> Scene:
    return build_scene("test", [Road(name="main", length_m=80.0), ego], library)


def test_rig_is_on_the_ground_below_the_rear_axle(library: Library) -> None:
    """Between the rear wheels' keypoints, at the height of the lane, X along it."""
    scene = street(library, Ego(name="ego", asset="car?seed=4", lane="main/forward0"))
    body, rig = scene.body("ego"), scene.rig_pose("ego")
    wheels = [p.position_m for p in library.keypoints(body.asset) if "rear" in p.name]
    lane = next(lane for lane in scene.lanes if lane.name == "main/forward0")
    local = (body.T_world_body.inverse() @ rig).translation_m

    assert local[0] == pytest.approx(wheels[0][0], abs=1e-5)
    assert local[1] == pytest.approx(0.0, abs=1e-5)
    assert rig.translation_m[1:] == pytest.approx(lane.center_m[0][1:], abs=1e-5)
    assert rig.rotation()[:, 0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)


def test_it_has_an_instance_but_no_label(library: Library) -> None:
    scene = street(library, Ego(name="ego", tags=("van",)))
    instance = scene.instance(scene.body("ego").instance_id)

    assert not instance.annotated
    assert instance.category == "ego"
    assert library.get(instance.asset).category == "van"


def test_what_is_not_there_is_told(library: Library) -> None:
    with pytest.raises(ConfigError, match="there is no driving lane 'main/sidewalk_left'"):
        street(library, Ego(name="ego", lane="main/sidewalk_left"))
    with pytest.raises(ConfigError, match="no asset is tagged spaceship"):
        street(library, Ego(name="ego", tags=("spaceship",)))


def test_a_configuration_adds_an_element_that_its_template_lacks(tmp_path: Path) -> None:
    """An entry with a type is a separate element, after all others; without one, an error."""
    text = "template: street\nrandomizers: []\nsensors: [{type: rgb_camera}]\n"
    (tmp_path / "more.yaml").write_text(text + "elements: {ego: {type: ego, tags: [car]}}\n")
    (tmp_path / "wrong.yaml").write_text(text + "elements: {ego: {tags: [car]}}\n")

    assert load_config(str(tmp_path / "more.yaml")).probes[0].elements[-1] == Ego(name="ego")
    with pytest.raises(ConfigError, match="the template has no element 'ego'"):
        load_config(str(tmp_path / "wrong.yaml"))


@pytest.mark.parametrize(("after", "reached"), [("main", True), ("", False)])
def test_the_ego_vehicle_starts_anywhere_with_enough_road_ahead(
    library: Library, after: str, reached: bool
) -> None:
    """40 m before the end of a road, or nearer where another one goes on."""
    on = [Road(name="on", after=after, length_m=80.0)] if after else []
    main = Road(name="main", length_m=80.0, lanes=(0, 1))
    scene = build_scene("test", [main, *on, Ego(name="ego", lane="main/forward0")], library)
    start = EgoOnLane(name="start", ahead_m=40.0, roads=("main",))
    places = [
        start(scene, library, rng_of("start", scene=k)).rig_pose("ego").translation_m[0]
        for k in range(25)
    ]
    assert (max(places) > 45.0) == reached
