"""Everything that lines a street: sizes, budgets, frames, facts and bytes."""

import numpy as np
import pytest

from gen_data.assets.family import Solid
from gen_data.content.scenery import FAMILIES, TEXTURES
from gen_data.core.errors import AssetError
from tests.every_value import for_every
from tests.scenery.clutter_limits import CLUTTER
from tests.solids import variant
from tests.tiers import first_and_all, sampled

# Height range [m] of real ones, and the largest number of triangles that a street affords.
LIMITS = {
    "building/residential": (8.0, 24.0, 6000), "building/old_town": (12.0, 28.0, 6500),
    "building/modern": (9.0, 24.0, 6500), "building/commercial": (7.0, 30.0, 6500),
    "building/house": (5.0, 14.0, 6000), "garage": (2.5, 3.2, 6000),
    "building/villa": (7.0, 22.0, 6000), "building/farmhouse": (5.0, 19.0, 6000),
    "building/warehouse": (4.5, 22.0, 6000), "building/office": (9.0, 34.0, 7000),
    "building/campus": (7.0, 26.0, 7000), "building/tower": (24.0, 52.0, 7000),
    "building/garage": (2.5, 3.2, 6000), "building/shed": (1.9, 5.0, 3000),
    "tree/broad": (7.0, 13.5, 12000), "tree/round": (4.5, 7.5, 12000),
    "tree/columnar": (7.0, 13.5, 12000), "tree/birch": (7.0, 13.0, 12000),
    "tree/young": (3.2, 5.5, 12000), "tree/conifer": (5.5, 12.5, 12000),
    "tree_spring": (3.0, 26.0, 12000), "tree_autumn": (3.0, 26.0, 12000),
    "tree_winter": (3.0, 26.0, 12000),
    "tree/linden": (10.2, 20.7, 12000),
    "tree/norway_maple": (8.5, 17.2, 12000),
    "tree/sycamore": (10.2, 20.7, 12000),
    "tree/plane": (11.9, 24.1, 12000),
    "tree/oak": (10.2, 21.8, 12000),
    "tree/horse_chestnut": (9.3, 19.5, 12000),
    "tree/ash": (10.2, 21.8, 12000),
    "tree/robinia": (8.5, 18.4, 12000),
    "tree/hornbeam": (6.8, 16.1, 12000),
    "tree/beech": (11.9, 24.1, 12000),
    "tree/ginkgo": (7.6, 17.2, 12000),
    "tree/willow": (7.6, 17.2, 12000),
    "tree/poplar": (12.8, 27.6, 12000),
    "tree/cherry": (3.8, 9.2, 12000),
    "tree/apple": (3.0, 6.9, 12000),
    "tree/rowan": (4.7, 10.3, 12000),
    "tree/hawthorn": (3.0, 6.9, 12000),
    "tree/alder": (7.6, 17.2, 12000),
    "tree/tree_of_heaven": (8.5, 20.7, 12000),
    "tree/pine": (7.6, 19.5, 12000),
    "tree/thuja": (3.0, 9.2, 12000),
    "hedge": (0.7, 3.7, 3500), "shrub": (0.4, 3.2, 3000), "grass_tuft": (0.08, 0.8, 300),
    "flower_bed": (0.15, 0.8, 1500), "ivy_wall": (1.6, 6.6, 2000),
    "bush": (0.6, 2.2, 6000), "planter": (0.5, 1.2, 1500),
    "horizon/trees": (6.0, 22.0, 3000), "horizon/forest": (12.0, 30.0, 5000),
    "horizon/hills": (12.0, 100.0, 6000), "horizon/skyline": (12.0, 90.0, 1500),
    "horizon/town": (7.0, 50.0, 1500),
    "overpass": (6.5, 7.6, 1500), "embankment": (6.0, 7.0, 400),
    "railway_track": (0.5, 0.6, 1500), "tram_pole": (7.0, 7.4, 200),
    "petrol_shop": (3.5, 4.3, 600), "price_sign": (4.9, 7.6, 600), "fountain": (0.9, 3.7, 1500),
    "straw_bale": (0.85, 2.0, 900), "power_pylon": (26.0, 36.0, 2000),
    "street_light": (6.0, 9.0, 1500), "litter_bin": (0.8, 1.4, 1500), "bench": (0.4, 1.0, 1500),
    "hydrant": (0.7, 1.0, 1500), "bollard": (0.6, 1.1, 1500), "cone": (0.45, 0.8, 1500),
    "guide_post": (0.94, 1.06, 200),
    "post_box": (1.1, 1.6, 1500), "bus_stop": (2.3, 2.8, 1500),
    "cabinet": (0.9, 1.4, 1500), "bike_rack": (0.7, 0.9, 1500), "barrier": (0.7, 1.3, 1500),
    "traffic_light": (2.6, 7.0, 1600), "drone": (0.06, 0.12, 1500), "gimbal": (0.05, 0.1, 500),
    "pedestrian_signal": (2.4, 3.3, 1500), "traffic_sign": (2.1, 3.3, 1500),
    # A path is as high as its slabs, a terrace as its parasol.
    "terrace": (0.02, 3.1, 1200), "garden_path": (0.05, 0.08, 200), "door_stairs": (0.5, 0.5, 200),
    # The ramp rises by 0.41 m, its handrails by 0.88 m more.
    "door_ramp": (1.29, 1.32, 600),
    **{name: (*limits.height_m, limits.triangles) for name, limits in CLUTTER.items()},
}  # fmt: skip

ROLES = {
    "", "facade", "grass", "window", "roof", "trim", "chrome", "sign", "bark", "leaf", "lamp",
    "glass", "lens_red", "lens_yellow", "lens_green", "lens_stop", "lens_walk", "paint",
    "underbody", "tyre", "rim", "headlight", "taillight",
}  # fmt: skip


for_every_variant = for_every(
    [(name, seed) for name in FAMILIES for seed in (0, 1)], lambda key: (key[0], variant(*key))
)
"""The first variants of every family."""


def test_every_family_has_a_stated_height_a_budget_and_facts() -> None:
    """A new family must state the height of the real object and its largest cost."""
    assert set(LIMITS) == set(FAMILIES)
    assert all(family.facts for family in FAMILIES.values())


@first_and_all
@pytest.mark.parametrize("name", sampled(FAMILIES, 4))
def test_every_variant_is_as_high_as_real_ones_and_in_budget(name: str, how_many: str) -> None:
    """The first two, or all seeds that are offered for selection; a dozen of large families."""
    low, high, triangles = LIMITS[name]
    count = FAMILIES[name].variants
    for seed in range(2) if how_many == "first" else range(0, count, 1 + count // 28 * 3):
        mesh = variant(name, seed).mesh
        assert low <= mesh.bounds_m()[1][2] <= high, seed
        assert 30 <= len(mesh.faces) <= triangles, seed


@for_every_variant
def test_it_stands_on_the_ground_around_its_origin(built: tuple[str, Solid]) -> None:
    """Nothing reaches below z = 0, something touches it, and the origin is under it."""
    name, solid = built
    low, high = solid.mesh.bounds_m()

    assert low[2] == pytest.approx(
        0.0, abs=0.03 if name.startswith(("bush", "hedge", "shrub", "ivy")) else 1e-5
    )
    assert low[2] >= -1e-6
    assert low[0] < 0.0 < high[0]
    assert low[1] < 0.0 < high[1]


@for_every_variant
def test_materials_are_used_and_dark_and_have_known_roles(built: tuple[str, Solid]) -> None:
    """Randomizers look for roles."""
    mesh = built[1].mesh

    assert set(mesh.face_slots.tolist()) == set(range(len(mesh.materials)))
    for material in mesh.materials:
        assert material.role in ROLES
        assert material.emission_cd_m2 == (0.0, 0.0, 0.0)


@for_every_variant
def test_collision_lies_within_the_mesh_bounds(built: tuple[str, Solid]) -> None:
    name, solid = built
    low, high = solid.mesh.bounds_m()
    points = np.concatenate(solid.collision.parts_m)

    assert (points >= np.array(low) - 0.1).all(), name
    assert (points <= np.array(high) + 0.1).all(), name


@pytest.mark.parametrize(("name", "parameters"), [
    ("building/house", {"style": "huose"}),
    ("building/house", {"style": "house", "region": "nroth"}),
    ("tree/birch", {"species": "palm", "leaves": 1.0}),
    ("tree/birch", {"species": "birch", "leaves": 1.5}),
    ("traffic_sign", {"sign": "stopp"}),
    ("traffic_light", {"mount": "poel"}),
    ("barrier", {"style": "jersy"}),
    ("fence", {"style": "pickts"}),
])  # fmt: skip
def test_unknown_parameters_are_refused_by_name(name: str, parameters: dict[str, object]) -> None:
    wrong = next(str(v) for v in parameters.values() if v not in ("birch", "house", 1.0))
    with pytest.raises(AssetError, match=wrong):
        FAMILIES[name].build(seed=0, **parameters)


@pytest.mark.parametrize("name", sampled(TEXTURES, 5))
def test_textures_are_repeatable_images(name: str) -> None:
    """8 bits per channel; two builds are equal; all maps have one size."""
    family = TEXTURES[name]
    first, second = (family.build(seed=0, **family.parameters) for _ in range(2))

    assert (first.albedo.dtype, first.albedo.ndim) == (np.uint8, 3)
    assert (first.albedo == second.albedo).all()
    assert first.albedo.std() > 3.0
    if first.normal is not None:
        assert first.normal.shape == first.albedo.shape
