"""Laws of ``python -m benchmarks.bench_scaling``: the fit, and the scenes it varies."""

import math

import numpy as np
import pytest

from benchmarks.bench_scaling import Bumps, bumps_scene, fit_line, format_law


def test_a_line_is_that_of_numpy_and_explains_the_square_of_the_correlation() -> None:
    """``polyfit`` and ``corrcoef`` are independent of the fit."""
    x, y = np.array([1.0, 2.0, 5.0, 9.0]), np.array([3.0, 1.0, 8.0, 7.0])
    line = fit_line(list(zip(x.tolist(), y.tolist(), strict=True)))

    assert [line.slope, line.intercept] == pytest.approx(np.polyfit(x, y, 1))
    assert line.r2 == pytest.approx(np.corrcoef(x, y)[0, 1] ** 2)


def test_equal_values_have_a_level_line_that_explains_nothing() -> None:
    """There is no variance to explain."""
    line = fit_line([(1.0, 4.0), (2.0, 4.0)])

    assert (line.slope, line.intercept) == (0.0, 4.0)
    assert math.isnan(line.r2)


def test_one_place_has_no_line() -> None:
    """Refused by the fit, left empty in the table."""
    with pytest.raises(ValueError, match="two different places"):
        fit_line([(1.0, 2.0), (1.0, 3.0)])
    assert format_law("workers", [(1.0, 2.0)]) == "| workers | 1: 2 | | | |"


def test_scenes_have_the_objects_triangles_and_lamps_asked_for() -> None:
    """Four bumps of 2 * 5 * 5 triangles above a plane."""
    scene = bumps_scene(side=2, rows=5, lamps=3, size_px=(64, 48))

    bumps = [body for body in scene.bodies if body.instance_id]
    assert [len(Bumps().mesh(body.asset).faces) for body in bumps] == [50] * 4
    assert len(scene.lights) == 3
    lens = scene.cameras[0].intrinsics
    assert (lens.width_px, lens.height_px) == (64, 48)
