"""Lines at the sides of lanes."""

import numpy as np
import pytest

from gen_data.core.lane_geometry import LaneBorder, border_line, lane_borders
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3
from gen_data.roads.cross_section import RoadShape, height_m
from gen_data.roads.lane_graph import road_lanes


def road(**given: object) -> tuple[Lane, ...]:
    return road_lanes(RoadShape(**given), "main", SE3(), 10.0)  # type: ignore[arg-type]


def offsets(borders: tuple[LaneBorder, ...]) -> dict[str, list[float]]:
    """By kind, how far borders of a straight road are to the left of its middle, sorted."""
    found: dict[str, list[float]] = {"lane": [], "road": [], "edge": []}
    for border in borders:
        found[border.kind].append(border.points_m[0][1])
    return {kind: sorted(values) for kind, values in found.items()}


@pytest.mark.parametrize("traffic", ["right", "left"])
def test_each_border_is_listed_once_and_knows_what_it_parts(traffic: str) -> None:
    """Two lanes of 3 m against, one along: -3 | 0 | 3 | 6, whatever side is driven on."""
    lanes = (2.0, 1.0) if traffic == "right" else (1.0, 2.0)
    found = offsets(lane_borders(road(lanes=lanes, lane_width_m=3.0, traffic=traffic)))

    assert found == {"road": [0.0], "lane": [3.0], "edge": [-3.0, 6.0]}


def test_a_median_parts_two_edges_and_junctions_and_paths_have_no_borders() -> None:
    """Nothing drives on a median: its sides are edges. Paths of junctions cross each other."""
    found = offsets(lane_borders(road(lanes=(1.0, 1.0), lane_width_m=3.0, median_m=2.0)))

    assert found == {"road": [], "lane": [], "edge": [-4.0, -1.0, 1.0, 4.0]}

    line = ((0.0, 0.0, 0.0), (9.0, 0.0, 0.0))
    lanes = (Lane("turn", "driving", line, 3.0, junction=True), Lane("path", "sidewalk", line, 3.0))

    assert lane_borders(lanes) == ()
    assert len(lane_borders((Lane("a", "driving", line, 3.0),))) == 2


@pytest.mark.parametrize("traffic", ["right", "left"])
def test_borders_lie_on_the_crowned_surface(traffic: str) -> None:
    """At the heights that the cross section has there."""
    given = {"lanes": (2.0, 2.0), "crown": 0.025, "traffic": traffic}
    shape = RoadShape(**given)  # type: ignore[arg-type]

    for border in lane_borders(road(**given)):
        points = np.array(border.points_m)
        np.testing.assert_allclose(points[:, 2], height_m(shape, points[:, 1]), atol=1e-6)


def test_borders_of_a_bend_are_parallel_to_it() -> None:
    """A radius of 100 m to the left; the circle's centre is at y = 100. Ends to 2 cm."""
    lanes = road(curvature_per_m=0.01, length_m=120.0, lanes=(1.0, 1.0), lane_width_m=3.5)
    for border in lane_borders(lanes):
        points = np.array(border.points_m)
        radius = np.hypot(points[:, 0], points[:, 1] - 100.0)
        nearest = min((96.5, 100.0, 103.5), key=lambda r: abs(r - radius[5]))

        np.testing.assert_allclose(radius[1:-1], nearest, atol=1e-4)
        np.testing.assert_allclose(radius, nearest, atol=0.02)


def test_sides_are_seen_in_the_direction_of_travel() -> None:
    """A lane that runs along -Y has its left in +X."""
    lane = Lane("l", "driving", ((0.0, 0.0, 1.0), (0.0, -10.0, 1.0)), 4.0, bank=0.05)

    assert border_line(lane, "left") == ((2.0, 0.0, 1.1), (2.0, -10.0, 1.1))
    assert border_line(lane, "right") == ((-2.0, 0.0, 0.9), (-2.0, -10.0, 0.9))
