"""The table of statistics next to real ones, on figures with known answers."""

import math
from dataclasses import replace
from statistics import fmean

import pytest

from benchmarks import bench_pictures, bench_scans
from benchmarks.bench_statistics import Column, Figure, bootstrap, format_table
from benchmarks.real_figures import RealFigures, judge, real_figures

REAL = RealFigures(asked=0.25, least=0.02, rows={"many": 0.8, "none": 0.0})


@pytest.mark.parametrize(
    ("name", "ours", "error", "verdict"),
    [
        ("many", 1.0, 0.0, "in"),
        ("many", 0.6, 0.0, "in"),
        ("many", 1.1, 0.04, "out"),
        ("many", 1.1, 0.06, "?"),
        ("many", 1.1, math.nan, "out"),
        ("none", 0.02, 0.0, "in"),
        ("none", 0.03, 0.001, "out"),
        ("many", math.nan, math.nan, "-"),
    ],
)
def test_a_row_is_out_beyond_its_range_by_two_standard_errors(
    name: str, ours: float, error: float, verdict: str
) -> None:
    """A quarter of .8 is .2: the range is .6 to 1; 1.1 is 2.5 errors of .04 beyond it."""
    assert judge(REAL, name, ours, error) == verdict


def test_the_error_of_a_mean_is_that_of_the_means_of_scenes() -> None:
    """Four scenes of three equal pictures: sqrt(variance of 0, 0, 1, 1 / 4) = .25, not .14."""
    scenes = [[0.0] * 3, [0.0] * 3, [1.0] * 3, [1.0] * 3]

    figure = bootstrap(scenes, lambda values: {"mean": fmean(values)})["mean"]

    assert figure.value == 0.5
    assert figure.error == pytest.approx(0.25, rel=0.25)


def test_both_benchmarks_measure_the_rows_of_the_file_of_real_figures() -> None:
    """Names of rows are those of the summaries, in their order."""
    pictures = [bench_pictures.Picture(())]

    assert list(bench_pictures.summarise(pictures)) == list(real_figures("pictures").rows)
    assert real_figures("scans").rows == bench_scans.REAL


def test_the_table_marks_figures_out_of_range_and_leaves_out_rows_without_figures() -> None:
    """KITTI has .53 cars below 25 px a picture and .06 above 192 px."""
    scenes = {"pictures": 9, "light": 0, "scans": 0}
    figures = {"cars < 25 px": Figure(0.9, 0.01), "cars > 192 px": Figure(0.06, 0.01)}
    column = Column("street.yaml", figures, scenes)

    head, _, *rows = format_table([column, replace(column, figures={})]).splitlines()

    assert "9 scenes" in head
    assert rows == [
        "| cars < 25 px | 0.53 | 0.9 ± 0.01 **out** |  |",
        "| cars > 192 px | 0.06 | 0.06 ± 0.01 |  |",
    ]
