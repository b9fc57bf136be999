"""Dirt that gathers on vehicles, by place on the mesh."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.assets.family import Solid, Worn
from gen_data.config.distributions import Constant
from gen_data.content.procedural.wear import draw_wear
from gen_data.content.vehicles import FAMILIES, TEXTURES
from gen_data.content.vehicles.road_dirt import DUST, SEEDS, cleaned, is_soiled, soiled
from gen_data.core.asset_types import Material
from gen_data.core.colorimetry import srgb_decode
from gen_data.core.scene import Body, ObjectGroup, Scene
from gen_data.randomizers.vehicle_paint import VehiclePaint
from tests.every_value import for_every
from tests.randomizers.doubles import FakeAssets, rng_of
from tests.solids import build, new_and_worn

SOILED = sorted(name for name, family in FAMILIES.items() if isinstance(family.build, Worn))


def shares(solid: Solid, seed: int) -> tuple[np.ndarray, np.ndarray]:
    mesh, rng = solid.mesh, np.random.default_rng(0)
    painted = [k for k, m in enumerate(mesh.materials) if m.role == "paint" and is_soiled(m)]
    faces = mesh.faces[np.isin(mesh.face_slots, painted)]
    corners = mesh.vertices_m[faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(faces), 40_000, p=area / area.sum())
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(chosen))
    uvs = np.einsum("nk,nkd->nd", weights, mesh.uvs[faces[chosen]].astype(np.float64))
    image = TEXTURES["road_dirt"].build(seed % SEEDS, amount=1.0, paint="rgb000000").albedo
    height, width = image.shape[:2]
    rows = np.clip(((1.0 - uvs[:, 1]) * height).astype(int), 0, height - 1)
    columns = np.clip((uvs[:, 0] * width).astype(int), 0, width - 1)
    linear = srgb_decode(image[rows, columns, 0].astype(np.float64) / 255.0)
    return np.einsum("nk,nkd->nd", weights, corners[chosen]), linear / DUST[0]


@pytest.mark.slow
@for_every([("car", s) for s in range(0, 124, 13)] + [("van", 3), ("taxi", 1)])
def test_dirt_lies_low_behind_wheels_and_on_the_rear(variant: tuple[str, int]) -> None:
    """Places in metres, from the keypoints of the wheels."""
    solid = build(*variant)
    places, share = shares(solid, variant[1])
    x, y, z = places.T
    hubs = {p.name: p.position_m for p in solid.keypoints}
    front, radius = hubs["wheel_front_left"][0], hubs["wheel_front_left"][2]
    assert solid.body_bounds_m is not None
    (low_x, _, _), (high_x, high_y, top) = solid.body_bounds_m
    side = np.abs(y) > 0.75 * high_y
    sill, waist = side & (z < 0.28 * top), side & (z > 0.55 * top)
    level = side & (z > 1.2 * radius) & (z < 1.7 * radius)
    behind = level & (x < front - 1.1 * radius) & (x > front - 2.0 * radius)
    further = level & (x > front - 3.9 * radius) & (x < front - 3.0 * radius)
    tail, nose = x < low_x + 0.05 * (high_x - low_x), x > high_x - 0.05 * (high_x - low_x)
    upper = (z > 0.35 * top) & (z < 0.65 * top)

    assert share[sill].mean() > 2.5 * share[waist].mean()
    assert share[tail & upper].mean() > 1.5 * share[nose & upper].mean()
    assert share[behind].mean() > 1.2 * share[further].mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", SOILED)
def test_shape_and_print_stay_as_they_are(name: str) -> None:
    """Coordinates of soiled slots lie in the image of the dirt."""
    for seed in (0, FAMILIES[name].variants - 1):
        new, used = new_and_worn(name, seed)
        dirty = [k for k, m in enumerate(used.materials) if is_soiled(m)]
        assert dirty == [
            k for k, m in enumerate(used.materials) if m.texture != new.materials[k].texture
        ]
        assert (np.abs(used.uvs[used.faces[np.isin(used.face_slots, dirty)]] - 0.5) <= 0.5).all()


@pytest.mark.slow
def test_older_vehicles_are_dirtier() -> None:
    """The amount in the texture follows the variant's wear, in tenths."""
    for seed in range(12):
        paint = next(m for m in build("car", seed).mesh.materials if m.role == "paint")
        amount = float(paint.texture.partition("amount=")[2].partition("&")[0])

        assert amount == pytest.approx(draw_wear("car", seed), abs=0.051)


@pytest.mark.slow
def test_brake_dust_darkens_and_dulls_rims() -> None:
    for seed in range(4):
        new, used = (
            next(m for m in mesh.materials if m.role == "rim") for mesh in new_and_worn("car", seed)
        )
        assert used.roughness > new.roughness
        assert all(u <= n + 1e-6 for u, n in zip(used.base_color, new.base_color, strict=True))


@pytest.mark.slow
@for_every([(0.012, 0.011, 0.014), (0.8, 0.8, 0.78), (0.25, 0.01, 0.012)])
def test_a_clean_texture_is_paint_and_a_dirty_one_nears_dust(
    color: tuple[float, float, float],
) -> None:
    """Within a step of 8 bits; the dirtiest place is mostly dust."""
    paint = replace(Material(), base_color=color, roughness=0.2, role="paint")
    fields = dict(f.split("=") for f in soiled(paint, 1.0, 1).texture.partition("?")[2].split("&"))

    def decoded(amount: float) -> np.ndarray:
        made = TEXTURES["road_dirt"].build(1, amount=amount, paint=fields["paint"])
        return np.asarray(srgb_decode(made.albedo.astype(np.float64) / 255.0))

    assert decoded(0.0).reshape(-1, 3) == pytest.approx(
        np.broadcast_to(color, (64 * 256, 3)), abs=0.005
    )
    toward = (decoded(1.0) - color) @ (np.array(DUST) - color)
    assert 0.6 < toward.max() / ((np.array(DUST) - color) @ (np.array(DUST) - color)) <= 1.0


def test_washing_gives_the_plain_paint_back() -> None:
    """Colour within 8 bits, gloss, no texture."""
    paint = Material((0.3, 0.05, 0.02), roughness=0.22, specular=0.6, role="paint")
    plain, seed = cleaned(soiled(paint, 0.7, 6))

    assert seed == 6 % SEEDS
    assert plain.texture == "" and plain.role == "paint"
    assert plain.base_color == pytest.approx(paint.base_color, abs=0.003)
    assert plain.roughness == pytest.approx(0.22, abs=1e-4)


@pytest.mark.parametrize("anew", [False, True])
def test_the_randomizer_washes_paints_and_soils_again(anew: bool) -> None:
    """No dirt gives plain paint, more dirt a larger amount; unsoiled vehicles get no texture."""
    old = Material((0.3, 0.05, 0.02), roughness=0.22, specular=0.6, role="paint")
    slots = (soiled(old, 0.9, 2), replace(old, role="trim"))
    body = Body("traffic/0", "wagon", group="traffic", materials=slots)
    group = ObjectGroup("traffic", (), ("wagon",), 1, "along", lanes=("driving",))
    scene = Scene("t", bodies=(body,), groups=(group,))

    def painted(dirt: float) -> tuple[Material, ...]:
        painter = VehiclePaint(
            name="paint", probability=Constant(anew), dirt=Constant(dirt), weathered=Constant(False)
        )
        return painter(scene, FakeAssets(), rng_of()).bodies[0].materials

    plain, light, heavy = (painted(dirt) for dirt in (0.0, 0.1, 0.25))
    amounts = [
        float(m[0].texture.partition("amount=")[2].partition("&")[0]) for m in (light, heavy)
    ]

    assert plain[0].texture == ""
    if not anew:
        assert plain[0].base_color == pytest.approx(old.base_color, abs=0.003)
    assert 0.0 < amounts[0] < amounts[1] <= 1.0
    assert "seed=2" in heavy[0].texture
    assert light[1].texture == "" and heavy[1].roughness > light[1].roughness
