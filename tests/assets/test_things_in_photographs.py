"""Bottles, prints and supports of objects as in photographs."""

from collections.abc import Callable

import numpy as np
import pytest

from gen_data.assets.families import declared
from gen_data.content.procedural import FAMILIES, containers, fruit_bough
from gen_data.content.procedural.bottles import choose_bottle
from gen_data.content.procedural.fruit import fruit_kind
from gen_data.content.procedural.textures.pictures import MANNERS, picture
from gen_data.content.procedural.textures.tableware_prints import ceramic_decor
from gen_data.content.procedural.vessel_contents import CONTENTS
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import variant_rng

WANTED = {"apple", "orange", "banana", "bottle", "cup", "mug", "drinking glass", "wine glass"}
LIKE = ("pomegranate", "onion", "persimmon", "courgette", "jug", "carafe", "canister", "plant_pot")
STAND_M = (0.9, 0.8, 0.5)


def _bottle_of(kind: str) -> int:
    return next(seed for seed in range(84) if choose_bottle(seed).kind == kind)


@pytest.mark.parametrize("kind", ["tinted", "waisted", "crushed", "soda"])
def test_bottles_of_plastic_let_light_through_to_the_level_of_their_drink(kind: str) -> None:
    """The drink is inside the wall at its height, and below the neck."""
    mesh = FAMILIES["bottle"].build(seed=_bottle_of(kind)).mesh
    roles = [material.role for material in mesh.materials]
    drink = mesh.vertices_m[np.unique(mesh.faces[mesh.face_slots == roles.index(CONTENTS)])]
    wall = mesh.vertices_m[np.unique(mesh.faces[mesh.face_slots == 0])]
    assert mesh.materials[0].transmission == 1.0
    assert drink[:, 2].max() < wall[:, 2].max() - 0.01
    assert np.hypot(*drink[:, :2].T).max() < np.hypot(*wall[:, :2].T).max()


def test_crushed_bottles_are_dented_by_a_tenth_of_their_radius_and_others_are_round() -> None:
    """Radii 4 to 6 cm above the foot; grooves are 1.2 mm deep."""
    for kind, low, high in (("crushed", 0.1, 0.7), ("tinted", 0.0, 0.05)):
        mesh = FAMILIES["bottle"].build(seed=_bottle_of(kind)).mesh
        wall = mesh.vertices_m[np.unique(mesh.faces[mesh.face_slots <= 1])].astype(np.float64)
        z = wall[:, 2] - wall[:, 2].min()
        radii = np.hypot(*wall[(z > 0.04) & (z < 0.06), :2].T)
        assert low <= np.ptp(radii) / radii.max() <= high, kind


@pytest.mark.parametrize("manner", MANNERS)
def test_pictures_are_made_as_asked_and_differ_by_seed(manner: str) -> None:
    """Lines have few colours, photographs hundreds; both manners fill the whole image."""
    made = [
        np.asarray(picture(160, 120, (244, 241, 234), variant_rng("t", seed), manner))  # type: ignore[arg-type]
        for seed in range(4)
    ]
    colors = [len(np.unique(image.reshape(-1, 3), axis=0)) for image in made]
    assert all(image.shape == (120, 160, 3) for image in made)
    assert len({image.tobytes() for image in made}) >= 3
    assert max(colors) <= 3 if manner == "lines" else min(colors) >= 4
    assert min(colors) > 500 or manner != "photograph"


def test_prints_of_mugs_show_the_same_picture_on_both_sides_of_the_handle() -> None:
    """Or one all around, which is a quarter of them."""
    both = 0
    for seed in range(12):
        image = ceramic_decor(seed=seed, kind="cartoon").albedo.astype(np.float64)
        both += np.abs(image[:, :256] - image[:, 256:]).mean() < 2.0
    assert 6 <= both <= 12


def test_look_alikes_have_no_category_of_what_they_resemble() -> None:
    """They are on no list of household objects: only close-ups have them."""
    for name in LIKE:
        family = FAMILIES[name]
        assert family.category not in WANTED
        assert "look_alike" in family.tags
        assert "household" not in family.tags


def test_crates_of_a_stand_carry_at_their_tiers_and_are_free_above() -> None:
    """Points 1 mm below and above the middle of each floor."""
    solid = FAMILIES["market_stand"].build(size_m=STAND_M, seed=1)
    tiers = declared("market_stand", "tiers")(STAND_M)
    assert len(tiers) == 3
    assert [at[2] for at, *_ in tiers] == sorted(at[2] for at, *_ in tiers)
    low, high = solid.mesh.bounds_m()
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    assert high[2] <= STAND_M[2] + 1e-6
    for (x, y, z), tilt, _ in tiers:
        up = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
        for away, inside in ((-0.001, True), (0.001, False)):
            at = np.array([x, y, z]) + away * up
            assert any(_contains(part, at) for part in solid.collision.parts_m) == inside


@pytest.mark.parametrize(
    ("name", "size_m", "interior", "beyond_m"),
    [("shopping_bag", (0.36, 0.24, 0.15), containers.bag_interior_m, 0.015),
     ("sink", (1.8, 0.62, 0.18), containers.sink_interior_m, 0.035)],
)  # fmt: skip
def test_floors_of_bags_and_sinks_carry_and_are_walled(
    name: str, size_m: Vec3, interior: Callable[[Vec3], Vec3], beyond_m: float
) -> None:
    """Solid below the floor, free above it, and solid beyond it at half the height."""
    parts = FAMILIES[name].build(size_m=size_m, seed=0).collision.parts_m
    length, width, floor = interior(size_m)

    def solid(x: float, y: float, z: float) -> bool:
        return any(_contains(part, np.array([x, y, z])) for part in parts)

    assert solid(0.0, 0.0, floor - 0.001)
    assert not solid(0.0, 0.0, floor + 0.002)
    for x, y in ((0.5 * length + beyond_m, 0.0), (0.0, 0.5 * width + beyond_m)):
        assert solid(x, y, 0.5 * size_m[2])
        assert solid(-x, -y, 0.5 * size_m[2])


def test_places_for_fruit_are_in_the_foliage_and_a_fruit_apart() -> None:
    """No nearer than 10 cm to one another; leaves surround them."""
    size_m = (1.1, 0.8, 0.8)
    hooks = np.array(fruit_bough.hooks_m(size_m, 3))
    away = np.linalg.norm(hooks[:, None] - hooks[None], axis=2) + np.eye(len(hooks))
    assert len(hooks) >= 12
    assert away.min() > 0.1
    assert (np.abs(hooks[:, :2]) < 0.5 * np.array(size_m[:2])).all()
    mesh = FAMILIES["fruit_bough"].build(size_m=size_m, seed=3).mesh
    leaves = mesh.vertices_m[np.unique(mesh.faces[mesh.face_slots > 0])]
    near = np.linalg.norm(leaves[:, None] - hooks[None].astype(np.float32), axis=2) < 0.12
    assert near.sum(axis=0).min() > 20


def _contains(part: np.ndarray, point: np.ndarray) -> bool:
    from scipy.spatial import ConvexHull

    equations = ConvexHull(part).equations
    return bool((equations[:, :3] @ point + equations[:, 3] <= 1e-9).all())


@pytest.mark.parametrize("group", ["apple", "orange", "lemon", "lime", "kiwi"])
def test_slices_of_fruit_are_discs_of_flesh_with_a_rim_of_skin(group: str) -> None:
    """Both faces are flesh; the volume equals a disc's with a slightly round rim."""
    seed = next(seed for seed in range(60) if fruit_kind(group, seed) == f"{group}/slice")
    mesh = FAMILIES[group].build(seed=seed).mesh
    a, b, c = mesh.vertices_m.astype(np.float64)[mesh.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    up = normals[:, 2] / np.linalg.norm(normals, axis=1).clip(1e-12)
    length_m, width_m, thick_m = np.ptp(mesh.vertices_m, axis=0).astype(np.float64).tolist()
    volume_m3 = (a * np.cross(b, c)).sum() / 6.0

    assert 0.0035 < thick_m < 0.013
    assert 0.94 < volume_m3 / (0.25 * np.pi * length_m * width_m * thick_m) < 1.0
    assert (up[mesh.face_slots == 1] > 0.99).sum() == (up[mesh.face_slots == 1] < -0.99).sum()
    assert np.abs(up[mesh.face_slots == 0]).max() < 0.6
