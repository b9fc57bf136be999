"""Traffic around roundabouts."""

import numpy as np
import pytest

from gen_data.core.se3 import SE3
from gen_data.roads.cross_section import RoadShape
from gen_data.roads.junction_shape import arm_pose
from gen_data.roads.lane_graph import link_lanes, road_lanes
from gen_data.roads.roundabout_shape import RoundaboutShape, roundabout_lanes
from gen_data.traffic.simulation import first_overlap
from tests.traffic.roads import driven


@pytest.mark.parametrize("traffic", ["right", "left"])
def test_cars_from_all_arms_get_around_without_touching(traffic: str) -> None:
    """One car on each of three arms: all leave the roundabout, and no two boxes ever meet."""
    shape = RoundaboutShape((0.0, 120.0, 240.0, -1.0), traffic=traffic)
    road = RoadShape(length_m=150.0, traffic=traffic)
    roads = [
        lane for k in range(3) for lane in road_lanes(road, f"arm{k}", arm_pose(shape, k), 13.9)
    ]
    lanes = link_lanes([*roundabout_lanes(shape, "ring", SE3(), 7.0, False), *roads])
    cars = [(f"arm{k}/backward0", at_m) for k, at_m in enumerate((110.0, 112.0, 118.0))]
    made, motion = driven(lanes, *cars, duration_s=40.0)

    middle = 0.5 * (made.front_m - made.rear_m)
    centres = motion.axle_m[..., :2] + middle[:, None] * motion.ahead
    moving = np.concatenate([centres, motion.ahead], axis=2)
    half = np.stack([0.5 * (made.front_m + made.rear_m), np.full(3, 0.95)], axis=1)
    radius = np.hypot(centres[..., 0], centres[..., 1])

    assert first_overlap(moving, half, np.zeros((0, 4)), np.zeros((0, 2))) is None
    assert (radius.min(axis=0) < 13.0).all()
    assert (radius[-1] > shape.reach_m()).all()
