"""Overlap of oriented boxes, against linear programming and against a grid of points."""

import math

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from gen_data.core.boxes import boxes_touch, rectangles_overlap
from gen_data.core.se3 import SE3, Array, Vec3

PLACES = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
HALVES = st.tuples(*[st.floats(0.05, 1.5)] * 3)
TURNS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(c * c for c in q) > 0.01)
CLEAR_M = 1e-6
"""Boxes nearer than this to just touching are left out: rounding decides about them."""


def pose_of(place: Vec3, turn: tuple[float, ...]) -> SE3:
    norm = math.sqrt(sum(c * c for c in turn))
    w, x, y, z = (c / norm for c in turn)
    return SE3(place, (w, x, y, z))


def half_spaces(pose: SE3, half_m: Vec3, larger_m: float) -> tuple[Array, Array]:
    """A box as the points with ``A @ p <= b``, its faces moved outwards."""
    axes = pose.rotation().T
    normals = np.concatenate([axes, -axes])
    reach = np.tile(np.array(half_m) + larger_m, 2)
    return normals, reach + normals @ np.asarray(pose.translation_m)


def have_a_common_point(a: SE3, half_a: Vec3, b: SE3, half_b: Vec3, larger_m: float) -> bool:
    """By a linear program over the half spaces of both boxes."""
    faces_a, limits_a = half_spaces(a, half_a, larger_m)
    faces_b, limits_b = half_spaces(b, half_b, larger_m)
    answer = linprog(
        np.zeros(3), np.concatenate([faces_a, faces_b]), np.concatenate([limits_a, limits_b]),
        bounds=(None, None), method="highs",
    )  # fmt: skip
    return bool(answer.status == 0)


@settings(deadline=None)
@given(PLACES, TURNS, HALVES, PLACES, TURNS, HALVES)
def test_boxes_touch_where_a_linear_program_finds_a_common_point(
    place_a: Vec3, turn_a: Vec3, half_a: Vec3, place_b: Vec3, turn_b: Vec3, half_b: Vec3
) -> None:
    """Any two boxes that are not just about to touch."""
    a, b = pose_of(place_a, turn_a), pose_of(place_b, turn_b)
    surely = have_a_common_point(a, half_a, b, half_b, -CLEAR_M)
    assume(surely == have_a_common_point(a, half_a, b, half_b, CLEAR_M))

    assert boxes_touch(a, half_a, b, half_b) == surely


@settings(deadline=None)
@given(PLACES, TURNS, HALVES, PLACES, HALVES)
def test_parallel_boxes_touch_where_their_intervals_do(
    place_a: Vec3, turn: Vec3, half_a: Vec3, between: Vec3, half_b: Vec3
) -> None:
    """Edges along edges make axes of no length, which must not separate anything."""
    a = pose_of(place_a, turn)
    b = a @ SE3(between)
    gaps = [abs(d) - p - q for d, p, q in zip(between, half_a, half_b, strict=True)]
    assume(all(abs(gap) > CLEAR_M for gap in gaps))

    assert boxes_touch(a, half_a, b, half_b) == all(gap < 0.0 for gap in gaps)


@settings(deadline=None)
@given(PLACES, HALVES, PLACES, HALVES, st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
def test_rectangles_overlap_where_upright_boxes_of_one_height_touch(
    place_a: Vec3, half_a: Vec3, place_b: Vec3, half_b: Vec3, yaw_a: float, yaw_b: float
) -> None:
    """The rectangle is the box seen from above; both ways round."""
    rows, boxes = [], []
    for (x, y, _), (half_x, half_y, _), yaw in ((place_a, half_a, yaw_a), (place_b, half_b, yaw_b)):
        rows.append(np.array([x, y, math.cos(yaw), math.sin(yaw)]))
        turn = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
        boxes.append((pose_of((x, y, 0.0), turn), (half_x, half_y, 1.0)))
    (a, size_a), (b, size_b) = boxes
    surely = have_a_common_point(a, size_a, b, size_b, -CLEAR_M)
    assume(surely == have_a_common_point(a, size_a, b, size_b, CLEAR_M))
    flat_a, flat_b = np.array(half_a[:2]), np.array(half_b[:2])

    assert bool(rectangles_overlap(rows[0], flat_a, rows[1], flat_b)) == surely
    assert bool(rectangles_overlap(rows[1], flat_b, rows[0], flat_a)) == surely


def test_rectangles_that_share_an_edge_do_not_overlap() -> None:
    """Neighbouring parking places are free of one another; boxes in contact do touch."""
    left, right = np.array([0.0, 0.0, 1.0, 0.0]), np.array([2.0, 0.0, 1.0, 0.0])
    half = np.array([1.0, 1.0])

    assert not rectangles_overlap(left, half, right, half)
    assert boxes_touch(SE3(), (1.0, 1.0, 1.0), SE3((2.0, 0.0, 0.0)), (1.0, 1.0, 1.0))


def test_one_rectangle_is_compared_with_many() -> None:
    """Shapes broadcast: near, far, and turned so that only one corner reaches."""
    own, half = np.array([0.0, 0.0, 1.0, 0.0]), np.array([1.0, 1.0])
    slope = math.sqrt(0.5)
    others = np.array([[1.5, 0.0, 1.0, 0.0], [4.0, 0.0, 1.0, 0.0], [2.3, 0.0, slope, slope]])

    overlap = rectangles_overlap(own, half, others, np.ones((3, 2)))

    assert overlap.tolist() == [True, False, True]
