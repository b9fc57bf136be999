"""Poses of people, as their family declares them."""

from collections.abc import Collection, Mapping
from functools import cache

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex

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


@cache
def waiting_poses() -> tuple[str, ...]:
    """Poses of people who stand at something, also stooped or with bags, without umbrellas."""
    held, moving = declared(_PEOPLE, "held"), moving_poses()
    at_things = ("standing", "bending", "carrying")
    return tuple(
        pose
        for pose, behaviour in _behaviours().items()
        if behaviour in at_things and pose not in moving and "umbrella" not in (held[pose] or "")
    )


def pose_person(asset: str, fitting: Collection[str], pose: str, assets: AssetIndex) -> str:
    """The asset, in another pose unless its own fits; meshes with one pose stay as they are."""
    if has_pose_of(asset, fitting, assets) or not has_poses(asset):
        return asset
    parsed = parse_asset_id(asset)
    return str(AssetId(parsed.name, {**parsed.parameters, "pose": pose}))


def has_pose_of(asset: str, fitting: Collection[str], assets: AssetIndex) -> bool:
    """Whether its pose is one of these; an asset without a pose fits everywhere."""
    own = dict(assets.get(asset).attributes).get("pose")
    return own is None or own in fitting


def has_poses(asset: str) -> bool:
    """Whether it is made in any pose: ids of files of packs and users have no parameters."""
    return bool(parse_asset_id(asset).parameters)


def _behaviours() -> Mapping[str, str]:
    behaviours: Mapping[str, str] = declared(_PEOPLE, "behaviours")
    return behaviours
