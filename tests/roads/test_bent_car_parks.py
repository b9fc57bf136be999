"""Car parks whose aisles bend, by plane geometry of circles and rays of Embree."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.content.roads.parking_area import parking_area
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Lane, Scene
from gen_data.core.se3 import SE3
from gen_data.roads.parking_shape import ParkingShape, parking_lanes
from gen_data.scene_templates.parking_area import ParkingArea
from tests.embree import RayCaster

RADIUS_M = 50.0
SHAPE = ParkingShape(bays=18, aisles=2, curvature_per_m=1.0 / RADIUS_M)
CENTRE_M: NDArray[np.float64] = np.array([0.0, RADIUS_M])
DOWN = (0.0, 0.0, -1.0)


def _lanes(kind: str) -> list[Lane]:
    return [lane for lane in parking_lanes(SHAPE, "lot", SE3()) if lane.kind == kind]


def _from_centre(lane: Lane) -> NDArray[np.float64]:
    places: NDArray[np.float64] = np.array(lane.center_m, np.float64)
    return places[:, :2] - CENTRE_M


def test_aisles_are_arcs_about_one_centre_in_both_directions() -> None:
    """Aisles of 6 m, 16 m apart: their lanes are 1.5 m to the right of -8 m and 8 m."""
    radii = {}
    for lane in _lanes("driving"):
        away = np.hypot(*_from_centre(lane).T)
        assert np.ptp(away) < 1e-5
        radii[lane.name] = round(float(away[0]), 3)
        turn = np.unwrap(np.arctan2(*_from_centre(lane).T[::-1]))
        expected = 45.0 / RADIUS_M if "forward" in lane.name else -45.0 / RADIUS_M
        assert turn[-1] - turn[0] == pytest.approx(expected, abs=1e-6)
    assert radii == {
        "lot/forward0": 59.5, "lot/backward0": 56.5, "lot/forward1": 43.5, "lot/backward1": 40.5,
    }  # fmt: skip


def test_bays_point_at_the_centre_and_are_at_least_as_wide_as_asked() -> None:
    """Rows have as many bays as their inner edges, of 34, 45, 50 and 61 m radius, have room for."""
    rows: dict[str, list[Lane]] = {}
    for lane in _lanes("parking"):
        start, end = _from_centre(lane)
        assert abs(start[0] * end[1] - start[1] * end[0]) < 1e-3
        assert np.hypot(*(end - start)) == pytest.approx(5.0, abs=1e-5)
        rows.setdefault(lane.name.partition("_")[0], []).append(lane)
    turn = 45.0 / RADIUS_M
    for name, inner_m in (
        ("lot/bay3", 34.0),
        ("lot/bay2", 45.0),
        ("lot/bay1", 50.0),
        ("lot/bay0", 61.0),
    ):
        assert len(rows[name]) == int(turn * inner_m / 2.5)
        for lane in rows[name]:
            assert 2.5 <= lane.width_m < 2.7
        angles = np.sort(
            [np.arctan2(*(_from_centre(lane)[0] * (1.0, -1.0))) for lane in rows[name]]
        )
        np.testing.assert_allclose(np.diff(angles) * inner_m, rows[name][0].width_m, atol=1e-4)


def test_paint_lies_between_bays_and_nowhere_else() -> None:
    """Rays fall onto paint on both sides of every bay, and onto asphalt in its middle."""
    mesh = parking_area(bays=18.0, aisles=2.0, curvature_per_m=1.0 / RADIUS_M).mesh
    caster = RayCaster((mesh.vertices_m, mesh.faces))
    roles = [material.role for material in mesh.materials]

    def met(places: NDArray[np.float64]) -> set[str]:
        above = np.insert(places, 2, 5.0, axis=1)
        hits = caster.cast(above, DOWN)
        assert (hits.mesh == 0).all()
        return {roles[slot] for slot in mesh.face_slots[hits.face].tolist()}

    sides, middles = [], []
    for lane in _lanes("parking"):
        start, end = _from_centre(lane)
        inner_m = min(np.hypot(*start), np.hypot(*end))
        for share in (0.3, 0.7):
            place = start + share * (end - start)
            middles.append(place + CENTRE_M)
            for way in (-1.0, 1.0):
                half = 0.5 * way * lane.width_m / inner_m
                turned = np.array([[np.cos(half), -np.sin(half)], [np.sin(half), np.cos(half)]])
                sides.append(turned @ place + CENTRE_M)
    drive = np.concatenate([np.asarray(lane.center_m)[:, :2] for lane in _lanes("driving")])
    assert met(np.array(sides)) == {"marking"}
    assert met(np.concatenate([middles, drive])) == {"asphalt"}


def test_straight_car_parks_are_bends_of_endless_radius() -> None:
    straight = parking_lanes(ParkingShape(bays=6), "lot", SE3())
    bent = parking_lanes(ParkingShape(bays=6, curvature_per_m=1e-8), "lot", SE3())
    ends = {lane.name: lane for lane in bent}
    for lane in straight:
        np.testing.assert_allclose(lane.center_m[0], ends[lane.name].center_m[0], atol=1e-4)
        np.testing.assert_allclose(lane.center_m[-1], ends[lane.name].center_m[-1], atol=1e-4)


@pytest.mark.parametrize(
    ("element", "fact"),
    [
        (ParkingArea(name="lot", aisles=2, curvature_per_m=0.07), "would have a radius of 3.3 m"),
        (ParkingArea(name="lot", bays=40, curvature_per_m=-0.03), "would turn by 172 degrees"),
    ],
)
def test_bends_that_cars_cannot_follow_are_refused(element: ParkingArea, fact: str) -> None:
    """The message names the field of the element."""
    with pytest.raises(
        ConfigError, match=rf"elements\.lot\.curvature_per_m is .*{re.escape(fact)}"
    ):
        element.add(Scene("lot"), None)  # type: ignore[arg-type]
