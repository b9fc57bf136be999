"""What stands or moves along lanes, how densely, and where."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.config.distributions import (
    Bounds,
    Constant,
    Count,
    Flag,
    NonNegative,
    Scalar,
    Uniform,
)
from gen_data.generator.core.errors import ConfigError, LayoutRejected, Rejection
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.lane_geometry import LaneLine, pose_on_lane
from gen_data.generator.core.members import Member, add_members, remove_members
from gen_data.generator.core.scene import LaneKind, ObjectGroup, Scene
from gen_data.generator.core.se3 import SE3, Vec3
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.asset_groups import CategoryWeights, draw_asset, find_group, make_wheel
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.footprints import Footprint, Ground, make_ground

COUNT_MAX = 2000
"""As many as the template's ``along`` element may have."""
PER_LANE_MAX = 20_000
"""Places in one row of a lane: a parked car every 50 cm for 10 km."""
SCALE = Bounds(0.001, 1000.0)
"""Factors that leave things an extent: scales are rounded to four decimals."""
SCATTER_TRIES = 20
"""Free places are tried this often for each thing that is scattered."""


class Along(RandomizerBase):
    """Draws the members of a template's ``lane_objects`` group anew.

    Along every lane of the group's kinds, things and gaps follow one another; what would overlap
    something that stands already is left out.

    Attributes:
        group: Name of the template's group; empty = the randomizer's own name.
        lanes: Only lanes of these kinds; empty = those of the group.
        roads: Only lanes of the elements with these names; empty = all.
        gap_m: Free length between neighbours of a row.
        passes: How often every lane is filled: several passes let people walk abreast.
        occupancy: Whether a place is taken: how full a parking lane is.
        count: How many at most: a random choice of all places; null = all.
        min_count: A layout with fewer free places is refused.
        lateral: Place across the lane, of the room there is: -1 right edge, 0 middle, 1 left edge.
        yaw_deg: Turn from the lane's direction.
        reversed: Whether it faces the other way.
        scale: Factor on its size.
        weights: How often a category is drawn compared with the others, 1 if not listed.
        min_clearance_m: Nothing else is nearer than this.
        junctions: Whether lanes across junctions count, too.
        uniform_area: Whether things are strewn over the lanes' area, turned any way, as in
            unstructured domain randomisation (Tremblay et al. 2018); ``count`` says how many.
    """

    type: Literal["lane_objects"] = "lane_objects"
    stage: Literal["scene"] = "scene"
    group: str = ""
    lanes: tuple[LaneKind, ...] = ()
    roads: tuple[str, ...] = ()
    gap_m: NonNegative = Uniform(3.0, 30.0)
    passes: int = Field(1, ge=1, le=8)
    occupancy: Flag = Constant(True)
    count: Annotated[Count, Bounds(0, COUNT_MAX)] | None = None
    min_count: int = Field(0, ge=0, le=COUNT_MAX)
    lateral: Annotated[Scalar, Bounds(-1, 1)] = Constant(0.0)
    yaw_deg: Scalar = Constant(0.0)
    reversed: Flag = Constant(False)
    scale: Annotated[Scalar, SCALE] = Constant(1.0)
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})
    min_clearance_m: float = Field(0.15, ge=0)
    junctions: bool = False
    uniform_area: bool = False

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raises ConfigError if there is no such group, or it lacks a category of the weights."""
        self._find_group(scene, assets)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the group's members exchanged.

        Raises:
            ConfigError: things and gaps are so short that a lane has room for too many.
            LayoutRejected: there is no room for the things to be scattered, or too little.
        """
        group, wheel = self._find_group(scene, assets)
        scene = remove_members(scene, group.name)
        lines = self._select_lanes(scene, group)
        roads = {lane.road for lane in scene.lanes}
        ground = make_ground(
            (b for b in scene.bodies if b.instance_id and b.name.partition("/")[0] not in roads),
            assets,
        )
        fill = self._scatter if self.uniform_area else self._fill_rows
        members = list(fill(lines, group, wheel, ground, assets, rng))
        if len(members) < self.min_count:
            remedy = (
                "a smaller min_count, gap_m or min_clearance_m, or longer roads "
                f"(randomizers.{self.name})"
            )
            raise LayoutRejected(Rejection("too few free places along lanes", remedy))
        if self.count is not None:
            wanted = self.count.draw(rng)
            members = [members[k] for k in sorted(rng.permutation(len(members))[:wanted].tolist())]
        return add_members(scene, group, members, assets)

    def _find_group(self, scene: Scene, assets: AssetIndex) -> tuple[ObjectGroup, CategoryWeights]:
        """The group, and the weighted categories of its assets."""
        field = f"randomizers.{self.name}"
        group = find_group(scene, self.group or self.name, f"{field}.group")
        return group, make_wheel(group, assets, self.weights, f"{field}.weights")

    def _select_lanes(self, scene: Scene, group: ObjectGroup) -> list[LaneLine]:
        """The lanes of the kinds and roads that are wanted."""
        kinds = self.lanes or group.lanes
        return [
            LaneLine(lane)
            for lane in scene.lanes
            if lane.kind in kinds
            and (self.junctions or not lane.junction)
            and (not self.roads or lane.road in self.roads)
        ]

    def _fill_rows(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        wheel: CategoryWeights,
        ground: Ground,
        assets: AssetIndex,
        rng: Rng,
    ) -> Iterator[Member]:
        """Things and gaps in turn along every lane, once per pass."""
        for line in lines * self.passes:
            at_m = float(rng.uniform()) * self.gap_m.draw(rng)
            for _ in range(PER_LANE_MAX):
                asset, scale, bounds_m = self._draw_thing(wheel, assets, rng)
                length_m, width_m = _extent_m(bounds_m, group.facing)
                room_m = max(0.0, 0.5 * (line.lane.width_m - width_m))
                left_m = room_m * self.lateral.draw(rng)
                turn = math.radians(self.yaw_deg.draw(rng))
                turn += math.pi if self.reversed.draw(rng) else 0.0
                used = self.occupancy.draw(rng)
                if at_m + length_m > line.length_m:
                    break
                if used:
                    place = line.pose(at_m + 0.5 * length_m, left_m)
                    pose = pose_on_lane(place, line.lane, bounds_m, group.facing, turn)
                    pose = pose.rounded()
                    if self._occupy(ground, pose, bounds_m):
                        yield Member(asset, pose, scale, collides=False)
                at_m += length_m + self.gap_m.draw(rng)
            else:
                raise ConfigError(
                    f"randomizers.{self.name}.gap_m: things and gaps are so short that a lane of "
                    f"{line.length_m:.1f} m has more than {PER_LANE_MAX:,} places; expected a "
                    "larger gap_m or scale"
                )

    def _scatter(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        wheel: CategoryWeights,
        ground: Ground,
        assets: AssetIndex,
        rng: Rng,
    ) -> Iterator[Member]:
        """Things anywhere over the lanes' area."""
        del group
        points = [point for line in lines for point in line.lane.center_m]
        low = [min(point[k] for point in points) for k in range(3)]
        high = [max(point[k] for point in points) for k in range(3)]
        for _ in range(self.count.draw(rng) if self.count is not None else 10):
            for _ in range(SCATTER_TRIES):
                asset, scale, bounds_m = self._draw_thing(wheel, assets, rng)
                x, y = (float(rng.uniform(low[k], high[k])) for k in range(2))
                stand = SE3.about_z(float(rng.uniform(0.0, 2.0 * math.pi)), (x, y, low[2]))
                pose = (stand @ SE3((0.0, 0.0, -bounds_m[0][2]))).rounded()
                if self._occupy(ground, pose, bounds_m):
                    yield Member(asset, pose, scale, collides=False)
                    break
            else:
                remedy = f"a smaller count or min_clearance_m (randomizers.{self.name})"
                raise LayoutRejected(Rejection("no room left between the lanes' things", remedy))

    def _occupy(self, ground: Ground, pose: SE3, bounds_m: tuple[Vec3, Vec3]) -> bool:
        """Take the ground under a thing if it is free; whether it was."""
        footprint = Footprint.of(pose, bounds_m)
        if not ground.is_free(footprint.grown(self.min_clearance_m)):
            return False
        ground.add(footprint)
        return True

    def _draw_thing(
        self, wheel: CategoryWeights, assets: AssetIndex, rng: Rng
    ) -> tuple[str, float, tuple[Vec3, Vec3]]:
        """An asset, its scale, and its bounds."""
        asset = draw_asset(wheel, rng)
        scale = round(self.scale.draw(rng), 4)
        (x0, y0, z0), (x1, y1, z1) = assets.bounds_m(asset)
        return asset, scale, (
            (scale * x0, scale * y0, scale * z0),
            (scale * x1, scale * y1, scale * z1),
        )  # fmt: skip


def _extent_m(bounds_m: tuple[Vec3, Vec3], facing: str) -> tuple[float, float]:
    """Extent along and across the lane."""
    x, y = bounds_m[1][0] - bounds_m[0][0], bounds_m[1][1] - bounds_m[0][1]
    return (x, y) if facing == "along" else (y, x)
