"""Collision geometry as the engine gets it."""

import itertools

import numpy as np
import pytest

from gen_data.core.asset_types import ConvexParts
from gen_data.physics.collision_shapes import (
    SHELL_M,
    box_shape,
    collision_shape,
    pack_shape,
    scale_step,
    unpack_shape,
)
from tests.physics.doubles import ball, box, cylinder


def test_the_centre_of_mass_of_a_cone_is_a_quarter_of_its_height_above_the_base() -> None:
    """Of a solid pyramid or cone; origin in the middle of its height of 12 cm."""
    shape = collision_shape(ConvexParts((cylinder(0.04, 0.12, top_radius_m=1e-6),)))

    assert shape.center_of_mass_m == pytest.approx((0.0, 0.0, -0.06 + 0.03), abs=1e-5)


def test_parts_weigh_by_their_volume() -> None:
    """A head of 8 and a handle of 2 cubic centimetres: (8 * 5 + 2 * 0) / 10 along X."""
    head, handle = box(0.02, 0.02, 0.02, at=(0.05, 0, 0)), box(0.02, 0.01, 0.01)

    shape = collision_shape(ConvexParts((head, handle)))

    assert shape.center_of_mass_m == pytest.approx((0.04, 0.0, 0.0), abs=1e-9)


def test_upright_boxes_become_primitives_and_turned_ones_do_not() -> None:
    """Centre relative to the centre of mass, half extents in order."""
    turned = box(0.2, 0.1, 0.1) @ np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])

    (primitive,) = collision_shape(ConvexParts((box(0.2, 0.1, 0.4, at=(1, 2, 3)),))).boxes

    np.testing.assert_allclose(primitive, ((0, 0, 0), (0.1, 0.05, 0.2)), atol=1e-12)
    assert collision_shape(ConvexParts((turned,))).boxes == ()


def test_a_box_of_its_corners_is_the_hull_that_qhull_finds() -> None:
    """Not centred, and of three different sizes."""
    low, high = (-0.3, -0.05, -0.2), (0.1, 0.05, 1.4)
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))

    made, found = box_shape(low, high), collision_shape(ConvexParts((corners,)))

    assert made.center_of_mass_m == pytest.approx((-0.1, 0.0, 0.6), abs=1e-12)
    assert made.center_of_mass_m == found.center_of_mass_m
    np.testing.assert_array_equal(made.boxes, found.boxes)
    (hull,), (expected,) = made.hulls, found.hulls
    np.testing.assert_allclose(hull.vertices_m, expected.vertices_m, atol=1e-12)
    np.testing.assert_allclose(hull.retreats, expected.retreats, atol=1e-9)
    assert hull.width_m == pytest.approx(expected.width_m, abs=1e-12)


@pytest.mark.parametrize("depth_m", [0.0005, SHELL_M])
def test_all_faces_of_a_hull_move_inward_by_the_shell(depth_m: float) -> None:
    """A can: both lids and its polygonal wall (24 sides) are nearer by exactly the depth."""
    (hull,) = collision_shape(ConvexParts((cylinder(0.04, 0.1),))).hulls

    points = hull.shrunken(depth_m)

    assert points[:, 2].max() == pytest.approx(0.05 - depth_m, abs=1e-8)
    assert points[:, 2].min() == pytest.approx(-0.05 + depth_m, abs=1e-8)
    wall = np.hypot(points[:, 0], points[:, 1]) * np.cos(np.pi / 24)
    np.testing.assert_allclose(wall, 0.04 * np.cos(np.pi / 24) - depth_m, atol=1e-8)


def test_a_thin_sheet_never_turns_inside_out() -> None:
    """A card of half a millimetre keeps a fifth of its thickness."""
    (hull,) = collision_shape(ConvexParts((box(0.08, 0.05, 0.0005),))).hulls

    assert np.ptp(hull.shrunken(SHELL_M)[:, 2]) == pytest.approx(0.0001, rel=1e-3)


def test_a_flat_part_neither_weighs_nor_fails() -> None:
    """A square without thickness and a cube: the cube alone has mass."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)

    shape = collision_shape(ConvexParts((square, box(0.1, 0.1, 0.1, at=(5, 0, 0)))))

    assert shape.center_of_mass_m == pytest.approx((5.0, 0.0, 0.0), abs=1e-9)


def test_points_inside_a_hull_are_left_out() -> None:
    """The engine sees a ball's surface only."""
    (hull,) = collision_shape(ConvexParts((np.concatenate([ball(0.05), ball(0.02)]),))).hulls

    assert len(hull.vertices_m) == 200


def test_any_scale_is_near_a_step() -> None:
    """Within 2.5 percent, hence the shell is missed by at most 25 micrometres."""
    for scale in np.geomspace(0.01, 100.0, 997):
        assert 1.05 ** scale_step(float(scale)) == pytest.approx(scale, rel=0.0251)
    assert scale_step(1.0) == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_stored_shape_is_the_same(seed: int) -> None:
    """Arrays of several parts, flat ones and boxes among them, to the last bit."""
    rng = np.random.default_rng(seed)
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
    parts = [corners * rng.uniform(0.01, 0.2, 3) + rng.uniform(-0.3, 0.3, 3) for _ in range(2)]
    if seed % 2:
        parts += [rng.normal(0.0, 0.1, (30, 3)), np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])]
    shape = collision_shape(ConvexParts(tuple(parts)))
    stored = unpack_shape(pack_shape(shape))

    assert bool(shape.boxes) == (seed % 2 == 0)
    assert stored.boxes == shape.boxes
    assert stored.center_of_mass_m == shape.center_of_mass_m
    assert stored.key == shape.key
    assert [stored.obj(step) for step in (-3, 0, 5)] == [shape.obj(step) for step in (-3, 0, 5)]
