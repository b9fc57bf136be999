"""Shape and lanes of car parks.

Straight ones lie along X. In bent ones, aisles and rows are arcs about one centre, and the lines
between bays point at it; each row has as many bays as its inner edge has room for.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.roads.lane_graph import world_points

EDGE_M = 0.6
"""Asphalt beyond the outermost lines."""
INNER_RADIUS_M = 5.0
"""Smallest radius of the inner edge of a bent aisle (M-GarVO, sections 2 and 3)."""
_SPEED_M_S = 2.8
_STEP_M = 1.0
"""Points of bent lanes are this far apart at most, on the middle line."""


@dataclass(frozen=True, slots=True)
class ParkingShape:
    """Bays at right angles to aisles that run along X, or bend with it.

    Places in it are ``x`` along its middle line, from the middle, and ``y`` to the left of that.

    Attributes:
        bays: Number of bays per row.
        aisles: Number of aisles, each with a row of bays on both sides.
        bay_m: Width and length of a bay (RAR, by sicherestrassen.de: 2.50 m x 5.00 m).
        aisle_m: Width of an aisle (same source: 6.00 m for bays at right angles).
        curvature_per_m: Curvature of the middle line, positive to the left; 0 = straight.

    Raises:
        ValueError: the bend is so tight that an edge of an aisle has a radius below 5 m.
    """

    bays: int = 10
    aisles: int = 1
    bay_m: tuple[float, float] = (2.5, 5.0)
    aisle_m: float = 6.0
    curvature_per_m: float = 0.0

    def __post_init__(self) -> None:
        """Refuse bends that cars could not follow, or that would bring both ends together."""
        if self.curvature_per_m == 0.0:
            return
        radius_m = 1.0 / abs(self.curvature_per_m)
        inner_m = radius_m - 0.5 * self.width_m + self.bay_m[1]
        if inner_m < INNER_RADIUS_M or inner_m <= self.bay_m[1] + EDGE_M:
            raise ValueError(
                f"curvature_per_m is {self.curvature_per_m:g}: the inner edge of an aisle would "
                f"have a radius of {inner_m:.1f} m; expected at least {INNER_RADIUS_M:g}, and bays "
                "on both sides"
            )
        if self.length_m * abs(self.curvature_per_m) > 0.9 * math.pi:
            raise ValueError(
                f"curvature_per_m is {self.curvature_per_m:g}: the car park would turn by "
                f"{math.degrees(self.length_m * abs(self.curvature_per_m)):.0f} degrees; expected "
                "at most 162"
            )

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

    def plan(self, x_m: Array | float, y_m: Array | float) -> Array:
        """Points [..., 2] in the frame of the car park at places [...]."""
        x, y = np.broadcast_arrays(np.asarray(x_m, np.float64), np.asarray(y_m, np.float64))
        if self.curvature_per_m == 0.0:
            return np.stack([x, y], axis=-1)
        turn, radius = self.curvature_per_m * x, 1.0 / self.curvature_per_m
        return np.stack(
            [(radius - y) * np.sin(turn), radius - (radius - y) * np.cos(turn)], axis=-1
        )

    def stretch(self, y_m: float) -> float:
        """Length along a line to the left of the middle line, over the length of that."""
        return 1.0 - self.curvature_per_m * y_m

    def row_x_m(self, near_m: float, far_m: float) -> Array:
        """Places [n + 1] on the middle line of the borders of a row of n bays.

        Args:
            near_m: ``y`` of the ends of its bays at the aisle.
            far_m: ``y`` of the other ends.
        """
        if self.curvature_per_m == 0.0:
            count = self.bays
        else:
            narrow = min(self.stretch(near_m), self.stretch(far_m))
            count = max(1, math.floor(self.length_m * narrow / self.bay_m[0] + 1e-6))
        borders: Array = self.length_m * (np.arange(count + 1) / count - 0.5)
        return borders

    def rows(self) -> Iterator[tuple[int, float, float]]:
        """Number of each row of bays, and the ``y`` of its ends at the aisle and away from it."""
        for number in range(self.aisles):
            y = self.aisle_y_m(number)
            for side in (1.0, -1.0):
                near = y + side * 0.5 * self.aisle_m
                yield 2 * number + (side > 0), near, near + side * self.bay_m[1]

    def aisle_y_m(self, number: int) -> float:
        """Y coordinate of an aisle's middle."""
        return (number + 0.5) * self.module_m - 0.5 * self.width_m


def parking_lanes(shape: ParkingShape, name: str, T_world_area: SE3) -> tuple[Lane, ...]:
    """Make a lane per bay, from the aisle inwards, and two along each aisle."""
    lanes: list[Lane] = []
    half_m = 0.5 * shape.length_m
    steps = 1 if shape.curvature_per_m == 0.0 else math.ceil(shape.length_m / _STEP_M)
    rows = tuple(shape.rows())
    for number in range(shape.aisles):
        y = shape.aisle_y_m(number)
        for word, way in (("forward", 1.0), ("backward", -1.0)):
            x = way * np.linspace(-half_m, half_m, steps + 1)
            center = _lifted(shape.plan(x, y - way * 0.25 * shape.aisle_m), T_world_area)
            lane = Lane(
                f"{name}/{word}{number}", "driving", center, 0.5 * shape.aisle_m,
                road=name, speed_m_s=_SPEED_M_S,
            )  # fmt: skip
            lanes.append(lane)
        for row, near, far in rows[2 * number : 2 * number + 2]:
            borders = shape.row_x_m(near, far)
            pitch_m = float(borders[1] - borders[0]) * min(shape.stretch(near), shape.stretch(far))
            for bay, x_m in enumerate(0.5 * (borders[:-1] + borders[1:])):
                center = _lifted(shape.plan(x_m, np.array([near, far])), T_world_area)
                width_m = round(pitch_m, 6)
                lanes.append(Lane(f"{name}/bay{row}_{bay}", "parking", center, width_m, road=name))
    return tuple(lanes)


def _lifted(places: Array, T_world_area: SE3) -> tuple[Vec3, ...]:
    return world_points(np.column_stack([places, np.zeros(len(places))]), T_world_area)
