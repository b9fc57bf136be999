"""Goodness of fit of rotations, directions and positions.

Seeds are fixed; ALPHA is the false-alarm rate of each single comparison.
"""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from gen_data.config.distributions import (
    AboutZ,
    Box,
    Cap,
    Distribution,
    EulerDeg,
    QuaternionWxyz,
    Shell,
    So3,
    Sphere,
)
from gen_data.core.se3 import SE3
from gen_data.core.streams import Rng, Streams

ALPHA = 1e-4
DRAWS = 8_000
Array = NDArray[np.float64]


GOLDEN_ROTATION = (-0.172046698052, 0.398677837669, 0.894301234003, -0.108079684966)
GOLDEN_DIRECTION = (0.9260915368190314, -0.366438171715, -0.08987508966639979)
GOLDEN_POSITION = (-0.4086242206357593, 0.01761914689249309, 2.1250523386837967)


def stream(name: str) -> Rng:
    return Streams(seed=20_240_229, scene=1).rng(name)


def drawn(distribution: Distribution[Any], n: int = DRAWS) -> Array:
    rng = stream(repr(distribution))
    return np.array([distribution.draw(rng) for _ in range(n)])


def assert_fits(values: Array, cdf: Any) -> None:
    """Kolmogorov-Smirnov at the stated false-alarm rate."""
    assert stats.kstest(values, cdf).pvalue > ALPHA


def assert_uniform_on_sphere(vectors: Array) -> None:
    """Unit length; height and azimuth uniform and independent (Archimedes), about each axis."""
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-11)
    for axis in range(3):
        height = vectors[:, axis]
        azimuth = np.arctan2(vectors[:, (axis + 2) % 3], vectors[:, (axis + 1) % 3])
        assert_fits(height, stats.uniform(-1, 2).cdf)
        assert_fits(azimuth, stats.uniform(-math.pi, 2 * math.pi).cdf)
        cells = np.histogram2d(height, azimuth, bins=(6, 6))[0]
        assert stats.chisquare(cells.ravel()).pvalue > ALPHA


def test_so3_rotation_angles_have_the_density_of_the_haar_measure() -> None:
    """Density (1 - cos a) / pi on [0, pi], so the cumulative is (a - sin a) / pi."""
    w = np.abs(drawn(So3())[:, 0])

    angle_rad = 2 * np.arccos(np.clip(w, 0, 1))

    assert_fits(angle_rad, lambda a: (a - np.sin(a)) / math.pi)


@pytest.mark.parametrize("vector", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, -0.48, 0.64)])
def test_so3_takes_any_axis_uniformly_over_the_sphere(vector: tuple[float, float, float]) -> None:
    """The image of a fixed direction has no preferred direction."""
    images = [SE3((0, 0, 0), tuple(q)).rotate(np.array(vector)) for q in drawn(So3())]

    assert_uniform_on_sphere(np.array(images))


def test_so3_rotation_axes_are_uniform_over_the_sphere() -> None:
    """And quaternions are of unit length, on both hemispheres alike."""
    quaternions = drawn(So3())
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-11)

    axes = quaternions[:, 1:] / np.linalg.norm(quaternions[:, 1:], axis=1)[:, None]

    assert_uniform_on_sphere(axes)
    assert stats.binomtest(int((quaternions[:, 0] > 0).sum()), DRAWS).pvalue > ALPHA


@pytest.mark.parametrize("yaw_deg", [(0.0, 360.0), (-30.0, 60.0)])
def test_about_z_turns_uniformly_about_the_vertical(yaw_deg: tuple[float, float]) -> None:
    """The angle is uniform in its range, the axis is Z."""
    low, high = yaw_deg
    quaternions = drawn(AboutZ(yaw_deg))

    yaw = np.degrees(2 * np.arctan2(quaternions[:, 3], quaternions[:, 0]))

    assert (quaternions[:, 1:3] == 0).all()
    assert_fits(np.mod(yaw - low, 360.0), stats.uniform(0, high - low).cdf)


def test_sphere_has_no_preferred_direction() -> None:
    assert_uniform_on_sphere(drawn(Sphere()))


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 2, -0.5)])
@pytest.mark.parametrize("half_angle_deg", [20.0, 90.0, 150.0])
def test_cap_is_uniform_by_area(axis: tuple[float, float, float], half_angle_deg: float) -> None:
    """The cosine to the axis is uniform up to the rim, the azimuth about the axis is uniform."""
    unit = np.array(axis) / np.linalg.norm(axis)
    rim = math.cos(math.radians(half_angle_deg))
    side = np.cross(unit, [1.0, 0.0, 0.0] if abs(unit[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)

    vectors = drawn(Cap(axis, half_angle_deg), 4_000)

    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-11)
    assert (vectors @ unit >= rim - 1e-11).all()
    assert_fits(vectors @ unit, stats.uniform(rim, 1 - rim).cdf)
    azimuth = np.arctan2(vectors @ np.cross(unit, side), vectors @ side)
    assert_fits(azimuth, stats.uniform(-math.pi, 2 * math.pi).cdf)


def test_box_is_uniform_by_volume() -> None:
    points = drawn(Box((-1, 0, 2), (1, 5, 2.5)))

    unit = (points - [-1, 0, 2]) / [2, 5, 0.5]
    for axis in range(3):
        assert_fits(unit[:, axis], stats.uniform().cdf)
    cells = np.histogramdd(unit, bins=(4, 4, 4), range=[(0, 1)] * 3)[0]
    assert stats.chisquare(cells.ravel()).pvalue > ALPHA


@pytest.mark.parametrize(
    ("radius_m", "elevation_deg"),
    [((0.6, 1.2), (15.0, 75.0)), ((0.0, 2.0), (-90.0, 90.0)), ((3.0, 3.5), (-20.0, 0.0))],
)
def test_shells_are_by_volume(
    radius_m: tuple[float, float], elevation_deg: tuple[float, float]
) -> None:
    """Radius cubed, sine of elevation and azimuth are uniform and independent."""
    center = np.array([1.0, -2.0, 0.5])
    (inner, outer), (low, high) = radius_m, np.sin(np.radians(elevation_deg))

    offset = drawn(Shell((1.0, -2.0, 0.5), radius_m, elevation_deg)) - center
    radius = np.linalg.norm(offset, axis=1)
    volume = (radius**3 - inner**3) / (outer**3 - inner**3)
    sine = (offset[:, 2] / radius - low) / (high - low)
    azimuth = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * math.pi) + 0.5

    assert (radius >= inner - 1e-9).all()
    assert (radius <= outer + 1e-9).all()
    for values in (volume, sine, azimuth):
        assert_fits(values, stats.uniform().cdf)
    cells = np.histogramdd(
        np.stack([volume, sine, azimuth], axis=1), bins=(4, 4, 4), range=[(0, 1)] * 3
    )[0]
    assert stats.chisquare(cells.ravel()).pvalue > ALPHA


@pytest.mark.parametrize(
    ("euler_deg", "vector", "image"),
    [
        ((90, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 90, 0), (0, 0, 1), (1, 0, 0)),
        ((0, 0, 90), (1, 0, 0), (0, 1, 0)),
        # Roll first: Y goes up to Z and then, by the yaw, stays there.
        ((90, 0, 90), (0, 1, 0), (0, 0, 1)),
        # Pitch takes X down to -Z, which the yaw leaves alone.
        ((0, 90, 90), (1, 0, 0), (0, 0, -1)),
    ],
)
def test_euler_angles_turn_about_fixed_axes(
    euler_deg: tuple[float, float, float],
    vector: tuple[float, float, float],
    image: tuple[float, float, float],
) -> None:
    """Roll about X, then pitch about Y, then yaw about Z, each right-handed (URDF)."""
    pose = SE3((0, 0, 0), EulerDeg(euler_deg).draw(stream("")))

    np.testing.assert_allclose(pose.rotate(np.array(vector, float)), image, atol=1e-12)


def test_a_quaternion_is_normalised() -> None:
    assert QuaternionWxyz((0, 0, 0, 5)).draw(stream("")) == (0, 0, 0, 1)


def test_drawn_poses_are_pinned() -> None:
    """If they change, every data set changes, and that is a breaking release."""
    rng = Streams(seed=7, scene=3).rng("randomizer/golden")

    assert So3().draw(rng) == GOLDEN_ROTATION
    assert Cap((1, 0, 0), 30).draw(rng) == pytest.approx(GOLDEN_DIRECTION, abs=1e-15)
    assert Shell((0, 0, 1), (0.6, 1.2), (15, 75)).draw(rng) == pytest.approx(
        GOLDEN_POSITION, abs=1e-15
    )
