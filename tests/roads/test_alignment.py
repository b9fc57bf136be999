"""Bends of roads: arcs between clothoids, by guidelines; values by tables, Fresnel and by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import fresnel

from gen_data.core.errors import ConfigError
from gen_data.roads import alignment
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.road import Bend, Road
from tests.libraries import library

KM_H = 1.0 / 3.6


@pytest.mark.parametrize(
    ("radius_m", "speed_km_h", "length_m"),
    [
        (60.0, 30.0, 20.0**2 / 60.0),     # A = R / 3
        (80.0, 50.0, 50.0**2 / 80.0),     # RASt 06: A = 50 m at 50 km/h
        (190.0, 70.0, 90.0**2 / 190.0),   # RASt 06: A = 90 m at 70 km/h
        (470.0, 120.0, 160.0**2 / 470.0), # RAA, EKA 2: A = 160 m
        (900.0, 120.0, 100.0),            # R / 3 = 300 m, which RAA asks for in EKA 1 A
        (40.0, 50.0, 40.0),               # never A > R
    ],
)  # fmt: skip
def test_clothoids_are_the_shortest_ones_of_the_guidelines(
    radius_m: float, speed_km_h: float, length_m: float
) -> None:
    """Lengths are A^2 / R."""
    assert alignment.spiral_m(radius_m, speed_km_h * KM_H) == pytest.approx(length_m)


@pytest.mark.parametrize(
    ("radius_m", "speed_km_h", "bank"),
    [
        (100.0, 50.0, 0.0),
        (150.0, 70.0, 0.06),
        (190.0, 70.0, 0.06),
        (math.sqrt(190.0 * 700.0), 70.0, math.sqrt(0.06 * 0.025)),
        (699.99, 70.0, 0.025),
        (700.0, 70.0, 0.0),
        (470.0, 120.0, 0.06),
        (4000.0, 120.0, 0.0),
    ],
)
def test_cross_slopes_of_bends_fall_with_the_radius(
    radius_m: float, speed_km_h: float, bank: float
) -> None:
    """From 6 % at the smallest radius to 2.5 %: geometric means belong to each other."""
    assert alignment.bank(radius_m, speed_km_h * KM_H) == pytest.approx(bank, abs=1e-5)


def test_a_bend_is_two_clothoids_with_an_arc_between_them() -> None:
    """R = 90 m, 30 km/h, 1 rad: the first clothoid ends where Fresnel's integrals do."""
    bends = alignment.lay_out(200.0, [(90.0, 1.0)], 30.0 * KM_H)
    start, spiral, arc, curvature = bends
    assert (spiral, arc, curvature) == pytest.approx((10.0, 80.0, 1.0 / 90.0), abs=1e-3)
    assert start + spiral + 0.5 * arc == pytest.approx(100.0, abs=1e-3)
    line = alignment.bent_line(200.0, 0.0, bends)
    scale = math.sqrt(math.pi * 90.0 * spiral)
    sine, cosine = fresnel(spiral / scale)
    x, y, heading = line.poses(np.array([start + spiral]))[0]
    assert (x - start, y) == pytest.approx((scale * cosine, scale * sine), abs=1e-6)
    assert heading == pytest.approx(spiral / 180.0, abs=1e-6)
    assert line.poses(np.array([200.0]))[0, 2] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("turns", [[(60.0, 0.9), (-60.0, 0.9)], [(-40.0, 3.0)], [(300.0, 0.2)] * 3])
def test_curvature_is_continuous_and_ends_are_straight(turns: list[tuple[float, float]]) -> None:
    """Headings of points 10 mm apart; the first and last 12 m lead straight on."""
    line = alignment.bent_line(150.0, 0.0, alignment.lay_out(150.0, turns, 8.3))
    s = np.linspace(0.0, 150.0, 15_001)
    x, y, heading = line.poses(s).T
    curvature = np.gradient(heading, s)
    assert np.abs(np.diff(curvature)).max() < 0.01 * 9.0 * max(1.0 / r**2 for r, _ in turns) + 1e-6
    assert np.ptp(heading[s <= 12.0]) == np.ptp(heading[s >= 138.001]) == 0.0
    np.testing.assert_allclose(np.hypot(np.diff(x), np.diff(y)), 0.01, rtol=1e-6)


def test_a_bend_turns_less_where_its_share_of_the_road_is_too_short() -> None:
    """66 m of 90 m are left: two clothoids of 40 / 9 m and an arc, together 61.56 m / 40 m."""
    line = alignment.bent_line(90.0, 0.0, alignment.lay_out(90.0, [(40.0, 2.5)], 8.3))
    assert line.poses(np.array([90.0]))[0, 2] == pytest.approx((66.0 - 40.0 / 9.0) / 40.0, abs=1e-3)
    assert alignment.lay_out(24.0, [(40.0, 1.0)], 8.3) == ()


def test_lanes_of_a_road_follow_its_bends() -> None:
    """Points of the lane 1.75 m to the right of the reference line are beside it, to 1 mm."""
    bend = Bend(to="right", radius_m=50, turn_deg=60)
    road = Road(name="main", length_m=120, speed_m_s=8.3, bends=(bend,))
    scene = build_scene("street", [road], library())
    lane = next(one for one in scene.lanes if one.name == "main/forward0")
    line = road.shape().line()
    s = np.linspace(0.0, 120.0, 6001)
    away = np.hypot(*(np.array(lane.center_m)[:, None, :2] - line.poses(s)[None, :, :2]).T)
    np.testing.assert_allclose(away.min(axis=0), 1.75, atol=1e-3)
    turned = np.diff(np.array(lane.center_m)[[-2, -1], :2], axis=0)[0]
    assert math.degrees(math.atan2(turned[1], turned[0])) == pytest.approx(-60.0, abs=0.01)


def test_guard_rails_stand_outside_of_bends() -> None:
    """Of a bend to the left, on the right: steel along 80.9 m, none on the other side."""
    road = Road(
        name="main", length_m=150, speed_m_s=8.3, bends=(Bend(radius_m=100, turn_deg=40),),
        rails=("bends", "bends"),
    )  # fmt: skip
    scene = build_scene("street", [road], library())
    mesh = library().mesh(scene.body("main").asset)
    points = mesh.vertices_m[mesh.vertices_m[:, 2] > 0.6]
    line = road.shape().line().poses(np.linspace(0.0, 150.0, 1501))
    k = np.hypot(*(points[:, None, :2] - line[None, :, :2]).T).argmin(axis=0)
    ahead = np.column_stack([np.cos(line[k, 2]), np.sin(line[k, 2])])
    delta = points[:, :2] - line[k, :2]
    left = ahead[:, 0] * delta[:, 1] - ahead[:, 1] * delta[:, 0]
    assert (left < -3.9).all()
    assert np.ptp(0.1 * k) == pytest.approx(math.radians(40.0) * 100.0 + 100.0 / 9.0, abs=0.3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"bends": (Bend(radius_m=15, turn_deg=40),), "setback_m": (20, 20)},
            "main.bends: a radius",
        ),
        ({"bends": (Bend(radius_m=40, turn_deg=150),) * 3, "length_m": 600}, "closes on itself"),
    ],
)
def test_impossible_bends_are_refused(given: dict[str, Any], message: str) -> None:
    """By the name of their field."""
    with pytest.raises(ConfigError, match=message):
        Road(name="main", **given).shape()
