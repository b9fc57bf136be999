"""Objects along lanes: which, how densely, and where."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import errors, interfaces
from gen_data.core.lane_geometry import LaneLine, pose_on_lane
from gen_data.core.members import Member, add_members, remove_members
from gen_data.core.scene import LaneKind, ObjectGroup, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import free_space
from gen_data.randomizers.asset_groups import CategoryWeights, GroupRandomizer, draw_asset

COUNT_MAX = 2000
"""Largest count of the template's ``lane_objects`` element."""
PER_LANE_MAX = 20_000
"""Largest number of places along one lane: one every 50 cm for 10 km."""
SCALE = dist.Bounds(0.001, 1000.0)
"""Scales are rounded to four decimals: none in this range becomes 0."""
LAND_FALL_M, LAND_SLOPE_M = 0.25, 6.0
"""The land slopes down by about this much behind a sidewalk, over this distance."""
JOINT_M = 0.01
"""Gap between the objects of a run."""
SCATTER_TRIES = 20
"""Attempts to find a free place for one scattered object."""


Bounds = tuple[Vec3, Vec3]
BoundsOf = Callable[[str], tuple[Bounds, Bounds]]
"""``_bounds_m`` of a library; most assets are drawn again and again."""
Thing = tuple[str, float, Bounds, Bounds]
"""Asset, scale, its scaled bounds [m], and the part of them that nothing else may enter."""


@dataclass(frozen=True, slots=True)
class _Run:
    """Equal objects in a row, up to an arc length of the lane.

    Attributes:
        used: Whether their places are occupied; None = drawn place by place.
    """

    thing: Thing
    end_m: float
    used: bool | None


class LaneObjects(GroupRandomizer):
    """Replaces the members of a template's ``lane_objects`` group by drawn ones.

    Objects and gaps alternate along every lane of the group's kinds; objects that would overlap
    existing ones are left out.

    Attributes:
        lanes: Kinds of lanes to use; empty = the group's.
        roads: Names of the elements whose lanes to use; empty = all.
        gap_m: Gap between neighbours along a lane, or between runs.
        run_m: Length of a run: the same asset again and again without gaps, such as the fence of
            one garden, whose pieces overlap in bends if ``min_clearance_m`` is 0; 0 = every object
            is drawn by itself.
        passes: Number of times to fill every lane: several passes let people walk abreast.
        occupancy: Whether a place is occupied; its probability is how full a parking lane is.
        fade_m: Distance from the ego vehicle over which the share of occupied places falls to 1/e:
            pictures then show fewer far objects; null = it does not fall.
        count: Largest number of objects, chosen at random from all places; null = no limit.
        min_count: Smallest number of free places; a layout with fewer is rejected.
        lateral: Position across the free width of the lane: -1 right edge, 0 middle, 1 left edge.
        behind_m: Distance to the right of the lane, which is away from the street on lanes next to
            it: second rows of houses, trees behind them.
        yaw_deg: Rotation from the lane's direction.
        reversed: Whether an object faces against the lane's direction.
        scale: Factor on an object's size.
        min_clearance_m: Smallest distance to any other object.
        junctions: Whether to use lanes across junctions, too.
        among: Lanes to use of several that have the same direction.
        uniform_area: Whether to scatter objects over the bounding rectangle of the lanes at any
            yaw, as in unstructured domain randomisation (Tremblay et al. 2018); ``count`` sets
            their number.
    """

    type: Literal["lane_objects"] = "lane_objects"
    stage: Literal["scene"] = "scene"
    lanes: tuple[LaneKind, ...] = ()
    roads: tuple[str, ...] = ()
    gap_m: dist.NonNegative = dist.Uniform(3.0, 30.0)
    run_m: dist.NonNegative = dist.Constant(0.0)
    passes: int = Field(1, ge=1, le=8)
    occupancy: dist.Flag = dist.Constant(True)
    fade_m: float | None = Field(None, gt=0)
    count: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] | None = None
    min_count: int = Field(0, ge=0, le=COUNT_MAX)
    lateral: Annotated[dist.Scalar, dist.Bounds(-1, 1)] = dist.Constant(0.0)
    behind_m: dist.NonNegative = dist.Constant(0.0)
    yaw_deg: dist.Scalar = dist.Constant(0.0)
    reversed: dist.Flag = dist.Constant(False)
    scale: Annotated[dist.Scalar, SCALE] = dist.Constant(1.0)
    min_clearance_m: float = Field(0.15, ge=0)
    junctions: bool = False
    among: Literal["all", "leftmost", "rightmost"] = "all"
    uniform_area: bool = False

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: Rng) -> Scene:
        """Return the scene with the group's members replaced."""
        group, weights = self.find_group(scene, assets)
        if not weights:
            return scene
        scene = remove_members(scene, group.name)
        lines = self._select_lanes(scene, group)
        ground = free_space.make_ground(free_space.standing_bodies(scene), assets)
        fill = self._scatter if self.uniform_area else self._fill_rows
        bounds_of = cache(partial(_bounds_m, assets))
        members = list(fill(lines, group, weights, ground, bounds_of, rng))
        if self.fade_m is not None:
            members = self._thin_out(members, scene, self.fade_m, rng)
        if len(members) < self.min_count:
            remedy = "a smaller min_count, gap_m or min_clearance_m, or longer roads"
            raise self.reject("too few free places along lanes", remedy)
        if self.count is not None:
            wanted = self.count.draw(rng)
            members = [members[k] for k in sorted(rng.permutation(len(members))[:wanted].tolist())]
        return add_members(scene, group, members, assets)

    def _thin_out(
        self, members: list[Member], scene: Scene, fade_m: float, rng: Rng
    ) -> list[Member]:
        """Leave out members at random, more of them far from the ego vehicle."""
        egos = [scene.body(rig.body).T_world_body for rig in scene.rigs if rig.body]
        if not egos:
            raise errors.ConfigError(
                f"randomizers.{self.name}.fade_m: the template has no ego vehicle; list an element "
                "of type ego, or leave fade_m out"
            )
        ego_x, ego_y, _ = egos[0].translation_m

        def stays(member: Member) -> bool:
            x, y, _ = member.T_world_body.translation_m
            return float(rng.uniform()) < math.exp(-math.hypot(x - ego_x, y - ego_y) / fade_m)

        return [member for member in members if stays(member)]

    def _select_lanes(self, scene: Scene, group: ObjectGroup) -> list[LaneLine]:
        kinds = self.lanes or group.lanes
        return [
            LaneLine(lane)
            for lane in scene.lanes
            if lane.kind in kinds
            and (self.junctions or not lane.junction)
            and not (self.among == "rightmost" and lane.right)
            and not (self.among == "leftmost" and lane.left)
            and (not self.roads or lane.road in self.roads)
        ]

    def _fill_rows(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        weights: CategoryWeights,
        ground: free_space.Ground,
        bounds_of: BoundsOf,
        rng: Rng,
    ) -> Iterator[Member]:
        """Alternate objects and gaps along every lane, once per pass."""
        for line in lines * self.passes:
            at_m = float(rng.uniform()) * self.gap_m.draw(rng)
            run = self._draw_run(at_m, weights, bounds_of, rng)
            joined: list[free_space.Footprint] = []
            for _ in range(PER_LANE_MAX):
                asset, scale, bounds_m, solid_m = run.thing
                length_m, width_m = _extent_m(bounds_m, group.facing)
                free_m = line.half_width_m(at_m + 0.5 * length_m) - 0.5 * width_m
                # Lanes that taper have no width where they begin or end.
                fits = free_m >= 0.0 or not line.lane.widths_m
                room_m = max(0.0, free_m)
                left_m = room_m * self.lateral.draw(rng)
                behind_m = self.behind_m.draw(rng)
                turn = math.radians(self.yaw_deg.draw(rng))
                turn += math.pi if self.reversed.draw(rng) else 0.0
                used = run.used if run.used is not None else self.occupancy.draw(rng)
                if at_m + length_m > line.length_m:
                    break
                if used and fits:
                    place = line.pose(at_m + 0.5 * length_m, left_m - behind_m)
                    place = place @ SE3((0.0, 0.0, -_land_fall_m(behind_m)))
                    pose = pose_on_lane(place, line.lane, bounds_m, group.facing, turn)
                    pose = pose.rounded()
                    footprint = free_space.Footprint.of(pose, solid_m)
                    if ground.is_free(footprint.expand(self.min_clearance_m)):
                        # On the inside of bends, pieces of one fence overlap at their backs.
                        if run.used is None or self.min_clearance_m > 0.0:
                            ground.add(footprint)
                        else:
                            joined.append(footprint)
                        yield Member(asset, pose, scale, collides=False)
                at_m += length_m
                if at_m < run.end_m:
                    at_m += JOINT_M
                else:
                    _add_all(ground, joined)
                    joined = []
                    at_m += self.gap_m.draw(rng)
                    run = self._draw_run(at_m, weights, bounds_of, rng)
            else:
                raise errors.ConfigError(
                    f"randomizers.{self.name}.gap_m: objects and gaps are so short that a lane of "
                    f"{line.length_m:.1f} m has more than {PER_LANE_MAX:,} places; expected a "
                    "larger gap_m or scale"
                )
            _add_all(ground, joined)

    def _scatter(
        self,
        lines: list[LaneLine],
        group: ObjectGroup,
        weights: CategoryWeights,
        ground: free_space.Ground,
        bounds_of: BoundsOf,
        rng: Rng,
    ) -> Iterator[Member]:
        del group
        points = [point for line in lines for point in line.lane.center_m]
        low = [min(point[k] for point in points) for k in range(3)]
        high = [max(point[k] for point in points) for k in range(3)]
        for _ in range(self.count.draw(rng) if self.count is not None else 10):
            for _ in range(SCATTER_TRIES):
                asset, scale, bounds_m, solid_m = self._draw_thing(weights, bounds_of, rng)
                x, y = (float(rng.uniform(low[k], high[k])) for k in range(2))
                stand = SE3.about_z(float(rng.uniform(0.0, 2.0 * math.pi)), (x, y, low[2]))
                pose = (stand @ SE3((0.0, 0.0, -bounds_m[0][2]))).rounded()
                if ground.occupy(free_space.Footprint.of(pose, solid_m), self.min_clearance_m):
                    yield Member(asset, pose, scale, collides=False)
                    break
            else:
                remedy = "a smaller count or min_clearance_m"
                raise self.reject("no free place for a scattered object", remedy)

    def _draw_run(
        self, at_m: float, weights: CategoryWeights, bounds_of: BoundsOf, rng: Rng
    ) -> _Run:
        thing = self._draw_thing(weights, bounds_of, rng)
        reach_m = self.run_m.draw(rng)
        return _Run(thing, at_m + reach_m, self.occupancy.draw(rng) if reach_m > 0.0 else None)

    def _draw_thing(self, weights: CategoryWeights, bounds_of: BoundsOf, rng: Rng) -> Thing:
        """Draw an asset and its scale; also return its scaled bounds."""
        asset = draw_asset(weights, rng)
        scale = round(self.scale.draw(rng), 4)
        bounds_m, solid_m = bounds_of(asset)
        if scale != 1.0:
            bounds_m, solid_m = _scale_bounds(bounds_m, scale), _scale_bounds(solid_m, scale)
        return asset, scale, bounds_m, solid_m


def _add_all(ground: free_space.Ground, footprints: list[free_space.Footprint]) -> None:
    for footprint in footprints:
        ground.add(footprint)


def _bounds_m(assets: interfaces.AssetIndex, asset: str) -> tuple[Bounds, Bounds]:
    """Bounds of an asset [m], and the part of them that nothing else may enter."""
    return assets.bounds_m(asset), free_space.standing_bounds_m(assets, asset)


def _scale_bounds(bounds_m: Bounds, scale: float) -> Bounds:
    (x0, y0, z0), (x1, y1, z1) = bounds_m
    return (scale * x0, scale * y0, scale * z0), (scale * x1, scale * y1, scale * z1)


def _land_fall_m(behind_m: float) -> float:
    """Depth of the land below a lane next to a road, at a distance away from the street."""
    return min(1.0, behind_m / LAND_SLOPE_M) * LAND_FALL_M


def _extent_m(bounds_m: Bounds, facing: str) -> tuple[float, float]:
    x, y = bounds_m[1][0] - bounds_m[0][0], bounds_m[1][1] - bounds_m[0][1]
    return (x, y) if facing == "along" else (y, x)
