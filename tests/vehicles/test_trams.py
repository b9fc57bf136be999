"""Trams: sizes, ends, doors, and a pantograph at the contact wire."""

import numpy as np
import pytest

from gen_data.content.roads.tram_wires import WIRE_M
from gen_data.content.vehicles import FAMILIES
from gen_data.content.vehicles.tram import tram_facts
from tests.solids import variant, with_role

SEEDS = range(FAMILIES["tram"].variants)


@pytest.mark.parametrize("seed", SEEDS)
def test_trams_are_as_large_as_real_ones(seed: int) -> None:
    """27 to 35 m, 2.3 to 2.65 m wide, 3.3 to 3.7 m high; the pantograph reaches the wire."""
    solid = variant("tram", seed)
    low, high = (np.array(edge) for edge in solid.body_bounds_m or solid.mesh.bounds_m())
    length, width, height = (high - low).tolist()

    assert 26.9 < length < 35.1
    assert width == pytest.approx((2.3, 2.4, 2.65)[seed % 3], abs=0.01)
    assert 3.3 < height < 3.7
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    assert solid.mesh.bounds_m()[1][2] == pytest.approx(WIRE_M, abs=0.01)
    assert len(solid.mesh.faces) < 5200
    assert abs(low[0] + high[0]) < 0.01 and abs(low[1] + high[1]) < 0.01


def test_lamps_are_at_the_ends_and_keypoints_at_lamps() -> None:
    """White ones ahead, red ones behind; wheels of the outer bogies on both sides."""
    solid = variant("tram", 0)
    x = solid.mesh.bounds_m()[1][0]
    points = {point.name: np.array(point.position_m) for point in solid.keypoints}

    assert with_role(solid.mesh, "headlight")[..., 0].min() > x - 2.0
    assert with_role(solid.mesh, "taillight")[..., 0].max() < 2.0 - x
    for role in ("headlight", "taillight"):
        corners = with_role(solid.mesh, role).reshape(-1, 3)
        for side in ("left", "right"):
            away = np.sqrt(((corners - points[f"{role}_{side}"]) ** 2).sum(axis=1))
            assert away.min() < 0.3
    assert points["wheel_front_left"][0] > 5.0 > -5.0 > points["wheel_rear_right"][0]


@pytest.mark.parametrize("seed", [0, 1])
def test_every_section_has_glazed_doors_on_both_sides(seed: int) -> None:
    """Glass down to 0.4 m over the rails, once per section and side."""
    glass = with_role(variant("tram", seed).mesh, "glass")
    low = glass[(glass[..., 2].min(axis=1) < 0.45) & (np.abs(glass[..., 1]).min(axis=1) > 0.9)]
    for sign in (1.0, -1.0):
        x = np.sort(low[(low[..., 1] * sign > 0).all(axis=1)].mean(axis=1)[:, 0])
        assert 1 + int((np.diff(x) > 2.0).sum()) == int(tram_facts(seed).attributes["sections"])


def test_surfaces_face_outward() -> None:
    """Normals of paint and glass at the sides and ends point away from the middle line."""
    for seed in (0, 1):
        for role in ("paint", "glass"):
            corners = with_role(variant("tram", seed).mesh, role)
            a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            normal, middle = np.cross(a, b), corners.mean(axis=1)
            side = np.abs(middle[:, 1]) > 1.1
            assert (normal[side, 1] * middle[side, 1] >= -1e-6).mean() > 0.97
