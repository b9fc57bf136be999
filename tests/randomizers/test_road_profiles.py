"""Longitudinal profiles by the rules of road design, and how roads meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core.errors import ConfigError
from gen_data.core.relief import RoadProfile
from gen_data.core.scene import Scene
from gen_data.randomizers.relief import ReliefOfRoads
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.junction import Junction
from gen_data.scene_templates.road import Road
from tests.libraries import library
from tests.randomizers.doubles import rng_of

STOPPING_M = {30: 35, 50: 65, 60: 85, 80: 130, 100: 185, 120: 250}
"""Design stopping sight distance by design speed [km/h]: Green Book, 2011, table 3-1."""
CREST = {30: 2, 50: 7, 60: 11, 80: 26, 100: 52, 120: 95}
SAG = {30: 6, 50: 13, 60: 18, 80: 30, 100: 45, 120: 63}
"""Rates K [m per % of change]: tables 3-34 and 3-36."""


def _street(*elements: Any) -> Scene:
    return build_scene("street", elements, library())


def _profiles(scene: Scene, seed: int, **fields: Any) -> Sequence[RoadProfile]:
    relief = ReliefOfRoads(name="relief", **fields)
    made = relief(scene, library(), rng_of("relief", scene=seed)).relief
    assert made is not None
    return made.roads


def _curves(road: RoadProfile) -> list[tuple[float, float, float]]:
    rows = [road.curves[k : k + 3] for k in (0, 3, 6)]
    return [(start, length, change) for start, length, change in rows if change]


@pytest.mark.parametrize("speed_km_h", STOPPING_M)
def test_vertical_curves_are_as_long_as_the_green_book_asks(speed_km_h: int) -> None:
    """Lengths per percent are the rates K of its tables, which are rounded up to whole metres."""
    road = Road(name="main", length_m=1500, speed_m_s=speed_km_h / 3.6)
    seen = set()
    for seed in range(30):
        (profile,) = _profiles(_street(road), seed, grade=Uniform(-0.06, 0.06))
        for _, length, change in _curves(profile):
            table = (CREST if change < 0.0 else SAG)[speed_km_h]
            rate = length / (100.0 * abs(change))
            if length > 0.6 * speed_km_h + 0.01:
                assert table - 1.1 < rate < table + 0.6
                seen.add(change < 0.0)
            else:
                assert rate > table - 1.1
    assert seen == {True, False}


def test_roads_are_level_at_a_junction_and_have_its_height() -> None:
    """The last and the first 10 m of four roads."""
    after = {"on": "cross/0", "left": "cross/1", "right": "cross/3"}
    scene = _street(
        Road(name="main", at_m=(-150.0, 0.0), length_m=150),
        Junction(name="cross", after="main", arms_deg=(0.0, 90.0, 180.0, 270.0)),
        *(Road(name=name, after=place, length_m=120) for name, place in after.items()),
    )
    for seed in range(10):
        main, *others = _profiles(scene, seed, grade=Uniform(-0.12, 0.12))
        end = main.height(np.linspace(140.0, 150.0, 5))
        np.testing.assert_allclose(end, end[-1], atol=0.005)
        for road in others:
            start = road.height(np.linspace(0.0, 10.0, 5))
            np.testing.assert_allclose(start, end[-1], atol=0.005)


def test_a_road_goes_on_at_the_height_and_grade_at_which_the_one_before_ended() -> None:
    """Without a junction between them, and wherever the first one starts."""
    scene = _street(
        Road(name="main", at_m=(-120.3, 7.7), yaw_deg=33.0, length_m=150, curvature_per_m=0.004),
        Road(name="on", after="main", length_m=90),
    )
    for seed in range(10):
        main, on = _profiles(scene, seed, grade=Uniform(-0.12, 0.12))
        assert on.start_m == pytest.approx(main.height(np.array([150.0]))[0], abs=1e-3)
        assert on.grade == pytest.approx(main.slope(150.0), abs=2e-4)


def test_no_road_is_steeper_than_the_steepest_grade() -> None:
    """Drawn grades of up to 12 % are cut to 5 %."""
    scene = _street(Road(name="main", length_m=400))
    for seed in range(10):
        (road,) = _profiles(scene, seed, grade=Uniform(-0.12, 0.12), grade_max=0.05)
        slopes = [road.slope(float(s)) for s in np.linspace(0.0, 400.0, 200)]
        assert max(map(abs, slopes)) <= 0.05 + 2e-4


def test_a_road_too_short_for_its_speed_still_ends_level() -> None:
    """30 m at 100 km/h between a slope and a junction."""
    scene = _street(
        Road(name="main", length_m=100, speed_m_s=27.8),
        Road(name="short", after="main", length_m=30, speed_m_s=27.8),
        Junction(name="cross", after="short"),
    )
    for seed in range(5):
        _, short = _profiles(scene, seed, grade=Constant(0.08), side_slope=Constant(0.0))
        assert abs(short.slope(30.0)) < 5e-4
        assert math.isfinite(float(short.height(np.array([30.0]))[0]))


def test_a_ring_of_roads_is_refused() -> None:
    """Two halves of a circle."""
    half_m = math.pi * 50.0
    scene = _street(
        Road(name="one", length_m=half_m, curvature_per_m=0.02),
        Road(name="other", after="one", length_m=half_m, curvature_per_m=0.02),
    )
    with pytest.raises(ConfigError, match="the road 'other' closes a ring of roads"):
        _profiles(scene, 0)
