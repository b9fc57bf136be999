"""Fit of a laser scanner to scans."""

from collections.abc import Mapping, Sequence

import numpy as np

from gen_data.core.se3 import Array
from gen_data.lab.matching import descriptions, recordings, results
from gen_data.lab.matching.indirect_inference import Estimate, fit, trimmed_mean
from gen_data.lab.matching.quantities import LIDAR, LidarQuantity, base, lidar_range
from gen_data.lab.matching.quantities.dark_returns import DARK_RETURNS, LEAST
from gen_data.lab.matching.simulation import Illumination, measure_illuminations, rescan
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from gen_data.sensors.lidar.scan_pattern import LidarModel


def fit_lidar(
    illuminations: Sequence[Illumination], scans: Sequence[recordings.Scan], sensor: int
) -> results.Part:
    """Fit a laser scanner.

    Args:
        illuminations: Scenes of the configuration.
        scans: Real scans.
        sensor: Position of the scanner among the sensors.
    """
    if not illuminations or not scans:
        return results.Part(results.not_fitted(LIDAR, "no laser scanner" if scans else "no scans"))
    scanner = illuminations[0].sensor
    if scanner.ideal:
        return results.Part(results.not_fitted(LIDAR, "the scanner is ideal"))
    real = np.array([[quantity.measure(scan) for quantity in LIDAR] for scan in scans])
    axes = [quantity.axis for quantity in LIDAR]
    own = np.array([quantity.start(scanner) for quantity in LIDAR])

    def simulate(positions: Sequence[int], coordinates: Array, count: int) -> Array:
        quantities = [LIDAR[k] for k in positions]
        return measure_illuminations(illuminations, quantities, coordinates, count)

    reports = scanner.device.response is not None
    used = [k for k, quantity in enumerate(LIDAR) if reports or quantity is not DARK_RETURNS]
    estimates = fit(real, simulate, axes, _start(own, trimmed_mean(real)), used)
    found = {LIDAR[k]: one for k, one in estimates.items()}
    rows = tuple(
        _row(quantity, found.get(quantity), float(before))
        for quantity, before in zip(LIDAR, own, strict=True)
    )
    statistics = _compare(illuminations, scans, found)
    return results.Part(rows, statistics, _fields(_with(scanner, found), rows, sensor))


def _row(quantity: LidarQuantity, found: Estimate | None, before: float) -> results.FittedQuantity:
    if found is None:
        (row,) = results.not_fitted(
            [quantity], "the data sheet has no response: no point has intensity 0"
        )
        return row
    value = base.round_digits(quantity.to_value(found.mean))
    return results.fitted_quantity(quantity, found, before, value, quantity.path)


def _start(own: Array, real: Array) -> Array:
    """First parameters: limits show only if they are near the recorded values."""
    start: Array = own.copy()
    reach, dark = LIDAR.index(lidar_range.RANGE), LIDAR.index(DARK_RETURNS)
    start[reach] = min(own[reach], real[reach] + 0.5 * lidar_range.RANGE.axis.step)
    start[dark] = max(own[dark], LEAST)
    return start


def _with(sensor: LidarSensor, found: Mapping[LidarQuantity, Estimate]) -> LidarSensor:
    for quantity, one in found.items():
        if one.determined:
            sensor = quantity.apply(sensor, one.mean)
    return sensor


def _fields(
    fitted: LidarSensor, rows: Sequence[results.FittedQuantity], sensor: int
) -> tuple[results.FittedField, ...]:
    """Changed fields; a data sheet is written whole, as its name stands for all of its values."""
    made = []
    for key in dict.fromkeys(quantity.key for quantity in LIDAR):
        stated = tuple(row for row in rows if row.is_fitted and row.path.partition(".")[0] == key)
        if stated:
            value = getattr(fitted, key)
            if isinstance(value, LidarModel):
                value = value.model_dump(mode="json", exclude_defaults=True)
            made.append(
                results.FittedField(base.FieldChange("sensors", sensor, key, value), stated)
            )
    return tuple(made)


def _compare(
    illuminations: Sequence[Illumination],
    scans: Sequence[recordings.Scan],
    found: Mapping[LidarQuantity, Estimate],
) -> tuple[results.ComparedStatistic, ...]:
    before = [rescan(one, one.sensor) for one in illuminations]
    after = [rescan(one, _with(one.sensor, found)) for one in illuminations]
    measures = [*((q.statistic, q.measure) for q in LIDAR), *descriptions.SCANS]
    return tuple(
        results.ComparedStatistic(
            name, *(np.array([measure(scan) for scan in group]) for group in (scans, before, after))
        )
        for name, measure in measures
    )
