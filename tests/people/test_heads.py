"""Faces, eyes and hair of people, and their umbrellas."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.content.people import analytic_body, carried_things, edges, head_layout
from gen_data.content.people.face_textures import EYES, FACES, eyes, face
from gen_data.content.people.person import draw_person
from gen_data.content.people.person_mesh import build_person, dress_person
from gen_data.content.procedural.material_presets import hex_to_srgb8
from gen_data.core.asset_types import MeshData, TextureData


def texel(texture: TextureData, uv: np.ndarray) -> np.ndarray:
    """Mean colour of the nine texels around texture coordinates."""
    height, width, _ = texture.albedo.shape
    column, row = int(uv[0] * width), int((1.0 - uv[1]) * height)
    field = texture.albedo[row - 1 : row + 2, column - 1 : column + 2]
    return np.asarray(field.reshape(-1, 3).astype(np.float64).mean(axis=0))


def built(haircut: str, pose: str = "stand") -> MeshData:
    person = draw_person(3, pose)
    person = replace(person, haircut=haircut, outfit=replace(person.outfit, headwear=""))
    return build_person(person, dress_person(person, analytic_body.simple_body())).mesh


def faces_of(mesh: MeshData, role: str) -> np.ndarray:
    """Triangles whose material has a role, as vertices [n, 3, 3]; brows do not count as hair."""
    slots = [
        k
        for k, material in enumerate(mesh.materials)
        if material.role == role and (material.texture or role != "hair")
    ]
    return np.asarray(mesh.vertices_m[mesh.faces[np.isin(mesh.face_slots, slots)]])


def test_brows_and_lips_lie_where_the_body_has_them() -> None:
    """Places of the template body: forehead, brow, cheek and lips."""
    image = face(list(FACES).index("woman_made_up"))
    places = np.array([(0.148, 0.02, 0.777), (0.14, 0.033, 0.7555), (0.155, 0.003, 0.668)])
    forehead, brow, lips = (texel(image, uv) for uv in head_layout.lay_out_head(places))
    assert brow.mean() < 0.75 * forehead.mean()
    assert lips[0] - lips[1] > forehead[0] - forehead[1] + 30.0


def test_a_beard_darkens_the_jaw_only() -> None:
    """The chin is darker than a woman's, the cheek under the eye is not."""
    names = list(FACES)
    chin, cheek = head_layout.lay_out_head(np.array([(0.148, 0.005, 0.632), (0.13, 0.045, 0.705)]))
    bearded, bare = face(names.index("man_bearded")), face(names.index("woman"))
    assert texel(bearded, chin).mean() < 0.7 * texel(bare, chin).mean()
    assert texel(bearded, cheek).mean() > 0.9 * texel(bare, cheek).mean()


@pytest.mark.parametrize("cell", range(8))
def test_eyes_have_a_pupil_in_an_iris_of_their_colour(cell: int) -> None:
    """From the middle outward: black, the colour of the table, white."""
    middle, ring, white = (
        texel(eyes(0), head_layout.lay_out_eyes(np.array([(0.137, 0.0308 + y, 0.7276)]), cell)[0])
        for y in (0.0, 0.0042, 0.0078)
    )
    colour = np.array(hex_to_srgb8(list(EYES.values())[cell]), dtype=np.float64)
    assert middle.max() < 30.0
    assert np.argsort(ring).tolist() == np.argsort(colour).tolist()
    assert white.mean() > ring.mean()


def test_a_hairline_has_locks_of_uneven_length() -> None:
    """The lower edge of short hair varies by centimetres, and no vertex of it is shared."""
    fringe, plain = (faces_of(built(cut), "hair") for cut in ("fringe", "cropped"))

    def forehead_edge_m(triangles: np.ndarray) -> np.ndarray:
        front = triangles[triangles[:, :, 0].max(axis=1) > 0.13]
        return np.asarray(np.unique(front[:, :, 2].min(axis=1)))

    assert forehead_edge_m(fringe).min() < forehead_edge_m(plain).min() - 0.005
    assert np.ptp(forehead_edge_m(fringe)) > 0.02


def test_a_horseshoe_leaves_the_crown_bald() -> None:
    """Hair ends below the top of the head; skin covers it."""
    mesh = built("horseshoe")
    top = float(mesh.vertices_m[:, 2].max())
    assert faces_of(mesh, "hair")[:, :, 2].max() < top - 0.03
    assert faces_of(mesh, "skin")[:, :, 2].max() == pytest.approx(top)


@pytest.mark.parametrize("haircut", ["bun", "ponytail"])
def test_tied_hair_touches_the_back_of_the_head(haircut: str) -> None:
    """A knot begins in the hair that it is tied of."""
    tied, short = (faces_of(built(cut), "hair").reshape(-1, 3) for cut in (haircut, "cropped"))
    assert tied[:, 0].min() < short[:, 0].min() - 0.03
    knot = tied[tied[:, 0] < short[:, 0].min() - 0.001]
    away = np.sqrt(((knot[:, None] - short[None]) ** 2).sum(axis=2)).min()
    assert away < 0.04


def test_calm_vectors_of_a_border_hardly_change_from_one_vertex_to_the_next() -> None:
    """A fan of six triangles whose rim zigzags; inner vertices keep theirs."""
    turn = 2.0 * np.pi * np.arange(6) / 6
    faces = np.array([(0, 1 + k, 1 + (k + 1) % 6) for k in range(6)])
    vectors = np.stack([np.cos(turn), np.sin(turn), np.where(np.arange(6) % 2, 1.0, -1.0)], axis=1)
    vectors = np.concatenate([[(0.0, 0.0, 1.0)], vectors])

    smooth = edges.calm(vectors, edges.border_edges(faces), 6)

    np.testing.assert_array_equal(smooth[0], vectors[0])
    assert np.abs(smooth[1:, 2]).max() < 0.02


def umbrella_of(pose: str) -> tuple[MeshData, np.ndarray, np.ndarray]:
    """A person, the vertices of the umbrella's cloth, and the right wrist."""
    person = draw_person(3, pose)
    person = replace(person, outfit=replace(person.outfit, bag=""))
    solid = build_person(person, dress_person(person, analytic_body.simple_body()))
    counts = np.bincount(solid.mesh.face_slots, minlength=len(solid.mesh.materials))
    bags = [k for k, material in enumerate(solid.mesh.materials) if material.role == "bag"]
    cloth = max(bags, key=lambda k: int(counts[k]))
    vertices = solid.mesh.vertices_m[solid.mesh.faces[solid.mesh.face_slots == cloth]]
    wrist = next(k.position_m for k in solid.keypoints if k.name == "right_wrist")
    return solid.mesh, vertices.reshape(-1, 3), np.array(wrist)


@pytest.mark.parametrize("pose", ["walk_umbrella", "stand_umbrella"])
def test_an_open_umbrella_is_above_the_head_and_a_metre_wide(pose: str) -> None:
    """Usual umbrellas have a diameter of 95 to 105 cm."""
    mesh, cloth, wrist = umbrella_of(pose)
    skin = faces_of(mesh, "hair")[:, :, 2].max()
    assert cloth[:, 2].max() > skin + 0.1
    assert 0.9 < np.ptp(cloth[:, 1]) < 1.05
    axis = cloth[:, :2].mean(axis=0)
    assert np.hypot(*(axis - wrist[:2])) < 0.3


@pytest.mark.parametrize("pose", ["walk_closed_umbrella", "stand_closed_umbrella"])
def test_a_closed_umbrella_hangs_from_the_hand(pose: str) -> None:
    """It is slim, ends above the ground and begins at the hand."""
    _, cloth, wrist = umbrella_of(pose)
    assert np.ptp(cloth[:, 1]) < 0.15
    assert 0.02 < cloth[:, 2].min() < cloth[:, 2].max() < wrist[2]


def test_an_open_umbrella_has_eight_ribs_with_struts() -> None:
    """Rods of six triangles: two for each rib, one strut."""
    person = draw_person(3, "stand_umbrella")
    figure = dress_person(person, analytic_body.simple_body())
    made: list[carried_things.Sheet] = []
    original = carried_things.make_things

    def kept(carrier: object) -> list[carried_things.Sheet]:
        made.extend(original(carrier))  # type: ignore[arg-type]
        return made

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gen_data.content.people.person_mesh.make_things", kept)
        build_person(person, figure)
    assert sum(len(sheet.faces) == 6 for sheet in made) == 3 * 8
