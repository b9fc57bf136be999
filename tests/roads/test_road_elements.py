"""Roads, junctions, crosswalks and car parks: lanes that people and cars can follow."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.assets.library import Library
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Lane, Scene
from gen_data.scene_templates import TABLE
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.element import Element

ROAD = {"type": "road", "name": "main", "length_m": 100.0}


def built(library: Library, *lines: dict[str, Any]) -> Scene:
    elements: list[Element] = [
        TABLE.load(line["type"]).model_validate(line, strict=False) for line in lines
    ]
    return build_scene("street", elements, library)


def by_name(scene: Scene) -> dict[str, Lane]:
    return {lane.name: lane for lane in scene.lanes}


def heading(lane: Lane, k: int) -> float:
    """Direction of a lane's first (0) or last (-1) step."""
    (x0, y0, _), (x1, y1, _) = lane.center_m[:2] if k == 0 else lane.center_m[-2:]
    return math.atan2(y1 - y0, x1 - x0)


def check_links(scene: Scene) -> int:
    """Successors start where their lanes end, in the same direction; how many there are."""
    lanes, count = by_name(scene), 0
    for lane in scene.lanes:
        for name in lane.successors:
            after = lanes[name]
            assert math.dist(lane.center_m[-1], after.center_m[0]) < 0.01
            turn = math.remainder(heading(after, 0) - heading(lane, -1), math.tau)
            assert abs(turn) < math.radians(5.0)
            assert after.kind == lane.kind
            count += 1
    return count


def test_traffic_keeps_right(library: Library) -> None:
    """Forward lanes run along +X on the right (-Y), backward lanes against it on the left."""
    lanes = by_name(built(library, {**ROAD, "lanes": [1, 2]}))
    first, second, back = lanes["main/forward0"], lanes["main/forward1"], lanes["main/backward0"]

    assert first.center_m[0][:2] == (0.0, -1.75)
    assert first.center_m[-1][:2] == (100.0, -1.75)
    assert second.center_m[0][1] == -5.25
    assert back.center_m[0][:2] == (100.0, 1.75)
    assert (first.left, first.right) == ("", "main/forward1")
    assert (second.left, second.right) == ("main/forward0", "")


def test_traffic_keeps_left_where_told(library: Library) -> None:
    """The same road in a country of left-hand traffic."""
    lanes = by_name(built(library, {**ROAD, "traffic": "left"}))

    assert lanes["main/forward0"].center_m[0][:2] == (0.0, 1.75)
    assert lanes["main/backward0"].center_m[0][:2] == (100.0, -1.75)


@pytest.mark.parametrize("curvature", [0.0, 0.02, -0.01])
def test_side_lanes_have_the_street_on_their_left(library: Library, curvature: float) -> None:
    """Parking, sidewalk, verge, furniture and house fronts on both sides."""
    both = {"parking": [True, True], "verge_m": [1.5, 1.5], "bicycle_m": [1.6, 1.6]}
    scene = built(library, {**ROAD, "curvature_per_m": curvature, **both})
    middle = np.array(by_name(scene)["main/forward0"].center_m)
    beside = [lane for lane in scene.lanes if lane.kind != "driving"]

    assert len(beside) == 12
    for lane in beside:
        points = np.array(lane.center_m)
        for a, b in pairwise(points):
            street = middle[np.abs(middle[:, :2] - a[:2]).sum(axis=1).argmin()]
            along, toward = b - a, street - a
            assert along[0] * toward[1] - along[1] * toward[0] > 0.0


def test_cross_section_adds_up(library: Library) -> None:
    """Lane 3.5, parking 2.2, kerb 0.15, verge 1.5, sidewalk 2.5 m, and the heights on them."""
    scene = built(library, {**ROAD, "parking": [True, True], "verge_m": [0, 1.5]})
    lanes = by_name(scene)

    def y_of(name: str) -> float:
        return lanes[name].center_m[0][1]

    assert y_of("main/parking_right") == pytest.approx(-(3.5 + 1.1))
    assert y_of("main/verge_right") == pytest.approx(-(5.7 + 0.15 + 0.75))
    assert y_of("main/sidewalk_right") == pytest.approx(-(5.7 + 0.15 + 1.5 + 1.25))
    assert y_of("main/furniture_right") == pytest.approx(-(5.7 + 0.15 + 1.5 + 0.5))
    assert y_of("main/frontage_left") == pytest.approx(5.7 + 0.15 + 2.5)
    assert lanes["main/forward0"].center_m[0][2] == pytest.approx(0.025 * 1.75)
    assert lanes["main/sidewalk_left"].center_m[0][2] == pytest.approx(0.12 + 0.025 * 1.25)


@pytest.mark.parametrize(("kind", "pitch_m"), [("angled", 2.5 / math.sin(math.radians(60.0))),
                                               ("perpendicular", 2.5)])  # fmt: skip
@pytest.mark.parametrize("traffic", ["right", "left"])
def test_angled_bays_are_lanes_that_cars_drive_into(
    library: Library, kind: str, pitch_m: float, traffic: str
) -> None:
    """One lane per bay, 5 m long and 0.6 m over the kerb, turned outwards from the traffic."""
    scene = built(library, {**ROAD, "parking": kind, "traffic": traffic})
    driving = by_name(scene)
    for word, side in (("left", 1.0), ("right", -1.0)):
        bays = [lane for lane in scene.lanes if lane.name.startswith(f"main/parking_{word}")]
        beside = "forward0" if (side < 0) == (traffic == "right") else "backward0"
        angle = math.remainder(
            heading(bays[0], 0) - heading(driving[f"main/{beside}"], 0), math.tau
        )

        assert len(bays) >= 30
        assert {lane.kind for lane in bays} == {"parking"}
        # Drivers turn to the kerb of their own side.
        turn = -1.0 if traffic == "right" else 1.0
        leaning = 60.0 if kind == "angled" else 90.0
        assert math.degrees(angle) == pytest.approx(turn * leaning, abs=0.1)
        for lane in bays:
            assert lane.center_m[0][1] == pytest.approx(side * 3.5)
            assert abs(lane.center_m[1][1] - lane.center_m[0][1]) == pytest.approx(
                5.6 if kind == "perpendicular" else 5.58 + 0.6 * math.sin(math.radians(60.0)),
                abs=0.01,
            )
        steps = [b.center_m[0][0] - a.center_m[0][0] for a, b in pairwise(bays)]
        assert steps == pytest.approx([pitch_m] * len(steps), abs=1e-4)


def test_kerbed_median_has_a_lane_for_plants(library: Library) -> None:
    """In the middle, between the kerbs, on top."""
    median = {"median_m": 3.0, "median_kerb_m": 0.12}
    lane = by_name(built(library, {**ROAD, **median}))["main/verge_median"]

    assert (lane.kind, lane.width_m) == ("verge", pytest.approx(2.7))
    assert lane.center_m[0] == pytest.approx((0.0, 0.0, 0.025 * 3.5 + 0.12))
    assert "main/verge_median" not in by_name(built(library, {**ROAD, "median_m": 3.0}))


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(5.0, 100.0), st.floats(-180.0, 180.0))
def test_roads_one_after_the_other_are_one_path(
    library: Library, curvature: float, length: float, yaw: float
) -> None:
    """Every driving and side lane goes on: 1 + 1 driving, 2 sidewalks, 2 furniture, 2 fronts."""
    scene = built(
        library,
        {**ROAD, "yaw_deg": yaw, "length_m": length, "curvature_per_m": curvature},
        {"type": "road", "name": "next", "after": "main", "length_m": 20, "curvature_per_m": 0.01},
    )

    assert check_links(scene) == 8


@pytest.mark.parametrize("lanes", [1, 2])
@pytest.mark.parametrize(
    "arms", [[0, 90, 180, 270], [0, 180, 270], [0, 70, 180, 300], [0, 140, 220], [0, 140, 180]]
)
def test_every_way_into_a_junction_leaves(library: Library, arms: list[float], lanes: int) -> None:
    """Each lane that comes in has a successor through the junction onto each road it may take."""
    roads = [
        {"type": "road", "name": f"arm{k}", "after": f"cross/{k}", "lanes": [lanes, lanes],
         "length_m": 30}
        for k in range(len(arms))
    ]  # fmt: skip
    cross = {"type": "junction", "name": "cross", "arms_deg": arms, "lanes": lanes, "yaw_deg": 33}
    scene = built(library, cross, *roads)
    named = by_name(scene)
    check_links(scene)

    for k in range(len(arms)):
        ways = {
            named[after].successors[0].split("/")[0]
            for n in range(lanes)
            for after in named[f"arm{k}/backward{n}"].successors
        }
        assert ways == {f"arm{j}" for j in range(len(arms)) if j != k}
    assert all(named[f"cross/sidewalk{k}"].successors for k in range(len(arms)))


def test_junction_meets_the_road_before_it(library: Library) -> None:
    """``after``: its arm at 180 degrees begins at the road's end."""
    tee = {"type": "junction", "name": "tee", "after": "main", "arms_deg": [90, 180, 270]}
    scene = built(library, ROAD, tee)

    assert len(by_name(scene)["main/forward0"].successors) == 2
    check_links(scene)


def test_crosswalk_spans_the_carriageway_at_its_station(library: Library) -> None:
    """From gutter to gutter, over the crown."""
    walk = {"type": "crosswalk", "name": "zebra", "road": "main", "station_m": 40}
    lane = by_name(built(library, ROAD, walk))["zebra/crosswalk"]

    assert lane.center_m[0] == pytest.approx((40.0, -3.5, 0.0))
    assert lane.center_m[3] == pytest.approx((40.0, 0.0, 0.0875))
    assert lane.center_m[-1] == pytest.approx((40.0, 3.5, 0.0))


def test_car_park_has_a_lane_per_bay(library: Library) -> None:
    """Two aisles with two rows of six; cars point away from their aisle."""
    lot = {"type": "parking_area", "name": "lot", "bays": 6, "aisles": 2, "at_m": [30, -40]}
    scene = built(library, lot)
    bays = [lane for lane in scene.lanes if lane.kind == "parking"]

    assert len(bays) == 24
    assert {lane.width_m for lane in bays} == {2.5}
    assert all(math.dist(lane.center_m[0], lane.center_m[-1]) == 5.0 for lane in bays)
    assert len([lane for lane in scene.lanes if lane.kind == "driving"]) == 4
    assert len({lane.center_m for lane in bays}) == 24


RING = {"type": "roundabout", "name": "ring"}
MARK = {"type": "road_marking", "name": "m", "road": "main"}


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([{**ROAD, "lanes": [0, 0]}], "elements.main.lanes"),
        ([{**ROAD, "sidewalk_m": [-1, 0]}], "elements.main.sidewalk_m"),
        ([{**ROAD, "curvature_per_m": 0.15}], "elements.main.curvature_per_m"),
        ([{**ROAD, "after": "mian"}], "there is no road 'mian'"),
        ([{"type": "junction", "name": "x", "arms_deg": [0, 20, 180]}], "40 to 180"),
        ([{"type": "junction", "name": "x", "radius_m": 2.0}], "too tight for the sidewalk"),
        ([{"type": "crosswalk", "name": "z", "road": "main"}], "there is no road 'main'"),
        ([MARK], "there is no road 'main'"),
        ([{**RING, "arms_deg": [0, 50, 180]}], "larger diameter_m"),
        ([{**RING, "ring_m": 4.5, "truck_apron_m": 2.0}], "elements.ring.ring_m"),
        ([{**RING, "radius_m": 6.0, "sidewalk_m": 8.0}], "too tight for the sidewalk"),
        ([{**RING, "arms_deg": [0, 180, 90]}], "ascending"),
        ([ROAD, {**MARK, "lane": "forward1"}], "has no lane 'forward1'"),
        ([ROAD, {**MARK, "sign": "word", "text": "ÖL"}], "cannot be painted"),
        ([ROAD, {**MARK, "station_m": 98}], "elements.m.station_m"),
    ],
)
def test_what_is_no_street_is_refused(
    library: Library, lines: list[dict[str, Any]], message: str
) -> None:
    """One message that names field and remedy."""
    with pytest.raises(ConfigError, match=message):
        built(library, *lines)


@pytest.mark.parametrize("traffic", ["right", "left"])
@pytest.mark.parametrize("arms", [[0, 90, 180, 270], [0, 120, 240], [90, 180, 270]])
def test_roundabout_leads_from_every_arm_to_every_other(
    library: Library, arms: list[float], traffic: str
) -> None:
    """Paths link the roads, keep to the ring's circle, and turn the way of their traffic."""
    roads = [
        {"type": "road", "name": f"arm{k}", "after": f"ring/{k}", "length_m": 30,
         "traffic": traffic}
        for k in range(len(arms))
    ]  # fmt: skip
    ring = {"type": "roundabout", "name": "ring", "arms_deg": arms, "traffic": traffic}
    scene = built(library, ring, *roads)
    named = by_name(scene)
    check_links(scene)

    for k in range(len(arms)):
        paths = [named[after] for after in named[f"arm{k}/backward0"].successors]
        ways = {path.successors[0].split("/")[0] for path in paths}
        assert ways == {f"arm{j}" for j in range(len(arms)) if j != k}
        for path in paths:
            xy = np.array(path.center_m)[:, :2]
            radius = np.hypot(xy[:, 0], xy[:, 1])
            assert radius.min() == pytest.approx(15.0 - 0.5 * (7.0 - 1.6), abs=0.05)
            # The step about the centre has one sign on the ring.
            a, b = xy[:-1][radius[:-1] < 12.6], xy[1:][radius[:-1] < 12.6]
            turn = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
            assert ((turn if traffic == "right" else -turn) > 0.0).all()
    assert len([lane for lane in scene.lanes if lane.kind == "crosswalk"]) == len(arms)


def test_roundabout_meets_the_road_before_it(library: Library) -> None:
    """``after``: its arm at 180 degrees begins at the road's end, without a step in height."""
    ring = {"type": "roundabout", "name": "ring", "after": "main", "arms_deg": [0, 90, 180]}
    scene = built(library, ROAD, ring)
    lanes = by_name(scene)

    ways = lanes["main/forward0"].successors
    assert len(ways) == 2
    assert lanes[ways[0]].center_m[0] == pytest.approx(
        lanes["main/forward0"].center_m[-1], abs=1e-4
    )


@pytest.mark.parametrize(
    ("sign", "lane", "low", "high"),
    [
        ("left", "forward0", (40.0, -3.5), (45.1, 0.0)),
        ("word", "backward0", (37.3, 0.0), (40.2, 3.5)),
        ("blocked_area", "middle", (40.0, -1.1), (52.0, 1.1)),
        ("zigzag", "parking", (40.0, -5.7), (52.1, -3.5)),
        ("give_way", "forward0", (40.0, -3.5), (40.61, 0.0)),
    ],
)
def test_painted_signs_lie_in_their_lane(
    library: Library, sign: str, lane: str, low: tuple[float, float], high: tuple[float, float]
) -> None:
    """From their foot in the direction of travel, within the lane."""
    line = {"type": "road_marking", "name": "m", "road": "main", "sign": sign, "lane": lane,
            "station_m": 40, "length_m": 12, "text": "30"}  # fmt: skip
    scene = built(library, {**ROAD, "parking": "parallel"}, line)
    (x0, y0, _), (x1, y1, _) = library.bounds_m(scene.body("m").asset)

    assert x0 >= low[0] - 0.2
    assert y0 >= low[1]
    assert x1 <= high[0] + 0.2
    assert y1 <= high[1]
    assert x1 - x0 > 0.5
