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
from tests.embree import RayCaster
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
        # The lowest step may lie in the ground; what is left to step down is no more than a riser.
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
