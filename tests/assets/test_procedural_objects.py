"""Every family of procedural objects, over several seeds."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gen_data.assets.family import Solid
from gen_data.content.procedural import FAMILIES, TEXTURES
from gen_data.content.procedural.vessel_contents import CONTENTS, FOODS
from gen_data.content.procedural.vessels import choose
from gen_data.core.asset_types import MeshData
from tests.every_value import for_every
from tests.solids import assert_well_formed, crosses, variant, volume_m3

SEEDS = (0, 1, 7, 11)
OBJECTS = sorted(name for name, family in FAMILIES.items() if family.variants)

# Longest side of real ones [m]: catalogues of tableware, ISO 4014/4032/7089, fruit grading rules.
LONGEST_SIDE_M = {
    "apple": (0.05, 0.1), "ball": (0.03, 0.25), "banana": (0.14, 0.28), "book": (0.15, 0.32),
    "bottle": (0.07, 0.34), "bowl": (0.08, 0.28), "bracket": (0.03, 0.1), "can": (0.06, 0.18),
    "candle": (0.05, 0.2), "carton": (0.1, 0.32), "connector": (0.02, 0.08), "cup": (0.07, 0.25),
    "flange": (0.05, 0.12), "fork": (0.15, 0.23), "gear": (0.02, 0.1), "hammer": (0.25, 0.36),
    "hex_bolt": (0.015, 0.13), "lime": (0.04, 0.07), "kiwi": (0.045, 0.085),
    "tomato": (0.025, 0.1), "bell_pepper": (0.07, 0.12), "peach": (0.05, 0.09),
    "plum": (0.03, 0.065), "cell_phone": (0.13, 0.18), "remote": (0.12, 0.24),
    "mouse": (0.09, 0.13), "keyboard": (0.27, 0.42), "scissors": (0.09, 0.27),
    "jar": (0.065, 0.16), "knife": (0.15, 0.37), "lemon": (0.05, 0.11),
    "milk_carton": (0.1, 0.26), "mug": (0.09, 0.16), "nut": (0.012, 0.04), "orange": (0.05, 0.1),
    "pear": (0.08, 0.13), "pipe_elbow": (0.03, 0.09), "plate": (0.15, 0.34),
    "screwdriver": (0.14, 0.28), "spoon": (0.11, 0.26), "stepped_shaft": (0.04, 0.2),
    "toy_block": (0.03, 0.1), "tumbler": (0.05, 0.21), "vase": (0.13, 0.3),
    "strawberry": (0.025, 0.06), "carrot": (0.08, 0.26), "grapes": (0.09, 0.24),
    "broccoli": (0.04, 0.18), "mushroom": (0.025, 0.075), "sandwich": (0.09, 0.21),
    "pizza": (0.1, 0.34), "cake": (0.055, 0.26), "donut": (0.08, 0.11), "hot_dog": (0.13, 0.21),
    "hand": (0.47, 0.65), "marker": (0.02, 1.0), "calibration_board": (0.06, 1.7),
    "qr_code": (0.025, 0.42),
    "pomegranate": (0.065, 0.12), "onion": (0.05, 0.1), "persimmon": (0.05, 0.09),
    "courgette": (0.11, 0.3), "jug": (0.08, 0.26), "carafe": (0.18, 0.28),
    "canister": (0.08, 0.19), "plant_pot": (0.07, 0.15),
    "washer": (0.014, 0.04), "wine_glass": (0.13, 0.245), "wrench": (0.1, 0.26),
}  # fmt: skip

# Open by design: a gable that sits on its box, pipe ends covered by collars.
OPEN_EDGES = {"milk_carton": 0.02, "pipe_elbow": 0.02, "flange": 0.005}


for_every_variant = for_every(
    [(name, seed) for name in OBJECTS for seed in SEEDS], lambda key: (key[0], variant(*key))
)


def test_every_object_family_has_a_stated_real_size() -> None:
    """A new family must state the size of the real object."""
    assert set(LONGEST_SIDE_M) == set(OBJECTS)


@pytest.mark.slow
@for_every_variant
def test_objects_are_closed_of_real_size_centred_and_near_hulls(built: tuple[str, Solid]) -> None:
    """The longest side lies in the range measured on real objects."""
    name, solid = built
    mesh = solid.mesh
    low, high = mesh.bounds_m()
    longest = max(b - a for a, b in zip(low, high, strict=True))
    assert LONGEST_SIDE_M[name][0] <= longest <= LONGEST_SIDE_M[name][1]
    # Objects are placed by the centre of their box.
    assert np.allclose(np.add(low, high), 0.0, atol=3e-6)
    # Labels are never cut off by wrapping around.
    assert 0.0 <= mesh.uvs.min() <= mesh.uvs.max() <= 1.0
    # Every edge is walked as often in one direction as in the other.
    assert _unmatched_edges(mesh) <= OPEN_EDGES.get(name, 0.0)
    # Half of the vertices within 2.5 mm of a part, nine in ten within 3.5 mm.
    rigid = [slot for slot, material in enumerate(mesh.materials) if material.role != CONTENTS]
    seen = np.unique(mesh.faces[np.isin(mesh.face_slots, rigid)])
    vertices = mesh.vertices_m[seen].astype(np.float64)
    outside = np.min([_outside_m(part, vertices) for part in solid.collision.parts_m], axis=0)
    assert np.quantile(outside, 0.5) < 0.0025
    assert np.quantile(outside, 0.9) < 0.0035


@for_every_variant
def test_meshes_are_well_formed_and_have_a_small_convex_collision(built: tuple[str, Solid]) -> None:
    """At most 12 000 triangles; of a board with a face for each cell, twice as many."""
    assert_well_formed(built[1].mesh)
    assert 60 <= len(built[1].mesh.faces) <= {"calibration_board": 24_000}.get(built[0], 12_000)
    # The divergence theorem gives a positive volume, smaller than the box; so for contents.
    mesh = built[1].mesh
    low, high = mesh.bounds_m()
    inside = np.array([material.role == CONTENTS for material in mesh.materials])[mesh.face_slots]
    for faces in (mesh.faces[~inside], mesh.faces[inside]):
        volume = volume_m3(mesh.vertices_m[faces].astype(np.float64))
        assert volume > 0.0 or not len(faces)
        # A plate fills its box.
        assert volume < np.prod(np.subtract(high, low)) * (1.0 + 1e-9)
    # Smoothing never turns a normal away from a face it belongs to.
    face = crosses(mesh) / np.linalg.norm(crosses(mesh), axis=1, keepdims=True)
    assert (face[:, None, :] * mesh.normals[mesh.faces]).sum(axis=2).min() > 0.5
    # At most 24 parts of at most 48 vertices; all of them are vertices of their hull.
    parts = built[1].collision.parts_m
    assert 1 <= len(parts) <= 24
    for part in parts:
        assert part.dtype == np.float64
        assert 4 <= len(part) <= 48
        hull = ConvexHull(part)
        depth = (part @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        assert depth.min() > -2e-4
    points = np.concatenate(built[1].collision.parts_m)
    assert np.abs(points.min(axis=0) - low).max() < 0.003
    assert np.abs(points.max(axis=0) - high).max() < 0.003


def open_variants(name: str) -> list[int]:
    """The first four variants without lid and solid food."""
    chosen = ((seed, choose(name, seed)) for seed in range(FAMILIES[name].variants))
    return [k for k, c in chosen if not c.lid and not c.straw and c.content not in FOODS][:4]


OPEN = [(name, seed) for name in ("mug", "cup", "bowl", "tumbler") for seed in open_variants(name)]


@pytest.mark.parametrize(("name", "seed"), OPEN)
def test_vessels_are_hollow_in_physics(name: str, seed: int) -> None:
    """A marble fits on the axis, from just above the floor to the rim."""
    solid = FAMILIES[name].build(seed=seed)
    low, high = solid.mesh.bounds_m()
    heights = np.linspace(low[2] + 0.02, high[2], 8)
    # The handle shifts the box's centre from the axis: find the axis from the rim.
    rim = solid.mesh.vertices_m[solid.mesh.vertices_m[:, 2] > high[2] - 0.001]
    axis = 0.5 * (rim.min(axis=0) + rim.max(axis=0)).astype(np.float64)
    marble = np.array([(axis[0] + 0.008 * dx, axis[1], z) for z in heights for dx in (-1, 0, 1)])
    for part in solid.collision.parts_m:
        assert (_outside_m(part, marble) > 0.001).all()


@for_every_variant
def test_labels_are_printed_and_metals_are_whole(built: tuple[str, Solid]) -> None:
    """Marks of use lie on plain colours, which randomizers may change."""
    for material in built[1].mesh.materials:
        assert material.roughness >= 0.04
        assert material.metallic in (0.0, 0.35, 1.0)
        if material.texture:
            family = material.texture.removeprefix("texture/").partition("?")[0]
            assert family in TEXTURES
            assert material.printed == (family != "use_marks")


@pytest.mark.parametrize("name", ["bottle", "can", "carton", "milk_carton", "jar", "book"])
def test_printed_things_carry_a_label(name: str) -> None:
    """The tag ``printed`` is kept: one slot of the mesh shows a printed texture."""
    assert "printed" in FAMILIES[name].tags
    mesh = FAMILIES[name].build(seed=2).mesh
    printed = [slot for slot, material in enumerate(mesh.materials) if material.printed]
    assert printed
    assert np.isin(mesh.face_slots, printed).any()


def test_labels_are_upright_and_not_mirrored() -> None:
    """Seen from outside, u grows to the right and v upward on a can, a box's front and a cover."""
    for name, front in (("can", (1.0, 0.0, 0.0)), ("carton", (1.0, 0.0, 0.0))):
        mesh = FAMILIES[name].build(seed=0).mesh
        du, dv = _texture_axes(mesh, np.array(front))
        assert np.allclose(du, (0.0, 1.0, 0.0), atol=0.15)
        assert np.allclose(dv, (0.0, 0.0, 1.0), atol=0.15)
    du, dv = _texture_axes(FAMILIES["book"].build(seed=0).mesh, np.array((0.0, 0.0, 1.0)))
    assert np.allclose(du, (0.0, 1.0, 0.0), atol=0.15)
    assert np.allclose(dv, (-1.0, 0.0, 0.0), atol=0.15)


def _texture_axes(mesh: MeshData, towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions in which u and v grow on the printed face that faces ``towards`` most."""
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    score = crosses(mesh) @ towards * (mesh.face_slots == 0)
    face = int(score.argmax())
    uv = mesh.uvs[mesh.faces[face]].astype(np.float64)
    edges = corners[face, 1:] - corners[face, 0]
    jacobian = np.linalg.solve(uv[1:] - uv[0], edges)
    return jacobian[0] / np.linalg.norm(jacobian[0]), jacobian[1] / np.linalg.norm(jacobian[1])


def _unmatched_edges(mesh: MeshData) -> float:
    """Share of directed edges without a partner in the other direction."""
    cells = np.round(mesh.vertices_m.astype(np.float64) * 1e6).astype(np.int64)
    _, welded = np.unique(cells, axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    n = int(faces.max()) + 1
    there, back = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    keys = np.unique(np.concatenate([there, back]))
    counts = [np.bincount(np.searchsorted(keys, e), minlength=len(keys)) for e in (there, back)]
    return float(np.maximum(counts[0] - counts[1], 0).sum() / len(edges))


def _outside_m(part: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far each point is outside the part's planes; negative inside."""
    hull = ConvexHull(part)
    return np.asarray((points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1))
