"""Trees: wood that thins out, leaves in clusters, and light that passes between them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from gen_data.generator.assets.procedural.variant_rng import variant_rng
from gen_data.generator.assets.scenery.branching import Lobe, grow_skeleton, points_in
from gen_data.generator.assets.scenery.textures.leaves import leaves
from gen_data.generator.assets.scenery.trees import SPECIES, tree, tree_facts
from gen_data.generator.core.asset_types import MeshData
from tests.scenery.rays import cast

LEAFY = [name for name in SPECIES if name != "conifer"]


def leaves_of(mesh: MeshData) -> np.ndarray:
    """Whether each face is a leaf."""
    slots = [k for k, m in enumerate(mesh.materials) if m.role == "leaf"]
    return np.isin(mesh.face_slots, slots)


@pytest.mark.parametrize("species", LEAFY)
def test_leaves_come_and_go_but_the_trunk_stays(species: str) -> None:
    """The share of leaves is what it says; the trunk of the same tree is the same."""
    full, half, bare = (tree(3, species, share).mesh for share in (1.0, 0.5, 0.0))

    assert leaves_of(half).sum() == pytest.approx(0.5 * leaves_of(full).sum(), abs=2)
    assert not leaves_of(bare).any()
    trunks = [foot_of(m) for m in (full, bare)]
    assert np.allclose(trunks[0], trunks[1])


def foot_of(mesh: MeshData) -> np.ndarray:
    """Vertices of the trunk on the ground."""
    slots = [k for k, m in enumerate(mesh.materials) if m.texture.startswith("texture/bark")]
    wood = mesh.vertices_m[np.unique(mesh.faces[np.isin(mesh.face_slots, slots)])]
    return wood[wood[:, 2] < 0.01]


@pytest.mark.parametrize(
    ("species", "season", "foliage"),
    [("oak", "winter", "bare"), ("pine", "winter", "leafy"), ("oak", "autumn", "leafy")],
)
def test_deciduous_trees_are_bare_in_winter(species: str, season: str, foliage: str) -> None:
    """The facts agree with the mesh; the wood does not depend on the season."""
    mesh = tree(2, species, 1.0, season).mesh

    assert dict(tree_facts(2, species, 1.0, season).attributes)["foliage"] == foliage
    assert leaves_of(mesh).any() == (foliage == "leafy")


def test_autumn_is_redder_than_summer_and_spring_blossoms() -> None:
    """Mean colours of the leaf materials, and white petals on half of a cherry's sprays."""
    summer, autumn, spring = (
        tree(0, "cherry", 1.0, season).mesh for season in ("summer", "autumn", "spring")
    )

    def red_to_green(mesh: MeshData) -> float:
        colors = [m.base_color for m in mesh.materials if m.role == "leaf"]
        return float(np.mean([r / g for r, g, _ in colors]))

    assert red_to_green(autumn) > 1.4
    assert red_to_green(summer) < 1.1
    petals = [k for k, m in enumerate(spring.materials) if "blossom" in m.texture]
    share = np.isin(spring.face_slots, petals).sum() / leaves_of(spring).sum()
    assert share == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("species", LEAFY)
def test_a_crown_is_dense_but_not_a_ball(species: str) -> None:
    """Level rays through the middle of the crown: most meet a leaf, some pass by all holes."""
    mesh = tree(1, species, 1.0).mesh
    crown = mesh.vertices_m[mesh.faces[leaves_of(mesh)]].reshape(-1, 3).astype(np.float64)
    middle, spread = crown.mean(axis=0), crown.std(axis=0)
    y, z = (g.ravel() for g in np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-1, 1, 25)))
    eyes = np.column_stack([0 * y + 20.0, middle[1] + y * spread[1], middle[2] + z * spread[2]])

    assert 0.5 < blocked_share(mesh, eyes) < 0.995


def blocked_share(mesh: MeshData, eyes: np.ndarray) -> float:
    """Share of rays along -X that meet wood, or a leaf and not a hole between leaves."""
    alphas = {m.texture: cover_of(m.texture) for m in mesh.materials if "leaves" in m.texture}
    blocked, going, eyes = 0, np.ones(len(eyes), dtype=bool), eyes.copy()
    for _ in range(40):
        far, face, _ = cast(mesh, eyes, np.tile([-1.0, 0.0, 0.0], (len(eyes), 1)))
        going &= face >= 0
        for k in np.flatnonzero(going):
            texture = mesh.materials[mesh.face_slots[face[k]]].texture
            at = eyes[k] - [far[k], 0.0, 0.0]
            if texture not in alphas or is_leaf(alphas[texture], mesh, int(face[k]), at):
                blocked, going[k] = blocked + 1, False
        eyes[:, 0] -= np.where(going, far + 1e-4, 0.0)
    return blocked / len(eyes)


@cache
def cover_of(texture: str) -> np.ndarray:
    """Coverage of a texture of leaves."""
    alpha = leaves(0, texture.partition("kind=")[2].partition("&")[0]).alpha
    assert alpha is not None
    return alpha


def is_leaf(alpha: np.ndarray, mesh: MeshData, face: int, at: np.ndarray) -> bool:
    """Whether a point of a face lies on a leaf; the nearest texel decides."""
    a, b, c = mesh.vertices_m[mesh.faces[face]].astype(np.float64)
    frame = np.stack([b - a, c - a], axis=1)
    u, v = np.linalg.lstsq(frame, at - a, rcond=None)[0]
    uv = np.array([1.0 - u - v, u, v]) @ mesh.uvs[mesh.faces[face]]
    size = len(alpha)
    column, row = (np.clip((uv[0], 1.0 - uv[1]), 0.0, 0.999) * size).astype(int)
    return bool(alpha[row, column] >= 128)


@pytest.mark.parametrize("species", SPECIES)
def test_leaf_normals_point_away_from_the_crowns_middle(species: str) -> None:
    """Soft shading: normals lean outward, and lie on their face's front."""
    mesh = tree(1, species, 1.0).mesh
    faces = mesh.faces[leaves_of(mesh)]
    corners = mesh.vertices_m[faces].astype(np.float64)
    axis = corners.mean(axis=1) * [1.0, 1.0, 0.0]
    far = (axis**2).sum(axis=1) > 0.3 * (axis**2).sum(axis=1).max()
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = mesh.normals[faces].mean(axis=1)

    assert ((normals * axis).sum(axis=1)[far] > 0.0).mean() > 0.9
    assert ((normals * own).sum(axis=1) > 0.0).all()


def test_branches_obey_the_pipe_model() -> None:
    """At every fork, the children's r^2.3 add up to the parent's (Shinozaki 1964)."""
    rng = variant_rng("test", 0)
    points = points_in((Lobe((0.0, 0.0, 4.0), (1.5, 1.5, 1.5)),), 200, rng)
    trunk = np.array([(0.0, 0.0, 0.5 * k) for k in range(6)])

    skeleton = grow_skeleton(trunk, points, 0.25, 0.15)

    area = skeleton.radii_m**2.3
    inner = np.unique(skeleton.parents[1:])
    sums = np.bincount(skeleton.parents[1:], area[1:], len(area))
    assert len(area) > 60
    assert skeleton.radii_m[0] == pytest.approx(0.15)
    assert np.allclose(area[inner], sums[inner], rtol=1e-6)
    assert (skeleton.parents[1:] < np.arange(1, len(area))).all()


def test_attraction_points_lie_in_their_lobes() -> None:
    """Inside the ellipsoid and not in its core."""
    lobe = Lobe((1.0, 2.0, 3.0), (2.0, 1.0, 0.5))

    points = points_in((lobe,), 100, variant_rng("test", 1))

    scaled = (points - lobe.centre_m) / lobe.axes_m
    r2 = (scaled**2).sum(axis=1)
    assert len(points) == 100
    assert r2.max() < 1.0
    assert r2.min() > 0.12
