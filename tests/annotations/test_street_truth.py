"""Truth about streets: motion, borders of lanes, free space, maps from above."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.annotations.annotate import Thresholds, annotate_ego, annotate_reading
from gen_data.annotations.bev_map import BevMap, level_pose
from gen_data.annotations.boxes3d import Boxes3d
from gen_data.annotations.free_space import FreeSpace
from gen_data.annotations.lanes import Lanes, is_seen
from gen_data.annotations.motion import Motion
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import Trajectory
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth
from gen_data.core.scene import Body, Camera, Instance, Lidar, Rig, Scene
from gen_data.core.scene_time import RIG_AXES, add_twists, place_sensors, scene_at
from gen_data.core.se3 import SE3, Array
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.crosswalk import Crosswalk
from gen_data.scene_templates.road import Road
from tests.libraries import library

LENS = Intrinsics.from_hfov(320, 200, math.radians(80.0))
EYE_M = 1.6
CAR = "car?seed=0"


def street(yaw_rad: float = 0.0) -> Scene:
    """A flat street along X with two lanes of 4 m, a crosswalk, a car, and an ego on the right.

    The car's middle is 20 m ahead of the ego; the camera looks ahead from 1.6 m above it.
    """
    elements = (
        Road(name="main", at_m=(-50.0, 0.0), length_m=100.0, lane_width_m=4.0, crown=0.0),
        Crosswalk(name="zebra", road="main", station_m=60.0, width_m=4.0),
    )
    scene = build_scene("street", elements, library())
    low, high = library().bounds_m(CAR)
    middle = 0.5 * (low[0] + high[0])
    pose = SE3((20.0 - middle, -2.0, -low[2]))
    car = Instance(1, "car/0", "car", 1, CAR, T_world_instance=pose, box_min_m=low, box_max_m=high)
    ego = Body("ego", CAR, SE3.about_z(yaw_rad, (0.0, -2.0, 0.0)), collides=False)
    camera = Camera("front", SE3(), LENS, None, "ego", SE3((0.0, 0.0, EYE_M)) @ RIG_AXES.inverse())
    return place_sensors(
        replace(
            scene,
            bodies=(*scene.bodies, Body("car/0", CAR, pose, instance_id=1), ego),
            instances=(car,),
            rigs=(Rig("ego", "ego"),),
            cameras=(camera,),
            lidars=(Lidar("roof", "", SE3((0.0, 0.0, 2.0)), rig="ego"),),
        )
    )


def pixel_rays() -> Array:
    """Directions in the world of the level camera's pixels, one metre along its axis [h, w, 3]."""
    u = (np.arange(320) + 0.5 - LENS.cx_px) / LENS.fx_px
    v = (np.arange(200) + 0.5 - LENS.cy_px) / LENS.fy_px
    right, down = np.meshgrid(u, v)
    return np.stack([np.ones_like(right), -right, -down], axis=-1)


def seen(scene: Scene) -> SensorReading:
    """The ground and the car's box as the camera sees them, without a renderer."""
    rays = pixel_rays()
    eye = np.array([0.0, -2.0, EYE_M])
    with np.errstate(divide="ignore"):
        depth = np.where(rays[..., 2] < 0.0, -EYE_M / rays[..., 2], np.inf)
        box = scene.instances[0]
        low = np.array(box.box_min_m) + box.T_world_instance.translation_m - eye
        high = np.array(box.box_max_m) + box.T_world_instance.translation_m - eye
        slabs = np.sort(np.stack([low / rays, high / rays]), axis=0)
    enter, leave = slabs[0].max(axis=-1), slabs[1].min(axis=-1)
    hit = (enter < leave) & (enter > 0) & (enter < depth)
    depth = np.where(hit, enter, depth)
    channels = {
        Channel.INSTANCE: hit.astype(np.uint16),
        Channel.Z_DEPTH: depth.astype(np.float32),
        Channel.RANGE: (depth * np.linalg.norm(rays, axis=-1)).astype(np.float32),
    }
    return SensorReading("front", scene.cameras[0], channels)


def annotated(annotator: FreeSpace | Lanes, scene: Scene) -> ImageTruth:
    """Labels of the image of a scene."""
    return annotator.annotate_image(scene, library(), seen(scene), ImageTruth(scene.cameras[0], ()))


def test_borders_are_where_the_ground_is_seen_under_them() -> None:
    """Image points, put back on the ground, lie 4 m, 0 m or -4 m from the street's middle."""
    truth = annotated(Lanes(far_m=60.0), street())
    assert truth.borders is not None
    sides = {("edge", -4.0), ("road", 0.0), ("edge", 4.0)}
    assert len(truth.borders) == 3
    for border in truth.borders:
        points = np.array(border.points_px)
        depth = EYE_M / ((points[:, 1] - LENS.cy_px) / LENS.fy_px)
        y = -2.0 - (points[:, 0] - LENS.cx_px) / LENS.fx_px * depth
        near = depth < 15.0
        assert near.sum() >= 5
        assert (border.kind, round(float(y[near].mean()), 1)) in sides
        np.testing.assert_allclose(y[near], np.round(y[near].mean()), atol=0.03)
        assert depth.max() < 60.0
        assert ((points >= 0.0) & (points < [320, 200])).all()


def test_points_behind_a_car_are_listed_and_hidden() -> None:
    """The car ahead hides the area behind its box, and nothing before it or at its sides."""
    scene = street()
    reading, truth = seen(scene), annotated(Lanes(step_px=1.0), scene)
    assert truth.borders is not None
    hidden = 0
    for border in truth.borders:
        for (u, v), visible in zip(border.points_px, border.visible, strict=True):
            covered = bool(reading.channels[Channel.INSTANCE][int(v), int(u)])
            depth = EYE_M / ((v - LENS.cy_px) / LENS.fy_px)
            # The part of the car just above the ground hides nothing.
            assert visible is not covered or (visible and 16.0 < depth < 21.0)
            hidden += not visible
    assert hidden > 5


def test_ground_far_down_a_steep_street_is_visible_and_a_wall_before_it_hides_it() -> None:
    """A plane that falls by 12 % from 1.6 m below the camera; rows of pixels show it 8 m apart.

    A wall of 1 m across it, 40 m ahead, hides the ground behind it.
    """
    lens = Intrinsics.from_hfov(160, 96, hfov_rad=1.2)
    camera = Camera("eye", RIG_AXES.inverse(), lens)
    rays = lens.pixel_rays()
    ground_m = 1.6 / np.maximum(rays[..., 1] - 0.12 * rays[..., 2], 1e-9)
    wall_m = 40.0 / rays[..., 2]
    below_top = rays[..., 1] * wall_m > 1.6 + 0.12 * 40.0 - 1.0
    ahead_m = np.arange(8.0, 100.0, 0.5)
    p_camera = np.stack([0.1 * ahead_m, 1.6 + 0.12 * ahead_m, ahead_m], axis=1)
    uv = lens.project(p_camera)

    def seen_in(range_m: Array) -> Array:
        reading = SensorReading("eye", camera, {Channel.RANGE: range_m.astype(np.float32)})
        return is_seen(reading, p_camera, uv)

    assert seen_in(np.where(ground_m < 1e6, ground_m, np.inf)).all()
    walled = seen_in(np.where(below_top, np.minimum(ground_m, wall_m), ground_m))
    assert walled[ahead_m < 39.0].all()
    # At 75 m, the ground is half a pixel below the top of the wall.
    assert not walled[(ahead_m > 44.0) & (ahead_m < 75.0)].any()


def test_free_space_is_the_carriageway_that_nothing_stands_on() -> None:
    """Pixels whose rays meet the ground between y = -4 and 4 before anything else."""
    scene = street()
    reading, truth = seen(scene), annotated(FreeSpace(far_m=30.0), scene)
    assert truth.free_space is not None
    found = np.zeros((200, 320), bool)
    mask = truth.free_space
    rows, columns = mask.pixels.shape
    found[mask.y_px : mask.y_px + rows, mask.x_px : mask.x_px + columns] = mask.pixels
    points = pixel_rays() * reading.channels[Channel.Z_DEPTH][..., None]
    ground = reading.channels[Channel.INSTANCE] == 0
    ground &= np.isfinite(points[..., 0])
    near = np.hypot(points[..., 0], points[..., 1]) < 30.0
    across = np.abs(points[..., 1] - 2.0)
    surely = ground & near & (across < 3.85)
    never = ~ground | ~near | (across > 4.15)

    assert surely.sum() > 5000
    assert found[surely].all()
    assert not found[never].any()


def test_nothing_is_free_where_there_is_no_street() -> None:
    """An empty mask, not None: it was looked for."""
    scene = replace(street(), bodies=(street().body("ego"),))
    truth = annotated(FreeSpace(), scene)

    assert truth.free_space is not None
    assert truth.free_space.pixels.size == 0


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 200.0])
def test_the_map_shows_what_lies_around_the_ego(yaw_deg: float) -> None:
    """Every pixel's centre, taken back to the world, against the street's own numbers."""
    scene = street(math.radians(yaw_deg))
    truth = annotate_ego({"": scene}, [BevMap(px_m=0.25, reach_m=30.0)], library())
    assert truth is not None
    birdseye = truth.birdseye
    assert birdseye is not None
    n = 240
    along = (0.5 * n - np.arange(n) - 0.5) * 0.25
    x, y = np.meshgrid(along, along, indexing="ij")
    world = birdseye.T_world_map.apply(np.stack([x, y, np.zeros_like(x)], axis=-1))
    x, y = world[..., 0], world[..., 1]
    car = scene.instances[0]
    low = np.array(car.box_min_m) + car.T_world_instance.translation_m
    high = np.array(car.box_max_m) + car.T_world_instance.translation_m

    def beyond(edge: float, value: Array) -> Array:
        return np.abs(value - edge) > 0.02

    clear = beyond(4.0, np.abs(y)) & beyond(6.65, np.abs(y)) & beyond(4.15, np.abs(y))
    on_car = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
    at_car = (x > low[0] - 0.05) & (x < high[0] + 0.05) & (y > low[1] - 0.05) & (y < high[1] + 0.05)
    layers = birdseye.layers
    np.testing.assert_array_equal(layers["drivable"][clear], (np.abs(y) < 4.0)[clear])
    zebra = (np.abs(x - 10.0) < 2.0) & (np.abs(y) < 4.0)
    np.testing.assert_array_equal(layers["crosswalk"][clear], zebra[clear])
    np.testing.assert_array_equal(layers["road_divider"], np.abs(y) < 0.1875)
    np.testing.assert_array_equal(layers["vehicles"], on_car)
    assert not layers["people"].any()
    assert not layers["lane_divider"].any()
    assert (layers["free_space"] <= layers["drivable"]).all()
    assert layers["free_space"][clear & (np.abs(y) < 4.0) & ~at_car].all()
    assert not layers["free_space"][on_car & (np.hypot(x - 20.0, y + 2.0) < 0.7)].any()
    sidewalk = (np.abs(y) > 4.15) & (np.abs(y) < 6.65)
    np.testing.assert_array_equal(layers["sidewalk"][clear], sidewalk[clear])


def test_a_map_is_level_and_looks_ahead_on_any_slope() -> None:
    """Half a turn included; looking straight up it keeps the world's axes."""
    for yaw in (-3.1, -1.0, 0.0, 2.0, math.pi):
        tilted = SE3.about_z(yaw, (1.0, 2.0, 3.0)) @ SE3((0.0,) * 3, (0.995, 0.0, 0.0998749, 0.0))
        map_pose = level_pose(tilted)
        assert map_pose.translation_m == (1.0, 2.0, 3.0)
        np.testing.assert_allclose(
            map_pose.rotation()[:, 0], [math.cos(yaw), math.sin(yaw), 0.0], atol=1e-6
        )
        np.testing.assert_allclose(map_pose.rotation()[:, 2], [0.0, 0.0, 1.0], atol=1e-12)
    up = SE3((0.0,) * 3, (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0))
    assert level_pose(up) == SE3()


def test_a_map_needs_a_rig() -> None:
    scene = replace(street(), rigs=(), cameras=(), lidars=())

    with pytest.raises(ConfigError, match="no rig to centre the map on; add an element 'ego'"):
        annotate_ego({"": scene}, [BevMap()], library())


def test_boxes_are_given_in_the_frames_of_ego_and_scanner_at_their_instants() -> None:
    """The ego stands at y = -2 facing +Y; the scanner sweeps when the car has moved on by 1 m."""
    scene = street(math.radians(90.0))
    car = scene.instances[0].T_world_instance
    track = Trajectory("car/0", 1.0, (car, SE3((10.0, 0.0, 0.0)) @ car))
    scene = replace(scene, tracks=(track,))
    truth = annotate_ego({"": scene, "roof": scene_at(scene, 0.1)}, [Boxes3d()], library())
    assert truth is not None
    boxes = truth.boxes3d
    assert boxes is not None
    x, y, _ = boxes["ego"][1].T_frame_box.translation_m
    later = boxes["roof"][1].T_frame_box.translation_m

    assert (x, y) == pytest.approx((0.0, -20.0), abs=1e-5)
    assert later[:2] == pytest.approx((0.0, -21.0), abs=1e-5)
    low, high = scene.instances[0].box_min_m, scene.instances[0].box_max_m
    assert later[2] == pytest.approx(0.5 * (high[2] - low[2]) - 2.0, abs=1e-5)


def test_motion_is_told_along_the_axes_of_three_frames() -> None:
    """5 m/s along +X; the ego faces +Y: the object moves to its right, and its camera's."""
    scene = street(math.radians(90.0))
    car = scene.instances[0].T_world_instance
    track = Trajectory("car/0", 1.0, (car, SE3((5.0, 0.0, 0.0)) @ car, SE3((10.0, 0.0, 0.0)) @ car))
    scene = add_twists(replace(scene, tracks=(track,), time_s=1.0))
    given = ObjectTruth(scene.instances[0], 100, None)
    reading = SensorReading("front", scene.cameras[0], {})

    motion = Motion().annotate(scene, reading, given).motion

    assert motion is not None
    assert motion.ego is not None
    assert motion.world.velocity_m_s == pytest.approx((5.0, 0.0, 0.0))
    assert motion.ego.velocity_m_s == pytest.approx((0.0, -5.0, 0.0), abs=1e-5)
    assert motion.camera.velocity_m_s == pytest.approx((5.0, 0.0, 0.0), abs=1e-5)
    assert motion.speed_m_s == pytest.approx(5.0)


def test_the_ego_turns_about_its_body_and_not_about_its_rig() -> None:
    """A rig 2 m ahead of a body that turns at 0.5 rad/s: 1 m/s sideways, 0.5 m/s^2 inwards."""
    half = 0.5 * 0.5 * 0.02
    knots = tuple(
        SE3((0.0, 0.0, 0.0), (math.cos(k * half), 0.0, 0.0, math.sin(k * half)))
        for k in range(-2, 3)
    )
    scene = Scene(
        "turn",
        bodies=(Body("ego", "car"),),
        rigs=(Rig("ego", "ego", SE3((2.0, 0.0, 0.0))),),
        tracks=(Trajectory("ego", 0.02, knots, -0.04),),
    )
    truth = annotate_ego({"": scene}, [Boxes3d()], library())

    assert truth is not None
    assert truth.twist.velocity_m_s == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert truth.twist.acceleration_m_s2 == pytest.approx((-0.5, 0.0, 0.0), abs=1e-6)
    assert truth.twist.angular_velocity_rad_s == pytest.approx((0.0, 0.0, 0.5), abs=1e-6)


def test_annotators_do_what_their_methods_say() -> None:
    """Objects, images, samples: each gets only its own annotations; without a request, none."""
    scene = street()
    annotators = [Motion(), Lanes(), Boxes3d()]
    image = annotate_reading(scene, seen(scene), annotators, Thresholds(), library())
    frame = annotate_ego({"": scene}, annotators, library())

    assert [thing.motion is not None for thing in image.objects] == [True]
    assert image.borders
    assert image.free_space is None
    assert isinstance(frame, EgoTruth)
    assert len(frame.borders or ()) == 3
    assert frame.birdseye is None
    assert annotate_ego({"": scene}, [Motion()], library()) is None
