"""Cycles of traffic lights.

Amber lasts 3 s, red with amber 1 s (RiLSA, at 50 km/h). Amber and an all-red time separate the
greens of two axes.
"""

import math
from dataclasses import dataclass
from typing import Literal

State = Literal["red", "red_yellow", "yellow", "green"]

AMBER_S = 3.0
RED_AMBER_S = 1.0


@dataclass(frozen=True, slots=True)
class Cycle:
    """Signal programme of a junction: its axes have green in turn.

    Attributes:
        axes: Number of axes.
        green_s: Duration of each green.
        all_red_s: Duration after each amber, including red with amber.
        offset_s: Time in the cycle at time 0.
    """

    axes: int
    green_s: float = 15.0
    all_red_s: float = 2.0
    offset_s: float = 0.0

    @property
    def share_s(self) -> float:
        """Time from the start of one axis' green to the start of the next one's [s]."""
        return self.green_s + AMBER_S + self.all_red_s

    @property
    def length_s(self) -> float:
        """Duration of the whole cycle [s]."""
        return self.axes * self.share_s

    def state(self, axis: int, time_s: float) -> State:
        """State of the signals of an axis."""
        local = self._local(axis, time_s)
        if local < self.green_s:
            return "green"
        if local < self.green_s + AMBER_S:
            return "yellow"
        if self.axes > 1 and local >= self.length_s - RED_AMBER_S:
            return "red_yellow"
        return "red"

    def red_left_s(self, axis: int, time_s: float) -> float:
        """Remaining red time of an axis [s]; 0 if it is not red."""
        if self.state(axis, time_s) != "red":
            return 0.0
        return self.length_s - RED_AMBER_S - self._local(axis, time_s)

    def switches_s(self, axis: int, until_s: float) -> tuple[float, ...]:
        """Times in (0, until_s] at which an axis' signals change."""
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
        """Time since the start of an axis' latest green [s]."""
        # Rounding may put a step of the simulation slightly before the instant of a switch.
        return (time_s + 1e-9 + self.offset_s - axis * self.share_s) % self.length_s


@dataclass(frozen=True, slots=True)
class Approach:
    """Signals of a lane into a junction."""

    cycle: Cycle
    axis: int

    def state(self, time_s: float) -> State:
        """State of the signals."""
        return self.cycle.state(self.axis, time_s)

    def red_left_s(self, time_s: float) -> float:
        """Remaining red time [s]; 0 if they are not red."""
        return self.cycle.red_left_s(self.axis, time_s)
