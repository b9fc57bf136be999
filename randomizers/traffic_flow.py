"""Traffic through time: everything on the road and on foot moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.generator.config.distributions import Normal, Positive, Uniform
from gen_data.generator.core.errors import ConfigError, LayoutRejected, Rejection, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.motion import StateChange, Trajectory
from gen_data.generator.core.scene import Body, Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.traffic.body_trajectories import make_upright_trajectories
from gen_data.generator.traffic.lane_routes import LaneGraph, draw_route, lanes_through_point
from gen_data.generator.traffic.obb_overlap import first_overlap
from gen_data.generator.traffic.pedestrian_paths import WalkNetwork, draw_path, make_walk_network
from gen_data.generator.traffic.pedestrians import Pedestrian
from gen_data.generator.traffic.signal_cycles import Approach, Cycle
from gen_data.generator.traffic.simulation import SimulatedMotion, simulate
from gen_data.generator.traffic.vehicles import LOOKAHEAD_M, Vehicle, Vehicles, make_vehicles
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.ego_on_lane import Stop
from gen_data.randomizers.traffic_actors import (
    DRIVERS,
    Driver,
    OnFoot,
    OnRoad,
    Standing,
    cycles_axes,
    find_approaches,
    find_drivers,
    find_obstacles,
    find_pedestrians,
    heading_direction,
    set_cycles,
)
from gen_data.randomizers.traffic_lights import (
    COLORS,
    Signal,
    group_junctions,
    has_lenses,
    read_signal,
)
from gen_data.randomizers.traffic_states import (
    apply_first_changes,
    gait_changes,
    lamp_changes,
    lamp_states,
    signal_changes,
)

JUNCTION_M = 40.0
"""Signals nearer to one another than this belong to one junction."""
BODY_M = (0.2, 0.22)
"""Half extents of a person's trunk, ahead and to the side."""


@dataclass(frozen=True, slots=True)
class Streets:
    """Lanes by what moves on them."""

    driving: LaneGraph
    sidewalks: LaneGraph
    crosswalks: LaneGraph

    @classmethod
    def of(cls, scene: Scene) -> Streets:
        """Those of a scene."""
        kinds = ("driving", "sidewalk", "crosswalk")
        return cls(*(LaneGraph.of(scene.lanes, kind) for kind in kinds))


class TrafficFlow(RandomizerBase):
    """Makes traffic move; list it after all groups, paints and lights of a street.

    Vehicles on driving lanes, the ego vehicle among them, follow routes over the lanes with pure
    pursuit (Coulter 1992) and keep distance by the Intelligent Driver Model (Treiber, Hennecke,
    Helbing 2000). They obey signals, give way in junctions without them, and stop for people on
    crosswalks. People whose pose is one of walking follow sidewalks and cross where they may.
    Everything else stands. What comes to the end of the network stops there.

    Attributes:
        duration_s: From time 0 on; a data set's sequences may not be longer.
        routes: By the name of a vehicle (``ego``): lanes, or points (x, y) in metres, that it
            drives through; it drives on at random. All others do so from the beginning.
        signals: Whether traffic lights work. If they do not, they stay as they are, and who comes
            first or from the right goes first.
        green_s: How long an axis of a junction has green.
        all_red_s: Between one axis' amber and the other's green.
        lens_cd_m2: Luminance of a lit lens of a signal.
        speed_factor: Of a driver, on the lanes' usual speed.
        headway_s: Time gap that a driver keeps.
        walking_m_s: Pace of somebody on foot.
        crossing: Probability that people take a crosswalk that they come to.
        brakelight_cd_m2, indicator_cd_m2: Luminance of lamps of vehicles.
    """

    type: Literal["traffic_flow"] = "traffic_flow"
    stage: Literal["scene"] = "scene"
    duration_s: float = Field(10.0, gt=0, le=600)
    routes: dict[str, tuple[Stop, ...]] = Field({})
    signals: bool = True
    green_s: Positive = Uniform(12.0, 25.0)
    all_red_s: Positive = Uniform(1.5, 3.0)
    lens_cd_m2: Positive = Uniform(5000.0, 10_000.0)
    speed_factor: Positive = Normal(1.0, 0.1, clip=(0.75, 1.2))
    headway_s: Positive = Normal(1.3, 0.25, clip=(0.8, 2.2))
    walking_m_s: Positive = Normal(1.35, 0.2, clip=(0.8, 1.9))
    crossing: float = Field(0.4, ge=0, le=1)
    brakelight_cd_m2: Positive = Uniform(6000.0, 15_000.0)
    indicator_cd_m2: Positive = Uniform(15_000.0, 40_000.0)

    @property
    def motion_duration_s(self) -> float:
        """The motion ends there."""
        return self.duration_s

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with tracks and changes, as it is at time 0.

        Raises:
            ConfigError: a route names nothing, or leaves the lanes.
            LayoutRejected: things would run into one another.
        """
        streets = Streets.of(scene)
        signals = self._signals(scene, assets, rng) if self.signals else []
        approaches = find_approaches(streets.driving, streets.crosswalks, signals)
        drivers = find_drivers(scene, streets.driving, assets)
        people = find_pedestrians(scene, streets.sidewalks, streets.crosswalks, assets)
        taking_part = [m.body for m in drivers] + [m.body for m in people]
        standing = find_obstacles(scene, taking_part, assets)
        planned = self._plan_routes(drivers, standing, streets)
        fleet = self._fleet(drivers, streets, planned, standing.boxes, rng)
        walks = make_walk_network(streets.sidewalks, streets.crosswalks, standing.boxes)
        walkers = self._walkers(people, walks, rng)
        motion = simulate(fleet, walkers, standing.boxes, approaches, self.duration_s)
        _check(motion, drivers, people, standing, self.name)
        tracks = _tracks(motion, drivers, people, assets)
        changes = [
            *self._signal_changes(signals, assets, rng),
            *self._lamp_changes(fleet, drivers, motion, assets, rng),
            *_gait(people, motion, assets, rng),
        ]
        return _set_in_motion(scene, tracks, changes)

    def _signals(self, scene: Scene, assets: AssetIndex, rng: Rng) -> list[tuple[Signal, Approach]]:
        """All traffic lights with cycles that are drawn per junction."""
        roles = frozenset(COLORS)
        lights = [read_signal(body) for body in scene.bodies if has_lenses(body, assets, roles)]
        junctions = []
        for junction in group_junctions(lights, JUNCTION_M):
            green_s, all_red_s = self.green_s.draw(rng), self.all_red_s.draw(rng)
            cycle = Cycle(max(cycles_axes(junction)) + 1, round(green_s, 2), round(all_red_s, 2))
            offset_s = round(float(rng.uniform()) * cycle.length_s, 2)
            junctions.append((junction, replace(cycle, offset_s=offset_s)))
        return set_cycles(junctions)

    def _plan_routes(
        self, drivers: Sequence[OnRoad], standing: Standing, streets: Streets
    ) -> dict[str, tuple[str, ...]]:
        """Lanes of the routes that were given, by the vehicles' names."""
        places = {driver.body.name: driver.place for driver in drivers}
        planned = {}
        for name, stops in sorted(self.routes.items()):
            where = f"randomizers.{self.name}.routes.{name}"
            if name not in places:
                known = sorted(places)
                raise ConfigError(
                    f"{where}: no vehicle '{name}' is on a driving lane; expected one of "
                    f"{', '.join(known) or 'none'}{did_you_mean(name, known)}"
                )
            _check_points(standing, stops, where)
            lanes = lanes_through_point(streets.driving, stops, where)
            start = places[name].lane
            if start not in lanes:
                raise ConfigError(
                    f"{where}: '{name}' starts on '{start}', which the route does not pass: "
                    f"{', '.join(lanes)}; give ego_on_lane the same route"
                )
            planned[name] = lanes[lanes.index(start) :]
        return planned

    def _fleet(
        self,
        drivers: Sequence[OnRoad],
        streets: Streets,
        planned: dict[str, tuple[str, ...]],
        obstacles: Array,
        rng: Rng,
    ) -> Vehicles | None:
        """Vehicles with drivers and routes; draws the same number for each of them."""
        vehicles = []
        for member in drivers:
            factor, headway_s = self.speed_factor.draw(rng), self.headway_s.draw(rng)
            kind = DRIVERS.get(member.category, Driver())
            given = planned.get(member.body.name, (member.place.lane,))
            fastest = max(line.lane.speed_m_s for line in streets.driving.lines.values())
            reach_m = min(factor * fastest, kind.speed_m_s) * self.duration_s
            length_m = member.place.at_m + reach_m + member.axles.front_m + LOOKAHEAD_M[1]
            x, y, _ = member.T_world_rear.translation_m
            vehicles.append(
                Vehicle(
                    name=member.body.name,
                    xy_m=(x, y),
                    ahead=member.ahead,
                    front_m=member.axles.front_m,
                    rear_m=member.axles.rear_m,
                    width_m=member.axles.width_m,
                    wheelbase_m=member.axles.wheelbase_m,
                    route=draw_route(streets.driving, given, length_m, rng),
                    station_m=member.place.at_m,
                    speed_factor=factor,
                    speed_max_m_s=kind.speed_m_s,
                    headway_s=headway_s,
                    acceleration_m_s2=kind.acceleration_m_s2,
                )
            )
        if not vehicles:
            return None
        fastest = max(
            min(v.speed_factor * streets.driving.lines[n].lane.speed_m_s, v.speed_max_m_s)
            for v in vehicles
            for n in v.route.lanes
        )
        reach_m = fastest * self.duration_s + 5.0
        return make_vehicles(vehicles, streets.driving, streets.crosswalks, obstacles, reach_m)

    def _walkers(self, people: Sequence[OnFoot], walks: WalkNetwork, rng: Rng) -> list[Pedestrian]:
        walkers = []
        for member in people:
            speed_m_s = self.walking_m_s.draw(rng)
            x, y, _ = member.body.T_world_body.translation_m
            ahead = heading_direction(member.body)
            graph = walks.sidewalks
            if member.place.lane in walks.crosswalks.lines:
                graph = walks.crosswalks
            axis = graph.lines[member.place.lane].pose(member.place.at_m).rotation()[:2, 0]
            forward = bool(ahead[0] * axis[0] + ahead[1] * axis[1] >= 0.0)
            path = draw_path(
                walks,
                member.place.lane,
                member.place.at_m,
                forward,
                speed_m_s * self.duration_s + 2.0,
                self.crossing,
                rng,
            )
            left_m = member.place.left_m if forward else -member.place.left_m
            walkers.append(
                Pedestrian(member.body.name, (x, y), ahead, speed_m_s, path, left_m)
                if member.walks
                else Pedestrian(member.body.name, (x, y), ahead)
            )
        return walkers

    def _signal_changes(
        self, signals: Sequence[tuple[Signal, Approach]], assets: AssetIndex, rng: Rng
    ) -> list[StateChange]:
        lens_cd_m2 = round(self.lens_cd_m2.draw(rng), 2)
        return [
            change
            for signal, approach in signals
            for change in signal_changes(signal, approach, assets, lens_cd_m2, self.duration_s)
        ]

    def _lamp_changes(
        self,
        fleet: Vehicles | None,
        drivers: Sequence[OnRoad],
        motion: SimulatedMotion,
        assets: AssetIndex,
        rng: Rng,
    ) -> list[StateChange]:
        made: list[StateChange] = []
        for k, member in enumerate(drivers):
            brake, blink = self.brakelight_cd_m2.draw(rng), self.indicator_cd_m2.draw(rng)
            begun = float(rng.uniform())
            assert fleet is not None, "there are drivers, so there is a fleet"
            states = lamp_states(
                motion.station_m[:, k],
                motion.speed_m_s[:, k],
                motion.acceleration_m_s2[:, k],
                member.axles.front_m,
                fleet.entries[k],
                begun,
            )
            made += lamp_changes(member.body, assets, states, brake, blink)
        return made


def _check_points(standing: Standing, stops: Sequence[Stop], where: str) -> None:
    """Raises ConfigError if a route's point is where something stands."""
    for k, stop in enumerate(stops):
        wall = "" if isinstance(stop, str) else standing.at(*stop)
        if wall and not isinstance(stop, str):
            raise ConfigError(
                f"{where}[{k}]: ({stop[0]:g}, {stop[1]:g}) is inside '{wall}': a vehicle cannot "
                "drive through it; expected a point on a driving lane"
            )


def _gait(
    people: Sequence[OnFoot], motion: SimulatedMotion, assets: AssetIndex, rng: Rng
) -> list[StateChange]:
    made: list[StateChange] = []
    for k, member in enumerate(people):
        start = float(rng.uniform())
        if member.walks:
            made += gait_changes(
                member.body, assets, motion.walked_m[:, k], motion.pace_m_s[:, k], start
            )
    return made


def _tracks(
    motion: SimulatedMotion, drivers: Sequence[OnRoad], people: Sequence[OnFoot], assets: AssetIndex
) -> list[tuple[Body, Trajectory | None]]:
    """The track of everybody who takes part; None = they never move."""
    backs = [member.axles.T_body_rear.inverse().translation_m for member in drivers]
    wheelbases = np.array([member.axles.wheelbase_m for member in drivers])
    bodies = [m.body for m in drivers] + [m.body for m in people]
    made = make_upright_trajectories(
        [member.body.name for member in drivers],
        motion.axle_m,
        motion.ahead,
        np.clip(motion.rise / np.maximum(wheelbases, 0.1), -0.3, 0.3),
        backs,
    ) + make_upright_trajectories(
        [member.body.name for member in people],
        motion.feet_m,
        motion.look,
        np.zeros(motion.look.shape[:2]),
        [(0.0, 0.0, -m.body.scale * assets.bounds_m(m.body.asset)[0][2]) for m in people],
    )
    return list(zip(bodies, made, strict=True))


def _check(
    motion: SimulatedMotion,
    drivers: Sequence[OnRoad],
    people: Sequence[OnFoot],
    standing: Standing,
    name: str,
) -> None:
    """Raises LayoutRejected if anything that moves overlaps anything."""
    middle = np.array([0.5 * (m.axles.front_m - m.axles.rear_m) for m in drivers])
    centres = motion.axle_m[..., :2] + middle[:, None] * motion.ahead
    cars = np.concatenate([centres, motion.ahead], axis=2)
    persons = np.concatenate([motion.feet_m[..., :2], motion.look], axis=2)
    halves = [(0.5 * (m.axles.front_m + m.axles.rear_m), 0.5 * m.axles.width_m) for m in drivers]
    found = first_overlap(
        np.concatenate([cars, persons], axis=1),
        np.array([*halves, *[BODY_M] * len(people)]).reshape(-1, 2),
        standing.boxes[:, [0, 1, 4, 5]],
        standing.boxes[:, 2:4],
    )
    if found is None:
        return
    kinds = [m.category for m in drivers] + ["person"] * len(people) + list(standing.categories)
    one, other = sorted((kinds[found[1]], kinds[found[2]]))
    remedy = f"fewer vehicles or people, or a shorter duration_s (randomizers.{name})"
    raise LayoutRejected(Rejection(f"{one} and {other} meet in traffic", remedy))


def _set_in_motion(
    scene: Scene, tracks: Sequence[tuple[Body, Trajectory | None]], changes: Sequence[StateChange]
) -> Scene:
    """The scene at time 0 with all that will happen."""
    moved = [
        replace(body, T_world_body=track.knots[0].rounded())
        for body, track in tracks
        if track is not None
    ]
    scene = apply_first_changes(scene.with_bodies(*moved), changes)
    order = sorted(range(len(changes)), key=lambda k: (changes[k].time_s, k))
    return replace(
        scene,
        tracks=tuple(track for _, track in tracks if track is not None),
        changes=tuple(changes[k] for k in order),
    )
