"""Built people: on the ground, of the right size, with keypoints inside them."""

from collections import Counter

import numpy as np
import pytest

from gen_data.assets.family import Solid
from gen_data.content.people.person import Person, draw_person
from gen_data.content.people.person_mesh import build_person, dress_person, simple_person
from gen_data.content.people.posing import HELD
from gen_data.core.asset_types import MeshData
from tests.people.bodies import KINDS, body_of

# https://cocodataset.org/#keypoints-2020, in the order of its annotation files.
COCO_17 = [
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee",
    "right_knee", "left_ankle", "right_ankle",
]  # fmt: skip
SEEDS = range(12)
POSES = ("walk", "run", "stand", "phone", "carry", "sit", "crouch", "bend_deep", "stand_crossed",
         "call", "walk_umbrella", "push_pram", "pull_suitcase", "wave")  # fmt: skip
"""One of each kind; all poses would take minutes."""


def made(person: Person, kind: str) -> Solid:
    return build_person(person, dress_person(person, body_of(kind)))


def distances_m(points: np.ndarray, mesh: MeshData) -> np.ndarray:
    """From each point to the nearest vertex or middle of a face."""
    vertices = mesh.vertices_m.astype(np.float64)
    samples = np.concatenate([vertices, vertices[mesh.faces].mean(axis=1)])
    return np.sqrt(((points[:, None] - samples[None]) ** 2).sum(axis=2)).min(axis=1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pose", POSES)
def test_the_lowest_vertex_stands_on_the_ground(kind: str, pose: str) -> None:
    """The ground is z = 0, whatever a person does."""
    for phase in (0.0, 0.3125):
        assert made(draw_person(3, pose, phase), kind).mesh.vertices_m[:, 2].min() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_standing_people_are_as_tall_as_their_facts_say(kind: str) -> None:
    """Shoes, hair and hats add at most 7 cm, and nothing takes more than 2 cm away."""
    for seed in SEEDS:
        person = draw_person(seed, "stand")
        top = float(made(person, kind).mesh.vertices_m[:, 2].max())
        assert person.height_m - 0.02 <= top <= person.height_m + 0.07


@pytest.mark.parametrize("kind", KINDS)
def test_people_have_cocos_seventeen_keypoints_in_its_order(kind: str) -> None:
    """Names and order as in the COCO data set."""
    keypoints = made(draw_person(0), kind).keypoints
    assert [point.name for point in keypoints] == COCO_17


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pose", ["stand", "walk", "sit"])
def test_left_keypoints_lie_to_the_left_of_right_ones(kind: str, pose: str) -> None:
    """+X is ahead and Z up, so left is +Y."""
    for seed in SEEDS:
        points = made(draw_person(seed, pose), kind).keypoints
        at = {point.name: np.array(point.position_m) for point in points}
        for name, place in at.items():
            if name.startswith("left_"):
                assert place[1] > at[name.replace("left_", "right_")][1], (seed, name)
        assert at["nose"][0] > 0.5 * (at["left_ear"][0] + at["right_ear"][0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pose", POSES)
def test_every_keypoint_lies_no_deeper_than_its_radius(kind: str, pose: str) -> None:
    """Else a keypoint in full view would count as hidden."""
    for seed in SEEDS[:4]:
        solid = made(draw_person(seed, pose, 0.125), kind)
        points = np.array([point.position_m for point in solid.keypoints])
        radii = np.array([point.radius_m for point in solid.keypoints])
        deep = distances_m(points, solid.mesh)
        wrong = [solid.keypoints[i].name for i in np.flatnonzero(deep > radii)]
        assert not wrong, (seed, wrong, deep - radii)


@pytest.mark.parametrize("kind", KINDS)
def test_standing_bodies_are_mirror_images_of_themselves(kind: str) -> None:
    """Joints of a symmetric pose differ in the sign of y only."""
    points = made(draw_person(5, "stand"), kind).keypoints
    at = {point.name: np.array(point.position_m) for point in points}
    for name, place in at.items():
        if name.startswith("left_"):
            mirrored = at[name.replace("left_", "right_")] * (1.0, -1.0, 1.0)
            np.testing.assert_allclose(place, mirrored, atol=0.004)


@pytest.mark.parametrize("kind", KINDS)
def test_half_a_stride_later_left_and_right_have_changed_places(kind: str) -> None:
    """A walk is the same on both sides, half a stride apart."""
    now, later = (
        {k.name: np.array(k.position_m) for k in made(person, kind).keypoints}
        for person in (draw_person(4, "walk", 0.125), draw_person(4, "walk", 0.625))
    )
    for joint in ("knee", "ankle", "wrist", "hip"):
        mirrored = later[f"right_{joint}"] * (1.0, -1.0, 1.0)
        np.testing.assert_allclose(now[f"left_{joint}"], mirrored, atol=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_a_stride_takes_the_left_foot_forward_first(kind: str) -> None:
    """Phase 0 is the left heel strike: left foot ahead, right arm ahead."""
    points = made(draw_person(4, "walk", 0.0), kind).keypoints
    at = {point.name: point.position_m for point in points}
    assert at["left_ankle"][0] > at["right_ankle"][0] + 0.3
    assert at["right_wrist"][0] > at["left_wrist"][0] + 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_people_keep_to_the_triangle_budget(kind: str) -> None:
    """At most 6,400 triangles, clothes, hair and bags included; 7,200 with a pram."""
    for seed in range(20):
        assert len(made(draw_person(seed, "carry"), kind).mesh.faces) <= 6400
        assert len(made(draw_person(seed, "push_pram"), kind).mesh.faces) <= 7200


def test_things_in_hands_do_not_lift_people_off_the_ground() -> None:
    """Bags, wheels and cases end above the lowest sole: shoes reach the ground."""
    for held, pose in {HELD[pose]: pose for pose in HELD if HELD[pose]}.items():
        for seed in (3, 8):
            solid = made(draw_person(seed, pose, 0.0), "simple")
            shoes = [k for k, m in enumerate(solid.mesh.materials) if m.role == "shoes"]
            faces = solid.mesh.faces[np.isin(solid.mesh.face_slots, shoes)]
            assert solid.mesh.vertices_m[faces, 2].min() < 0.004, held


@pytest.mark.parametrize("kind", KINDS)
def test_meshes_are_well_formed(kind: str) -> None:
    """Indices are in range, normals are unit, faces have three corners, all is finite."""
    for seed in SEEDS:
        mesh = made(draw_person(seed), kind).mesh
        assert np.isfinite(mesh.vertices_m).all()
        assert mesh.faces.min() == 0 and mesh.faces.max() == len(mesh.vertices_m) - 1
        assert mesh.face_slots.max() < len(mesh.materials)
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-3)
        a, b, c = mesh.faces.T
        assert not ((a == b) | (b == c) | (a == c)).any()


@pytest.mark.parametrize("kind", KINDS)
def test_normals_look_outward(kind: str) -> None:
    """Normals of a torso point away from the body's axis, far more often than not."""
    mesh = made(draw_person(5, "stand"), kind).mesh
    v, n = mesh.vertices_m, mesh.normals
    trunk = (v[:, 2] > 1.1) & (v[:, 2] < 1.3) & (np.abs(v[:, 1]) < 0.12)
    assert ((v[trunk] * n[trunk])[:, :2].sum(axis=1) > 0.0).mean() > 0.95


@pytest.mark.parametrize("kind", KINDS)
def test_every_material_says_what_it_is(kind: str) -> None:
    """Roles let randomizers recolour clothes and leave skin alone."""
    mesh = made(draw_person(5, "stand"), kind).mesh
    roles = Counter(material.role for material in mesh.materials)
    assert {"skin", "hair", "eyes", "top", "bottom", "shoes"} <= set(roles)
    assert "" not in roles


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_person_is_the_same_bytes(kind: str) -> None:
    first, second = (made(draw_person(9, "walk", 0.25), kind) for _ in range(2))
    assert first.mesh.vertices_m.tobytes() == second.mesh.vertices_m.tobytes()
    assert first.mesh.normals.tobytes() == second.mesh.normals.tobytes()
    assert first.keypoints == second.keypoints
    assert first.mesh.materials == second.mesh.materials


def test_a_pose_is_the_same_whatever_the_same_person_did_before() -> None:
    """Shape and clothes are kept from pose to pose; nothing of a pose is."""
    first = simple_person(7, "walk", 0.25).mesh
    simple_person(7, "sit", 0.0)
    again, fresh = (
        simple_person(7, "walk", 0.25).mesh,
        made(draw_person(7, "walk", 0.25), "simple"),
    )
    for name in ("vertices_m", "normals", "faces", "face_slots"):
        expected = getattr(first, name).tobytes()
        assert getattr(again, name).tobytes() == expected
        assert getattr(fresh.mesh, name).tobytes() == expected
