"""Cycles of traffic lights.

Amber lasts 3 s, red and amber together 1 s (RiLSA, at 50 km/h); between the end of one
green and the beginning of the next lie amber and a time in which all is red.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

State = Literal["red", "red_yellow", "yellow", "green"]

AMBER_S = 3.0
RED_AMBER_S = 1.0


@dataclass(frozen=True, slots=True)
class Cycle:
    """A junction's programme: its axes have green one after the other.

    Attributes:
        axes: Number of axes.
        green_s: Of each.
        all_red_s: After each amber, red and amber included.
        offset_s: Time in the cycle at time 0.
    """

    axes: int
    green_s: float = 15.0
    all_red_s: float = 2.0
    offset_s: float = 0.0

    @property
    def share_s(self) -> float:
        """From the beginning of one axis' green to that of the next."""
        return self.green_s + AMBER_S + self.all_red_s

    @property
    def length_s(self) -> float:
        """Of the whole cycle."""
        return self.axes * self.share_s

    def state(self, axis: int, time_s: float) -> State:
        """What the signals of an axis show."""
        local = self._local(axis, time_s)
        if local < self.green_s:
            return "green"
        if local < self.green_s + AMBER_S:
            return "yellow"
        if self.axes > 1 and local >= self.length_s - RED_AMBER_S:
            return "red_yellow"
        return "red"

    def red_left_s(self, axis: int, time_s: float) -> float:
        """How long an axis stays red; 0 when it is not."""
        if self.state(axis, time_s) != "red":
            return 0.0
        return self.length_s - RED_AMBER_S - self._local(axis, time_s)

    def switches_s(self, axis: int, until_s: float) -> tuple[float, ...]:
        """Times above 0 and up to some time at which an axis' signals change."""
        ends = (0.0, self.green_s, self.green_s + AMBER_S, self.length_s - RED_AMBER_S)
        start = axis * self.share_s - self.offset_s
        found = []
        for end in ends:
            first = start + end
            k = math.ceil(-first / self.length_s)
            while first + k * self.length_s <= until_s:
                if first + k * self.length_s > 0.0:
                    found.append(round(first + k * self.length_s, 6))
                k += 1
        return tuple(sorted(found))

    def _local(self, axis: int, time_s: float) -> float:
        """Time since the beginning of an axis' latest green."""
        # A step of the simulation may come out a bit below the instant of a switch.
        return (time_s + 1e-9 + self.offset_s - axis * self.share_s) % self.length_s


@dataclass(frozen=True, slots=True)
class Approach:
    """The signals that a lane into a junction obeys."""

    cycle: Cycle
    axis: int

    def state(self, time_s: float) -> State:
        """What they show."""
        return self.cycle.state(self.axis, time_s)

    def red_left_s(self, time_s: float) -> float:
        """How long they stay red; 0 when they are not."""
        return self.cycle.red_left_s(self.axis, time_s)
