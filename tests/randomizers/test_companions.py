"""Company for people along lanes."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gen_data.assets.library import open_library
from gen_data.config.distributions import Constant
from gen_data.content.people.posing import MOVING_POSES
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.members import Member, add_members
from gen_data.core.scene import ObjectGroup, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.companions import Companions
from tests.randomizers.doubles import rng_of

ASSETS = tuple(f"simple_person?seed={k}" for k in range(4))
APART_M = 12.0


def people(library: AssetLibrary, pose: str, count: int) -> Scene:
    """People in a row, far from each other, who face +X."""
    group = ObjectGroup("people", (), ASSETS, 0, "along", lanes=("sidewalk",))
    members = [
        Member(f"simple_person?pose={pose}&seed={k % 4}", SE3((0.0, APART_M * k, 0.0)))
        for k in range(count)
    ]
    return add_members(Scene("test", groups=(group,)), group, members, library)


def companies(scene: Scene) -> list[list[np.ndarray]]:
    """Places and headings of each company: x, y, yaw."""
    found: dict[int, list[np.ndarray]] = {}
    for body in scene.bodies:
        x, y, _ = body.T_world_body.translation_m
        ahead = body.T_world_body.matrix()[:3, 0]
        row = np.array([x, y, math.atan2(ahead[1], ahead[0])])
        found.setdefault(round(y / APART_M), []).append(row)
    return list(found.values())


def poses(scene: Scene, library: AssetLibrary) -> list[str]:
    return [dict(library.get(body.asset).attributes)["pose"] for body in scene.bodies]


def test_walkers_get_company_beside_them_that_walks_the_same_way(library: AssetLibrary) -> None:
    """Neighbours are one gap apart across the way."""
    draw = Companions(name="company", group="people", size=Constant(3), gap_m=Constant(0.8))
    scene = draw(people(library, "walk", 6), library, rng_of("stream"))

    assert set(poses(scene, library)) <= set(MOVING_POSES)
    groups = companies(scene)
    assert sum(len(group) for group in groups) >= 15
    for group in groups:
        rows = np.array(sorted(group, key=lambda row: float(row[1])))
        np.testing.assert_allclose(rows[:, 2], 0.0, atol=1e-6)
        if len(rows) == 3:
            np.testing.assert_allclose(np.diff(rows[:, 1]), 0.8, atol=1e-3)


def test_people_who_stand_face_the_middle_of_their_circle(library: AssetLibrary) -> None:
    """Everyone looks to the common middle within 35 degrees, and nobody walks."""
    draw = Companions(name="company", group="people", size=Constant(3), radius_m=Constant(0.6))
    scene = draw(people(library, "stand", 5), library, rng_of("stream"))

    assert not set(poses(scene, library)) & set(MOVING_POSES)
    full = [np.array(group) for group in companies(scene) if len(group) == 3]
    assert len(full) >= 3
    for rows in full:
        toward = rows[:, :2].mean(axis=0) - rows[:, :2]
        angles = np.arctan2(toward[:, 1], toward[:, 0]) - rows[:, 2]
        assert np.abs(np.angle(np.exp(1j * angles))).max() < math.radians(35.0)


def test_two_people_in_three_have_company_by_default(library: AssetLibrary) -> None:
    """63 % of a Poisson distribution without 0, of mean parameter 1."""
    scene = Companions(name="company", group="people")(
        people(library, "walk", 60), library, rng_of("stream")
    )
    sizes = [len(group) for group in companies(scene)]
    assert 0.45 < sum(n for n in sizes if n > 1) / sum(sizes) < 0.78


def test_nobody_stands_in_a_wall_or_has_a_name_twice(library: AssetLibrary) -> None:
    """Places next to a dense row of people are taken: companies stay small."""
    group = ObjectGroup("people", (), ASSETS, 0, "along", lanes=("sidewalk",))
    row = [Member(ASSETS[k % 4], SE3((0.0, 0.7 * k, 0.0))) for k in range(20)]
    dense = add_members(Scene("test", groups=(group,)), group, row, library)

    scene = Companions(name="company", group="people", size=Constant(2), gap_m=Constant(0.7))(
        dense, library, rng_of("stream")
    )

    names = [body.name for body in scene.bodies]
    assert len(set(names)) == len(names)
    assert len({i.instance_id for i in scene.instances}) == len(names)
    assert len(names) < 30


def test_everybody_has_one_way_to_walk_in_company_and_one_to_talk(library: AssetLibrary) -> None:
    draw = Companions(name="company", group="people", size=Constant(3))
    found: set[str] = set()
    for pose in ("walk", "stand"):
        start = people(library, pose, 30)
        given = {body.asset for body in start.bodies}
        scene = draw(start, library, rng_of(pose))
        found |= {body.asset for body in scene.bodies} - given
    assert 4 < len(found) <= 2 * len(ASSETS)
    assert not any("phase" in asset for asset in found)


@pytest.mark.slow
@pytest.mark.parametrize(("pose", "companions"), [("walk", 0), ("stand", 8)])
def test_a_mesh_that_stands_joins_a_circle_but_walks_with_nobody(
    tmp_path: Path, pose: str, companions: int
) -> None:
    """A figure from a file has one pose, which its attributes state."""
    trimesh.creation.box((0.4, 0.5, 1.8)).export(tmp_path / "figure.obj")
    (tmp_path / "assets.yaml").write_text(
        "licence: CC0-1.0\nauthor: Someone\nsource: workshop\n"
        "assets:\n  - {id: figure, file: figure.obj, category: person, mass_kg: 75,\n"
        "     origin: floor, attributes: {pose: standing}}\n"
    )
    library = open_library([tmp_path], cache_dir=tmp_path / "cache")
    scene = people(library, pose, 4)
    group = replace(scene.groups[0], assets=("user/figure",))
    draw = Companions(name="company", group="people", size=Constant(3))

    company = draw(replace(scene, groups=(group,)), library, rng_of("stream"))

    figures = [body for body in company.bodies if body.asset == "user/figure"]
    assert len(figures) == companions
    assert len(company.bodies) == 4 + companions
