"""Pixels of event cameras: events from a sequence of frames.

A pixel triggers an event whenever the logarithm of its intensity has changed by a threshold since
its last event (Lichtsteiner, Posch and Delbruck 2008). Events are interpolated between frames as in
Rebecq et al., "ESIM", CoRL 2018; the spread of thresholds and the noise are those of Hu, Liu and
Delbruck, "v2e", CVPRW 2021.

The trigger levels of each pixel lie on a grid that is fixed for a sequence, so that the events
between two instants do not depend on earlier events: none is lost or repeated at the border of two
steps as long as the change continues in one direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng

DARK_CD_M2 = 0.005
"""Luminance equivalent of the dark current. White paper under 0.1 lx, the least illuminance for a
DVS128 (Lichtsteiner et al. 2008), is six times as bright."""
THRESHOLD_MIN = 0.01
BRIGHT_SHARE = 0.25
"""Shot noise of the brightest pixels over that in the dark (v2e)."""


@dataclass(frozen=True, eq=False, slots=True)
class Pixels:
    """Fixed pattern of a device: threshold and offset of the levels of each pixel, [h, w]."""

    threshold: Array
    phase: Array

    @classmethod
    def draw(cls, shape: tuple[int, int], threshold: float, spread: float, rng: Rng) -> Pixels:
        """Draw the pixels of one device."""
        thresholds = threshold + spread * rng.standard_normal(shape)
        return cls(np.maximum(thresholds, THRESHOLD_MIN), rng.uniform(0.0, 1.0, shape))

    def levels(self, logarithm: Array) -> Array:
        """Log intensity in units of the threshold; whole numbers are the trigger levels."""
        levels: Array = logarithm / self.threshold + self.phase
        return levels


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """Events, arrays [n]; ``pixel`` is the row-major index, ``polarity`` 1 or -1."""

    time_s: Array
    pixel: NDArray[np.int64]
    polarity: NDArray[np.int64]

    def take(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> Events:
        """Select events by index or mask."""
        return Events(self.time_s[which], self.pixel[which], self.polarity[which])

    @staticmethod
    def merge(parts: list[Events]) -> Events:
        """All events with times rounded to the microsecond, sorted by time, then by pixel."""
        events = Events.concatenate(parts)
        time_s = np.round(events.time_s, 6)
        ticks = np.rint(time_s * 1e6).astype(np.int64)
        places = 2 * events.pixel + (events.polarity > 0)
        order = stable_order(ticks, stable_order(places))
        return Events(time_s, events.pixel, events.polarity).take(order)

    @staticmethod
    def concatenate(parts: list[Events]) -> Events:
        """All events in the given order."""
        return Events(
            np.concatenate([part.time_s for part in parts]),
            np.concatenate([part.pixel for part in parts]),
            np.concatenate([part.polarity for part in parts]),
        )


def stable_order(
    numbers: NDArray[np.int64], before: NDArray[np.intp] | None = None
) -> NDArray[np.intp]:
    """Indices that sort integers stably: a radix sort by 16 bits, linear in their count.

    Args:
        numbers: Of any sign, [n].
        before: An order to refine, which ties keep; None = the given order.
    """
    order = np.arange(len(numbers)) if before is None else before
    if len(numbers) == 0:
        return order
    left = numbers - numbers.min()
    for shift in range(0, int(left.max()).bit_length(), 16):
        digits = ((left >> shift) & 0xFFFF).astype(np.uint16)
        order = order[np.argsort(digits[order], kind="stable")]
    return order


def log_response(luminance: Array) -> Array:
    """Logarithm of luminance [cd/m^2] plus dark current."""
    logarithm: Array = np.log(np.maximum(luminance, 0.0) + DARK_CD_M2)
    return logarithm


def signal_events(levels: list[Array], times_s: Array) -> Events:
    """Events between frames: one per crossed level, at its linearly interpolated time.

    They are grouped by frame and not sorted by time.

    Args:
        levels: ``Pixels.levels`` of at least two frames.
        times_s: Instants of the frames.
    """
    flat = [level.ravel() for level in levels]
    # The last level reported is the nearest one behind, seen in the direction of the first change.
    state = np.where(flat[1] >= flat[0], np.floor(flat[0]), np.ceil(flat[0]))
    parts = []
    for k in range(len(flat) - 1):
        before, after = flat[k], flat[k + 1]
        up = np.maximum(np.floor(after) - state, 0.0)
        down = np.maximum(state - np.ceil(after), 0.0)
        for sign, crossed in ((1, up), (-1, down)):
            active = np.flatnonzero(crossed)
            count = crossed[active].astype(np.int64)
            pixel = np.repeat(active, count)
            rank = np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count) + 1
            level = state[pixel] + sign * rank
            share = (level - before[pixel]) / (after[pixel] - before[pixel])
            time_s = times_s[k] + np.clip(share, 0.0, 1.0) * (times_s[k + 1] - times_s[k])
            parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
        state = state + up - down
    return Events.concatenate(parts)


def noise_events(
    luminance: Array, start_s: float, end_s: float, leak_hz: float, shot_hz: float, rng: Rng
) -> Events:
    """Noise events: positive ones by leakage, both polarities by shot noise, more in the dark.

    The rate of shot noise falls linearly with ``I / (I + mean I)`` of the intensity I.
    """
    duration_s = end_s - start_s
    intensity = luminance.ravel() + DARK_CD_M2
    brightness = intensity / (intensity + intensity.mean())
    shot = shot_hz * (1.0 - (1.0 - BRIGHT_SHARE) * brightness)
    parts = []
    for rate_hz, sign in ((leak_hz + 0.5 * shot, 1), (0.5 * shot, -1)):
        count = rng.poisson(rate_hz * duration_s)
        pixel = np.repeat(np.arange(len(count)), count)
        time_s = rng.uniform(start_s, end_s, len(pixel))
        parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
    return Events.concatenate(parts)


def apply_refractory_period(events: Events, refractory_s: float) -> Events:
    """Drop events in the dead time after their pixel's last kept event; they are sorted by time."""
    if refractory_s <= 0.0 or len(events.pixel) == 0:
        return events
    order = stable_order(events.pixel)
    pixel, time_s = events.pixel[order], events.time_s[order]
    soon = (np.diff(pixel) == 0) & (np.diff(time_s) < refractory_s)
    hasty: NDArray[np.bool_] = np.zeros(int(pixel[-1]) + 1, np.bool_)
    hasty[pixel[1:][soon]] = True
    # Most pixels have no two events so close and keep all of them: only the others are simulated.
    kept = ~hasty[events.pixel]
    order = order[hasty[pixel]]
    pixel = events.pixel[order]
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    rank = np.arange(len(pixel)) - np.repeat(starts, np.diff(starts, append=len(pixel)))
    awake_s = np.full(len(hasty), -np.inf)
    by_rank = np.argsort(rank, kind="stable")
    for places in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1]):
        time_s = events.time_s[order[places]]
        awake = time_s >= awake_s[pixel[places]]
        kept[order[places]] = awake
        awake_s[pixel[places][awake]] = time_s[awake] + refractory_s
    return events.take(kept)
