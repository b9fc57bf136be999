"""How often images and scans of a data set arrive, and how late, if faults of delivery are set."""

from collections import defaultdict
from collections.abc import Iterator

from gen_data.core import reported
from gen_data.core.capture import PointCloud, SensorReading
from gen_data.report.report_tables import NOTHING, Table
from gen_data.runner.stored import StoredSamples

IN_TIME = (1, 0.0)
"""Arrivals and lateness [s] of a reading without a fault."""


def delivery_tables(stored: StoredSamples) -> Iterator[Table]:
    """A row per camera and scanner of which a reading is lost, doubled or late.

    Raises:
        StorageError: a file of a sample is missing or damaged.
    """
    if not any((s.get("faults") or {}).get("delivery") for s in stored.config.get("sensors", ())):
        return
    found: dict[str, list[tuple[int, float]]] = defaultdict(list)
    for index in stored.indices:
        capture = stored.labelled(index, has_points=False).capture
        arriving: dict[str, SensorReading | PointCloud] = {**capture.readings, **capture.clouds}
        for name, reading in arriving.items():
            late_s = reported.arrived_s(reading) - reading.time_s
            found[name].append((reported.copies(reading), late_s))
    rows = tuple(_row(name, own) for name, own in sorted(found.items()) if set(own) != {IN_TIME})
    if rows:
        header = ("sensor", "readings", "lost", "doubled", "late, mean", "late, most")
        note = "Exports have the readings that arrive; the data set has all of them, with labels."
        yield Table("Delivery", header, rows, note)


def _row(name: str, deliveries: list[tuple[int, float]]) -> tuple[str, ...]:
    counts = [copies for copies, _ in deliveries]
    late_ms = [1000.0 * late_s for copies, late_s in deliveries if copies]
    times = (sum(late_ms) / len(late_ms), max(late_ms)) if late_ms else ()
    shown = [f"{ms:.1f} ms" for ms in times] or [NOTHING] * 2
    return (name, str(len(counts)), str(counts.count(0)), str(counts.count(2)), *shown)
