"""The measurement on a GPU: its comparison with references, its limits, and its path on a CPU."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from benchmarks.gpu import __main__ as command
from benchmarks.gpu import rates
from benchmarks.gpu.parts import Result, run_part
from benchmarks.gpu.references import differences, have_same_bytes
from benchmarks.gpu.report import format_report, reached

ROOT = Path(__file__).parents[2]


def png(image: np.ndarray) -> Any:
    return cv2.imencode(".png", image)[1].reshape(-1)


def facts(reference: dict[str, Any], found: dict[str, Any]) -> list[tuple[str, str]]:
    return [(f.what, f.fact) for f in differences("sample 0", reference, found)]


def test_a_photograph_may_differ_by_one_level_and_in_one_pixel_of_a_thousand() -> None:
    """100 x 100 pixels: ten may be far off, an eleventh not."""
    one = np.full((100, 100, 3), 100, np.uint8)
    near, at_bound, beyond = one + 1, one.copy(), one.copy()
    at_bound[0, :10], beyond[0, :11] = 200, 200

    assert facts({"image/color/rgb": png(one)}, {"image/color/rgb": png(near)}) == []
    assert facts({"image/color/rgb": png(one)}, {"image/color/rgb": png(at_bound)}) == []
    assert facts({"image/color/rgb": png(one)}, {"image/color/rgb": png(beyond)}) == [
        ("sample 0, color/rgb", "99.89 % of pixels within 1 level, up to 100 levels")
    ]


def test_labels_with_other_bytes_are_found_and_counted() -> None:
    """The digest decides; the values kept say by how much."""
    ids = np.array([[0, 1], [2, 3]], np.uint16)
    other = np.array([[0, 1], [2, 9]], np.uint16)
    key = "color/instance"
    reference = {f"digest/{key}": np.array([1], np.uint8), f"values/{key}": ids}
    found = {f"digest/{key}": np.array([2], np.uint8), f"values/{key}": other}

    assert facts(reference, reference) == []
    assert facts(reference, found) == [
        (f"sample 0, {key}", "other bytes (1 of 4 values kept differ)")
    ]


def test_a_point_may_be_a_tenth_of_a_millimetre_off() -> None:
    """Along any axis; a missing point is a difference too."""
    here = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    near, far = here.copy(), here.copy()
    near[0, 2], far[1, 1] = 9e-5, 2.0002

    assert facts({"points/top": here}, {"points/top": near}) == []
    assert facts({"points/top": here}, {"points/top": far}) == [
        ("sample 0, top", "1 of 2 points differ, by up to 0.0002 m")
    ]
    assert facts({"points/top": here}, {"points/top": here[:1]}) == [
        ("sample 0, top", "another number of points")
    ]
    assert facts({"points/top": here}, {}) == [("sample 0, points/top", "only in one of the two")]


def test_a_second_drawing_has_the_same_bytes_also_where_there_is_nothing() -> None:
    """NaN marks pixels without flow; -0.0 equals 0.0 and has other bytes."""
    flow = np.array([[np.nan, 0.5], [0.0, np.nan]], np.float32)
    ids = np.array([1, 2], np.uint16)
    drawn = {"values/flow": flow, "values/ids": ids}

    assert have_same_bytes(drawn, {"values/flow": flow.copy(), "values/ids": ids.copy()})
    assert not have_same_bytes(drawn, {"values/flow": flow, "values/ids": ids + 1})
    assert not have_same_bytes({"values/flow": np.zeros(2)}, {"values/flow": -np.zeros(2)})
    assert not have_same_bytes(drawn, {"values/flow": flow})
    assert not have_same_bytes(drawn, {"values/flow": flow, "values/ids": ids.reshape(2, 1)})


def test_a_part_that_fails_names_file_line_kernel_and_error() -> None:
    result = run_part("broken", "report:format_report", 60.0, figures={"card": 1}, failures={})

    assert result.value is None
    assert result.failure.startswith("benchmarks/gpu/report.py:")
    assert "kernel none: AttributeError: 'int' object has no attribute 'items'" in result.failure


def test_a_part_that_takes_too_long_is_left_out() -> None:
    result = run_part("slow", "frames:time_kernels", 0.05, config="tabletop", device="cpu",
                      views=1, small=True)  # fmt: skip

    assert result.failure == "left out: not finished within 0 s"


def test_the_report_ends_with_the_goals_and_what_is_missing() -> None:
    """Shares of 500 samples/s to disk, 2,000 in memory, and 1 billion rays per second."""
    rate = {"ready": 1, "memory": {"1": 100.0, "2": 150.0}, "disk": {"1": 50.0}, "busy": {},
            "device_mb": 600.0, "stages": {"render": 3.0}, "scenes": 9,
            "left_out": []}  # fmt: skip
    sweep = {"rays": 4_000_000, "ms": 8.0, "kernels": [["trace", 7.0]]}
    figures = {"rates": {"tabletop": rate}, "sweeps": {"one": sweep}}

    text = format_report(figures, {"paths": "left out"})

    assert reached(figures) == {"disk": 50.0, "memory": 150.0, "rays": 5e8}
    assert text.splitlines()[-6:] == [
        "| 500 labelled samples/s to disk, tabletop | 50 | 10 % |",
        "| 2e+03 labelled samples/s in memory, tabletop | 150 | 8 % |",
        "| 1e+09 rays/s of one launch | 5e+08 | 50 % |",
        "",
        "Missing:",
        "- paths: left out",
    ]


WORKER = """
import json, sys
if sys.argv[1] == "2":
    raise SystemExit("out of memory")
for line in sys.stdin:
    number, place, window_s, pool = json.loads(line)
    made = {"n": 6, "s": 2.0, "scenes": min(pool, 3), "cpu_s": {"render": 0.75}}
    print(json.dumps(made | {"number": number}), flush=True)
"""
"""Makes three samples a second; the third worker ends instead."""


@contextmanager
def answering(folder: Path, count: int) -> Iterator[list[rates._Worker]]:
    workers = [
        rates._Worker([sys.executable, "-c", WORKER, str(k)], folder / f"{k}.log")
        for k in range(count)
    ]
    yield workers
    for worker in workers:
        worker.end()


def test_workers_not_ready_are_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of four workers, the third has ended: the other three are measured, and two, and one."""
    monkeypatch.setattr(rates, "_started", lambda *a: answering(tmp_path, a[3]))

    found = rates.measure_rates("street", "cpu", [1, 2, 4], 0.1, 120.0, small=True, scenes=16)

    assert found["memory"] == found["disk"] == {"3": 9.0, "2": 6.0, "1": 3.0}
    assert (found["ready"], found["scenes"], found["stages"]) == (3, 3, {"render": 125.0})
    assert found["left_out"] == ["1 workers not ready: out of memory"]


def test_measurements_that_would_end_too_late_are_left_out_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A window longer than the limit."""
    monkeypatch.setattr(rates, "_started", lambda *a: answering(tmp_path, a[3]))

    found = rates.measure_rates("street", "cpu", [1, 2], 121.0, 120.0, small=True, scenes=16)

    assert found["memory"] == found["disk"] == {}
    assert found["left_out"] == [
        "disk, 2 workers: 0 of them in time",
        "memory, 2 workers: 0 of them in time",
        "disk, 1 workers: 0 of them in time",
        "memory, 1 workers: 0 of them in time",
    ]


def test_references_that_are_too_large_to_be_carried_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file is written all the same, and the exit code is 1."""
    part = tmp_path / "street.npz"
    noise = np.random.default_rng(1).integers(256, size=8_100_000, dtype=np.uint8)
    np.savez(part, **{"street/0/scene": noise})
    done = [Result("street", 1.0, str(part), "")]
    monkeypatch.setattr(command, "_side_by_side", lambda *_: done)
    path = tmp_path / "all.npz"

    assert command.main(["--make-references", str(path), "--configs", "street"]) == 1

    assert capsys.readouterr().out.splitlines()[-1] == (
        f"{path}: more than 8 MB; keep fewer points or pixels"
    )
    assert path.exists()


def measure(*words: str | Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    line = [sys.executable, "-m", "benchmarks.gpu", *words, "--limit-s", "900"]
    subprocess.run(line, cwd=ROOT, env=environment, check=True)


@pytest.mark.slow
def test_the_measurement_runs_on_the_cpu_with_tiny_sizes(tmp_path: Path) -> None:
    """Every part but the compilation of all kernels, and the comparison below."""
    parts = ("card", "kernels", "sweeps", "paths", "rates")

    measure("--device", "cpu", "--json", tmp_path / "gpu.json", "--parts", *parts)

    found = json.loads((tmp_path / "gpu.json").read_text())
    assert found["failures"] == {}
    assert set(found["figures"]) == set(parts)
    tabletop = found["figures"]["rates"]["tabletop"]
    assert tabletop["left_out"] == []
    assert min(tabletop["disk"]["1"], tabletop["memory"]["1"]) > 0.0


@pytest.mark.slow
def test_the_path_of_a_gpu_draws_what_the_cpu_draws(tmp_path: Path) -> None:
    """One lane per thread, lists in another order: same labels, same images.

    Left untested are the arithmetic of a GPU, and threads that run at the same time.
    """
    references, name = tmp_path / "references.npz", "tabletop"

    measure("--make-references", references, "--configs", name)
    measure("--device", "cpu-as-gpu", "--references", references, "--configs", name,
            "--parts", "correct", "--json", tmp_path / "gpu.json")  # fmt: skip

    correct = json.loads((tmp_path / "gpu.json").read_text())["figures"]["correct"]
    assert correct == {name: {"compared": 22, "findings": [], "repeats": True}}
    assert references.stat().st_size < 250_000
