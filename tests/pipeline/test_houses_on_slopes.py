"""Houses on the relief of a street: rays of Embree fall onto the ground, and onto their stairs."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Body
from gen_data.core.se3 import SE3
from gen_data.pipeline import house_entrances
from tests.embree import RayCaster, placed
from tests.street_ground import Street
from tests.streets import FEW, SCENERY

GIVEN = (
    "shared.district=garden_villas", "shared.junction=none", "shared.course=straight",
    "shared.course_on=straight", "shared.landmark=none", "randomizers.relief.grade=0.08",
    "randomizers.relief.side_slope=0", "sensors.color.size_px=[64, 32]",
)  # fmt: skip


@pytest.fixture(scope="module")
def slope() -> Iterator[tuple[Street, AssetLibrary]]:
    """Villas 7 or 10 m behind a pavement that climbs by 8 %."""
    scenery = [name for name in SCENERY if name != "buildings"]
    config = load_config("street.yaml", overrides=(*FEW, *GIVEN), without=scenery)
    with open_pipeline(config) as pipeline:
        yield Street.first(pipeline), pipeline.assets


def _stairs(street: Street) -> list[tuple[Body, Body]]:
    """Houses and their stairs."""
    bodies = {body.name: body for body in street.scene.bodies}
    return [
        (bodies[name.rpartition("/")[0]], body)
        for name, body in bodies.items()
        if "/stairs" in name
    ]


@pytest.mark.slow
def test_stairs_lead_from_doors_to_the_ground(slope: tuple[Street, AssetLibrary]) -> None:
    """Landings are at the floor; steps of at most 18 cm fall to the ground before them."""
    street, assets = slope
    found = _stairs(street)
    assert len(found) >= 4
    for house, stairs in found:
        mesh = assets.mesh(stairs.asset)
        caster = RayCaster(
            (stairs.T_world_body.apply(mesh.vertices_m.astype(np.float64)), mesh.faces)
        )
        long_m = float(mesh.vertices_m[:, 0].max())
        way = np.arange(0.05, long_m, 0.05)
        places = stairs.T_world_body.apply(np.column_stack([way, 0.0 * way, 0.0 * way]))
        above = np.column_stack([places[:, :2], np.full(len(places), 60.0)])
        tops = 60.0 - caster.cast(above, (0.0, 0.0, -1.0)).distance.astype(np.float64)
        assert tops[0] == pytest.approx(house.T_world_body.translation_m[2], abs=0.002)
        drops = -np.diff(tops)
        assert drops.min() > -1e-4
        assert drops.max() < 0.1801
        ground = street.ground_m(places)
        # The lowest step may lie in the ground; the remaining step down is at most a riser.
        assert tops[-1] - ground[-1] < 0.18
        assert tops[0] - ground[0] > 0.04


@pytest.mark.slow
def test_ground_does_not_rise_above_floors_at_fronts(slope: tuple[Street, AssetLibrary]) -> None:
    """Where houses stand higher than their door, both ends of their front are clear of earth."""
    street, assets = slope
    for house, _ in _stairs(street):
        points = assets.vertices_m(house.asset) * house.scale
        low = points[points[:, 2] < points[:, 2].min() + 1.0]
        front, (right, left) = low[:, 0].max(), (low[:, 1].min(), low[:, 1].max())
        ends = house.T_world_body.apply(np.array([(front, right, 0.0), (front, left, 0.0)]))
        over = ends[:, 2] - street.ground_m(ends)
        # Gardens lie up to 0.1 m below the floors of level streets.
        assert -0.01 < over.min() < 0.1
        assert np.ptp(over) == pytest.approx(0.08 * math.dist(ends[0], ends[1]), abs=0.02)


@pytest.fixture(scope="module")
def ramps() -> Iterator[tuple[Street, AssetLibrary, list[Body]]]:
    """The same villas with paths and plants, and a ramp wherever there is room for one."""
    scenery = [name for name in SCENERY if name not in ("buildings", "paths", "garden_plants")]
    config = load_config("street.yaml", overrides=(*FEW, *GIVEN), without=scenery)
    with open_pipeline(config) as pipeline:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(house_entrances, "_has_ramp", lambda house: True)
            street = Street.first(pipeline)
        found = [b for b in street.scene.bodies if b.name.endswith("/ramp0")]
        yield street, pipeline.assets, found


def _surface(ramp: Body, assets: AssetLibrary) -> tuple[np.ndarray, np.ndarray]:
    """Places [n, 3] every 5 cm along the middle of a ramp, and distances from its upper end."""
    high_m = float(assets.vertices_m(ramp.asset)[:, 0].max())
    way = np.arange(0.01, high_m, 0.05)
    level = ramp.T_world_body.apply(np.column_stack([way, 0.0 * way, 0.0 * way]))
    above = np.column_stack([level[:, :2], np.full(len(way), 60.0)])
    down = RayCaster(placed(ramp, assets)).cast(above, (0.0, 0.0, -1.0)).distance
    on = np.isfinite(down)
    return np.column_stack([level[on, :2], 60.0 - down[on].astype(np.float64)]), way[on]


@pytest.mark.slow
def test_ramps_fall_by_6_percent_with_rests_from_the_landing_to_the_ground(
    ramps: tuple[Street, AssetLibrary, list[Body]],
) -> None:
    """DIN 18040-1: at most 6 %, runs of at most 6 m between rests of 1.5 m."""
    street, assets, found = ramps
    houses = {body.name: body for body in street.scene.bodies}
    assert len(found) >= 4
    longest = 0.0
    for ramp in found:
        places, way = _surface(ramp, assets)
        floor_m = houses[ramp.name.rpartition("/")[0]].T_world_body.translation_m[2]
        assert places[0, 2] == pytest.approx(floor_m, abs=0.002)
        grades = -np.diff(places[:, 2]) / np.diff(way)
        assert grades.min() > -1e-3
        assert grades.max() < 0.0605
        rests = way[1:][grades < 0.01]
        if way[-1] > 6.05:
            assert rests.min() == pytest.approx(6.0, abs=0.06)
            assert rests.max() == pytest.approx(7.5, abs=0.06)
        else:
            assert len(rests) == 0
        assert abs(places[-1, 2] - street.ground_m(places[-1:])[0]) < 0.02
        longest = max(longest, float(way[-1]))
    assert longest > 2.0


@pytest.mark.slow
def test_nothing_stands_on_ramps_and_their_paths(
    ramps: tuple[Street, AssetLibrary, list[Body]],
) -> None:
    """Rays that fall from 1.9 m above ramps, turning places and paths meet those first."""
    street, assets, found = ramps
    bodies = list(street.scene.bodies)
    own = {f"{ramp.name}{part}" for ramp in found for part in ("", "/turn", "/path")}
    caster = RayCaster(*(placed(body, assets) for body in bodies))
    for ramp in found:
        allowed = own | {body.name for body in bodies if body.asset.startswith("garden_path")}
        allowed |= {body.name for body in bodies if body.asset.startswith(("ground", "road"))}
        allowed.add(ramp.name.replace("/ramp", "/stairs"))
        for name in (ramp.name, f"{ramp.name}/turn", f"{ramp.name}/path"):
            body = street.scene.body(name)
            places, _ = _surface(body, assets)
            hits = caster.cast(places + np.array([0.0, 0.0, 1.9]), (0.0, 0.0, -1.0)).mesh
            assert {bodies[k].name for k in hits.tolist()} <= allowed, name


def test_a_share_of_houses_has_ramps_and_no_warehouse() -> None:
    """0.27 of houses with room for one, which makes 5 % of all houses with stairs."""

    def share(asset: str) -> float:
        places = np.random.default_rng(0).uniform(-200.0, 200.0, (4000, 2)).tolist()
        houses = [Body("house", asset, SE3((x, y, 0.1))) for x, y in places]
        return float(np.mean([house_entrances._has_ramp(house) for house in houses]))

    for style in ("house", "villa", "farmhouse"):
        assert share(f"building/{style}?seed=3") == pytest.approx(0.27, abs=0.03)
    assert share("building/warehouse?seed=3") == 0.0
