"""Furniture: it has the requested sizes, and objects can be put on and in it."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gen_data.assets.families import declared
from gen_data.assets.family import Solid
from gen_data.content.procedural import FAMILIES
from gen_data.content.procedural.furniture import bin_interior_m, shelf_clearance_m, shelf_levels_m
from gen_data.core.errors import AssetError

FURNITURE = sorted(name for name, family in FAMILIES.items() if not family.variants)
SIZED = ("table", "shelf", "bin", "box", "pedestal", "gantry")


@pytest.mark.parametrize("name", FURNITURE)
def test_defaults_build_finite_meshes_with_the_documented_slots(name: str) -> None:
    """Every parametric family stands for itself, with one material per named slot."""
    mesh = FAMILIES[name].build(**FAMILIES[name].parameters).mesh
    assert np.isfinite(mesh.vertices_m).all()
    assert np.isfinite(mesh.normals).all()
    assert len(mesh.materials) == len(declared(name, "slots"))
    assert set(np.unique(mesh.face_slots)) == set(range(len(declared(name, "slots"))))


@pytest.mark.parametrize("name", SIZED)
@pytest.mark.parametrize("size_m", [(1.6, 0.7, 0.9), (0.5, 0.4, 0.7)])
def test_the_box_is_the_size_asked_for(name: str, size_m: tuple[float, float, float]) -> None:
    """Centred on its footprint, standing on z = 0; collision agrees."""
    solid = FAMILIES[name].build(size_m=size_m)
    low, high = solid.mesh.bounds_m()
    points = np.concatenate(solid.collision.parts_m)
    assert np.allclose(low, (-size_m[0] / 2, -size_m[1] / 2, 0.0), atol=2e-6)
    assert np.allclose(high, (size_m[0] / 2, size_m[1] / 2, size_m[2]), atol=2e-6)
    assert np.abs(points.min(axis=0) - low).max() < 0.003
    assert np.abs(points.max(axis=0) - high).max() < 0.003


@pytest.mark.parametrize("shape", ["rectangle", "disk"])
def test_a_light_panel_shines_down_with_all_of_its_lower_side(shape: str) -> None:
    """The lamp's slot covers z = 0, faces down, and has the area of the shape; dark at first."""
    mesh = FAMILIES["light_panel"].build(size_m=(0.8, 0.5), shape=shape).mesh
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces[mesh.face_slots == 1]]
    normals = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(corners[..., 2]).max() == 0.0
    assert (normals[:, 2] < 0.0).all()
    expected = 0.4 if shape == "rectangle" else np.pi * 0.16
    assert -normals[:, 2].sum() == pytest.approx(expected, rel=0.002)
    assert (mesh.materials[1].role, mesh.materials[1].emission_cd_m2) == ("lamp", (0.0, 0.0, 0.0))
    assert mesh.bounds_m()[1][2] == pytest.approx(0.04)


@pytest.mark.parametrize("style", ["legs", "trestle", "bench"])
def test_every_table_style_has_a_flat_top_and_legs_to_the_floor(style: str) -> None:
    """A ball dropped above the top meets it at its height; the legs reach z = 0."""
    solid = FAMILIES["table"].build(size_m=(1.2, 0.8, 0.74), style=style)
    assert _highest_at(solid, 0.0, 0.0) == pytest.approx(0.74)
    assert _highest_at(solid, 0.5, 0.3) == pytest.approx(0.74)
    assert solid.mesh.bounds_m()[0][2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("style", ["bookcase", "rack"])
def test_shelf_levels_are_where_its_boards_are(style: str) -> None:
    """Each level carries, and the clearance above it is free and no more than free."""
    size_m, levels = (0.9, 0.32, 1.6), 4
    solid = FAMILIES["shelf"].build(size_m=size_m, levels=levels, style=style)
    free = shelf_clearance_m(size_m, levels)
    for z in shelf_levels_m(size_m, levels):
        assert _inside_any(solid, (0.0, 0.0, z - 0.001))
        assert not _inside_any(solid, (0.0, 0.0, z + 0.001))
        assert not _inside_any(solid, (0.0, 0.0, z + free - 0.001))
        assert _inside_any(solid, (0.0, 0.0, z + free + 0.001))


def test_things_fall_into_a_bin_and_stay_in_it_as_is_seen_from_inside() -> None:
    """Inside is free down to the floor; the floor and four walls are solid."""
    size_m = (0.6, 0.4, 0.22)
    solid = FAMILIES["bin"].build(size_m=size_m)
    length, width, floor = bin_interior_m(size_m)
    for a, b in ((0, 0), (0.49, 0), (0, 0.49), (-0.49, -0.49)):
        x, y = a * length, b * width
        assert not _inside_any(solid, (x, y, floor + 0.002))
        assert not _inside_any(solid, (x, y, 0.3))
        assert _inside_any(solid, (x, y, floor - 0.002))
    for x, y in ((0.51 * length, 0.0), (0.0, -0.51 * width)):
        assert _inside_any(solid, (x, y, 0.1))
    # The mesh's inner wall is where collision's is.
    mesh = solid.mesh
    inner = mesh.vertices_m[(mesh.normals[:, 2] > 0.9) & (mesh.vertices_m[:, 2] < 0.03)]
    assert inner[:, 2].min() == pytest.approx(0.008, abs=0.003)


def test_rooms_face_inward_and_their_walls_and_floors_are_solid_outside() -> None:
    """A ray from the middle meets every big face from its front; outside is collision."""
    solid = FAMILIES["room"].build(size_m=(5.0, 4.0, 2.8))
    mesh = solid.mesh
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    to_middle = np.array([0.0, 0.0, 1.4]) - corners.mean(axis=1)
    shell = mesh.face_slots <= 1
    assert ((cross * to_middle).sum(axis=1)[shell] > 0).all()
    assert not _inside_any(solid, (0.0, 0.0, 1.4))
    for outside in ((2.6, 0, 1), (-2.6, 0, 1), (0, 2.1, 1), (0, 0, -0.1), (0, 0, 2.9)):
        assert _inside_any(solid, outside)
    # One face upward in the floor's slot, solid below and free above; materials stay.
    solid = FAMILIES["room"].build(size_m=(30.0, 20.0, 3.0), walls=0)
    low, high = solid.mesh.bounds_m()
    assert (low, high) == ((-15.0, -10.0, 0.0), (15.0, 10.0, 0.0))
    assert (solid.mesh.normals == (0.0, 0.0, 1.0)).all()
    assert set(solid.mesh.face_slots) == {0}
    assert solid.mesh.materials == FAMILIES["room"].build().mesh.materials
    assert _inside_any(solid, (14.0, -9.0, -0.1))
    assert not _inside_any(solid, (15.1, 0.0, 1.0))
    assert not _inside_any(solid, (0.0, 0.0, 3.1))
    # Windows that do not fit are left out; the walls are then whole.
    whole = FAMILIES["room"].build(size_m=(5.0, 4.0, 2.8), door=0, window=0).mesh
    small = FAMILIES["room"].build(size_m=(1.5, 1.5, 2.0)).mesh
    assert set(np.unique(whole.face_slots)) == set(np.unique(small.face_slots)) == {0, 1, 2, 3}


def test_a_backdrop_curves_up_from_its_floor_and_a_sphere_stands_on_it() -> None:
    """Solid below its floor, free above, solid behind the wall."""
    solid = FAMILIES["backdrop"].build(size_m=(3.0, 3.0, 2.2))
    assert _inside_any(solid, (0.0, 0.0, -0.01))
    assert not _inside_any(solid, (0.0, 0.0, 0.01))
    assert _inside_any(solid, (0.0, 1.6, 1.0))
    assert (solid.mesh.normals[:, 2] >= -1e-6).all()
    # All of it lies half a diameter from its centre; a sphere of no size is refused.
    mesh = FAMILIES["sphere"].build(diameter_m=0.3).mesh
    radius = np.linalg.norm(mesh.vertices_m - np.array([0.0, 0.0, 0.15]), axis=1)
    assert np.allclose(radius, 0.15, atol=2e-6)
    with pytest.raises(ValueError, match=r"a sphere of 0 m; expected 0\.001 m to 10 m"):
        FAMILIES["sphere"].build(diameter_m=0.0)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [("table", {"size_m": (1.2, 0.8, 0.0)}, r"table: size_m=1\.2,0\.8,0\.0 .* between 0\.2"),
     ("table", {"style": "legz"}, r"style=legz .*did you mean 'legs'"),
     ("box", {"color": "bleu"}, r"color=bleu .*did you mean 'blue'"),
     ("bin", {"size_m": (500.0, 0.4, 0.2)}, r"bin: size_m"),
     ("light_panel", {"shape": "disc"}, "disk"),
     ("shelf", {"size_m": (0.9, 0.3, 1.0), "levels": 40}, r"levels=40 .* between 1 and 15")],
)  # fmt: skip
def test_wrong_parameters_are_told(name: str, parameters: dict[str, object], message: str) -> None:
    with pytest.raises(AssetError, match=message):
        FAMILIES[name].build(**parameters)


def test_wood_grain_runs_along_every_leg() -> None:
    """On the side of an upright leg the image's horizontal is the world's vertical."""
    mesh = FAMILIES["table"].build(size_m=(1.2, 0.8, 0.74)).mesh
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    tall = np.ptp(corners[:, :, 2], axis=1) > 0.5
    flat = np.ptp(corners, axis=1).min(axis=1) < 1e-6
    uv = mesh.uvs[mesh.faces].astype(np.float64)[tall & flat]
    assert len(uv)
    assert (np.ptp(uv[:, :, 0], axis=1) > np.ptp(uv[:, :, 1], axis=1)).all()


def _are_inside(solid: Solid, points: np.ndarray) -> np.ndarray:
    """For each of [n, 3] points, is it in a part of the collision?"""
    hulls = [ConvexHull(part).equations for part in solid.collision.parts_m]
    inside = [(points @ planes[:, :3].T + planes[:, 3] <= 1e-9).all(axis=1) for planes in hulls]
    return np.asarray(np.any(inside, axis=0))


def _inside_any(solid: Solid, point: tuple[float, float, float]) -> bool:
    return bool(_are_inside(solid, np.array([point]))[0])


def _highest_at(solid: Solid, x: float, y: float) -> float:
    """Top of the collision above a place, on a grid of 1 mm."""
    heights = np.arange(2.0, -0.001, -0.001)
    points = np.stack([np.full_like(heights, x), np.full_like(heights, y), heights - 5e-4], axis=1)
    return float(heights[_are_inside(solid, points).argmax()])
