"""Hours and money of a run from measured means."""

from pathlib import Path

from gen_data.cli.cost_estimate import Prices, Probe, estimate_rows
from tests.end_to_end.running import gen_data

BILLION = 1_000_000_000


def test_a_billion_samples_cost_hours_times_prices() -> None:
    """0.36 s of a core for each of 1e9 samples are 1e5 core hours; 50 kB are 50,000 GB."""
    probe = Probe({"render": 0.27, "encode": 0.09}, 0.72, 50e3, 4.0, has_gpu=True)
    rows = dict(estimate_rows(probe, BILLION, 100, Prices(0.05, 2.0, 0.02)))

    assert rows["size, measured"] == "50.0 TB (50 kB per sample)"
    assert rows["files, measured"] == "4,000,000,000 (4.0 per sample)"
    assert rows["CPU, measured"] == "100,000.00 h (0.360 s per sample)"
    assert rows["time on 100 cores"] == "1,000.00 h"
    assert rows["GPU, measured"].startswith("200,000.00 h")
    assert (rows["cost of CPU"], rows["cost of GPU"]) == ("5,000.00", "400,000.00")
    assert rows["cost of storage per month"] == "1,000.00"


def test_nothing_costs_what_has_no_price_or_was_not_used() -> None:
    probe = Probe({"render": 0.27}, 0.72, 50e3, 4.0, has_gpu=False)

    assert not [name for name, _ in estimate_rows(probe, 10, 2, Prices()) if "cost" in name]
    assert "cost of GPU" not in dict(estimate_rows(probe, 10, 2, Prices(gpu_hour=1.0)))


def test_a_price_needs_measured_hours(tmp_path: Path) -> None:
    done = gen_data(
        "plan", "tabletop.yaml", "--n", "10", "--price-per-cpu-hour", "0.05", cwd=tmp_path
    )
    assert done.returncode == 2
    assert "expected --probe K" in done.stderr
