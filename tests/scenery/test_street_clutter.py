"""Street clutter: sizes, fronts, tags and variety of every family."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.assets.family import Solid
from gen_data.content.scenery import FAMILIES
from gen_data.content.scenery.utility_lines import utility_pole
from gen_data.core import asset_types, errors, scene, se3
from gen_data.randomizers.free_space import Footprint, is_clear, make_ground
from tests import solids, tiers
from tests.randomizers.doubles import FakeAssets
from tests.scenery.clutter_limits import CLUTTER

ACROSS = (
    "fence", "garden_wall", "road_barrier", "construction_fence", "scaffold", "skip_container",
)  # fmt: skip
"""Families that run along Y, next to a street."""
ALONG = ("parked_bicycle", "kick_scooter", "trailer", "dog", "pram")
"""Families that point along X, as vehicles do."""


def test_the_families_tagged_as_clutter_are_those_of_the_table() -> None:
    """A family without a stated size, or without its tag, is noticed."""
    tagged = {name for name, family in FAMILIES.items() if "street_clutter" in family.tags}

    assert tagged == set(CLUTTER)


@pytest.mark.parametrize("name", tiers.sampled(CLUTTER, 5))
def test_every_variant_is_as_long_and_wide_as_real_ones(name: str) -> None:
    """Extents along X and Y; heights and triangles are checked for all scenery."""
    limits = CLUTTER[name]
    assert FAMILIES[name].variants >= limits.variants
    for seed in range(min(8, FAMILIES[name].variants)):
        low, high = (np.array(edge) for edge in solids.variant(name, seed).mesh.bounds_m())
        length, width, _ = high - low
        assert limits.length_m[0] <= length <= limits.length_m[1], seed
        assert limits.width_m[0] <= width <= limits.width_m[1], seed
        assert abs(low[2]) < 1e-5, seed


@pytest.mark.parametrize("name", tiers.sampled(CLUTTER, 5))
def test_all_variants_differ(name: str) -> None:
    """No two seeds that are offered for selection are the same object."""
    seeds = range(FAMILIES[name].variants)

    assert len({solids.digest(solids.variant(name, seed)) for seed in seeds}) == len(seeds)


@pytest.mark.parametrize("name", CLUTTER)
def test_surfaces_face_outward(name: str) -> None:
    """Closed parts prevail, so triangles turned inside out would make the volume negative."""
    for seed in range(4):
        mesh = solids.variant(name, seed).mesh
        assert solids.volume_m3(mesh.vertices_m[mesh.faces].astype(np.float64)) > 0.0, seed


@pytest.mark.parametrize("name", [*ACROSS, *ALONG])
def test_pieces_extend_along_the_axis_of_their_kind(name: str) -> None:
    """Panels line a street along Y; vehicles point along X."""
    for seed in range(4):
        low, high = (np.array(edge) for edge in solids.variant(name, seed).mesh.bounds_m())
        length, width, _ = high - low
        if variant_is_upright_and_single(name, seed):
            assert (width > length) == (name in ACROSS), seed


def test_cables_of_different_poles_meet_at_mid_span() -> None:
    """Every variant's cables end at the same places: any two poles join."""
    half = 20.0
    ends = [cable_ends(utility_pole(seed, 2 * half), half) for seed in range(6)]

    assert len(ends[0]) == 5
    for seed in range(1, 6):
        assert np.allclose(ends[seed], ends[0], atol=2e-3)


@pytest.mark.parametrize("span_m", [-1.0, 81.0])
def test_spans_that_no_pole_carries_are_refused(span_m: float) -> None:
    with pytest.raises(errors.AssetError, match="span_m"):
        utility_pole(0, span_m)


def test_the_body_of_a_pole_leaves_out_its_cables() -> None:
    """Its bounds do not depend on the span, and lie symmetrically across the line."""
    for seed in range(6):
        with_cables, alone = utility_pole(seed, 35.0), utility_pole(seed, 0.0)
        assert with_cables.body_bounds_m == alone.mesh.bounds_m()
        low, high = with_cables.mesh.bounds_m()
        assert low[:2] == pytest.approx((-high[0], -high[1]), abs=1e-6), seed


class PoleAssets(FakeAssets):
    """Every asset is a pole of 0.4 m whose cables reach 17.5 m on both sides."""

    category = "utility_pole"

    def get(self, asset_id: str) -> asset_types.Asset:
        return replace(super().get("brick"), category=self.category)

    def bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3]:
        return (-17.5, -0.9, 0.0), (17.5, 0.9, 9.0)

    def body_bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3]:
        return (-0.2, -0.2, 0.0), (0.2, 0.2, 9.0)


class VehicleAssets(PoleAssets):
    """The same shape as a vehicle's, whose mirrors do take room."""

    category = "truck"


@pytest.mark.parametrize(("assets", "is_free"), [(PoleAssets(), True), (VehicleAssets(), False)])
def test_things_may_stand_below_the_cables_of_poles(assets: PoleAssets, is_free: bool) -> None:
    """Only the pole itself takes room, of the ground and of views."""
    body = scene.Body("pole", "pole", se3.SE3(), instance_id=1)
    ground = make_ground((body,), assets)

    assert not ground.is_free(Footprint(0.0, 0.0, 0.1, 0.1, 0.0))
    assert ground.is_free(Footprint(5.0, 0.0, 0.1, 0.1, 0.0)) == is_free
    assert is_clear((5.0, 0.0, 1.5), scene.Scene("test", bodies=(body,)), assets, 0.1) == is_free


def cable_ends(solid: Solid, half_m: float) -> list[tuple[float, float]]:
    """Middles (y, z) of the cables' ends at +X, sorted by y."""
    points = solid.mesh.vertices_m.astype(np.float64)
    at_end = np.unique(points[np.abs(points[:, 0] - half_m) < 1e-4][:, 1:].round(5), axis=0)
    groups: list[list[np.ndarray]] = []
    for point in at_end:
        near = [group for group in groups if np.abs(group[0] - point).max() < 0.05]
        if near:
            near[0].append(point)
        else:
            groups.append([point])
    return [tuple(np.mean(group, axis=0).tolist()) for group in groups]


def variant_is_upright_and_single(name: str, seed: int) -> bool:
    """Not a row in a rack, nothing that has fallen over."""
    family = FAMILIES[name]
    assert family.facts is not None
    parking = family.facts(seed=seed, **family.parameters).attributes.get("parking", "")
    return parking not in {"rack", "hoop_pair", "fallen"}
