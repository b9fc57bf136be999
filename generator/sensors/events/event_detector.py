"""What happens to the thing that carries it, from the truth: collisions, lines crossed, and more.

The occurrences are those of CARLA's collision, lane invasion and obstacle detectors and of
CoppeliaSim's proximity sensors. They are facts about boxes and lanes, not measurements: no noise.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.generator.core.capture import Channel, Measurements
from gen_data.generator.core.errors import SampleError
from gen_data.generator.core.interfaces import Renderer
from gen_data.generator.core.measurement_dtypes import (
    LIGHT_STATES,
    OCCURRENCES,
    WATCHER,
    table_rows,
)
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.events.lane_queries import (
    governing_light,
    is_crossed,
    lane_border_pieces,
)
from gen_data.generator.sensors.events.obb_queries import (
    OrientedObstacle,
    ahead_m,
    distance_m,
    find_obstacles,
    is_touching,
    project_to_ground,
)
from gen_data.generator.sensors.mounting import Instrument, window_s

Occurrence = Literal["collision", "lane_invasion", "obstacle", "traffic_light", "proximity"]
EVERYTHING: tuple[Occurrence, ...] = get_args(Occurrence)
Row = tuple[float, int, int, float]
"""Time, kind, other instance, value."""

FASTEST_M_S = 150.0
"""Nothing comes nearer more quickly."""
LOW_M = 0.2
"""What is lower is no obstacle to something that stands on the same ground."""


class EventDetector(Instrument):
    """What happens to its carrier: collisions, lines crossed, obstacles, lights, things near.

    Collisions and crossed lines are reported when they begin; the others at every reading for
    which they hold. Lanes outside junctions are taken to have lines on both sides.

    Attributes:
        events: What is reported.
        obstacle_m: An obstacle straight ahead is reported when it is nearer than this.
        light_m: A traffic light is reported when its stop line is nearer than this.
        proximity_m: The nearest thing is reported when it is nearer to the device than this.
        resolution_s: Between the instants at which collisions and lines are looked for.
    """

    kind: ClassVar[str] = "watcher"
    type: Literal["watcher"] = "watcher"
    name: str = Field("watcher", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    events: tuple[Occurrence, ...] = Field(EVERYTHING, min_length=1)
    obstacle_m: float = Field(20.0, gt=0, le=500)
    light_m: float = Field(50.0, gt=0, le=500)
    proximity_m: float = Field(3.0, gt=0, le=500)
    resolution_s: float = Field(0.01, gt=0, le=1)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """What happened since the last reading.

        Raises:
            SampleError: its carrier has no box.
        """
        del renderer, channels, rng
        own, others = self._company(scene)
        times_s = self._instants(scene)
        rows: list[Row] = []
        if "collision" in self.events:
            rows += _collisions(own, others, times_s)
        if "lane_invasion" in self.events:
            rows += _invasions(scene, own, times_s)
        if "obstacle" in self.events:
            rows += self._obstacle(scene, own, others)
        if "traffic_light" in self.events:
            rows += self._light(scene, own)
        if "proximity" in self.events:
            rows += self._proximity(scene, others)
        return Measurements(self.name, scene.device(self.name), _table(rows), scene.time_s)

    def _company(self, scene: Scene) -> tuple[OrientedObstacle, list[OrientedObstacle]]:
        """The box that carries it, and all it might meet."""
        body = scene.body(scene.rig(self.rig).body)
        things = {thing.instance.instance_id: thing for thing in find_obstacles(scene)}
        own = things.pop(body.instance_id, None)
        if own is None:
            raise SampleError(
                f"sensor '{self.name}': '{body.name}', which carries rig '{self.rig}', has no box;"
                " watch from a rig on a labelled thing"
            )
        now_s = scene.time_s
        return own, [t for t in things.values() if not project_to_ground(own, t, now_s, LOW_M)]

    def _instants(self, scene: Scene) -> Array:
        """Instants from the last reading to this one; the same from whichever side one comes."""
        start_s, end_s = window_s(scene, self.rate_hz)
        parts = max(math.ceil((end_s - start_s) / self.resolution_s - 1e-9), 1)
        if end_s <= 0.0:
            return np.array([0.0])
        return np.round(start_s + (end_s - start_s) * np.arange(parts + 1) / parts, 9)

    def _obstacle(
        self, scene: Scene, own: OrientedObstacle, others: list[OrientedObstacle]
    ) -> list[Row]:
        """The nearest thing straight ahead."""
        now_s = scene.time_s
        gaps = [(ahead_m(own, t, now_s), t.instance.instance_id) for t in others]
        return _nearest("obstacle", now_s, gaps, self.obstacle_m)

    def _proximity(self, scene: Scene, others: list[OrientedObstacle]) -> list[Row]:
        """The thing nearest to the device."""
        now_s = scene.time_s
        place = np.asarray(scene.device(self.name).T_world_device.translation_m)
        gaps = [(distance_m(t, place, now_s), t.instance.instance_id) for t in others]
        return _nearest("proximity", now_s, gaps, self.proximity_m)

    def _light(self, scene: Scene, own: OrientedObstacle) -> list[Row]:
        """State of the light that the carrier has to mind."""
        light = governing_light(scene, own.box(scene.time_s), self.light_m)
        if light is None:
            return []
        state = dict(light.attributes)["state"]
        shown = LIGHT_STATES.index(state) if state in LIGHT_STATES else 0
        kind = OCCURRENCES.index("traffic_light")
        return [(scene.time_s, kind, light.instance_id, float(shown))]


def _collisions(own: OrientedObstacle, others: list[OrientedObstacle], times_s: Array) -> list[Row]:
    """Every beginning of a touch, with the speed against each other."""
    kind = OCCURRENCES.index("collision")
    rows: list[Row] = []
    moves_m = FASTEST_M_S * float(times_s[-1] - times_s[0])
    here = np.asarray(own.box(float(times_s[-1])).translation_m)
    for other in others:
        if distance_m(other, here, float(times_s[-1])) > own.radius_m + moves_m:
            continue
        for k in _beginnings(np.array([is_touching(own, other, float(t)) for t in times_s])):
            mine, its = own.twist(float(times_s[k])), other.twist(float(times_s[k]))
            closing = np.subtract(its.velocity_m_s, mine.velocity_m_s)
            speed_m_s = float(np.sqrt(closing @ closing))
            rows.append((float(times_s[k]), kind, other.instance.instance_id, speed_m_s))
    return rows


def _invasions(scene: Scene, own: OrientedObstacle, times_s: Array) -> list[Row]:
    """Every line that comes under the carrier, and on which side of it."""
    pieces = lane_border_pieces(scene)
    near_m = own.radius_m + 100.0
    middle = np.array(own.box(float(times_s[-1])).translation_m[:2])
    pieces = pieces[np.abs(pieces - middle).max(axis=(1, 2)) < near_m]
    if len(pieces) == 0:
        return []
    under = np.array([is_crossed(pieces, own.box(float(t)), own.half_m) for t in times_s])
    kind = OCCURRENCES.index("lane_invasion")
    # A line that comes under it from one side stays under it until it is out on the other.
    return [
        (float(times_s[k]), kind, 0, 1.0 if under[k, 0] else -1.0)
        for k in _beginnings(under[:, 0] | under[:, 1])
    ]


def _beginnings(held: NDArray[np.bool_]) -> list[int]:
    """Instants at which something holds that did not before; the first counts at time 0 only."""
    if len(held) == 1:
        return [0] if held[0] else []
    return [int(k) + 1 for k in np.flatnonzero(held[1:] & ~held[:-1])]


def _nearest(kind: str, time_s: float, gaps: list[tuple[float, int]], limit_m: float) -> list[Row]:
    """The nearest of several things, if it is within a limit."""
    gap_m, instance_id = min(gaps, default=(math.inf, 0))
    if gap_m >= limit_m:
        return []
    return [(time_s, OCCURRENCES.index(kind), instance_id, gap_m)]


def _table(rows: list[Row]) -> NDArray[np.void]:
    """Rows in order of time, kind and instance."""
    columns = np.array(sorted(rows), dtype=np.float64).reshape(-1, 4).T
    names = tuple(column.name for column in WATCHER)
    return table_rows("watcher", len(rows), **dict(zip(names, columns, strict=True)))
