"""Surfaces that carry objects and are not tops: seats, rims and trays."""

import numpy as np
import pytest

from gen_data.core.keypoint_names import SUPPORT
from tests.embree import RayCaster
from tests.rooms.test_layouts import library

SIDE = 24


def heights_m(asset_id: str) -> np.ndarray:
    """Heights at which rays from above end over the surface, relative to its height, [SIDE^2]."""
    mesh = library().mesh(asset_id)
    corners = [k.position_m for k in library().keypoints(asset_id) if k.name == SUPPORT]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    axes = [np.linspace(a, b, SIDE) for a, b in zip(low[:2], high[:2], strict=True)]
    x, y = (grid.ravel() for grid in np.meshgrid(*axes))
    above = np.stack([x, y, np.full_like(x, 5.0)], axis=1)
    hits = RayCaster((mesh.vertices_m, mesh.faces)).cast(above, (0.0, 0.0, -1.0))
    return 5.0 - hits.distance - low[2]


@pytest.mark.slow
@pytest.mark.parametrize("family", ["armchair", "chair", "sofa", "trolley", "wash_basin"])
def test_nothing_sticks_out_of_a_surface_that_carries_things(family: str) -> None:
    """Neither piping nor pillows nor throws: objects would stand in them. Cushions sag a little."""
    variants = [a.asset_id for a in library().find(()) if a.asset_id.startswith(f"{family}?")]
    assert len(variants) >= 8
    for asset_id in variants:
        above_m = heights_m(asset_id)
        assert above_m.max() < 0.001, asset_id
        assert np.percentile(above_m, 10) > -0.005, asset_id
