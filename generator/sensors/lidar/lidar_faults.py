"""Faults of laser scanners: dead beams and blocked parts of the window."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from gen_data.config.base_model import Strict
from gen_data.config.distributions import Bounds, Constant, Count, Scalar
from gen_data.core.capture import PointCloud
from gen_data.core.streams import Rng
from gen_data.sensors.fault_draws import fault_stream
from gen_data.sensors.sensor_faults import SensorFaults


class Blocked(Strict):
    """Parts of the window through which no light passes: mud, tape, ice.

    Attributes:
        count: Number of sectors.
        width_deg: Width of each in azimuth.
    """

    count: Count = Constant(1)
    width_deg: Annotated[Scalar, Bounds(0, 360)] = Constant(20.0)


class LidarFaults(SensorFaults):
    """Faults of scans; a sequence has one scanner, whose faults stay.

    Attributes:
        dead_beams: Number of lasers without returns.
        blocked: Blocked sectors of the window; null = none.
    """

    dead_beams: Count = Constant(0)
    blocked: Blocked | None = None

    def apply(self, cloud: PointCloud, rings: int, rng: Rng) -> PointCloud:
        """The scan without the points that faults take away, and their record.

        ``rings`` is the number of the scanner's lasers, ``rng`` its stream at this step.
        """
        shared = fault_stream(rng).of_sequence()
        count = min(self.dead_beams.draw(shared), rings)
        dead = np.sort(shared.choice(rings, count, replace=False))
        sectors = []
        for _ in range(self.blocked.count.draw(shared) if self.blocked else 0):
            assert self.blocked is not None
            begin_deg = round(float(shared.uniform(-180.0, 180.0)), 3)
            sectors.append((begin_deg, round(float(self.blocked.width_deg.draw(shared)), 3)))
        x, y, _ = cloud.points["position_m"].astype(np.float64).T
        azimuth_deg = np.degrees(np.arctan2(y, x))
        lost = np.isin(cloud.points["ring"], dead)
        for begin_deg, width_deg in sectors:
            lost |= (azimuth_deg - begin_deg) % 360.0 < width_deg
        origins = None if cloud.origins is None else cloud.origins[~lost]
        faults = _record(dead.tolist(), sectors)
        return replace(cloud, points=cloud.points[~lost], origins=origins, faults=faults)


def _record(dead: list[int], sectors: list[tuple[float, float]]) -> Mapping[str, Any]:
    """Rings without points; begin and width of sectors [deg], to the left from straight ahead."""
    record = {"dead_beams": dead, "blocked_deg": [list(sector) for sector in sectors]}
    return {name: value for name, value in record.items() if value}
