"""Light, states, cameras and walks in furnished rooms."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from gen_data.annotations.bev_map import BevMap
from gen_data.assets.library import open_library
from gen_data.config import distributions as dist
from gen_data.core import intrinsics, sample, se3
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Camera, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.streams import Streams
from gen_data.randomizers.ceiling_camera import CeilingCamera
from gen_data.randomizers.furnish import Furnish
from gen_data.randomizers.object_states import ObjectStates
from gen_data.randomizers.room_camera import RoomCamera
from gen_data.randomizers.room_lighting import RoomLighting
from gen_data.randomizers.room_path import RoomPath
from gen_data.scene_templates import builder, carrier, room_layout
from tests.rooms.test_layouts import distance_m, heights_m, library

ON, OFF = dist.Constant(True), dist.Constant(False)


@cache
def flat(seed: int = 1, kind: str = "apartment") -> Scene:
    """A furnished apartment, or room, with a camera and a carrier."""
    elements = (room_layout.RoomLayout(name="room", kind=kind), carrier.Carrier(name="carrier"))
    camera = Camera("color", se3.SE3((0.0, 0.0, 1.5)), intrinsics.Intrinsics.from_hfov(64, 48, 1.2))
    scene = replace(builder.build_scene("test", elements, library()), cameras=(camera,))
    for attempt in range(4):
        try:
            return Furnish(name="f")(scene, library(), Streams(5, seed, attempt=attempt).rng("f"))
        except LayoutRejected:
            continue
    raise AssertionError("no apartment in four attempts")


def states(scene: Scene, **fields: dist.Numeric[bool]) -> Scene:
    return ObjectStates(name="s", **fields)(scene, library(), Streams(5, 1).rng("s"))


@pytest.mark.slow
def test_closed_parts_are_where_their_pieces_are_and_say_so() -> None:
    """With no opening, parts stay as they were, and every label is 0."""
    closed = states(flat(), is_open=OFF)
    parts = [b for b in closed.bodies if b.part_id == 2]
    attributes = [dict(closed.instance(b.instance_id).attributes) for b in parts]

    assert len(parts) >= 8
    assert parts == [b for b in flat().bodies if b.part_id == 2]
    assert {a["open"] for a in attributes} == {"0"}


@pytest.mark.slow
def test_the_joint_of_a_label_is_the_turn_of_the_part() -> None:
    """The angle between a door's leaf and its frame, from their poses."""
    opened = states(flat(), is_open=ON)
    angles = {}
    for body in opened.bodies:
        piece, _, part = body.name.rpartition("/")
        if part in ("leaf", "door"):
            turn = opened.body(piece).T_world_body.inverse() @ body.T_world_body
            stated = float(dict(opened.instance(body.instance_id).attributes)["joint"])
            angles[stated] = 2.0 * math.acos(min(1.0, abs(turn.quaternion_wxyz[0])))

    assert max(angles) > 0.2
    assert list(angles) == pytest.approx(list(angles.values()), abs=2e-3)


@pytest.mark.slow
def test_screens_that_are_on_shine_and_say_so() -> None:
    """Every screen is lit with is_on, none without."""
    for is_on, word in ((ON, "on"), (OFF, "off")):
        scene = states(flat(kind="office"), is_on=is_on)
        screens = [
            b
            for b in scene.bodies
            if any(m.role == "screen" for m in b.materials or library().materials(b.asset))
        ]

        assert screens
        for body in screens:
            lit = any(sum(m.emission_cd_m2) > 0 for m in body.materials)
            assert lit == (word == "on")
            assert dict(scene.instance(body.instance_id).attributes)["state"] == word


@pytest.mark.slow
def test_every_lit_lamp_has_a_light_near_it_and_no_other_has() -> None:
    """Labels, emission and lights agree, by day."""
    seen = set()
    for stream in range(5):
        light = RoomLighting(name="l", night=OFF, is_on=dist.Probability(0.5))
        scene = light(flat(), library(), Streams(5, stream).rng("l"))
        spheres = [np.array(one.position_m) for one in scene.lights if one.kind == "sphere"]
        for lamp in (i for i in scene.instances if i.category == "lamp"):
            (body,) = (b for b in scene.bodies if b.instance_id == lamp.instance_id)
            (at_m,) = (k.position_m for k in library().keypoints(body.asset) if k.name == "lamp")
            here = body.T_world_body.apply(np.array([at_m]))[0, :2]
            near = [p for p in spheres if np.linalg.norm(p[:2] - here) < 1e-3]
            state = dict(lamp.attributes)["state"]
            seen.add(state)

            assert bool(near) == (state == "on")
            assert any(sum(m.emission_cd_m2) > 0 for m in body.materials) == (state == "on")
    assert seen == {"on", "off"}


@pytest.mark.slow
def test_at_night_a_lamp_is_on_and_no_light_comes_through_windows() -> None:
    """Neither sun nor panels, and the view is nearly black."""
    scene = RoomLighting(name="l", night=ON, is_on=OFF)(flat(), library(), Streams(5, 2).rng("l"))

    assert {light.kind for light in scene.lights} == {"sphere"}
    assert max(scene.body("room/outside").materials[0].emission_cd_m2) < 1.0


@pytest.mark.slow
def test_the_sun_shines_into_a_window() -> None:
    """It travels inwards through one of them: against its outward normal."""
    fields = {"night": OFF, "sun": ON}
    scene = RoomLighting(name="l", **fields)(flat(), library(), Streams(5, 3).rng("l"))
    (sun,) = (light for light in scene.lights if light.kind == "sun")
    inward = [
        b.T_world_body.rotate(np.array((1.0, 0.0, 0.0)))
        for b in scene.bodies
        if "/window_" in b.name
    ]

    assert sun.direction[2] < -0.5
    assert max(float(np.dot(n, sun.direction)) for n in inward) > 0.25


@pytest.mark.slow
def test_cameras_stand_on_free_floor_at_the_drawn_height() -> None:
    """Nothing is nearer than the clearance, by OpenCV's distance to outlines."""
    camera = RoomCamera(name="c", height_m=dist.Constant(1.4))
    for view in range(10):
        scene = camera(flat(), library(), Streams(5, 1, view=view).rng("c"))
        x, y, z = scene.camera("color").T_world_camera.translation_m
        near = [
            b.name
            for b in scene.bodies
            if b.group == "room"
            and heights_m(b)[0] - 0.2 < z < heights_m(b)[1] + 0.2
            and distance_m(b, x, y) < 0.2
        ]

        assert z == pytest.approx(1.4)
        assert not near


def walk(number: int = 4, **fields: object) -> Scene:
    return RoomPath(name="p", **fields)(flat(), library(), Streams(5, number).rng("p"))


@pytest.mark.slow
def test_a_walk_has_its_speed_and_touches_nothing() -> None:
    """Every 0.1 s, by OpenCV's distance to outlines; shortened by corners only."""
    scene = walk(speed_m_s=dist.Constant(0.8), radius_m=0.2, duration_s=6.0)
    places = [
        scene_at(scene, 0.1 * k).body("carrier").T_world_body.translation_m[:2] for k in range(61)
    ]
    steps = [math.dist(a, b) for a, b in pairwise(places)]
    low = [
        b
        for b in scene.bodies
        if b.group == "room" and heights_m(b)[0] < 2.0 and heights_m(b)[1] > 0.03
    ]

    assert np.median(steps) == pytest.approx(0.08, rel=0.03)
    assert max(steps) <= 0.0805
    assert min(distance_m(b, *place) for b in low for place in places) > 0.1


@pytest.mark.slow
def test_a_walk_looks_where_it_goes() -> None:
    """Its X axis is within 60 degrees of its velocity, nearly always: at turns it looks around."""
    scenes = [walk(number, speed_m_s=dist.Constant(0.6), duration_s=6.0) for number in range(6)]
    ahead = []
    for scene, k in product(scenes, range(1, 59, 3)):
        moved = scene_at(scene, 0.1 * k)
        pose, later = (
            s.body("carrier").T_world_body for s in (moved, scene_at(scene, 0.1 * k + 0.05))
        )
        velocity = np.array(later.translation_m) - np.array(pose.translation_m)
        ahead.append(
            float(np.dot(pose.rotate(np.array((1.0, 0.0, 0.0))), velocity))
            / np.linalg.norm(velocity)
        )

    assert np.mean(np.array(ahead) > 0.5) > 0.9


@pytest.mark.slow
def test_a_walk_without_carrier_is_refused() -> None:
    """The text names the field and the element."""
    with pytest.raises(ConfigError, match=r"randomizers.p.carrier: .*'hand' of type carrier"):
        walk(carrier="hand")


@pytest.mark.slow
def test_a_carrier_too_wide_for_a_room_is_rejected_with_a_remedy() -> None:
    """One metre of radius, in a bathroom."""
    walks = RoomPath(name="p", radius_m=1.0)
    with pytest.raises(LayoutRejected) as caught:
        walks(flat(kind="bathroom"), library(), Streams(5, 4).rng("p"))

    assert "radius_m" in caught.value.rejection.remedy


@pytest.mark.slow
def test_the_map_of_a_room_agrees_with_outlines() -> None:
    """Occupied cells are in a box of a standing piece; free ones at most in its empty corners."""
    scene = states(flat(), is_open=OFF)
    truth = sample.EgoTruth(rig="carrier", T_world_ego=se3.SE3((0.0, 0.0, 0.0)))
    made = (
        BevMap(px_m=0.05, reach_m=6.0).annotate_frame({"": scene}, open_library(()), truth).birdseye
    )
    assert made is not None
    free, occupied = made.layers["free_space"], made.layers["occupied"]
    n = len(free)
    standing = [
        b
        for b in scene.bodies
        if b.group == "room" and heights_m(b)[0] < 1.9 and heights_m(b)[1] > 0.03
    ]

    assert not (free & occupied).any()
    assert free.sum() * 0.05**2 == pytest.approx(
        _area_m2(scene) - occupied.sum() * 0.05**2, rel=0.05
    )
    for row, column in np.argwhere(free)[::97]:
        x, y = (0.5 * n - row - 0.5) * 0.05, (0.5 * n - column - 0.5) * 0.05
        assert all(distance_m(b, x, y) > -0.3 for b in standing)
    for row, column in np.argwhere(occupied)[::97]:
        x, y = (0.5 * n - row - 0.5) * 0.05, (0.5 * n - column - 0.5) * 0.05
        fitted = [b for b in scene.bodies if b.name.endswith("/leaf") or "/blind_" in b.name]
        assert min(distance_m(b, x, y) for b in (*standing, *fitted)) < 0.05


def _area_m2(scene: Scene) -> float:
    area = 0.0
    for body in scene.bodies:
        if body.name.endswith("/floor") or body.asset.startswith("door_frame"):
            (x0, y0, _), (x1, y1, _) = library().bounds_m(body.asset)
            area += (x1 - x0) * (y1 - y0)
    return area


@pytest.mark.slow
def test_ceiling_cameras_are_below_the_ceiling_of_a_room_and_look_down() -> None:
    """Within their distances and tilt, by every draw; the room is around and below them."""
    scene = flat()
    ceilings = [b for b in scene.bodies if b.name.endswith("/ceiling")]
    for stream in range(12):
        moved = CeilingCamera(name="c")(scene, library(), Streams(5, stream).rng("c"))
        pose = moved.camera("color").T_world_camera
        eye_m, forward = np.array(pose.translation_m), pose.rotation()[:, 2]
        inside = []
        for body in ceilings:
            low, high = (
                body.T_world_body.apply(np.array(c)) for c in library().bounds_m(body.asset)
            )
            inside.append(bool(((eye_m > low)[:2] & (eye_m < high)[:2]).all()))
            below_m = body.T_world_body.translation_m[2] - eye_m[2]
            assert 0.06 - 1e-6 <= below_m <= 0.14 + 1e-6
        assert sum(inside) == 1
        assert math.degrees(math.acos(-forward[2])) <= 4.0 + 1e-3
