"""What stands or moves along lanes, how densely, and where."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from generator.config.distributions import (
    Bounds,
    Constant,
    Count,
    Flag,
    NonNegative,
    Positive,
    Scalar,
    Uniform,
)
from generator.core.errors import LayoutRejected, Rejection
from generator.core.interfaces import AssetIndex
from generator.core.lanes import LaneLine, standing_on_lane
from generator.core.scene import Body, Instance, LaneKind, ObjectGroup, Scene
from generator.core.se3 import SE3, Vec3
from generator.core.streams import Rng
from randomizers.base import RandomizerBase
from randomizers.footprints import Footprint, Ground, ground_of
from randomizers.groups import Wheel, drawn_asset, free_ids, group_named, wheel_of, without_members

SCATTER_TRIES = 20
"""Free places are tried this often for each thing that is scattered."""


@dataclass(frozen=True, slots=True)
class Place:
    """Something that has found its place."""

    asset: str
    scale: float
    T_world_body: SE3


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
    count: Count | None = None
    min_count: int = Field(0, ge=0)
    lateral: Annotated[Scalar, Bounds(-1, 1)] = Constant(0.0)
    yaw_deg: Scalar = Constant(0.0)
    reversed: Flag = Constant(False)
    scale: Positive = Constant(1.0)
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})
    min_clearance_m: float = Field(0.15, ge=0)
    junctions: bool = False
    uniform_area: bool = False

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the group's members exchanged.

        Raises:
            LayoutRejected: there is no room for what is to be scattered, or too little.
        """
        group = group_named(scene, self.group or self.name, f"randomizers.{self.name}.group")
        scene = without_members(scene, group.name)
        wheel = wheel_of(group, assets, self.weights, f"randomizers.{self.name}.weights")
        kinds = self.lanes or group.lanes
        lines = [
            LaneLine(lane)
            for lane in scene.lanes
            if lane.kind in kinds
            and (self.junctions or not lane.junction)
            and (not self.roads or lane.road in self.roads)
        ]
        roads = {lane.road for lane in scene.lanes}
        ground = ground_of(
            (b for b in scene.bodies if b.instance_id and b.name.partition("/")[0] not in roads),
            assets,
        )
        walk = self._strewn if self.uniform_area else self._walked
        places = list(walk(lines, group, wheel, ground, assets, rng))
        if len(places) < self.min_count:
            remedy = (
                "a smaller min_count, gap_m or min_clearance_m, or longer roads "
                f"(randomizers.{self.name})"
            )
            raise LayoutRejected(Rejection("too few free places along lanes", remedy))
        if self.count is not None:
            wanted = self.count.draw(rng)
            places = [places[k] for k in sorted(rng.permutation(len(places))[:wanted].tolist())]
        return _with_members(scene, group, places, assets)

    def _walked(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        wheel: Wheel,
        ground: Ground,
        assets: AssetIndex,
        rng: Rng,
    ) -> Iterator[Place]:
        """Things and gaps in turn along every lane, once per pass."""
        for line in lines * self.passes:
            at_m = float(rng.uniform()) * self.gap_m.draw(rng)
            while True:
                asset, scale, bounds_m = self._thing(wheel, assets, rng)
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
                    pose = standing_on_lane(place, line.lane, bounds_m, group.facing, turn)
                    pose = pose.rounded()
                    footprint = Footprint.of(pose, bounds_m)
                    if ground.is_free(footprint.grown(self.min_clearance_m)):
                        ground.add(footprint)
                        yield Place(asset, scale, pose)
                at_m += length_m + self.gap_m.draw(rng)

    def _strewn(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        wheel: Wheel,
        ground: Ground,
        assets: AssetIndex,
        rng: Rng,
    ) -> Iterator[Place]:
        """Things anywhere over the lanes' area."""
        del group
        points = [point for line in lines for point in line.lane.center_m]
        low = [min(point[k] for point in points) for k in range(3)]
        high = [max(point[k] for point in points) for k in range(3)]
        for _ in range(self.count.draw(rng) if self.count is not None else 10):
            for _ in range(SCATTER_TRIES):
                asset, scale, bounds_m = self._thing(wheel, assets, rng)
                x, y = (float(rng.uniform(low[k], high[k])) for k in range(2))
                turned = SE3.about_z(float(rng.uniform(0.0, 2.0 * math.pi)), (x, y, low[2]))
                pose = (turned @ SE3((0.0, 0.0, -bounds_m[0][2]))).rounded()
                footprint = Footprint.of(pose, bounds_m)
                if ground.is_free(footprint.grown(self.min_clearance_m)):
                    ground.add(footprint)
                    yield Place(asset, scale, pose)
                    break
            else:
                remedy = f"a smaller count or min_clearance_m (randomizers.{self.name})"
                raise LayoutRejected(Rejection("no room left between the lanes' things", remedy))

    def _thing(
        self, wheel: Wheel, assets: AssetIndex, rng: Rng
    ) -> tuple[str, float, tuple[Vec3, Vec3]]:
        """An asset, its scale, and its bounds."""
        asset = drawn_asset(wheel, rng)
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


def _with_members(
    scene: Scene, group: ObjectGroup, places: list[Place], assets: AssetIndex
) -> Scene:
    ids = free_ids(scene, len(places))
    bodies, instances = [], []
    for k, (place, instance_id) in enumerate(zip(places, ids, strict=True)):
        name = f"{group.name}/{k}"
        category = assets.get(place.asset).category
        body = Body(
            name,
            place.asset,
            place.T_world_body,
            place.scale,
            instance_id=instance_id,
            group=group.name,
            collides=False,
        )
        bodies.append(body)
        instances.append(
            Instance(instance_id, name, category, 0, place.asset, annotated=group.annotated)
        )
    return replace(
        scene,
        bodies=(*scene.bodies, *bodies),
        instances=(*scene.instances, *instances),
    )
