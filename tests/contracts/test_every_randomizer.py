"""Contract of every randomizer in the table, built-in or third-party."""

import json
import math
import pickle
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from pydantic import ValidationError

from gen_data.assets.library import open_library
from gen_data.core import asset_types, interfaces, intrinsics, members, plates, serialization
from gen_data.core.scene import (
    Body,
    Camera,
    Instance,
    Lane,
    Lidar,
    ObjectGroup,
    Rig,
    Scene,
    Weather,
)
from gen_data.core.se3 import SE3, look_at
from gen_data.randomizers import TABLE
from gen_data.scene_templates import builder, road, robot, room, room_layout, surface
from gen_data.scene_templates.carrier import Carrier
from gen_data.scene_templates.objects import AssetChoice, Objects
from tests.randomizers.doubles import FakeAssets, rng_of
from tests.tiers import cases

GIVEN: dict[str, dict[str, Any]] = {
    "arm_task": {"group": "objects", "task": "stack"}, "ceiling_lights": {"visible": True},
    "beside_vehicles": {"group": "people", "vehicles": ["lane_objects"], "count": 8},
    "companions": {"group": "lane_objects", "size": 4, "gap_m": {"uniform": [3, 5]}},
    "distractors": {"count": {"uniform_integer": [1, 4]}}, "colors": {"probability": True},
    "drone_flight": {"from_end_m": 10}, "hand_held": {"group": "hands", "objects": "objects"},
    "materials": {"probability": True},
    "reaching_hand": {"group": "objects", "things": "objects", "probability": True},
    "street_lights": {"when": "always"}, "textures": {"textures": ["wood"], "probability": True},
}  # fmt: skip
"""Fields that a randomizer requires, or that ensure that it changes the scene."""

PHYSICS_BOUND = (
    "arm_configuration", "arm_motion", "arm_task", "beside_vehicles", "companions", "distractors",
    "door_paths", "ego_on_lane", "furnish", "hand_held", "lane_objects", "objects",
    "physics_properties", "plate", "reaching_hand", "traffic_flow",
)  # fmt: skip
"""Randomizers that must run before physics."""


IN_ROOMS = (
    "ceiling_camera", "furnish", "object_states", "room_camera", "room_lighting", "room_path",
)  # fmt: skip
"""Randomizers of furnished rooms, whose assets and rules are the real ones."""


@cache
def furnished_room() -> Scene:
    library = open_library(())
    elements = (room_layout.RoomLayout(name="room", kind="office"), Carrier(name="carrier"))
    scene = builder.build_scene("test", elements, library)
    lens = intrinsics.Intrinsics.from_hfov(64, 48, 1.0)
    cameras = tuple(Camera(name, SE3((0.0, 0.0, 1.5)), lens) for name in ("left", "right"))
    return made("furnish")(replace(scene, cameras=cameras), library, rng_of("room"))


@cache
def houses_and_garden() -> Scene:
    """Six houses whose doors look at a garden, and a group of paths."""
    library = open_library(())
    house = "building/villa?seed=0"
    lane = Lane("garden", "garden", ((-30.0, 3.0, 0.0), (180.0, 3.0, 0.0)), 6.0, road="main")
    houses = ObjectGroup("buildings", (), (house,), 0, "along", lanes=("frontage",))
    kinds = tuple(f"garden_path?length_m=4&seed={k}" for k in range(8))
    paths = ObjectGroup("door_paths", (), kinds, 0, "along")
    lens = intrinsics.Intrinsics.from_hfov(64, 48, 1.0)
    cameras = tuple(Camera(name, SE3((0.0, 0.0, 1.5)), lens) for name in ("left", "right"))
    scene = Scene("test", groups=(houses, paths), lanes=(lane,), cameras=cameras)
    y = -library.bounds_m(house)[1][0]
    places = (SE3.about_z(0.5 * math.pi, (30.0 * k, y, 0.0)) for k in range(6))
    return members.add_members(
        scene, houses, [members.Member(house, place) for place in places], library
    )


@cache
def table_with_hands() -> Scene:
    """A table, a group of hands and one of fruit, and two cameras."""
    elements = (
        room.Room(name="room"), surface.SurfaceElement(name="table"),
        Objects(name="hands", on="table", count=0, assets=AssetChoice(tags=("body_part",))),
        Objects(name="objects", on="table", count=0, assets=AssetChoice(ids=("apple", "carton"))),
    )  # fmt: skip
    lens = intrinsics.Intrinsics.from_hfov(64, 48, 1.0)
    cameras = tuple(Camera(name, SE3((0.0, 0.0, 1.5)), lens) for name in ("left", "right"))
    return replace(builder.build_scene("test", elements, open_library(())), cameras=cameras)


@cache
def straight_road() -> Scene:
    bench = Body("bench", "bench?seed=0", SE3((20.0, 6.0, 0.0)), instance_id=1)
    lens = intrinsics.Intrinsics.from_hfov(64, 48, 1.0)
    cameras = tuple(Camera(name, SE3((0.0, 0.0, 1.5)), lens) for name in ("left", "right"))
    scene = builder.build_scene("test", (road.Road(name="main"),), open_library(()))
    return replace(
        scene,
        bodies=(*scene.bodies, bench),
        instances=(Instance(1, "bench", "bench", 0, bench.asset),),
        cameras=cameras,
    )


def world_of(kind: str) -> tuple[Scene, interfaces.AssetIndex]:
    """A scene that a randomizer can change, and its assets."""
    if kind == "door_paths":
        return houses_and_garden(), open_library(())
    if kind in IN_ROOMS:
        return furnished_room(), open_library(())
    if kind == "hand_held":
        return table_with_hands(), open_library(())
    if kind == "relief":
        return straight_road(), open_library(())
    return nominal_scene(), FakeAssets()


def nominal_scene() -> Scene:
    """A room with a table, an arm, objects, lamps, cars, one of them the ego, and two cameras.

    Outside, people walk in rain, and a drone hovers.
    """
    household, shapes = AssetChoice(tags=("household",)), AssetChoice(tags=("random_shape",))
    elements = (
        room.Room(name="room"), surface.SurfaceElement(name="table"),
        robot.Robot(name="arm", asset="two_link", on="table", at_m=(-0.45, 0.0)),
        Objects(name="objects", on="table", count=4, assets=household),
        Objects(name="distractors", on="table", count=1, assets=shapes, annotate=False),
    )  # fmt: skip
    lens = intrinsics.Intrinsics.from_hfov(64, 48, 1.0)
    cameras = tuple(
        Camera(name, look_at((1.0, 0.0, 1.5), (0.0, 0.0, 0.8)), lens) for name in ("left", "right")
    )
    lanes = (Lane("lane", "driving", ((-40.0, 5.0, 0.0), (40.0, 5.0, 0.0)), 3.5, road="street"),)
    group = ObjectGroup("lane_objects", (), ("wagon",), 1, "along", lanes=("driving",))
    wagon = Body(
        "lane_objects/0", "wagon", SE3((0.0, 5.0, 0.75)), instance_id=99, group="lane_objects"
    )
    labelled = Instance(99, "lane_objects/0", "car", 0, "wagon")
    ego = Body("ego", "wagon", SE3((-20.0, 5.0, 0.75)), instance_id=98)
    carrier = Instance(98, "ego", "ego", 0, "wagon", annotated=False)
    scene = builder.build_scene("test", elements, FakeAssets())
    lamp = Body("street_lamp", "street_lamp", SE3((1.0, 1.0, 0.0)))
    signal = Body("signal", "signal", SE3((3.0, 3.0, 0.0)))
    plate = Body("plate", "plane", materials=(asset_types.Material(role=plates.CATCHER),))
    drone = Body("drone", "plane", SE3((0.0, 0.0, 50.1)))
    gimbal = Body("drone_gimbal", "plane", SE3((0.0, 0.0, 50.0)))
    flying = (Rig("drone", "drone"), Rig("drone_gimbal", "drone_gimbal"))
    walkers = [_walker(k) for k in range(12)]
    persons = [Instance(w.instance_id, w.name, "person", 0, w.asset) for w in walkers]
    crowd = ObjectGroup("people", (), ("walker?seed=0",), 12, "along", lanes=("sidewalk",))
    return replace(
        scene,
        bodies=(*scene.bodies, lamp, signal, plate, wagon, ego, drone, gimbal, *walkers),
        instances=(*scene.instances, labelled, carrier, *persons),
        rigs=(*scene.rigs, Rig("ego", "ego"), Rig("car", "lane_objects/0"), *flying),
        cameras=cameras,
        lidars=(Lidar("roof", "", SE3((0.0, 0.0, 1.9)), rig="car"),),
        lanes=lanes,
        groups=(*scene.groups, group, crowd),
        weather=Weather(rain_mm_h=5.0),
    )


def _walker(k: int) -> Body:
    at = SE3((float(k), -20.0, 0.0))
    return Body(f"people/{k}", f"walker?seed={k}", at, instance_id=100 + k, group="people")


def made(kind: str) -> Any:
    plain = {"type": kind, "name": kind, **GIVEN.get(kind, {})}
    return TABLE.load(kind).model_validate_json(json.dumps(plain))


def drawn(kind: str, stream: str = "stream", scene_index: int = 0) -> Scene:
    return made(kind)(*world_of(kind), rng_of(stream, scene_index))


SLOW = {"ceiling_camera", "furnish", "hand_held", "object_states", "room_camera", "room_lighting"}
each = pytest.mark.parametrize("kind", cases(TABLE, set(TABLE) - SLOW))


@each
def test_scene_that_is_handed_in_stays_as_it_is(kind: str) -> None:
    scene, assets = world_of(kind)
    before = serialization.canonical_json(scene)

    made(kind)(scene, assets, rng_of())

    assert serialization.canonical_json(scene) == before


@each
def test_same_stream_draws_the_same_scene_in_any_process(kind: str) -> None:
    """Equal draws from a second call and from a copy in another process."""
    by_copy = pickle.loads(pickle.dumps(made(kind)))(*world_of(kind), rng_of("stream"))

    assert drawn(kind) == drawn(kind) == by_copy


@each
def test_other_streams_draw_other_scenes(kind: str) -> None:
    """Five streams give five different scenes, none of them the nominal one."""
    scenes = [world_of(kind)[0], *(drawn(kind, f"stream {k}") for k in range(5))]

    assert len({serialization.canonical_json(scene) for scene in scenes}) == 6


@each
def test_scene_holds_plain_values_only(kind: str) -> None:
    """The scene has no numpy scalars: it reads back from JSON as the same scene."""
    scene = drawn(kind)
    assert_plain(serialization.to_plain(scene))
    assert serialization.from_plain(Scene, json.loads(serialization.canonical_json(scene))) == scene


@each
def test_names_and_ids_stay_in_order(kind: str) -> None:
    """Body names and instance ids are unique, every body's instance exists, cameras remain."""
    for scene_index in range(5):
        scene = drawn(kind, scene_index=scene_index)
        names = [body.name for body in scene.bodies]
        ids = [instance.instance_id for instance in scene.instances]

        assert len(set(names)) == len(names)
        assert len(set(ids)) == len(ids)
        assert min(ids) == 1
        assert {body.instance_id for body in scene.bodies} <= {0, *ids}
        assert [camera.name for camera in scene.cameras] == ["left", "right"]
        arms = [] if kind in (*IN_ROOMS, "door_paths", "hand_held", "relief") else ["arm"]
        assert [arm.name for arm in scene.articulations] == arms


@pytest.mark.parametrize("kind", PHYSICS_BOUND)
def test_what_physics_has_to_see_is_drawn_per_scene_only(kind: str) -> None:
    """``stage: view`` would come after physics, and is refused."""
    assert made(kind).stage == interfaces.Stage.BUILD
    plain = {"type": kind, "name": kind, "stage": "view", **GIVEN.get(kind, {})}
    with pytest.raises(ValidationError, match="stage"):
        TABLE.load(kind).model_validate_json(json.dumps(plain))


@pytest.mark.parametrize("kind", [kind for kind in TABLE if kind not in PHYSICS_BOUND])
def test_looks_can_be_drawn_per_scene_or_per_view(kind: str) -> None:
    for word, stage in (("scene", interfaces.Stage.BUILD), ("view", interfaces.Stage.VIEW)):
        plain = {"type": kind, "name": kind, "stage": word, **GIVEN.get(kind, {})}
        assert TABLE.load(kind).model_validate_json(json.dumps(plain)).stage == stage


def assert_plain(value: Any) -> None:
    """Exactly JSON's own types, all the way down."""
    if isinstance(value, dict):
        for item in value.values():
            assert_plain(item)
    elif isinstance(value, list):
        for item in value:
            assert_plain(item)
    else:
        assert type(value) in (float, int, str, bool, type(None)), repr(value)
