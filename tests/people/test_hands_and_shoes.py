"""Fingers at rest and in grips; shoes and their textures."""

import numpy as np
import pytest

from gen_data.content.people.body import Array
from gen_data.content.people.person import draw_person
from gen_data.content.people.person_mesh import build_person, dress_person
from gen_data.content.people.posing import bone_rotations, bone_transforms, stance
from gen_data.content.people.shoe_textures import DESIGNS, lay_out_shoes, shoe
from gen_data.core.colorimetry import srgb_decode
from tests.people.bodies import NEEDS_PACK, body_of

FINGERS = ("index", "middle", "ring", "pinky")


def posed_joints(pose: str) -> dict[str, Array]:
    """Heads of the bones in a pose, by name [m]."""
    body = body_of("pack")
    heads = body.points_m[: len(body.bones)]
    moves = bone_transforms(body, heads, bone_rotations(body, heads, stance(pose, 0)))
    places = np.einsum("bij,bj->bi", moves[:, :, :3], heads) + moves[:, :, 3]
    return dict(zip(body.bones, places, strict=True))


def angle_deg(a: Array, b: Array) -> float:
    return float(np.degrees(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))))


@NEEDS_PACK
@pytest.mark.parametrize("side", ["l", "r"])
def test_fingers_at_rest_lie_side_by_side_and_flex_more_from_index_to_little(side: str) -> None:
    """The cascade of the fingers, as in surgery's examination of hands."""
    at = posed_joints("stand")
    roots = [at[f"{name}_02_{side}"] - at[f"{name}_01_{side}"] for name in FINGERS]
    ends = [at[f"{name}_03_{side}"] - at[f"{name}_02_{side}"] for name in FINGERS]
    hand = at[f"middle_01_{side}"] - at[f"hand_{side}"]
    across = at[f"pinky_01_{side}"] - at[f"index_01_{side}"]
    aside = [abs(90.0 - angle_deg(root, across)) for root in roots]
    flexion = [angle_deg(hand, end) for end in ends]

    assert max(aside) - min(aside) < 12.0
    assert flexion == sorted(flexion)
    assert 20.0 < flexion[0] < flexion[-1] < 80.0


@NEEDS_PACK
@pytest.mark.parametrize("pose", ["stand_umbrella", "stand_cup", "stand_closed_umbrella"])
def test_what_is_held_touches_palm_and_fingers_without_filling_the_hand(pose: str) -> None:
    """Some vertices of the hand lie within 1 cm of the object; the wrist's joint does not."""
    person = draw_person(5, pose)
    solid = build_person(person, dress_person(person, body_of("pack")))
    mesh = solid.mesh
    roles = np.array([material.role for material in mesh.materials])[mesh.face_slots]
    wrist = next(k for k in solid.keypoints if k.name == "right_wrist").position_m
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    middles = corners.mean(axis=1)
    near = np.linalg.norm(middles - wrist, axis=1) < 0.2
    hand = corners[near & (roles == "skin")].reshape(-1, 3)
    thing = middles[near & ~np.isin(roles, ["skin", "top", "bottom", "hair", "eyes", "shoes"])]

    assert len(thing)
    away = np.linalg.norm(hand[:, None] - thing[None], axis=2).min(axis=1)
    assert away.min() < 0.02
    assert np.linalg.norm(thing - wrist, axis=1).min() > 0.02


@pytest.mark.slow
def test_the_rim_of_the_sole_has_its_colour_and_the_upper_another() -> None:
    """Mean texels above and below the edge; a worn rim is up to a third darker."""
    for seed, design in enumerate(DESIGNS.values()):
        image = srgb_decode(shoe(seed).albedo.astype(np.float64) / 255.0)
        rows = len(image)
        # The texture's first row is at the top: 180 degrees.
        rim = image[int(rows * (1 - 100 / 180)) : int(rows * (1 - 90 / 180))].mean(axis=(0, 1))
        wanted = srgb_decode(np.array([int(design.sole[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0)
        np.testing.assert_allclose(rim / wanted, 0.85, atol=0.2, err_msg=design.sole)


@NEEDS_PACK
def test_soles_and_uppers_meet_at_one_row() -> None:
    """The zones of the template's feet lie on either side of the row of 84 of 180 degrees."""
    body = body_of("pack")
    middles = {zone: body.points_m[body.faces[zone]].mean(axis=1) for zone in ("shoes", "soles")}
    rows_deg = {zone: 180.0 * lay_out_shoes(p)[:, 1] for zone, p in middles.items()}

    assert (rows_deg["shoes"] <= 84.5).all()
    assert (rows_deg["soles"] >= 83.5).all()
