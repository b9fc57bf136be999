"""Paved areas along roads: forecourts and squares."""

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural.patches import Array, Patch, make_solid_in_place
from gen_data.content.roads.deck import surface
from gen_data.content.roads.road_materials import GROUNDS, ground_material, textured_material

_EDGE_M = 0.12


def paved_area(
    *, size_m: tuple[float, float] = (30.0, 20.0), cover: str = "paving", seed: int = 0
) -> Solid:
    """A level rectangle about the origin, its top at z = 0, with an edge of stone.

    Args:
        size_m: Extent along X and Y.
        cover: A word of ``GROUNDS``.
        seed: Seed of its texture.

    Raises:
        AssetError: the cover is unknown.
    """
    check_option("paved_area", "cover", cover, GROUNDS)
    x, y = 0.5 * size_m[0], 0.5 * size_m[1]
    plan = np.stack(np.meshgrid([-x, 0.0, x], [-y, 0.0, y], indexing="ij"), axis=2)
    points = np.concatenate([plan, np.zeros((3, 3, 1))], axis=2)
    top = surface(points, plan, "pavement", 0)
    corners = np.array([(x, -y), (x, y), (-x, y), (-x, -y)])
    sides = [_edge(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    kerb = textured_material("concrete?seed=1", "kerb", 0.85, (0.95, 0.94, 0.91))
    slab = np.array([[a, b, z] for a in (-x, x) for b in (-y, y) for z in (-0.3, 0.0)])
    return make_solid_in_place([top, *sides], (ground_material(cover, seed), kerb), [slab])


def _edge(start_m: Array, end_m: Array) -> Patch:
    """A row of edging stones along one side, counter-clockwise, and its outer face."""
    along = (end_m - start_m) / np.hypot(*(end_m - start_m))
    out = _EDGE_M * np.array([along[1], -along[0]])
    profile = ((out, -0.3), (0.999 * out, 0.003), (-out, 0.003))
    rows = [[[*(corner + away), z] for away, z in profile] for corner in (start_m, end_m)]
    length = float(np.hypot(*(end_m - start_m)))
    plan = np.array([[(s, t) for t in (-0.4, -0.1, 0.1)] for s in (0.0, length)])
    return surface(np.array(rows), plan, "kerb", 1)
