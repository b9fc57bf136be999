"""Symmetries of procedural objects, measured on their meshes."""

import math
from typing import Any

import numpy as np
import pytest

from gen_data.assets.library import Library
from gen_data.core.asset_types import MeshData, Symmetry
from gen_data.core.se3 import SE3
from tests.distances import distances_m

TOLERANCE = 0.005
"""Share of an object's diagonal; polygons stand for circles with 8 to 48 corners."""

ANY_ANGLE_RAD = 1.0
"""Turn that stands for all of a continuous symmetry; no simple part of a circle."""

STATED = {"bollard": {0}, "bowl": {0, 16}, "candle": {0}, "cone": {4}, "connector": {2, 4},
          "cup": {0}, "flange": {4, 6, 8}, "gear": {2, 14, 16, 18, 20, 24}, "hex_bolt": {6},
          "nut": {2, 6}, "pipe_elbow": {2}, "plate": {0}, "screwdriver": {0, 2, 6, 8},
          "stepped_shaft": {0}, "toy_block": {2}, "tumbler": {0, 8, 10, 12, 16}, "vase": {0},
          "washer": {0, 2}, "wine_glass": {0}}  # fmt: skip
"""Folds by family that may occur."""


def turned(points_m: np.ndarray, symmetry: Symmetry) -> np.ndarray:
    angle_rad = 2.0 * math.pi / symmetry.fold if symmetry.fold else ANY_ANGLE_RAD
    x, y, z = (math.sin(0.5 * angle_rad) * v for v in symmetry.axis)
    turn = SE3((0.0, 0.0, 0.0), (math.cos(0.5 * angle_rad), x, y, z)).rotation()
    offset_m = np.asarray(symmetry.offset_m)
    return np.asarray((points_m - offset_m) @ turn.T + offset_m)


def deviation(mesh: MeshData, symmetry: Symmetry) -> float:
    """Hausdorff distance of the turned from the original mesh, per slot, over its diagonal.

    A turn is an isometry of finite order, or one of a circle: the largest distance of turned points
    from the surface is that of the surface from turned points.
    """
    corners_m = mesh.vertices_m[mesh.faces].astype(np.float64)
    worst_m = 0.0
    for slot in np.unique(mesh.face_slots):
        mine_m = corners_m[mesh.face_slots == slot]
        # Corners and centres of triangles: long thin ones bend away from a circle in the middle.
        points_m = np.concatenate([mine_m.reshape(-1, 3), mine_m.mean(axis=1)])
        points_m = np.unique(points_m, axis=0)
        worst_m = max(worst_m, distances_m(turned(points_m, symmetry), mine_m).max())
    return worst_m / float(np.linalg.norm(np.ptp(corners_m.reshape(-1, 3), axis=0)))


def stated(library: Library, family: str) -> dict[str, tuple[Symmetry, ...]]:
    ids = [f"{family}?seed={k}" for k in range(6)]
    return {name: library.get(name).symmetries for name in ids}


@pytest.mark.slow
@pytest.mark.parametrize("family", STATED)
def test_a_turn_leaves_the_mesh_in_place(family: str, library: Library) -> None:
    found = stated(library, family)
    assert {s.fold for listed in found.values() for s in listed} <= STATED[family]
    assert any(found.values())
    for name, symmetries in found.items():
        mesh = library.mesh(name)
        for symmetry in symmetries:
            assert deviation(mesh, symmetry) < TOLERANCE, (name, symmetry)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asset", "folds"),
    [("box?size_m=0.2,0.2,0.3", {2, 4}), ("box?size_m=0.2,0.25,0.3", {2}), ("pedestal", {4}),
     ("sphere?diameter_m=0.3", {0})],
)  # fmt: skip
def test_parametric_objects_have_folds(asset: str, folds: set[int], library: Library) -> None:
    """Their origin is on the floor; equal sides have quarter turns."""
    symmetries = library.get(asset).symmetries
    assert {s.fold for s in symmetries} == folds
    for symmetry in symmetries:
        assert deviation(library.mesh(asset), symmetry) < TOLERANCE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asset", "wrong"),
    [("mug?seed=0", Symmetry((0.0, 0.0, 1.0), 0)),
     ("gear?seed=0", Symmetry((0.0, 0.0, 1.0), 7 * 11)),
     ("flange?seed=0", Symmetry((0.0, 0.0, 1.0), 5)), ("cup?seed=0", Symmetry((1.0, 0.0, 0.0), 2)),
     ("sphere", Symmetry((1.0, 0.0, 0.0), 0)),
     ("screwdriver?seed=0", Symmetry((0.0, 0.0, 1.0), 2))],
)  # fmt: skip
def test_other_turns_are_found_out(asset: str, wrong: Any, library: Library) -> None:
    assert deviation(library.mesh(asset), wrong) > TOLERANCE


@pytest.mark.slow
@pytest.mark.parametrize("family", ["mug", "bottle", "can", "carton", "ball", "bracket", "hammer"])
def test_printed_and_lopsided_objects_have_none(family: str, library: Library) -> None:
    assert not any(stated(library, family).values())
