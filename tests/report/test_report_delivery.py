"""Lost, doubled and late readings in reports."""

from types import SimpleNamespace
from typing import Any

from gen_data.core.capture import Capture
from gen_data.report.delivery_statistics import delivery_tables

LOST, TWICE_LATE, LATE = {"lost": True}, {"doubled": True, "arrived_s": 2.25}, {"arrived_s": 3.125}


def reading(time_s: float, record: Any = None) -> Any:
    return SimpleNamespace(time_s=time_s, faults={"delivery": record} if record else {})


def stored(delivery: Any) -> Any:
    """Four images of a faulty camera, of a sound one, and two scans, of which one is late."""
    records = (None, LOST, TWICE_LATE, None)
    samples = [
        Capture(
            {"left": reading(float(k), record), "right": reading(float(k))},
            {"top": reading(float(k), LATE if k == 3 else None)} if k % 2 else {},
            {},
        )
        for k, record in enumerate(records)
    ]
    return SimpleNamespace(
        config={"sensors": [{"name": "left", "faults": {"delivery": delivery}}, {"name": "right"}]},
        indices=range(4),
        labelled=lambda k, has_points: SimpleNamespace(capture=samples[k]),
    )


def test_reports_count_readings_that_do_not_arrive_once_and_in_time() -> None:
    (table,) = delivery_tables(stored({"lost": 0.2}))

    assert table.title == "Delivery"
    assert table.rows == (
        ("left", "4", "1", "1", "83.3 ms", "250.0 ms"),
        ("top", "2", "0", "0", "62.5 ms", "125.0 ms"),
    )


def test_reports_without_such_faults_have_no_such_table() -> None:
    assert not list(delivery_tables(stored(None)))
