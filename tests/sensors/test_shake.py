"""Blur by an unsteady hand."""

import numpy as np
import pytest

from gen_data.sensors.camera.optics import smear


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 90.0, 135.0])
def test_a_point_of_light_becomes_a_line_of_the_same_energy(angle_deg: float) -> None:
    """Its second moments are as of a segment: length squared over 12 along it, none across."""
    image = np.zeros((61, 61, 3), np.float32)
    image[30, 30] = 1000.0
    out = smear(image, 12.0, np.radians(angle_deg))[..., 0].astype(np.float64)
    v, u = np.mgrid[0:61, 0:61] - 30.0
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    along, across = u * c + v * s, v * c - u * s

    assert out.sum() == pytest.approx(1000.0, rel=1e-5)
    # Bilinear weights add at most a quarter of a squared pixel in each direction.
    assert (out * along**2).sum() / out.sum() == pytest.approx(12.0**2 / 12.0, abs=0.3)
    assert (out * across**2).sum() / out.sum() < 0.3
    assert abs((out * along).sum()) / out.sum() < 1e-3


def test_an_even_image_stays_as_it_is() -> None:
    """Also at its borders."""
    image = np.full((20, 30, 3), 7.0, np.float32)
    assert np.allclose(smear(image, 9.0, 0.4), image, rtol=1e-5)
