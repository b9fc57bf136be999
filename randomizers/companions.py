"""Company for people who stand or walk along lanes: couples, families, talking circles."""

import math
from typing import Annotated, Literal

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.config import distributions as dist
from gen_data.core import se3, streams
from gen_data.core.interfaces import AssetIndex
from gen_data.core.members import Member, add_members, change_assets
from gen_data.core.scene import Body, Scene
from gen_data.randomizers.asset_groups import (
    CategoryWeights,
    GroupRandomizer,
    draw_asset,
    free_number,
)
from gen_data.randomizers.free_space import Footprint, Ground, make_ground, standing_bodies
from gen_data.randomizers.pedestrian_poses import (
    has_pose_of,
    has_poses,
    moving_poses,
    pose_person,
    talking_poses,
    walking_poses,
)

SIZE_MAX = 12
"""Largest size of a company."""
_SWAY_M = 0.2
"""Standard deviation of how far a companion walks ahead or behind."""


class Companions(GroupRandomizer):
    """Gives members of a ``lane_objects`` group company.

    List it after the randomizer that draws the group. Companions of somebody who walks walk next to
    them in the same direction; companions of somebody who stands form a circle with them and talk.
    Those who would overlap something else are left out, and so are people of packs and files whose
    one pose is to stand, next to walkers. Everybody has one way to walk in company and one way to
    talk, which lets scenes share meshes.

    Attributes:
        size: Number of people in a company, including the one who has a place already. By default a
            Poisson distribution without 0 with a mean parameter of 1: 63 % of all people
            have company; Moussaid et al., "The walking behaviour of pedestrian social groups and
            its impact on crowd dynamics", PLoS ONE 5(4), 2010, report this family of distributions
            and up to 70 %.
        gap_m: Distance between neighbours who walk abreast.
        radius_m: Radius of a circle of two; larger circles grow with their size.
        min_clearance_m: Smallest distance to anything else.
    """

    type: Literal["companions"] = "companions"
    stage: Literal["scene"] = "scene"
    size: Annotated[dist.Count, dist.Bounds(1, SIZE_MAX)] = dist.Choice(
        {1: 0.582, 2: 0.291, 3: 0.097, 4: 0.024, 5: 0.006}
    )
    gap_m: Annotated[dist.Scalar, dist.Bounds(0.3, 5.0)] = dist.Uniform(0.6, 0.85)
    radius_m: Annotated[dist.Scalar, dist.Bounds(0.2, 5.0)] = dist.Uniform(0.4, 0.6)
    min_clearance_m: float = 0.02

    def __call__(self, scene: Scene, assets: AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with companions added to the group."""
        group, weights = self.find_group(scene, assets)
        leaders = [body for body in scene.bodies if body.group == group.name]
        ground = make_ground(standing_bodies(scene), assets)
        added: list[Member] = []
        changed: dict[str, str] = {}
        for leader in leaders:
            others = self.size.draw(rng) - 1
            pose = dict(assets.get(leader.asset).attributes).get("pose", "")
            if others == 0:
                continue
            if not pose or pose in moving_poses():
                added += self._walk_beside(leader, others, weights, ground, assets, rng)
            else:
                changed[leader.name] = _talking(leader.asset, assets)
                added += self._stand_around(leader, others, weights, ground, assets, rng)
        scene = change_assets(scene, changed)
        return add_members(scene, group, added, assets, first=free_number(leaders))

    def _walk_beside(
        self,
        leader: Body,
        others: int,
        weights: CategoryWeights,
        ground: Ground,
        assets: AssetIndex,
        rng: streams.Rng,
    ) -> list[Member]:
        """Companions to the left and right by turns, in the leader's direction."""
        made = []
        side = 1.0 if rng.uniform() < 0.5 else -1.0
        gap_m = self.gap_m.draw(rng)
        for k in range(others):
            drawn = draw_asset(weights, rng)
            aside_m = side * gap_m * (k // 2 + 1) * (-1.0 if k % 2 else 1.0)
            ahead_m = _SWAY_M * float(rng.normal())
            if not has_pose_of(drawn, walking_poses(), assets) and not has_poses(drawn):
                continue  # a mesh that stands cannot walk
            place = leader.T_world_body @ se3.SE3((ahead_m, aside_m, 0.0))
            made += self._place(_walking(drawn, assets), place, ground, assets)
        return made

    def _stand_around(
        self,
        leader: Body,
        others: int,
        weights: CategoryWeights,
        ground: Ground,
        assets: AssetIndex,
        rng: streams.Rng,
    ) -> list[Member]:
        """Companions on a circle ahead of the leader; all look to its middle."""
        radius_m = self.radius_m.draw(rng) / math.sin(math.pi / (others + 1))
        middle = leader.T_world_body @ se3.SE3((radius_m, 0.0, 0.0))
        made = []
        for k in range(others):
            asset = _talking(draw_asset(weights, rng), assets)
            turn = 2.0 * math.pi * (k + 1) / (others + 1) + 0.15 * float(rng.normal())
            place = middle @ se3.SE3.about_z(turn) @ se3.SE3((-radius_m, 0.0, 0.0))
            made += self._place(asset, place, ground, assets)
        return made

    def _place(self, asset: str, pose: se3.SE3, ground: Ground, assets: AssetIndex) -> list[Member]:
        """The member, if its place is free; it then occupies that place."""
        footprint = Footprint.of(pose, assets.bounds_m(asset))
        if not ground.occupy(footprint, self.min_clearance_m):
            return []
        return [Member(asset, pose.rounded(), collides=False)]


def _walking(asset: str, assets: AssetIndex) -> str:
    """The asset as it walks: in its own pose if that is a walk, at its own phase."""
    return pose_person(asset, walking_poses(), "walk", assets)


def _talking(asset: str, assets: AssetIndex) -> str:
    """The asset as it stands and talks: each seed in one of the poses."""
    seed = parse_asset_id(asset).parameters.get("seed", 0)
    poses = talking_poses()
    pose = poses[seed % len(poses)] if isinstance(seed, int) else poses[0]
    return pose_person(asset, poses, pose, assets)
