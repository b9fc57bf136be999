"""Event detector: collisions, lane invasions and other events of its carrier, from ground truth.

The events match CARLA's collision, lane invasion and obstacle detectors and of CoppeliaSim's
proximity sensors. They are computed from boxes and lanes, without noise.
"""

import math
from typing import ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import errors, interfaces
from gen_data.core.capture import Channel, Measurements
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.events.obb_queries import (
    OrientedObstacle,
    distance_m,
    find_obstacles,
    gap_ahead_m,
    governing_light,
    is_below,
    is_crossed,
    is_touching,
    lane_border_pieces,
)
from gen_data.sensors.mounting import Instrument, window_s

Occurrence = Literal["collision", "lane_invasion", "obstacle", "traffic_light", "proximity"]
EVERYTHING: tuple[Occurrence, ...] = get_args(Occurrence)
Row = tuple[float, int, int, float]
"""Time [s], number of the event, id of the other instance, value."""

OCCURRENCES = ("collision", "lane_invasion", "obstacle", "traffic_light", "proximity")
"""Events that a watcher (event detector) reports, by index."""

LIGHT_STATES = ("dark", "red", "red_yellow", "yellow", "green")
"""``value`` of the occurrence ``traffic_light``, by number."""

COLUMNS = (
    TIME,
    Column(
        "occurrence",
        "|u1",
        "0 collision, 1 lane_invasion, 2 obstacle, 3 traffic_light, 4 proximity",
    ),
    Column("instance_id", "<u2", "the other object; 0 = none"),
    Column(
        "value",
        "<f4",
        "collision: speed against each other [m/s]; lane_invasion: 1 = the line to the left, -1 ="
        " to the right; obstacle, proximity: distance [m]; traffic_light: 0 dark, 1 red, 2 red and"
        " yellow, 3 yellow, 4 green",
    ),
)
CLOSING_SPEED_MAX_M_S = 150.0
"""Bound for culling: no object approaches faster."""
LOW_M = 0.2
"""Objects lower than this above the carrier's ground are not obstacles."""


class EventDetector(Instrument):
    """Detects events of its carrier: collisions, lane invasions, obstacles, lights, proximity.

    Collisions and lane invasions are reported when they begin, the others at every reading while
    they last. All lanes outside junctions count as having lines on both sides.

    Attributes:
        events: Events to report.
        obstacle_m: Largest distance of an obstacle straight ahead.
        light_m: Largest distance of a traffic light's stop line.
        proximity_m: Largest distance between the device and the nearest object.
        resolution_s: Time between checks for collisions and lane invasions.
    """

    kind: ClassVar[str] = "watcher"
    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    type: Literal["watcher"] = "watcher"
    name: str = Field("watcher", pattern=NAME_PATTERN)
    events: tuple[Occurrence, ...] = Field(EVERYTHING, min_length=1)
    obstacle_m: float = Field(20.0, gt=0, le=500)
    light_m: float = Field(50.0, gt=0, le=500)
    proximity_m: float = Field(3.0, gt=0, le=500)
    resolution_s: float = Field(0.01, gt=0, le=1)

    def capture(
        self, scene: Scene, renderer: interfaces.Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Report the events since the last reading.

        Raises:
            SampleError: the carrier has no box.
        """
        del renderer, channels, rng
        own, others = self._find_boxes(scene)
        times_s = self._check_times(scene)
        rows: list[Row] = []
        if "collision" in self.events:
            rows += _collisions(own, others, times_s)
        if "lane_invasion" in self.events:
            rows += _lane_invasions(scene, own, times_s)
        if "obstacle" in self.events:
            rows += self._obstacle(scene, own, others)
        if "traffic_light" in self.events:
            rows += self._light(scene, own)
        if "proximity" in self.events:
            rows += self._proximity(scene, others)
        return Measurements(self.name, scene.device(self.name), _table(rows), scene.time_s)

    def _find_boxes(self, scene: Scene) -> tuple[OrientedObstacle, list[OrientedObstacle]]:
        body = scene.body(scene.rig(self.rig).body)
        boxes = {box.instance.instance_id: box for box in find_obstacles(scene)}
        own = boxes.pop(body.instance_id, None)
        if own is None:
            raise errors.SampleError(
                f"sensor '{self.name}': '{body.name}', which carries rig '{self.rig}', has no box;"
                " mount it on the rig of a labelled object"
            )
        now_s = scene.time_s
        return own, [b for b in boxes.values() if not is_below(own, b, now_s, LOW_M)]

    def _check_times(self, scene: Scene) -> Array:
        """Instants [s] of checks from the last reading to this one, both included, [n]."""
        start_s, end_s = window_s(scene, self.rate_hz)
        parts = max(math.ceil((end_s - start_s) / self.resolution_s - 1e-9), 1)
        if end_s <= 0.0:
            return np.array([0.0])
        return np.round(start_s + (end_s - start_s) * np.arange(parts + 1) / parts, 9)

    def _obstacle(
        self, scene: Scene, own: OrientedObstacle, others: list[OrientedObstacle]
    ) -> list[Row]:
        now_s = scene.time_s
        gaps = [(gap_ahead_m(own, b, now_s), b.instance.instance_id) for b in others]
        return _report_nearest("obstacle", now_s, gaps, self.obstacle_m)

    def _proximity(self, scene: Scene, others: list[OrientedObstacle]) -> list[Row]:
        now_s = scene.time_s
        position = np.asarray(scene.device(self.name).T_world_device.translation_m)
        gaps = [(distance_m(b, position, now_s), b.instance.instance_id) for b in others]
        return _report_nearest("proximity", now_s, gaps, self.proximity_m)

    def _light(self, scene: Scene, own: OrientedObstacle) -> list[Row]:
        light = governing_light(scene, own.box(scene.time_s), self.light_m)
        if light is None:
            return []
        state = dict(light.attributes)["state"]
        number = LIGHT_STATES.index(state) if state in LIGHT_STATES else 0
        kind = OCCURRENCES.index("traffic_light")
        return [(scene.time_s, kind, light.instance_id, float(number))]


def _collisions(own: OrientedObstacle, others: list[OrientedObstacle], times_s: Array) -> list[Row]:
    """Beginnings of contacts, with the relative speed [m/s]."""
    kind = OCCURRENCES.index("collision")
    rows: list[Row] = []
    travel_max_m = CLOSING_SPEED_MAX_M_S * float(times_s[-1] - times_s[0])
    here = np.asarray(own.box(float(times_s[-1])).translation_m)
    for other in others:
        if distance_m(other, here, float(times_s[-1])) > own.radius_m + travel_max_m:
            continue
        for k in _rising_edges(np.array([is_touching(own, other, float(t)) for t in times_s])):
            mine, its = own.twist(float(times_s[k])), other.twist(float(times_s[k]))
            relative = np.subtract(its.velocity_m_s, mine.velocity_m_s)
            speed_m_s = float(np.sqrt(relative @ relative))
            rows.append((float(times_s[k]), kind, other.instance.instance_id, speed_m_s))
    return rows


def _lane_invasions(scene: Scene, own: OrientedObstacle, times_s: Array) -> list[Row]:
    """Beginnings of lines below the carrier: 1 for its left half, -1 for its right one."""
    pieces = lane_border_pieces(scene)
    near_m = own.radius_m + 100.0
    middle = np.array(own.box(float(times_s[-1])).translation_m[:2])
    pieces = pieces[np.abs(pieces - middle).max(axis=(1, 2)) < near_m]
    if len(pieces) == 0:
        return []
    under = np.array([is_crossed(pieces, own.box(float(t)), own.half_m) for t in times_s])
    kind = OCCURRENCES.index("lane_invasion")
    # A crossed line passes from one half to the other: both halves together make it one event.
    return [
        (float(times_s[k]), kind, 0, 1.0 if under[k, 0] else -1.0)
        for k in _rising_edges(under[:, 0] | under[:, 1])
    ]


def _rising_edges(flags: NDArray[np.bool_]) -> list[int]:
    """Indices at which a flag becomes set; a single flag, at time 0, counts if it is set."""
    if len(flags) == 1:
        return [0] if flags[0] else []
    return [int(k) + 1 for k in np.flatnonzero(flags[1:] & ~flags[:-1])]


def _report_nearest(
    kind: str, time_s: float, gaps: list[tuple[float, int]], limit_m: float
) -> list[Row]:
    """One row for the nearest of (gap [m], instance id), if it is within a limit."""
    gap_m, instance_id = min(gaps, default=(math.inf, 0))
    if gap_m >= limit_m:
        return []
    return [(time_s, OCCURRENCES.index(kind), instance_id, gap_m)]


def _table(rows: list[Row]) -> NDArray[np.void]:
    columns = np.array(sorted(rows), dtype=np.float64).reshape(-1, 4).T
    names = tuple(column.name for column in COLUMNS)
    return table_rows(COLUMNS, len(rows), **dict(zip(names, columns, strict=True)))
