"""Luminous intensities of lamps of cars, against UN Regulations No. 7 and No. 112."""

import numpy as np
import pytest

from gen_data.randomizers.vehicle_lights import VehicleLights
from tests.solids import build, with_role

LIMITS_CD = {
    # Zone III of a dipped beam, above its cut-off: 0.1 to 0.7 lx at 25 m; class B.
    "headlight": (0.1 * 25.0**2, 0.7 * 25.0**2),
    # R7, rear position lamps of category R1.
    "taillight": (4.0, 17.0),
}


def lens_area_m2(seed: int, role: str) -> float:
    """Of one of the two lamps of a car, seen from before or behind it."""
    corners = with_role(build("car", seed).mesh, role)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ahead = normals[:, 0] if role == "headlight" else -normals[:, 0]
    return float(0.5 * np.maximum(ahead, 0.0).sum() / 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("role", LIMITS_CD)
def test_lamps_of_cars_are_as_strong_as_the_regulations_ask(role: str) -> None:
    """On average; the strongest draw on the largest lens is at most one stop too bright."""
    areas_m2 = [lens_area_m2(seed, role) for seed in range(0, 120, 5)]
    darkest, brightest = getattr(VehicleLights(name="lights"), f"{role}_cd_m2").support()
    weakest_cd, strongest_cd = LIMITS_CD[role]

    assert weakest_cd <= np.mean(areas_m2) * 0.5 * (darkest + brightest) <= strongest_cd
    assert np.max(areas_m2) * brightest <= 2.0 * strongest_cd
