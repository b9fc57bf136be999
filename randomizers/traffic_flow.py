"""Motion of vehicles and pedestrians through a sequence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import errors, se3
from gen_data.core.interfaces import AssetIndex
from gen_data.core.motion import StateChange, Trajectory
from gen_data.core.scene import Body, Scene
from gen_data.core.streams import Rng
from gen_data.randomizers import base, traffic_actors, traffic_lights, traffic_states
from gen_data.randomizers.ego_on_lane import Stop
from gen_data.traffic import suspension
from gen_data.traffic.lane_routes import LaneGraph, draw_route, lanes_through_point
from gen_data.traffic.pedestrian_paths import WalkNetwork, draw_path, make_walk_network
from gen_data.traffic.pedestrians import Pedestrian
from gen_data.traffic.signal_cycles import Approach, Cycle
from gen_data.traffic.simulation import (
    KNOT_S,
    STEP_S,
    SimulatedMotion,
    first_overlap,
    make_upright_trajectories,
    simulate,
)
from gen_data.traffic.vehicles import LOOKAHEAD_M, Vehicle, Vehicles, make_vehicles

JUNCTION_M = 40.0
"""Largest distance between neighbouring signals of one junction."""
BODY_M = (0.2, 0.22)
"""Half extents of a person's trunk, forwards and sideways."""


@dataclass(frozen=True, slots=True)
class Streets:
    """Lane graphs by kind of traffic; ``driving`` includes bicycle lanes."""

    driving: LaneGraph
    sidewalks: LaneGraph
    crosswalks: LaneGraph

    @classmethod
    def of(cls, scene: Scene) -> "Streets":
        """Build the lane graphs of a scene."""
        kinds = (("driving", "bicycle"), ("sidewalk",), ("crosswalk",))
        return cls(*(LaneGraph.of(scene.lanes, *of) for of in kinds))


class TrafficFlow(base.RandomizerBase):
    """Simulates traffic; list it after all groups, paints and lights of a street.

    Vehicles on driving and bicycle lanes, including the ego vehicle, follow routes over the lanes
    with pure pursuit (Coulter 1992) and keep their distance with the Intelligent Driver Model
    (Treiber, Hennecke, Helbing 2000). Cyclists keep to the side of their lane. Vehicles obey
    signals, give way at junctions without signals, and stop for pedestrians on crosswalks. People
    in a walking pose follow sidewalks and use crosswalks. Everything else stands still. Vehicles
    and pedestrians stop at the end of the road network.

    Attributes:
        duration_s: Simulated time from time 0; limits the length of the data set's sequences.
        routes: Route by name of a vehicle (``ego``): lanes, or points (x, y) in metres, to drive
            through; a random route follows. Vehicles without an entry drive at random.
        signals: Whether traffic lights operate. If not, they keep their state, and vehicles give
            way to vehicles that arrive first or from the right.
        green_s: Duration of green for one axis of a junction.
        all_red_s: Time between amber for one axis and green for the other.
        lens_cd_m2: Luminance of a lit signal lens.
        speed_factor: Factor of a driver on the lanes' usual speed.
        headway_s: Time gap that a driver keeps.
        walking_m_s: Walking speed of a pedestrian.
        crossing: Probability that a pedestrian takes a crosswalk on the way.
        brakelight_cd_m2, indicator_cd_m2: Luminance of vehicle lamps.
    """

    type: Literal["traffic_flow"] = "traffic_flow"
    stage: Literal["scene"] = "scene"
    duration_s: float = Field(10.0, gt=0, le=600)
    routes: dict[str, tuple[Stop, ...]] = Field({})
    signals: bool = True
    green_s: dist.Positive = dist.Uniform(12.0, 25.0)
    all_red_s: dist.Positive = dist.Uniform(1.5, 3.0)
    lens_cd_m2: dist.Positive = dist.Uniform(5000.0, 10_000.0)
    speed_factor: dist.Positive = dist.Normal(1.0, 0.1, clip=(0.75, 1.2))
    headway_s: dist.Positive = dist.Normal(1.3, 0.25, clip=(0.8, 2.2))
    walking_m_s: dist.Positive = dist.Normal(1.35, 0.2, clip=(0.8, 1.9))
    crossing: float = Field(0.4, ge=0, le=1)
    brakelight_cd_m2: dist.Positive = dist.Uniform(6000.0, 15_000.0)
    indicator_cd_m2: dist.Positive = dist.Uniform(15_000.0, 40_000.0)

    @property
    def motion_duration_s(self) -> float:
        """End of the simulated motion [s]."""
        return self.duration_s

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene at time 0, with trajectories and state changes."""
        streets = Streets.of(scene)
        signals = self._draw_signal_cycles(scene, assets, rng) if self.signals else []
        approaches = traffic_actors.find_approaches(streets.driving, streets.crosswalks, signals)
        drivers = traffic_actors.find_drivers(scene, streets.driving, assets)
        people = traffic_actors.find_pedestrians(
            scene, streets.sidewalks, streets.crosswalks, assets
        )
        moving = [m.body for m in drivers] + [m.body for m in people]
        standing = traffic_actors.find_obstacles(scene, moving, assets)
        planned = self._plan_routes(drivers, standing, streets)
        vehicles = self._make_vehicles(drivers, streets, planned, standing.boxes, rng)
        walks = make_walk_network(streets.sidewalks, streets.crosswalks, standing.boxes)
        pedestrians = self._make_pedestrians(people, walks, rng)
        motion = simulate(vehicles, pedestrians, standing.boxes, approaches, self.duration_s)
        _reject_collisions(motion, drivers, people, standing, self.name)
        tracks = _make_trajectories(motion, drivers, people, assets)
        changes = [
            *self._draw_signal_changes(signals, assets, rng),
            *self._draw_lamp_changes(vehicles, drivers, motion, assets, rng),
            *_draw_gait_changes(people, motion, assets, rng),
        ]
        return _set_in_motion(scene, tracks, changes)

    def _draw_signal_cycles(
        self, scene: Scene, assets: AssetIndex, rng: Rng
    ) -> list[tuple[traffic_lights.Signal, Approach]]:
        roles = frozenset(traffic_lights.COLORS)
        lights = [
            traffic_lights.read_signal(body)
            for body in scene.bodies
            if traffic_lights.has_lenses(body, assets, roles)
        ]
        junctions = []
        for junction in traffic_lights.group_junctions(lights, JUNCTION_M):
            green_s, all_red_s = self.green_s.draw(rng), self.all_red_s.draw(rng)
            cycle = Cycle(
                max(traffic_actors.number_axes(junction)) + 1,
                round(green_s, 2),
                round(all_red_s, 2),
            )
            offset_s = round(float(rng.uniform()) * cycle.length_s, 2)
            junctions.append((junction, replace(cycle, offset_s=offset_s)))
        return traffic_actors.set_cycles(junctions)

    def _plan_routes(
        self,
        drivers: Sequence[traffic_actors.OnRoad],
        standing: traffic_actors.Standing,
        streets: Streets,
    ) -> dict[str, tuple[str, ...]]:
        places = {driver.body.name: driver.place for driver in drivers}
        planned = {}
        for name, stops in sorted(self.routes.items()):
            where = f"randomizers.{self.name}.routes.{name}"
            if name not in places:
                known = sorted(places)
                raise errors.ConfigError(
                    f"{where}: there is no vehicle '{name}' on a driving lane; expected one of "
                    f"{', '.join(known) or 'none'}{errors.did_you_mean(name, known)}"
                )
            _check_points(standing, stops, where)
            lanes = lanes_through_point(streets.driving, stops, where)
            start = places[name].lane
            if start not in lanes:
                raise errors.ConfigError(
                    f"{where}: '{name}' starts on '{start}', which the route does not pass: "
                    f"{', '.join(lanes)}; give ego_on_lane the same route"
                )
            planned[name] = lanes[lanes.index(start) :]
        return planned

    def _make_vehicles(
        self,
        drivers: Sequence[traffic_actors.OnRoad],
        streets: Streets,
        planned: dict[str, tuple[str, ...]],
        obstacles: se3.Array,
        rng: Rng,
    ) -> Vehicles | None:
        """Draw a driver and a route for each vehicle; None if there is none."""
        vehicles = []
        for member in drivers:
            factor, headway_s = self.speed_factor.draw(rng), self.headway_s.draw(rng)
            kind = traffic_actors.DRIVERS.get(member.category, traffic_actors.Driver())
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
                    left_m=member.place.left_m if kind.keeps_side else 0.0,
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

    def _make_pedestrians(
        self, people: Sequence[traffic_actors.OnFoot], walks: WalkNetwork, rng: Rng
    ) -> list[Pedestrian]:
        pedestrians = []
        for member in people:
            speed_m_s = self.walking_m_s.draw(rng)
            x, y, _ = member.body.T_world_body.translation_m
            ahead = traffic_actors.heading_direction(member.body)
            graph = walks.sidewalks
            if member.place.lane in walks.crosswalks.lines:
                graph = walks.crosswalks
            axis = graph.lines[member.place.lane].pose(member.place.at_m).rotation()[:2, 0]
            forward = bool(ahead[0] * axis[0] + ahead[1] * axis[1] >= 0.0)
            place, length_m = member.place, speed_m_s * self.duration_s + 2.0
            path = draw_path(walks, place.lane, place.at_m, forward, length_m, self.crossing, rng)
            left_m = member.place.left_m if forward else -member.place.left_m
            pedestrians.append(
                Pedestrian(member.body.name, (x, y), ahead, speed_m_s, path, left_m)
                if member.walks
                else Pedestrian(member.body.name, (x, y), ahead)
            )
        return pedestrians

    def _draw_signal_changes(
        self,
        signals: Sequence[tuple[traffic_lights.Signal, Approach]],
        assets: AssetIndex,
        rng: Rng,
    ) -> list[StateChange]:
        lens_cd_m2 = round(self.lens_cd_m2.draw(rng), 2)
        return [
            change
            for signal, approach in signals
            for change in traffic_states.signal_changes(
                signal, approach, assets, lens_cd_m2, self.duration_s
            )
        ]

    def _draw_lamp_changes(
        self,
        vehicles: Vehicles | None,
        drivers: Sequence[traffic_actors.OnRoad],
        motion: SimulatedMotion,
        assets: AssetIndex,
        rng: Rng,
    ) -> list[StateChange]:
        made: list[StateChange] = []
        for k, member in enumerate(drivers):
            brake, blink = self.brakelight_cd_m2.draw(rng), self.indicator_cd_m2.draw(rng)
            begun = float(rng.uniform())
            assert vehicles is not None, "drivers imply vehicles"
            states = traffic_states.lamp_states(
                motion.station_m[:, k],
                motion.speed_m_s[:, k],
                motion.acceleration_m_s2[:, k],
                member.axles.front_m,
                vehicles.entries[k],
                begun,
            )
            made += traffic_states.lamp_changes(member.body, assets, states, brake, blink)
        return made


def _check_points(standing: traffic_actors.Standing, stops: Sequence[Stop], where: str) -> None:
    """Raise ConfigError if a point of a route is inside a standing body."""
    for k, stop in enumerate(stops):
        wall = "" if isinstance(stop, str) else standing.at(*stop)
        if wall and not isinstance(stop, str):
            raise errors.ConfigError(
                f"{where}[{k}]: ({stop[0]:g}, {stop[1]:g}) is inside '{wall}': a vehicle cannot "
                "drive through it; expected a point on a driving lane"
            )


def _draw_gait_changes(
    people: Sequence[traffic_actors.OnFoot], motion: SimulatedMotion, assets: AssetIndex, rng: Rng
) -> list[StateChange]:
    made: list[StateChange] = []
    for k, member in enumerate(people):
        start = float(rng.uniform())
        if member.walks:
            made += traffic_states.gait_changes(
                member.body, assets, motion.walked_m[:, k], motion.pace_m_s[:, k], start
            )
    return made


def _make_trajectories(
    motion: SimulatedMotion,
    drivers: Sequence[traffic_actors.OnRoad],
    people: Sequence[traffic_actors.OnFoot],
    assets: AssetIndex,
) -> list[tuple[Body, Trajectory | None]]:
    """Trajectory of every vehicle and pedestrian; None for a body that never moves."""
    backs = [member.axles.T_body_rear.inverse().translation_m for member in drivers]
    wheelbases = np.array([member.axles.wheelbase_m for member in drivers])
    bodies = [m.body for m in drivers] + [m.body for m in people]
    is_sprung = np.array([_has_four_wheels(member.body, assets) for member in drivers], bool)
    kept = slice(None, None, round(KNOT_S / STEP_S))
    lift_m, sway_right = is_sprung * np.array(
        suspension.sway(
            motion.speed_m_s[kept], motion.acceleration_m_s2[kept], motion.ahead, KNOT_S
        )
    )
    # About the middle between the axles: neither leaves the ground by more than half of it.
    axle_m = motion.axle_m - 0.5 * lift_m[..., None] * np.array([0.0, 0.0, 1.0])
    made = make_upright_trajectories(
        [member.body.name for member in drivers],
        axle_m,
        motion.ahead,
        # Small-angle pitch; the floor on the wheelbase avoids a division by zero.
        np.clip((motion.rise + lift_m) / np.maximum(wheelbases, 0.1), -0.3, 0.3),
        backs,
        sway_right + is_sprung * motion.bank,
    ) + make_upright_trajectories(
        [member.body.name for member in people],
        motion.feet_m,
        motion.look,
        np.zeros(motion.look.shape[:2]),
        [(0.0, 0.0, -m.body.scale * assets.bounds_m(m.body.asset)[0][2]) for m in people],
    )
    return list(zip(bodies, made, strict=True))


def _has_four_wheels(body: Body, assets: AssetIndex) -> bool:
    return sum(p.name.startswith("wheel") for p in assets.keypoints(body.asset)) == 4


def _reject_collisions(
    motion: SimulatedMotion,
    drivers: Sequence[traffic_actors.OnRoad],
    people: Sequence[traffic_actors.OnFoot],
    standing: traffic_actors.Standing,
    name: str,
) -> None:
    """Raise LayoutRejected if a moving body overlaps another body."""
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
    raise errors.LayoutRejected(errors.Rejection(f"{one} and {other} collide in traffic", remedy))


def _set_in_motion(
    scene: Scene, tracks: Sequence[tuple[Body, Trajectory | None]], changes: Sequence[StateChange]
) -> Scene:
    """Return the scene at time 0 with its trajectories and state changes."""
    moved = [
        replace(body, T_world_body=track.knots[0].rounded())
        for body, track in tracks
        if track is not None
    ]
    scene = traffic_states.apply_first_changes(scene.with_bodies(*moved), changes)
    order = sorted(range(len(changes)), key=lambda k: (changes[k].time_s, k))
    return replace(
        scene,
        tracks=tuple(track for _, track in tracks if track is not None),
        changes=tuple(changes[k] for k in order),
    )
