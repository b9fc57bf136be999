"""Trees: wood that thins out, leaves in clusters, and light that passes between them."""

from functools import cache

import numpy as np
import pytest

from gen_data.content.scenery.branching import Lobe, grow_skeleton, points_in
from gen_data.content.scenery.textures.leaves import leaves
from gen_data.content.scenery.trees import SPECIES, tree, tree_facts
from gen_data.core.asset_types import MeshData
from gen_data.core.colorimetry import luminance
from gen_data.core.variant_rng import variant_rng
from tests.scenery.rays import cast
from tests.tiers import sampled

LEAFY = [name for name in SPECIES if name != "conifer"]


@cache
def summer_mesh(species: str) -> MeshData:
    return tree(1, species, 1.0).mesh


def leaves_of(mesh: MeshData) -> np.ndarray:
    slots = [k for k, m in enumerate(mesh.materials) if m.role == "leaf"]
    return np.isin(mesh.face_slots, slots)


@pytest.mark.parametrize("species", sampled(LEAFY, 6))
def test_leaves_come_and_go_but_the_trunk_stays(species: str) -> None:
    """The share of leaves is as stated; the trunk of the same tree is the same."""
    full, half, bare = summer_mesh(species), *(tree(1, species, k).mesh for k in (0.5, 0.0))

    assert leaves_of(half).sum() == pytest.approx(0.5 * leaves_of(full).sum(), abs=2)
    assert not leaves_of(bare).any()
    trunks = [foot_of(m) for m in (full, bare)]
    assert np.allclose(trunks[0], trunks[1])


def foot_of(mesh: MeshData) -> np.ndarray:
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


@pytest.mark.parametrize("species", sampled(SPECIES, 6))
def test_leaves_in_the_depth_of_a_crown_are_as_bright_as_at_its_surface(species: str) -> None:
    """Reflectance is the leaf's own: renderers find how little light reaches the depth."""
    leafy = [m.base_color for m in tree(2, species, 1.0).mesh.materials if m.role == "leaf"]

    levels = luminance(np.array(leafy))

    assert len(levels) == 4
    assert levels.max() < 1.03 * levels.min()


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


@pytest.mark.parametrize("species", sampled(LEAFY, 6))
def test_a_crown_is_dense_but_not_a_ball(species: str) -> None:
    """Level rays through the middle of the crown: most meet a leaf, some pass by all holes."""
    mesh = summer_mesh(species)
    crown = mesh.vertices_m[mesh.faces[leaves_of(mesh)]].reshape(-1, 3).astype(np.float64)
    middle, spread = crown.mean(axis=0), crown.std(axis=0)
    y, z = (g.ravel() for g in np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-1, 1, 25)))
    eyes = np.column_stack([0 * y + 20.0, middle[1] + y * spread[1], middle[2] + z * spread[2]])

    assert 0.5 < blocked_share(mesh, eyes) < 0.995


def blocked_share(mesh: MeshData, eyes: np.ndarray) -> float:
    """Share of rays along -X that meet wood, or a leaf and not a hole between leaves."""
    going = eyes.copy()
    blocked = 0
    for _ in range(40):
        far, face, _ = cast(mesh, going, np.tile([-1.0, 0.0, 0.0], (len(going), 1)))
        met = face >= 0
        at = going[met] - np.outer(far[met], [1.0, 0.0, 0.0])
        opaque = is_opaque(mesh, face[met], at)
        blocked += int(opaque.sum())
        going = at[~opaque] - [1e-4, 0.0, 0.0]
        if not len(going):
            break
    return blocked / len(eyes)


@cache
def cover_of(texture: str) -> np.ndarray:
    alpha = leaves(0, texture.partition("kind=")[2].partition("&")[0]).alpha
    assert alpha is not None
    return alpha


def is_opaque(mesh: MeshData, face: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Whether points [n, 3] of faces [n] lie on wood or a leaf; the nearest texel decides."""
    corners = mesh.vertices_m[mesh.faces[face]].astype(np.float64)
    frame = corners[:, 1:] - corners[:, :1]
    normal = np.einsum("nik,njk->nij", frame, frame)
    offset = np.einsum("nik,nk->ni", frame, at - corners[:, 0])
    u, v = np.linalg.solve(normal, offset[..., None])[..., 0].T
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    uv = np.einsum("nk,nkc->nc", weights, mesh.uvs[mesh.faces[face]])
    opaque = np.ones(len(face), dtype=bool)
    for slot, material in enumerate(mesh.materials):
        if "leaves" in material.texture:
            here = mesh.face_slots[face] == slot
            alpha = cover_of(material.texture)
            places = np.clip(np.stack([uv[here, 0], 1.0 - uv[here, 1]]), 0.0, 0.999)
            column, row = (places * len(alpha)).astype(int)
            opaque[here] = alpha[row, column] >= 128
    return opaque


@pytest.mark.parametrize("species", SPECIES)
def test_leaf_normals_point_away_from_the_crowns_middle(species: str) -> None:
    """Soft shading: normals lean outward, and lie on their face's front."""
    mesh = summer_mesh(species)
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
