"""Skeletons: order of keypoints, and the bones between them."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Skeleton:
    """Names in the order in which formats list them, and bones as pairs of indices from 0."""

    names: tuple[str, ...]
    bones: tuple[tuple[int, int], ...] = ()


def _parse_skeleton(names: str, bones: str) -> Skeleton:
    listed = tuple(names.split())
    pairs = (bone.split("-") for bone in bones.split())
    return Skeleton(listed, tuple((listed.index(a), listed.index(b)) for a, b in pairs))


PERSON = _parse_skeleton(
    "nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow "
    "right_elbow left_wrist right_wrist left_hip right_hip left_knee right_knee left_ankle "
    "right_ankle",
    "left_ankle-left_knee left_knee-left_hip right_ankle-right_knee right_knee-right_hip "
    "left_hip-right_hip left_shoulder-left_hip right_shoulder-right_hip "
    "left_shoulder-right_shoulder left_shoulder-left_elbow right_shoulder-right_elbow "
    "left_elbow-left_wrist right_elbow-right_wrist left_eye-right_eye nose-left_eye "
    "nose-right_eye left_eye-left_ear right_eye-right_ear left_ear-left_shoulder "
    "right_ear-right_shoulder",
)
"""The 17 points and 19 bones of COCO's category ``person`` (person_keypoints_val2017.json)."""

VEHICLE = _parse_skeleton(
    "wheel_front_left wheel_front_right wheel_rear_left wheel_rear_right headlight_left "
    "headlight_right taillight_left taillight_right",
    "wheel_front_left-wheel_front_right wheel_rear_left-wheel_rear_right "
    "wheel_front_left-wheel_rear_left wheel_front_right-wheel_rear_right "
    "headlight_left-headlight_right taillight_left-taillight_right "
    "wheel_front_left-headlight_left wheel_front_right-headlight_right "
    "wheel_rear_left-taillight_left wheel_rear_right-taillight_right",
)

TWO_WHEELER = _parse_skeleton(
    "wheel_front wheel_rear headlight taillight",
    "wheel_front-wheel_rear wheel_front-headlight wheel_rear-taillight",
)

CYCLIST = _parse_skeleton(
    " ".join(PERSON.names + TWO_WHEELER.names),
    " ".join(f"{s.names[a]}-{s.names[b]}" for s in (PERSON, TWO_WHEELER) for a, b in s.bones),
)
"""A rider with a two-wheeler."""

HAND = _parse_skeleton(
    "wrist thumb_1 thumb_2 thumb_3 thumb_4 index_1 index_2 index_3 index_4 middle_1 middle_2 "
    "middle_3 middle_4 ring_1 ring_2 ring_3 ring_4 little_1 little_2 little_3 little_4",
    "wrist-thumb_1 thumb_1-thumb_2 thumb_2-thumb_3 thumb_3-thumb_4 wrist-index_1 index_1-index_2 "
    "index_2-index_3 index_3-index_4 wrist-middle_1 middle_1-middle_2 middle_2-middle_3 "
    "middle_3-middle_4 wrist-ring_1 ring_1-ring_2 ring_2-ring_3 ring_3-ring_4 wrist-little_1 "
    "little_1-little_2 little_2-little_3 little_3-little_4",
)
"""The 21 points and 20 bones of a hand in COCO-WholeBody (Jin et al., ECCV 2020)."""

KNOWN = (PERSON, VEHICLE, TWO_WHEELER, CYCLIST, HAND)


def find_skeleton(names: Iterable[str]) -> Skeleton:
    """The first known skeleton with all names; else a skeleton of the names without bones.

    A category's keypoints are thus the same in all data sets, even if some never occur.
    """
    listed = tuple(dict.fromkeys(names))
    for skeleton in KNOWN:
        if set(listed) <= set(skeleton.names):
            return skeleton
    return Skeleton(listed)
