"""Surfaces that carry things and are not tops: seats, rims and trays."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest

from gen_data.generator.assets.interiors.parts import SUPPORT
from tests.rooms.test_layouts import library

SIDE = 24


def heights_m(asset_id: str) -> np.ndarray:
    """What rays from above meet over the surface, relative to its height, [SIDE^2]."""
    mesh = library().mesh(asset_id)
    rays = o3d.t.geometry.RaycastingScene()
    rays.add_triangles(mesh.vertices_m.astype(np.float32), mesh.faces.astype(np.uint32))
    corners = [k.position_m for k in library().keypoints(asset_id) if k.name == SUPPORT]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    axes = [np.linspace(a, b, SIDE) for a, b in zip(low[:2], high[:2], strict=True)]
    x, y = (grid.ravel() for grid in np.meshgrid(*axes))
    zero = np.zeros_like(x)
    down = np.stack([x, y, zero + 5.0, zero, zero, zero - 1.0], axis=1)
    hits = rays.cast_rays(o3d.core.Tensor(down.astype(np.float32)))["t_hit"].numpy()
    return 5.0 - hits - low[2]


@pytest.mark.parametrize("family", ["armchair", "chair", "sofa", "trolley", "wash_basin"])
def test_nothing_sticks_out_of_a_surface_that_carries_things(family: str) -> None:
    """Neither piping nor pillows nor throws: things would stand in them. Cushions sag a little."""
    variants = [a.asset_id for a in library().find(()) if a.asset_id.startswith(f"{family}?")]
    assert len(variants) >= 8
    for asset_id in variants:
        above_m = heights_m(asset_id)
        assert above_m.max() < 0.001, asset_id
        assert np.percentile(above_m, 10) > -0.005, asset_id
