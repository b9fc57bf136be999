"""Bones, angles and skinning."""

import itertools
from collections import Counter

import numpy as np
import pytest

from gen_data.content.people import posing
from gen_data.content.people.person import draw_person
from tests.people.bodies import KINDS, body_of


def posed_heads(kind: str, pose: str, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bone heads before and after a pose, and parents."""
    body = body_of(kind)
    count = len(body.bones)
    heads = body.points_m[:count]
    transforms = posing.bone_transforms(
        body, heads, posing.bone_rotations(body, heads, posing.stance(pose, step))
    )
    after = np.einsum("bij,bj->bi", transforms[:, :, :3], heads) + transforms[:, :, 3]
    return heads, after, body.parents


@pytest.mark.parametrize("kind", KINDS)
def test_bones_keep_their_lengths_in_every_pose(kind: str) -> None:
    """Poses turn bones; they never stretch them."""
    for pose, step in itertools.product(posing.POSES, range(0, posing.PHASES, 3)):
        before, after, parents = posed_heads(kind, pose, step)
        child = np.flatnonzero(parents >= 0)
        lengths = [np.linalg.norm(p[child] - p[parents[child]], axis=1) for p in (before, after)]
        np.testing.assert_allclose(lengths[0], lengths[1], atol=1e-9, err_msg=f"{pose} {step}")


@pytest.mark.parametrize("kind", KINDS)
def test_rotations_are_rotations(kind: str) -> None:
    body = body_of(kind)
    heads = body.points_m[: len(body.bones)]
    for pose in posing.POSES:
        for rotation in posing.bone_rotations(body, heads, posing.stance(pose, 5)).values():
            np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_points_of_one_bone_move_rigidly() -> None:
    """With all weight on one bone, skinning is that bone's transform."""
    points = np.array([[1.0, 2.0, 3.0], [0.0, -1.0, 0.5]])
    quarter = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0]])
    transforms = np.stack([np.eye(3, 4), quarter])
    bones = np.array([[1, 0, 0, 0], [0, 1, 0, 0]])
    weights = np.array([[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]])
    moved = posing.skin_points(points, bones, weights, transforms)
    np.testing.assert_allclose(moved[0], [-2.0 + 5.0, 1.0 + 6.0, 10.0])
    np.testing.assert_allclose(moved[1], 0.5 * points[1] + 0.5 * np.array([6.0, 6.0, 7.5]))


def test_normals_of_a_flat_sheet_are_its_own() -> None:
    """Counter-clockwise seen from above looks up; unused vertices get up, too."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]], dtype=np.float64)
    normals = posing.vertex_normals(points, np.array([[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(normals, np.tile([0.0, 0.0, 1.0], (5, 1)))


def test_walking_is_periodic_and_opposite_legs_are_half_a_stride_apart() -> None:
    """The right leg at step k equals the left one eight steps later."""
    for pose in ("walk", "run"):
        for step in range(posing.PHASES):
            assert posing.stance(pose, step) == posing.stance(pose, step + posing.PHASES)
            assert (
                posing.stance(pose, step).right_leg
                == posing.stance(pose, step + posing.PHASES // 2).left_leg
            )


def test_the_standing_foot_is_flat_while_the_other_swings() -> None:
    """From foot flat to heel rise, hip, knee and ankle leave the sole within 3 deg of level."""
    for step in range(2, 7):
        leg = posing.stance("walk", step).left_leg
        assert abs(leg.hip - leg.knee + leg.ankle) <= 3.0


def test_there_are_more_than_sixty_poses_and_two_of_three_people_walk() -> None:
    """Poses that nobody sits or leans in without furniture are drawn."""
    drawn = Counter(draw_person(seed).pose for seed in range(600))
    assert len(posing.POSES) > 60 and len(drawn) > 50
    assert not any(pose.startswith(("sit", "lean")) for pose in drawn)
    assert 0.55 < sum(drawn[pose] for pose in posing.MOVING_POSES) / 600 < 0.75


@pytest.mark.parametrize("kind", KINDS)
def test_both_feet_of_people_who_stand_are_on_the_ground(kind: str) -> None:
    """Ankles are within 2 cm of each other's height, whichever leg carries the body."""
    for pose in posing.POSES:
        if pose in posing.MOVING_POSES or posing.BEHAVIOURS[pose] == "sitting":
            continue
        body = body_of(kind)
        _, after, _ = posed_heads(kind, pose, 0)
        left, right = (after[body.bone(f"foot_{side}"), 2] for side in "lr")
        assert abs(left - right) < 0.02, pose


def test_heads_turn_without_the_trunk() -> None:
    """A head that is turned by 42 degrees to the left faces there; the chest stays ahead."""
    body = body_of("simple")
    heads = body.points_m[: len(body.bones)]
    ahead = np.array([1.0, 0.0, 0.0])
    look, walk = (
        posing.bone_rotations(body, heads, posing.stance(pose, 4))
        for pose in ("walk_look_left", "walk")
    )
    facing = look["head"] @ ahead
    assert np.degrees(np.arctan2(facing[1], facing[0])) == pytest.approx(42.0, abs=1.0)
    np.testing.assert_allclose(look["spine_03"], walk["spine_03"])


def test_poses_fit_ages() -> None:
    """Nobody under fifteen pushes a pram, nobody over 64 runs; children run most often."""
    people = [draw_person(seed) for seed in range(1500)]
    poses = {age: {p.pose for p in people if p.age_group == age} for age in ("child", "senior")}
    assert not poses["child"] & {"push_pram", "stand_pram", "walk_stooped"}
    assert not poses["senior"] & {"run", "jog"}
    assert poses["child"] & {"run", "jog"}
