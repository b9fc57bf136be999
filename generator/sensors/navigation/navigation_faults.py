"""Faults of navigation: jumps of GNSS positions, and steps of the biases of an IMU."""

import math
from dataclasses import replace
from typing import Annotated

import numpy as np

from gen_data.config.distributions import Bounds, Constant, NonNegative, Scalar
from gen_data.core.capture import Measurements
from gen_data.core.geodesy import GeodeticOrigin, to_geodetic
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.fault_draws import Rare, fault_stream
from gen_data.sensors.sensor_faults import SensorFaults

PLACES = ("latitude_deg", "longitude_deg", "altitude_m")
LENGTH_SQUARED_MIN = 1e-12


class Jumps(Rare):
    """Jumps of the position, as by reflected signals; reported accuracies do not change.

    Attributes:
        distance_m: Length of a jump, in a level direction.
        lasts_s: Time until the position jumps back.
    """

    distance_m: Annotated[Scalar, Bounds(0, 10_000)] = Constant(10.0)
    lasts_s: NonNegative = Constant(2.0)


class GnssFaults(SensorFaults):
    """Faults of a GNSS receiver.

    Attributes:
        jumps: Jumps of the position; null = none.
    """

    jumps: Jumps | None = None

    def apply(self, fixes: Measurements, rng: Rng) -> Measurements:
        """The fixes with jumps, and their record: begin, end [s], east and north [m] of each."""
        if self.jumps is None or not len(fixes.rows):
            return fixes
        shared = fault_stream(rng).of_sequence()
        rows, jumps = fixes.rows.copy(), []
        times_s = rows["time_s"]
        for begin_s in self.jumps.begin_s(shared, float(times_s[-1])):
            # A stream for each jump: its draws do not depend on the number of jumps.
            own = shared.streams.rng(f"{shared.name}/{begin_s:.6f}")
            turn, length_m = own.uniform(0.0, 2.0 * math.pi), self.jumps.distance_m.draw(own)
            east_m, north_m = length_m * math.cos(turn), length_m * math.sin(turn)
            end_s = float(begin_s) + self.jumps.lasts_s.draw(own)
            wrong = (times_s >= begin_s) & (times_s < end_s) & np.isfinite(rows[PLACES[0]])
            for k in np.flatnonzero(wrong):
                origin = GeodeticOrigin(*(float(rows[name][k]) for name in PLACES))
                moved = to_geodetic(np.array([[east_m, north_m, 0.0]]), origin)[0]
                for name, value in zip(PLACES, np.round(moved, (10, 10, 6)[0]), strict=True):
                    rows[name][k] = value
            if wrong.any():
                jumps.append([float(begin_s), round(end_s, 6), round(east_m, 6), round(north_m, 6)])
        return replace(fixes, rows=rows, faults={"jumps": jumps} if jumps else {})


class BiasSteps(Rare):
    """Steps of the biases of all axes, as by shocks or heat; each stays.

    Attributes:
        force_m_s2: Standard deviation of a step of the accelerometer.
        rate_deg_s: Standard deviation of a step of the gyroscope.
    """

    force_m_s2: float = 0.1
    rate_deg_s: float = 0.2


class ImuFaults(SensorFaults):
    """Faults of an IMU.

    Attributes:
        bias_steps: Steps of its biases; null = none.
    """

    bias_steps: BiasSteps | None = None

    def apply(self, readings: Measurements, axes: tuple[str, ...], rng: Rng) -> Measurements:
        """The readings with steps, and their record: instant [s] and step of each of the axes.

        ``axes`` are the columns of three forces, then of three rates.
        """
        steps = self.bias_steps
        if steps is None or not len(readings.rows):
            return readings
        shared = fault_stream(rng).of_sequence()
        rows, record = readings.rows.copy(), []
        scale = np.repeat([steps.force_m_s2, math.radians(steps.rate_deg_s)], 3)
        for begin_s in steps.begin_s(shared, float(rows["time_s"][-1])):
            own = shared.streams.rng(f"{shared.name}/{begin_s:.6f}")
            step: Array = np.round(scale * own.standard_normal(6), 9)
            later = rows["time_s"] >= begin_s
            for axis, value in zip(axes, step, strict=True):
                rows[axis][later] += value
            record.append([float(begin_s), *step.tolist()])
        return replace(readings, rows=rows, faults={"bias_steps": record} if record else {})
