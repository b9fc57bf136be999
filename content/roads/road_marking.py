"""One sign painted on a road: an arrow, a word, a bicycle, a blocked area, a line across a lane."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural.patches import Array
from gen_data.content.roads import road, road_materials
from gen_data.content.roads.deck import PAINT_LIFT_M
from gen_data.content.roads.painted_signs import (
    ARROWS,
    LETTER_M,
    STROKE_M,
    arrow,
    bicycle,
    hatching,
    letter_polygons,
)
from gen_data.core.writing import NO_LANGUAGE, Writing
from gen_data.roads.cross_section import RoadShape

SIGNS = (*ARROWS, "word", "bicycle", "blocked_area", "stop_line", "give_way", "zigzag")
_LIFT_M = PAINT_LIFT_M + 0.0012
_EDGE_M = 0.12


def road_marking(
    *,
    sign: str = "straight",
    text: str = "_STOP",
    station_m: float = 20.0,
    across_m: float = 0.0,
    turned: float = 0.0,
    area_m: float = 8.0,
    width_m: float = 2.8,
    **others: Any,
) -> Solid:
    """A sign in the road's frame, over its other lines.

    Args:
        sign: A word of ``SIGNS``.
        text: Letters and digits of a ``word``, after an underscore.
        station_m: Foot of the sign, along the road.
        across_m: Its middle, to the left of the road's middle.
        turned: Whether it is read against the road's direction.
        area_m: Length of blocked areas and zigzag lines.
        width_m: Width of these and of lines across the lane, and the largest width of a word.
        others: Fields of ``StreetLook`` and of ``RoadShape``, as for the road.

    Raises:
        AssetError: the sign or a letter of the text is unknown.
    """
    check_option("road_marking", "sign", sign, SIGNS)
    look, shape = road_materials.split_look(others)
    profile = RoadShape(**shape)
    deck = road.make_deck(profile, look)
    polygons = list(_polygons(sign, text.removeprefix("_"), area_m, width_m))
    patches = deck.paint(polygons, (station_m, across_m), turned > 0.0, lift_m=_LIFT_M)
    points = np.concatenate([patch.corners_m.reshape(-1, 3) for patch in patches])
    low, high = points.min(axis=0), points.max(axis=0)
    ground = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                       for z in (low[2] - 0.02, high[2])])  # fmt: skip
    return road_materials.make_street_solid(patches, look, [ground])


def road_marking_writing(
    *,
    sign: str = "straight",
    text: str = "_STOP",
    station_m: float = 20.0,
    across_m: float = 0.0,
    turned: float = 0.0,
    width_m: float = 2.8,
    **others: Any,
) -> tuple[Writing, ...]:
    """A word, in the frame of the mesh; other signs have none. Arguments as above."""
    word = text.removeprefix("_")
    if sign != "word" or not word:
        return ()
    others.pop("area_m", None)
    look, shape = road_materials.split_look(others)
    deck = road.make_deck(RoadShape(**shape), look)
    corners = np.array([station_m, across_m]) + (-1.0 if turned > 0.0 else 1.0) * np.array(
        [_corners(letter) for letter in letter_polygons(word, width_m)]
    )
    points_m = deck.at(corners[..., 0].ravel(), corners[..., 1].ravel(), _LIFT_M)
    language = "en" if len(word) > 1 and word.isalpha() else NO_LANGUAGE
    return (Writing(word, language, points_m.reshape(-1, 4, 3), STROKE_M / LETTER_M),)


def _corners(polygons: Sequence[Array]) -> Array:
    """Corners [4, 2] of a letter in the reader's frame, from its top left clockwise."""
    points = np.concatenate(polygons)
    (low, right), (high, left) = points.min(axis=0), points.max(axis=0)
    return np.array([(high, left), (high, right), (low, right), (low, left)])


def _polygons(sign: str, text: str, length_m: float, width_m: float) -> Iterator[Array]:
    """Polygons of a sign in the reader's frame, from its foot."""
    half = 0.5 * width_m
    if sign in ARROWS:
        yield from arrow(sign)
    elif sign == "word":
        for letter in letter_polygons(text, width_m):
            yield from letter
    elif sign == "bicycle":
        yield from bicycle()
    elif sign == "stop_line":
        yield _box(0.0, 0.5, half)
    elif sign == "give_way":
        # A row of triangles that point at the driver (Vienna Convention, annex 2).
        count = max(1, math.floor(width_m / 0.75))
        for k in range(count):
            middle = (k + 0.5) * width_m / count - half
            yield np.array([[0.0, middle], [0.6, middle - 0.25], [0.6, middle + 0.25]])
    elif sign == "blocked_area":
        yield from hatching(length_m, width_m - _EDGE_M)
        for side in (half, -half):
            yield _box(0.0, length_m, 0.5 * _EDGE_M) + np.array([0.0, side])
        for end in (0.0, length_m - _EDGE_M):
            yield _box(end, end + _EDGE_M, half)
    else:
        # Zigzag lines where nobody may stop: at bus stops (StVO, sign 299).
        turns = max(2, round(length_m / 2.0))
        at = [(length_m * k / turns, half if k % 2 else -half) for k in range(turns + 1)]
        for (x0, y0), (x1, y1) in pairwise(at):
            along = np.array([x1 - x0, y1 - y0]) / math.hypot(x1 - x0, y1 - y0)
            normal = 0.5 * _EDGE_M * np.array([-along[1], along[0]])
            start, end_ = np.array([x0, y0]), np.array([x1, y1])
            yield np.stack([start - normal, end_ - normal, end_ + normal, start + normal])


def _box(x0: float, x1: float, half: float) -> Array:
    return np.array([[x0, -half], [x1, -half], [x1, half], [x0, half]])
