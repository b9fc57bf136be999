"""Arrows, words and symbols painted on a road, as convex polygons.

Outlines are in the reader's frame: X along the lane in the direction of travel from the foot of the
sign, Y to the left of its middle. Sources: letters of at least 1.8 m (MUTCD 2009, 3B.20); hatching
of blocked areas at 45 degrees in bars of 0.25 or 0.50 m (Austria, Bodenmarkierungsverordnung).
Arrows of 5 m, letters of 2.4 m and all shapes are assumed, within a fifth of European sizes.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.patches import Array

ARROWS = (
    "straight", "left", "right", "straight_left", "straight_right", "left_right",
)  # fmt: skip
ARROW_M = 5.0
LETTER_M, STROKE_M = 2.4, 0.3
_SHAFT_M, _HEAD_M = 0.15, (0.75, 1.5)
_STROKES: dict[str, str] = {
    "A": "00-06 06-28 28-46 46-40 03-43",
    "B": "00-08 08-38 38-47 47-45 45-34 34-04 34-43 43-41 41-30 30-00",
    "C": "41-30 30-10 10-01 01-07 07-18 18-38 38-47", "D": "00-08 08-28 28-46 46-42 42-20 20-00",
    "E": "40-00 00-08 08-48 04-34", "F": "00-08 08-48 04-34",
    "G": "24-44 44-41 41-30 30-10 10-01 01-07 07-18 18-38 38-47", "H": "00-08 40-48 04-44",
    "I": "20-28", "K": "00-08 04-48 04-40", "L": "40-00 00-08", "M": "00-08 08-24 24-48 48-40",
    "N": "00-08 08-40 40-48", "O": "01-07 07-18 18-38 38-47 47-41 41-30 30-10 10-01",
    "P": "00-08 08-38 38-47 47-45 45-34 34-04", "R": "00-08 08-38 38-47 47-45 45-34 34-04 24-40",
    "S": "01-10 10-30 30-41 41-43 43-34 34-14 14-05 05-07 07-18 18-38 38-47", "T": "20-28 08-48",
    "U": "08-01 01-10 10-30 30-41 41-48", "W": "08-10 10-24 24-30 30-48", "X": "00-48 08-40",
    "Z": "08-48 48-00 00-40", "0": "01-07 07-18 18-38 38-47 47-41 41-30 30-10 10-01",
    "1": "20-28 28-06", "2": "40-00 00-45 45-47 47-38 38-18 18-07",
    "3": "01-10 10-30 30-41 41-43 43-34 34-14 34-45 45-47 47-38 38-18 18-07",
    "4": "30-38 38-02 02-42", "5": "01-10 10-30 30-41 41-44 44-35 35-05 05-08 08-48",
    "6": "47-38 38-18 18-07 07-01 01-10 10-30 30-41 41-43 43-34 34-04", "7": "10-48 48-08",
    "8": "14-05 05-07 07-18 18-38 38-47 47-45 45-34 34-14 14-03 03-01 01-10 10-30 30-41 41-43"
    " 43-34",
    "9": "01-10 10-30 30-41 41-47 47-38 38-18 18-07 07-05 05-14 14-44",
}  # fmt: skip
"""Strokes of a letter: from and to, each a column 0 to 4 and a row 0 to 8 from its foot."""
LETTERS = frozenset(_STROKES)


def arrow(word: str) -> list[Array]:
    """Polygons [n, 2] of an arrow ``ARROW_M`` long.

    Raises:
        AssetError: the word is none of ``ARROWS``.
    """
    check_option("road_marking", "arrow", word, ARROWS)
    ways = word.split("_")
    width, length = _HEAD_M
    made: list[Array] = []
    top = ARROW_M - length if "straight" in ways else 0.55 * ARROW_M
    made.append(_box((0.0, -0.5 * _SHAFT_M), (top, 0.5 * _SHAFT_M)))
    if "straight" in ways:
        made.append(np.array([[top, -0.5 * width], [ARROW_M, 0.0], [top, 0.5 * width]]))
    for way, side in (("left", 1.0), ("right", -1.0)):
        if way in ways:
            start = 0.3 * ARROW_M if "straight" in ways else 0.5 * ARROW_M
            made += _turning(start, side)
    return made


def _turning(start_m: float, side: float) -> Iterator[Array]:
    """The branch of an arrow that points to one side: a bent shaft and a head."""
    path = [(start_m, 0.0), (start_m + 0.75, 0.09), (start_m + 1.15, 0.27), (start_m + 1.4, 0.5)]
    for (x0, y0), (x1, y1) in pairwise(path):
        yield _stroke((x0, side * y0), (x1, side * y1), 1.6 * _SHAFT_M)
    head = np.array([[0.7, 0.46], [2.3, 0.46], [1.75, 1.2]]) + np.array([start_m, 0.0])
    yield _wind(head * np.array([1.0, side]))


def letter_polygons(text: str, width_m: float) -> list[list[Array]]:
    """Polygons of each letter of a word as wide as the lane allows, read by drivers from its foot.

    Args:
        text: Letters and digits.
        width_m: Largest width of the word.

    Raises:
        AssetError: a letter is unknown.
    """
    for letter in text:
        check_option("road_marking", "text", letter, _STROKES)
    pitch = min(0.85, width_m / max(1, len(text)))
    cell, row = (pitch - min(0.22, 0.28 * pitch)) / 4.0, LETTER_M / 8.0
    thick = min(0.13, 0.9 * cell)
    made = []
    for k, letter in enumerate(text):
        strokes = []
        right = (0.5 * (len(text) - 1) - k) * pitch
        for stroke in _STROKES[letter].split():
            (c0, r0), (c1, r1) = ((int(end[0]), int(end[1])) for end in stroke.split("-"))
            ends = ((r0 * row, right + (2 - c0) * cell), (r1 * row, right + (2 - c1) * cell))
            strokes.append(_letter_stroke(ends[0], ends[1], thick))
        made.append(strokes)
    return made


def bicycle() -> list[Array]:
    """Polygons of a bicycle 1.0 m wide and 1.65 m long, wheels side by side."""
    made: list[Array] = []
    wheel, stretch = 0.21, 1.55
    hubs = ((0.0, 0.28), (0.0, -0.28))
    for _, y in hubs:
        turn = 2.0 * math.pi * np.arange(13) / 12.0
        rim = np.stack([stretch * (wheel + wheel * np.cos(turn)), y + wheel * np.sin(turn)], axis=1)
        inner = np.stack(
            [stretch * (wheel + 0.72 * wheel * np.cos(turn)), y + 0.72 * wheel * np.sin(turn)],
            axis=1,
        )
        made += [
            np.stack([rim[k], rim[k + 1], inner[k + 1], inner[k]]) for k in range(len(rim) - 1)
        ]
    foot, seat, head = (0.33, 0.02), (0.78, 0.1), (0.78, -0.2)
    frame = (
        ((0.33, 0.28), foot), (foot, head), (head, seat), (seat, foot), (seat, (0.33, 0.28)),
        ((0.33, -0.28), (0.98, -0.14)), ((0.98, -0.14), (0.98, -0.28)),
        ((0.86, 0.2), (0.86, 0.02)),
    )  # fmt: skip
    made += [_stroke(a, b, 0.06) for a, b in frame]
    return made


def hatching(length_m: float, width_m: float, bar_m: float = 0.5) -> list[Array]:
    """Bars at 45 degrees across a rectangle from the origin, as wide as the gaps between them."""
    made = []
    step = 2.0 * bar_m * math.sqrt(2.0)
    low, high = -0.5 * width_m, 0.5 * width_m
    for k in range(math.ceil((length_m + width_m) / step)):
        x = k * step - width_m
        bar = np.array([[x, low], [x + 0.5 * step, low],
                        [x + 0.5 * step + width_m, high], [x + width_m, high]])  # fmt: skip
        for clipped in (clip_convex(bar, 0, 0.0, length_m),):
            if len(clipped) > 2:
                made.append(clipped)
    return made


def clip_convex(polygon: Array, axis: int, low: float, high: float) -> Array:
    """The part of a convex polygon [n, 2] between two values of a coordinate; may be empty."""
    for limit, sign in ((low, 1.0), (high, -1.0)):
        if len(polygon) == 0:
            break
        away = sign * (polygon[:, axis] - limit)
        kept: list[Array] = []
        for k in range(len(polygon)):
            j = (k + 1) % len(polygon)
            if away[k] >= 0.0:
                kept.append(polygon[k])
            if (away[k] < 0.0) != (away[j] < 0.0):
                share = away[k] / (away[k] - away[j])
                kept.append(polygon[k] + share * (polygon[j] - polygon[k]))
        polygon = np.array(kept).reshape(-1, 2)
    return polygon


def split_convex(polygon: Array, axis: int, at: Sequence[float]) -> list[Array]:
    """Parts of a convex polygon between neighbouring values, which ascend."""
    limits = (-math.inf, *at, math.inf)
    low, high = float(polygon[:, axis].min()), float(polygon[:, axis].max())
    parts = []
    for a, b in pairwise(limits):
        if b > low + 1e-6 and a < high - 1e-6:
            part = clip_convex(polygon, axis, max(a, low), min(b, high))
            if len(part) > 2:
                parts.append(part)
    return parts


def _box(low: tuple[float, float], high: tuple[float, float]) -> Array:
    return np.array([low, (high[0], low[1]), high, (low[0], high[1])])


def _stroke(a: tuple[float, float], b: tuple[float, float], width_m: float) -> Array:
    """A bar between two points, counter-clockwise."""
    start, end = np.array(a), np.array(b)
    along = (end - start) / math.hypot(*(end - start))
    across = 0.5 * width_m * np.array([-along[1], along[0]])
    longer = 0.35 * width_m * along
    return np.stack(
        [start - longer - across, end + longer - across, end + longer + across,
         start - longer + across]
    )  # fmt: skip


def _letter_stroke(a: tuple[float, float], b: tuple[float, float], width_m: float) -> Array:
    """A bar whose thickness grows along the lane as the letter is stretched."""
    stretch = STROKE_M / 0.13
    bar = _stroke((a[0] / stretch, a[1]), (b[0] / stretch, b[1]), width_m)
    stretched: Array = bar * np.array([stretch, 1.0])
    return stretched


def _wind(polygon: Array) -> Array:
    """The polygon counter-clockwise."""
    x, y = polygon.T
    turned = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() < 0.0
    return polygon[::-1] if turned else polygon
