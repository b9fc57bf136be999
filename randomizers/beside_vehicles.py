"""People next to parked vehicles: at a door, or behind the boot."""

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import se3, streams
from gen_data.core.interfaces import AssetIndex
from gen_data.core.lane_geometry import LaneLine
from gen_data.core.members import Member, add_members
from gen_data.core.scene import Body, Lane, Scene
from gen_data.randomizers.asset_groups import GroupRandomizer, draw_asset, free_number
from gen_data.randomizers.base import check_known, choose
from gen_data.randomizers.free_space import Footprint, Ground, make_ground, standing_bodies
from gen_data.randomizers.pedestrian_poses import (
    has_pose_of,
    has_poses,
    pose_person,
    waiting_poses,
)
from gen_data.traffic.lane_routes import project_on_lane

COUNT_MAX = 50
_DOORS = (0.08, -0.12)
"""Places of the front and rear doors of a car ahead of its middle, in lengths (assumed)."""
_BEHIND = 0.25
"""Share of people behind a vehicle, the others are at a door (assumed)."""
_DEEP_M = 0.25
"""From the middle of a standing person to the outermost point in front (assumed)."""


class BesideVehicles(GroupRandomizer):
    """Adds people who stand next to vehicles, on a lane or pavement.

    List it after the randomizers that draw the vehicles and the group. Nobody is added whose place
    is taken or off all lanes, and no person of a pack or file whose one pose is to walk.

    Attributes:
        vehicles: Names of the groups of vehicles.
        count: Number of people.
        gap_m: Distance of a person from the side of the vehicle, or from its rear.
        turn_deg: Direction of view relative to the one towards the vehicle.
    """

    type: Literal["beside_vehicles"] = "beside_vehicles"
    stage: Literal["scene"] = "scene"
    vehicles: tuple[str, ...] = Field(min_length=1, examples=[["parked"]])
    count: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] = dist.Choice({0: 2, 1: 1})
    gap_m: Annotated[dist.Scalar, dist.Bounds(0.02, 3.0)] = dist.Uniform(0.1, 0.6)
    turn_deg: Annotated[dist.Scalar, dist.Bounds(-180, 180)] = dist.Normal(
        0.0, 50.0, (-150.0, 150.0)
    )

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if a group, or a category of the weights, is unknown."""
        super().check(scene, assets)
        groups = [group.name for group in scene.groups]
        for name in self.vehicles:
            field = f"randomizers.{self.name}.vehicles"
            check_known(name, groups, f"{field}: the template has no object group")

    def __call__(self, scene: Scene, assets: AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with people added to the group."""
        group, weights = self.find_group(scene, assets)
        vehicles = [body for body in scene.bodies if body.group in self.vehicles]
        count = self.count.draw(rng)
        if not vehicles or not weights:
            return scene
        ground = make_ground(standing_bodies(scene), assets)
        added: list[Member] = []
        for _ in range(count):
            vehicle = vehicles[int(rng.integers(len(vehicles)))]
            asset = draw_asset(weights, rng)
            pose, place = choose(waiting_poses(), rng), self._place(vehicle, assets, rng)
            if has_poses(asset) or has_pose_of(asset, waiting_poses(), assets):
                asset = pose_person(asset, (), pose, assets)
                added += _stand(asset, place, scene.lanes, ground, assets)
        members = [body for body in scene.bodies if body.group == group.name]
        return add_members(scene, group, added, assets, first=free_number(members))

    def _place(self, vehicle: Body, assets: AssetIndex, rng: streams.Rng) -> se3.SE3:
        """``T_world_place``: X towards the vehicle, turned; the height is the vehicle's."""
        bounds = assets.body_bounds_m(vehicle.asset) or assets.bounds_m(vehicle.asset)
        x0, y0, x1, y1 = (vehicle.scale * v for v in (*bounds[0][:2], *bounds[1][:2]))
        side = 1.0 if rng.uniform() < 0.5 else -1.0
        is_behind, door = rng.uniform() < _BEHIND, _DOORS[int(rng.integers(len(_DOORS)))]
        away_m = self.gap_m.draw(rng) + _DEEP_M
        across = 0.35 * float(rng.uniform(-1.0, 1.0))
        turn = math.radians(self.turn_deg.draw(rng))
        if is_behind:
            own = se3.SE3.about_z(turn, (x0 - away_m, across * (y1 - y0), 0.0))
        else:
            x = 0.5 * (x0 + x1) + door * (x1 - x0)
            y = y1 + away_m if side > 0.0 else y0 - away_m
            own = se3.SE3.about_z(turn - side * 0.5 * math.pi, (x, y, 0.0))
        return vehicle.T_world_body @ own


def _stand(
    asset: str, place: se3.SE3, lanes: Iterable[Lane], ground: Ground, assets: AssetIndex
) -> list[Member]:
    """The member, if its place is free and on a lane; it then occupies that place."""
    height_m = _height_m(lanes, place)
    bounds_m = assets.bounds_m(asset)
    if height_m is None:
        return []
    rise_m = height_m - bounds_m[0][2] - place.translation_m[2]
    pose = se3.SE3((0.0, 0.0, rise_m)) @ place
    if not ground.occupy(Footprint.of(pose, bounds_m)):
        return []
    return [Member(asset, pose.rounded(), collides=False)]


def _height_m(lanes: Iterable[Lane], place: se3.SE3) -> float | None:
    """Height of the lane that a place is on, nearest to its middle; None off all lanes."""
    x, y, _ = place.translation_m
    found: list[tuple[float, float]] = []
    for lane in lanes:
        line = LaneLine(lane)
        at = project_on_lane(line, x, y)
        if 2.0 * at.away_m <= lane.width_m:
            found.append((at.away_m / lane.width_m, line.pose(at.at_m).translation_m[2]))
    return min(found)[1] if found else None
