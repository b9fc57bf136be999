"""Districts: elements that a scene lacks, land before houses, and the streets of the template."""

from functools import cache

import numpy as np
import pytest

from gen_data.assemble.config import Config, load_config
from gen_data.config.distributions import Constant
from gen_data.config.problems import Problems
from gen_data.config.shared_values import resolve_shared
from gen_data.config.validation import validate
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene, SharedValue
from gen_data.core.streams import Streams
from gen_data.randomizers.lane_objects import LaneObjects as DrawLaneObjects
from gen_data.randomizers.weather import PRESETS
from gen_data.scene_templates import builder, crosswalk, horizon, junction, signals
from gen_data.scene_templates.element import Element
from gen_data.scene_templates.lane_objects import LaneObjects
from gen_data.scene_templates.objects import AssetChoice
from gen_data.scene_templates.road import Road
from tests.libraries import library
from tests.randomizers.doubles import rng_of

BENCHES = LaneObjects(
    name="benches", lanes=("furniture",), count=4, assets=AssetChoice(ids=("bench",)), present=False
)


@cache
def street() -> Config:
    return load_config("street")


def built(*elements: Element) -> Scene:
    return builder.build_scene("test", elements, library())


def test_absent_elements_leave_nothing_but_the_names_of_their_groups() -> None:
    """A randomizer of the group changes nothing; unknown groups are still refused."""
    scene = built(Road(name="main"), Road(name="side", at_m=(0.0, 50.0), present=False), BENCHES)
    draw = DrawLaneObjects(name="benches", weights={"bench": 2.0})
    draw.check(scene, library())

    assert {lane.road for lane in scene.lanes} == {"main"}
    assert [body.name for body in scene.bodies] == ["main"]
    assert draw(scene, library(), rng_of("stream")) is scene
    with pytest.raises(ConfigError, match="no object group 'bench'"):
        DrawLaneObjects(name="bench").check(scene, library())


@pytest.mark.parametrize(("element", "place"), [
    (Road(name="on", after="cross/0"), "elements.on.after: the element 'cross' is absent"),
    (signals.Signals(name="signals", junction="cross"), "elements.signals.junction: the element"),
    (crosswalk.Crosswalk(name="zebra", road="side"), "elements.zebra.road: the element 'side'"),
])  # fmt: skip
def test_relations_to_absent_elements_are_one_clear_error(element: Element, place: str) -> None:
    """The error names the field, the absent element and the remedy; absent ones may refer to it."""
    absent = (junction.Junction(name="cross", present=False), Road(name="side", present=False))
    with pytest.raises(ConfigError, match=place) as caught:
        built(Road(name="main"), *absent, element)
    assert f"or present: false for '{element.name}'" in str(caught.value)
    assert built(Road(name="main"), *absent, element.model_copy(update={"present": False})).lanes


def test_houses_stand_behind_the_setback() -> None:
    """Garden and frontage are level with the sidewalk's outer edge, at the widths of the road."""
    lanes = {lane.name: lane for lane in built(Road(name="main", setback_m=(5.0, 0.0))).lanes}
    garden, front = lanes["main/garden_left"], lanes["main/frontage_left"]
    edge_m = 3.5 + 0.15 + 2.5

    assert garden.width_m == 5.0
    assert garden.center_m[0][1] == pytest.approx(edge_m + 2.5)
    assert front.center_m[0][1] == pytest.approx(edge_m + 5.0)
    assert garden.center_m[0][2] == pytest.approx(0.12 + 0.025 * 2.5)
    assert front.center_m[0][2] == garden.center_m[0][2]
    assert "main/garden_right" not in lanes
    assert lanes["main/frontage_right"].center_m[0][1] == pytest.approx(-edge_m)


def test_fronts_go_on_past_a_side_road_opposite() -> None:
    """The straight side of a T has houses as far back as the roads have; its corners have none."""
    scene = built(
        Road(name="main", length_m=40.0, setback_m=(5.0, 5.0)),
        junction.Junction(name="cross", after="main", arms_deg=(0.0, 90.0, 180.0), setback_m=5.0),
        Road(name="on", after="cross/0", length_m=40.0, setback_m=(5.0, 5.0)),
    )
    lanes = {lane.name: lane for lane in scene.lanes}
    fronts = [name for name, lane in lanes.items() if lane.kind == "frontage"]

    assert sorted(name for name in fronts if name.startswith("cross")) == ["cross/frontage2"]
    assert lanes["main/frontage_right"].successors == ("cross/frontage2",)
    assert lanes["cross/frontage2"].successors == ("on/frontage_right",)


@cache
def districts() -> dict[tuple[SharedValue, SharedValue], Scene]:
    """Roads by district and junction: each district and each junction at least once."""
    config, scenes = street(), {}
    seen: set[SharedValue] = set()
    for number in range(300):
        shared = config.shared(Streams(3, number, index=number))
        key = (dict(shared)["district"], dict(shared)["junction"])
        if not seen.issuperset(key):
            seen.update(key)
            elements = config.scene_config(shared).elements
            roads = [e for e in elements if not isinstance(e, LaneObjects)]
            scenes[key] = builder.build_scene("street", roads, library())
    return scenes


@pytest.mark.slow
def test_every_district_and_junction_is_drawn() -> None:
    """All outcomes of both shared values."""
    names = {name for key in districts() for name in key}
    assert names == {
        *("old_town", "residential", "leafy_suburb", "garden_villas", "arterial", "industrial"),
        *("campus", "park_edge", "village", "country_road", "motorway"),
        *("x", "t_left", "t_right", "t_end", "y", "roundabout", "none"),
    }


@pytest.mark.slow
def test_traffic_can_go_on_where_roads_meet() -> None:
    """In every district, the lanes of roads that lead to a junction or another road continue."""
    for key, scene in districts().items():
        driving = {lane.name: lane for lane in scene.lanes if lane.kind == "driving"}
        along = [lane for name, lane in driving.items() if name.startswith("main/forward")]
        assert along and all(lane.successors for lane in along), key
        back = [lane for lane in driving.values() if lane.name.startswith("on/backward")]
        assert all(lane.successors for lane in back), key
        crossing = [lane for lane in driving.values() if lane.junction]
        assert bool(crossing) == (key[1] != "none"), key
        assert all(lane.successors for lane in crossing), key


@pytest.mark.slow
def test_cyclists_ride_along_across_and_towards() -> None:
    """On the right of their lanes: directions of all quarters, in streets of all districts."""
    config, ways = street(), []
    parts = config.scene_config(config.shared(Streams(3, 0, index=0)))
    group = next(e for e in parts.elements if e.name == "cyclists")
    draw = next(r for r in parts.randomizers if r.name == "cyclists")
    draw = draw.model_copy(update={"count": Constant(4)})  # type: ignore[attr-defined]
    for number, scene in enumerate(districts().values()):
        streams = Streams(2, number)
        drawn = draw(group.add(scene, library()), library(), streams.rng("cyclists"))
        bodies = [body for body in drawn.bodies if body.group == "cyclists"]
        ways += [np.arctan2(*body.T_world_body.rotation()[[1, 0], 0]) for body in bodies]
    quarters = np.bincount(np.round(np.array(ways) / (0.5 * np.pi)).astype(int) % 4, minlength=4)

    assert quarters.sum() > 20
    assert (quarters >= 0.1 * quarters.sum()).all(), quarters


def test_groups_may_use_only_the_outer_or_the_inner_lanes() -> None:
    """Of two lanes of 3.5 m each way: all, those at the kerb, those next to the middle."""
    group = LaneObjects(name="bins", lanes=("driving",), assets=AssetChoice(ids=("bench",)))
    scene = built(Road(name="main", lanes=(2, 2)), group)
    away_m = {}
    for among in ("all", "rightmost", "leftmost"):
        draw = DrawLaneObjects(name="bins", among=among, gap_m=Constant(5.0))
        drawn = draw(scene, library(), rng_of("stream"))
        places = [b.T_world_body.translation_m[1] for b in drawn.bodies if b.group == "bins"]
        away_m[among] = {round(abs(y), 1) for y in places}

    assert {among: sorted(found) for among, found in away_m.items()} == {
        "all": [1.8, 5.2],
        "rightmost": [5.2],
        "leftmost": [1.8],
    }


@pytest.mark.slow
def test_sections_differ_by_district() -> None:
    """Typical traits of each district."""
    by_district = {key[0]: scene for key, scene in districts().items()}
    kinds = {
        name: {lane.kind for lane in scene.lanes if lane.road == "main"}
        for name, scene in by_district.items()
    }
    lanes_m = {
        name: {lane.width_m for lane in scene.lanes if lane.kind == "driving"}
        for name, scene in by_district.items()
    }

    assert "sidewalk" not in kinds["country_road"] | kinds["motorway"]
    assert "garden" not in kinds["old_town"]
    assert "garden" in kinds["garden_villas"] & kinds["village"] & kinds["industrial"]
    assert lanes_m["motorway"] == {3.75}
    assert max(lanes_m["village"]) < max(lanes_m["arterial"])
    forward = [lane for lane in by_district["arterial"].lanes if "main/forward" in lane.name]
    assert len(forward) >= 2


@pytest.mark.slow
def test_land_beyond_the_ends_of_roads_is_grass_in_every_district() -> None:
    """Gravel lay there in towns: on slopes, a broad beige band between road and horizon."""
    for key, scene in districts().items():
        (land,) = (body for body in scene.bodies if body.name == "land")
        roles = [material.role for material in library().materials(land.asset)]
        assert roles == ["grass"], key


@pytest.mark.slow
def test_towers_stand_where_one_sees_a_city() -> None:
    """Often at arterials, seldom in suburbs, never in villages; never on more than a third."""
    config = street()
    listed = config.document.entries["elements"].items
    (item,) = (e for e in listed if e.plain().get("name") == "city")
    seen: dict[SharedValue, list[bool]] = {}
    for number in range(400):
        shared = config.shared(Streams(5, number, index=number))
        # The other elements would take a hundred times as long.
        problems = Problems()
        city = validate(resolve_shared(item, dict(shared)), horizon.Horizon, problems)
        problems.raise_if_any()
        assert city is not None
        assert sum(high - low for low, high in city.arcs_deg) <= 120.0
        seen.setdefault(dict(shared)["district"], []).append(city.present)
    share = {name: sum(flags) / len(flags) for name, flags in seen.items()}

    assert share["village"] == share["country_road"] == share["garden_villas"] == 0.0
    assert share["leafy_suburb"] < share["residential"] < 0.5 < share["arterial"] < 0.9


@pytest.mark.slow
def test_trees_are_bare_where_snow_lies() -> None:
    """Every weather with snow on the ground draws winter, whose deciduous trees are bare."""
    snowy = [name for name, preset in PRESETS.items() if preset.condition.weather.snow_cover > 0.0]
    assert len(snowy) == 15
    choice = f"shared.weather={{choice: [{', '.join(snowy)}]}}"
    config = load_config("street", overrides=[choice])
    drawn = [config.shared(Streams(3, scene, index=scene)) for scene in range(150)]
    assert {dict(shared)["weather"] for shared in drawn} == set(snowy)
    assert {dict(shared)["season"] for shared in drawn} == {"winter"}
    shared = drawn[0]
    parts = config.scene_config(shared).elements
    trees = [part for part in parts if isinstance(part, LaneObjects) and "trees" in part.name]
    found = {a for part in trees for a in part.assets.resolve(library(), part.name)}
    leafy = {a.split("?")[0] for a in found if "bare" not in str(library().get(a).attributes)}

    assert leafy == {"tree/conifer", "tree/pine", "tree/thuja"}
    assert [part.season for part in parts if isinstance(part, horizon.Horizon)][:1] == ["winter"]
