"""Faults that any sensor may have: a wrong clock."""

from dataclasses import replace
from typing import Annotated, Any, TypeVar

import numpy as np

from gen_data.config.base_model import Strict
from gen_data.config.distributions import Bounds, Constant, Scalar
from gen_data.core.capture import Measurements, PointCloud, SensorReading
from gen_data.core.interfaces import Sensor
from gen_data.core.measurement_dtypes import TIME_DECIMALS
from gen_data.core.reported import CLOCK
from gen_data.core.streams import Rng

Reading = TypeVar("Reading", bound=SensorReading | PointCloud | Measurements)
NONE = Constant(0.0)


class Clock(Strict):
    """A wrong clock. True instants and stamps count from the beginning of the sequence.

    A reading at the true instant ``t`` has the stamp ``t + offset_s + 1e-6 drift_ppm t``, plus
    jitter. Stamps within one reading keep their order.

    Attributes:
        offset_s: Error at the beginning, drawn once per sequence; stamps with a positive one are
            too late.
        drift_ppm: Error of the clock's rate, drawn once per sequence: microseconds per second.
        jitter_s: Standard deviation of a normal error of each stamp.
    """

    offset_s: Annotated[Scalar, Bounds(-60, 60)] = NONE
    drift_ppm: Annotated[Scalar, Bounds(-100_000, 100_000)] = NONE
    jitter_s: Annotated[Scalar, Bounds(0, 10)] = NONE

    def stamp(self, reading: Reading, rng: Rng) -> Reading:
        """The reading with its record, and with the reported instants in the rows of a table.

        The record has ``offset_s``, ``drift_ppm`` and ``reported_s``, the stamp of the reading; of
        tables with jitter also ``true_s``, the true instant of each row.
        """
        own = rng.streams.rng(f"{rng.name}/faults/clock")
        shared = own.of_sequence()
        fields = (self.offset_s, self.drift_ppm, self.jitter_s)
        offset_s, drift_ppm, jitter_s = (round(float(f.draw(shared)), 9) for f in fields)
        if not (offset_s or drift_ppm or jitter_s):
            return reading
        rows_s = reading.rows["time_s"] if isinstance(reading, Measurements) else np.zeros(0)
        # Equal instants have equal stamps: all detections of a radar's scan, for instance.
        times_s, place = np.unique(np.append(rows_s, reading.time_s), return_inverse=True)
        stamps_s = times_s + offset_s + 1e-6 * drift_ppm * times_s
        if jitter_s:
            stamps_s += jitter_s * own.standard_normal(len(stamps_s))
            stamps_s = np.maximum.accumulate(stamps_s)
        *row_stamps_s, stamp_s = np.round(stamps_s, TIME_DECIMALS)[place.ravel()].tolist()
        record: dict[str, Any] = {
            "offset_s": offset_s,
            "drift_ppm": drift_ppm,
            "reported_s": stamp_s,
        }
        changes: dict[str, Any] = {"faults": {**reading.faults, CLOCK: record}}
        if isinstance(reading, Measurements):
            if jitter_s:
                record["true_s"] = rows_s.tolist()
            changes["rows"] = reading.rows.copy()
            changes["rows"]["time_s"] = row_stamps_s
        return replace(reading, **changes)


class SensorFaults(Strict):
    """Faults that any sensor may have.

    Attributes:
        clock: A wrong clock; null = a true one.
    """

    clock: Clock | None = None


def deliver(sensor: Sensor, reading: Reading, rng: Rng) -> Reading:
    """The reading as a sensor with its ``faults`` reports it; ``rng`` is its stream at the step."""
    faults = getattr(sensor, "faults", None)
    if not isinstance(faults, SensorFaults) or faults.clock is None:
        return reading
    return faults.clock.stamp(reading, rng)
