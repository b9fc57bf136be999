"""Curves by arc length, against closed forms and scipy's quadrature."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import fresnel

from gen_data.roads import alignment, reference_line

CURVATURES = st.floats(-0.2, 0.2, allow_nan=False)


@settings(max_examples=60, deadline=None)
@given(CURVATURES, st.floats(1.0, 300.0))
def test_arc_keeps_its_distance_from_the_centre(curvature: float, length: float) -> None:
    """Every point lies on the circle; nearly straight arcs are as exact as strong ones."""
    poses = reference_line.Arc(length, curvature).local(np.linspace(0.0, length, 9))
    if abs(curvature) > 1e-6:
        radius = 1.0 / curvature
        away = np.hypot(poses[:, 0], poses[:, 1] - radius)
        assert away == pytest.approx(np.full(9, abs(radius)), rel=1e-9)
    else:
        assert poses[:, 0] == pytest.approx(np.linspace(0.0, length, 9), rel=1e-6)
    assert poses[-1, 2] == pytest.approx(curvature * length)


@settings(max_examples=60, deadline=None)
@given(CURVATURES, CURVATURES, st.floats(5.0, 120.0))
def test_spiral_is_the_integral_of_its_heading(start: float, end: float, length: float) -> None:
    s = np.array([0.0, 0.3 * length, length])
    poses = reference_line.Spiral(length, start, end).local(s)

    def heading(u: float) -> float:
        return start * u + 0.5 * (end - start) / length * u * u

    for k, upper in enumerate(s):
        assert poses[k, 0] == pytest.approx(
            quad(lambda u: math.cos(heading(u)), 0.0, upper, limit=400)[0], abs=1e-6
        )
        assert poses[k, 1] == pytest.approx(
            quad(lambda u: math.sin(heading(u)), 0.0, upper, limit=400)[0], abs=1e-6
        )


def test_clothoid_from_a_straight_line_is_fresnels() -> None:
    """X + iy = a (C + iS)(s / a), a = sqrt(pi / rate)."""
    length, end = 50.0, 0.02
    a = math.sqrt(math.pi * length / end)
    sine, cosine = fresnel(length / a)

    assert reference_line.Spiral(length, 0.0, end).local(np.array([length]))[
        0, :2
    ] == pytest.approx((a * cosine, a * sine), abs=1e-9)


@pytest.mark.parametrize(
    "curve",
    [
        reference_line.Line(40.0),
        reference_line.Arc(40.0, -0.03),
        reference_line.Spiral(40.0, 0.05, -0.02),
        reference_line.Poly3(40.0, (0.0, 0.0, 0.01, -0.0001)),
    ],
)
def test_parameter_is_arc_length_and_heading_is_the_tangent(curve: reference_line.Curve) -> None:
    """Steps along the curve are as long as the parameter's, and point along the heading."""
    s = np.linspace(0.0, 40.0, 4001)
    poses = curve.local(s)
    steps = np.diff(poses[:, :2], axis=0)
    middle = 0.5 * (poses[1:, 2] + poses[:-1, 2])

    assert np.hypot(*steps.T) == pytest.approx(np.full(4000, 0.01), rel=1e-4)
    assert np.arctan2(steps[:, 1], steps[:, 0]) == pytest.approx(middle, abs=1e-4)


def test_parametric_cubic_runs_through_its_ends() -> None:
    """P is normalised or arc length; the heading never jumps."""
    for end in (1.0, 25.0):
        scale = 1.0 / end
        curve = reference_line.ParamPoly3(
            25.0, (0.0, 24.0 * scale, 0.0, 0.0), (0.0, 0.0, 6.0 * scale**2, 0.0), end
        )
        poses = curve.local(np.linspace(0.0, 25.0, 50))

        assert poses[-1, :2] == pytest.approx((24.0, 6.0))
        assert np.abs(np.diff(poses[:, 2])).max() < 0.05


def test_pieces_follow_one_another() -> None:
    """A line, then an arc from where and as the line ends."""
    line = reference_line.ReferenceLine(
        (reference_line.Placed(0.0, 1.0, 2.0, 0.5, reference_line.Line(10.0)),
         reference_line.Placed(10.0, 1.0 + 10 * math.cos(0.5), 2.0 + 10 * math.sin(0.5), 0.5,
                               reference_line.Arc(20.0, 0.05)))
    )  # fmt: skip
    before, after = line.poses(np.array([10.0 - 1e-7, 10.0 + 1e-7]))

    assert before == pytest.approx(after, abs=1e-6)
    assert line.length_m == 30.0


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(-8.0, 8.0))
def test_offset_is_measured_at_right_angles(curvature: float, t: float) -> None:
    """Points beside the line are |t| away from it, on the side of t's sign."""
    line = alignment.bent_line(30.0, curvature, ())
    s = np.array([12.0])
    x, y, heading = line.poses(s)[0]
    px, py = line.points(s, np.array([t]))[0]

    assert -math.sin(heading) * (px - x) + math.cos(heading) * (py - y) == pytest.approx(t)
    assert math.cos(heading) * (px - x) + math.sin(heading) * (py - y) == pytest.approx(0, abs=1e-9)
