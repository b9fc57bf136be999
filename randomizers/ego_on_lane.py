"""Start pose of the ego vehicle."""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import interfaces, lane_geometry, streams
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.scene import Body, Scene
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.free_space import Footprint, make_ground, standing_bodies
from gen_data.traffic.axles import find_axles
from gen_data.traffic.lane_routes import LaneGraph, lanes_through_point

TRIES = 32

Stop = str | tuple[float, float]
"""Stop of a route: a lane's name, or a point (x, y) [m]."""


class EgoOnLane(RandomizerBase):
    """Puts the ego vehicle on a driving lane; list it before the lane_objects randomizers.

    Attributes:
        ego: Name of the template's ``ego`` element.
        roads: Names of the elements whose lanes to use; empty = all.
        route: Lanes, or points (x, y) in metres; the vehicle starts on the first. Give
            traffic_flow the same route. Empty = start on any lane.
        ahead_m: Smallest length of road ahead of the vehicle, on any way through junctions; at most
            half of the lane it starts on.
        lateral_m: Offset to the left of the lane's centre line.
        min_clearance_m: Smallest distance to any other object.
    """

    type: Literal["ego_on_lane"] = "ego_on_lane"
    stage: Literal["scene"] = "scene"
    ego: str = "ego"
    roads: tuple[str, ...] = ()
    route: tuple[Stop, ...] = ()
    ahead_m: float = Field(40.0, ge=0)
    lateral_m: Annotated[dist.Scalar, dist.Bounds(-5, 5)] = dist.Normal(0.0, 0.1, clip=(-0.3, 0.3))
    min_clearance_m: float = Field(0.5, ge=0)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the ego vehicle moved."""
        body = find_ego(scene, self.ego, f"randomizers.{self.name}.ego")
        graph = LaneGraph.of(scene.lanes, "driving")
        lines = self._select_lanes(graph)
        axles = find_axles(assets, body.asset, body.scale)
        ground = make_ground((b for b in standing_bodies(scene) if b.name != body.name), assets)
        total_m = sum(line.length_m for line in lines)
        for _ in range(TRIES):
            place, left_m = float(rng.uniform()) * total_m, self.lateral_m.draw(rng)
            share = float(rng.uniform())
            line = next((one for one in lines if (place := place - one.length_m) < 0.0), lines[-1])
            beyond_m = _road_beyond_m(graph, line.lane.name, self.ahead_m)
            ahead_m = max(min(self.ahead_m, 0.5 * line.length_m) - beyond_m, 0.0)
            last_m = line.length_m - ahead_m - axles.front_m
            if last_m <= axles.rear_m:
                continue
            at_m = axles.rear_m + share * (last_m - axles.rear_m)
            pose = (line.pose(at_m, left_m) @ axles.T_body_rear.inverse()).rounded()
            footprint = Footprint.of(pose, assets.bounds_m(body.asset), body.scale)
            if ground.is_free(footprint.expand(self.min_clearance_m)):
                return scene.with_bodies(replace(body, T_world_body=pose))
        remedy = "other roads, a smaller ahead_m or min_clearance_m"
        raise self.reject("no free place for the ego vehicle", remedy)

    def _select_lanes(self, graph: LaneGraph) -> list[lane_geometry.LaneLine]:
        """Select the lanes to start on."""
        if self.route:
            names = lanes_through_point(graph, self.route, f"randomizers.{self.name}.route")
            return [graph.lines[names[0]]]
        lines = [
            line
            for line in graph.lines.values()
            if not line.lane.junction and (not self.roads or line.lane.road in self.roads)
        ]
        if not lines:
            known = sorted({line.lane.road for line in graph.lines.values()})
            raise ConfigError(
                f"randomizers.{self.name}.roads: the scene has no driving lane on "
                f"{' or '.join(self.roads) or 'any road'}; there is {', '.join(known) or 'none'}"
            )
        return lines


def _road_beyond_m(graph: LaneGraph, name: str, wanted_m: float) -> float:
    """Length of the shortest way from the end of a lane to the end of the network, or enough."""
    ways = graph.successors(name) if wanted_m > 0.0 else ()
    lengths = [(graph.lines[way].length_m, way) for way in ways]
    return min(
        (length + _road_beyond_m(graph, way, wanted_m - length) for length, way in lengths),
        default=0.0,
    )


def find_ego(scene: Scene, name: str, field: str) -> Body:
    """Find the body of an ego vehicle.

    Raises:
        ConfigError: the template has no ego vehicle of that name.
    """
    known = [rig.name for rig in scene.rigs if rig.body]
    if name not in known:
        raise ConfigError(
            f"{field}: the template has no ego vehicle '{name}'; there is "
            f"{', '.join(known) or 'none: list an element of type ego'}{did_you_mean(name, known)}"
        )
    return scene.body(scene.rig(name).body)
