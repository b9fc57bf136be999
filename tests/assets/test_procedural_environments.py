"""Environments: mean luminance, orientation, and their bright parts."""

import numpy as np
import pytest

from gen_data.content.procedural import ENVIRONMENTS
from gen_data.sky.equirectangular import normalize_luminance, pixel_directions

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("name", sorted(ENVIRONMENTS))
@pytest.mark.parametrize("seed", [0, 1, 5])
def test_mean_luminance_is_one_by_solid_angle(name: str, seed: int) -> None:
    """Integrated with rows weighted by the sine of their polar angle."""
    image = ENVIRONMENTS[name].build(seed)
    rows, columns, channels = image.shape
    weight = np.sin(np.pi * (np.arange(rows) + 0.5) / rows)
    luminance = (image.astype(np.float64) * LUMINANCE).sum(axis=2).mean(axis=1)
    assert image.dtype == np.float32
    assert (columns, channels) == (2 * rows, 3)
    assert np.isfinite(image).all()
    assert image.min() >= 0.0
    assert (luminance * weight).sum() / weight.sum() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("name", sorted(ENVIRONMENTS))
def test_equal_seeds_make_equal_environments_and_others_differ(name: str) -> None:
    build = ENVIRONMENTS[name].build
    assert build(1).tobytes() == build(1).tobytes()
    assert len({build(k).tobytes() for k in range(4)}) == 4


def test_columns_grow_clockwise_from_minus_x_and_studios_have_few_lights() -> None:
    """Row 0 is the zenith, column 0 is -X, the centre +X, three quarters -Y."""
    d = pixel_directions(64)
    assert d[0, 0, 2] > 0.999
    assert np.allclose(d[32, 0], (-1.0, 0.0, 0.0), atol=0.05)
    assert np.allclose(d[32, 64], (1.0, 0.0, 0.0), atol=0.05)
    assert np.allclose(d[32, 96], (0.0, -1.0, 0.0), atol=0.05)
    assert np.allclose((d**2).sum(axis=2), 1.0)
    assert np.allclose(normalize_luminance(np.full((16, 32, 3), 7.0)), 1.0, atol=1e-6)
    # Soft boxes: a tenth of the directions gives most of the light.
    image = ENVIRONMENTS["studio"].build(0) @ LUMINANCE.astype(np.float32)
    weight = np.sin(np.pi * (np.arange(len(image)) + 0.5) / len(image))[:, None]
    power = np.sort((image * weight).ravel())[::-1]
    assert power[: power.size // 10].sum() > 0.4 * power.sum()
