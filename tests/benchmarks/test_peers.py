"""The comparison with other renderers: its scenes, its measures, and PyBullet's part of it."""

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from benchmarks.bench_peers import Figures, compare, format_table
from benchmarks.peers import worlds
from benchmarks.peers.workload import OBJECTS, ground_mesh, object_mesh, object_meshes

WORLD = worlds.World(
    meshes=("/thing.obj",),
    T_world_bodies=(np.eye(4).tolist(),),
    ids=(3,),
    lamps=(worlds.Lamp((1.0, 2.0, 3.0), 0.1, (10.0, 20.0, 30.0)),),
    T_world_camera=np.eye(4).tolist(),
    size_px=(640, 480),
    focal_px=600.0,
)


@pytest.mark.parametrize("number", range(OBJECTS))
def test_objects_are_closed_and_have_twelve_thousand_triangles(number: int) -> None:
    """An outward surface without holes encloses a positive volume."""
    vertices_m, faces = object_mesh(number)
    mesh = trimesh.Trimesh(vertices_m, faces, process=False)

    assert len(faces) == 12_012
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert 0.18 < mesh.extents.max() < 0.40


def test_small_objects_are_closed_and_have_few_triangles() -> None:
    """Superquadrics of 16 rings, two boxes, a cylinder and a frustum of 24 sides, a hexagon."""
    solids = [
        trimesh.Trimesh(*mesh, process=True, merge_norm=True) for mesh in object_meshes("small")
    ]

    assert [len(solid.faces) for solid in solids] == [*[480] * 5, 12, 12, 92, 92, 20]
    assert all(solid.is_watertight and solid.volume > 0 for solid in solids)
    box, _, _, frustum, hexagon = solids[5:]
    assert box.volume == pytest.approx(0.2 * 0.14 * 0.1)
    base_m2 = 24 / 2 * math.sin(2 * math.pi / 24) * (0.09 / math.cos(math.pi / 24)) ** 2
    assert frustum.volume == pytest.approx(0.16 / 3 * base_m2 * (1 + 0.3 + 0.3**2))
    assert hexagon.extents == pytest.approx([0.2, 0.2, 0.12])


def test_the_ground_is_a_box_with_outward_faces() -> None:
    """2.4 m x 2.4 m x 2 cm; merged, because every side has vertices of its own."""
    mesh = trimesh.Trimesh(*ground_mesh(), process=True, merge_norm=True)

    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(2.4 * 2.4 * 0.02)


def test_worlds_survive_their_file(tmp_path: Path) -> None:
    """Renderers in other interpreters read exactly what was drawn."""
    worlds.write_worlds([WORLD, WORLD], tmp_path)

    assert worlds.read_worlds(tmp_path) == [WORLD, WORLD]


def test_depth_buffers_turn_into_metres() -> None:
    """A point at 2 m on the axis, through the projection matrix and back."""
    clip = worlds.projection(WORLD) @ [0.0, 0.0, -2.0, 1.0]
    buffer = 0.5 * (clip[2] / clip[3] + 1)

    assert worlds.unproject_depth(np.array([buffer, 0.0, 1.0])) == pytest.approx(
        [2.0, worlds.NEAR_M, worlds.FAR_M]
    )


def test_the_projection_agrees_with_the_pinhole_formula() -> None:
    """``u = f x / z + w / 2`` [px], downward rows."""
    x, y, z = 0.3, -0.2, 1.5
    clip = worlds.projection(WORLD) @ [x, -y, -z, 1.0]  # OpenGL looks along -Z, with Y up
    u_px = 320 * (1 + clip[0] / clip[3])
    v_px = 240 * (1 - clip[1] / clip[3])

    assert (u_px, v_px) == pytest.approx((600 * x / z + 320, 600 * y / z + 240))


def test_every_peer_writes_three_images_and_the_boxes(tmp_path: Path) -> None:
    """Depth in millimetres; 0 is nothing; boxes are x, y, width, height of visible pixels."""
    ids = np.zeros((48, 64), np.uint16)
    ids[10:20, 5:9] = 7
    depth_m = np.where(ids == 7, 1.234, np.inf)
    worlds.write_files(
        worlds.Images(np.full((48, 64, 3), (1, 2, 3), np.uint8), depth_m, ids), tmp_path, 4
    )

    def read(name: str) -> np.ndarray:
        return cv2.imread(str(worlds.plane_path(tmp_path, name, 4)), cv2.IMREAD_UNCHANGED)

    assert read("rgb")[0, 0].tolist() == [3, 2, 1]
    assert np.unique(read("depth")).tolist() == [0, 1234]
    assert np.array_equal(read("instance"), ids)
    assert json.loads((tmp_path / "4.json").read_text()) == {"7": [5, 10, 4, 10]}


def test_agreement_is_the_mean_intersection_over_union() -> None:
    """Half of one mask and all of the other; background does not count."""
    ours = np.repeat([0, 1, 2], 4)
    theirs = np.array([0, 0, 0, 0, 1, 1, 0, 0, 2, 2, 2, 2])

    assert worlds.mask_agreement(theirs, ours) == pytest.approx((0.5 + 1.0) / 2)


def test_srgb_has_the_values_of_the_standard() -> None:
    """IEC 61966-2-1: 18 % grey is 118, and 0.0031308 the end of the straight part."""
    assert worlds.encode_srgb(np.array([0.0, 0.0031308, 0.18, 1.0, 7.0])).tolist() == [
        0,
        10,
        118,
        255,
        255,
    ]


def test_the_table_says_who_is_missing_and_who_draws_other_scenes() -> None:
    """Ratios are to the medians of TinyRenderer."""
    table = format_table(
        {
            "ours": Figures(3.0, (0.1, 0.11, 0.3), math.nan),
            "TinyRenderer": Figures(0.4, (0.2, 0.22, 0.24), 0.98),
            "MuJoCo": Figures(0.4, (0.2,), 0.5),
            "Mitsuba": "No module named 'mitsuba'",
        }
    )

    # (0.11 + 3 / 150) / (0.22 + 0.4 / 150)
    assert "| ours | 0.110 | 0.100 - 0.300 | 0.50 | 3.0 | 0.58 |  |" in table
    assert "| TinyRenderer | 0.220 | 0.200 - 0.240 | 1.00 | 0.4 | 1.00 | 0.980 |" in table
    assert "0.500: other scenes |" in table
    assert "| Mitsuba | not installed | | | | | No module named 'mitsuba' |" in table


@pytest.mark.slow
def test_tiny_renderer_draws_the_same_scenes(tmp_path: Path) -> None:
    """Side by side with ours, in processes of their own."""
    pytest.importorskip("pybullet")

    found = compare(["ours", "ours, full samples", "TinyRenderer"], tmp_path, count=2, rounds=1)

    assert [figures for figures in found.values() if isinstance(figures, str)] == []
    agreements = {name: figures.agreement for name, figures in found.items()}  # type: ignore[union-attr]
    assert agreements["ours, full samples"] == 1.0
    assert agreements["TinyRenderer"] > 0.95
