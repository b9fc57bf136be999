"""Models of pybullet: real sizes, upright, found by tag."""

import math
from pathlib import Path

import numpy as np
import pybullet_data
import pytest

from gen_data.assets.library import Library
from gen_data.core.errors import AssetError

OBJECTS = ("domino", "jenga", "lego", "mug", "soccerball", "table", "teddy", "tray")


def size_m(library: Library, asset_id: str) -> np.ndarray:
    low, high = np.array(library.bounds_m(asset_id))
    return high - low


@pytest.mark.parametrize(
    ("name", "expected_m", "tolerance_m"),
    [
        ("soccerball", (0.22, 0.22, 0.22), 0.002),  # FIFA law 2: circumference 0.68 to 0.70 m
        ("domino", (0.00635, 0.0254, 0.0508), 1e-4),  # the URDF's own collision box
        ("jenga", (0.075, 0.025, 0.015), 1e-4),  # maker's specification
        ("lego", (0.0318, 0.0318, 0.023), 5e-4),  # Duplo 2x2 is 31.8 mm wide
        ("mug", (0.082, 0.122, 0.1), 0.002),
        ("table", (1.5, 1.0, 0.625), 1e-3),
    ],
)
def test_objects_have_the_size_of_the_real_thing(
    library: Library, name: str, expected_m: tuple[float, ...], tolerance_m: float
) -> None:
    """Metres, whatever the unit of the file."""
    assert size_m(library, f"pybullet/{name}") == pytest.approx(expected_m, abs=tolerance_m)


def test_teddies_and_random_shapes_have_their_files_sizes_and_textures(library: Library) -> None:
    """0.16 m from feet to ears, along Z."""
    size = size_m(library, "pybullet/teddy")
    assert size[2] == pytest.approx(0.16, abs=1e-4)
    assert int(size.argmax()) == 2
    # At scale 0.015 they are hand-sized, and they have the colour of their URDF.
    lines = Path(pybullet_data.getDataPath(), "random_urdfs/000/000.obj").read_text().splitlines()
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], dtype=float)
    expected = 0.015 * (points.max(axis=0) - points.min(axis=0))
    assert size_m(library, "random_urdfs/000") == pytest.approx(expected, abs=1e-5)
    red, green, blue = library.materials("random_urdfs/000")[0].base_color
    assert blue > 10 * max(red, green)
    # A material's texture id leads to the image next to the mesh.
    (material,) = library.materials("pybullet/domino")
    assert library.texture(material.texture).albedo.shape == (1024, 2048, 3)
    assert material.printed
    assert material.base_color == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_are_in_the_normal_form_with_their_origin_where_conventions_put_it(
    library: Library, name: str
) -> None:
    """Centre of the bounding box; furniture at the centre of its footprint on the floor."""
    asset = library.get(f"pybullet/{name}")
    low, high = np.array(library.bounds_m(asset.asset_id))
    centre = 0.5 * (low + high)
    if "furniture" in asset.tags:
        centre[2] = low[2]
    assert centre == pytest.approx(np.zeros(3), abs=1e-6)
    # Mesh and parts share one frame: their boxes agree (the table's legs do not collide).
    asset_id = f"pybullet/{name}"
    points = np.concatenate(library.convex_parts(asset_id).parts_m)
    low, high = np.array(library.bounds_m(asset_id))
    slack = 0.08 * float((high - low).max())
    assert (points.max(axis=0) <= high + slack).all()
    assert (points.min(axis=0) >= low - slack).all()
    assert (points.max(axis=0) >= high - slack).all()
    assert (points.max(axis=0) - points.min(axis=0))[:2] == pytest.approx(
        (high - low)[:2], abs=slack
    )
    mesh = library.mesh(f"pybullet/{name}")
    assert mesh.vertices_m.dtype == mesh.normals.dtype == mesh.uvs.dtype == np.float32
    assert mesh.faces.dtype == mesh.face_slots.dtype == np.int32
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert mesh.faces.min() == 0
    assert mesh.faces.max() == len(mesh.vertices_m) - 1
    assert mesh.face_slots.max() < len(mesh.materials)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices_m[0] = 0.0


@pytest.mark.slow
def test_a_thousand_random_shapes_are_found_and_all_assets_name_their_licence(
    library: Library,
) -> None:
    """Every folder of random_urdfs is listed, sorted by id, but the one whose mesh has NaNs."""
    found = library.find({"random_shape"})
    folders = sorted(p.name for p in (Path(pybullet_data.getDataPath()) / "random_urdfs").iterdir())
    fit = [name for name in folders if name != "168"]
    assert [a.asset_id for a in found] == [f"random_urdfs/{name}" for name in fit]
    assert {a.category for a in found} == {"random_object"}
    assert len({a.sha256 for a in found}) == len(found)
    for kind in ("object", "robot", "texture", "environment"):
        for asset in library.find((), kind):
            assert asset.licence
            assert asset.author
            assert asset.source
            assert len(asset.sha256) == 64
            assert asset.tags == tuple(sorted(set(asset.tags)))


def test_other_ids_are_answered_with_the_nearest_and_collision_parts_are_small(
    library: Library,
) -> None:
    """Neither duck nor bicycle are offered."""
    for name in ("pybullet/duck", "pybullet/bicycle"):
        with pytest.raises(AssetError):
            library.get(name)
    with pytest.raises(AssetError, match=r"pybullet/tedy.*did you mean 'pybullet/teddy'"):
        library.mesh("pybullet/tedy")
    with pytest.raises(AssetError, match="pybullet/teddy"):
        library.robot("pybullet/teddy")
    with pytest.raises(AssetError, match="is a robot"):
        library.mesh("franka_panda")
    # At most 24 parts of at most 64 vertices, each with volume.
    from scipy.spatial import ConvexHull

    for asset_id in ("pybullet/teddy", "pybullet/mug", "pybullet/soccerball", "random_urdfs/003"):
        parts = library.convex_parts(asset_id).parts_m
        assert 1 <= len(parts) <= 24
        for part in parts:
            assert 4 <= len(part) <= 64
            assert ConvexHull(part).volume > 0.0
    # 64 vertices on a sphere of radius r hold most of 4/3 pi r^3.
    (part,) = library.convex_parts("pybullet/soccerball").parts_m
    assert ConvexHull(part).volume > 0.85 * 4 / 3 * math.pi * 0.11**3
