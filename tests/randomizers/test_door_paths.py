"""Paths from gardens' street edges to doors."""

import math

import numpy as np
import pytest

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.members import Member, add_members
from gen_data.core.scene import Lane, ObjectGroup, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.door_paths import DoorPaths
from tests.randomizers.doubles import rng_of

HOUSE = "building/villa?seed=0"
PATHS = tuple(f"garden_path?length_m=4&seed={k}" for k in range(3))
GARDEN_M = 6.0
RISE_M = 0.3


def garden(y_m: float, ahead: float) -> Lane:
    """Along X at that Y, with the street to the left of its direction; it falls to the street."""
    ends = ((-40.0 * ahead, y_m, 0.5 * RISE_M), (40.0 * ahead, y_m, 0.5 * RISE_M))
    return Lane("garden", "garden", ends, GARDEN_M, "main", bank=-RISE_M / GARDEN_M)


def street(library: AssetLibrary, *lanes: Lane) -> Scene:
    """A house that faces +Y, its front wall on y = 0, at the height of the garden's rear edge."""
    houses = ObjectGroup("buildings", (), (HOUSE,), 0, "along", lanes=("frontage",))
    paths = ObjectGroup("paths", (), PATHS, 0, "along", lanes=("garden",))
    (door,) = [point for point in library.keypoints(HOUSE) if point.name == "door"]
    pose = SE3.about_z(0.5 * math.pi, (0.0, -door.position_m[0], RISE_M))
    scene = Scene("test", groups=(houses, paths), lanes=lanes)
    return add_members(scene, houses, [Member(HOUSE, pose)], library)


def laid(scene: Scene, library: AssetLibrary) -> list[np.ndarray]:
    """Corners of the paths' upper sides, [n, 3] each, world."""
    made = DoorPaths(name="paths")(scene, library, rng_of("paths"))
    found = []
    for body in made.bodies:
        if body.group == "paths":
            vertices = library.mesh(body.asset).vertices_m.astype(np.float64)
            found.append(body.T_world_body.apply(vertices[vertices[:, 2] > 0.0]))
    return found


def test_a_path_leads_from_the_door_to_the_edge_of_the_street(library: AssetLibrary) -> None:
    """Straight ahead, over the fall of the garden, and under the house by less than its step."""
    (path,) = laid(street(library, garden(0.5 * GARDEN_M, 1.0)), library)
    (door,) = [point for point in library.keypoints(HOUSE) if point.name == "door"]
    middle_x = -door.position_m[1]
    street_end, door_end = path[:, 1].max(), path[:, 1].min()

    assert 0.5 * (path[:, 0].min() + path[:, 0].max()) == pytest.approx(middle_x, abs=1e-3)
    assert street_end == pytest.approx(GARDEN_M, abs=0.1)
    assert -0.3 < door_end <= 0.02
    assert path[path[:, 1] > GARDEN_M - 0.2, 2].mean() == pytest.approx(0.04, abs=0.02)
    assert path[path[:, 1] < 0.1, 2].mean() == pytest.approx(RISE_M + 0.04, abs=0.03)


@pytest.mark.parametrize("lanes", [
    pytest.param((), id="no garden"),
    pytest.param((garden(0.5 * GARDEN_M, -1.0),), id="garden of the other side of a street"),
    pytest.param((garden(20.0, 1.0),), id="far away"),
    pytest.param((garden(-20.0, 1.0),), id="behind the house"),
])  # fmt: skip
def test_houses_without_a_garden_get_none(library: AssetLibrary, lanes: tuple[Lane, ...]) -> None:
    assert laid(street(library, *lanes), library) == []


def test_the_nearest_garden_counts(library: AssetLibrary) -> None:
    """A second strip behind the first is not reached."""
    lanes = garden(9.0, 1.0), garden(0.5 * GARDEN_M, 1.0)
    (path,) = laid(street(library, *lanes), library)

    assert path[:, 1].max() == pytest.approx(GARDEN_M, abs=0.1)


def test_what_stands_in_the_way_stays(library: AssetLibrary) -> None:
    """A path would run through it."""
    scene = street(library, garden(0.5 * GARDEN_M, 1.0))
    group = ObjectGroup("things", (), ("bench?seed=0",), 0, "along", lanes=("garden",))
    (door,) = [point for point in library.keypoints(HOUSE) if point.name == "door"]
    thing = Member("bench?seed=0", SE3((-door.position_m[1], 3.0, RISE_M / 2)))
    scene = add_members(Scene("test", scene.bodies, scene.instances, groups=(*scene.groups, group),
                              lanes=scene.lanes), group, [thing], library)  # fmt: skip

    assert laid(scene, library) == []
