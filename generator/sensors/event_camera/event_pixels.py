"""Pixels that report changes of brightness: from frames to events.

A pixel reports whenever the logarithm of its intensity has changed by a threshold since its last
event (Lichtsteiner, Posch and Delbruck 2008). It is simulated from frames as in Rebecq et al.,
"ESIM", CoRL 2018, with times by linear interpolation, and in Hu, Liu and Delbruck, "v2e", CVPRW
2021, from which the spread of thresholds and the noise come.

Here the levels at which a pixel reports lie on a fixed grid, one per pixel and sequence, so that
what it reports between two instants needs no memory of what it reported before them: nothing is
lost or told twice where one step ends and the next begins, as long as the change goes on in one
direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng

DARK_CD_M2 = 0.005
"""Luminance that a pixel adds to all it sees: its dark current. White paper under 0.1 lx is six
times as bright, the least at which a DVS128 works (Lichtsteiner et al. 2008)."""
THRESHOLD_MIN = 0.01
BRIGHT_SHARE = 0.25
"""v2e: shot noise of the brightest pixels, in units of that in the dark."""


@dataclass(frozen=True, eq=False, slots=True)
class Pixels:
    """What is peculiar to each pixel, [h, w]: its threshold, and where its levels lie."""

    threshold: Array
    phase: Array

    @classmethod
    def drawn(cls, shape: tuple[int, int], threshold: float, spread: float, rng: Rng) -> Pixels:
        """The pixels of one device."""
        thresholds = threshold + spread * rng.standard_normal(shape)
        return cls(np.maximum(thresholds, THRESHOLD_MIN), rng.uniform(0.0, 1.0, shape))

    def levels(self, logarithm: Array) -> Array:
        """Brightness in units of thresholds; whole numbers are the levels."""
        levels: Array = logarithm / self.threshold + self.phase
        return levels


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """Events, arrays [n]; ``pixel`` counts along rows."""

    time_s: Array
    pixel: NDArray[np.int64]
    polarity: NDArray[np.int64]

    def taken(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> Events:
        """Some of them, in that order."""
        return Events(self.time_s[which], self.pixel[which], self.polarity[which])

    @staticmethod
    def joined(parts: list[Events]) -> Events:
        """All of them, to the microsecond, by time, then by pixel."""
        every = Events.gathered(parts)
        time_s = np.round(every.time_s, 6)
        ticks = np.rint(time_s * 1e6).astype(np.int64)
        places = 2 * every.pixel + (every.polarity > 0)
        order = stable_order(ticks, stable_order(places))
        return Events(time_s, every.pixel, every.polarity).taken(order)

    @staticmethod
    def gathered(parts: list[Events]) -> Events:
        """All of them as they come."""
        return Events(
            np.concatenate([part.time_s for part in parts]),
            np.concatenate([part.pixel for part in parts]),
            np.concatenate([part.polarity for part in parts]),
        )


def stable_order(
    numbers: NDArray[np.int64], before: NDArray[np.intp] | None = None
) -> NDArray[np.intp]:
    """The stable order of whole numbers, by 16 bits at a time, which is linear in their count.

    Args:
        numbers: Of any sign, [n].
        before: The order they are in already; None = as they stand.
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
    """What a pixel responds to."""
    logarithm: Array = np.log(np.maximum(luminance, 0.0) + DARK_CD_M2)
    return logarithm


def signal_events(levels: list[Array], times_s: Array) -> Events:
    """Events between frames: one for every level that is crossed, in the middle of its passing.

    They come frame by frame, in no order of time.

    Args:
        levels: ``Pixels.levels`` of at least two frames.
        times_s: Of the frames.
    """
    flat = [level.ravel() for level in levels]
    # A level that lies just behind in the direction of the first change was the last to be told.
    state = np.where(flat[1] >= flat[0], np.floor(flat[0]), np.ceil(flat[0]))
    parts = []
    for k in range(len(flat) - 1):
        before, after = flat[k], flat[k + 1]
        up = np.maximum(np.floor(after) - state, 0.0)
        down = np.maximum(state - np.ceil(after), 0.0)
        for sign, crossed in ((1, up), (-1, down)):
            told = np.flatnonzero(crossed)
            count = crossed[told].astype(np.int64)
            pixel = np.repeat(told, count)
            rank = np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count) + 1
            level = state[pixel] + sign * rank
            share = (level - before[pixel]) / (after[pixel] - before[pixel])
            time_s = times_s[k] + np.clip(share, 0.0, 1.0) * (times_s[k + 1] - times_s[k])
            parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
        state = state + up - down
    return Events.gathered(parts)


def noise_events(
    luminance: Array, start_s: float, end_s: float, leak_hz: float, shot_hz: float, rng: Rng
) -> Events:
    """Events without a change: leakage brightens, shot noise does either, more in the dark.

    Pixels of mean luminance are half way between dark and bright.
    """
    duration_s = end_s - start_s
    seen = luminance.ravel() + DARK_CD_M2
    brightness = seen / (seen + seen.mean())
    shot = shot_hz * (1.0 - (1.0 - BRIGHT_SHARE) * brightness)
    parts = []
    for rate_hz, sign in ((leak_hz + 0.5 * shot, 1), (0.5 * shot, -1)):
        count = rng.poisson(rate_hz * duration_s)
        pixel = np.repeat(np.arange(len(count)), count)
        time_s = rng.uniform(start_s, end_s, len(pixel))
        parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
    return Events.gathered(parts)


def apply_refractory_period(events: Events, refractory_s: float) -> Events:
    """The events, given in order of time, that find their pixel awake again after its last one."""
    if refractory_s <= 0.0 or len(events.pixel) == 0:
        return events
    order = stable_order(events.pixel)
    pixel, time_s = events.pixel[order], events.time_s[order]
    soon = (np.diff(pixel) == 0) & (np.diff(time_s) < refractory_s)
    hasty: NDArray[np.bool_] = np.zeros(int(pixel[-1]) + 1, np.bool_)
    hasty[pixel[1:][soon]] = True
    # Most pixels never report twice so soon, and keep all they have.
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
    return events.taken(kept)
