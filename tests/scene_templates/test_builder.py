"""From elements and their relations to a nominal scene."""

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.scene import Scene
from gen_data.scene_templates import TABLE
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.element import Element
from tests.randomizers.doubles import FakeAssets, corners_of, deepest_overlap_m

TABLE_M = (1.2, 0.8)
HOUSEHOLD = {"tags": ["household"]}


def element(**plain: Any) -> Element:
    made: Element = TABLE.load(plain["type"]).model_validate(plain, strict=False)
    return made


def built(*lines: dict[str, Any]) -> Scene:
    return build_scene("test", [element(**line) for line in lines], FakeAssets())


ROOM = {"type": "room", "name": "room", "size_m": (5, 4, 2.8)}
DESK = {"type": "surface", "name": "table", "top_size_m": TABLE_M, "height_m": 0.74}
TINY = {**DESK, "top_size_m": (0.19, 0.19)}
ARM = {"type": "robot", "name": "arm", "asset": "two_link", "on": "table", "at_m": (-0.45, 0.1)}


def clutter(**other: Any) -> dict[str, Any]:
    return {"type": "objects", "name": "clutter", "on": "table", "assets": HOUSEHOLD, **other}


def test_table_has_its_surface_at_its_top() -> None:
    """Size and height as told; the body stands on the floor."""
    scene = built({**DESK, "at_m": (0.3, -0.2), "yaw_deg": 90})
    surface = scene.surface("table")

    assert surface.size_m == TABLE_M
    assert surface.T_world_surface.translation_m == pytest.approx((0.3, -0.2, 0.74))
    along = surface.T_world_surface.rotate(np.array([1.0, 0.0, 0.0]))
    assert along == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert corners_of(scene.body("table"))[:, 2].min() == pytest.approx(0.0, abs=1e-6)


def test_things_stand_on_one_another() -> None:
    """A bin on a table, moved and turned with it."""
    bench = {**DESK, "name": "bench", "at_m": (1.0, 0.0), "yaw_deg": 90}
    bin_ = {
        "type": "bin", "name": "bin", "on": "bench", "at_m": (0.2, 0.1), "size_m": (0.4, 0.3, 0.2),
    }  # fmt: skip
    scene = built(bench, bin_)

    assert scene.body("bin").T_world_body.translation_m == pytest.approx((0.9, 0.2, 0.74))
    floor = scene.surface("bin")
    assert floor.walled
    assert floor.size_m[0] < 0.4
    assert floor.size_m[1] < 0.3
    assert 0.74 < floor.T_world_surface.translation_m[2] < 0.76


def test_shelf_has_a_surface_per_board() -> None:
    """Boards from below, with the free height between them."""
    shelf = {"type": "shelf", "name": "shelf", "size_m": (0.9, 0.3, 1.6), "levels": 4}
    boards = built(shelf).surfaces
    heights = [board.T_world_surface.translation_m[2] for board in boards]

    assert [board.name for board in boards] == [f"shelf/{k}" for k in range(4)]
    assert heights == sorted(heights)
    gaps = np.diff([*heights, 1.6])
    assert all(0.0 < board.clearance_m < gap for board, gap in zip(boards, gaps, strict=True))


def test_robot_stands_at_its_home_pose_with_a_body_per_link() -> None:
    """Positions of the links by trigonometry: shoulder 0.4 rad, elbow 0.9 rad, 0.3 m each."""
    scene = built(DESK, ARM)
    (arm,), base_z = scene.articulations, 0.74
    links = {b.name: b for b in scene.bodies if b.instance_id == arm.instance_id}
    instance = scene.instance(arm.instance_id)

    assert list(links) == [f"arm/{name}" for name in ("base", "upper", "hand", "left", "right")]
    assert instance.category == "robot_arm"
    assert [links[f"arm/{part}"].part_id for part in instance.parts] == [1, 2, 3, 4, 5]
    upper = (-0.45, 0.1, base_z + 0.3)
    hand = (upper[0] + 0.3 * math.sin(0.4), 0.1, upper[2] + 0.3 * math.cos(0.4))
    left = (hand[0] + 0.3 * math.sin(1.3), 0.14, hand[2] + 0.3 * math.cos(1.3))
    for name, place in (("upper", upper), ("hand", hand), ("left", left)):
        body = links[f"arm/{name}"]
        assert body.T_world_body.translation_m == pytest.approx(place, abs=2e-6)
        assert (body.motion, body.collides) == ("kinematic", False)


def test_hand_is_sent_over_the_table_only() -> None:
    """The workspace is the air over the table, as far as the arm reaches."""
    low, high = built(DESK, {**ARM, "reach_m": 0.7}).articulations[0].workspace_m

    assert (low[0], high[0]) == pytest.approx((-0.6, 0.25))
    assert (low[1], high[1]) == pytest.approx((-0.4, 0.4))
    assert 0.74 < low[2] < high[2]


@pytest.mark.parametrize("placement", ["drop", "scatter", "grid", "stack"])
@pytest.mark.parametrize("count", [1, 6, 14])
def test_objects_stand_apart_on_their_surface(placement: str, count: int) -> None:
    """Nominal objects overlap nothing, are on the table, and keep clear of the arm's base."""
    scene = built(DESK, ARM, clutter(count=count, placement=placement))
    objects = [body for body in scene.bodies if body.group == "clutter"]
    base = scene.body("arm/base")
    corners = np.concatenate([corners_of(body) for body in objects])

    assert len(objects) == count
    assert deepest_overlap_m([*objects, base]) < 1e-6
    assert (np.abs(corners[:, :2]) <= np.array(TABLE_M) / 2 + 1e-6).all()
    assert corners[:, 2].min() == pytest.approx(0.74, abs=1e-6)


def test_group_is_kept_out_of_what_stands_on_its_surface() -> None:
    """A disc around the arm's base, 10 cm wide; none for a bin on another table."""
    other = {**DESK, "name": "other", "at_m": (2.0, 0.0)}
    bin_ = {"type": "bin", "name": "bin", "on": "other", "size_m": (0.4, 0.3, 0.2)}
    # Listed before the arm: groups come last all the same.
    (group,) = built(DESK, other, clutter(count=2), ARM, bin_).groups
    ((x, y, radius_m),) = group.keep_out

    assert (x, y) == pytest.approx((-0.45, 0.1), abs=1e-6)
    assert 0.05 * math.sqrt(2.0) <= radius_m < 0.12


def test_objects_on_a_shelf_are_spread_over_its_boards() -> None:
    """Eight objects on four boards: two each, under the next board."""
    shelf = {"type": "shelf", "name": "shelf", "size_m": (0.9, 0.3, 1.6), "levels": 4}
    scene = built(shelf, clutter(on="shelf", count=8))
    boards = [s.T_world_surface.translation_m[2] for s in scene.surfaces]
    lowest = [corners_of(b)[:, 2].min() for b in scene.bodies if b.group]

    assert sorted(lowest) == pytest.approx(sorted(boards * 2), abs=1e-6)
    assert scene.groups[0].surfaces == tuple(f"shelf/{k}" for k in range(4))


def test_things_too_high_for_a_shelf_are_not_put_there_nominally() -> None:
    """Boards 17 cm apart: neither the bottle of 26 cm nor the ball of 20 cm."""
    shelf = {"type": "shelf", "name": "shelf", "size_m": (0.9, 0.3, 0.8), "levels": 4}
    scene = built(shelf, clutter(on="shelf", count=10))

    assert not {b.asset for b in scene.bodies} & {"bottle", "ball"}


@pytest.mark.parametrize("annotate", [True, False])
def test_instances_count_from_one_in_the_order_of_creation(annotate: bool) -> None:
    """Background has none, furniture no annotation; ``annotate`` goes to each object."""
    scene = built(ROOM, clutter(count=2, annotate=annotate), DESK, ARM)

    assert [(i.instance_id, i.name, i.annotated) for i in scene.instances] == [
        (1, "table", False),
        (2, "arm", True),
        (3, "clutter/0", annotate),
        (4, "clutter/1", annotate),
    ]
    assert scene.groups[0].annotated == annotate
    assert scene.body("room").instance_id == 0


def test_hollow_props_and_backdrops_are_background_and_others_are_not() -> None:
    """Cameras may be under a gantry: its bounding box must not count."""
    gantry = {"type": "prop", "name": "gantry", "asset": "gantry?size_m=1.6,1,1.8"}
    plinth = {"type": "prop", "name": "plinth", "asset": "pedestal?size_m=0.3,0.3,0.7"}
    backdrop = {"type": "backdrop", "name": "ground", "asset": "plane?size_m=6,6"}
    scene = built({**gantry, "hollow": True}, plinth, backdrop)

    numbers = [scene.body(name).instance_id for name in ("gantry", "plinth", "ground")]
    assert numbers == [0, 1, 0]
    with pytest.raises(ValidationError, match="exclude each other"):
        built({**gantry, "hollow": True, "annotate": True})


def test_focus_is_the_air_over_what_carries_objects() -> None:
    """The box over the table; the empty one next to it does not count."""
    scene = built(DESK, {**DESK, "name": "other", "at_m": (2.0, 0.0)}, clutter(count=2))

    assert scene.focus.center_m[:2] == (0.0, 0.0)
    assert scene.focus.size_m[:2] == TABLE_M
    assert 0.74 < scene.focus.center_m[2] < 1.0


def test_a_room_bounds_cameras_and_lights_with_or_without_walls() -> None:
    """A hand's breadth inside; rooms with walls keep the id of before there were others."""
    room, terrace = built(ROOM), built({**ROOM, "walls": False})

    assert room.body("room").asset == "room?door=1&size_m=5,4,2.8&window=1"
    assert terrace.body("room").asset == "room?door=1&size_m=5,4,2.8&walls=0&window=1"
    assert terrace.interior_m == room.interior_m

    low, high = built(ROOM).interior_m

    assert (-2.5 < low[0] < -2.2) and (-2.0 < low[1] < -1.7) and (0.0 < low[2] < 0.3)
    assert (2.2 < high[0] < 2.5) and (1.7 < high[1] < 2.0) and (2.5 < high[2] < 2.8)


def test_scene_without_a_lamp_gets_one_and_others_keep_theirs() -> None:
    """A template need not think of light."""
    lamp = {"type": "light", "name": "lamp", "position_m": (0, 0, 2), "intensity_cd": 500}

    assert len(built(DESK).lights) == 1
    assert [light.intensity_cd for light in built(DESK, lamp).lights] == [500.0]


def test_a_ceiling_panel_is_a_light_and_its_housing() -> None:
    """4000 lm of 0.6 m x 1.2 m are 4000 / pi cd; the housing is background right above it."""
    panel = {
        "type": "light", "name": "panel", "kind": "rectangle", "position_m": (0, 0, 2.6),
        "size_m": (1.2, 0.6), "luminous_flux_lm": 4000,
    }  # fmt: skip
    scene = built(DESK, panel)

    (light,) = scene.lights
    assert light.intensity_cd == pytest.approx(4000.0 / math.pi, abs=1e-4)
    assert (light.size_m, light.direction, light.body) == ((1.2, 0.6), (0.0, 0.0, -1.0), "panel")
    body = scene.body("panel")
    assert body.T_world_body.translation_m == pytest.approx((0.0, 0.0, 2.601))
    assert body.instance_id == 0


@pytest.mark.parametrize("kind", ["rectangle", "disk"])
def test_a_panel_need_not_be_seen(kind: str) -> None:
    """Without a housing there is but the light; its direction is made a unit vector."""
    lamp = {
        "type": "light", "name": "soft", "kind": kind, "direction": (0, 3, -4), "visible": False,
    }  # fmt: skip
    scene = built(DESK, lamp)

    assert [body.name for body in scene.bodies] == [body.name for body in built(DESK).bodies]
    assert (scene.lights[0].direction, scene.lights[0].body) == ((0.0, 0.6, -0.8), "")


@pytest.mark.parametrize(("given", "said"), [
    ({"intensity_cd": -1}, "greater than or equal to 0"),
    ({"intensity_cd": float("nan")}, "finite"),
    ({"luminous_flux_lm": float("inf")}, "finite"),
    ({"luminous_flux_lm": 100, "intensity_cd": 5}, "exclude each other"),
    ({"kind": "rectangle", "size_m": (0.0, 1.0)}, "size_m must be above 0"),
    ({"kind": "disk", "radius_m": 0}, "radius_m of a disk"),
    ({"kind": "spot", "direction": (0, 0, 0)}, "direction must not be 0"),
])  # fmt: skip
def test_an_impossible_lamp_is_refused_when_it_is_read(given: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        built(DESK, {"type": "light", "name": "lamp", **given})


@pytest.mark.parametrize(("chosen", "assets"), [
    ({"tags": ["household", "toy"]}, {"ball"}),
    ({"any_of": ["part", "toy"]}, {"ball", "bolt", "nut"}),
    ({"ids": ["can"]}, {"can?seed=0", "can?seed=1"}),
    ({"ids": ["can?seed=1", "odd"]}, {"can?seed=1", "odd"}),
    ({"tags": ["household"], "exclude": ["can", "toy"]}, {"bottle", "brick"}),
])  # fmt: skip
def test_assets_are_chosen_by_tags_and_ids(chosen: dict[str, Any], assets: set[str]) -> None:
    """All tags, any tag, a family, single assets; less the excluded ones."""
    assert set(built(DESK, clutter(assets=chosen, count=0)).groups[0].assets) == assets


@pytest.mark.parametrize(("line", "message"), [
    (clutter(on="tabel"), r"elements\.clutter\.on: .*'tabel'.*did you mean 'table'"),
    ({**ARM, "on": "tabel"}, r"elements\.arm\.on: .*'tabel'.*did you mean 'table'"),
    (clutter(count=400), r"elements\.clutter\.count: 400 objects do not fit .*'table'"),
    (clutter(count=60, placement="scatter"), r"elements\.clutter\.count: 60 objects do not"),
    (clutter(assets={"tags": ["part", "toy"]}), r"elements\.clutter\.assets: no asset matches"),
    (clutter(assets={"tags": ["no_such_tag"]}), r"elements\.clutter\.assets\.tags: no object has"),
    ({**DESK, "height_m": 0.5}, r"elements\.table: two elements have this name"),
])  # fmt: skip
def test_impossible_relations_are_told_with_their_place(line: dict[str, Any], message: str) -> None:
    """One message naming the element, the fact and the nearest name."""
    with pytest.raises(ConfigError, match=message):
        built(DESK, line)


@pytest.mark.parametrize(("desk", "line", "error", "message"), [
    (TINY, clutter(assets={"ids": ["ball"]}), ConfigError, "every asset is larger than surface"),
    (DESK, clutter(assets={"ids": ["botle"]}), AssetError, "did you mean 'bottle'"),
    (DESK, {**ARM, "asset": "bottle"}, AssetError, "is no robot"),
])  # fmt: skip
def test_what_has_no_room_or_no_name_is_told(
    desk: Any, line: Any, error: Any, message: str
) -> None:
    """A table of 19 cm under larger objects; the library gives the nearest names."""
    with pytest.raises(error, match=message):
        built(desk, line)


@pytest.mark.parametrize("line", [
    {**DESK, "hight_m": 0.7}, {**DESK, "name": "1st"}, {**DESK, "name": "a/b"},
    {**DESK, "style": "glass"}, {"type": "shelf", "name": "s", "levels": 0}, clutter(count=-1),
    clutter(placement="throw"), {"type": "objects", "name": "o", "on": "table", "assets": {}},
])  # fmt: skip
def test_elements_are_strict(line: dict[str, Any]) -> None:
    """Unknown fields, names that would clash with paths, numbers out of range."""
    with pytest.raises(ValidationError):
        element(**line)
