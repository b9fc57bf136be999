"""Streets: objects along lanes, and signals at junctions."""

import math

import numpy as np
import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Scene
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.junction import Junction
from gen_data.scene_templates.lane_objects import LaneObjects
from gen_data.scene_templates.objects import AssetChoice
from gen_data.scene_templates.road import Road
from gen_data.scene_templates.signals import Signals
from tests.libraries import library


def crossing() -> list[object]:
    """Two roads that meet at a junction; the second leads away from it."""
    return [
        Road(name="main", length_m=60.0),
        Junction(name="cross", after="main"),
        Road(name="on", after="cross/0", length_m=40.0),
    ]


def built(*elements: object) -> Scene:
    return build_scene("test", [*crossing(), *elements], library())  # type: ignore[list-item]


def yaw_of(body: Body) -> float:
    ahead = body.T_world_body.rotation()[:, 0]
    return math.atan2(ahead[1], ahead[0])


def test_things_are_spread_evenly_over_all_lanes_of_their_kinds() -> None:
    """Twelve benches on four furniture lanes of 60 m and 40 m: distances are the same."""
    benches = LaneObjects(
        name="benches", lanes=("furniture",), count=10, assets=AssetChoice(ids=("bench",))
    )
    scene = built(benches)
    placed = [b for b in scene.bodies if b.group == "benches"]
    lanes = [lane for lane in scene.lanes if lane.kind == "furniture"]

    assert len(placed) == 10
    for body in placed:
        x, y, _ = body.T_world_body.translation_m
        nearest = min(math.hypot(x - px, y - py) for lane in lanes for px, py, _ in lane.center_m)
        assert nearest < 2.5
    assert {i.category for i in scene.instances if i.name.startswith("benches")} == {"bench"}


def test_house_fronts_stand_on_the_frontage_and_face_the_street() -> None:
    """To the left of their lane, where the street is."""
    houses = LaneObjects(
        name="houses",
        lanes=("frontage",),
        facing="left",
        count=6,
        assets=AssetChoice(ids=("building/residential",)),
        annotate=False,
    )
    scene = built(houses)
    roads = [lane for lane in scene.lanes if lane.kind == "driving"]
    middle = np.array([p[:2] for lane in roads for p in lane.center_m])
    for body in (b for b in scene.bodies if b.group == "houses"):
        here = np.array(body.T_world_body.translation_m[:2])
        ahead = body.T_world_body.rotation()[:2, 0]
        to_street = middle[np.argmin(np.sum((middle - here) ** 2, axis=1))] - here
        assert ahead @ to_street / np.linalg.norm(to_street) > 0.7


def test_every_road_that_comes_to_a_junction_has_a_signal_that_faces_it() -> None:
    """``main`` comes towards +X; ``on`` comes back towards -X: lights look at both."""
    scene = built(Signals(name="signals", junction="cross"))
    signals = [b for b in scene.bodies if b.name.startswith("signals/")]

    assert sorted(round(abs(yaw_of(b)), 3) for b in signals) == [0.0, round(math.pi, 3)]
    for body in signals:
        _, y, _ = body.T_world_body.translation_m
        looks_back = abs(yaw_of(body)) > 1.0
        # Right of those who come: traffic keeps right.
        assert (y < 0.0) == looks_back
        assert 3.5 < abs(y) < 6.0


@pytest.mark.parametrize(("element", "fact"), [
    (Signals(name="signals", junction="corss"), "no road leads to a junction 'corss'"),
    (LaneObjects(name="boats", lanes=("bicycle",), count=3, assets=AssetChoice(ids=("bench",))),
     "no lane of kind bicycle"),
])  # fmt: skip
def test_what_has_no_place_is_one_clear_error(element: object, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        built(element)


def test_preferred_assets_replace_others_category_by_category() -> None:
    """Street lights are taken, since nothing of their category is preferred; benches all are."""
    choice = AssetChoice(ids=("bench", "street_light"), prefer=("bench",))
    chosen = choice.resolve(library(), "field")
    everything = AssetChoice(ids=("bench", "street_light")).resolve(library(), "field")

    assert chosen == everything
    trees = AssetChoice(tags=("tree",), prefer=("birch",)).resolve(library(), "field")
    assert trees and all(asset.startswith("tree/birch") for asset in trees)
