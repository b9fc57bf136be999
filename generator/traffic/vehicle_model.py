"""Longitudinal motion of vehicles: following, signals, right of way and pedestrians."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gen_data.core.se3 import Array
from gen_data.traffic import conflict_zones, idm, lane_routes, signal_cycles
from gen_data.traffic.vehicles import EASY_M_S2, Entry, Vehicles

SEEN_M = 12.0
"""Smallest distance at which drivers decide about a junction; more at higher speeds."""
CAN_STOP_M_S2 = 3.0
"""Largest deceleration for amber or for waiting pedestrians; otherwise drivers go on."""
MUST_STOP_M_S2 = 6.0
"""Largest deceleration for crossing pedestrians; otherwise drivers go on."""
GAP_S = 1.0
"""Time margin between a vehicle that crosses and the next one."""
PATIENCE_S = 3.0
"""Waiting time after which drivers go in the order of arrival."""
AT_LINE_S = 0.4
"""Time gap to stop lines, which cannot brake, unlike leaders."""
BEFORE_LINE_M = 1.0
"""Distance of stopped vehicles from a stop line."""


@dataclass(frozen=True, slots=True)
class CrossingPedestrian:
    """A pedestrian on a crosswalk, or waiting at its kerb.

    Attributes:
        waits: Whether the pedestrian stands at the kerb; drivers stop if they can do so easily.
        at_m: Station on the crosswalk.
        forward: Whether the pedestrian walks in its direction.
    """

    crosswalk: str
    at_m: float
    forward: bool
    waits: bool = False


@dataclass(frozen=True, slots=True)
class _Approaching:
    """A vehicle that approaches a junction and may not yet enter it.

    Attributes:
        after_s: Time until the front is at the junction.
    """

    number: int
    entry: Entry
    after_s: float


class VehicleModel:
    """State of all vehicles, at first at the speed limits of their places; ``step`` changes it.

    Attributes:
        station_m, speed_m_s, acceleration_m_s2: Motion along the routes [n].
        entered: Number of junctions that each vehicle has entered or may enter.
        waited_s: Time since each vehicle stopped [n].
    """

    def __init__(self, fleet: Vehicles, approaches: Mapping[str, signal_cycles.Approach]) -> None:
        self.fleet = fleet
        self.approaches = approaches
        n = len(fleet.vehicles)
        self._at_lines = replace(fleet.drivers, headway_s=np.full(n, AT_LINE_S))
        self.station_m: Array = fleet.first_m.copy()
        self.acceleration_m_s2: Array = np.zeros(n)
        self.waited_s: Array = np.zeros(n)
        fronts = self.station_m + fleet.front_m
        self.entered = [
            sum(entry.at_m < front - 0.5 for entry in entries)
            for entries, front in zip(fleet.entries, fronts.tolist(), strict=True)
        ]
        self.speed_m_s = self._speed_limits(np.zeros(n))

    def settle(self, crossers: Sequence[CrossingPedestrian]) -> None:
        """Lower the speeds at time 0 until comfortable braking suffices."""
        fleet = self.fleet
        stops = self._find_stops(0.0, crossers)
        room = np.maximum(stops - self.station_m - fleet.front_m - BEFORE_LINE_M, 0.0)
        speed = np.minimum(self.speed_m_s, np.sqrt(2.0 * EASY_M_S2 * np.minimum(room, 1e4)))
        for _ in range(len(speed)):
            gap, leader = self._find_leaders(speed)
            behind = idm.equilibrium_speed(fleet.drivers, gap, speed)
            free = np.maximum(np.minimum(gap, 1e4) - fleet.drivers.standstill_m, 0.0)
            lower = np.minimum(behind, np.sqrt(leader * leader + 2.0 * EASY_M_S2 * free))
            if (lower >= speed - 1e-9).all():
                break
            speed = np.minimum(speed, lower)
        self.speed_m_s = speed

    def step(self, time_s: float, step_s: float, crossers: Sequence[CrossingPedestrian]) -> None:
        """Advance by one step with constant accelerations; speeds stay at or above 0."""
        fleet, drivers, v = self.fleet, self.fleet.drivers, self.speed_m_s
        gap, leader = self._find_leaders(v)
        stops = self._find_stops(time_s, crossers, gap, leader)
        to_stop = stops - self.station_m - fleet.front_m + drivers.standstill_m - BEFORE_LINE_M
        taken = np.maximum(
            idm.interaction(drivers, v, gap, leader),
            idm.interaction(self._at_lines, v, to_stop, np.zeros_like(v)),
        )
        a = idm.free_acceleration(drivers, v, self._speed_limits(v)) - taken
        a = np.maximum(np.minimum(a, drivers.acceleration_m_s2), -idm.HARDEST_M_S2)
        after = np.maximum(v + a * step_s, 0.0)
        # Stop vehicles that would creep on by millimetres.
        after[(after < 0.05) & (a < 0.1)] = 0.0
        self.acceleration_m_s2 = (after - v) / step_s
        self.station_m = self.station_m + 0.5 * (v + after) * step_s
        self.speed_m_s = after
        self.waited_s = np.where(after < 0.3, self.waited_s + step_s, 0.0)

    def lets_pass(self, crosswalk: str) -> bool:
        """Whether pedestrians may enter a crosswalk: no vehicle is on it or too fast to stop."""
        for i, zones in enumerate(self.fleet.zones):
            for zone in zones:
                if zone.zone.crosswalk != crosswalk:
                    continue
                front = float(self.station_m[i]) + self.fleet.vehicles[i].front_m
                rear = float(self.station_m[i]) - self.fleet.vehicles[i].rear_m
                v = float(self.speed_m_s[i])
                needed = 0.5 * v * v / CAN_STOP_M_S2 + 0.5 * v
                if front > zone.enter_m - needed and rear < zone.leave_m:
                    return False
        return True

    def _speed_limits(self, speed_m_s: Array) -> Array:
        """Speed limits half a second ahead [n]."""
        ahead = self.station_m - self.fleet.first_m + 0.5 * speed_m_s
        last = self.fleet.allowed_m_s.shape[1] - 1
        k = np.minimum((ahead / lane_routes.STATION_M).astype(np.int64), last)
        allowed: Array = self.fleet.allowed_m_s[np.arange(len(k)), k]
        return allowed

    def _find_leaders(self, speed_m_s: Array) -> tuple[Array, Array]:
        """Gaps to the leaders [n], ``inf`` = none, and their speeds [n]."""
        fleet = self.fleet
        if not len(speed_m_s):
            return np.zeros(0), np.zeros(0)
        front = self.station_m + fleet.front_m
        theirs = self.station_m[None] + fleet.offset_m
        rears, fronts = theirs - fleet.rear_m[None], theirs + fleet.front_m[None]
        ahead = (
            (fronts > fleet.from_m)
            & (rears < fleet.to_m)
            & (rears + fronts > (2.0 * self.station_m + fleet.front_m - fleet.rear_m)[:, None])
        )
        gaps = np.where(ahead, rears - front[:, None], np.inf)
        who = np.argmin(gaps, axis=1)
        gap = gaps[np.arange(len(who)), who]
        return gap, np.where(gap < np.inf, speed_m_s[who], 0.0)

    def _find_stops(
        self,
        time_s: float,
        crossers: Sequence[CrossingPedestrian],
        gap_m: Array | None = None,
        leader_m_s: Array | None = None,
    ) -> Array:
        """Stations of the next stops [n]; ``inf`` = none. Lets vehicles into junctions."""
        stops: Array = self.fleet.end_m.copy()
        approaching = self._find_approaching(time_s, stops)
        for own in approaching:
            i = own.number
            full = (
                gap_m is not None
                and leader_m_s is not None
                and self._is_full(own, float(gap_m[i]), float(leader_m_s[i]))
            )
            yields = full or any(self._must_yield(own, other) for other in approaching)
            if yields or self._is_taken(own):
                stops[i] = min(stops[i], own.entry.at_m)
            else:
                self.entered[i] += 1
        if crossers:
            self._stop_for_people(crossers, stops)
        return stops

    def _find_approaching(self, time_s: float, stops: Array) -> list[_Approaching]:
        """Vehicles that approach a junction without a red light, by time of arrival."""
        approaching = []
        for i, entries in enumerate(self.fleet.entries):
            self._revoke_entry(i, time_s)
            if self.entered[i] >= len(entries):
                continue
            entry = entries[self.entered[i]]
            left = entry.at_m - float(self.station_m[i]) - self.fleet.vehicles[i].front_m
            v = float(self.speed_m_s[i])
            if left > max(SEEN_M, v * v / EASY_M_S2):
                continue
            if self._is_red(entry, left, v, time_s):
                stops[i] = min(stops[i], entry.at_m)
                continue
            approaching.append(_Approaching(i, entry, max(left, 0.0) / max(v, 2.0)))
        return sorted(approaching, key=lambda own: (own.after_s, own.number))

    def _revoke_entry(self, i: int, time_s: float) -> None:
        """Revoke the permission of a vehicle that can still stop when the light changes."""
        k = self.entered[i] - 1
        if k < 0:
            return
        entry = self.fleet.entries[i][k]
        left = entry.at_m - float(self.station_m[i]) - self.fleet.vehicles[i].front_m
        if left > 0.0 and self._is_red(entry, left, float(self.speed_m_s[i]), time_s):
            self.entered[i] = k

    def _is_red(self, entry: Entry, left_m: float, speed_m_s: float, time_s: float) -> bool:
        approach = self.approaches.get(entry.came)
        if approach is None:
            return False
        state = approach.state(time_s)
        if state == "yellow":
            return speed_m_s * speed_m_s <= 2.0 * CAN_STOP_M_S2 * max(left_m, 0.0)
        return state != "green"

    def _is_taken(self, own: _Approaching) -> bool:
        """Whether a vehicle is on, or may enter, a lane that crosses or joins its own."""
        for k, entries in enumerate(self.fleet.entries):
            if k == own.number:
                continue
            for entry in entries[: self.entered[k]]:
                overlap = self.fleet.overlaps.get((entry.lane, own.entry.lane))
                if overlap is None or overlap.kind == "part":
                    continue
                rear = float(self.station_m[k]) - self.fleet.vehicles[k].rear_m
                if rear < min(entry.at_m + overlap.own_m[1], entry.leave_m):
                    return True
        return False

    def _is_full(self, own: _Approaching, gap_m: float, leader_m_s: float) -> bool:
        """Whether there is no room beyond the junction; vehicles do not stop inside it."""
        vehicle = self.fleet.vehicles[own.number]
        front = float(self.station_m[own.number]) + vehicle.front_m
        needed = own.entry.leave_m + vehicle.front_m + vehicle.rear_m + 2.0
        return leader_m_s < 2.0 and front + gap_m < needed

    def _must_yield(self, own: _Approaching, other: _Approaching) -> bool:
        """Whether another vehicle has the right of way and arrives too early to go first."""
        if own.number == other.number:
            return False
        overlap = self.fleet.overlaps.get((own.entry.lane, other.entry.lane))
        if overlap is None or overlap.kind == "part":
            return False
        vehicle = self.fleet.vehicles[own.number]
        length = vehicle.front_m + vehicle.rear_m
        v = max(float(self.speed_m_s[own.number]), 4.0)
        passed_s = own.after_s + (overlap.own_m[1] + length) / v + GAP_S
        theirs = max(float(self.speed_m_s[other.number]), 4.0)
        if other.after_s + overlap.other_m[0] / theirs > passed_s:
            return False
        waited = float(self.waited_s[own.number]), float(self.waited_s[other.number])
        if max(waited) >= PATIENCE_S:
            return (waited[1], -other.number) > (waited[0], -own.number)
        return self._is_second(own, other)

    def _is_second(self, own: _Approaching, other: _Approaching) -> bool:
        """Whether the other goes first: straight before oncoming turns, by arrival, from the right.

        Vehicles from the same lane follow each other and are never compared.
        """
        ax, ay = self.fleet.headings[own.entry.came]
        bx, by = self.fleet.headings[other.entry.came]
        if ax * bx + ay * by < -0.7:
            straight = abs(own.entry.turn) < 0.3, abs(other.entry.turn) < 0.3
            if straight[0] != straight[1]:
                return straight[1]
            own_m = own.entry.leave_m - own.entry.at_m
            other_m = other.entry.leave_m - other.entry.at_m
            return (other_m, other.number) < (own_m, own.number)
        if abs(own.after_s - other.after_s) > GAP_S:
            return other.after_s < own.after_s
        across = ax * by - ay * bx
        return across > 0.3 or (abs(across) <= 0.3 and other.number < own.number)

    def _stop_for_people(self, crossers: Sequence[CrossingPedestrian], stops: Array) -> None:
        for i, zones in enumerate(self.fleet.zones):
            front = float(self.station_m[i]) + self.fleet.vehicles[i].front_m
            v = float(self.speed_m_s[i])
            for zone in zones:
                left = zone.enter_m - front
                if left < 0.0 or left > v * v + 30.0:
                    continue
                needed = 0.5 * v * v / max(left, 0.01)
                if any(_is_in_the_way(one, zone.zone, needed) for one in crossers):
                    stops[i] = min(stops[i], zone.enter_m)
                    break


def _is_in_the_way(
    crosser: CrossingPedestrian, zone: conflict_zones.Zone, needed_m_s2: float
) -> bool:
    """Whether to stop before a zone for a pedestrian who has not yet left the lane.

    Args:
        crosser: Pedestrian.
        zone: Intersection of lane and crosswalk.
        needed_m_s2: Deceleration needed to stop.
    """
    if crosser.crosswalk != zone.crosswalk:
        return False
    if needed_m_s2 > (CAN_STOP_M_S2 if crosser.waits else MUST_STOP_M_S2):
        return False
    passed = crosser.at_m - zone.at_m if crosser.forward else zone.at_m - crosser.at_m
    return passed < 0.5 * zone.width_m + 0.5
