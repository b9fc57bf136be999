"""Paths from streets to the doors of houses."""

import math
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.core import interfaces, streams
from gen_data.core.members import Member, add_members, remove_members
from gen_data.core.scene import Body, Lane, Scene
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.randomizers import asset_groups, free_space

DOOR = "door"
"""Keypoint of a building where its door meets the ground."""
_STEP_M = 0.25
"""Lengths are multiples of this, which lets scenes share paths."""
_SUNK_M = 0.03


class DoorPaths(asset_groups.GroupRandomizer):
    """Lays a path from the street to the door of every house behind a garden.

    The members of the group are assets with a parameter ``length_m``. List this randomizer after
    the houses' and before the fences' and plants', which then leave the paths free.
    Houses without a keypoint ``door`` or without a garden lane before them get none.

    Attributes:
        houses: Name of the ``lane_objects`` group of houses.
        reach_m: Longest path.
    """

    type: Literal["door_paths"] = "door_paths"
    stage: Literal["scene"] = "scene"
    houses: str = "buildings"
    reach_m: float = Field(16.0, gt=0, le=60)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the group's members replaced."""
        group, weights = self.find_group(scene, assets)
        if not weights:
            return scene
        scene = remove_members(scene, group.name)
        gardens = [lane for lane in scene.lanes if lane.kind == "garden"]
        # Porches and steps reach over the paths of their houses, which are in nobody else's way.
        others = (body for body in free_space.standing_bodies(scene) if body.group != self.houses)
        ground = free_space.make_ground(others, assets)
        members = []
        for body in scene.bodies:
            if body.group != self.houses:
                continue
            for point in assets.keypoints(body.asset):
                if point.name != DOOR:
                    continue
                door_m = _door(body, point.position_m)
                end_m = self._street_edge(body, door_m, gardens)
                if end_m is None:
                    continue
                asset, pose = _lay(asset_groups.draw_asset(weights, rng), door_m, end_m)
                footprint = free_space.Footprint.of(pose, assets.bounds_m(asset))
                if ground.occupy(footprint):
                    members.append(Member(asset, pose.rounded(), collides=False))
        return add_members(scene, group, members, assets)

    def _street_edge(self, house: Body, door_m: Vec3, gardens: list[Lane]) -> Vec3 | None:
        """Where the way ahead from a door in the world leaves the garden [m]; None if not near."""
        start, ahead = np.array(door_m), house.T_world_body.rotation()[:2, 0]
        ends: list[tuple[float, float]] = []
        for lane in gardens:
            crossing = _crossing_m(np.array(lane.center_m), start[:2], ahead)
            if crossing is not None:
                # The bank is the rise from the right to the left, where the street is.
                half_m = 0.5 * lane.width_m
                ends.append((crossing[0] + half_m, crossing[1] + half_m * lane.bank))
        reach_m, z = min(ends, default=(math.inf, 0.0))
        if reach_m > self.reach_m:
            return None
        x, y = (start[:2] + reach_m * ahead).tolist()
        return (x, y, z)


def _door(house: Body, door_m: Vec3) -> Vec3:
    x, y, z = house.T_world_body.apply(house.scale * np.asarray(door_m)).tolist()
    return (x, y, z)


def _crossing_m(line_m: Array, start_m: Array, ahead: Array) -> tuple[float, float] | None:
    """Distance along a ray to a polyline [n, 3], in plan, and the line's height there [m].

    None unless it crosses to the line's left, where the street is.
    """
    a, step = line_m[:-1, :2] - start_m, np.diff(line_m[:, :2], axis=0)
    turned = ahead[0] * step[:, 1] - ahead[1] * step[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        way = (a[:, 0] * step[:, 1] - a[:, 1] * step[:, 0]) / turned
        share = (a[:, 0] * ahead[1] - a[:, 1] * ahead[0]) / turned
    hit = np.flatnonzero((turned < 0.0) & (way > 0.0) & (share >= 0.0) & (share <= 1.0))
    if not len(hit):
        return None
    k = int(hit[way[hit].argmin()])
    low, high = line_m[k : k + 2, 2]
    return float(way[k]), float(low + share[k] * (high - low))


def _lay(style: str, door_m: Vec3, street_m: Vec3) -> tuple[str, SE3]:
    """Asset and ``T_world_path`` of a path of that style, which ends at the street."""
    dx, dy, dz = (b - a for a, b in zip(door_m, street_m, strict=True))
    length_m = math.hypot(dx, dy)
    whole_m = max(2.0, math.ceil(length_m / _STEP_M)) * _STEP_M
    parsed = parse_asset_id(style)
    asset = str(AssetId(parsed.name, {**parsed.parameters, "length_m": whole_m}))
    # The rest of the last step lies below the house.
    share = 1.0 - 0.5 * whole_m / length_m
    # Half of its height lies in the ground, which is not quite level.
    z = door_m[2] + share * dz - _SUNK_M
    middle = (door_m[0] + share * dx, door_m[1] + share * dy, z)
    half_rise = 0.5 * math.atan2(dz, length_m)
    tilt = SE3(quaternion_wxyz=(math.cos(half_rise), 0.0, -math.sin(half_rise), 0.0))
    return asset, SE3.about_z(math.atan2(dy, dx), middle) @ tilt
