"""Shape and lanes of car parks."""

from dataclasses import dataclass

import numpy as np

from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3
from gen_data.roads.lane_graph import world_points

EDGE_M = 0.6
"""Asphalt beyond the outermost lines."""
_SPEED_M_S = 2.8


@dataclass(frozen=True, slots=True)
class ParkingShape:
    """Bays at right angles to aisles that run along X.

    Attributes:
        bays: Number of bays per row.
        aisles: Number of aisles, each with a row of bays on both sides.
        bay_m: Width and length of a bay (RAR, by sicherestrassen.de: 2.50 m x 5.00 m).
        aisle_m: Width of an aisle (same source: 6.00 m for bays at right angles).
    """

    bays: int = 10
    aisles: int = 1
    bay_m: tuple[float, float] = (2.5, 5.0)
    aisle_m: float = 6.0

    @property
    def length_m(self) -> float:
        """Extent along the aisles."""
        return self.bays * self.bay_m[0]

    @property
    def module_m(self) -> float:
        """Extent across an aisle and its two rows."""
        return self.aisle_m + 2.0 * self.bay_m[1]

    @property
    def width_m(self) -> float:
        """Extent across all aisles."""
        return self.aisles * self.module_m

    def aisle_y_m(self, number: int) -> float:
        """Y coordinate of an aisle's middle."""
        return (number + 0.5) * self.module_m - 0.5 * self.width_m


def parking_lanes(shape: ParkingShape, name: str, T_world_area: SE3) -> tuple[Lane, ...]:
    """Make a lane per bay, from the aisle inwards, and two along each aisle."""
    lanes: list[Lane] = []
    for number in range(shape.aisles):
        y = shape.aisle_y_m(number)
        for word, way in (("forward", 1.0), ("backward", -1.0)):
            x = way * np.linspace(-0.5 * shape.length_m, 0.5 * shape.length_m, 2)
            offset = np.full(2, y - way * 0.25 * shape.aisle_m)
            center = world_points(np.column_stack([x, offset, np.zeros(2)]), T_world_area)
            lane = Lane(
                f"{name}/{word}{number}", "driving", center, 0.5 * shape.aisle_m,
                road=name, speed_m_s=_SPEED_M_S,
            )  # fmt: skip
            lanes.append(lane)
        for side in (1.0, -1.0):
            near = y + side * 0.5 * shape.aisle_m
            for bay in range(shape.bays):
                x_m = (bay + 0.5) * shape.bay_m[0] - 0.5 * shape.length_m
                ends = np.array([[x_m, near, 0.0], [x_m, near + side * shape.bay_m[1], 0.0]])
                row = 2 * number + (side > 0)
                center = world_points(ends, T_world_area)
                lanes.append(
                    Lane(f"{name}/bay{row}_{bay}", "parking", center, shape.bay_m[0], road=name)
                )
    return tuple(lanes)
