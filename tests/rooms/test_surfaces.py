"""Covers of the walls of rooms: pale paint, one wall that stands out, tiles by worktops."""

import colorsys
from functools import cache

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.colorimetry import srgb_encode
from gen_data.core.scene import Body, Scene
from tests.rooms.test_layouts import family, furnished, library, world_vertices

ROOMS = 24


@cache
def rooms(kind: str) -> tuple[Scene, ...]:
    return tuple(furnished(kind, seed) for seed in range(ROOMS))


def walls(scene: Scene) -> list[Body]:
    return [body for body in scene.bodies if family(body) == "wall"]


def saturation_and_value(material: Material) -> tuple[float, float]:
    red, green, blue = srgb_encode(np.array(material.base_color)).tolist()
    return colorsys.rgb_to_hsv(red, green, blue)[1:]


def is_painted(material: Material) -> bool:
    return material.texture.startswith("texture/paint?")


@pytest.mark.slow
def test_walls_of_workplaces_are_pale() -> None:
    """Workshops have no coloured paint at all."""
    for scene in rooms("workshop"):
        for wall in walls(scene):
            if is_painted(wall.materials[0]):
                saturation, value = saturation_and_value(wall.materials[0])
                assert saturation < 0.1, (saturation, value)


@pytest.mark.slow
def test_at_most_one_wall_stands_out() -> None:
    """Walls of a room are of one material, but for one of them in some rooms."""
    others = []
    for scene in rooms("living_room"):
        materials = [wall.materials[0] for wall in walls(scene)]
        commonest = max(materials, key=materials.count)
        others.append(len(materials) - materials.count(commonest))

    assert set(others) == {0, 1}
    assert np.mean(others) < 0.4


@pytest.mark.slow
def test_splashbacks_cover_the_wall_behind_every_worktop_and_no_window() -> None:
    """From below the worktops to 1.45 m, or to the sill of a window there; 8 mm thick."""
    covered = 0
    for scene in rooms("kitchen"):
        for wall in walls(scene):
            low_m, high_m = _splashback_m(wall)
            units = [
                b
                for b in scene.bodies
                if family(b) in ("cooker", "kitchen_sink", "kitchen_unit")
                and _gap_m(wall, b) < 0.03
                and "/" not in b.asset.partition("?")[0]
            ]
            if low_m is None or high_m is None:
                continue
            covered += 1
            assert units
            for unit in units:
                points = wall.T_world_body.inverse().apply(world_vertices(unit))
                assert low_m[0] < points[:, 0].min() + 0.03
                assert high_m[0] > points[:, 0].max() - 0.03
            assert 0.8 < low_m[2] < 0.9 < high_m[2] <= 1.45
            assert high_m[1] - low_m[1] < 0.0081
            for x, width, sill in _windows(wall):
                apart = x + 0.5 * width < low_m[0] or x - 0.5 * width > high_m[0]
                assert apart or high_m[2] < sill

    assert covered > ROOMS // 3


def _splashback_m(wall: Body) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Opposite corners of the faces of a wall's third material, in its frame."""
    mesh = library().mesh(wall.asset)
    faces = mesh.faces[mesh.face_slots == 2]
    if not len(faces):
        return None, None
    corners = mesh.vertices_m[faces].reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def _gap_m(wall: Body, body: Body) -> float:
    """Distance of a body's back from a wall that it faces away from; else infinite."""
    forward = wall.T_world_body.inverse().apply(
        body.T_world_body.apply(np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]))
    )
    if forward[1, 1] - forward[0, 1] < 0.99:
        return float("inf")
    points = wall.T_world_body.inverse().apply(world_vertices(body))
    return float(abs(points[:, 1].min()))


def _windows(wall: Body) -> list[tuple[float, float, float]]:
    """Middle, width and lower edge of a wall's openings, from its id."""
    text = next(
        (p for p in wall.asset.partition("?")[2].split("&") if p.startswith("openings=")), ""
    )
    numbers = [float(v) for v in text.partition("=")[2].split(",") if v]
    rows = [numbers[k : k + 4] for k in range(0, len(numbers), 4)]
    return [(x, width, low) for x, width, low, _ in rows if width > 0.0]
