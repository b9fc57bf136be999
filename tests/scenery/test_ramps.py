"""Ramps for wheelchairs, by rays of Embree and the measures of DIN 18040-1."""

import numpy as np
import pytest

from gen_data.assets.library import open_library
from gen_data.content.scenery.ramps import door_ramp
from tests.embree import RayCaster

TOPS_M = (0.0, 0.8, 6.0, 0.44, 7.5, 0.44, 10.0, 0.29)
DOWN = (0.0, 0.0, -1.0)


def _caster() -> RayCaster:
    """The ramp by its id, as streets name it: with two runs and a rest."""
    numbers = ",".join(f"{value:g}" for value in TOPS_M)
    mesh = open_library().mesh(f"door_ramp?seed=0&tops_m={numbers}&width_m=1.4")
    return RayCaster((mesh.vertices_m, mesh.faces))


def test_its_surface_has_the_stated_heights_over_the_clear_width() -> None:
    """1.2 m between handrails are clear; curbs on both sides are 0.1 m higher."""
    way = np.linspace(0.05, 9.95, 100)
    expected = np.interp(way, TOPS_M[::2], TOPS_M[1::2])
    caster = _caster()
    for y, higher in ((-0.59, 0.0), (0.0, 0.0), (0.59, 0.0), (-0.695, 0.1), (0.695, 0.1)):
        start = np.column_stack([way, np.full(100, y), np.full(100, 5.0)])
        tops = 5.0 - caster.cast(start, DOWN).distance
        np.testing.assert_allclose(tops, expected + higher, atol=1e-3)


def test_handrails_are_85_to_90_cm_high_and_3_to_4_cm_thick() -> None:
    """They go on level for 0.3 m beyond both ends (2010 ADA Standards, 505.10)."""
    way = np.linspace(-0.29, 10.29, 60)
    expected = np.interp(way, TOPS_M[::2], TOPS_M[1::2])
    caster = _caster()
    for y in (-0.67, 0.67):
        start = np.column_stack([way, np.full(60, y), np.full(60, 5.0)])
        over = 5.0 - caster.cast(start, DOWN).distance - expected
        assert over.min() > 0.85
        assert over.max() < 0.905
    across = caster.cast((3.3, -2.0, 0.8 - 3.3 * 0.06 + 0.88), (0.0, 1.0, 0.0)).distance
    assert 0.03 <= 2.0 * (2.0 - 0.67 - float(across)) <= 0.045


def test_it_is_solid_down_to_the_ground() -> None:
    sides = _caster().cast([[x, 2.0, 0.02] for x in (0.1, 5.0, 7.0, 9.9)], (0.0, -1.0, 0.0))
    np.testing.assert_allclose(sides.distance, 1.3, atol=1e-4)


@pytest.mark.parametrize(
    ("tops_m", "width_m"),
    [
        ((0.0, 0.4), 1.4),
        ((0.0, 0.4, 2.0), 1.4),
        ((0.5, 0.4, 2.0, 0.3), 1.4),
        ((0.0, 0.4, 2.0, 0.0), 1.4),
        ((0.0, 0.4, 2.0, 0.5), 1.4),
        ((0.0, 0.4, 2.0, 0.1), 1.4),
        ((0.0, 3.1, 2.0, 3.0), 1.4),
        ((0.0, 0.4, 2.0, 0.3), 0.9),
    ],
)
def test_other_profiles_are_refused(tops_m: tuple[float, ...], width_m: float) -> None:
    with pytest.raises(ValueError, match="tops_m is"):
        door_ramp(0, tops_m, width_m)
