"""Rigid poses: group laws, agreement with matrices, and cameras that look at places."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gen_data.core.se3 import IDENTITY, SE3, look_at, rotation_to_quaternion

QUICK = settings(max_examples=150, deadline=None, derandomize=True)

coordinates = st.floats(-100, 100, allow_subnormal=False)
vectors = st.tuples(coordinates, coordinates, coordinates)


@st.composite
def quaternions(draw: st.DrawFn) -> tuple[float, float, float, float]:
    parts = draw(
        st.lists(st.floats(-1, 1, allow_subnormal=False), min_size=4, max_size=4).filter(
            lambda q: math.hypot(*q) > 0.1
        )
    )
    w, x, y, z = (float(v) for v in np.array(parts) / np.linalg.norm(parts))
    return w, x, y, z


poses = st.builds(SE3, vectors, quaternions())


def assert_same_pose(a: SE3, b: SE3) -> None:
    """Equal as maps: q and -q are one rotation."""
    np.testing.assert_allclose(a.matrix(), b.matrix(), atol=1e-9)


@QUICK
@given(poses)
def test_a_pose_and_its_inverse_cancel_and_its_matrix_gives_it_back(pose: SE3) -> None:
    """All four branches of Shepperd's method; the scalar part is never negative."""
    assert_same_pose(pose.inverse() @ pose, IDENTITY)
    assert_same_pose(pose @ pose.inverse(), IDENTITY)

    back = SE3.from_matrix(pose.matrix())

    assert_same_pose(back, pose)
    assert back.quaternion_wxyz[0] >= 0
    assert math.hypot(*back.quaternion_wxyz) == pytest.approx(1.0, abs=1e-12)


@QUICK
@given(poses, poses)
def test_composition_is_the_matrix_product(a: SE3, b: SE3) -> None:
    """``T_a_c = T_a_b @ T_b_c`` in either representation."""
    np.testing.assert_allclose((a @ b).matrix(), a.matrix() @ b.matrix(), atol=1e-9)


@QUICK
@given(poses, poses, poses)
def test_composition_is_associative(a: SE3, b: SE3, c: SE3) -> None:
    """Chains of frames need no parentheses."""
    assert_same_pose((a @ b) @ c, a @ (b @ c))


@QUICK
@given(quaternions())
def test_rotation_matrices_are_proper_and_agree_with_scipy(
    q: tuple[float, float, float, float],
) -> None:
    """An independent implementation; scipy puts the scalar last."""
    expected = Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()

    np.testing.assert_allclose(SE3((0, 0, 0), q).rotation(), expected, atol=1e-12)

    rotation = SE3((0, 0, 0), q).rotation()

    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@QUICK
@given(poses, st.lists(vectors, min_size=1, max_size=5))
def test_points_move_as_by_the_matrix(pose: SE3, points: list[tuple[float, float, float]]) -> None:
    """Any leading shape; directions are rotated only."""
    p = np.array(points)
    homogeneous = np.concatenate([p, np.ones((len(p), 1))], axis=1)

    moved = pose.apply(p)

    np.testing.assert_allclose(moved, (homogeneous @ pose.matrix().T)[:, :3], atol=1e-9)
    np.testing.assert_allclose(pose.apply(p[None, :, None]), moved[None, :, None], atol=0)
    np.testing.assert_allclose(pose.rotate(p), moved - pose.translation_m, atol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_survive_the_matrix(axis: int) -> None:
    """Where the scalar part vanishes and one vector part dominates."""
    q = [0.0, 0.0, 0.0, 0.0]
    q[1 + axis] = 1.0

    assert rotation_to_quaternion(SE3((0, 0, 0), tuple(q)).rotation()) == tuple(q)  # type: ignore[arg-type]


def test_about_z_turns_x_to_y() -> None:
    pose = SE3.about_z(math.pi / 2, (1.0, 2.0, 3.0))

    np.testing.assert_allclose(pose.rotate(np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(pose.apply(np.zeros(3)), [1, 2, 3])


def test_rounding_lands_on_the_decimal_grid() -> None:
    """Negative zero becomes zero, too, so that text is the same; the quaternion stays unit."""
    pose = SE3((1.23456789, -0.00000001, 2.0), (0.5, 0.5, 0.5, 0.5)).rounded()

    assert pose.translation_m == (1.234568, 0.0, 2.0)
    assert math.copysign(1, pose.translation_m[1]) == 1
    assert pose.rounded() == pose


eyes = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5))


@QUICK
@given(eyes, eyes, st.floats(-math.pi, math.pi))
def test_look_at_puts_the_target_on_the_optical_axis(
    eye: tuple[float, float, float], target: tuple[float, float, float], roll_rad: float
) -> None:
    """At its distance, whatever the roll."""
    distance = math.dist(eye, target)
    if distance < 1e-3:
        return

    T_world_camera = look_at(eye, target, roll_rad)
    p_camera = T_world_camera.inverse().apply(np.array(target))

    np.testing.assert_allclose(p_camera, [0, 0, distance], atol=1e-6 * (1 + distance))
    np.testing.assert_allclose(T_world_camera.translation_m, eye)


@QUICK
@given(eyes, eyes)
def test_look_at_keeps_the_horizon_level(
    eye: tuple[float, float, float], target: tuple[float, float, float]
) -> None:
    """The camera's X axis is horizontal and its Y axis points down, unless it looks straight up."""
    horizontal = math.dist(eye[:2], target[:2])
    if horizontal < 0.02 * math.dist(eye, target) or horizontal < 1e-3:
        return

    rotation = look_at(eye, target).rotation()

    assert rotation[2, 0] == pytest.approx(0.0, abs=1e-9)
    assert rotation[2, 1] < 0


def test_a_positive_roll_turns_the_camera_clockwise() -> None:
    """Seen along the viewing direction: X moves towards the former down."""
    level, rolled = look_at((0, 0, 0), (1, 0, 0)), look_at((0, 0, 0), (1, 0, 0), math.pi / 2)

    np.testing.assert_allclose(level.rotation()[:, 0], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(rolled.rotation()[:, 0], [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize("target", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1e-9, 0.0, -3.0)])
def test_looking_straight_up_or_down_is_defined(target: tuple[float, float, float]) -> None:
    T_world_camera = look_at((0, 0, 0), target)

    p_camera = T_world_camera.inverse().apply(np.array(target))

    np.testing.assert_allclose(p_camera, [0, 0, abs(target[2])], atol=1e-8)


def test_looking_at_oneself_is_refused() -> None:
    with pytest.raises(ValueError, match="a target that differs from the eye"):
        look_at((1, 2, 3), (1, 2, 3))
