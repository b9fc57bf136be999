"""Tracks pass through their knots, move as calculus demands, and carry all that rides along."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation
from scipy.special import fresnel

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import STILL, JointTrajectory, StateChange, Trajectory, interpolate_poses
from gen_data.core.scene import Body, Camera, Device, Instance, Lidar, Light, Rig, Scene
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.core.se3 import SE3

QUICK = settings(max_examples=60, deadline=None, derandomize=True)

ways = st.lists(
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3, 3)), min_size=2, max_size=8
)


def track_of(points: list[tuple[float, float, float]], step_s: float = 0.25) -> Trajectory:
    """A track through points, turning a little at every knot."""
    return Trajectory(
        "car", step_s, tuple(SE3.about_z(0.1 * k, p) for k, p in enumerate(points)), start_s=1.0
    )


@QUICK
@given(ways)
def test_a_track_passes_through_its_knots(points: list[tuple[float, float, float]]) -> None:
    """At the knots' instants the pose is the knot itself."""
    track = track_of(points)
    for k, knot in enumerate(track.knots):
        assert track.pose(1.0 + 0.25 * k) == knot


def test_poses_of_several_tracks_are_those_of_each() -> None:
    """Tracks of different beginnings, steps and lengths; before, between and after their knots."""
    tracks = [
        track_of([(0, 0, 0), (1, 2, 0), (5, 2, 1), (6, -1, 1)]),
        track_of([(3, 0, 0), (4, 0, 0)], 0.1),
        track_of([(0, 0, 0), (-1, 2, 0), (-5, 2, 1), (0, 0, 2)]),
    ]
    times_s = np.array([0.5, 1.0, 1.06, 1.31, 1.75, 1.76, 9.0])

    rotations, translations = interpolate_poses(tracks, times_s)

    for i, track in enumerate(tracks):
        for k, time_s in enumerate(times_s.tolist()):
            pose = track.pose(time_s)
            np.testing.assert_allclose(rotations[i, k], pose.rotation(), atol=1e-14)
            np.testing.assert_allclose(translations[i, k], pose.translation_m, atol=1e-13)


@QUICK
@given(ways, st.floats(0.0, 1.0))
def test_positions_and_velocities_are_those_of_a_catmull_rom_spline(
    points: list[tuple[float, float, float]], share: float
) -> None:
    """SciPy's Hermite spline with NumPy's slopes of second order, and its derivative."""
    track = track_of(points)
    p = np.array(points)
    knots_s = 1.0 + 0.25 * np.arange(len(points))
    slopes = np.gradient(p, 0.25, axis=0, edge_order=min(2, len(p) - 1))
    spline = CubicHermiteSpline(knots_s, p, slopes)
    t = 1.0 + share * (knots_s[-1] - 1.0)
    if np.min(np.abs(knots_s - t)) < 1e-6:
        return
    twist = track.twist(t)
    np.testing.assert_allclose(track.pose(t).translation_m, spline(t), atol=1e-6)
    np.testing.assert_allclose(twist.velocity_m_s, spline(t, 1), atol=1e-5)


@QUICK
@given(st.floats(0.0, 1.0), st.floats(-0.4, 0.4))
def test_rotations_between_knots_stay_near_the_shortest_arc(f: float, turn_rad: float) -> None:
    """A normalised linear blend of small turns differs from slerp by a hair."""
    track = Trajectory("car", 1.0, (SE3(), SE3.about_z(turn_rad)))
    turned = Rotation.from_matrix(track.pose(f).rotation()).magnitude()
    assert turned == pytest.approx(abs(turn_rad) * f, abs=1e-3)


def test_angular_velocity_is_the_turn_over_the_step() -> None:
    """A quarter turn to the left in half a second is pi radians a second about Z."""
    track = Trajectory("car", 0.5, (SE3(), SE3.about_z(0.5 * math.pi)))
    np.testing.assert_allclose(
        track.twist(0.2).angular_velocity_rad_s, (0.0, 0.0, math.pi), atol=1e-9
    )


def circular(t: float) -> SE3:
    """20 m radius to the left at 8 m/s, from the origin along X."""
    turned = 0.4 * t
    return SE3.about_z(turned, (20.0 * math.sin(turned), 20.0 * (1.0 - math.cos(turned)), 0.0))


def clothoid(t: float) -> SE3:
    """A turn that grows: 10 m/s with a turn rate of 0.2 rad/s^2 times t (Fresnel's integrals)."""
    unit_s = math.sqrt(math.pi / 0.2)
    sine, cosine = fresnel(t / unit_s)
    return SE3.about_z(0.1 * t * t, (10.0 * unit_s * cosine, 10.0 * unit_s * sine, 0.0))


STEP_S = 0.1


@pytest.mark.parametrize("knots", [4, 12])
@pytest.mark.parametrize("motion", ["circle", "clothoid"])
def test_acceleration_and_turn_rate_are_the_curves_at_every_knot(motion: str, knots: int) -> None:
    """Centripetal acceleration v w to the left and turn rate w, at both ends of the track too."""
    way, speed = (circular, 8.0) if motion == "circle" else (clothoid, 10.0)
    track = Trajectory("car", STEP_S, tuple(way(STEP_S * k) for k in range(knots)))
    for k, knot in enumerate(track.knots):
        rate = 0.4 if motion == "circle" else 0.2 * STEP_S * k
        seen = track.twist(STEP_S * k).seen_along(knot)
        assert seen.velocity_m_s == pytest.approx((speed, 0.0, 0.0), abs=0.01 * speed), k
        assert seen.acceleration_m_s2 == pytest.approx((0.0, speed * rate, 0.0), abs=0.02), k
        assert seen.angular_velocity_rad_s == pytest.approx((0.0, 0.0, rate), abs=1e-9), k


def test_even_acceleration_is_exact_from_the_first_to_the_last_instant() -> None:
    """Braking by 3 m/s^2: a parabola, which a cubic with correct slopes follows exactly."""
    places = [20.0 * t - 1.5 * t * t for t in np.arange(5) * STEP_S]
    track = Trajectory("car", STEP_S, tuple(SE3((x, 0.0, 0.0)) for x in places))
    for t in np.linspace(0.0, 4 * STEP_S, 13).tolist():
        twist = track.twist(t)
        assert track.pose(t).translation_m[0] == pytest.approx(20.0 * t - 1.5 * t * t, abs=1e-8)
        assert twist.velocity_m_s[0] == pytest.approx(20.0 - 3.0 * t, abs=1e-8)
        assert twist.acceleration_m_s2[0] == pytest.approx(-3.0, abs=1e-8)


def test_outside_its_knots_a_body_stands_still_and_one_knot_is_no_track() -> None:
    """Before the first and after the last knot."""
    track = track_of([(0, 0, 0), (1, 0, 0)])
    assert track.pose(0.0) == track.knots[0]
    assert track.pose(9.0) == track.knots[-1]
    assert track.twist(9.0) == STILL

    with pytest.raises(ValueError, match="two knots"):
        Trajectory("car", 0.1, (SE3(),))


def scene() -> Scene:
    """A car with a lamp, a rig and sensors on it, which drives 1 m in 1 s along X."""
    k = Intrinsics.from_hfov(8, 6, 1.0)
    return place_sensors(
        Scene(
            "test",
            bodies=(
                Body("car", "box", SE3(), instance_id=1),
                Body("tree", "box", SE3((5.0, 5.0, 0.0)), instance_id=2),
            ),
            instances=(
                Instance(1, "car", "car", 1, "box", attributes=(("brake", "off"),)),
                Instance(2, "tree", "tree", 2, "box"),
            ),
            lights=(
                Light("lamp", "spot", position_m=(2.0, 0.5, 0.6), body="car"),
                Light("sun", "sun"),
            ),
            cameras=(Camera("color", SE3(), k, rig="ego", T_rig_camera=SE3((1.0, 0.0, 1.5))),),
            lidars=(Lidar("top", "", SE3((0.0, 0.0, 2.0)), rig="ego"),),
            devices=(Device("imu", "imu", "ego", SE3((0.1, 0.0, 0.3))),),
            rigs=(Rig("ego", "car", SE3((0.0, 0.0, 0.1))),),
            tracks=(Trajectory("car", 1.0, (SE3(), SE3((1.0, 0.0, 0.0)))),),
            changes=(
                StateChange(0.5, "car", asset="box?lit", attributes=(("brake", "on"),)),
                StateChange(0.8, "car", attributes=(("brake", "off"),)),
            ),
        )
    )


def test_everything_on_a_moving_body_moves_with_it() -> None:
    """Body, instance, lamp, camera, lidar and device; the tree and the sun stay."""
    then = scene_at(scene(), 1.0)
    assert then.body("car").T_world_body.translation_m == (1.0, 0.0, 0.0)
    assert then.instance(1).T_world_instance.translation_m == (1.0, 0.0, 0.0)
    assert then.lights[0].position_m == (3.0, 0.5, 0.6)
    assert then.lights[1] == scene().lights[1]
    assert then.camera("color").T_world_camera.translation_m == (2.0, 0.0, 1.6)
    assert then.lidar("top").T_world_lidar.translation_m == (1.0, 0.0, 2.1)
    assert then.device("imu").T_world_device.translation_m == (1.1, 0.0, 0.4)
    assert then.body("tree") == scene().body("tree")


def test_a_panel_turns_with_its_body() -> None:
    """A quarter turn about Z: normal and first side with it; both stay unit and at right angles."""
    panel = Light(
        "p", "rectangle", (1.0, 0.0, 1.0), (1.0, 0.0, 0.0), side=(0.0, 1.0, 0.0), body="car"
    )
    turned = SE3.about_z(0.5 * math.pi)
    moving = replace(scene(), lights=(panel,), tracks=(Trajectory("car", 1.0, (SE3(), turned)),))

    (then,) = scene_at(moving, 1.0).lights

    assert then.position_m == pytest.approx((0.0, 1.0, 1.0))
    assert then.direction == pytest.approx((0.0, 1.0, 0.0))
    assert then.side == pytest.approx((-1.0, 0.0, 0.0))


def test_changes_hold_until_the_next_one() -> None:
    """The brake lights for three tenths of a second; the lamp's look stays."""
    for time_s, brake, asset in (
        (0.4, "off", "box"),
        (0.6, "on", "box?lit"),
        (0.9, "off", "box?lit"),
    ):
        then = scene_at(scene(), time_s)
        assert dict(then.instance(1).attributes)["brake"] == brake
        assert then.body("car").asset == then.instance(1).asset == asset


def test_the_way_to_an_instant_does_not_matter_and_instances_have_its_velocities() -> None:
    """By another instant or straight: the same bodies. One metre in one second; the tree stands."""
    assert scene_at(scene_at(scene(), 0.3), 0.7).bodies == scene_at(scene(), 0.7).bodies

    then = scene_at(scene(), 0.5)
    assert then.instance(1).twist.velocity_m_s == pytest.approx((1.0, 0.0, 0.0))
    assert then.instance(2).twist == STILL


def test_joint_positions_are_linear_between_knots_and_constant_outside() -> None:
    """Half a radian in half a second, from the first second on."""
    track = JointTrajectory(0.5, ((0.0, 1.0), (0.5, 1.0)), start_s=1.0)
    assert (track.positions(0.0), track.positions(1.25)) == ((0.0, 1.0), (0.25, 1.0))
    assert track.positions(9.0) == (0.5, 1.0)
