"""Riders of bicycles: girth and luggage; spokes of wheels."""

import numpy as np
import pytest

from gen_data.content.vehicles import FAMILIES
from gen_data.content.vehicles.bicycle import cyclist, cyclist_facts, spoked_wheel
from gen_data.content.vehicles.vehicle_materials import VehicleSlot
from gen_data.core.asset_types import MeshData
from gen_data.core.errors import AssetError
from gen_data.renderers.warp.lidar.infrared_materials import infrared_fields
from tests.solids import with_role

VARIANTS = [cyclist(seed).mesh for seed in range(FAMILIES["cyclist"].variants)]


def points_of(mesh: MeshData, role: str) -> np.ndarray:
    return with_role(mesh, role).reshape(-1, 3)


def test_some_carry_bags_of_several_colours() -> None:
    """About two thirds; backpacks are above the saddle, panniers next to the rear wheel."""
    bags = [points_of(mesh, "canvas") for mesh in VARIANTS]
    floors = [mesh.bounds_m()[0][2] for mesh in VARIANTS]
    carried = [(b, z) for b, z in zip(bags, floors, strict=True) if len(b)]
    materials = [material for mesh in VARIANTS for material in mesh.materials]
    colors = {material.base_color for material in materials if material.role == "canvas"}

    assert 0.4 < len(carried) / len(VARIANTS) < 0.9
    assert len(colors) > 3
    backs = [bag[:, 2].max() - floor > 1.2 for bag, floor in carried]
    panniers = [bag[:, 2].min() - floor < 0.6 for bag, floor in carried]
    assert any(backs) and any(panniers)
    assert all(back or pannier for back, pannier in zip(backs, panniers, strict=True))
    for bag, floor in carried:
        low = bag[bag[:, 2] - floor < 0.75]
        assert (np.abs(low[:, 1]) > 0.03).all() and (low[:, 0] < -0.2).all()


def test_racing_bicycles_have_no_panniers() -> None:
    """Their bags are all on backs."""
    for seed, mesh in enumerate(VARIANTS):
        bag = points_of(mesh, "canvas")
        if "road" in str(cyclist_facts(seed)) and len(bag):
            assert bag[:, 2].min() - mesh.bounds_m()[0][2] > 0.9


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_who_waits_has_one_foot_on_the_ground(seed: int) -> None:
    """The left one, next to the bicycle; the other one is on a pedal; heads are below a rider's."""
    mesh = cyclist(seed, "wait").mesh
    shoes = points_of(mesh, "shoes")
    left, right = shoes[shoes[:, 1] > 0.0], shoes[shoes[:, 1] < 0.0]

    assert left[:, 2].min() == pytest.approx(0.0, abs=0.02)
    assert left[:, 1].min() > 0.15
    assert right[:, 2].min() > 0.2
    assert VARIANTS[seed].bounds_m()[1][2] - 0.25 < mesh.bounds_m()[1][2]
    assert mesh.bounds_m()[1][2] < VARIANTS[seed].bounds_m()[1][2]
    assert dict(cyclist_facts(seed, "wait").attributes)["pose"] == "wait"
    with pytest.raises(AssetError, match="pose=fly is unknown"):
        cyclist(seed, "fly")


def test_girth_varies() -> None:
    """Widths of trunks in their clothes, from lean to padded: within the drawn fifth."""
    widths = [np.ptp(points_of(mesh, "top")[:, 1]) for mesh in VARIANTS]

    assert max(widths) / min(widths) > 1.05
    assert max(widths) == pytest.approx(0.6, abs=0.15)


def test_spokes_cover_as_much_of_a_wheel_as_thirty_six_of_two_millimetres() -> None:
    """36 x 2 mm of the circumference, at three radii, and scatter a laser's light."""
    wheel = spoked_wheel(0.345, 0.021)
    wires = wheel.corners_m[wheel.slots == VehicleSlot.SPOKE].reshape(-1, 3, 3)[..., [0, 2]]
    edges = np.roll(wires, -1, axis=1) - wires
    turn = np.linspace(0.0, 2.0 * np.pi, 6000, endpoint=False)
    for radius_m in (0.1, 0.17, 0.25):
        p = radius_m * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        away = p[:, None, None] - wires
        side = np.sign(edges[..., 0] * away[..., 1] - edges[..., 1] * away[..., 0])
        covered = (np.abs(side.sum(axis=2)) == 3).any(axis=1).mean()
        assert covered == pytest.approx(36 * 0.002 / (2.0 * np.pi * radius_m), rel=0.15)

    (steel,) = (m for m in VARIANTS[0].materials if m.metallic == 0.5)
    even, *_ = infrared_fields(steel, np.asarray(steel.base_color))
    assert even > 0.2
