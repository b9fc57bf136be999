"""Small streets for traffic tests."""

from collections.abc import Mapping, Sequence

import numpy as np

from gen_data.core.scene import Lane, LaneKind
from gen_data.core.streams import Rng, Streams
from gen_data.traffic.lane_routes import LaneGraph, draw_route
from gen_data.traffic.pedestrians import Pedestrian
from gen_data.traffic.signal_cycles import Approach
from gen_data.traffic.simulation import SimulatedMotion, simulate
from gen_data.traffic.vehicles import Vehicle, Vehicles, make_vehicles

NO_BOXES = np.zeros((0, 6))
REACH_M = 400.0


def rng_of(name: str = "test") -> Rng:
    return Streams(3, 0).rng(name)


def lane(
    name: str,
    *points: tuple[float, float],
    kind: LaneKind = "driving",
    after: Sequence[str] = (),
    speed_m_s: float = 13.9,
    junction: bool = False,
    width_m: float = 3.5,
) -> Lane:
    """A lane through points on level ground."""
    line = tuple((x, y, 0.0) for x, y in points)
    return Lane(
        name, kind, line, width_m, successors=tuple(after), speed_m_s=speed_m_s, junction=junction
    )


def crossing() -> list[Lane]:
    """Two one-way streets that cross at the origin, from the west and from the south."""
    return [
        lane("west", (-150.0, 0.0), (-10.0, 0.0), after=["over_we"]),
        lane("over_we", (-10.0, 0.0), (10.0, 0.0), after=["east"], junction=True),
        lane("east", (10.0, 0.0), (200.0, 0.0)),
        lane("south", (0.0, -150.0), (0.0, -10.0), after=["over_sn"]),
        lane("over_sn", (0.0, -10.0), (0.0, 10.0), after=["north"], junction=True),
        lane("north", (0.0, 10.0), (0.0, 200.0)),
    ]


def car(graph: LaneGraph, name: str, on: str, at_m: float, **changes: float) -> Vehicle:
    """A car of 4.5 m in the middle of a lane; its rear axle is at ``at_m``."""
    x, y, _ = graph.lines[on].pose(at_m).translation_m
    cosine, sine = graph.lines[on].pose(at_m).rotation()[:2, 0].tolist()
    route = draw_route(graph, [on], at_m + REACH_M, rng_of(name))
    return Vehicle(
        name, (x, y), (cosine, sine), front_m=3.6, rear_m=0.9, width_m=1.9, wheelbase_m=2.7,
        route=route, station_m=at_m, **changes,
    )  # fmt: skip


def fleet(
    lanes: Sequence[Lane], *cars: tuple[str, float], obstacles: np.ndarray = NO_BOXES
) -> Vehicles:
    graph = LaneGraph.of(lanes, "driving")
    vehicles = [car(graph, f"car/{k}", on, at_m) for k, (on, at_m) in enumerate(cars)]
    return make_vehicles(vehicles, graph, LaneGraph.of(lanes, "crosswalk"), obstacles, REACH_M)


def driven(
    lanes: Sequence[Lane],
    *cars: tuple[str, float],
    duration_s: float = 15.0,
    approaches: Mapping[str, Approach] | None = None,
    walkers: Sequence[Pedestrian] = (),
    obstacles: np.ndarray = NO_BOXES,
) -> tuple[Vehicles, SimulatedMotion]:
    made = fleet(lanes, *cars, obstacles=obstacles)
    return made, simulate(made, walkers, obstacles, approaches or {}, duration_s)


def fronts_m(made: Vehicles, motion: SimulatedMotion) -> np.ndarray:
    """Stations of the cars' fronts at every step."""
    return motion.station_m + made.front_m
