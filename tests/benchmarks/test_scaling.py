"""Simulated runs, against timetables made by hand."""

import pytest

from benchmarks.scaling import Costs, format_forecasts, simulate

COSTS = Costs(
    plan_s=1.0, start_s=2.0, sample_s=1.0, shard_size=10, sample_bytes=100.0, driver_s=1.0,
    merge_s=0.1,
)  # fmt: skip


def test_a_run_of_four_shards_by_two_workers_has_the_timetable_made_by_hand() -> None:
    """Ten seconds to make a shard, five to store it, one to report it.

    Worker A: makes 3-13, stores 13-18, reports 18-19; makes 19-29, stores 29-34, reports 34-35.
    Worker B: makes 3-13, stores 18-23, reports 23-24; makes 24-34, stores 34-39, reports 39-40.
    Merging of 40 samples takes 4 s.
    """
    found = simulate(COSTS, samples=40, workers=2, bytes_per_s=200.0)

    assert found.seconds == pytest.approx(44.0)
    assert found.samples_per_s == pytest.approx(40 / 44)
    assert found.shares == pytest.approx(
        {"workers": 20 / 44, "storage": 20 / 44, "driver": 4 / 44, "plan and merging": 5 / 44}
    )


def test_one_worker_does_everything_in_turn() -> None:
    found = simulate(COSTS, samples=40, workers=1, bytes_per_s=200.0)

    assert found.seconds == pytest.approx(1 + 2 + 4 * (10 + 5 + 1) + 4)
    assert found.limit == "workers"


def test_more_workers_than_shards_make_nothing_faster() -> None:
    """All four shards are made at once and stored in turn: 3 + 10 + 4 * 5 + 1 + 4 s."""
    few, many = (simulate(COSTS, 40, workers, 200.0) for workers in (4, 1000))

    assert few.seconds == many.seconds == pytest.approx(38.0)
    assert many.limit == "storage"


@pytest.mark.parametrize(
    ("workers", "bytes_per_s", "merge_s", "limit"),
    [
        (10, 1e9, 0.0001, "workers"),
        (1000, 1000.0, 0.0001, "storage"),
        (1000, 1e9, 0.0001, "driver"),
        (1000, 1e9, 1.0, "plan and merging"),
    ],
)
def test_the_limit_is_the_part_that_works_longest(
    workers: int, bytes_per_s: float, merge_s: float, limit: str
) -> None:
    """10,000 samples: 10,000 s of making by all workers, and 1,000 s of reports, 1 s per shard."""
    costs = Costs(1.0, 2.0, 1.0, 10, 100.0, 1.0, merge_s)

    assert simulate(costs, 10_000, workers, bytes_per_s).limit == limit


def test_the_table_has_a_row_for_each_number_of_workers() -> None:
    rows = format_forecasts(COSTS, 40, 200.0).splitlines()

    assert rows[2] == "| 1 | 1 | 0.0 | 56 % | 28 % | 6 % | 7 % | workers |"
    assert rows[3] == "| 2 | 1 | 0.0 | 45 % | 45 % | 9 % | 11 % | workers |"
    assert [row.split(" | ")[0] for row in rows[2:]] == [
        f"| {count}" for count in (1, 2, 4, 8, 16, 64, 256, 1000)
    ]
