"""Poses of people, as their family declares them."""

from collections.abc import Mapping
from functools import cache

from gen_data.assets.families import declared

_PEOPLE = "simple_person"
"""Family whose poses all people have, except people from files."""


def stride_phases() -> int:
    """Number of phases of a stride."""
    phases: int = declared(_PEOPLE, "phases")
    return phases


@cache
def moving_poses() -> tuple[str, ...]:
    """Poses with a stride: their phase changes while a person walks."""
    poses: tuple[str, ...] = declared(_PEOPLE, "moving_poses")
    return poses


@cache
def walking_poses() -> tuple[str, ...]:
    """Moving poses of people who do not run."""
    behaviours = _behaviours()
    return tuple(pose for pose in moving_poses() if behaviours[pose] != "running")


@cache
def talking_poses() -> tuple[str, ...]:
    """Poses of people who stand and talk."""
    moving = moving_poses()
    return tuple(
        pose
        for pose, behaviour in _behaviours().items()
        if behaviour == "talking" and pose not in moving
    )


@cache
def free_handed_poses() -> frozenset[str]:
    """Poses of people who stand or walk with empty hands."""
    behaviours, held = _behaviours(), declared(_PEOPLE, "held")
    return frozenset(
        p for p in behaviours if not held[p] and behaviours[p] in ("walking", "standing")
    )


def _behaviours() -> Mapping[str, str]:
    behaviours: Mapping[str, str] = declared(_PEOPLE, "behaviours")
    return behaviours
