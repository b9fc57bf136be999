"""Sweeps of scanners that move, past bodies that move: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.capture import PointCloud
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import Trajectory
from gen_data.core.scene import Body, Camera, Lidar, Rig, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from tests.renderers.fake_library import FakeLibrary, box_mesh, room_mesh

MESHES = {"wall": box_mesh((0.2, 80.0, 30.0)), "box": box_mesh((4.0, 2.0, 1.6)),
          "cart": box_mesh((0.2, 0.2, 0.2)), "hall": room_mesh((60.0, 60.0, 20.0))}  # fmt: skip
SPEED_M_S = np.array([14.0, 3.0, 0.0])
YAW_RATE_RAD_S = 0.6
STEP_S = 0.05
PERIOD_S = 0.1


def moving(body: str, start: tuple[float, float, float], turning: bool = True) -> Trajectory:
    """Even motion, and an even turn to the left, from 1 s before to 1 s after time 0."""
    knots = []
    for k in range(-20, 21):
        place = np.asarray(start) + SPEED_M_S * (k * STEP_S)
        yaw = YAW_RATE_RAD_S * k * STEP_S if turning else 0.0
        knots.append(SE3.about_z(yaw, tuple(map(float, place))))
    return Trajectory(body, STEP_S, tuple(knots), start_s=-20 * STEP_S)


def scene_of(bodies: list[Body], *tracks: Trajectory) -> Scene:
    cart = Body("cart", "cart", SE3((0.0, 0.0, -3.0)))
    rig = Rig("rig", "cart", SE3((0.0, 0.0, 3.0)))
    lidar = Lidar("velodyne", "", SE3((0.5, 0.0, 0.0)), rig="rig", sweep_s=PERIOD_S)
    scene = Scene("test", (cart, *bodies), tracks=tracks, rigs=(rig,), lidars=(lidar,))
    return scene_at(scene, 0.2)


BEFORE_A_WALL = scene_of([Body("wall", "wall", SE3((30.1, 0.0, 0.0)))], moving("cart", (0, 0, -3)))
"""A still wall, 30 m from the start of a turning scanner."""


def sweep(scene: Scene, motion: str, **fields: object) -> PointCloud:
    sensor = LidarSensor(
        name="velodyne", model="VLP-16", ideal=True, motion_distortion=motion, **fields
    )  # type: ignore[arg-type]
    renderer = WarpRenderer(FakeLibrary(MESHES), "cpu")
    return sensor.capture(scene, renderer, frozenset(), Streams(1, 2).rng("lidar"))


def times_s(cloud: PointCloud) -> np.ndarray:
    """The instant of every point, in the scene's time."""
    return cloud.start_s + cloud.points["time_s"].astype(np.float64)


def scanner_poses(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Yaw and position of the scanner on its turning cart, 0.5 m before its centre."""
    yaw = YAW_RATE_RAD_S * t
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(t)], axis=1)
    return yaw, SPEED_M_S * t[:, None] + 0.5 * ahead


def turned(yaw: np.ndarray, v: np.ndarray) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1], v[:, 2]], axis=1)


def test_the_scene_s_instant_is_the_middle_of_the_sweep() -> None:
    """There the scanner looks straight ahead."""
    cloud = sweep(
        scene_of([Body("hall", "hall", SE3((0, 0, -5.0)))], moving("cart", (0, 0, -3))), "raw"
    )

    assert (cloud.time_s, cloud.start_s) == (0.2, pytest.approx(0.15))
    x, y, _ = cloud.points["position_m"].T
    ahead = np.abs(np.arctan2(y, x)) < 0.01
    np.testing.assert_allclose(times_s(cloud)[ahead], 0.2, atol=2e-4)


def test_a_moving_wall_is_met_where_it_is_when_each_pulse_leaves_unless_frozen() -> None:
    """Still scanner, wall at ``x = 20 + 14 t``: range = x / cosine, within 1 mm."""
    start = (20.1, 0.0, 0.0)
    scene = scene_of([Body("wall", "wall", SE3(start))], moving("wall", start, turning=False))

    cloud = sweep(scene, "deskewed")

    p = cloud.points["position_m"].astype(np.float64)
    x_m = 20.0 + SPEED_M_S[0] * times_s(cloud) - 0.5
    direction = p / np.linalg.norm(p, axis=1, keepdims=True)
    expected_m = x_m / direction[:, 0]
    assert len(p) > 5000
    assert np.ptp(x_m) > 0.4
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), expected_m, atol=1e-3)

    x_m = sweep(scene, "none").points["position_m"][:, 0]

    np.testing.assert_allclose(x_m, 20.0 + SPEED_M_S[0] * 0.2 - 0.5, atol=1e-4)


def test_raw_points_of_a_moving_scanner_are_in_the_frame_of_their_pulse() -> None:
    """Driven and turned by the closed form of the motion, they lie on the still wall; 1 mm."""
    cloud = sweep(BEFORE_A_WALL, "raw")

    yaw, eye_m = scanner_poses(times_s(cloud))
    p_world = eye_m + turned(yaw, cloud.points["position_m"].astype(np.float64))
    assert len(p_world) > 4000
    np.testing.assert_allclose(p_world[:, 0], 30.0, atol=1e-3)
    assert np.ptp(cloud.points["time_s"]) > 0.02


def test_deskewed_points_are_in_the_frame_of_the_scene_s_instant() -> None:
    """The still wall is a plane there; as measured it is off by decimetres."""
    cloud, raw = (sweep(BEFORE_A_WALL, motion) for motion in ("deskewed", "raw"))

    def wall_x(points: np.ndarray) -> np.ndarray:
        yaw, eye_m = scanner_poses(np.array([0.2]))
        p = points["position_m"].astype(np.float64)
        return (eye_m + turned(np.repeat(yaw, len(p)), p))[:, 0]

    np.testing.assert_allclose(wall_x(cloud.points), 30.0, atol=1e-3)
    assert np.abs(wall_x(raw.points) - 30.0).max() > 0.3
    assert (cloud.points["time_s"] == raw.points["time_s"]).all()


def test_points_on_a_body_that_turns_past_a_turning_scanner_lie_on_it() -> None:
    """Taken to the body's frame at their instant, they are on its faces within 1 mm."""
    start = (9.0, 4.0, 0.0)
    scene = scene_of([Body("box", "box", SE3(start), instance_id=1)],
                     moving("box", start), moving("cart", (0, 0, -3), turning=False))  # fmt: skip

    cloud = sweep(scene, "deskewed")

    t = times_s(cloud)
    p_world = cloud.points["position_m"] + (SPEED_M_S * 0.2 + (0.5, 0.0, 0.0))
    local = turned(-YAW_RATE_RAD_S * t, p_world - start - SPEED_M_S * t[:, None])
    outside = np.abs(local) - (2.0, 1.0, 0.8)
    assert len(local) > 300
    np.testing.assert_allclose(outside.max(axis=1), 0.0, atol=1e-3)
    assert (cloud.points["instance_id"] == 1).all()


@pytest.mark.parametrize("motion", ["raw", "deskewed"])
def test_where_nothing_moves_every_kind_of_sweep_is_the_same(motion: str) -> None:
    """Byte by byte; a track that rests moves nothing either."""
    hall = Body("hall", "hall", SE3((0.0, 0.0, -5.0)))
    still = scene_of([hall])
    resting = Trajectory("hall", 0.1, (hall.T_world_body,) * 4)

    frozen = sweep(still, "none").points.tobytes()

    assert sweep(still, motion).points.tobytes() == frozen
    assert sweep(scene_of([hall], resting), motion).points.tobytes() == frozen


def test_a_scanner_beside_a_camera_rides_with_the_camera_s_rig() -> None:
    """As if it were on the rig itself."""
    scene = BEFORE_A_WALL
    T_rig_camera = SE3((0.5, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
    camera = Camera("color", SE3(), Intrinsics(8, 8, 8.0, 8.0, 4.0, 4.0), None, "rig", T_rig_camera)
    beside = Scene("test", scene.bodies, cameras=(camera,), rigs=scene.rigs, tracks=scene.tracks,
                   lidars=(Lidar("velodyne", "color", sweep_s=PERIOD_S),))  # fmt: skip

    one, other = sweep(scene, "raw"), sweep(scene_at(beside, 0.2), "raw")

    assert len(one.points) == len(other.points)
    np.testing.assert_allclose(one.points["position_m"], other.points["position_m"], atol=2e-4)


def test_poses_of_many_instants_are_those_of_one_by_one() -> None:
    """Bit by bit, before, at, between and after the knots."""
    track = moving("cart", (1.0, 2.0, 3.0))
    instants_s = np.array([-3.0, -1.0, -0.51234, 0.0, 0.05, 0.0666, 0.99999, 1.0, 7.0])

    R, t = track.poses(instants_s)

    for k, instant_s in enumerate(instants_s):
        pose = track.pose(float(instant_s))
        assert tuple(t[k]) == pose.translation_m
        np.testing.assert_allclose(R[k], pose.rotation(), atol=1e-15)


def test_a_moving_sweep_made_again_is_the_same() -> None:
    """Byte by byte, by a renderer that has seen another scene before."""
    start = (9.0, 4.0, 0.0)
    box = Body("box", "box", SE3(start), instance_id=1)
    scene = scene_of([box], moving("box", start), moving("cart", (0, 0, -3)))
    sensor = LidarSensor(name="velodyne", model="VLP-16", returns="dual", divergence=True)
    used = WarpRenderer(FakeLibrary(MESHES), "cpu")
    sensor.capture(BEFORE_A_WALL, used, frozenset(), Streams(1, 2).rng("lidar"))

    one, two = (
        sensor.capture(scene, renderer, frozenset(), Streams(1, 2).rng("lidar")).points
        for renderer in (used, WarpRenderer(FakeLibrary(MESHES), "cpu"))
    )

    assert len(one) > 100
    assert one.tobytes() == two.tobytes()


@pytest.mark.parametrize("motion", ["raw", "deskewed", "none"])
def test_points_of_lasers_beside_the_axis_lie_on_the_walls(motion: str) -> None:
    """Beams that pass the axis at a distance, at two heights, end on the walls of a hall."""
    hall = Body("hall", "hall", SE3((0.0, 0.0, -2.5)))
    sensor = LidarSensor(name="velodyne", model="HDL-64E", ideal=True, motion_distortion=motion)
    renderer = WarpRenderer(FakeLibrary(MESHES), "cpu")
    scene = replace(scene_of([hall]), tracks=())
    cloud = sensor.capture(scene, renderer, frozenset(), Streams(1, 2).rng("lidar"))
    p_world = cloud.lidar.T_world_lidar.apply(cloud.points["position_m"].astype(np.float64))

    sides = np.abs(np.abs(p_world[:, :2]) - 30.0).min(axis=1)
    floor = np.abs(p_world[:, 2] + 2.5)
    assert len(p_world) > 130_000
    assert np.minimum(sides, floor).max() < 1e-3
    # The highest beam starts 0.209 m up, 29.5 m from the wall ahead, and rises by 2 degrees.
    top = cloud.points[cloud.points["ring"] == 0]["position_m"]
    ahead = top[np.abs(top[:, 1]) < 0.5]
    ahead = ahead[ahead[:, 0] > 0.0]
    np.testing.assert_allclose(ahead[:, 2], 0.209 + 29.5 * np.tan(np.radians(2.0)), atol=2e-3)
