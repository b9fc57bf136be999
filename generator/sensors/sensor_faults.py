"""Faults that any sensor may have: of its clock, its calibration, and its line."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.config.distributions import Bounds, Constant, Scalar
from gen_data.core.capture import Measurements, PointCloud, SensorReading
from gen_data.core.interfaces import Sensor
from gen_data.core.measurement_dtypes import TIME_DECIMALS
from gen_data.core.reported import CLOCK, DELIVERY, Mounted, mounted_of
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.core.streams import Rng, Streams

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


class Extrinsics(Strict):
    """An error of the extrinsic calibration: the sensor stays, and its stated pose is wrong.

    Attributes:
        rotation_deg: Angle between true and stated axes, about an axis of any direction; drawn once
            per sequence.
        translation_m: Distance between true and stated origin, in any direction.
    """

    rotation_deg: Annotated[Scalar, Bounds(0, 45)] = NONE
    translation_m: Annotated[Scalar, Bounds(0, 10)] = NONE

    def draw(self, rng: Rng) -> SE3 | None:
        """``T_sensor_reported``; None without an error."""
        half_rad = 0.5 * math.radians(self.rotation_deg.draw(rng))
        length_m = float(self.translation_m.draw(rng))
        if half_rad == 0.0 and length_m == 0.0:
            return None
        axis, towards = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
        turn = (math.cos(half_rad), *(math.sin(half_rad) * axis).tolist())
        return SE3(tuple((length_m * towards).tolist()), turn).rounded(9)


def check_most(field: str, most: float, parts: int, name: str) -> None:
    """Reject a fault of more parts than a sensor has; a distribution without an end is cut there.

    Raises:
        ValueError: the text names the field.
    """
    if parts < most < math.inf:
        raise ValueError(f"{field}: {most:g} is more than the {parts} {name} of the sensor")


class Delivery(Strict):
    """Readings that are lost, doubled or late on their way; each is drawn by itself.

    A reading of a device with several ones in a step is the rows of one instant.

    Attributes:
        lost: Share of readings that do not arrive.
        doubled: Share of the others that arrive twice.
        late_s: Time from a reading to its arrival.
    """

    lost: float = Field(0.0, ge=0, le=1)
    doubled: float = Field(0.0, ge=0, le=1)
    late_s: Annotated[Scalar, Bounds(0, 60)] = NONE

    def draw(self, reading: SensorReading | PointCloud | Measurements, rng: Rng) -> "Delivered":
        """How a reading with true times arrives."""
        own = rng.streams.rng(f"{rng.name}/faults/delivery")
        late_s = round(float(self.late_s.draw(own)), TIME_DECIMALS)
        rows_s = reading.rows["time_s"] if isinstance(reading, Measurements) else np.zeros(0)
        if not len(rows_s):
            rows_s = np.array([reading.time_s])
        times_s, place = np.unique(rows_s, return_inverse=True)
        shares = own.uniform(size=(2, len(times_s)))
        lost = shares[0] < self.lost
        doubled = ~lost & (shares[1] < self.doubled)
        record: dict[str, Any] = {}
        for name, drawn in (("lost", lost), ("doubled", doubled)):
            if drawn.all():
                record[name] = True
            elif drawn.any():
                record[f"{name}_s"] = times_s[drawn].tolist()
        if late_s and not lost.all():
            record["arrived_s"] = round(reading.time_s + late_s, TIME_DECIMALS)
        return Delivered(record, np.where(lost, 0, np.where(doubled, 2, 1))[place.ravel()])


@dataclass(frozen=True, eq=False, slots=True)
class Delivered:
    """How a reading arrives.

    Attributes:
        record: ``lost`` and ``doubled``, if the whole reading is; ``lost_s`` and ``doubled_s``,
            true instants of the rows that are; ``arrived_s``, by a true clock, if it is late.
        copies: How many times each row of a table arrives, from 0.
    """

    record: Mapping[str, Any]
    copies: NDArray[np.int64]

    def of(self, reading: Reading) -> Reading:
        """The reading with its record, and as many rows as arrive."""
        if not self.record:
            return reading
        faults: dict[str, Any] = {**reading.faults, DELIVERY: self.record}
        changes: dict[str, Any] = {"faults": faults}
        if isinstance(reading, Measurements) and len(reading.rows):
            changes["rows"] = np.repeat(reading.rows, self.copies)
            true_s = reading.faults.get(CLOCK, {}).get("true_s")
            if true_s is not None:
                repeated = np.repeat(np.array(true_s), self.copies).tolist()
                faults[CLOCK] = {**reading.faults[CLOCK], "true_s": repeated}
        return replace(reading, **changes)


class SensorFaults(Strict):
    """Faults that any sensor may have.

    Attributes:
        clock: A wrong clock; null = a true one.
        extrinsics: An error of the stated pose; null = none.
        delivery: Lost, doubled and late readings; null = none.
    """

    clock: Clock | None = None
    extrinsics: Extrinsics | None = None
    delivery: Delivery | None = None

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the faults of its readings that may be other than 0, for formats."""
        named = {"clock": self.clock, "extrinsics": self.extrinsics}
        kinds = [name for name, fault in named.items() if fault and _may_differ(fault)]
        if self.delivery is not None:
            kinds += [name for name in ("lost", "doubled") if getattr(self.delivery, name) > 0.0]
        return tuple(kinds)


def _may_differ(fault: Strict) -> bool:
    return any(getattr(fault, name).support() != (0.0, 0.0) for name in type(fault).model_fields)


def faults_of(sensor: Sensor) -> SensorFaults:
    """The faults of a sensor of any package; none if it has no such field."""
    faults = getattr(sensor, "faults", None)
    return faults if isinstance(faults, SensorFaults) else SensorFaults()


def with_calibrations(scene: Scene, sensors: Sequence[Sensor], streams: Streams) -> Scene:
    """The scene with the errors of the calibrations of sensors; ``streams`` are the sequence's."""
    errors = {
        sensor.name: error
        for sensor in sensors
        if (fault := faults_of(sensor).extrinsics) is not None
        and (error := fault.draw(streams.rng(f"sensor/{sensor.name}/faults/extrinsics")))
    }

    def stated(mounted: tuple[Mounted, ...]) -> tuple[Mounted, ...]:
        return tuple(replace(m, T_sensor_reported=errors.get(m.name)) for m in mounted)

    kinds = (scene.cameras, scene.lidars, scene.devices)
    if not errors and all(m.T_sensor_reported is None for kind in kinds for m in kind):
        return scene
    cameras, lidars, devices = stated(scene.cameras), stated(scene.lidars), stated(scene.devices)
    return replace(scene, cameras=cameras, lidars=lidars, devices=devices)


def deliver(sensor: Sensor, reading: Reading, rng: Rng) -> Reading:
    """The reading as a sensor with its ``faults`` reports it; ``rng`` is its stream at the step."""
    faults, error = faults_of(sensor), mounted_of(reading).T_sensor_reported
    arrival = None if faults.delivery is None else faults.delivery.draw(reading, rng)
    if error is not None:
        w, *xyz = error.quaternion_wxyz
        record = {
            "rotation_deg": round(math.degrees(2.0 * math.atan2(math.hypot(*xyz), abs(w))), 9),
            "translation_m": round(math.hypot(*error.translation_m), 9),
            "T_sensor_reported": error.matrix().tolist(),
        }
        changes: dict[str, Any] = {"faults": {**reading.faults, "extrinsics": record}}
        reading = replace(reading, **changes)
    reading = reading if faults.clock is None else faults.clock.stamp(reading, rng)
    return reading if arrival is None else arrival.of(reading)
