"""Horizons: where the pieces stand, and that they are reproducible background."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from gen_data.assets.library import Library
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.scene_templates.horizon import Horizon, convex_outline, offset_outline
from gen_data.scene_templates.road import Road


@pytest.fixture(scope="module")
def street(library: Library) -> Scene:
    scene = Road(name="main", length_m=120.0).add(Scene(template="test"), library)
    return Road(name="side", at_m=(60.0, 10.0), yaw_deg=70.0, length_m=80.0).add(scene, library)


def lane_points(scene: Scene) -> np.ndarray:
    return np.concatenate([np.array(lane.center_m)[:, :2] for lane in scene.lanes])


def test_every_piece_keeps_its_distance_from_every_lane(street: Scene, library: Library) -> None:
    """Bounds of the pieces, and not only their origins, stay away from the roads."""
    made = Horizon(kinds=("trees", "forest"), distance_m=60.0, coverage=1.0).add(street, library)
    pieces = made.bodies[len(street.bodies) :]
    lanes = lane_points(street)

    assert len(pieces) > 30
    assert made.instances == street.instances
    for body in pieces:
        (x0, y0, _), (x1, y1, _) = library.bounds_m(body.asset)
        grid = [(x, y, 0.0) for x in np.linspace(x0, x1, 3) for y in np.linspace(y0, y1, 9)]
        points = body.T_world_body.apply(np.array(grid))[:, :2]
        gaps = np.sqrt(((points[:, None] - lanes[None]) ** 2).sum(axis=2))
        assert gaps.min() > 45.0


def test_pieces_face_the_roads_and_fill_the_whole_circle(street: Scene, library: Library) -> None:
    """The front (+X) of every piece points inwards; no direction is left empty."""
    made = Horizon(kinds=("hills",)).add(street, library)
    centre = lane_points(street).mean(axis=0)
    bearings = []
    for body in made.bodies[len(street.bodies) :]:
        place = np.array(body.T_world_body.translation_m)[:2]
        front = body.T_world_body.apply(np.array([[1.0, 0.0, 0.0]]))[0, :2] - place
        assert float(front @ (centre - place)) > 0.0
        bearings.append(math.degrees(math.atan2(*(place - centre)[::-1])) % 360.0)

    ordered = np.sort(bearings)
    assert np.diff([*ordered, ordered[0] + 360.0]).max() < 60.0


def test_arcs_limit_the_ring_and_the_seed_moves_pieces(street: Scene, library: Library) -> None:
    """Half a ring has about half of the pieces; the same seed gives the same scene."""
    whole, again, other = (
        Horizon(kinds=("trees",), coverage=1.0, seed=seed).add(street, library).bodies
        for seed in (1, 1, 2)
    )
    half = Horizon(kinds=("trees",), coverage=1.0, seed=1, arcs_deg=((-90.0, 90.0),))
    count = len(half.add(street, library).bodies) - len(street.bodies)

    assert whole == again
    assert whole != other
    assert count == pytest.approx(0.5 * (len(whole) - len(street.bodies)), rel=0.25)


def test_a_scene_without_roads_is_refused(library: Library) -> None:
    with pytest.raises(ConfigError, match="no lane to surround"):
        Horizon().add(Scene(template="test"), library)
    with pytest.raises(ValidationError, match="distance_m"):
        Horizon(distance_m=5.0)


def test_outline_of_a_square_with_a_point_inside() -> None:
    """Andrew's algorithm drops inner points; the offset line is a rounded square."""
    points = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (2.0, 1.0), (2.0, 0.0)])

    hull = convex_outline(points)
    ring = offset_outline(hull, 3.0)

    assert sorted(map(tuple, hull.tolist())) == [(0.0, 0.0), (0.0, 4.0), (4.0, 0.0), (4.0, 4.0)]
    gaps = np.sqrt(((ring[:, None] - hull[None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.allclose(gaps, 3.0)
    steps = np.roll(ring, -1, axis=0) - ring
    area = 0.5 * float((ring[:, 0] * np.roll(ring[:, 1], -1)
                        - ring[:, 1] * np.roll(ring[:, 0], -1)).sum())  # fmt: skip
    # Steiner's formula: area + perimeter * distance + pi * distance^2.
    assert area == pytest.approx(16.0 + 16.0 * 3.0 + math.pi * 9.0, rel=1e-3)
    assert np.sqrt((steps**2).sum(axis=1)).max() < 4.1
