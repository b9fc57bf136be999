"""Bridges, level crossings, petrol stations and squares: lanes stay free, the rest makes room."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.content.scenery.shelters import pump_islands_m
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.scene_templates import builder, level_crossing, overpass, petrol_station, square
from gen_data.scene_templates.element import Element
from gen_data.scene_templates.road import Road
from gen_data.scene_templates.tram_line import TramLine
from tests.libraries import library
from tests.scenery.rays import cast

TOWN = Road(name="main", length_m=150.0, verge_m=(1.5, 1.5), setback_m=(5.0, 5.0), parking=True)
BENT = Road(
    name="main", length_m=200.0, kerb_m=0.0, sidewalk_m=(0.0, 0.0), verge_m=(1.5, 1.5),
    setback_m=(14.0, 14.0), curvature_per_m=0.005, median_m=4.0, lanes=(2, 2),
)  # fmt: skip
PLACES: tuple[Element, ...] = (
    overpass.Overpass(name="place", road="main", station_m=75.0),
    overpass.Overpass(name="place", road="main", station_m=75.0, kind="steel", width_m=8.0),
    level_crossing.LevelCrossing(name="place", road="main", station_m=75.0),
    petrol_station.PetrolStation(name="place", road="main", station_m=75.0),
    square.Square(name="place", road="main", station_m=75.0),
)
VEHICLE_M = 4.4
"""Height that stays free: vehicles are at most 4 m high (Directive 96/53/EC)."""


def built(*elements: Element) -> Scene:
    return builder.build_scene("test", elements, library())


@pytest.fixture(
    params=[(road, place) for road in (TOWN, BENT) for place in PLACES],
    ids=lambda p: f"{'bent' if p[0] is BENT else 'town'}-{p[1].type}", scope="module",
)  # fmt: skip
def scene(request: pytest.FixtureRequest) -> Scene:
    return built(*request.param)


def test_driving_lanes_are_what_they_were(scene: Scene) -> None:
    """Neither their number nor their course changes, and traffic can go on."""
    length = 200.0 if any(lane.name == "main/forward1" for lane in scene.lanes) else 150.0
    before = built(BENT if length == 200.0 else TOWN)
    driving = {lane.name: lane.center_m for lane in before.lanes if lane.kind == "driving"}

    assert {n.name: n.center_m for n in scene.lanes if n.kind == "driving"} == driving


def test_nothing_stands_in_the_space_of_vehicles_and_people(scene: Scene) -> None:
    """Rays from above the middles and borders of lanes meet nothing before the ground."""
    points = np.concatenate([
        np.array(lane.center_m) + np.array([0.0, 0.0, VEHICLE_M if lane.kind == "driving" else 2.3])
        for lane in scene.lanes
        if lane.kind == "driving" or lane.name.startswith("main/sidewalk")
    ])  # fmt: skip
    down = np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    for body in (body for body in scene.bodies if body.name.startswith("place/")):
        mesh = library().mesh(body.asset)
        if body.asset.startswith("tree"):
            continue  # Crowns reach over sidewalks, as do all street trees.
        inverse = body.T_world_body.inverse()
        distance, face, _ = cast(mesh, inverse.apply(points), inverse.rotate(down))
        hit = np.array([f >= 0 for f in face])
        assert (np.array(distance)[hit] > 2.1).all(), body.name


def test_gardens_and_houses_leave_room(scene: Scene) -> None:
    """Nothing solid of the place stands on the remainder of the lanes of plants and houses."""
    beside = [n for n in scene.lanes if n.kind in ("garden", "verge") and n.road == "main"]
    points = np.concatenate([np.array(lane.center_m)[:, :2] for lane in beside])
    for body in scene.bodies:
        # Crowns of trees reach farther than their trunks.
        is_low = not body.asset.startswith(("building", "tree"))
        if body.name.startswith("place/") and body.instance_id and is_low:
            (x0, y0, _), (x1, y1, _) = library().bounds_m(body.asset)
            local = body.T_world_body.inverse().apply(
                np.column_stack([points, np.zeros(len(points))])
            )
            inside = (
                (local[:, 0] > x0) & (local[:, 0] < x1) & (local[:, 1] > y0) & (local[:, 1] < y1)
            )
            assert not inside.any(), body.name


def test_a_bridge_is_as_high_and_wide_as_it_says() -> None:
    """4.7 m over the road, from beyond one sidewalk to beyond the other."""
    made = built(TOWN, PLACES[0])
    (deck,) = (b for b in made.bodies if b.name == "place/deck")
    (_, y0, low), (_, y1, _) = library().bounds_m(deck.asset)
    edge_m = 3.5 + 2.2 + 0.15 + 1.5 + 2.5

    assert low == pytest.approx(4.7, abs=1e-3)
    assert (y0, y1) == pytest.approx((-(edge_m + 1.6), edge_m + 1.6), abs=0.01)


def test_rails_have_standard_gauge_on_the_road_and_beside_it() -> None:
    """1435 mm between the inner edges of the heads."""
    made = built(TOWN, PLACES[2])
    panels = next(b for b in made.bodies if b.name == "place/panels")
    mesh = library().mesh(panels.asset)
    rails = [k for k, m in enumerate(mesh.materials) if m.metallic > 0.8 and m.roughness < 0.4]
    s = mesh.vertices_m[np.unique(mesh.faces[np.isin(mesh.face_slots, rails)])][:, 0]
    inner = np.abs(s - 75.0).min()
    track = next(b for b in made.bodies if b.name == "place/track_left")
    steel = library().mesh(track.asset)
    top = steel.vertices_m[steel.vertices_m[:, 2] > 0.5]

    assert 2.0 * inner == pytest.approx(1.435, abs=2e-3)
    assert 2.0 * np.abs(top[:, 1]).min() == pytest.approx(1.435, abs=2e-3)


def test_a_square_has_people_and_houses_around_it() -> None:
    """Lanes for people along the houses; houses begin where the paving ends."""
    made = built(TOWN, PLACES[4])
    walks = [lane for lane in made.lanes if lane.name.startswith("place/sidewalk")]
    houses = [body for body in made.bodies if body.asset.startswith("building")]
    pad = next(b for b in made.bodies if b.name == "place/pavement")
    inverse = pad.T_world_body.inverse()

    assert len(walks) == 3
    assert all(lane.kind == "sidewalk" for lane in walks)
    assert len(houses) >= 5
    for house in houses:
        (x0, y0, _), (_, y1, _) = library().bounds_m(house.asset)
        middle = house.T_world_body.apply(np.array([[x0, 0.5 * (y0 + y1), 0.0]]))
        x, y, _ = inverse.apply(middle)[0]
        assert x > 15.0 or abs(y) > 20.0


@pytest.mark.parametrize("road", [TOWN, BENT], ids=["town", "bent"])
def test_driveways_lead_from_the_gutter_to_the_forecourt(road: Road) -> None:
    """They begin in the gutter, rise over the kerb, and end on the forecourt at its height."""
    made = built(road, PLACES[3])
    pad = next(b for b in made.bodies if b.name == "place/forecourt")
    (x0, _, _), _ = library().bounds_m(pad.asset)
    ways = [b for b in made.bodies if b.name.startswith("place/driveway")]

    assert len(ways) == 2
    for body in ways:
        ends = [(x, 0.0, 0.0) for x in (-0.45, library().bounds_m(body.asset)[1][0])]
        gutter, far = body.T_world_body.apply(np.array(ends))
        assert gutter[2] == pytest.approx(0.0, abs=0.01)
        inside = pad.T_world_body.inverse().apply(far[None])[0]
        assert x0 - 0.05 < inside[0] < x0 + 1.0
        top = library().bounds_m(body.asset)[1][2]
        assert top == pytest.approx(pad.T_world_body.translation_m[2] + 0.012, abs=0.011)


def test_cars_stand_beside_the_islands_under_the_canopy() -> None:
    """With labels, clear of islands and of each other; none if nobody fills up."""
    busy = petrol_station.PetrolStation(name="place", road="main", station_m=75.0, cars=1.0, seed=2)
    made = built(TOWN, busy)
    canopy = next(b for b in made.bodies if b.name == "place/canopy")
    islands = pump_islands_m(2)
    cars = [b for b in made.bodies if b.name.startswith("place/car")]
    annotated = {i.name for i in made.instances if i.annotated}

    assert len(cars) == len(islands)
    assert {car.name for car in cars} <= annotated
    inverse = canopy.T_world_body.inverse()
    for car in cars:
        (x0, y0, _), (x1, y1, _) = library().bounds_m(car.asset)
        corners = car.T_world_body.apply(
            np.array([(x, y, 0.0) for x in (x0, x1) for y in (y0, y1)])
        )
        y = inverse.apply(corners)[:, 1]
        for island in islands:
            assert (y > island + 0.55).all() or (y < island - 0.55).all()
    quiet = built(TOWN, busy.model_copy(update={"cars": 0.0}))
    assert not any(b.name.startswith("place/car") for b in quiet.bodies)


RAILS = Road(name="main", length_m=120.0, tram=True, lanes=(2, 2), median_m=3.0)


def test_contact_wires_hang_over_the_tracks_between_poles() -> None:
    """5.5 m over the middles of the inner lanes, without gaps; poles stand next to the lanes."""
    made = built(RAILS, TramLine(name="wires", road="main"))
    lanes = {lane.name: np.array(lane.center_m) for lane in made.lanes}
    wires = [b for b in made.bodies if b.name.endswith("/wires")]
    poles = [b for b in made.bodies if "/pole_" in b.name]
    points = np.concatenate(
        [b.T_world_body.apply(library().mesh(b.asset).vertices_m.astype(float)) for b in wires]
    )
    thin = points[np.abs(points[:, 2] - 5.5) < 0.02]

    assert len(wires) == 4 and len(poles) == 8
    for name in ("main/forward0", "main/backward0"):
        mine = thin[np.abs(thin[:, 1] - lanes[name][0, 1]) < 0.02]
        assert np.unique(np.round(mine[:, 0], 3))[[0, -1]] == pytest.approx([0.0, 120.0], abs=0.01)
    assert min(abs(b.T_world_body.translation_m[1]) for b in poles) > 8.6
    assert all(b.instance_id for b in poles) and not any(b.instance_id for b in wires)
    with pytest.raises(ConfigError, match="'main' bends; expected a straight road"):
        built(RAILS.model_copy(update={"curvature_per_m": 0.004}), TramLine(name="w", road="main"))
    with pytest.raises(ConfigError, match="'main' has no track"):
        built(TOWN, TramLine(name="w", road="main"))


@pytest.mark.parametrize("place", PLACES, ids=lambda p: p.type)
def test_places_need_room_on_their_road(place: Element) -> None:
    """The error names the field and the possible stations; unknown roads are named too."""
    late = place.model_copy(update={"station_m": 149.0})
    with pytest.raises(
        ConfigError, match=r"elements.place.station_m: 149 m; expected .* on 'main'"
    ):
        built(TOWN, late)
    with pytest.raises(ConfigError, match="no road 'other'"):
        built(TOWN, place.model_copy(update={"road": "other"}))


def test_bays_are_left_out_where_the_place_is_and_nowhere_else() -> None:
    """Lanes across the road are not cut."""
    road = TOWN.model_copy(update={"parking": ("perpendicular", "perpendicular")})
    before, after = (
        {n.name: n for n in scene.lanes if n.kind == "parking"}
        for scene in (built(road), built(road, PLACES[2]))
    )
    gone = [lane.center_m[0][0] for name, lane in before.items() if name not in after]

    assert 4 <= len(gone) <= 10
    assert all(abs(x - 75.0) <= 5.5 for x in gone)
    assert all(after[name] == replace(before[name], successors=()) for name in after)
